//! Whether something grows: the straight line through what was measured, with its standard error.

/// Values over time.
#[derive(Debug, Clone, Default)]
pub struct Series(Vec<(f64, f64)>);

/// A straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Mean value.
    pub mean: f64,
    /// Growth per unit of time.
    pub slope: f64,
    /// Its standard error. Neighbouring residuals are alike where a value goes up and down slowly: the number of values that counts
    /// for it is smaller by what that takes.
    pub sigma: f64,
}

impl Series {
    /// Adds a value.
    pub fn push(&mut self, time: f64, value: f64) {
        self.0.push((time, value));
    }

    /// The line through the values from a time on; `None` for fewer than four, or none apart in time.
    #[must_use]
    pub fn slope(&self, from: f64) -> Option<Slope> {
        let points: Vec<_> = self.0.iter().copied().filter(|(time, _)| *time >= from).collect();
        let count = f64::from(u32::try_from(points.len()).ok().filter(|count| *count >= 4)?);
        let mean_of = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (middle, mean) = (mean_of(|(time, _)| *time), mean_of(|(_, value)| *value));
        let spread: f64 = points.iter().map(|(time, _)| (time - middle).powi(2)).sum();
        if spread <= 0.0 {
            return None;
        }
        let slope = points.iter().map(|(time, value)| (time - middle) * (value - mean)).sum::<f64>() / spread;
        let residuals: Vec<_> =
            points.iter().map(|(time, value)| value - mean - slope * (time - middle)).collect();
        let squares: f64 = residuals.iter().map(|residual| residual.powi(2)).sum();
        let products: f64 = residuals.windows(2).map(|pair| pair.iter().product::<f64>()).sum();
        let alike = if squares > 0.0 { (products / squares).clamp(0.0, 0.99) } else { 0.0 };
        let sigma = (squares / (count - 2.0) / spread * (1.0 + alike) / (1.0 - alike)).sqrt();
        Some(Slope { mean, slope, sigma })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_and_noise_has_the_error_that_it_should() {
        let mut line = Series::default();
        (0..10).map(f64::from).for_each(|time| line.push(time, 3.0 + 2.0 * time));
        let Slope { mean, slope, sigma } = line.slope(0.0).unwrap();
        assert!((mean - 12.0).abs() < 1e-12 && (slope - 2.0).abs() < 1e-12 && sigma < 1e-12);
        assert_eq!(line.slope(7.0), None, "three values");
        // Alternately one above and one below: unlike neighbours count as independent.
        let mut noise = Series::default();
        (0..100_u32).for_each(|k| noise.push(f64::from(k), if k % 2 == 0 { 1.0 } else { -1.0 }));
        let Slope { slope, sigma, .. } = noise.slope(0.0).unwrap();
        let expected = (100.0 / 98.0 / 83_325.0_f64).sqrt();
        assert!(
            slope.abs() < 2.0 * sigma && (sigma / expected - 1.0).abs() < 1e-2,
            "{slope} {sigma} {expected}"
        );
        // Ten alike in a row count as fewer.
        let mut slow = Series::default();
        (0..100_u32).for_each(|k| slow.push(f64::from(k), if k / 10 % 2 == 0 { 1.0 } else { -1.0 }));
        assert!(slow.slope(0.0).unwrap().sigma > 2.0 * sigma);
    }
}
