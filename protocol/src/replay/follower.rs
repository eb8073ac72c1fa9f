//! A stream that stays, to the bit, what another service's is, while frames and journal come.
//!
//! Frames are given to the stream at once: whoever has to go on in the other's place has no time to catch up. An entry of the journal
//! that comes later than the frames behind its place takes the stream back to where it was before, by its memory, and frames and
//! entries are given again in the service's order ([`Sequencer`]).

use std::collections::VecDeque;
use std::sync::Arc;

use isotherm_correction::unit::UnitSettings;

use super::sequencer::LATE_NS;
use super::{Deed, Mark, Outline, Sequencer};
use crate::journal::{JournalEntry, JournalEvent};
use crate::key::{Input, RawStream, UnitId};
use crate::stream::{Heard, UnitStream};

/// How far apart the stream's own memories are taken (ns): an entry may be as late as that.
const APART_NS: u64 = 1_000_000_000;
/// The input by which it is known which frames came before a memory.
const GYRO: Input = Input::Raw(RawStream::Gyro);
/// How long an entry may wait for frames that the other service has heard (ns).
const LONGEST_WAIT_NS: u64 = 1_000_000_000;
/// Most frames that wait for a memory, and most that are kept between two; beyond them the oldest go, and the memory is asked for anew.
pub const MAX_WAITING: usize = 1 << 15;
/// Most entries that wait for a memory.
const MAX_ENTRIES: usize = 1024;

/// What the stream knew at some time.
#[derive(Debug)]
struct Anchor {
    /// As an entry of the other service's journal: the stream knows what that one knew.
    entry: JournalEntry,
    at_ns: u64,
    /// How many frames had come.
    frames: u64,
    /// How many corrected frames had been made.
    made: u64,
}

/// A frame that may have to be given again.
#[derive(Debug)]
struct Frame {
    input: Input,
    at_ns: u64,
    bytes: Box<[u8]>,
}

/// A stream that takes the place of the present one.
#[derive(Debug)]
pub struct Rebuilt {
    /// The stream.
    pub stream: UnitStream,
    /// How many of the corrected frames that were made before hold: those behind them are [`Self::frames`] now.
    pub before: u64,
    /// The corrected frames that it has made again, the oldest first.
    pub frames: Vec<Vec<u8>>,
    /// Whether frames and entries were those that the other service had, as far as is known.
    pub exact: bool,
}

/// Follows one unit at one other service.
#[derive(Debug)]
pub struct Follower {
    unit: UnitId,
    /// Memories of the stream, the oldest first; none before the other's memory is there.
    anchors: VecDeque<Anchor>,
    /// The memory that is to be gone on from.
    memory: Option<(JournalEntry, u64)>,
    frames: VecDeque<Frame>,
    /// How many frames came before the first of [`Self::frames`], as far as they were followed.
    gone: u64,
    /// What was heard before it.
    before: [Heard; Input::ALL.len()],
    /// Behind the first anchor, by number; while there is no memory those of every instance.
    entries: Vec<(JournalEntry, u64)>,
    /// How many of [`Self::entries`], the last ones, the stream was not given.
    waiting: usize,
}

impl Follower {
    /// One that has no memory of the other service yet; its stream has heard `before`.
    #[must_use]
    pub fn new(unit: UnitId, before: [Heard; Input::ALL.len()]) -> Self {
        Self {
            unit,
            before,
            anchors: VecDeque::new(),
            memory: None,
            frames: VecDeque::new(),
            gone: 0,
            entries: Vec::new(),
            waiting: 0,
        }
    }

    /// Whether the stream is what the other's is, as far as is known.
    #[must_use]
    pub fn has_joined(&self) -> bool {
        !self.anchors.is_empty()
    }

    /// Whether a memory is there that is not gone on from yet.
    #[must_use]
    pub fn has_memory(&self) -> bool {
        self.memory.is_some()
    }

    /// Whether entries wait for their frames.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.has_joined() && self.waiting > 0
    }

    /// The memory must be taken anew. Entries behind the next one may have come already.
    pub fn lose(&mut self) {
        self.anchors.clear();
        self.memory = None;
    }

    /// Notes a frame that the stream is given.
    pub fn frame(&mut self, input: Input, now_ns: u64, bytes: &[u8]) {
        if self.frames.len() == MAX_WAITING {
            self.give_up_oldest();
            if self.anchors.front().is_some_and(|anchor| anchor.frames < self.gone) {
                self.lose();
            }
        }
        self.frames.push_back(Frame { input, at_ns: now_ns, bytes: bytes.into() });
    }

    /// Gives the oldest frame up; `false` where there is none.
    fn give_up_oldest(&mut self) -> bool {
        let Some(Frame { input, bytes, .. }) = self.frames.pop_front() else { return false };
        self.before[input.index()].note(&bytes);
        self.gone += 1;
        true
    }

    /// Takes the answer to a question for the memory, or an entry of the journal. Whether it is of use.
    pub fn entry(&mut self, entry: JournalEntry, now_ns: u64) -> bool {
        // The service ends, the unit's stream does not.
        if entry.unit != self.unit.as_str() || entry.event == JournalEvent::Ended {
            return false;
        }
        if matches!(entry.event, JournalEvent::Memory { .. }) {
            let same = self.anchors.back().is_some_and(|anchor| anchor.entry.instance == entry.instance);
            if !same {
                self.lose();
                self.entries.retain(|(other, _)| is_behind(other, &entry));
                self.waiting = self.waiting.min(self.entries.len());
                self.memory = Some((entry, now_ns));
            }
            return !same;
        }
        if self.anchors.front().is_some_and(|anchor| anchor.entry.instance != entry.instance) {
            return false;
        }
        let same = |(other, _): &(JournalEntry, u64)| {
            (other.number, &other.instance) == (entry.number, &entry.instance)
        };
        let known = self.entries.iter().any(same);
        let in_memory = self.anchors.front().is_some_and(|anchor| !is_behind(&entry, &anchor.entry));
        if known || in_memory {
            return false;
        }
        if self.entries.len() == MAX_ENTRIES {
            self.entries.remove(0);
        }
        let place = self.entries.partition_point(|(other, _)| other.number <= entry.number);
        self.entries.insert(place, (entry, now_ns));
        self.waiting = self.entries.len().min(self.waiting + 1);
        true
    }

    /// Goes on as far as it can: from a memory that has come, or from an entry whose frames have come. `own` is the stream as it
    /// is, and `made` how many corrected frames were taken from it and its forerunners; what is given back takes its place. The second
    /// value says that the memory must be asked for anew.
    pub fn advance(&mut self, own: &UnitStream, made: u64, now_ns: u64) -> (Option<Rebuilt>, bool) {
        if let Some((memory, at_ns)) = self.memory.clone() {
            let anchor = Anchor { entry: memory, at_ns, frames: self.gone, made };
            // Where the last gyro frame that the other had heard did not come, some behind it may be missing too.
            let of_before = self.is_of_before(&anchor.entry);
            if !of_before && !self.has_last_gyro_frame(&anchor.entry) {
                return (None, now_ns > at_ns.saturating_add(LATE_NS));
            }
            let rebuilt = self.rebuild(&anchor, of_before);
            let Some(again) = &rebuilt else {
                return (None, now_ns > at_ns.saturating_add(4 * super::NEAR_NS));
            };
            if !again.exact {
                // Entries behind the memory follow frames that did not come here.
                self.lose();
                return (None, true);
            }
            // The stream's own from here on: which frames were in the other's memory need not be found out again.
            let last = self.entries.iter().rfind(|(entry, _)| is_behind(entry, &anchor.entry));
            let number = last.map_or(anchor.entry.number, |(entry, _)| entry.number);
            self.memory = None;
            self.waiting = 0;
            self.entries.clear();
            self.remember((&again.stream, made), (&anchor.entry.instance, number), now_ns);
            return (rebuilt, false);
        }
        if self.anchors.is_empty() {
            return (None, false);
        }
        if self.waiting == 0 {
            if self.anchors.back().is_some_and(|anchor| anchor.at_ns.saturating_add(APART_NS) <= now_ns) {
                let last =
                    self.anchors.back().map(|anchor| (anchor.entry.instance.clone(), anchor.entry.number));
                let (instance, before) = last.unwrap_or_default();
                let number = self.entries.last().map_or(before, |(entry, _)| entry.number);
                self.remember((own, made), (&instance, number), now_ns);
            }
            return (None, false);
        }
        let late = |(_, at_ns): &(JournalEntry, u64)| at_ns.saturating_add(LONGEST_WAIT_NS) < now_ns;
        let Some(last) = self.entries.last() else { return (None, false) };
        if !reaches(&own.heard(), &last.0.heard) {
            let stuck = self.untaken().any(late);
            if stuck {
                self.lose();
            }
            return (None, stuck);
        }
        let rebuilt = self.give_waiting();
        let stuck = !rebuilt.as_ref().is_some_and(|rebuilt| rebuilt.exact);
        if stuck {
            self.lose();
        }
        (rebuilt, stuck)
    }

    /// The other service is not followed any more: what it did to the unit is done to `own` too, though frames that came before it there are
    /// missing here. What is given back takes the stream's place.
    pub fn finish(mut self, own: &mut UnitStream) -> Option<Rebuilt> {
        let waiting: Vec<_> = self.untaken().map(|(entry, _)| entry.clone()).collect();
        let rebuilt = self.give_waiting();
        if rebuilt.is_none() {
            let orders = |event: &&JournalEvent| {
                matches!(event, JournalEvent::Changed { .. } | JournalEvent::Commanded { .. })
            };
            for event in waiting.iter().map(|entry| &entry.event).filter(orders) {
                // A revision that the stream was given before is passed over.
                let _ = own.carry_out(event);
            }
        }
        rebuilt
    }

    /// Entries that the stream was not given.
    fn untaken(&self) -> impl Iterator<Item = &(JournalEntry, u64)> {
        self.entries.iter().skip(self.entries.len().saturating_sub(self.waiting))
    }

    /// A stream that goes on from before the first entry that waits; `None` where none is known from before it.
    fn give_waiting(&mut self) -> Option<Rebuilt> {
        let before = self.untaken().next()?.0.heard;
        while self.anchors.back().is_some_and(|anchor| !reaches(&before, &anchor.entry.heard)) {
            self.anchors.pop_back();
        }
        let anchor = self.anchors.pop_back()?;
        let rebuilt = self.rebuild(&anchor, true);
        self.anchors.push_back(anchor);
        self.waiting = 0;
        rebuilt
    }

    /// Whether a memory has heard what came here before it was followed, and no more: of a unit that sends nothing.
    fn is_of_before(&self, memory: &JournalEntry) -> bool {
        memory.heard.iter().zip(&self.before).all(|(heard, before)| heard.frames == 0 || heard == before)
    }

    fn has_last_gyro_frame(&self, memory: &JournalEntry) -> bool {
        memory.heard[GYRO.index()].frames == 0 || self.last_heard(memory, GYRO).is_some()
    }

    /// Place of the last frame of an input that a memory has heard.
    fn last_heard(&self, memory: &JournalEntry, input: Input) -> Option<usize> {
        let heard = Some(memory.heard[input.index()]).filter(|heard| heard.frames > 0)?;
        self.frames.iter().rposition(|frame| {
            let mut own = Heard::default();
            own.note(&frame.bytes);
            frame.input == input && own.crc == heard.crc
        })
    }

    /// For each input, how many of the frames are older than what a memory has heard though it names none of them: the connection was
    /// lost in between, and they came before the last gyro frame that is in the memory.
    fn older(&self, memory: &JournalEntry) -> [usize; Input::ALL.len()] {
        let gyro = self.last_heard(memory, GYRO).unwrap_or(0);
        Input::ALL.map(|input| {
            let heard = memory.heard[input.index()].frames > 0;
            if heard && self.last_heard(memory, input).is_none() { gyro } else { 0 }
        })
    }

    /// Takes the stream's own memory, and gives up what is older than the one before it.
    fn remember(&mut self, (own, made): (&UnitStream, u64), (instance, number): (&str, u64), now_ns: u64) {
        let event = JournalEvent::Memory { memory: own.memory(), document: None, pending: None };
        let (unit, instance, heard) = (self.unit.to_string(), instance.to_owned(), own.heard());
        let entry = JournalEntry { unit, instance, number, heard, event };
        let frames = self.gone + self.frames.len() as u64;
        self.anchors.push_back(Anchor { entry, at_ns: now_ns, frames, made });
        while self.anchors.len() > 2 {
            self.anchors.pop_front();
        }
        let Some(oldest) = self.anchors.front() else { return };
        let (first, number) = (oldest.frames, oldest.entry.number);
        while self.gone < first && self.give_up_oldest() {}
        self.entries.retain(|(entry, _)| entry.number > number);
    }

    /// A stream that goes on from a memory with all frames and entries behind it; `None` where it is not certain yet which of the
    /// frames were in the memory. With `at_once` that is not waited for.
    fn rebuild(&self, anchor: &Anchor, at_once: bool) -> Option<Rebuilt> {
        let mark = Mark::of(&anchor.entry, anchor.at_ns);
        let behind: Vec<_> =
            self.entries.iter().filter(|(entry, _)| is_behind(entry, &anchor.entry)).cloned().collect();
        let marks = behind.iter().map(|(entry, at_ns)| Mark::of(entry, *at_ns));
        let mut sequencer =
            Sequencer::new(Outline::new(std::iter::once(mark).chain(marks).collect())).behind(self.before);
        let skipped = usize::try_from(anchor.frames.saturating_sub(self.gone)).unwrap_or(usize::MAX);
        let mut left = behind.len() + 1;
        sequencer.entry(anchor.entry.clone(), anchor.at_ns);
        for (entry, at_ns) in behind {
            sequencer.entry(entry, at_ns);
        }
        // The stream's own memories have heard what came before them.
        let older = if at_once { [0; Input::ALL.len()] } else { self.older(&anchor.entry) };
        for (place, Frame { input, at_ns, bytes }) in self.frames.iter().enumerate().skip(skipped) {
            if place < older[input.index()] {
                continue;
            }
            sequencer.frame(*input, *at_ns, bytes.to_vec());
        }
        if at_once {
            sequencer.finish();
        }
        let mut made = Made { stream: None, frames: Vec::new(), exact: true };
        while let Some(deed) = sequencer.next_deed() {
            left -= usize::from(matches!(deed, Deed::Entry { .. }));
            made.take(&self.unit, deed);
        }
        let Made { stream, frames, exact } = made;
        let stream = stream.filter(|_| left == 0)?;
        Some(Rebuilt { stream, before: anchor.made, frames, exact })
    }

    /// The instance that is followed, or whose memory is to be gone on from.
    #[must_use]
    pub fn instance(&self) -> Option<Arc<str>> {
        let memory = self.memory.as_ref().map(|(memory, _)| memory);
        let entry = memory.or_else(|| self.anchors.back().map(|anchor| &anchor.entry));
        entry.map(|entry| entry.instance.as_str().into())
    }
}

/// Whether an entry is of the same journal as a memory and stands behind it.
fn is_behind(entry: &JournalEntry, memory: &JournalEntry) -> bool {
    entry.instance == memory.instance && entry.number > memory.number
}

/// Whether a stream has been given all that an entry says, by number.
fn reaches(own: &[Heard; Input::ALL.len()], want: &[Heard; Input::ALL.len()]) -> bool {
    own.iter().zip(want).all(|(own, want)| own.frames >= want.frames)
}

/// A stream that is being made.
struct Made {
    stream: Option<UnitStream>,
    frames: Vec<Vec<u8>>,
    exact: bool,
}

impl Made {
    fn take(&mut self, unit: &UnitId, deed: Deed) {
        match deed {
            Deed::Frame { input, frame, .. } => {
                if let Some(stream) = &mut self.stream {
                    // A frame that cannot be read is counted by the stream, there as here.
                    let _ = stream.receive(input, &frame);
                }
            }
            Deed::Entry { entry, anchor, .. } => {
                let fresh = || UnitStream::new(unit.clone(), UnitSettings::default());
                if anchor {
                    self.stream = Some(fresh());
                }
                let done = self.stream.get_or_insert_with(fresh).carry_out(&entry.event);
                self.exact &= done.is_ok();
                if anchor && done.is_err() {
                    self.stream = None;
                }
            }
            Deed::Notice(_) => self.exact = false,
        }
        let Some(stream) = &mut self.stream else { return };
        loop {
            let mut frame = Vec::new();
            if stream.next_frame(&mut frame).is_none() {
                break;
            }
            self.frames.push(frame);
        }
        // Asked for by the service after every frame; it is part of the memory.
        while stream.take_in_force().is_some() {}
    }
}

#[cfg(test)]
mod tests;
