//! What the ticks of a script carry.

use std::ops::Range;
use std::sync::Arc;

use isotherm_correction::sample::{
    AccelTick, GyroTick, HalfPeriodCounts, LasingMode, OutputKind, Readings, Sensors,
};
use isotherm_correction::units::Timestamp;

use super::Script;

/// A kind of sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Gyros.
    Gyro,
    /// Accelerometers.
    Accel,
}

/// Readings that are not what they should be.
#[derive(Debug, Clone, PartialEq)]
pub struct Odd {
    /// Kind of the sensor.
    pub kind: Kind,
    /// Which; `None`: every one.
    pub sensor: Option<usize>,
    /// In which ticks.
    pub ticks: Range<u64>,
    /// What they read instead.
    pub value: f64,
}

/// Ticks of a whole swing.
const SWING_TICKS: u64 = 40;

impl Script {
    pub(super) fn next_tick(&mut self) -> (AccelTick, GyroTick) {
        let (sequence, end_time) = (self.next, Timestamp::from_ns(self.now_ns));
        let odd = self.durations.iter().find(|(tick, _)| *tick == sequence);
        let duration = odd.map_or(self.tick, |(_, duration)| *duration);
        self.next += 1;
        self.now_ns = self.now_ns.saturating_add(self.tick.as_ns());
        let periodic = self.switches > 0 && sequence.is_multiple_of(self.switches);
        let switch_command = periodic || self.commands.contains(&sequence);
        if switch_command {
            self.mode = self.mode.reversed();
            self.since_switch = 0;
        }
        let reported = if self.since_switch < self.mode_late { self.mode.reversed() } else { self.mode };
        self.since_switch = self.since_switch.saturating_add(1);
        let readings = self.gyro_readings(sequence);
        let has_modes = self.switches > 0;
        let counts = self.calibration.gyro_output() == OutputKind::Counts;
        let half_periods = if has_modes && self.halves && counts {
            let turned = self.dither_turns && self.mode == LasingMode::Minus;
            let dither = self.dither_hz * duration.as_s() / if turned { -2.0 } else { 2.0 };
            readings.iter().map(|reading| half_periods(*reading, dither)).collect()
        } else {
            Sensors::new()
        };
        let gyro = GyroTick {
            sequence,
            end_time,
            duration,
            half_periods,
            readings,
            mode: has_modes.then_some(reported),
            switch_command,
            meander: has_modes.then(|| self.meander_of(sequence)),
            series: self.series,
        };
        let readings = self.accel_readings(sequence);
        (AccelTick { sequence, end_time, duration, readings }, gyro)
    }

    fn meander_of(&self, sequence: u64) -> LasingMode {
        match sequence.checked_div(self.meander) {
            Some(half) if half.is_multiple_of(2) => LasingMode::Plus,
            _ => LasingMode::Minus,
        }
    }

    fn gyro_readings(&mut self, sequence: u64) -> Readings {
        let calibration = Arc::clone(&self.calibration);
        let output = calibration.gyro_output();
        let mut readings: Readings = (0..calibration.gyro_count())
            .map(|sensor| self.reading(output, self.swing_of(sequence, sensor)))
            .collect();
        if let Some((gyro, from)) = self.fails
            && sequence >= from
        {
            readings[gyro] = 40.0;
        }
        self.make_odd(Kind::Gyro, sequence, &mut readings);
        readings
    }

    fn accel_readings(&mut self, sequence: u64) -> Readings {
        let calibration = Arc::clone(&self.calibration);
        let output = calibration.accel_output();
        let readings = (0..calibration.accel_count()).map(|sensor| {
            let still = if sensor == 2 { -9800.0 } else { 40.0 };
            let still = self.forces.get(sensor).copied().unwrap_or(still);
            let mean = still + self.swing_of(sequence + 7, sensor);
            let mean = if output == OutputKind::Counts { mean * 5e-3 } else { mean };
            self.reading(output, mean)
        });
        let mut readings = readings.collect::<Readings>();
        self.make_odd(Kind::Accel, sequence, &mut readings);
        readings
    }

    fn reading(&mut self, output: OutputKind, mean: f64) -> f64 {
        let scatter = self.scatter * self.dice.between_minus_one_and_one();
        match output {
            OutputKind::Counts => (mean + scatter).round(),
            OutputKind::Mean => mean * 1e-3 + scatter * 1e-6,
        }
    }

    /// A triangle: the same on every machine. Each sensor is a few ticks ahead of the one before, as in coning.
    fn swing_of(&self, sequence: u64, sensor: usize) -> f64 {
        let phase = (sequence + 7 * sensor as u64) % SWING_TICKS;
        let half = SWING_TICKS / 2;
        let up = if phase < half { phase } else { SWING_TICKS - phase };
        #[expect(clippy::cast_precision_loss, reason = "small numbers")]
        let share = up as f64 / half as f64;
        self.swing * (2.0 * share - 1.0)
    }

    fn make_odd(&self, kind: Kind, sequence: u64, readings: &mut Readings) {
        let odd = self.odd.iter().filter(|odd| odd.kind == kind && odd.ticks.contains(&sequence));
        for Odd { sensor, value, .. } in odd {
            let which = readings.iter_mut().enumerate();
            which
                .filter(|(index, _)| sensor.is_none_or(|sensor| sensor == *index))
                .for_each(|(_, reading)| *reading = *value);
        }
    }
}

/// Half-period counts: one half of the tick's own in either, beside those of the dither.
fn half_periods(reading: f64, dither: f64) -> HalfPeriodCounts {
    #[expect(clippy::cast_possible_truncation, reason = "a few thousand counts")]
    let (counts, dither) = (reading as i32, dither.round() as i32);
    let first = counts / 2;
    HalfPeriodCounts { positive: dither + first, negative: (counts - first) - dither }
}
