//! Where in a recording a stream begins: behind the last frame that its memory has heard, or at the first frame that a
//! new unit was given. And where the recording ends before what a last memory has heard.

use std::collections::VecDeque;

use crate::codec;
use crate::key::{Input, RawStream};
use crate::raw::GyroBatch;
use crate::stream::Heard;

use super::copies::Copies;
use super::{Frame, NEAR_NS, Sequencer};
use crate::replay::outline::{Mark, MarkKind};

/// How long before an entry that a stream begins with frames are kept for it, and how long behind a memory an entry may come whose
/// count says which frames the memory has heard (ns).
const KEPT_NS: u64 = 5_000_000_000;
/// How much later than a memory the last frame may come that the memory has heard (ns).
pub(in crate::replay) const LATE_NS: u64 = 300_000_000;
/// The input by which it is known which frames came before a memory.
const GYRO: Input = Input::Raw(RawStream::Gyro);

/// For each input the order of the first frame that a memory has not heard.
type Cuts = [u64; Input::ALL.len()];

/// How far the frames that wait were looked through for those that a memory has heard last.
#[derive(Debug, Default)]
pub(super) struct Search {
    mark: Option<Mark>,
    order: u64,
    /// By [`Input::index`].
    found: [bool; Input::ALL.len()],
    /// Whether the gyro frame came no later than the memory. One that came later may be of a unit that was silent and now repeats itself.
    in_time: bool,
    /// Whether the last gyro frame came that the entry behind the memory has heard.
    reached: bool,
}

impl Sequencer {
    /// Goes on towards an entry that another stream begins with; `false` where more must come first.
    pub(super) fn anchor(&mut self) -> bool {
        let Some(mark) = self.marks.front().cloned() else { return false };
        let kept_ns = mark.received_ns.saturating_sub(KEPT_NS);
        if self.oldest(|_| true).is_some_and(|(_, frame)| frame.received_ns < kept_ns) {
            // Of the stream before, or of none.
            return self.give_oldest();
        }
        if !self.is_certain(&mark) && !self.over {
            return false;
        }
        let cuts = if mark.kind == MarkKind::Memory {
            let counted = if self.search.in_time { None } else { self.behind_count(&mark) };
            if counted.is_none()
                && let Some(better) = self.better_memory(&mark)
            {
                self.marks.drain(..better);
                return true;
            }
            let cuts = counted.unwrap_or_else(|| self.behind_memory(&mark));
            self.copies = Copies::default();
            if counted.is_none() {
                self.set_copies_aside(&mark, &cuts);
            }
            cuts
        } else {
            self.copies = Copies::default();
            self.before_first(&mark)
        };
        // A stream whose service has stopped is gone; one that was killed may have heard what comes before the cut.
        while let Some(index) = self.first_before(&cuts) {
            self.give(index);
        }
        self.given.iter_mut().for_each(VecDeque::clear);
        self.carry_out(true)
    }

    /// Whether nothing that is still to come can change where the stream begins: a log that was played as fast as it went has
    /// millions of ticks within [`NEAR_NS`].
    fn is_certain(&mut self, mark: &Mark) -> bool {
        let over = |mark: &Mark, now_ns: u64| now_ns > mark.received_ns.saturating_add(NEAR_NS);
        if mark.kind == MarkKind::Began {
            return over(mark, self.now_ns)
                || self.oldest(|_| true).is_some_and(|(_, oldest)| self.begins_with(oldest, mark));
        }
        self.look_for_last(mark);
        let Search { found, in_time, reached, .. } = &self.search;
        let (entry, seen) = match self.counting(mark).filter(|_| !in_time) {
            Some(counting) => (counting, *reached),
            None => (mark, found.iter().all(|found| *found)),
        };
        over(entry, self.now_ns) || (seen && self.now_ns > entry.received_ns)
    }

    /// Looks through the frames that have come since for the last ones that a memory has heard.
    fn look_for_last(&mut self, mark: &Mark) {
        let mut search = std::mem::take(&mut self.search);
        if search.mark.as_ref() != Some(mark) {
            search = Search { mark: Some(mark.clone()), ..Search::default() };
            let before = self.before.iter().flatten();
            for ((found, heard), before) in search.found.iter_mut().zip(&mark.heard).zip(before) {
                *found = heard.frames == 0 || (before.frames > 0 && before.crc == heard.crc);
            }
            search.in_time = search.found[GYRO.index()] || gyro(mark).frames == 0;
        }
        let counting = self.counting(mark).map(gyro);
        let inputs = search.found.iter_mut().zip(&mark.heard).zip(&self.waiting).enumerate();
        for (index, ((found, heard), frames)) in inputs {
            *found |= heard.frames == 0;
            for frame in frames.iter().rev().take_while(|frame| frame.order > search.order) {
                let crc = frame.crc();
                let is_last = crc == heard.crc && heard.frames > 0;
                let is_gyro = index == GYRO.index();
                *found |=
                    is_last && (!is_gyro || frame.received_ns <= mark.received_ns.saturating_add(LATE_NS));
                search.in_time |= is_last && is_gyro && frame.received_ns <= mark.received_ns;
                search.reached |= is_gyro && counting.is_some_and(|counting| counting.crc == crc);
            }
        }
        search.order = self.order;
        self.search = search;
    }

    /// The next entry of the same journal that has heard more of the gyros than a memory, where it came soon enough to count by.
    fn counting(&self, mark: &Mark) -> Option<&Mark> {
        let of_journal = self.marks.iter().skip(1).take_while(|later| later.instance == mark.instance);
        let next = of_journal.into_iter().find(|later| gyro(later).frames > gyro(mark).frames);
        next.filter(|later| later.received_ns <= mark.received_ns.saturating_add(KEPT_NS))
    }

    /// Whether a recording, or a unit, begins with a new stream: then every frame is the stream's.
    fn begins_with(&self, oldest: &Frame, mark: &Mark) -> bool {
        let fresh = self.unheard == 0 && self.standing.is_none();
        fresh && oldest.received_ns.saturating_add(NEAR_NS) >= mark.received_ns
    }

    /// Place, among the entries to come, of a memory to begin with instead of `mark`.
    ///
    /// A recorder may have asked before it heard the producers. Where the last gyro frame that the memory has heard is not in
    /// the recording, and an entry soon behind it has heard other frames than the recorder, some are missing; a later memory is then the
    /// surer one to begin with. Without such an entry the unit was silent when it was asked for.
    fn better_memory(&self, mark: &Mark) -> Option<usize> {
        let heard = gyro(mark);
        if heard.frames == 0 || self.last_like(GYRO.index(), heard, mark.received_ns).is_some() {
            return None;
        }
        self.counting(mark)?;
        let mut later = self.marks.iter().enumerate().skip(1);
        let later =
            later.find(|(_, later)| later.kind == MarkKind::Memory && later.instance == mark.instance);
        later.filter(|(_, later)| gyro(later).frames > heard.frames).map(|(place, _)| place)
    }

    /// Place, among the frames of an input that wait, of the last one that an entry has heard, received at `received_ns`.
    ///
    /// Of equal frames the last one before the entry came: a producer that repeats itself does so at once.
    fn last_like(&self, index: usize, heard: Heard, received_ns: u64) -> Option<usize> {
        let frames = (heard.frames > 0).then_some(&self.waiting[index])?;
        let in_time = |frame: &Frame| frame.received_ns <= received_ns && frame.crc() == heard.crc;
        let late = |frame: &Frame| {
            (received_ns..=received_ns.saturating_add(NEAR_NS)).contains(&frame.received_ns)
                && frame.crc() == heard.crc
        };
        frames.iter().rposition(in_time).or_else(|| frames.iter().position(late))
    }

    /// The input whose next frame was recorded first, of those whose next frame is before their cut.
    fn first_before(&self, cuts: &Cuts) -> Option<usize> {
        let before =
            |index: usize| self.waiting[index].front().is_some_and(|frame| frame.order < cuts[index]);
        self.oldest(before).map(|(index, _)| index)
    }

    /// The cuts by the count of the next entry: the frames that it has heard more than the memory are those up to its last one.
    fn behind_count(&self, mark: &Mark) -> Option<Cuts> {
        let counting = self.counting(mark)?;
        let mut cuts = [0; Input::ALL.len()];
        for (index, ((cut, heard), more)) in cuts.iter_mut().zip(&mark.heard).zip(&counting.heard).enumerate()
        {
            let frames = &self.waiting[index];
            if more.frames == heard.frames {
                // What came of it before the memory did, this has heard.
                let before = frames.iter().rfind(|frame| frame.received_ns <= mark.received_ns);
                *cut = before.map_or(0, |frame| frame.order + 1);
                continue;
            }
            let last = self.last_like(index, *more, counting.received_ns)? as u64 + 1;
            let first = last.checked_sub(more.frames.checked_sub(heard.frames)?)?;
            let before = first.checked_sub(1).map(|before| frames.get(usize::try_from(before).ok()?));
            if before.is_some_and(|before| before.is_none_or(|before| before.crc() != heard.crc)) {
                return None;
            }
            *cut = frames.get(usize::try_from(first).ok()?)?.order;
        }
        Some(cuts)
    }

    /// The cuts by the last frames that the memory has heard.
    fn behind_memory(&self, mark: &Mark) -> Cuts {
        let found: [Option<&Frame>; Input::ALL.len()] = std::array::from_fn(|index| {
            self.waiting[index].get(self.last_like(index, mark.heard[index], mark.received_ns)?)
        });
        let last = found.iter().flatten().max_by_key(|frame| frame.order);
        // Had the memory heard any frame of the other inputs in the recording, it would name it; only what is much older
        // than what it has heard can have been missed by the service.
        let missed_ns = last.map_or(0, |frame| frame.received_ns.saturating_sub(NEAR_NS));
        let mut cuts = [0; Input::ALL.len()];
        for ((cut, found), frames) in cuts.iter_mut().zip(found).zip(&self.waiting) {
            let missed = || frames.iter().take_while(|frame| frame.received_ns < missed_ns).last();
            *cut = found.or_else(missed).map_or(0, |frame| frame.order + 1);
        }
        cuts
    }

    /// For each input the order of the first frame that a new unit was given.
    fn before_first(&self, mark: &Mark) -> Cuts {
        let Some((_, oldest)) = self.oldest(|_| true) else { return [0; Input::ALL.len()] };
        if self.begins_with(oldest, mark) {
            return [0; Input::ALL.len()];
        }
        let by_sequence = self.published.and_then(|sequence| self.first_gyro_frame(mark, sequence));
        let by_time = || {
            let all = self.waiting.iter().flatten();
            let before = all.clone().filter(|frame| frame.received_ns <= mark.received_ns);
            // The entry came with the first frame, right behind it.
            before.map(|frame| frame.order).max().or_else(|| all.map(|frame| frame.order).min())
        };
        [by_sequence.or_else(by_time).unwrap_or(0); Input::ALL.len()]
    }

    /// The first frame near the entry that has the tick which the new unit published first, or a later one.
    fn first_gyro_frame(&self, mark: &Mark, sequence: u64) -> Option<u64> {
        let frames = &self.waiting[GYRO.index()];
        let near =
            frames.iter().filter(|frame| frame.received_ns.saturating_add(NEAR_NS) >= mark.received_ns);
        let gyro = near.filter_map(|frame| {
            let batch: GyroBatch = codec::decode(&frame.bytes).ok()?;
            let numbers = batch.ticks.first()?.sequence..batch.ticks.last()?.sequence.saturating_add(1);
            numbers.contains(&sequence).then_some(frame.order)
        });
        let first = gyro.min()?;
        // What was recorded right before it came to the service with it: the frames of a tick belong together.
        let gyro_before =
            frames.iter().rev().find(|frame| frame.order < first).map_or(0, |frame| frame.order + 1);
        let together =
            self.waiting.iter().flatten().filter(|frame| (gyro_before..=first).contains(&frame.order));
        let received_ns = frames.iter().find(|frame| frame.order == first)?.received_ns;
        let near = together.filter(|frame| frame.received_ns.saturating_add(1_000_000) >= received_ns);
        near.map(|frame| frame.order).min()
    }

    /// Whether the last entry is a memory that has heard more than was recorded, up to a frame that is not in the recording.
    ///
    /// A recorder asks before it ends: what was on its way to it then is no loss, and no tick rests on that memory.
    pub(super) fn ends_behind_the_log(&self) -> bool {
        let last = self.marks.front().filter(|mark| mark.kind == MarkKind::Memory && self.marks.len() == 1);
        let Some(mark) = last.filter(|_| self.over) else { return false };
        let behind = |index: usize| {
            let waiting = &self.waiting[index];
            let open = self.to_go[index].is_none();
            let more = open && self.distance(index).is_some_and(|frames| frames > waiting.len() as u64);
            more && waiting.iter().all(|frame| frame.crc() != mark.heard[index].crc)
        };
        (0..Input::ALL.len()).any(behind)
    }
}

/// What an entry says of the gyros.
fn gyro(mark: &Mark) -> Heard {
    mark.heard[GYRO.index()]
}
