//! Metrics of the service as a whole.

use isotherm_protocol::service_status::FolderState;

use super::super::page::Type;
use super::Family;
use crate::receive::fault::FaultKind;

/// All of them.
pub(super) const FAMILIES: &[Family] = &[
    Family {
        name: "isotherm_build_info",
        unit: "",
        kind: Type::Gauge,
        labels: &["version", "instance_id"],
        help: "Always 1; version and Zenoh id of the service",
        samples: |look, out| out.whole(&[env!("CARGO_PKG_VERSION"), &look.instance], 1),
    },
    Family {
        name: "isotherm_uptime",
        unit: "seconds",
        kind: Type::Gauge,
        labels: &[],
        help: "Time since the service started",
        samples: |look, out| out.gauge(&[], look.uptime_s),
    },
    Family {
        name: "isotherm_healthy",
        unit: "",
        kind: Type::Gauge,
        labels: &[],
        help: "1 if /healthz answers 200, otherwise 0",
        samples: |look, out| out.flag(&[], look.healthy),
    },
    Family {
        name: "isotherm_units",
        unit: "",
        kind: Type::Gauge,
        labels: &[],
        help: "Units that have appeared",
        samples: |look, out| out.whole(&[], look.units.len() as u64),
    },
    Family {
        name: "isotherm_instances",
        unit: "",
        kind: Type::Gauge,
        labels: &[],
        help: "Service instances for the same units, this one included",
        samples: |look, out| out.whole(&[], look.instances),
    },
    Family {
        name: "isotherm_pair_alarms",
        unit: "",
        kind: Type::Counter,
        labels: &["kind"],
        help: "Ticks whose bits differ between instances, units published by two services: alarm on any",
        samples: |look, out| {
            [FaultKind::OtherBits, FaultKind::TwoSpeak].into_iter().try_for_each(|kind| {
                let fault = look.faults.iter().find(|fault| fault.kind == kind.name());
                out.counter(&[kind.name()], fault.map_or(0, |fault| fault.count))
            })
        },
    },
    Family {
        name: "isotherm_refused_messages",
        unit: "",
        kind: Type::Counter,
        labels: &["kind"],
        help: "Messages refused that belong to no known unit",
        samples: |look, out| {
            let mut kinds = FaultKind::ALL.iter().filter(|kind| is_refusal(**kind)).map(|kind| kind.name());
            kinds.try_for_each(|kind| {
                let fault = look.faults.iter().find(|fault| fault.kind == kind);
                out.counter(&[kind], fault.map_or(0, |fault| fault.count))
            })
        },
    },
    Family {
        name: "isotherm_swaps",
        unit: "",
        kind: Type::Counter,
        labels: &["outcome"],
        help: "Swaps accepted and refused, of all units, unknown ones included; a first document from a file is not counted",
        samples: |look, out| {
            out.counter(&["accepted"], look.posted.accepted)?;
            out.counter(&["refused"], look.posted.refused)
        },
    },
    Family {
        name: "isotherm_log_lines_dropped",
        unit: "",
        kind: Type::Counter,
        labels: &[],
        help: "Log lines dropped because stderr was blocked: a stopped terminal, a full pipe",
        samples: |look, out| out.counter(&[], look.log_lines_dropped),
    },
    Family {
        name: "isotherm_calibration_folder_readable",
        unit: "",
        kind: Type::Gauge,
        labels: &[],
        help: "1 if the folder of calibration documents can be read; absent without one",
        samples: |look, out| match &look.posted.folder {
            Some(folder) => out.flag(&[], folder.state != FolderState::Gone),
            None => Ok(()),
        },
    },
    Family {
        name: "isotherm_bad_documents",
        unit: "",
        kind: Type::Gauge,
        labels: &[],
        help: "Refused documents of that folder, at most 64",
        samples: |look, out| out.whole(&[], look.posted.bad_documents.len() as u64),
    },
    Family {
        name: "isotherm_state_folder_writable",
        unit: "",
        kind: Type::Gauge,
        labels: &[],
        help: "1 if the state folder can be written, 0 if every swap is refused; absent without one",
        samples: |look, out| look.state_folder_writable.map_or(Ok(()), |writable| out.flag(&[], writable)),
    },
    Family {
        name: "isotherm_audit_entries",
        unit: "",
        kind: Type::Gauge,
        labels: &[],
        help: "Number of the last entry of the audit file; absent without a state folder",
        samples: |look, out| {
            look.posted.store.as_ref().map_or(Ok(()), |store| out.whole(&[], store.audit_entries))
        },
    },
];

/// Whether it is a message that was refused; the others are a unit's own.
fn is_refusal(kind: FaultKind) -> bool {
    use FaultKind as K;

    !matches!(kind, K::Unpublished | K::Alarm | K::OtherBits | K::TwoSpeak | K::TwoProducers)
}
