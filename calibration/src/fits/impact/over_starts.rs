//! How the constant part differs from start to start, from the means of several logs (002).
//!
//! The Earth's rate is the same in all of them, as long as the unit stands as it stood: it drops out of the scatter.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::fits::drift::columns::Columns;
use crate::numbers::{Size, real};

/// Probability beyond either end of an interval.
const BEYOND: f64 = 0.025;

/// Standard deviation over starts of one gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// It (°/h).
    pub sigma: f64,
    /// Its 95 % interval (°/h).
    pub interval: [f64; 2],
}

/// Mean rate of each gyro over a log (°/h).
pub fn means(columns: &Columns) -> [f64; 3] {
    [0, 1, 2].map(|axis| columns.values.get(axis).map_or(f64::NAN, |values| Size::of(values).mean))
}

/// Standard deviations of the gyros' means, a row for each start; `None` for fewer than two.
pub fn sigmas(starts: &[[f64; 3]]) -> Option<[Found; 3]> {
    let degrees = real(starts.len().checked_sub(1).filter(|degrees| *degrees > 0)?);
    let law = ChiSquared::new(degrees).ok()?;
    Some([0, 1, 2].map(|axis| {
        let mean = starts.iter().map(|start| start[axis]).sum::<f64>() / (degrees + 1.0);
        let squares: f64 = starts.iter().map(|start| (start[axis] - mean) * (start[axis] - mean)).sum();
        let end = |probability: f64| (squares / law.inverse_cdf(probability)).sqrt();
        Found { sigma: (squares / degrees).sqrt(), interval: [end(1.0 - BEYOND), end(BEYOND)] }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::noise;

    #[test]
    fn five_starts_come_to_what_a_table_says() {
        // 1…5: s² = 2.5; χ² of four degrees: 0.48442 and 11.1433.
        let starts: Vec<[f64; 3]> =
            [1.0, 2.0, 3.0, 4.0, 5.0].iter().map(|x| [*x, 10.0 + 2.0 * x, 7.0]).collect();
        let [x, y, z] = sigmas(&starts).unwrap();
        assert!((x.sigma - 2.5_f64.sqrt()).abs() < 1e-12 && (y.sigma - 10.0_f64.sqrt()).abs() < 1e-12);
        for (found, expected) in x.interval.into_iter().zip([10.0 / 11.1433, 10.0 / 0.48442]) {
            assert!((found / f64::sqrt(expected) - 1.0).abs() < 1e-4, "{found}");
        }
        assert!(z.sigma < 1e-15);
        assert_eq!(sigmas(&starts[..1]), None);
    }

    #[test]
    fn the_interval_holds_the_truth_as_often_as_it_says() {
        let mut noise = noise();
        let inside = (0..400)
            .filter(|_| {
                let starts: Vec<[f64; 3]> = (0..6).map(|_| [0.02 * noise(), 0.0, 0.0]).collect();
                let [low, high] = sigmas(&starts).unwrap()[0].interval;
                (low..=high).contains(&0.02)
            })
            .count();
        assert!((365..=395).contains(&inside), "{inside} of 400");
    }
}
