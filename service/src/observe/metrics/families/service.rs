//! Metrics of the service as a whole.

use isotherm_protocol::service_status::FolderState;

use super::Family;
use crate::receive::fault::FaultKind;

/// All of them.
pub(super) const FAMILIES: &[Family] = &[
    Family::gauge(
        ("isotherm_build_info", ""),
        &["version", "instance_id"],
        "Always 1; version and Zenoh id of the service",
        |look, out| out.whole(&[env!("CARGO_PKG_VERSION"), &look.instance], 1),
    ),
    Family::gauge(("isotherm_uptime", "seconds"), &[], "Time since the service started", |look, out| {
        out.gauge(&[], look.uptime_s)
    }),
    Family::gauge(("isotherm_healthy", ""), &[], "1 if /healthz answers 200, otherwise 0", |look, out| {
        out.flag(&[], look.healthy)
    }),
    Family::gauge(("isotherm_units", ""), &[], "Units that have appeared", |look, out| {
        out.whole(&[], look.units.len() as u64)
    }),
    Family::gauge(
        ("isotherm_instances", ""),
        &[],
        "Service instances for the same units, this one included",
        |look, out| out.whole(&[], look.instances),
    ),
    Family::counter(
        ("isotherm_pair_alarms", ""),
        &["kind"],
        "Ticks whose bits differ between instances, units published by two services: alarm on any",
        |look, out| {
            [FaultKind::OtherBits, FaultKind::TwoSpeak].into_iter().try_for_each(|kind| {
                let fault = look.faults.iter().find(|fault| fault.kind == kind.name());
                out.counter(&[kind.name()], fault.map_or(0, |fault| fault.count))
            })
        },
    ),
    Family::counter(
        ("isotherm_refused_messages", ""),
        &["kind"],
        "Messages refused that belong to no known unit",
        |look, out| {
            let mut kinds = FaultKind::ALL.iter().filter(|kind| is_refusal(**kind)).map(|kind| kind.name());
            kinds.try_for_each(|kind| {
                let fault = look.faults.iter().find(|fault| fault.kind == kind);
                out.counter(&[kind], fault.map_or(0, |fault| fault.count))
            })
        },
    ),
    Family::counter(
        ("isotherm_swaps", ""),
        &["outcome"],
        "Swaps accepted and refused, of all units, unknown ones included; a first document from a file is not counted",
        |look, out| {
            out.counter(&["accepted"], look.posted.accepted)?;
            out.counter(&["refused"], look.posted.refused)
        },
    ),
    Family::counter(
        ("isotherm_log_lines_dropped", ""),
        &[],
        "Log lines dropped because stderr was blocked: a stopped terminal, a full pipe",
        |look, out| out.counter(&[], look.log_lines_dropped),
    ),
    Family::counter(
        ("isotherm_late_receipts", ""),
        &[],
        "Receipts that took over 1 s: meanwhile ticks are dropped for that subscriber; the status names it",
        |look, out| out.counter(&[], look.late_receipts),
    ),
    Family::gauge(
        ("isotherm_calibration_folder_readable", ""),
        &[],
        "1 if the folder of calibration documents can be read; absent without one",
        |look, out| match &look.posted.folder {
            Some(folder) => out.flag(&[], folder.state != FolderState::Gone),
            None => Ok(()),
        },
    ),
    Family::gauge(
        ("isotherm_bad_documents", ""),
        &[],
        "Refused documents of that folder, at most 64",
        |look, out| out.whole(&[], look.posted.bad_documents.len() as u64),
    ),
    Family::gauge(
        ("isotherm_state_folder_writable", ""),
        &[],
        "1 if the state folder can be written, 0 if every swap is refused; absent without one",
        |look, out| look.state_folder_writable.map_or(Ok(()), |writable| out.flag(&[], writable)),
    ),
    Family::gauge(
        ("isotherm_audit_entries", ""),
        &[],
        "Number of the last entry of the audit file; absent without a state folder",
        |look, out| look.posted.store.as_ref().map_or(Ok(()), |store| out.whole(&[], store.audit_entries)),
    ),
];

/// Whether it is a message that was refused; the others are a unit's own.
fn is_refusal(kind: FaultKind) -> bool {
    use FaultKind as K;

    !matches!(kind, K::Unpublished | K::Alarm | K::OtherBits | K::TwoSpeak | K::TwoProducers)
}
