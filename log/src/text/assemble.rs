//! Events of rows: ticks get their number, end and duration, and everything its place in time.

use std::collections::VecDeque;

use isotherm_correction::sample::{AccelTick, GyroTick, LasingMode, OutputKind, TemperatureReading};
use isotherm_correction::unit::MAX_TICK_DURATION;
use isotherm_correction::units::{Span, Timestamp};

use super::LogEvent;
use super::resolve::{Columns, TickCells};
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
    /// Times that the gyro ticks' own numbers began anew: each run of them is a series.
    series: u64,
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
            series: 0,
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
        if let Some(readings) = &accel {
            self.close(ACCEL, Some((stamp, readings.sequence)), columns);
        }
        if let Some((readings, _)) = &gyro {
            self.close(GYRO, Some((stamp, readings.sequence)), columns);
        }
        for reading in temperatures {
            self.enqueue(LogEvent::Temperature(*reading));
        }
        let [of_gyros, of_accels] = &columns.ticks;
        if let (Some(readings), Some(cells)) = (accel, of_accels) {
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
        if let (Some((readings, states)), Some(cells)) = (gyro, of_gyros) {
            let output = cells.output;
            let changed = columns.by_mode && self.mode.is_some() && self.mode != states.mode;
            self.mode = states.mode;
            let waits = self.gyro.waits(readings.duration.is_some());
            self.series += u64::from(self.gyro.begins_anew(readings.sequence));
            let timing = self.gyro.tick(stamp, readings.sequence, readings.duration);
            let tick = GyroTick { series: self.series, ..gyro_tick(timing, &readings, states, changed) };
            self.add(GYRO, waits, stamp, LogEvent::Gyro { output, tick }, columns);
        }
        self.settled = stamp;
    }

    /// A row that could not be read, which had ticks of gyros and of accelerometers or not; `stamp` where that much of it could.
    pub(super) fn skip(&mut self, stamp: Option<i64>, had: [bool; 2], columns: &Columns) {
        self.close_all(stamp.map(|stamp| (stamp, None)), columns);
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
    fn close_all(&mut self, next: Option<(i64, Option<u64>)>, columns: &Columns) {
        self.close(ACCEL, next, columns);
        self.close(GYRO, next, columns);
    }

    /// Closes the open tick of a kind; `next` is when its successor begins, and the number that it states.
    fn close(&mut self, kind: usize, next: Option<(i64, Option<u64>)>, columns: &Columns) {
        let Some((start, mut event)) = self.open.get_mut(kind).and_then(Option::take) else { return };
        let timeline = if kind == GYRO { &self.gyro } else { &self.accel };
        if let Some(tick) = Tick::of(&mut event) {
            *tick.duration = timeline.until(start, next);
            *tick.end_time = Timestamp::from_ns(start) + *tick.duration;
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
            if let Some(tick) = Tick::of(&mut part) {
                tick.cut(number, self.parts);
            }
            if let LogEvent::Gyro { tick, .. } = &mut part {
                tick.switch_command &= number == 0;
                // Counts of half a period cannot be parted.
                tick.half_periods.clear();
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

/// What ticks of both kinds have.
struct Tick<'e> {
    kind: usize,
    output: OutputKind,
    sequence: &'e mut u64,
    end_time: &'e mut Timestamp,
    duration: &'e mut Span,
    readings: &'e mut [f64],
}

impl<'e> Tick<'e> {
    /// Of an event; `None` for a temperature.
    fn of(event: &'e mut LogEvent) -> Option<Self> {
        let (kind, output, sequence, end_time, duration, readings) = match event {
            LogEvent::Gyro { output, tick: GyroTick { sequence, end_time, duration, readings, .. } } => {
                (GYRO, *output, sequence, end_time, duration, readings)
            }
            LogEvent::Accel { output, tick: AccelTick { sequence, end_time, duration, readings } } => {
                (ACCEL, *output, sequence, end_time, duration, readings)
            }
            LogEvent::Temperature(_) => return None,
        };
        Some(Self { kind, output, sequence, end_time, duration, readings })
    }

    /// Cuts one of so many equal parts out of it, counted from 0.
    fn cut(self, number: u32, parts: u32) {
        let Self { output, sequence, end_time, duration, readings, .. } = self;
        *sequence = sequence.saturating_mul(parts.into()).saturating_add(number.into());
        let begin = *end_time - *duration;
        let until =
            |part: u32| Span::from_ns(duration.as_ns().saturating_mul(part.into()) / i64::from(parts));
        *end_time = begin + until(number + 1);
        *duration = Span::from_ns(until(number + 1).as_ns() - until(number).as_ns());
        if output == OutputKind::Counts {
            for reading in readings {
                *reading /= f64::from(parts);
            }
        }
    }
}

/// Divides increments by the duration of their tick.
fn to_means(event: &mut LogEvent, columns: &Columns) {
    let Some(Tick { kind, duration, readings, .. }) = Tick::of(event) else { return };
    let cells = columns.ticks.get(kind).and_then(Option::as_ref);
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
