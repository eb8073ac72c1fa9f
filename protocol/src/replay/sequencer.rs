//! In which order a unit was given its frames and the entries of its journal.
//!
//! Recorder and service heard the same frames, but not at the same moments, and an entry reaches the recorder before or
//! behind the frames that it follows. What holds is what the entry says: how many frames of each input the service had
//! been given, and the checksum of the last of them. So frames are given in recorded order up to the next entry's place in
//! their input; those behind it wait until the entry has been carried out.
//!
//! Where the frame at that place has another checksum, recorder and service did not hear the same. Then the frame is
//! looked for among those that were received within [`NEAR_NS`] of the entry, the numbering follows the service's from
//! there on, and a [`Notice`] says what is missing.

mod anchor;
mod copies;

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::journal::JournalEntry;
use crate::key::Input;
use crate::stream::Heard;

pub(super) use anchor::LATE_NS;
use anchor::Search;
use copies::Copies;

use super::notice::Notice;
use super::outline::{Mark, MarkKind, Outline, Place};

/// How far from an entry, in time of reception, the last frame before it is looked for (ns).
pub const NEAR_NS: u64 = 2_000_000_000;
/// Most frames of one input, behind the place that an entry has by its count, that are looked through for the last one
/// before it.
const MOST_BEHIND: u64 = 4096;
/// Most frames that are held back for the next entry; beyond them they are given, whatever the entry says.
const MOST_WAITING: usize = 1 << 16;
/// How many checksums of frames that were given are remembered.
const REMEMBERED: usize = 4096;

/// What a unit is given next.
#[derive(Debug)]
pub enum Deed {
    /// A frame.
    Frame {
        /// Of which input.
        input: Input,
        /// When it was received (ns since 1970-01-01 UTC).
        received_ns: u64,
        /// The frame.
        frame: Vec<u8>,
    },
    /// An entry of the journal.
    Entry {
        /// The entry.
        entry: Box<JournalEntry>,
        /// When it was received (ns since 1970-01-01 UTC).
        received_ns: u64,
        /// A stream begins with it that knows nothing of what was before.
        anchor: bool,
    },
    /// Nothing; something is to be said.
    Notice(Notice),
}

/// A frame that waits.
#[derive(Debug)]
struct Frame {
    order: u64,
    received_ns: u64,
    bytes: Vec<u8>,
}

impl Frame {
    fn crc(&self) -> u32 {
        let mut heard = Heard::default();
        heard.note(&self.bytes);
        heard.crc
    }
}

/// Where the stream stands.
#[derive(Debug)]
struct Standing {
    instance: Arc<str>,
    /// Number of the last entry.
    number: u64,
    /// In the service's count.
    heard: [Heard; Input::ALL.len()],
}

/// Brings the frames and entries of one unit in order.
#[derive(Debug, Default)]
pub struct Sequencer {
    marks: VecDeque<Mark>,
    /// Entries that have come and whose turn has not.
    arrived: BTreeMap<(Arc<str>, Place), (Box<JournalEntry>, u64)>,
    /// Frames that wait, by [`Input::index`].
    waiting: [VecDeque<Frame>; Input::ALL.len()],
    order: u64,
    /// `None` while no stream has begun, and where its service has stopped.
    standing: Option<Standing>,
    /// How many frames of each input are to be given before the next entry, where that is known.
    to_go: [Option<u64>; Input::ALL.len()],
    /// Checksums of the last frames given of each input.
    given: [VecDeque<u32>; Input::ALL.len()],
    /// Sequence number of the first corrected tick that came behind the entry that the next stream begins with.
    published: Option<u64>,
    /// What came before the first frame; `None` where that is not known.
    before: Option<[Heard; Input::ALL.len()]>,
    /// For the memory that the next stream begins with.
    search: Search,
    /// For the memory that the last stream began with.
    copies: Copies,
    out: VecDeque<Deed>,
    now_ns: u64,
    over: bool,
    unheard: u64,
}

impl Sequencer {
    /// For a unit with a journal.
    #[must_use]
    pub fn new(outline: Outline) -> Self {
        let Outline { marks, beside, without_beginning } = outline;
        let lost = (without_beginning > 0).then_some(Notice::WithoutBeginning { entries: without_beginning });
        let beside = beside.into_iter().map(|instance| Notice::Beside { instance });
        let out = lost.into_iter().chain(beside).map(Deed::Notice).collect();
        Self { marks: marks.into(), out, ..Self::default() }
    }

    /// For a unit without one: frames in the order in which they were recorded.
    #[must_use]
    pub fn without_journal() -> Self {
        let heard = [Heard::default(); Input::ALL.len()];
        Self { standing: Some(Standing { instance: "".into(), number: 0, heard }), ..Self::default() }
    }

    /// Is told what came before the first frame: a memory that has heard just that goes before every frame.
    #[must_use]
    pub fn behind(self, before: [Heard; Input::ALL.len()]) -> Self {
        Self { before: Some(before), ..self }
    }

    /// Takes a frame, in recorded order.
    pub fn frame(&mut self, input: Input, received_ns: u64, bytes: Vec<u8>) {
        self.now_ns = self.now_ns.max(received_ns);
        self.order += 1;
        let frame = Frame { order: self.order, received_ns, bytes };
        self.waiting[input.index()].extend(self.copies.keep(input.index(), frame));
    }

    /// Takes an entry of the journal, whenever it was recorded.
    pub fn entry(&mut self, entry: JournalEntry, received_ns: u64) {
        self.now_ns = self.now_ns.max(received_ns);
        let mark = Mark::of(&entry, received_ns);
        // What the outline does not have is of no use: of another instance, or there already.
        if self.marks.iter().any(|known| known.instance == mark.instance && known.place() == mark.place()) {
            self.arrived.insert((Arc::clone(&mark.instance), mark.place()), (Box::new(entry), received_ns));
        }
    }

    /// Is told of a corrected frame; `first_sequence` gives the sequence number of its first tick, where it is needed.
    pub fn published(&mut self, received_ns: u64, first_sequence: impl FnOnce() -> Option<u64>) {
        self.now_ns = self.now_ns.max(received_ns);
        let awaited = self.published.is_none()
            && self.next_begins().is_some_and(|mark| mark.received_ns <= received_ns);
        if awaited {
            self.published = first_sequence();
        }
    }

    /// The recording is over.
    pub fn finish(&mut self) {
        self.over = true;
    }

    /// Whether [`Sequencer::finish`] has been called.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// Frames that no stream was given: from before the first one began, or from after the last one's service had stopped.
    #[must_use]
    pub fn unheard(&self) -> u64 {
        self.unheard
    }

    /// What comes next; `None` until more has been taken.
    pub fn next_deed(&mut self) -> Option<Deed> {
        loop {
            if let Some(deed) = self.out.pop_front() {
                return Some(deed);
            }
            let went_on = match self.marks.front() {
                None => self.give_oldest(),
                Some(_) if self.next_begins().is_some() => self.anchor(),
                Some(_) => self.approach(),
            };
            if !went_on {
                return None;
            }
        }
    }

    /// The next entry, where it is one that another stream begins with.
    fn next_begins(&self) -> Option<&Mark> {
        let mark = self.marks.front()?;
        self.standing.as_ref().is_none_or(|standing| standing.instance != mark.instance).then_some(mark)
    }

    /// The input whose next frame was recorded first.
    fn oldest(&self, may: impl Fn(usize) -> bool) -> Option<(usize, &Frame)> {
        let fronts = self.waiting.iter().enumerate().filter(|(index, _)| may(*index));
        let fronts = fronts.filter_map(|(index, frames)| Some((index, frames.front()?)));
        fronts.min_by_key(|(_, frame)| frame.order)
    }

    /// Gives the frame that was recorded first, whatever comes; `false` where none waits.
    fn give_oldest(&mut self) -> bool {
        let oldest = self.oldest(|_| true).map(|(index, _)| index);
        oldest.is_some_and(|index| self.give(index))
    }

    /// Gives the next frame of an input, or drops it where there is no stream.
    fn give(&mut self, index: usize) -> bool {
        let Some(Frame { received_ns, bytes, .. }) = self.waiting[index].pop_front() else { return false };
        let Some(standing) = &mut self.standing else {
            self.unheard += 1;
            return true;
        };
        let (heard, given) = (&mut standing.heard[index], &mut self.given[index]);
        heard.note(&bytes);
        if !self.marks.is_empty() {
            given.push_back(heard.crc);
            if given.len() > REMEMBERED {
                given.pop_front();
            }
        }
        if let Some(to_go) = &mut self.to_go[index] {
            *to_go = to_go.saturating_sub(1);
        }
        self.out.push_back(Deed::Frame { input: Input::ALL[index], received_ns, frame: bytes });
        true
    }

    /// Goes on towards the next entry of the same stream; `false` where more must come first.
    fn approach(&mut self) -> bool {
        if self.ends_behind_the_log() {
            self.marks.clear();
            return true;
        }
        for input in Input::ALL {
            self.look_for_place(input);
        }
        if self.to_go.iter().all(|to_go| *to_go == Some(0)) {
            return self.carry_out(false);
        }
        let Some(mark) = self.marks.front() else { return false };
        // Frames that were received long before the entry cannot be the last one before it, or behind it, unless the
        // service was as far behind; then their number decides.
        let early_ns = mark.received_ns.saturating_sub(NEAR_NS);
        let too_many = self.waiting.iter().map(VecDeque::len).sum::<usize>() > MOST_WAITING;
        let oldest = self.oldest(|index| self.to_go[index] != Some(0));
        let may = oldest.filter(|(index, frame)| {
            let known = too_many || self.to_go[*index].is_some();
            known || (frame.received_ns < early_ns && self.distance(*index).is_some_and(|frames| frames > 0))
        });
        may.map(|(index, _)| index).is_some_and(|index| self.give(index))
    }

    /// How many frames the service was given more, by its count, before the next entry; `None` where it was fewer.
    fn distance(&self, index: usize) -> Option<u64> {
        self.marks.front()?.heard[index].frames.checked_sub(self.standing.as_ref()?.heard[index].frames)
    }

    /// Whether nothing that is still to come can be near the next entry.
    fn seen_enough(&self, index: usize) -> bool {
        let Some(mark) = self.marks.front() else { return true };
        let waiting = self.waiting[index].len() as u64;
        let behind = waiting.saturating_sub(self.distance(index).unwrap_or(0));
        self.over || self.now_ns > mark.received_ns.saturating_add(NEAR_NS) || behind > MOST_BEHIND
    }

    /// Finds out how many frames of an input come before the next entry, as far as it can be known already.
    fn look_for_place(&mut self, input: Input) {
        if self.to_go[input.index()].is_some() {
            return;
        }
        if let Some((frames, notice)) = self.place(input) {
            let notice = notice.filter(|notice| !self.gives_copies(notice));
            self.out.extend(notice.map(Deed::Notice));
            self.to_go[input.index()] = Some(frames);
        }
    }

    fn place(&self, input: Input) -> Option<(u64, Option<Notice>)> {
        let index = input.index();
        let mark = self.marks.front()?;
        let (want, have) = (mark.heard[index], self.standing.as_ref()?.heard[index]);
        let (waiting, distance) = (&self.waiting[index], self.distance(index));
        let at = |frames: u64| waiting.get(usize::try_from(frames.checked_sub(1)?).ok()?);
        let as_counted = match distance {
            Some(0) => (want.crc == have.crc || want.frames == 0).then_some(0),
            Some(frames) => at(frames).is_some_and(|frame| frame.crc() == want.crc).then_some(frames),
            None => None,
        };
        if let Some(frames) = as_counted {
            return Some((frames, None));
        }
        // A frame that is not there yet may still be the right one.
        let missing = distance.is_some_and(|frames| frames > waiting.len() as u64);
        if missing && !self.seen_enough(index) {
            return None;
        }
        let entry = mark.number;
        let told = |to_go: u64| {
            let expected = distance.unwrap_or(0);
            let behind = want.frames.abs_diff(have.frames);
            Some(match distance {
                Some(_) if to_go < expected => Notice::NotRecorded { input, frames: expected - to_go, entry },
                Some(_) => Notice::NotHeard { input, frames: to_go - expected, entry },
                None => Notice::NotHeard { input, frames: behind + to_go, entry },
            })
        };
        let expected = distance.unwrap_or(0);
        let found = (1..).zip(waiting).filter(|(_, frame)| frame.crc() == want.crc);
        if let Some((to_go, _)) = found.min_by_key(|(number, _)| expected.abs_diff(*number)) {
            return Some((to_go, told(to_go)));
        }
        if have.crc == want.crc {
            return Some((0, told(0)));
        }
        if !self.seen_enough(index) {
            return None;
        }
        if let Some(passed) = self.given[index].iter().rev().position(|crc| *crc == want.crc) {
            return Some((0, Some(Notice::TooEarly { input, frames: passed as u64, entry })));
        }
        let before = waiting.iter().filter(|frame| frame.received_ns <= mark.received_ns).count() as u64;
        Some((before, Some(Notice::PlaceUnknown { input, entry })))
    }

    /// Hands out the next entry, where it has come.
    fn carry_out(&mut self, anchor: bool) -> bool {
        let Some(mark) = self.marks.front() else { return false };
        let key = (Arc::clone(&mark.instance), mark.place());
        let arrived = self.arrived.remove(&key);
        if arrived.is_none() && !self.over {
            return false;
        }
        let Some(mark) = self.marks.pop_front() else { return false };
        let last = self.standing.as_ref().filter(|_| !anchor).map(|standing| standing.number);
        if let Some(last) = last {
            let to = if mark.kind == MarkKind::Memory { mark.number } else { mark.number.saturating_sub(1) };
            if to > last {
                self.out.push_back(Deed::Notice(Notice::EntriesMissing { from: last + 1, to }));
            }
        }
        let (instance, number) = (Arc::clone(&mark.instance), mark.number);
        match arrived {
            Some((entry, received_ns)) => self.out.push_back(Deed::Entry { entry, received_ns, anchor }),
            None => self.out.push_back(Deed::Notice(Notice::EntriesMissing { from: number, to: number })),
        }
        self.standing =
            (mark.kind != MarkKind::Ended).then_some(Standing { instance, number, heard: mark.heard });
        self.to_go = [None; Input::ALL.len()];
        self.published = None;
        if !anchor {
            self.copies = Copies::default();
        }
        true
    }
}
