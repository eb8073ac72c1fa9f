//! A log as the messages that are to be played: due, filtered, in series of their own.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::sync::Arc;

use isotherm_bus::outlet::{GyroTicks, new_series};
use isotherm_correction::sample::{ChannelName, GyroTick};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::message::{Message, Topic};
use isotherm_log::part::{LogFiles, Messages};
use isotherm_log::schedule::Schedule;
use isotherm_log::streams::decoded::Decoded;
use isotherm_protocol::codec;
use isotherm_protocol::key::{Input, RawStream, UnitId};
use isotherm_protocol::raw::{GyroBatch, HealthBatch, HealthTick};
use zenoh::bytes::ZBytes;
use zenoh::key_expr::{OwnedKeyExpr, keyexpr};

use super::PlayOptions;
use crate::error::Error;

/// How often health readings go out, in event time.
const HEALTH_INTERVAL: Span = Span::from_ms(1000);
/// A batch so many ticks behind the newest is of a producer whose numbers begin again: the service does not wait for one as late.
const ANEW: u64 = 256;

/// A message to be played.
#[derive(Debug)]
pub(super) struct Cue {
    /// The unit in the log.
    pub(super) unit: UnitId,
    /// When, after the log's first message (ns).
    pub(super) at_ns: i64,
    /// What.
    pub(super) frame: Arc<Frame>,
    /// It is the first gyro batch of another series than the unit's last one.
    pub(super) begins_series: bool,
}

/// A frame, and what it carries.
#[derive(Debug)]
pub(super) struct Frame {
    /// Its topic.
    pub(super) input: Input,
    /// Its bytes.
    pub(super) bytes: ZBytes,
    /// What it carries.
    pub(super) load: Load,
}

/// What a frame carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Load {
    /// Gyro ticks.
    Gyro(GyroTicks),
    /// Accelerometer ticks.
    Accel(u64),
    /// Temperature readings.
    Temperature(u64),
    /// Health readings at so many times.
    Health(u64),
    /// A rate reference.
    Reference,
    /// Nothing that can be read: the service will refuse it, as it did before.
    Unreadable,
}

/// The log, once through.
#[derive(Debug)]
pub(super) struct Playlist<'a> {
    options: &'a PlayOptions,
    pub(super) messages: Messages,
    /// How far the log was read when its first message came: to the part that is played (bytes).
    first_bytes: Option<u64>,
    schedule: Schedule,
    series: SeriesNumbers,
    /// When the units' next health readings are due, where they are given.
    health_due: Option<Timestamp>,
    ready: VecDeque<Cue>,
    /// Temperature channels that the units have in the log.
    pub(super) channels: BTreeMap<UnitId, BTreeSet<ChannelName>>,
}

impl<'a> Playlist<'a> {
    /// Opens the log.
    pub(super) fn new(options: &'a PlayOptions) -> Result<Self, Error> {
        let messages = options.files.open(&options.part)?;
        let series = SeriesNumbers::from(options.series.unwrap_or_else(new_series));
        let schedule = schedule(options);
        let (ready, channels) = Default::default();
        Ok(Self { options, messages, first_bytes: None, schedule, series, health_due: None, ready, channels })
    }

    /// Goes back to the beginning: what follows is of new series.
    pub(super) fn rewind(&mut self) -> Result<(), Error> {
        self.messages = self.options.files.open(&self.options.part)?;
        self.first_bytes = None;
        self.schedule = schedule(self.options);
        self.series.begin_anew();
        self.health_due = None;
        self.ready.clear();
        Ok(())
    }

    /// How far the log has been read (0…1), from the beginning of the part that is played.
    #[expect(clippy::cast_precision_loss, reason = "a share of a bar")]
    pub(super) fn share(&self) -> f64 {
        let progress = self.messages.progress();
        let first = self.first_bytes.unwrap_or_else(|| progress.read());
        let all = progress.total().saturating_sub(first).max(1);
        progress.read().saturating_sub(first) as f64 / all as f64
    }

    /// The next message to be played; `None` behind the last.
    pub(super) fn next(&mut self) -> Result<Option<Cue>, Error> {
        loop {
            if let Some(cue) = self.ready.pop_front() {
                return Ok(Some(cue));
            }
            let Some(message) = self.messages.next_message()? else { return Ok(None) };
            self.first_bytes.get_or_insert_with(|| self.messages.progress().read());
            self.take(message);
        }
    }

    /// Takes a message, where it is one to be played.
    fn take(&mut self, message: Message) {
        let Message { topic, received_ns, frame } = message;
        let (unit, input) = match &topic {
            Topic::Raw(unit, stream) => (unit.clone(), Input::Raw(*stream)),
            Topic::Reference(unit) => (unit.clone(), Input::Reference),
            _ => return,
        };
        let decoded = Decoded::of_input(input, &frame).ok();
        let times = decoded.as_ref().and_then(Decoded::times);
        let (load, bytes, begins_series) = self.load(&unit, decoded, frame);
        // Its time is noted also where it is left out: a filter does not move what is left.
        let at_ns = self.schedule.due(Some(&unit), received_ns, times.map(|[_, last]| last));
        if let (Load::Gyro(_), Some([first, _])) = (load, times) {
            self.report_health(&unit, at_ns, first);
        }
        if wanted(&self.options.topics, &topic) {
            let frame = Arc::new(Frame { input, bytes: bytes.into(), load });
            self.ready.push_back(Cue { unit, at_ns, frame, begins_series });
        }
    }

    /// What a frame carries, its bytes with a series of this player, and whether it begins a series.
    fn load(&mut self, unit: &UnitId, decoded: Option<Decoded>, frame: Vec<u8>) -> (Load, Vec<u8>, bool) {
        let load = match decoded {
            Some(Decoded::Gyro(batch)) => return self.gyro(unit, batch, frame),
            Some(Decoded::Accel(batch)) => Load::Accel(batch.ticks.len() as u64),
            Some(Decoded::Temperature(batch)) => {
                let channels = self.channels.entry(unit.clone()).or_default();
                channels.extend(batch.readings.iter().map(|reading| reading.channel));
                Load::Temperature(batch.readings.len() as u64)
            }
            Some(Decoded::Health(batch)) => Load::Health(batch.ticks.len() as u64),
            Some(Decoded::Reference(_)) => Load::Reference,
            _ => Load::Unreadable,
        };
        (load, frame, false)
    }

    fn gyro(&mut self, unit: &UnitId, mut batch: GyroBatch, frame: Vec<u8>) -> (Load, Vec<u8>, bool) {
        let (Some(first), Some(last)) = (batch.ticks.first(), batch.ticks.last()) else {
            return (Load::Unreadable, frame, false);
        };
        let (series, begins) = self.series.number(unit, first, last);
        let ticks = GyroTicks { series, first: first.sequence, count: batch.ticks.len() as u64 };
        batch.ticks.iter_mut().for_each(|tick| tick.series = series);
        // What could be decoded can be encoded.
        (Load::Gyro(ticks), codec::encode(&batch).unwrap_or(frame), begins)
    }

    /// Adds the health readings that are due before a gyro batch.
    fn report_health(&mut self, unit: &UnitId, at_ns: i64, time: Timestamp) {
        if self.options.health.is_empty() || self.health_due.is_some_and(|due| time < due) {
            return;
        }
        self.health_due = Some(time + HEALTH_INTERVAL);
        let tick = HealthTick { time_ns: time.as_ns(), readings: self.options.health.clone() };
        // Readings that were taken from a command line fit a frame: see the check of their number there.
        let Ok(bytes) = codec::encode(&HealthBatch { ticks: vec![tick] }) else { return };
        let input = Input::Raw(RawStream::Health);
        if wanted(&self.options.topics, &Topic::Raw(unit.clone(), RawStream::Health)) {
            let frame = Arc::new(Frame { input, bytes: bytes.into(), load: Load::Health(1) });
            self.ready.push_back(Cue { unit: unit.clone(), at_ns, frame, begins_series: false });
        }
    }
}

fn schedule(options: &PlayOptions) -> Schedule {
    match options.files {
        LogFiles::Recordings(_) => Schedule::of_recordings(options.clock),
        LogFiles::Text { .. } => Schedule::of_text(),
    }
}

/// Whether messages of a topic are taken.
pub(crate) fn wanted(topics: &[OwnedKeyExpr], topic: &Topic) -> bool {
    if topics.is_empty() {
        return true;
    }
    let key = topic.key();
    keyexpr::new(key.as_str()).is_ok_and(|key| topics.iter().any(|wanted| wanted.intersects(key)))
}

/// Numbers for the series of a log: each of its series becomes one of this player, in the order of their first batches; one whose
/// ticks begin again becomes another.
#[derive(Debug)]
struct SeriesNumbers {
    next: u64,
    // Looked up only.
    known: HashMap<(UnitId, u64), Known>,
    last: HashMap<UnitId, u64>,
}

/// A series of the log.
#[derive(Debug)]
struct Known {
    number: u64,
    /// Sequence number of its first tick.
    first: u64,
    /// Sequence number and end of its newest.
    newest: (u64, Timestamp),
}

impl Known {
    /// Whether a batch of the series begins it again, rather than to come late or twice.
    fn begins_again(&self, first: &GyroTick, last: &GyroTick) -> bool {
        let (newest, end_time) = self.newest;
        // The same batch again has the same end; a run as long as the one before it has a later one.
        if first.sequence > newest || (last.sequence == newest && last.end_time <= end_time) {
            return false;
        }
        let behind = newest - if last.sequence < newest { last.sequence } else { first.sequence };
        behind >= ANEW || first.sequence == self.first || first.end_time > end_time
    }
}

impl SeriesNumbers {
    fn from(first: u64) -> Self {
        Self { next: first, known: HashMap::new(), last: HashMap::new() }
    }

    /// The number of the series of a unit's batch, and whether it is another than the unit's last one.
    fn number(&mut self, unit: &UnitId, first: &GyroTick, last: &GyroTick) -> (u64, bool) {
        let newest = (last.sequence, last.end_time);
        let series = (unit.clone(), first.series);
        let number = match self.known.get_mut(&series) {
            Some(known) if !known.begins_again(first, last) => {
                known.newest = known.newest.max(newest);
                known.number
            }
            _ => {
                let number = self.next;
                self.next = self.next.wrapping_add(1);
                self.known.insert(series, Known { number, first: first.sequence, newest });
                number
            }
        };
        (number, self.last.insert(unit.clone(), number) != Some(number))
    }

    /// Whatever comes is of new series.
    fn begin_anew(&mut self) {
        self.known.clear();
        self.last.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restart_stays_one_and_another_pass_is_a_new_one() {
        let (a, b) = (UnitId::new("A").unwrap(), UnitId::new("B").unwrap());
        let mut numbers = SeriesNumbers::from(100);
        let tick = |series, sequence| GyroTick { series, sequence, ..GyroTick::default() };
        let first = [(&a, 0, 7), (&b, 0, 7), (&a, 0, 8), (&a, 900, 0), (&a, 0, 9), (&a, 900, 1)]
            .map(|(unit, series, sequence)| (unit, tick(series, sequence)))
            .map(|(unit, tick)| numbers.number(unit, &tick, &tick));
        assert_eq!(first, [(100, true), (101, true), (100, false), (102, true), (100, true), (102, true)]);
        numbers.begin_anew();
        assert_eq!(numbers.number(&a, &tick(0, 9), &tick(0, 9)), (103, true));
    }

    #[test]
    fn a_log_whose_numbers_begin_again_goes_on_in_another_series() {
        let unit = UnitId::new("A").unwrap();
        // Number of a batch's first tick and its end (ms); batches are of ten ticks, one each millisecond.
        let series = |batches: &[(u64, i64)]| {
            let mut numbers = SeriesNumbers::from(0);
            let tick = |sequence, ms| {
                let end_time = Timestamp::from_ns(ms * 1_000_000);
                GyroTick { sequence, end_time, ..GyroTick::default() }
            };
            let number = |&(first, ms): &(u64, i64)| {
                numbers.number(&unit, &tick(first, ms), &tick(first + 9, ms + 9)).0
            };
            batches.iter().map(number).collect::<Vec<_>>()
        };
        assert_eq!(series(&[(50, 50), (60, 60), (50, 50), (60, 60)]), [0, 0, 1, 1], "a short log twice");
        assert_eq!(series(&[(50, 50), (900, 900), (60, 60), (70, 70)]), [0, 0, 1, 1], "far behind");
        assert_eq!(series(&[(50, 50), (90, 90), (0, 100), (10, 110)]), [0, 0, 1, 1], "time goes on");
        assert_eq!(series(&[(0, 0), (0, 10), (0, 10), (0, 20)]), [0, 1, 1, 2], "runs of one batch each");
        assert_eq!(series(&[(50, 50), (50, 50), (60, 60), (80, 80), (70, 70), (70, 70), (90, 90)]), [0; 7]);
    }

    #[test]
    fn keys_are_filtered_as_subscribers_do() {
        let topic = Topic::of("imu/A-1/raw/gyro");
        let keys = |texts: &[&str]| -> Vec<_> {
            texts.iter().map(|text| OwnedKeyExpr::new(*text).unwrap()).collect()
        };
        assert!(wanted(&[], &topic));
        assert!(wanted(&keys(&["imu/*/raw/gyro"]), &topic));
        assert!(wanted(&keys(&["imu/B/**", "imu/A-1/**"]), &topic));
        assert!(!wanted(&keys(&["imu/*/raw/accel"]), &topic));
    }
}
