//! Back to an earlier revision: a swap like any other, with a document that was accepted before.

use isotherm_protocol::control::{Schedule, SwapOptions, SwapOutcome, SwapReply};
use isotherm_protocol::history::Source;
use isotherm_protocol::key::UnitId;

use super::order::Order;
use super::worker::Worker;
use isotherm_document::unplaced;

impl Worker {
    /// Goes back to the calibration before the present one, or to a stated revision.
    pub(super) fn roll_back(&mut self, unit: &UnitId, to: Option<u64>, options: SwapOptions) -> SwapReply {
        let set = match to {
            Some(revision) => self.store.by_revision(unit, revision),
            None => self.store.previous(unit),
        };
        let Some(set) = set.cloned() else {
            return self.no_rollback(unit, self.why_no_rollback(unit, to));
        };
        let bytes = match self.store.document(&set.digest) {
            Ok(Some(bytes)) => bytes,
            Ok(None) => {
                let message = format!("the document of revision {} is no longer kept", set.revision);
                return self.no_rollback(unit, message);
            }
            Err(error) => return self.no_rollback(unit, error.to_string()),
        };
        // It was accepted for this unit once, whatever serial it names.
        let options = SwapOptions { any_serial: true, ..options };
        self.swap(&Order {
            unit: Some(unit.clone()),
            bytes: &bytes,
            name: &self.store.document_file(&set.digest).map_or_else(
                || format!("document of revision {}", set.revision),
                |file| file.display().to_string(),
            ),
            source: Source::Rollback { to: set.revision },
            overlay: set.overlay,
            read: None,
            options,
        })
    }

    /// Why there is nothing to go back to, and what there is.
    fn why_no_rollback(&self, unit: &UnitId, to: Option<u64>) -> String {
        let revisions: Vec<_> =
            self.store.good_sets(unit).take(8).map(|set| set.revision.to_string()).collect();
        match to {
            _ if revisions.is_empty() => format!("no document was ever accepted for unit {unit}"),
            Some(to) => {
                format!("unit {unit} has no revision {to}; its latest are {}", revisions.join(", "))
            }
            None if self
                .store
                .good_sets(unit)
                .zip(self.store.good_sets(unit).skip(1))
                .all(|(a, b)| a.corrects_as(b)) =>
            {
                format!("unit {unit} has had no other document than the present one")
            }
            None => format!(
                "unit {unit} has no older revision to roll back to: to go forward, give a revision; its latest are {}",
                revisions.join(", ")
            ),
        }
    }

    fn no_rollback(&self, unit: &UnitId, message: String) -> SwapReply {
        let active = self.records.get(unit).and_then(|record| record.active.as_ref());
        let written = active.and_then(|active| active.written.as_ref());
        SwapReply {
            outcome: SwapOutcome::Refused,
            unit: unit.to_string(),
            revision: active.map_or(0, |active| active.revision),
            digest: written.map(|written| written.digest.to_string()).unwrap_or_default(),
            proposed: None,
            schedule: Schedule::NextTick,
            slew_s: 0.0,
            // No matter of a file.
            problems: vec![unplaced(None, message)],
            warnings: Vec::new(),
            difference: None,
        }
    }
}
