//! Seeded drifts of the size that a document states: constant part, Markov part, trend whose rate is a Markov process.

use isotherm_correction::drift::DriftParts;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::estimate::{REFERENCE_TICKS, TICK_S};
use super::scenario::{CARES, Course, Drift, Figures, Voyage};
use crate::error::Error;
use crate::numbers::{percentile, real};
use crate::report::in_parallel;

/// Normal deviates from a seed, the same on every machine.
struct Deviates {
    generator: Pcg64Mcg,
    spare: Option<f64>,
}

impl Deviates {
    /// One stream per seed and gyro.
    fn new(seed: u64, gyro: u64) -> Self {
        let mut scramble = Pcg64Mcg::seed_from_u64(seed ^ (gyro + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        Self { generator: Pcg64Mcg::seed_from_u64(scramble.next_u64()), spare: None }
    }

    fn uniform(&mut self) -> f64 {
        real(self.generator.next_u64() >> 11) * (2.0 / 9_007_199_254_740_992.0) - 1.0
    }

    /// By Marsaglia's polar method.
    fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (x, y) = (self.uniform(), self.uniform());
            let square = x * x + y * y;
            if square < 1.0 && square > 0.0 {
                let factor = libm::sqrt(-2.0 * libm::log(square) / square);
                self.spare = Some(y * factor);
                return x * factor;
            }
        }
    }
}

/// A drift of three gyros from a seed, with a straight trend (rad/s²) beside it.
pub fn drift(voyage: &Voyage, parts: &[DriftParts; 3], trend: [f64; 3], seed: u64) -> Drift {
    let ticks = voyage.ticks();
    let mut truth = vec![[0.0; 3]; ticks];
    let mut measured = truth.clone();
    for (axis, parts) in parts.iter().enumerate() {
        let mut deviates = Deviates::new(seed, axis as u64);
        let decay = libm::exp(-TICK_S / parts.correlation_time_s);
        let drive = parts.sigma_rad_per_s * (1.0 - decay * decay).sqrt();
        let trend_decay = libm::exp(-TICK_S / parts.trend_correlation_time_s);
        let trend_drive = parts.trend_sigma_rad_per_s2 * (1.0 - trend_decay * trend_decay).sqrt();
        let white = parts.angle_random_walk_rad_per_sqrt_s / TICK_S.sqrt();
        let mut constant = parts.initial_sigma_rad_per_s * deviates.normal();
        let mut markov = parts.sigma_rad_per_s * deviates.normal();
        let mut rate = parts.trend_sigma_rad_per_s2 * deviates.normal();
        let mut reference = 0.0;
        for (index, (truth, measured)) in truth.iter_mut().zip(&mut measured).enumerate() {
            constant += (rate + trend[axis]) * TICK_S;
            markov = decay * markov + drive * deviates.normal();
            rate = trend_decay * rate + trend_drive * deviates.normal();
            if index % REFERENCE_TICKS == 0 {
                reference = voyage.reference_sigma_rad_per_s * deviates.normal();
            }
            truth[axis] = constant + markov;
            measured[axis] = truth[axis] + white * deviates.normal() + reference;
        }
    }
    let held = truth.get(voyage.calibration_ticks().saturating_sub(1)).copied().unwrap_or_default();
    Drift { truth, measured, held }
}

/// What many voyages came to under one care.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Middle value of each figure.
    pub median: Figures,
    /// What 95 % of the voyages stay below.
    pub within_95_percent: Figures,
}

/// Sails once per seed, with the straight `trend` (rad/s²) beside what the parts say: by [`CARES`] the first seed's course, and what
/// all of them came to.
///
/// # Errors
/// [`Error::Refused`]: everything that is wrong with the parts.
pub fn sail_all(
    voyage: &Voyage,
    parts: &[DriftParts; 3],
    trend: [f64; 3],
    seeds: &[u64],
) -> Result<Vec<(Course, Spread)>, Error> {
    let all = in_parallel(seeds, |seed| {
        let drift = drift(voyage, parts, trend, *seed);
        CARES.into_iter().map(|care| voyage.sail(care, &drift, parts)).collect::<Result<Vec<_>, _>>()
    });
    let mut first = Vec::new();
    let mut figures = vec![Vec::new(); CARES.len()];
    for courses in all {
        let courses = courses?;
        figures.iter_mut().zip(&courses).for_each(|(figures, course)| figures.push(course.figures()));
        if first.is_empty() {
            first = courses;
        }
    }
    Ok(first.into_iter().zip(figures.iter().map(|figures| spread(figures))).collect())
}

fn spread(figures: &[Figures]) -> Spread {
    let at = |share: usize| {
        let of = |value: fn(&Figures) -> f64| percentile(figures.iter().map(value), share);
        Figures {
            radial_at_end_m: of(|figures| figures.radial_at_end_m),
            radial_largest_m: of(|figures| figures.radial_largest_m),
            heading_at_end_arcmin: of(|figures| figures.heading_at_end_arcmin),
            heading_largest_arcmin: of(|figures| figures.heading_largest_arcmin),
        }
    };
    Spread { median: at(50), within_95_percent: at(95) }
}
