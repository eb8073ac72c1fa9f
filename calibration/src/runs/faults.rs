//! Columns of readings that nothing can be made of, whatever is to be made of them.

use crate::axes::sensor_name;
use crate::numbers::{median, percentile, real};
use crate::report::six;

/// Share of readings that may be no number.
const LARGEST_MISSING: f64 = 0.01;

/// Times the range of nine in ten readings from the middle one at which a reading is far from all others.
const FAR: f64 = 10.0;

/// What is wrong with the readings of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// All of them are this.
    Dead(f64),
    /// The same in every tick as another sensor, by number.
    Twin(usize),
    /// How many are not numbers, and of how many.
    Missing([usize; 2]),
}

impl Fault {
    /// Of a column by itself.
    pub fn of(column: &[f64]) -> Option<Self> {
        let missing = missing(column);
        if real(missing) > LARGEST_MISSING * real(column.len()) {
            return Some(Self::Missing([missing, column.len()]));
        }
        dead(column).map(Self::Dead)
    }

    /// Of one column beside those before it.
    pub fn among(columns: &[Vec<f64>], index: usize) -> Option<Self> {
        let column = columns.get(index)?;
        let equal = |other: &Vec<f64>| {
            other.len() == column.len() && other.iter().zip(column).all(|(a, b)| a.total_cmp(b).is_eq())
        };
        Self::of(column).or_else(|| columns[..index].iter().position(equal).map(Self::Twin))
    }

    /// In words; the sensor is one of so many of a kind.
    pub fn words(self, kind: &str, of: usize) -> String {
        match self {
            Self::Dead(value) => format!(
                "every reading is {}: the sensor is dead, or the mapping names the wrong column",
                six(value)
            ),
            Self::Twin(twin) => format!(
                "the same in every tick as {kind} {}: does the mapping have a column twice?",
                sensor_name(twin, of)
            ),
            Self::Missing([missing, all]) => format!(
                "{missing} of {all} readings are not numbers, at most {} % may be: look for a broken column or a sensor beyond its \
                 limit, or cut the log with --start and --duration",
                LARGEST_MISSING * 100.0
            ),
        }
    }
}

/// How many readings are not numbers.
pub fn missing(column: &[f64]) -> usize {
    column.iter().filter(|reading| !reading.is_finite()).count()
}

/// Readings of a sensor at rest that are far from all others: their ticks.
pub fn far(column: &[f64]) -> Vec<usize> {
    let [low, high] = [5, 95].map(|percent| percentile(column.iter().copied(), percent));
    let (middle, limit) = (median(column), FAR * (high - low));
    let is_far = |tick: &usize| limit > 0.0 && (column[*tick] - middle).abs() > limit;
    (0..column.len()).filter(is_far).collect()
}

/// The one reading that a column has; `None` where it changes, or has none.
pub fn dead(column: &[f64]) -> Option<f64> {
    let mut good = column.iter().filter(|reading| reading.is_finite());
    let first = good.next()?;
    good.all(|reading| (reading - first).abs() <= 0.0).then_some(*first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_told_by_kind() {
        let wave: Vec<f64> = (0..200).map(|k| libm::sin(f64::from(k))).collect();
        let mut holed = wave.clone();
        holed[7] = f64::NAN;
        let mut flat = vec![2.5; 200];
        flat[3] = f64::NAN;
        let columns = [wave.clone(), holed.clone(), flat, vec![f64::NAN; 200], wave, holed];
        let found: Vec<_> = (0..columns.len()).map(|index| Fault::among(&columns, index)).collect();
        let twin = |of| Some(Fault::Twin(of));
        let wanted = [None, None, Some(Fault::Dead(2.5)), Some(Fault::Missing([200, 200])), twin(0), twin(1)];
        assert_eq!(found, wanted);
        assert_eq!(Fault::of(&[]), None);
        insta::assert_snapshot!(Fault::Twin(3).words("gyro", 6));
    }

    #[test]
    fn far_readings_are_found_beside_drift_noise_and_coarse_counts() {
        let mut column: Vec<f64> =
            (0..2000).map(|k| libm::sin(f64::from(k * k)) + 1e-3 * f64::from(k)).collect();
        assert!(far(&column).is_empty());
        column[7] = 99.0;
        column[1500] = f64::NAN;
        column[1999] = -99.0;
        assert_eq!(far(&column), [7, 1999]);
        let counts: Vec<f64> = (0..2000).map(|k| f64::from(u8::from(k % 100 == 0))).collect();
        assert_eq!((far(&counts), far(&[])), (Vec::new(), Vec::new()));
    }
}
