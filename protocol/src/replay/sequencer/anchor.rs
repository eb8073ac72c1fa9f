//! Where in a recording a stream begins: behind the last frame that its memory has heard, or at the first frame that a
//! new unit was given. And where the recording ends before what a last memory has heard.

use std::collections::VecDeque;

use crate::codec;
use crate::key::{Input, RawStream};
use crate::raw::GyroBatch;

use super::copies::Copies;
use super::{Frame, NEAR_NS, Sequencer};
use crate::replay::outline::{Mark, MarkKind};

/// How long before an entry that a stream begins with frames are kept for it (ns).
const KEPT_NS: u64 = 5_000_000_000;

/// How far the frames that wait were looked through for those that a memory has heard last.
#[derive(Debug, Default)]
pub(super) struct Search {
    mark: Option<Mark>,
    order: u64,
    /// By [`Input::index`].
    found: [bool; Input::ALL.len()],
}

impl Sequencer {
    /// Goes on towards an entry that another stream begins with; `false` where more must come first.
    pub(super) fn anchor(&mut self) -> bool {
        let Some(mark) = self.marks.front() else { return false };
        let (received_ns, kept_ns) = (mark.received_ns, mark.received_ns.saturating_sub(KEPT_NS));
        if self.oldest(|_| true).is_some_and(|(_, frame)| frame.received_ns < kept_ns) {
            // Of the stream before, or of none.
            return self.give_oldest();
        }
        if !self.over && self.now_ns <= received_ns.saturating_add(NEAR_NS) && !self.is_certain() {
            return false;
        }
        let Some(mark) = self.marks.front().cloned() else { return false };
        if let Some(better) = self.better_memory(&mark) {
            self.marks.drain(..better);
            return true;
        }
        let cuts = if mark.kind == MarkKind::Memory {
            let cuts = self.behind_memory(&mark);
            self.set_copies_aside(&mark, &cuts);
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
    fn is_certain(&mut self) -> bool {
        let Some(mark) = self.marks.front() else { return false };
        if mark.kind == MarkKind::Began {
            return self.oldest(|_| true).is_some_and(|(_, oldest)| self.begins_with(oldest, mark));
        }
        if self.search.mark.as_ref() != Some(mark) {
            self.search = Search { mark: Some(mark.clone()), ..Search::default() };
            let before = self.before.iter().flatten();
            for ((found, heard), before) in self.search.found.iter_mut().zip(&mark.heard).zip(before) {
                *found = before.frames > 0 && before.crc == heard.crc;
            }
        }
        let Search { order, found, .. } = &mut self.search;
        for ((found, heard), frames) in found.iter_mut().zip(&mark.heard).zip(&self.waiting) {
            let mut fresh = frames.iter().rev().take_while(|frame| frame.order > *order);
            *found |= heard.frames == 0 || fresh.any(|frame| frame.crc() == heard.crc);
        }
        *order = self.order;
        self.now_ns > mark.received_ns && found.iter().all(|found| *found)
    }

    /// Whether a recording, or a unit, begins with a new stream: then every frame is the stream's.
    fn begins_with(&self, oldest: &Frame, mark: &Mark) -> bool {
        let fresh = self.unheard == 0 && self.standing.is_none();
        fresh && oldest.received_ns.saturating_add(NEAR_NS) >= mark.received_ns
    }

    /// Place, among the entries to come, of a memory to begin with instead of `mark`.
    ///
    /// A recorder may have asked before it heard the producers. Where the last gyro frame that the memory has heard is not in
    /// the recording, some that came behind it may be missing too; a later memory is then the surer one to begin with.
    fn better_memory(&self, mark: &Mark) -> Option<usize> {
        let gyro = Input::Raw(RawStream::Gyro).index();
        let heard = mark.heard.get(gyro).filter(|_| mark.kind == MarkKind::Memory)?;
        let recorded = self.waiting.get(gyro)?.iter().any(|frame| frame.crc() == heard.crc);
        if recorded || heard.frames == 0 {
            return None;
        }
        let mut later = self.marks.iter().enumerate().skip(1);
        let later =
            later.find(|(_, later)| later.kind == MarkKind::Memory && later.instance == mark.instance);
        let goes_on = |later: &Mark| later.heard.get(gyro).is_some_and(|later| later.frames > heard.frames);
        later.filter(|(_, later)| goes_on(later)).map(|(place, _)| place)
    }

    /// The input whose next frame was recorded first, of those whose next frame is before their cut.
    fn first_before(&self, cuts: &[u64; Input::ALL.len()]) -> Option<usize> {
        let before = |index: usize| {
            let front = self.waiting.get(index).and_then(VecDeque::front);
            front.zip(cuts.get(index)).is_some_and(|(frame, cut)| frame.order < *cut)
        };
        self.oldest(before).map(|(index, _)| index)
    }

    /// For each input the order of the first frame that the memory has not heard.
    fn behind_memory(&self, mark: &Mark) -> [u64; Input::ALL.len()] {
        let mut cuts = [None; Input::ALL.len()];
        let mut last: Option<&Frame> = None;
        for ((cut, heard), frames) in cuts.iter_mut().zip(&mark.heard).zip(&self.waiting) {
            if heard.frames == 0 {
                continue;
            }
            // Of equal frames the last one before the memory came: a producer that repeats itself does so at once.
            let same = || frames.iter().filter(|frame| frame.crc() == heard.crc);
            let found = same().rfind(|frame| frame.received_ns <= mark.received_ns).or_else(|| same().next());
            *cut = found.map(|frame| frame.order + 1);
            last = last.into_iter().chain(found).max_by_key(|frame| frame.order);
        }
        // Had the memory heard any frame of the other inputs in the recording, it would name it; only what is much older
        // than what it has heard can have been missed by the service.
        let missed_ns = last.map_or(0, |frame| frame.received_ns.saturating_sub(NEAR_NS));
        let mut orders = [0; Input::ALL.len()];
        for ((order, cut), frames) in orders.iter_mut().zip(cuts).zip(&self.waiting) {
            let missed = frames.iter().take_while(|frame| frame.received_ns < missed_ns).last();
            *order = cut.unwrap_or_else(|| missed.map_or(0, |frame| frame.order + 1));
        }
        orders
    }

    /// For each input the order of the first frame that a new unit was given.
    fn before_first(&self, mark: &Mark) -> [u64; Input::ALL.len()] {
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
        let frames = self.waiting.get(Input::Raw(RawStream::Gyro).index())?;
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
        let near = together.filter(|frame| frame.received_ns + 1_000_000 >= received_ns);
        near.map(|frame| frame.order).min()
    }

    /// Whether the last entry is a memory that has heard more than was recorded, up to a frame that is not in the recording.
    ///
    /// A recorder asks before it ends: what was on its way to it then is no loss, and no tick rests on that memory.
    pub(super) fn ends_behind_the_log(&self) -> bool {
        let last = self.marks.front().filter(|mark| mark.kind == MarkKind::Memory && self.marks.len() == 1);
        let Some(mark) = last.filter(|_| self.over) else { return false };
        let behind = |index: usize| {
            let (Some(want), Some(waiting)) = (mark.heard.get(index), self.waiting.get(index)) else {
                return false;
            };
            let open = self.to_go.get(index).is_some_and(Option::is_none);
            let more = open && self.distance(index).is_some_and(|frames| frames > waiting.len() as u64);
            more && waiting.iter().all(|frame| frame.crc() != want.crc)
        };
        (0..Input::ALL.len()).any(behind)
    }
}
