//! One voyage: calibration with all rates known, then hours on its own.

use clap::{ArgAction, Args};
use isotherm_correction::drift::DriftParts;
use isotherm_correction::units::AngularRate;

use super::estimate::{TICK_S, residual};
use super::ins::{Errors, GREATEST_LATITUDE_DEG, Ins, TURN_RATIO};
use crate::error::Error;
use crate::limits::within;

/// Ticks in one step of the error equations, and its length (s).
const STEP_TICKS: usize = 6;
const STEP_S: f64 = 60.0;
/// Steps between two points of a curve.
const POINT_STEPS: usize = 10;

/// Most hours of either part.
const MOST_HOURS: f64 = 1000.0;

/// Where and how long.
#[derive(Debug, Clone, Copy, PartialEq, Args, serde::Serialize)]
pub struct Voyage {
    /// Latitude (°)
    #[arg(long = "latitude", value_name = "DEG", default_value_t = 60.0, allow_hyphen_values = true, value_parser = within(-GREATEST_LATITUDE_DEG, GREATEST_LATITUDE_DEG))]
    pub latitude_deg: f64,
    /// Rate of the platform about the vertical (multiples of the Earth's)
    #[arg(long, hide_short_help = true, value_name = "RATIO", default_value_t = TURN_RATIO, allow_hyphen_values = true, value_parser = within(-1000.0, 1000.0))]
    pub turn_ratio: f64,
    /// Length of the calibration before it (h)
    #[arg(long = "calibration-hours", value_name = "HOURS", default_value_t = 21.0, value_parser = within(0.5, MOST_HOURS))]
    pub calibration_h: f64,
    /// Length of the voyage without position (h)
    #[arg(long, value_name = "HOURS", default_value_t = 48.0, value_parser = within(0.5, MOST_HOURS))]
    pub hours: f64,
    /// No velocity log: level gyros are not observed during the voyage
    #[arg(long = "no-log-aid", hide_short_help = true, action = ArgAction::SetFalse)]
    pub log_aids_level: bool,
    /// Standard error of the reference rate per minute (°/h)
    #[arg(long = "reference-sigma", hide_short_help = true, value_name = "DEG_PER_H", default_value = "0.001", value_parser = rate)]
    pub reference_sigma_rad_per_s: f64,
}

/// Reads a rate in °/h as rad/s.
fn rate(text: &str) -> Result<f64, String> {
    within(0.0, 1000.0)(text).map(|rate| AngularRate::from_deg_per_h(rate).as_rad_per_s())
}

/// A drift of the gyros x, y, z, tick by tick (rad/s).
#[derive(Debug, Clone, PartialEq)]
pub struct Drift {
    /// As it is.
    pub truth: Vec<[f64; 3]>,
    /// As the estimator sees it, with the noise of gyros and references.
    pub measured: Vec<[f64; 3]>,
    /// What is known of it at the end of the calibration by plain averaging.
    pub held: [f64; 3],
}

/// What is done about the drift.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Care {
    /// Its value at the end of the calibration is subtracted from then on.
    Held,
    /// The estimator without the state of the trend.
    WithoutTrend,
    /// The estimator with it.
    WithTrend,
    /// The estimator with a constant and its trend, without a Markov part: 002's new model.
    TrendAlone,
}

/// All of them, in the order of the tables.
pub const CARES: [Care; 4] = [Care::Held, Care::WithoutTrend, Care::WithTrend, Care::TrendAlone];

impl Care {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Held => "held at its last value",
            Self::WithoutTrend => "estimator without trend state",
            Self::WithTrend => "estimator with trend state",
            Self::TrendAlone => "estimator with trend state, without Markov part",
        }
    }
}

/// What came of one care.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// What was done.
    pub care: Care,
    /// Length of the voyage without position (h), and the errors then.
    pub points: Vec<(f64, Errors)>,
    /// Drift that was left, at the same times (rad/s).
    pub left: Vec<[f64; 3]>,
}

/// The figures of a course.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Figures {
    /// Radial position error at the end (m).
    pub radial_at_end_m: f64,
    /// The largest on the way (m).
    pub radial_largest_m: f64,
    /// Heading error at the end (′).
    pub heading_at_end_arcmin: f64,
    /// The largest on the way (′).
    pub heading_largest_arcmin: f64,
}

impl Course {
    /// Its figures.
    pub fn figures(&self) -> Figures {
        let end = self.points.last().map(|point| point.1).unwrap_or_default();
        let largest =
            |of: &dyn Fn(&Errors) -> f64| self.points.iter().map(|point| of(&point.1)).fold(0.0, f64::max);
        Figures {
            radial_at_end_m: end.radial_m(),
            radial_largest_m: largest(&Errors::radial_m),
            heading_at_end_arcmin: end.heading_arcmin().abs(),
            heading_largest_arcmin: largest(&|errors| errors.heading_arcmin().abs()),
        }
    }
}

impl Voyage {
    /// Ticks of the calibration.
    pub fn calibration_ticks(&self) -> usize {
        ticks(self.calibration_h)
    }

    /// Ticks of all.
    pub fn ticks(&self) -> usize {
        self.calibration_ticks() + ticks(self.hours)
    }

    /// What comes of a drift (tick by tick from the calibration's beginning) under one care.
    ///
    /// # Errors
    /// [`Error::Refused`]: everything that is wrong with the parts.
    pub fn sail(&self, care: Care, drift: &Drift, parts: &[DriftParts; 3]) -> Result<Course, Error> {
        let departure = self.calibration_ticks();
        let expected = match care {
            Care::Held => None,
            Care::WithoutTrend => {
                Some(parts.map(|parts| DriftParts { trend_sigma_rad_per_s2: 0.0, ..parts }))
            }
            Care::WithTrend => Some(*parts),
            Care::TrendAlone => Some(parts.map(|parts| DriftParts { sigma_rad_per_s: 0.0, ..parts })),
        };
        let less_held = |rates: &[f64; 3]| [0, 1, 2].map(|axis| rates[axis] - drift.held[axis]);
        let left: Vec<[f64; 3]> = match expected {
            None => drift.truth.iter().map(less_held).collect(),
            Some(parts) => residual(self, drift, &parts).map_err(Error::Refused)?,
        };
        let alone = left.get(departure..).unwrap_or(&[]);
        let mut ins = Ins::new(self.latitude_deg, self.turn_ratio, STEP_S);
        let (mut points, mut kept) = (Vec::new(), Vec::new());
        let mut hours = 0.0;
        let last = alone.len() / STEP_TICKS;
        for (index, step) in alone.chunks_exact(STEP_TICKS).enumerate() {
            let mut mean = [0.0; 3];
            for drift in step {
                mean.iter_mut().zip(drift).for_each(|(sum, drift)| *sum += drift * TICK_S / STEP_S);
            }
            ins.step(mean);
            hours += STEP_S / 3600.0;
            if (index + 1) % POINT_STEPS == 0 || index + 1 == last {
                points.push((hours, ins.errors()));
                kept.push(mean);
            }
        }
        Ok(Course { care, points, left: kept })
    }
}

/// Ticks of so many hours, whole steps of the error equations.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "hours are checked to be few")]
fn ticks(hours: f64) -> usize {
    let minutes = (hours * 60.0).round().max(0.0) as usize;
    minutes * STEP_TICKS
}
