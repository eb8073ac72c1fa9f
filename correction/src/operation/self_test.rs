//! Self-test of the instrument (models §7): calibration, gyros, accelerometers, temperature channels, and what the
//! producer reports of itself.
//!
//! It runs for [`SelfTest::LENGTH`] of event time. A sensor is alive while its readings are finite, within the input range,
//! and not one and the same value for longer than [`SelfTest::LONGEST_STANDSTILL`].

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::calibration::Calibration;
use crate::observation::Observation;
use crate::sample::{ChannelName, MAX_SENSORS, SensorFlags, Sensors};
use crate::units::{Span, Timestamp};

/// Share of a sensor's ticks that must be alive (%).
const ALIVE_PERCENT: [f64; 2] = [95.0, 100.0];

/// A voltage that the producer reports, such as the half-wave voltage of a gyro's mode control.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SelfTestVoltage {
    /// Name on the raw health topic.
    pub name: ChannelName,
    /// Smallest and largest good value (V).
    pub range_v: [f64; 2],
}

/// A counter that the producer reports, such as one of its own errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SelfTestCounter {
    /// Name on the raw health topic.
    pub name: ChannelName,
    /// Largest good increase over the self-test.
    pub max_increase: f64,
}

/// What the producer's own readings must be.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SelfTestParts {
    /// Voltages, with their limits.
    pub voltages: Vec<SelfTestVoltage>,
    /// Counters, with their limits.
    pub counters: Vec<SelfTestCounter>,
}

/// What the producer reports of itself: a voltage (V) or a counter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HealthReading {
    /// Name of the quantity.
    pub name: ChannelName,
    /// Time of the reading on the producer's clock.
    pub time: Timestamp,
    /// Its value.
    pub value: f64,
}

/// What is checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CheckItem {
    /// A calibration is in force; its value is the revision counter.
    Calibration,
    /// Gyro of this index is alive; its value is the share of live ticks (%).
    Gyro(usize),
    /// Accelerometer of this index is alive; likewise.
    Accel(usize),
    /// Temperature channel of this name is alive; its value is the smoothed temperature (°C).
    Temperature(ChannelName),
    /// Voltage of this name; its value (V) is the one nearest to a limit, or furthest beyond it.
    Voltage(ChannelName),
    /// Increase of the counter of this name over the test: two readings at least.
    Counter(ChannelName),
}

/// One check with its measured value and limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CheckResult {
    /// What was checked.
    pub item: CheckItem,
    /// What was measured; `None` where nothing came.
    pub value: Option<f64>,
    /// Smallest and largest good value, in the item's unit of measure.
    pub limits: [f64; 2],
    /// Whether it is good.
    pub passed: bool,
}

/// Result of a self-test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SelfTestReport {
    /// End of its last tick; `None` where no tick came.
    pub ended: Option<Timestamp>,
    /// Event time that it looked at.
    pub length: Span,
    /// Every check, in the order of the calibration.
    pub checks: Vec<CheckResult>,
}

impl SelfTestReport {
    /// Whether every check is good.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.checks.iter().all(|check| check.passed)
    }

    /// Report on a unit without a calibration: there is nothing to check it against.
    #[must_use]
    pub fn uncalibrated() -> Self {
        Self { ended: None, length: Span::ZERO, checks: [calibration_check(0)].into() }
    }
}

/// Whether one sensor moves.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Liveness {
    last: f64,
    since: Timestamp,
    live: u64,
}

impl Liveness {
    fn observe(&mut self, reading: f64, flags: SensorFlags, first: bool, time: Timestamp) {
        if first || reading.to_bits() != self.last.to_bits() {
            *self = Self { last: reading, since: time, ..*self };
        }
        let bad = SensorFlags::NOT_FINITE | SensorFlags::OVERRANGE | SensorFlags::EXCLUDED;
        let moves = time.since(self.since) <= SelfTest::LONGEST_STANDSTILL;
        self.live += u64::from(reading.is_finite() && moves && !flags.intersects(bad));
    }

    fn result(self, item: CheckItem, ticks: u64) -> CheckResult {
        #[expect(clippy::cast_precision_loss, reason = "ticks of a few seconds")]
        let value = (ticks > 0).then(|| 100.0 * self.live as f64 / ticks as f64);
        within(item, value, ALIVE_PERCENT)
    }
}

/// What the producer reported under one name.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Reported {
    item: CheckItem,
    name: ChannelName,
    limits: [f64; 2],
    /// Of a counter: where it began.
    first: Option<f64>,
    /// Of a voltage the worst so far, of a counter the last behind the first: one reading alone says nothing of an increase.
    counts: Option<f64>,
}

impl Reported {
    fn take(&mut self, value: f64) {
        if matches!(self.item, CheckItem::Counter(_)) {
            self.counts = self.first.map(|_| value);
            self.first.get_or_insert(value);
            return;
        }
        let [low, high] = self.limits;
        let excess =
            |value: f64| if value.is_nan() { f64::INFINITY } else { (low - value).max(value - high) };
        let stays = |counts: &f64| excess(*counts) > excess(value);
        self.counts = self.counts.filter(stays).or(Some(value));
    }

    fn result(&self) -> CheckResult {
        let value = self.counts.map(|counts| counts - self.first.unwrap_or(0.0));
        within(self.item, value, self.limits)
    }
}

/// A self-test that is running.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct SelfTest {
    start: Option<Timestamp>,
    end: Timestamp,
    ticks: u64,
    accel_ticks: u64,
    gyros: Sensors<Liveness>,
    accels: Sensors<Liveness>,
    reported: Vec<Reported>,
}

impl SelfTest {
    /// Event time that it takes; the clock ends it after 14 s where no ticks come.
    pub const LENGTH: Span = Span::from_ms(10_000);
    /// Longest time that a live sensor gives one and the same reading.
    pub const LONGEST_STANDSTILL: Span = Span::from_ms(1000);

    /// Begins with the next tick.
    #[must_use]
    pub fn new(calibration: &Calibration) -> Self {
        let fresh = |sensors: usize| (0..sensors.min(MAX_SENSORS)).map(|_| Liveness::default()).collect();
        let SelfTestParts { voltages, counters } = calibration.self_test();
        let reported = |item, name, limits| Reported { item, name, limits, first: None, counts: None };
        let voltages = voltages.iter().map(|it| reported(CheckItem::Voltage(it.name), it.name, it.range_v));
        let counters =
            counters.iter().map(|it| reported(CheckItem::Counter(it.name), it.name, [0.0, it.max_increase]));
        Self {
            gyros: fresh(calibration.gyro_count()),
            accels: fresh(calibration.accel_count()),
            reported: voltages.chain(counters).collect(),
            ..Self::default()
        }
    }

    /// Takes one tick; whether the test is over.
    pub fn observe(&mut self, seen: &Observation) -> bool {
        let start = *self.start.get_or_insert(seen.end_time - seen.duration);
        self.end = seen.end_time;
        for (liveness, gyro) in self.gyros.iter_mut().zip(seen.gyros.iter()) {
            // Over a mode switch a gyro may well give nothing.
            if seen.settled || self.ticks == 0 {
                liveness.observe(gyro.reading, gyro.flags, self.ticks == 0, seen.end_time);
            } else {
                *liveness = Liveness { since: seen.end_time, live: liveness.live + 1, ..*liveness };
            }
        }
        self.ticks += 1;
        if seen.accels.count > 0 {
            for (liveness, (reading, flags)) in self.accels.iter_mut().zip(seen.accels.iter()) {
                liveness.observe(reading, flags, self.accel_ticks == 0, seen.end_time);
            }
            self.accel_ticks += 1;
        }
        seen.end_time.since(start) >= Self::LENGTH
    }

    /// Takes what the producer reports of itself, unless it is [`SelfTest::LENGTH`] away from `now`, the end of the last tick.
    pub fn health(&mut self, reading: &HealthReading, now: Option<Timestamp>) {
        let away = |now: Timestamp| reading.time.since(now).max(now.since(reading.time));
        if now.is_some_and(|now| away(now) > Self::LENGTH) {
            return;
        }
        for reported in self.reported.iter_mut().filter(|reported| reported.name == reading.name) {
            reported.take(reading.value);
        }
    }

    /// The result so far; `temperature` gives each channel's smoothed temperature (°C), where it is alive.
    #[must_use]
    pub fn report(
        &self,
        calibration: &Calibration,
        revision: u64,
        temperature: &dyn Fn(&ChannelName) -> Option<f64>,
    ) -> SelfTestReport {
        let mut checks = Vec::from([calibration_check(revision)]);
        let gyros = self.gyros.iter().enumerate();
        checks.extend(gyros.map(|(i, gyro)| gyro.result(CheckItem::Gyro(i), self.ticks)));
        let accels = self.accels.iter().enumerate();
        checks.extend(accels.map(|(i, accel)| accel.result(CheckItem::Accel(i), self.accel_ticks)));
        checks.extend(calibration.channels().iter().map(|channel| {
            let name = channel.name();
            within(CheckItem::Temperature(*name), temperature(name), channel.range_deg_c())
        }));
        checks.extend(self.reported.iter().map(Reported::result));
        let length = self.start.map_or(Span::ZERO, |start| self.end.since(start));
        SelfTestReport { ended: self.start.map(|_| self.end), length, checks }
    }
}

fn within(item: CheckItem, value: Option<f64>, limits: [f64; 2]) -> CheckResult {
    let [low, high] = limits;
    CheckResult { item, value, limits, passed: value.is_some_and(|value| (low..=high).contains(&value)) }
}

#[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ swaps")]
fn calibration_check(revision: u64) -> CheckResult {
    within(CheckItem::Calibration, Some(revision as f64), [1.0, f64::INFINITY])
}

#[cfg(test)]
mod tests;
