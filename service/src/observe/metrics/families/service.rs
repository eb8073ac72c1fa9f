//! Metrics of the service itself.

use isotherm_protocol::service_status::FolderState;

use super::{Family, Sample, Source, Type, Value, each, families, known, one};
use crate::control::STATE_FOLDER;
use crate::observe::instance::LOG_LINES_DROPPED;
use crate::observe::metrics::source::Look;
use crate::observe::subscribers::BEHIND;
use crate::receive::fault::{FaultKind, of_kind};

families! { Service "isotherm_":
    Gauge "build_info" "" ["version", "instance_id"] "Always 1; version and Zenoh id of the service"
        |look| vec![Sample { labels: vec![env!("CARGO_PKG_VERSION"), &look.service.instance], value: Value::Whole(1) }];
    Gauge "uptime" "seconds" [] "Time since the service started"
        |look| one(look.service.uptime_s);
    Gauge "healthy" "" [] "1 if /healthz answers 200, otherwise 0"
        |look| one(look.healthy);
    Gauge "units" "" [] "Units that have appeared"
        |look| one(look.units.len() as u64);
    Gauge "instances" "" [] "Service instances for the same units, this one included"
        |look| one(look.instances);
    Counter "pair_alarms" "" ["kind"] "Ticks whose bits differ between instances, units published by two services: alarm on any"
        |look| faults(look, [FaultKind::OtherBits, FaultKind::TwoSpeak]);
    Counter "refused_messages" "" ["kind"] "Messages refused that belong to no known unit"
        |look| faults(look, FaultKind::ALL.iter().copied().filter(|kind| kind.is_refusal()));
    Counter "swaps" "" ["outcome"] "Swaps accepted and refused, of all units, unknown ones included; dry runs and a first document from a file are not counted"
        |look| each([("accepted", look.service.swaps_accepted), ("refused", look.service.swaps_refused)]);
    Counter "log_lines_dropped" "" [] "Log lines dropped because stderr was blocked: a stopped terminal, a full pipe"
        |look| one(look.count(LOG_LINES_DROPPED));
    Counter "late_receipts" "" [] "Receipts that took over 1 s: meanwhile ticks are dropped for that subscriber; the status names it"
        |look| one(look.count(BEHIND));
    Gauge "calibration_folder_readable" "" [] "1 if the folder of calibration documents can be read; absent without one"
        |look| known(look.service.calibrations.as_ref().map(|folder| folder.state != FolderState::Gone));
    Gauge "bad_documents" "" [] "Refused documents of that folder, at most 64"
        |look| one(look.service.bad_documents.len() as u64);
    Gauge "state_folder_writable" "" [] "1 if the state folder can be written, 0 if every swap is refused; absent without one"
        |look| known(look.service.store.as_ref().map(|_| of_kind(&look.service.faults, STATE_FOLDER).is_none()));
    Gauge "audit_entries" "" [] "Number of the last entry of the audit file; absent without a state folder"
        |look| known(look.service.store.as_ref().map(|store| store.audit_entries));
}

/// How often messages were refused, by reason.
fn faults(look: &Look, kinds: impl IntoIterator<Item = FaultKind>) -> Vec<Sample<'_>> {
    each(kinds.into_iter().map(|kind| (kind.name(), look.count(kind.name()))))
}
