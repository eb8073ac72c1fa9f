//! What a log says of its mode switches before anything is corrected: how many, how long the light is lost, and the
//! dither frequency behind them.

use std::collections::VecDeque;

use isotherm_correction::sample::{GyroTick, LasingMode, OutputKind};

use super::seen::Seen;
use crate::error::Error;
use crate::numbers::{median, real, scatter, seconds};
use crate::runs::Run;

/// Ticks before a switch that show what a reading is like.
const BEFORE: usize = 16;
/// Fewest and most ticks behind a switch that are kept, and the time that they should cover (s).
const AFTER: [usize; 2] = [24, 400];
const AFTER_S: f64 = 1.0;
/// Ticks behind a command among which the lost ones are looked for.
const SEARCH: usize = 16;
/// A reading this many standard deviations off is not the gyro's.
const FAR_SIGMAS: f64 = 8.0;
/// Share of the dither's counts that a half-period difference may be off, and that a reading may be off.
const DITHER_SHARES: [f64; 2] = [0.5, 0.1];
/// Counts that a reading may be off where there is no dither to compare with.
const FAR_COUNTS: f64 = 6.0;
/// Share of the switches that must show a lost tick.
const LOST_SHARE: f64 = 0.02;

/// The ticks behind one switch.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Behind {
    /// Whether a reading was not the gyro's, by ticks from the command on.
    pub lost: Vec<bool>,
    /// Mean duration of a tick (s).
    pub tick_s: f64,
    /// Dither frequency (Hz) by sensor and tick from the command on; empty where the instrument has no half-period counts.
    pub dither_hz: Vec<Vec<f64>>,
    /// Whether the negative half comes first in most of these ticks, by sensor, likewise.
    pub is_negative_first: Vec<bool>,
}

/// All switches of some runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Switches {
    /// What the readings are; `None` without ticks.
    pub output: Option<OutputKind>,
    /// Whether every reading is a whole number.
    pub whole: bool,
    /// Number of gyros.
    pub sensors: usize,
    /// Gyro ticks in all.
    pub ticks: u64,
    /// Mean duration of a tick (s).
    pub tick_s: f64,
    /// Ticks in the plus mode, in the minus mode, and without a mode.
    pub of_mode: [u64; 3],
    /// Ticks with a phase of the slow meander of each sign.
    pub of_meander: [u64; 2],
    /// Times between switches (s).
    pub between_s: Vec<f64>,
    /// What is behind each.
    pub behind: Vec<Behind>,
    /// What each gyro's readings are like.
    pub seen: Vec<Seen>,
    /// By how much each change of the mode comes behind the switch command that is nearest to it (s); empty without commands.
    pub late_s: Vec<f64>,
}

impl Switches {
    /// Reads the raw ticks of some runs.
    ///
    /// # Errors
    /// As [`Run::gyro_ticks`].
    pub fn of(runs: &[Run]) -> Result<Self, Error> {
        let mut found = Self { whole: true, ..Self::default() };
        let mut length_s = 0.0;
        for run in runs {
            let mut eye = Eye::default();
            found.seen.iter_mut().for_each(Seen::begin);
            let mut begin = None;
            run.gyro_ticks(|output, tick| {
                found.output.get_or_insert(output);
                found.whole &= tick
                    .readings
                    .iter()
                    .filter(|reading| reading.is_finite())
                    .all(|reading| reading.fract() == 0.0);
                found.sensors = found.sensors.max(tick.readings.len());
                found.ticks += 1;
                length_s += tick.duration.as_s();
                let now = tick.end_time.as_ns();
                let since_s = seconds(now.saturating_sub(*begin.get_or_insert(now)));
                found.seen.resize(found.sensors, Seen::default());
                eye.take(tick, &mut found);
                let kind = (eye.is_calm(), output == OutputKind::Counts);
                for (sensor, seen) in found.seen.iter_mut().enumerate() {
                    seen.take(tick, sensor, since_s, kind);
                }
            })?;
            eye.end(&mut found);
        }
        found.tick_s = if found.ticks == 0 { 0.0 } else { length_s / real(found.ticks) };
        Ok(found)
    }

    /// Ticks that a switch loses: the last one behind the command that more than a chance few of the switches lose.
    pub fn transition_ticks(&self) -> usize {
        let count = |tick: usize| {
            let lost = self.behind.iter().filter(|behind| behind.lost.get(tick).is_some_and(|lost| *lost));
            real(lost.count())
        };
        let least = (LOST_SHARE * real(self.behind.len())).max(1.0);
        (0..SEARCH).rev().find(|&tick| count(tick) >= least).map_or(0, |tick| tick + 1)
    }

    /// Usual time between switches (s).
    pub fn period_s(&self) -> f64 {
        median(&self.between_s)
    }

    /// Share by which one mode has more ticks than the other, 0…1.
    pub fn unbalance(&self) -> f64 {
        let [plus, minus, _] = self.of_mode.map(real);
        if plus + minus > 0.0 { (plus - minus).abs() / (plus + minus) } else { 1.0 }
    }

    /// Whether the producer says which phase the slow meander has.
    pub fn has_meander(&self) -> bool {
        self.of_meander.iter().all(|ticks| *ticks > 0)
    }
}

/// Watches the ticks of one run.
#[derive(Debug, Default)]
struct Eye {
    mode: Option<LasingMode>,
    is_commanded: bool,
    commands_ns: Vec<i64>,
    changes_ns: Vec<i64>,
    switched_ns: Option<i64>,
    before: VecDeque<GyroTick>,
    behind: Option<Vec<GyroTick>>,
}

impl Eye {
    fn take(&mut self, tick: &GyroTick, found: &mut Switches) {
        let [plus, minus, none] = &mut found.of_mode;
        *match tick.mode {
            Some(LasingMode::Plus) => plus,
            Some(LasingMode::Minus) => minus,
            None => none,
        } += 1;
        if let Some(phase) = tick.meander {
            let [plus, minus] = &mut found.of_meander;
            *if phase == LasingMode::Plus { plus } else { minus } += 1;
        }
        if tick.switch_command && !self.is_commanded {
            self.commands_ns.push(tick.end_time.as_ns());
        }
        self.is_commanded = tick.switch_command;
        if tick.mode.is_some() && self.mode.is_some() && tick.mode != self.mode {
            self.close(found);
            let now = tick.end_time.as_ns();
            self.changes_ns.push(now);
            if let Some(before) = self.switched_ns {
                found.between_s.push(seconds(now - before));
            }
            self.switched_ns = Some(now);
            self.behind = Some(Vec::new());
        }
        self.mode = tick.mode.or(self.mode);
        if let Some(behind) = &mut self.behind {
            behind.push(tick.clone());
            if behind.len() >= wanted(tick.duration.as_s()) {
                self.close(found);
            }
        } else {
            if self.before.len() == BEFORE {
                self.before.pop_front();
            }
            self.before.push_back(tick.clone());
        }
    }

    /// Whether no switch is near.
    fn is_calm(&self) -> bool {
        self.behind.as_ref().is_none_or(|behind| behind.len() >= SEARCH)
    }

    /// Ends the run.
    fn end(&mut self, found: &mut Switches) {
        self.close(found);
        let nearest = |change: &i64| {
            let next = self.commands_ns.partition_point(|command| command < change);
            let near = self.commands_ns.get(next.saturating_sub(1)..)?.iter().take(2);
            near.map(|command| change - command).min_by_key(|late| late.abs())
        };
        found.late_s.extend(self.changes_ns.iter().filter_map(nearest).map(seconds));
    }

    /// Ends what is behind a switch.
    fn close(&mut self, found: &mut Switches) {
        let Some(behind) = self.behind.take() else { return };
        let sensors = behind.first().map_or(0, |tick| tick.readings.len());
        let limits: Vec<Limits> =
            (0..sensors).map(|sensor| Limits::of(&self.before, &behind, sensor)).collect();
        let lost =
            |tick: &GyroTick| limits.iter().enumerate().any(|(sensor, limits)| limits.beyond(tick, sensor));
        let seconds: f64 = behind.iter().map(|tick| tick.duration.as_s()).sum();
        found.behind.push(Behind {
            lost: behind.iter().take(SEARCH).map(lost).collect(),
            tick_s: seconds / real(behind.len().max(1)),
            dither_hz: (0..sensors)
                .filter_map(|sensor| behind.iter().map(|tick| dither_hz(tick, sensor)).collect())
                .collect(),
            is_negative_first: (0..sensors)
                .filter_map(|sensor| behind.iter().map(|tick| difference(tick, sensor)).collect())
                .map(|differences: Vec<f64>| median(&differences) < 0.0)
                .collect(),
        });
        self.before.clear();
    }
}

/// What readings of one gyro are like around a switch.
struct Limits {
    reading: f64,
    far: f64,
    difference: Option<f64>,
}

impl Limits {
    /// From the ticks before it; the first switch of a run may have too few, then from the later ones behind it.
    fn of(before: &VecDeque<GyroTick>, behind: &[GyroTick], sensor: usize) -> Self {
        let near: Vec<&GyroTick> = if before.len() >= BEFORE / 2 {
            before.iter().collect()
        } else {
            behind.iter().skip(SEARCH).collect()
        };
        let readings: Vec<f64> = near.iter().filter_map(|tick| tick.readings.get(sensor).copied()).collect();
        let differences: Vec<f64> = near.iter().filter_map(|tick| difference(tick, sensor)).collect();
        let sigma = scatter(&readings);
        let difference = (!differences.is_empty()).then(|| median(&differences).abs());
        let floor = difference.map_or(FAR_COUNTS, |counts| DITHER_SHARES[1] * counts.abs());
        let floor =
            if readings.iter().filter(|reading| reading.is_finite()).all(|reading| reading.fract() == 0.0) {
                floor
            } else {
                0.0
            };
        Self { reading: median(&readings), far: floor.max(FAR_SIGMAS * sigma), difference }
    }

    fn beyond(&self, tick: &GyroTick, sensor: usize) -> bool {
        // A reading that is no number is another trouble, which is told elsewhere.
        let reading =
            tick.readings.get(sensor).is_some_and(|reading| (reading - self.reading).abs() > self.far);
        let halves = match (self.difference, difference(tick, sensor)) {
            // The half that came first before the switch may come second after it.
            (Some(usual), Some(now)) => (now.abs() - usual).abs() > DITHER_SHARES[0] * usual,
            _ => false,
        };
        reading || halves
    }
}

/// Counts of a tick's first half less those of its second: negative where the dither's negative half comes first.
fn difference(tick: &GyroTick, sensor: usize) -> Option<f64> {
    tick.half_periods.get(sensor).map(|counts| f64::from(counts.positive) - f64::from(counts.negative))
}

/// Dither frequency of a gyro in a tick (Hz), where it has half-period counts (models §6).
pub(super) fn dither_hz(tick: &GyroTick, sensor: usize) -> Option<f64> {
    let seconds = tick.duration.as_s();
    difference(tick, sensor).filter(|_| seconds > 0.0).map(|counts| counts.abs() / seconds)
}

/// How many ticks behind a switch are kept.
fn wanted(tick_s: f64) -> usize {
    let [least, most] = AFTER;
    (least..most).find(|count| real(*count) * tick_s >= AFTER_S).unwrap_or(most)
}
