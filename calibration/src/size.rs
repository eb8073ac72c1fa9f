//! How large a set of numbers is.

use crate::numbers::{ends, real};

/// Size of a set of numbers; those that are no number are left out.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Size {
    /// How many there are.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Standard deviation about the mean.
    #[serde(rename = "standard_deviation")]
    pub deviation: f64,
    /// Largest less smallest.
    pub peak_to_peak: f64,
}

impl Size {
    /// Of some values; zero without any.
    pub fn of(values: &[f64]) -> Self {
        let good = || values.iter().copied().filter(|value| value.is_finite());
        let count = good().count();
        if count == 0 {
            return Self::default();
        }
        let mean = good().sum::<f64>() / real(count);
        let about =
            |centre: f64| (good().map(|x| (x - centre) * (x - centre)).sum::<f64>() / real(count)).sqrt();
        let [low, high] = ends(good());
        Self { count, mean, rms: about(0.0), deviation: about(mean), peak_to_peak: high - low }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_no_part_of_a_size() {
        let size = Size::of(&[1.0, f64::NAN, 3.0]);
        assert_eq!((size.count, size.mean, size.deviation, size.peak_to_peak), (2, 2.0, 1.0, 2.0));
        assert_eq!(Size::of(&[]), Size::default());
    }
}
