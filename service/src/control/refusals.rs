//! Refused documents: counted, told, written down once.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use isotherm_protocol::control::MAX_BY;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Problem;
use isotherm_protocol::history::{AuditEvent, MAX_PROBLEMS, Refusal, Source};
use isotherm_protocol::key::UnitId;

use super::decision::Decision;
use super::manager::Worker;
use super::request::Request;

/// Refusals that are remembered, so that the same one again is only counted.
const REMEMBERED: usize = 64;
/// Most refusals that are written down in a minute; beyond it they are counted.
const MOST_A_MINUTE: u32 = 1000;
const MINUTE: Duration = Duration::from_secs(60);

/// What makes two refusals the same.
type Same = (Option<UnitId>, Source, Digest);

/// Refusals so far.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    /// How many documents were refused.
    pub(super) count: u64,
    last: VecDeque<Same>,
    minute: Option<(Instant, u32)>,
}

impl Refusals {
    /// Counts one; whether it is to be written down.
    fn is_news(&mut self, now: Instant, same: Same) -> bool {
        if self.last.contains(&same) {
            return false;
        }
        let (start, written) = self.minute.filter(|(start, _)| now - *start < MINUTE).unwrap_or((now, 0));
        if written == MOST_A_MINUTE {
            return false;
        }
        self.minute = Some((start, written + 1));
        if self.last.len() == REMEMBERED {
            self.last.pop_front();
        }
        self.last.push_back(same);
        true
    }

    /// A document was accepted: whatever is refused from now on is refused against another one.
    pub(super) fn forget(&mut self, unit: &UnitId) {
        self.last.retain(|(refused, _, _)| refused.as_ref() != Some(unit));
    }
}

impl Worker {
    /// Counts, tells and writes down that a document was refused.
    pub(super) fn note_refusal(&mut self, request: &Request, bytes: &[u8], decision: &Decision) {
        let Decision { unit, problems, .. } = decision;
        let unit = unit.as_ref();
        // A dry run changes nothing, and nobody is to be woken by one.
        if request.options.dry_run {
            return;
        }
        self.count_refusal(unit, problems.first());
        let digest = Digest::of(bytes);
        let same = (unit.cloned(), request.source.clone(), digest);
        if !self.refusals.is_news(Instant::now(), same) {
            return;
        }
        let shown = unit.map(ToString::to_string).unwrap_or_default();
        for problem in problems {
            tracing::error!(unit = shown, source = %request.source, "refused: {problem}");
        }
        // Told at every start, written down once.
        let at_start = matches!(request.source, Source::Start { .. });
        let before = request.source.file().and_then(|path| self.store.refused_in_folder(path));
        if at_start && before == Some(digest) {
            return;
        }
        let by: String = request.options.by.chars().take(MAX_BY).collect();
        self.note_refused(unit, &by, (request.source.clone(), digest, false), problems);
    }

    /// Writes down, once, that a file is refused because another one names its unit too.
    pub(super) fn note_rival(&mut self, unit: &UnitId, source: Source, digest: Digest, problem: &Problem) {
        let before = source.file().and_then(|path| self.store.rival_in_folder(path));
        let told = matches!(source, Source::Start { .. }) && before == Some(digest);
        if !told && self.refusals.is_news(Instant::now(), (Some(unit.clone()), source.clone(), digest)) {
            self.note_refused(Some(unit), "", (source, digest, true), std::slice::from_ref(problem));
        }
    }

    fn note_refused(
        &mut self,
        unit: Option<&UnitId>,
        by: &str,
        (source, digest, rival): (Source, Digest, bool),
        problems: &[Problem],
    ) {
        let count = problems.len() as u64;
        let problems = problems.iter().take(MAX_PROBLEMS).map(ToString::to_string).collect();
        let event = AuditEvent::Refused(Refusal { source, digest, problems, count, rival });
        self.note(unit, by, event, "the refusal");
    }

    /// Counts a refusal, for the status.
    pub(super) fn count_refusal(&mut self, unit: Option<&UnitId>, problem: Option<&Problem>) {
        self.refusals.count += 1;
        let Some(unit) = unit else { return };
        // A flood of strange serials must not fill the memory.
        if !self.records.contains_key(unit) && self.intake.present(unit).is_none() {
            return;
        }
        let record = self.records.entry(unit.clone()).or_default();
        record.swaps.refused += 1;
        record.swaps.last_refusal = problem.map(ToString::to_string);
        self.tell_account(unit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_refusal_again_is_no_news_until_something_was_accepted() {
        let mut refusals = Refusals::default();
        let now = Instant::now();
        let unit = UnitId::new("U").unwrap();
        let same = (Some(unit.clone()), Source::Bus, Digest([1; 32]));
        assert!(refusals.is_news(now, same.clone()));
        assert!(!refusals.is_news(now, same.clone()));
        refusals.forget(&unit);
        assert!(refusals.is_news(now, same));
    }

    #[test]
    fn a_flood_of_refusals_is_written_down_up_to_a_limit() {
        let mut refusals = Refusals::default();
        let now = Instant::now();
        let mut flood = |now| {
            let news = (0..3000_u32).filter(|i| {
                let mut digest = [0; 32];
                digest[..4].copy_from_slice(&i.to_be_bytes());
                refusals.is_news(now, (None, Source::Bus, Digest(digest)))
            });
            news.count()
        };
        assert_eq!(flood(now), 1000);
        assert_eq!(flood(now + MINUTE), 1000, "the next minute has room again");
    }
}
