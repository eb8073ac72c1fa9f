//! What is heard of another instance, and of the producer after the other instance was lost.

use std::time::{Duration, Instant};

use isotherm_correction::operation::State;
use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, Revision};
use isotherm_protocol::journal::{JournalEntry, JournalEvent};
use isotherm_protocol::raw::GyroBatch;
use isotherm_protocol::stream::UnitStream;

use super::{Footing, Standing};
use crate::control::Notice;
use crate::receive::fault::FaultKind;
use crate::receive::unit::UnitActor;

/// How long after the other instance is lost what the producer sent before may still come.
const LATE: Duration = Duration::from_millis(50);
/// How long two speak at once before that is an alarm.
const DOUBLED: Duration = Duration::from_secs(1);

impl UnitActor {
    /// The producer is heard after the other instance was lost. Where no tick is missing an isolated unit speaks on, as soon as nobody
    /// else is heard; what is missing here another instance may have published.
    pub(crate) fn hear_again(&mut self, frame: &[u8], now: Instant) {
        self.speech.uncertain = self.speech.lost_at.is_some_and(|since| now < since + LATE);
        let first = codec::decode::<GyroBatch>(frame).ok().and_then(|batch| batch.ticks.into_iter().next());
        let Some(first) = first else { return };
        let last = self.stream.unit().newest_tick().map(|(sequence, _)| sequence);
        let same = first.series == self.stream.incoming_series();
        let lacks = same && last.is_some_and(|last| first.sequence > last.saturating_add(1));
        match &mut self.speech.following {
            None if lacks => self.follow(now, Footing::Nothing),
            Some(following) if following.isolated => {
                (following.isolated, following.listens) = (false, now);
                (following.doubt, following.intact) = (!lacks, !lacks);
            }
            _ => {}
        }
    }

    /// Another instance has published a frame of the unit.
    pub(crate) fn hear(&mut self, frame: &[u8], now: Instant, standing: &Standing) {
        let Ok(batch) = codec::decode::<CorrectedBatch>(frame) else { return };
        if let Some(following) = &mut self.speech.following {
            following.kept.heard(batch, now);
            // It speaks, and what it knows is what counts.
            (following.doubt, following.isolated) = (false, false);
            return;
        }
        if standing.active {
            return;
        }
        let Some(tick) = batch.ticks.last() else { return };
        let unit = self.stream.unit();
        let Some(own) = unit.observation().map(|seen| seen.end_time) else {
            // Without a calibration there is nothing to keep up with.
            if standing.yields && standing.alone_since.is_none() {
                self.follow(now, Footing::Nothing);
            } else if unit.newest_tick().is_some() {
                self.note_doubled(now);
            }
            return;
        };
        let behind_ns = tick.end_time.as_ns().saturating_sub(own.as_ns());
        let limit_ns = i64::try_from(standing.takeover.as_nanos()).unwrap_or(i64::MAX);
        let (ahead, keeps_up) = (behind_ns > limit_ns, behind_ns >= -limit_ns);
        let state = self.stream.unit().state();
        if !matches!(state, State::RunningWithReversal | State::RunningWithoutReversal) {
            // Silent on purpose: the other is told.
            self.speech.memory_due |= standing.alone_since.is_none();
        } else if standing.alone_since.is_none() && (ahead || (standing.yields && keeps_up)) {
            tracing::info!(unit = %self.stream.id(), sequence = tick.sequence, "another instance publishes: standby");
            let footing = if self.speech.uncertain { Footing::Nothing } else { Footing::All };
            self.follow(now, footing);
            if let Some(following) = &mut self.speech.following {
                following.kept.heard(batch, now);
            }
        } else if keeps_up {
            // Until one of the two has yielded.
            self.note_doubled(now);
        }
    }

    /// Another instance publishes what this one publishes.
    fn note_doubled(&mut self, now: Instant) {
        let first = self.speech.doubled.filter(|(_, last)| now.saturating_duration_since(*last) < DOUBLED);
        self.speech.doubled = Some((first.map_or(now, |(first, _)| first), now));
    }

    /// Takes an entry of another instance's journal, or its memory.
    pub(crate) fn hear_journal(&mut self, entry: JournalEntry, now: Instant, standing: &Standing) {
        if matches!(entry.event, JournalEvent::Commanded { accepted: true, .. }) {
            self.is_commanded_elsewhere();
        }
        // Another instance speaks too, and goes before this one.
        if matches!(entry.event, JournalEvent::Memory { .. }) && standing.yields && self.speaks() {
            let footing = if self.does_as(&entry.event) { Footing::All } else { Footing::Nothing };
            self.follow(now, footing);
        }
        let Some(following) = &mut self.speech.following else {
            self.adopt(entry);
            return;
        };
        let ns = following.ns(now);
        let order = matches!(
            entry.event,
            JournalEvent::Changed { .. } | JournalEvent::Commanded { accepted: true, .. }
        );
        let order = order.then(|| entry.clone());
        // It publishes what it has made until its memory has come, should the other be gone by then.
        let at_once =
            following.intact && !following.follower.has_joined() && !following.follower.has_memory();
        let documents = match &entry.event {
            JournalEvent::Memory { document, pending, .. } => Some([document, pending].map(Clone::clone)),
            _ => None,
        };
        if following.follower.entry(entry, ns) {
            if let Some(documents) = documents {
                following.documents = documents.into_iter().flatten().collect();
            }
            if let Some(order) = order {
                // With the memory it is done once more, in its place.
                let done = at_once && self.stream.carry_out(&order.event).is_ok();
                following.note_order(order);
                if done {
                    self.look();
                }
            }
        }
        self.catch_up(now);
    }

    /// Whether the unit is in the state that another instance's memory says it is in. Where it is not, that instance may be silent
    /// on purpose: nothing is said in its place before its memory is taken.
    fn does_as(&self, memory: &JournalEvent) -> bool {
        let mut other = UnitStream::new(self.stream.id().clone(), UnitSettings::default());
        other.carry_out(memory).is_ok() && other.unit().state() == self.stream.unit().state()
    }

    /// Another instance that spoke too took an order: it holds here, as this one goes on.
    fn adopt(&mut self, entry: JournalEntry) {
        let given = |revision| self.stream.given(|_| None).any(|event| is_of(&event, revision));
        let is_new = match &entry.event {
            JournalEvent::Changed { revision, .. } => !given(*revision),
            JournalEvent::Commanded { accepted, .. } => *accepted,
            _ => false,
        };
        if !is_new {
            return;
        }
        let (unit, name, before) = (self.stream.id().clone(), entry.event.name(), self.stream.unit().state());
        if let Err(error) = self.stream.carry_out(&entry.event) {
            tracing::warn!(%unit, instance = entry.instance, "an order of another instance ({name}) cannot be \
                carried out here: {error}");
            return;
        }
        // A command that changed nothing is not told again, or two that speak would tell it to each other for ever.
        let is_change = matches!(entry.event, JournalEvent::Changed { .. });
        if is_change || self.stream.unit().state() != before {
            tracing::info!(%unit, instance = entry.instance, "an order of another instance ({name}) holds here too");
            self.journal(|_| entry.event.clone());
            self.notices.untold.push_back(Notice::Followed(Box::new(entry)));
        }
        self.status_due = true;
        self.look();
    }

    /// Whether two speak for so long that it is an alarm.
    pub(super) fn two_speak(&mut self, now: Instant) -> Option<(FaultKind, String)> {
        let (first, last) = self.speech.doubled?;
        let lasts = now.saturating_duration_since(last) < DOUBLED;
        if !lasts {
            (self.speech.doubled, self.speech.two_told) = (None, false);
            return None;
        }
        let long = last.saturating_duration_since(first) >= DOUBLED;
        (long && !std::mem::replace(&mut self.speech.two_told, true)).then(|| {
            let words =
                format!("unit {}: another service publishes its corrected ticks too", self.stream.id());
            (FaultKind::TwoSpeak, words)
        })
    }
}

/// Whether an event gave the unit that revision.
pub(super) fn is_of(event: &JournalEvent, given: Revision) -> bool {
    matches!(event, JournalEvent::Changed { revision, .. } if *revision == given)
}
