//! Corrected ticks on their way out: each is written once, into the frame that it leaves in.

use std::collections::VecDeque;

use isotherm_correction::sample::CorrectedTick;
use isotherm_correction::sigma::Sigma;
use serde::{Deserialize, Serialize};

use crate::codec::{MAX_FRAME, MAX_TICKS, WINDOW, begin, seal};
use crate::corrected::{
    CorrectedBatch, MAX_RUN, MAX_TICK, SigmaRun, append_sigmas, append_tick, spread, version,
};
use crate::raw::MAX_CHANNELS;

/// Corrected ticks that have not been taken yet.
#[derive(Debug, Default, Clone, Serialize, Deserialize)]
#[serde(into = "Waiting", from = "Waiting")]
pub struct Outgoing {
    /// Frames that nothing can be added to; mostly none.
    full: VecDeque<Frame>,
    open: Frame,
    /// Length of the last frame in bytes: the next one is likely to be as long.
    length: usize,
    /// What stood before its ticks, and what that follows from: so will the next one begin, mostly until a temperature was read.
    head: Vec<u8>,
    head_of: Option<HeadKey>,
    /// How many heads there were before this one.
    heads: u64,
    /// Ticks are kept as they are, and written when a frame is asked for.
    as_ticks: bool,
    ticks: Vec<CorrectedTick>,
}

/// What a memory has of them: each tick, its revision and its series.
type Waiting = Vec<(CorrectedTick, [u64; 2], Option<Sigma>)>;

// Full frames are never too long for their reader: the parts of a head have fewer bytes than a tick.
const _: () = assert!((MAX_TICKS + MAX_CHANNELS + 4) * MAX_TICK + MAX_RUNS * MAX_RUN < MAX_FRAME);

/// Most runs of standard errors in a frame: one more begins another frame.
const MAX_RUNS: usize = 512;

/// A frame whose ticks are written and whose head is not.
#[derive(Debug, Default, Clone)]
struct Frame {
    /// A head, likely the one that will be right, then the ticks.
    bytes: Vec<u8>,
    /// Number of that head, and its length in bytes.
    head: u64,
    room: usize,
    count: usize,
    last: Last,
    /// Standard errors of the ticks, where they have any.
    sigmas: Vec<SigmaRun>,
}

/// What a head follows from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct HeadKey {
    /// Version of the batch.
    version: u8,
    /// Counter of the revision, and the series.
    revision: u64,
    series: u64,
    /// State of the temperatures.
    temperatures: u64,
    ticks: usize,
}

/// The last of some ticks.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Last {
    pub(super) end_time_ns: i64,
    pub(super) sequence: u64,
    pub(super) revision: u64,
    pub(super) series: u64,
}

impl Outgoing {
    /// How many ticks there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.frames().map(|frame| frame.count).sum::<usize>() + self.ticks.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.open.count == 0 && self.full.is_empty() && self.ticks.is_empty()
    }

    /// The ticks that are kept as they are: all there are in a stream that [keeps them](super::UnitStream::keeping_ticks).
    #[must_use]
    pub fn ticks(&self) -> &[CorrectedTick] {
        &self.ticks
    }

    /// Has ticks kept as they are.
    pub(super) fn keep_ticks(&mut self) {
        self.as_ticks = true;
    }

    /// One tick more.
    #[inline]
    pub(super) fn push(&mut self, tick: &CorrectedTick) {
        if self.as_ticks {
            self.ticks.push(tick.clone());
        } else {
            self.write(tick);
        }
    }

    fn write(&mut self, tick: &CorrectedTick) {
        let Frame { count, last, .. } = &self.open;
        let is_another = (last.revision, last.series) != (tick.revision, tick.series);
        if *count == MAX_TICKS || (*count > 0 && is_another) {
            self.full.push_back(std::mem::take(&mut self.open));
        }
        if self.open.count == 0 {
            // One allocation for a frame like the last, and what writing wants behind its end.
            self.open.bytes.clear();
            self.open.sigmas.clear();
            self.open.bytes.reserve(self.length + self.length / 8 + WINDOW);
            self.open.bytes.extend_from_slice(&self.head);
            (self.open.head, self.open.room) = (self.heads, self.head.len());
        }
        append_tick(&mut self.open.bytes, tick);
        self.open.count += 1;
        self.open.last = Last::of(tick);
        if let Some(sigma) = tick.sigma.as_deref() {
            self.note_sigma(sigma);
        }
    }

    /// Puts the standard errors of the tick just written behind those of the ones before it.
    #[cold]
    fn note_sigma(&mut self, sigma: &Sigma) {
        SigmaRun::push(&mut self.open.sigmas, self.open.count - 1, sigma);
        if self.open.sigmas.len() == MAX_RUNS {
            self.full.push_back(std::mem::take(&mut self.open));
        }
    }

    /// Makes the next frame, all of one revision and series, in the place of `into`, whose capacity is kept for the one after it;
    /// its last tick, and how many there are. `write_head` appends the head of a frame with this last tick and so many of them;
    /// `temperatures` says in which state they are.
    #[inline(never)]
    pub(super) fn next_frame(
        &mut self,
        into: &mut Vec<u8>,
        temperatures: u64,
        write_head: impl FnOnce(&mut Vec<u8>, Last, usize),
    ) -> Option<(Last, usize)> {
        if !self.ticks.is_empty() {
            let mut ticks = std::mem::take(&mut self.ticks);
            ticks.drain(..).for_each(|tick| self.write(&tick));
            self.ticks = ticks;
        }
        let frame = self.full.front_mut().unwrap_or(&mut self.open);
        if frame.count == 0 {
            return None;
        }
        let Last { revision, series, .. } = frame.last;
        let version = version(series, &frame.sigmas);
        let key = HeadKey { version, revision, series, temperatures, ticks: frame.count };
        if self.head_of != Some(key) {
            self.head_of = Some(key);
            self.heads += 1;
            self.head.clear();
            begin::<CorrectedBatch>(&mut self.head, version);
            write_head(&mut self.head, frame.last, frame.count);
        }
        if frame.head != self.heads {
            frame.bytes.splice(..frame.room, self.head.iter().copied());
        }
        append_sigmas(&mut frame.bytes, series, &frame.sigmas);
        seal(&mut frame.bytes);
        self.length = frame.bytes.len();
        std::mem::swap(into, &mut frame.bytes);
        let done = (frame.last, std::mem::take(&mut frame.count));
        if let Some(frame) = self.full.pop_front()
            && self.open.count == 0
        {
            self.open.bytes = frame.bytes;
        }
        Some(done)
    }

    /// Forgets the head of the last frame: a revision's counter may mean another one.
    pub(super) fn forget_head(&mut self) {
        self.head_of = None;
    }

    /// Takes all ticks as they are.
    pub(super) fn take(&mut self) -> (Vec<CorrectedTick>, Option<Last>) {
        let mut ticks: Vec<_> = self.frames().flat_map(Frame::ticks).collect();
        ticks.append(&mut self.ticks);
        let last = ticks.last().map(Last::of);
        self.clear();
        (ticks, last)
    }

    /// Gives all ticks up; the last of them.
    pub(super) fn clear(&mut self) -> Option<Last> {
        let last = self.ticks.last().map(Last::of);
        let last =
            last.or_else(|| self.frames().filter(|frame| frame.count > 0).last().map(|frame| frame.last));
        self.full.clear();
        self.open.count = 0;
        self.ticks.clear();
        last
    }

    fn frames(&self) -> impl Iterator<Item = &Frame> {
        self.full.iter().chain(std::iter::once(&self.open))
    }
}

impl Frame {
    /// The ticks, read back.
    fn ticks(&self) -> Vec<CorrectedTick> {
        let mut rest = self.bytes.get(self.room..).unwrap_or_default();
        let ticks = (0..self.count).map_while(|_| {
            let (tick, behind) = postcard::take_from_bytes::<CorrectedTick>(rest).ok()?;
            rest = behind;
            Some(CorrectedTick { revision: self.last.revision, series: self.last.series, ..tick })
        });
        let mut ticks: Vec<_> = ticks.collect();
        spread(&self.sigmas, &mut ticks);
        ticks
    }
}

impl Last {
    fn of(tick: &CorrectedTick) -> Self {
        let CorrectedTick { end_time, sequence, revision, series, .. } = *tick;
        Self { end_time_ns: end_time.as_ns(), sequence, revision, series }
    }
}

impl From<Outgoing> for Waiting {
    fn from(outgoing: Outgoing) -> Self {
        let ticks = outgoing.frames().flat_map(Frame::ticks).chain(outgoing.ticks.iter().cloned());
        ticks
            .map(|tick| ([tick.revision, tick.series], tick.sigma.as_deref().copied(), tick))
            .map(|(of, sigma, tick)| (tick, of, sigma))
            .collect()
    }
}

impl From<Waiting> for Outgoing {
    fn from(waiting: Waiting) -> Self {
        let mut outgoing = Self::default();
        for (tick, [revision, series], sigma) in waiting {
            outgoing.push(&CorrectedTick { revision, series, sigma: sigma.map(Box::new), ..tick });
        }
        outgoing
    }
}
