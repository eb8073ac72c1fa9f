//! Corrected frames that were computed and not published, beside what another instance has published.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick, Revision, are_same};

/// How old a tick is when it is compared: entries of the journal may come later than the ticks behind them.
const SETTLED: Duration = Duration::from_millis(500);
/// How long a tick that was heard waits for its like.
const LONGEST_WAIT: Duration = Duration::from_secs(3);

/// A tick by the end of its time, its number and its series.
type Id = (i64, u64, u64);

fn id(tick: &CorrectedTick) -> Id {
    (tick.end_time.as_ns(), tick.sequence, tick.series)
}

/// A frame that was computed here.
#[derive(Debug)]
struct Frame {
    bytes: Vec<u8>,
    ids: Vec<Id>,
    at: Instant,
    /// The other instance has published it, or a later one.
    heard: bool,
    /// This one has published it.
    out: bool,
}

/// A tick that was heard.
#[derive(Debug)]
struct Heard {
    tick: CorrectedTick,
    revision: Revision,
    at: Instant,
}

/// What came of comparing.
#[derive(Debug, Default)]
pub(super) struct Settled {
    /// Ticks compared.
    pub(super) compared: u64,
    /// Those that were others.
    pub(super) differing: u64,
    /// The first of them: its sequence number, and in what it differs.
    pub(super) difference: Option<(u64, String)>,
    /// Ticks were heard that were not computed here.
    pub(super) missed: bool,
}

/// The frames, the oldest first.
#[derive(Debug, Default)]
pub(super) struct Kept {
    frames: VecDeque<Frame>,
    /// How many there were, those that are given up with them.
    pub(super) made: u64,
    heard: BTreeMap<Id, Heard>,
    last_heard: Option<Id>,
    /// When something was last heard, or else first computed.
    heard_at: Option<Instant>,
    /// Ticks that were heard before this time are not compared: the stream had not joined.
    since: Option<Instant>,
}

impl Kept {
    /// A frame was computed; whether it says that ticks are missing.
    pub(super) fn computed(&mut self, bytes: Vec<u8>, now: Instant) -> bool {
        let ticks = codec::decode::<CorrectedBatch>(&bytes).map(|batch| batch.ticks).unwrap_or_default();
        let ids: Vec<_> = ticks.iter().map(id).collect();
        let heard = ids.iter().any(|id| self.was_heard(id));
        self.heard_at.get_or_insert(now);
        self.made += 1;
        self.frames.push_back(Frame { bytes, ids, at: now, heard, out: false });
        if heard {
            self.frames.iter_mut().for_each(|frame| frame.heard = true);
        }
        ticks.iter().any(|tick| tick.missed > 0)
    }

    /// Whether a tick was heard: a line that is behind hears what it computes later.
    fn was_heard(&self, id: &Id) -> bool {
        self.heard.contains_key(id) || self.last_heard == Some(*id)
    }

    /// The other instance has published a batch.
    pub(super) fn heard(&mut self, batch: CorrectedBatch, now: Instant) {
        let revision = batch.revision;
        let Some(last) = batch.ticks.last().map(id) else { return };
        let own = self.frames.iter().rposition(|frame| frame.ids.contains(&last));
        for frame in self.frames.iter_mut().take(own.map_or(0, |own| own + 1)) {
            frame.heard = true;
        }
        (self.last_heard, self.heard_at) = (Some(last), Some(now));
        for tick in batch.ticks {
            self.heard.insert(id(&tick), Heard { tick, revision, at: now });
        }
    }

    /// The stream has been taken back: these are the frames that it has made again, and so many of those that it made before hold. Of a
    /// stream that had not joined (`None`) no frame does, and nothing that was heard until now is compared.
    pub(super) fn replace(&mut self, frames: Vec<Vec<u8>>, holds: Option<u64>, now: Instant) {
        let mut before = std::mem::take(&mut self.frames);
        let mut marks: BTreeMap<Id, (Instant, bool, bool)> = BTreeMap::new();
        for frame in &before {
            marks.extend(frame.ids.iter().map(|id| (*id, (frame.at, frame.heard, frame.out))));
        }
        if holds.is_none() {
            self.since = Some(now);
        }
        if let Some(holds) = holds {
            let given_up = usize::try_from(self.made.saturating_sub(holds)).unwrap_or(usize::MAX);
            self.frames.extend(before.drain(..before.len().saturating_sub(given_up)));
            self.made = holds + frames.len() as u64;
        }
        let oldest = marks.first_key_value().map(|(id, _)| *id);
        let mut again = VecDeque::new();
        for bytes in frames {
            let Ok(batch) = codec::decode::<CorrectedBatch>(&bytes) else { continue };
            let ids: Vec<_> = batch.ticks.iter().map(id).collect();
            let known = ids.iter().rev().find_map(|id| marks.get(id).copied());
            // What is older than all that was kept has been compared.
            if known.is_none() && again.is_empty() && oldest.is_some() && ids.last() < oldest.as_ref() {
                continue;
            }
            let (at, was_heard, out) = known.unwrap_or((now, false, false));
            let heard = was_heard || ids.iter().any(|id| self.was_heard(id));
            again.push_back(Frame { bytes, ids, at, heard, out });
        }
        self.frames.append(&mut again);
        let last = self.frames.iter().rposition(|frame| frame.heard);
        for frame in self.frames.iter_mut().take(last.unwrap_or(0)) {
            frame.heard = true;
        }
    }

    /// When nothing has been heard for that long while a frame waits to be heard: counted from what was last heard, as subscribers do,
    /// where the frame has waited for three quarters of it by then.
    pub(super) fn late_at(&self, limit: Duration) -> Option<Instant> {
        let oldest = self.oldest_waiting()?;
        let silent = self.heard_at.map_or(oldest.at, |heard_at| heard_at.min(oldest.at)) + limit;
        Some(silent.max(oldest.at + limit * 3 / 4))
    }

    /// Whether nothing was heard for that long, while a frame waited to be: where nothing is computed either, nothing is to be heard.
    pub(super) fn is_silent(&self, now: Instant, limit: Duration) -> bool {
        self.oldest_waiting().is_some_and(|oldest| {
            let since = self.heard_at.map_or(oldest.at, |heard_at| heard_at.max(oldest.at));
            now.saturating_duration_since(since) >= limit
        })
    }

    /// Whether the other instance was heard within a time.
    pub(super) fn was_heard_within(&self, now: Instant, time: Duration) -> bool {
        let heard_at = self.heard_at.filter(|_| self.last_heard.is_some());
        heard_at.is_some_and(|heard_at| now.saturating_duration_since(heard_at) < time)
    }

    /// The oldest frame that waits to be heard.
    fn oldest_waiting(&self) -> Option<&Frame> {
        self.frames.iter().rev().take_while(|frame| !frame.heard).last()
    }

    /// Compares what is old enough, where the stream is `in_step`, and gives it up.
    pub(super) fn settle(&mut self, now: Instant, in_step: bool) -> Settled {
        let mut settled = Settled::default();
        let age = |at: Instant| now.saturating_duration_since(at);
        while self
            .frames
            .front()
            .is_some_and(|frame| age(frame.at) >= SETTLED && (frame.heard || age(frame.at) >= LONGEST_WAIT))
        {
            let Some(frame) = self.frames.pop_front() else { break };
            let Ok(batch) = codec::decode::<CorrectedBatch>(&frame.bytes) else { continue };
            for tick in &batch.ticks {
                let Some(heard) = self.heard.remove(&id(tick)) else { continue };
                if !in_step || self.since.is_some_and(|since| heard.at < since) {
                    continue;
                }
                settled.compared += 1;
                if heard.revision == batch.revision && are_same(&heard.tick, tick) {
                    continue;
                }
                if heard.tick.missed != tick.missed {
                    // One of the two lacks what the other has: no other bits, and the one that speaks holds.
                    settled.missed = true;
                    continue;
                }
                settled.differing += 1;
                let words = || difference(tick, batch.revision, &heard);
                settled.difference.get_or_insert_with(|| (tick.sequence, words()));
            }
        }
        let newest = self.frames.back().and_then(|frame| frame.ids.last()).map(|(end, ..)| *end);
        let since = self.since;
        self.heard.retain(|(end, ..), heard| {
            let old = age(heard.at) >= LONGEST_WAIT;
            let passed = newest.is_some_and(|newest| newest > *end)
                && since.is_some_and(|since| heard.at > since + SETTLED);
            settled.missed |= old && passed && in_step;
            !old
        });
        settled
    }

    /// The frames that are to be published and were not yet: those that were not heard, and the last ones that were, as far as twice the
    /// `overlap` back. What the other published before is not said again.
    pub(super) fn due(&mut self, now: Instant, overlap: Duration) -> Vec<Vec<u8>> {
        // However long ago it was heard: where the processors are busy, what it sent may reach subscribers later than what is sent now.
        let heard_at = self.heard_at.unwrap_or(now);
        let recent = |frame: &Frame| heard_at.saturating_duration_since(frame.at) <= overlap * 2;
        let is_due = |frame: &Frame| !frame.out && (!frame.heard || (recent(frame) && self.agrees(frame)));
        let due: Vec<_> = self.frames.iter().map(is_due).collect();
        let frames = self.frames.iter_mut().zip(due).filter(|(_, due)| *due);
        let published = frames.map(|(frame, _)| {
            frame.out = true;
            frame.bytes.clone()
        });
        published.collect()
    }

    /// Whether a frame is what was heard, as far as it was.
    fn agrees(&self, frame: &Frame) -> bool {
        let Ok(batch) = codec::decode::<CorrectedBatch>(&frame.bytes) else { return false };
        let same = |tick, heard: &Heard| heard.revision == batch.revision && are_same(&heard.tick, tick);
        batch.ticks.iter().all(|tick| self.heard.get(&id(tick)).is_none_or(|heard| same(tick, heard)))
    }
}

/// In what a tick differs from the one that was heard, in words.
fn difference(own: &CorrectedTick, revision: Revision, heard: &Heard) -> String {
    if revision != heard.revision {
        return format!("revision {} here, {} there", revision.counter, heard.revision.counter);
    }
    let there = &heard.tick;
    let arrays = [
        ("delta_angle_rad", own.delta_angle, there.delta_angle),
        ("delta_velocity_m_per_s", own.delta_velocity, there.delta_velocity),
    ];
    for (name, own, there) in arrays {
        if let Some((own, there)) =
            own.iter().zip(&there).find(|(own, there)| own.to_bits() != there.to_bits())
        {
            return format!("{name} {own:e} here, {there:e} there");
        }
    }
    format!(
        "flags {:#06x}, missed {} here, {:#06x}, {} there",
        own.flags.bits(),
        own.missed,
        there.flags.bits(),
        there.missed
    )
}

#[cfg(test)]
mod tests {
    use isotherm_correction::units::{Span, Timestamp};

    use super::*;

    const TAKEOVER: Duration = Duration::from_millis(20);

    fn batch(sequence: u64) -> CorrectedBatch {
        let tick = CorrectedTick {
            sequence,
            end_time: Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000),
            duration: Span::from_ns(5_000_000),
            ticks: 1,
            ..CorrectedTick::default()
        };
        CorrectedBatch {
            unit: "ZLG-0001".to_owned(),
            series: 0,
            revision: Revision { counter: 1, digest: [7; 8] },
            temperatures: [].into_iter().collect(),
            ticks: vec![tick],
            sigmas: Vec::new(),
        }
    }

    fn frame(sequence: u64) -> Vec<u8> {
        codec::encode(&batch(sequence)).unwrap()
    }

    fn sequences(frames: &[Vec<u8>]) -> Vec<u64> {
        frames.iter().map(|frame| codec::decode::<CorrectedBatch>(frame).unwrap().ticks[0].sequence).collect()
    }

    #[test]
    fn what_a_stream_that_joined_has_made_and_nobody_was_heard_of_is_due_once() {
        let (mut kept, start) = (Kept::default(), Instant::now());
        for sequence in 0..4 {
            assert!(!kept.computed(frame(sequence), start));
        }
        kept.heard(batch(1), start);
        kept.replace((2..6).map(frame).collect(), None, start);
        let late = start + TAKEOVER * 3;
        assert_eq!(sequences(&kept.due(late, TAKEOVER)), [2, 3, 4, 5]);
        // What the other says now it need not say again, nor does this one.
        kept.heard(batch(5), late);
        kept.replace((2..7).map(frame).collect(), Some(kept.made - 4), late);
        assert_eq!(sequences(&kept.due(late, TAKEOVER)), [6]);
        assert!(kept.due(late, TAKEOVER).is_empty());
    }

    #[test]
    fn what_was_heard_last_is_due_however_late_the_takeover_is() {
        let (mut kept, start) = (Kept::default(), Instant::now());
        for sequence in 0..3 {
            let at = start + TAKEOVER * 3 * u32::try_from(sequence).unwrap();
            kept.computed(frame(sequence), at);
            kept.heard(batch(sequence), at);
        }
        assert_eq!(sequences(&kept.due(start + TAKEOVER * 20, TAKEOVER)), [2]);
    }

    #[test]
    fn silence_counts_from_what_was_last_heard_if_the_next_tick_was_due_soon() {
        let start = Instant::now();
        // Time of the next tick behind what was heard, and of the takeover (ms).
        for (next, late) in [(1, 20), (5, 20), (6, 21), (100, 115)] {
            let mut kept = Kept::default();
            kept.computed(frame(0), start);
            kept.heard(batch(0), start);
            assert_eq!(kept.late_at(TAKEOVER), None);
            kept.computed(frame(1), start + Duration::from_millis(next));
            assert_eq!(kept.late_at(TAKEOVER), Some(start + Duration::from_millis(late)));
        }
        // What is behind by itself is late no later for that.
        let mut kept = Kept::default();
        for sequence in 0..3 {
            kept.computed(frame(sequence), start);
        }
        kept.heard(batch(0), start + Duration::from_millis(10));
        assert_eq!(kept.late_at(TAKEOVER), Some(start + TAKEOVER));
    }

    #[test]
    fn a_pause_of_the_producer_is_no_silence_of_the_other() {
        let (mut kept, start) = (Kept::default(), Instant::now());
        kept.computed(frame(0), start);
        kept.heard(batch(0), start);
        let next = start + Duration::from_secs(2);
        kept.computed(frame(1), next);
        let limit = Duration::from_millis(100);
        assert!(!kept.is_silent(next + Duration::from_millis(5), limit));
        assert!(kept.is_silent(next + limit, limit));
    }

    /// The stream's own memory may be younger than what waits.
    #[test]
    fn what_was_made_before_the_stream_was_taken_back_is_kept() {
        let start = Instant::now();
        // The last one: what was made behind the place that it was taken back to is none of the stream's, as after a command to stand by.
        for (heard, holds, again, due) in [
            (2, 5, 5..7, 3..7),
            (4, 5, 5..7, 5..7),
            (2, 7, 7..7, 3..7),
            (2, 7, 7..9, 3..9),
            (2, 5, 5..5, 3..5),
        ] {
            let mut kept = Kept { since: Some(start), ..Kept::default() };
            let late = start + LONGEST_WAIT;
            for sequence in 0..7 {
                kept.computed(frame(sequence), late);
            }
            (0..=heard).for_each(|sequence| kept.heard(batch(sequence), late));
            kept.replace(again.map(frame).collect(), Some(holds), late);
            let settled = kept.settle(late + SETTLED, true);
            assert_eq!((settled.compared, settled.differing), (heard + 1, 0));
            assert_eq!(sequences(&kept.due(late + SETTLED, Duration::ZERO)), due.collect::<Vec<_>>());
            kept.computed(frame(9), late + LONGEST_WAIT);
            assert!(!kept.settle(late + LONGEST_WAIT, true).missed);
        }
    }

    #[test]
    fn what_was_heard_a_moment_ago_is_due_where_it_is_the_same() {
        let (mut kept, now) = (Kept::default(), Instant::now());
        let mut other = batch(1);
        other.revision.counter = 2;
        for (sequence, heard) in [(0, batch(0)), (1, other), (2, batch(2))] {
            kept.computed(frame(sequence), now);
            kept.heard(heard, now);
        }
        assert_eq!(sequences(&kept.due(now + TAKEOVER, TAKEOVER)), [0, 2]);
    }

    /// It may have reached nobody else, and what is behind it is published before the other is missed.
    #[test]
    fn what_was_heard_before_it_was_computed_is_due_to_an_active_instance() {
        let (mut kept, now) = (Kept::default(), Instant::now());
        for sequence in 0..3 {
            kept.heard(batch(sequence), now);
            kept.computed(frame(sequence), now);
            assert_eq!(sequences(&kept.due(now, TAKEOVER)), [sequence]);
            assert!(kept.due(now, TAKEOVER).is_empty());
        }
    }
}
