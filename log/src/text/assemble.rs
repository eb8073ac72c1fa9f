//! Events of rows: ticks get their number, end and duration, and everything its place in time.

use std::collections::VecDeque;

use isotherm_correction::sample::{AccelTick, GyroTick, LasingMode, OutputKind, TemperatureReading};
use isotherm_correction::unit::MAX_TICK_DURATION;
use isotherm_correction::units::{Span, Timestamp};

use super::LogEvent;
use super::resolve::{Columns, SwitchCells, TickCells};
use super::row::{GyroStates, Readings};
use super::timeline::{Timeline, Timing};
use crate::mapping::TimeMapping;

/// Longest nominal tick that stays whole: with five per cent for jitter, the core takes it.
const LONGEST_WHOLE: Span = Span::from_ns(MAX_TICK_DURATION.as_ns() / 105 * 100);

/// Place of the gyros among the open ticks.
const GYRO: usize = 0;
/// Place of the accelerometers among the open ticks.
const ACCEL: usize = 1;

/// A row's parts, before anything of it takes effect.
#[derive(Debug)]
pub(super) struct Parts {
    /// Stamp of the row (ns).
    pub(super) stamp: i64,
    /// Its sequence number, where rows have one.
    pub(super) number: Option<u64>,
    /// The gyros, where the row has them.
    pub(super) gyro: Option<(Readings, GyroStates)>,
    /// The accelerometers, where the row has them.
    pub(super) accel: Option<Readings>,
}

/// Makes events of rows.
#[derive(Debug)]
pub(super) struct Assembler {
    /// Gyro ticks.
    gyro: Timeline,
    /// Accelerometer ticks.
    accel: Timeline,
    /// The last gyro tick's mode.
    mode: Option<LasingMode>,
    /// Ticks that began and whose end is not known yet: their starts and events.
    open: [Option<(i64, LogEvent)>; 2],
    /// Events whose turn has not come.
    queue: VecDeque<LogEvent>,
    /// Events up to this time can be given; later rows have later ones.
    settled: i64,
    /// Equal parts that every tick is cut into: a slow logger's are longer than the core takes.
    parts: u32,
}

impl Assembler {
    /// No rows yet.
    pub(super) fn new(mapping: &TimeMapping) -> Self {
        let timeline = Timeline::new(mapping);
        Self {
            gyro: timeline.clone(),
            accel: timeline,
            mode: None,
            open: [None, None],
            queue: VecDeque::new(),
            settled: i64::MIN,
            parts: parts_of(mapping.tick.unwrap_or(Span::ZERO)),
        }
    }

    /// The next event whose turn has come.
    pub(super) fn next(&mut self) -> Option<LogEvent> {
        let due = self.queue.front().is_some_and(|event| event.time().as_ns() <= self.settled);
        if due { self.queue.pop_front() } else { None }
    }

    /// Makes events of a row.
    pub(super) fn take(&mut self, parts: Parts, temperatures: &[TemperatureReading], columns: &Columns) {
        let Parts { stamp, gyro, accel, .. } = parts;
        if accel.is_some() {
            self.close(ACCEL, Some(stamp), columns);
        }
        if gyro.is_some() {
            self.close(GYRO, Some(stamp), columns);
        }
        for reading in temperatures {
            self.enqueue(LogEvent::Temperature(*reading));
        }
        if let (Some(readings), Some(cells)) = (accel, &columns.accel) {
            let output = cells.output;
            let waits = self.accel.waits(readings.duration.is_some());
            let timing = self.accel.tick(stamp, readings.sequence, readings.duration);
            let tick = AccelTick {
                sequence: timing.sequence,
                end_time: Timestamp::from_ns(timing.end_ns),
                duration: timing.duration,
                readings: readings.values,
            };
            self.add(ACCEL, waits, stamp, LogEvent::Accel { output, tick }, columns);
        }
        if let (Some((readings, states)), Some(cells)) = (gyro, &columns.gyro) {
            let output = cells.ticks.output;
            let changed = matches!(cells.switch, SwitchCells::ModeChange)
                && self.mode.is_some()
                && self.mode != states.mode;
            self.mode = states.mode;
            let waits = self.gyro.waits(readings.duration.is_some());
            let timing = self.gyro.tick(stamp, readings.sequence, readings.duration);
            let tick = gyro_tick(timing, &readings, states, changed);
            self.add(GYRO, waits, stamp, LogEvent::Gyro { output, tick }, columns);
        }
        self.settled = stamp;
    }

    /// A row that could not be read, which had ticks of gyros and of accelerometers or not; `stamp` where that much of it could.
    pub(super) fn skip(&mut self, stamp: Option<i64>, had: [bool; 2], columns: &Columns) {
        self.close_all(stamp, columns);
        for (timeline, had) in [&mut self.gyro, &mut self.accel].into_iter().zip(had) {
            if had {
                timeline.skip(stamp);
            }
        }
    }

    /// There are no further rows: everything can be given.
    pub(super) fn end(&mut self, columns: &Columns) {
        self.close_all(None, columns);
        self.settled = i64::MAX;
    }

    /// Queues an event, or keeps it open until its end is known.
    fn add(&mut self, kind: usize, waits: bool, stamp: i64, mut event: LogEvent, columns: &Columns) {
        if waits {
            if let Some(open) = self.open.get_mut(kind) {
                *open = Some((stamp, event));
            }
        } else {
            to_means(&mut event, columns);
            self.enqueue_parts(event);
        }
    }

    /// Closes both open ticks.
    fn close_all(&mut self, next: Option<i64>, columns: &Columns) {
        self.close(ACCEL, next, columns);
        self.close(GYRO, next, columns);
    }

    /// Closes the open tick of a kind, whose successor begins at `next`.
    fn close(&mut self, kind: usize, next: Option<i64>, columns: &Columns) {
        let Some((start, mut event)) = self.open.get_mut(kind).and_then(Option::take) else { return };
        match &mut event {
            LogEvent::Gyro { tick, .. } => {
                tick.duration = self.gyro.until(start, next);
                tick.end_time = Timestamp::from_ns(start) + tick.duration;
            }
            LogEvent::Accel { tick, .. } => {
                tick.duration = self.accel.until(start, next);
                tick.end_time = Timestamp::from_ns(start) + tick.duration;
            }
            LogEvent::Temperature(_) => {}
        }
        to_means(&mut event, columns);
        self.enqueue_parts(event);
    }

    /// Queues a tick, in equal parts where it is too long. Sequence numbers then count the parts.
    fn enqueue_parts(&mut self, event: LogEvent) {
        if self.parts == 1 {
            return self.enqueue(event);
        }
        for number in 0..self.parts {
            let mut part = event.clone();
            let of = Part { number, parts: self.parts };
            match &mut part {
                LogEvent::Gyro { output, tick } => {
                    of.cut((&mut tick.sequence, &mut tick.end_time, &mut tick.duration));
                    of.share(*output, &mut tick.readings);
                    tick.switch_command &= number == 0;
                    // Counts of half a period cannot be parted.
                    tick.half_periods.clear();
                }
                LogEvent::Accel { output, tick } => {
                    of.cut((&mut tick.sequence, &mut tick.end_time, &mut tick.duration));
                    of.share(*output, &mut tick.readings);
                }
                LogEvent::Temperature(_) => {}
            }
            self.enqueue(part);
        }
    }

    /// Queues an event at its place in time.
    fn enqueue(&mut self, event: LogEvent) {
        let order = event.order();
        let place = self.queue.iter().rposition(|earlier| earlier.order() <= order);
        self.queue.insert(place.map_or(0, |at| at + 1), event);
    }
}

/// Equal parts that a nominal tick is cut into.
fn parts_of(tick: Span) -> u32 {
    let parts = tick.as_ns().max(1).unsigned_abs().div_ceil(LONGEST_WHOLE.as_ns().unsigned_abs());
    u32::try_from(parts).unwrap_or(u32::MAX)
}

/// One of the equal parts of a tick.
#[derive(Clone, Copy)]
struct Part {
    /// Which, from 0.
    number: u32,
    /// How many there are.
    parts: u32,
}

impl Part {
    fn cut(self, (sequence, end, duration): (&mut u64, &mut Timestamp, &mut Span)) {
        *sequence = sequence.saturating_mul(self.parts.into()).saturating_add(self.number.into());
        let begin = *end - *duration;
        let until =
            |parts: u32| Span::from_ns(duration.as_ns().saturating_mul(parts.into()) / i64::from(self.parts));
        *end = begin + until(self.number + 1);
        *duration = Span::from_ns(until(self.number + 1).as_ns() - until(self.number).as_ns());
    }

    fn share(self, output: OutputKind, readings: &mut [f64]) {
        if output == OutputKind::Counts {
            for reading in readings {
                *reading /= f64::from(self.parts);
            }
        }
    }
}

/// Divides increments by the duration of their tick.
fn to_means(event: &mut LogEvent, columns: &Columns) {
    let (cells, readings, duration) = match event {
        LogEvent::Gyro { tick, .. } => {
            (columns.gyro.as_ref().map(|gyro| &gyro.ticks), &mut tick.readings, tick.duration)
        }
        LogEvent::Accel { tick, .. } => (columns.accel.as_ref(), &mut tick.readings, tick.duration),
        LogEvent::Temperature(_) => return,
    };
    let Some(TickCells { output: OutputKind::Mean, sensors, .. }) = cells else { return };
    for (reading, (_, conversion)) in readings.iter_mut().zip(sensors) {
        if conversion.per_tick {
            *reading /= duration.as_s();
        }
    }
}

/// A gyro tick of its parts.
fn gyro_tick(timing: Timing, readings: &Readings, states: GyroStates, changed: bool) -> GyroTick {
    GyroTick {
        sequence: timing.sequence,
        end_time: Timestamp::from_ns(timing.end_ns),
        duration: timing.duration,
        readings: readings.values,
        mode: states.mode,
        switch_command: states.switch_command || changed,
        meander: states.meander,
        half_periods: states.half_periods,
        series: 0,
    }
}
