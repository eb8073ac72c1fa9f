//! What the raw ticks of one gyro are like as a whole: whether it lives all the time, and how fast it shows to turn.

use crate::numbers::real;
use isotherm_correction::sample::GyroTick;

/// Times the usual distance of changes after which a reading that stays is no slow one, and reversal periods that it must last.
const USUAL: f64 = 50.0;
const PERIODS: f64 = 2.0;

/// One gyro over all runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Seen {
    /// Ticks with a number.
    ticks: f64,
    /// Changes from a tick to the next.
    changes: f64,
    last: Option<f64>,
    stays: Stay,
    longest: Stay,
    /// Sum of counts, or of means times seconds, away from the switches, and the time of it (s): up to a second of them.
    calm: [f64; 2],
    /// What whole seconds came to. A reading that is lost may be anything, and spoils its own second only.
    per_second: Vec<f64>,
    /// Ticks with half-period counts, and whether one was not zero.
    halves: (u64, bool),
}

/// A time in which a reading stays the same.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stay {
    /// The reading.
    pub reading: f64,
    /// Its ticks.
    pub ticks: f64,
    /// Its beginning since that of the run (s).
    pub from_s: f64,
    /// Its end (s).
    pub to_s: f64,
}

impl Seen {
    /// A run begins.
    pub(super) fn begin(&mut self) {
        self.last = None;
        self.stays = Stay::default();
    }

    /// Takes a tick, with its time since the beginning of the run (s), and whether it is far from a switch.
    pub(super) fn take(
        &mut self,
        tick: &GyroTick,
        sensor: usize,
        since_s: f64,
        (is_calm, is_count): (bool, bool),
    ) {
        if let Some(halves) = tick.half_periods.get(sensor) {
            self.halves.0 += 1;
            self.halves.1 |= halves.positive != 0 || halves.negative != 0;
        }
        let Some(reading) = tick.readings.get(sensor).copied().filter(|reading| reading.is_finite()) else {
            return;
        };
        self.ticks += 1.0;
        if is_calm {
            let seconds = tick.duration.as_s();
            self.calm[0] += if is_count { reading } else { reading * seconds };
            self.calm[1] += seconds;
            if self.calm[1] > 1.0 - 0.5 * seconds {
                self.per_second.push(self.calm[0] / self.calm[1]);
                self.calm = [0.0; 2];
            }
        }
        if self.last.is_some_and(|last| (last - reading).abs() <= 0.0) {
            self.stays.ticks += 1.0;
            self.stays.to_s = since_s;
        } else {
            self.changes += f64::from(u8::from(self.last.is_some()));
            self.stays = Stay { reading, ticks: 1.0, from_s: since_s, to_s: since_s };
        }
        self.last = Some(reading);
        if self.stays.ticks > self.longest.ticks {
            self.longest = self.stays;
        }
    }

    /// Where the reading stays the same for far longer than it does otherwise, and over reversals of the given period (s).
    pub fn frozen(&self, period_s: f64) -> Option<Stay> {
        let usual = (self.ticks - self.longest.ticks) / self.changes;
        let lasts_s = self.longest.to_s - self.longest.from_s;
        (self.changes > 0.0 && self.longest.ticks > USUAL * usual && lasts_s > PERIODS * period_s)
            .then_some(self.longest)
    }

    /// Usual reading over a second: counts, or the mean rate (rad/s); `None` where there is none away from the switches. Of counts the
    /// middle fifth is averaged, for they are whole numbers.
    pub fn per_second(&self) -> Option<f64> {
        let mut sorted = self.per_second.clone();
        sorted.sort_by(f64::total_cmp);
        let beside = 2 * sorted.len() / 5;
        let middle = sorted.get(beside..sorted.len() - beside).filter(|middle| !middle.is_empty())?;
        Some(middle.iter().sum::<f64>() / real(middle.len()))
    }

    /// Whether its reading is the same in each run, or no number.
    pub fn is_dead(&self) -> bool {
        self.changes <= 0.0
    }

    /// Whether there are half-period counts, and all are zero.
    pub fn has_dead_halves(&self) -> bool {
        matches!(self.halves, (1.., false))
    }
}

#[cfg(test)]
mod tests {
    use isotherm_correction::units::Span;

    use super::*;

    fn seen(reading: impl Fn(u32) -> f64) -> Seen {
        let mut seen = Seen::default();
        seen.begin();
        for number in 0..10_000_u32 {
            let tick = GyroTick {
                duration: Span::from_ns(100_000_000),
                readings: [reading(number)].into_iter().collect(),
                ..GyroTick::default()
            };
            seen.take(&tick, 0, 0.1 * f64::from(number), (true, true));
        }
        seen
    }

    #[test]
    fn a_gyro_that_dies_is_told_from_a_slow_one() {
        // A count in every seventh tick.
        let slow = |number: u32| f64::from(u8::from(number.is_multiple_of(7)));
        assert_eq!(seen(slow).frozen(30.0), None);
        let dies = seen(|number| if number < 6000 { slow(number) } else { 0.0 }).frozen(30.0).unwrap();
        assert!((dies.from_s - 599.6).abs() < 0.5 && (dies.to_s - 999.9).abs() < 0.01, "{dies:?}");
        // Through a mode in which it shows next to nothing.
        let in_one_mode = |number: u32| if (number / 300).is_multiple_of(2) { slow(number) } else { 0.0 };
        assert_eq!(seen(in_one_mode).frozen(30.0), None);
        let per_second = seen(slow).per_second().unwrap();
        assert!((per_second - 10.0 / 7.0).abs() < 0.5, "{per_second}");
    }
}
