//! What the in-run estimator is to expect of a gyro: `[gyro.sensor.drift]` out of an analysis.

use isotherm_protocol::document::{Document, Drift};

use super::fit::Analysis;
use super::markov::Fit;
use super::report::Found;
use crate::axes::AXES;
use crate::error::Error;
use crate::fits::drift::allan::{Coefficient, Term};
use crate::report::short;

/// How long a trend's rate holds where the log does not say: 002's extrapolation errs by 30 % over the 50 h behind the
/// fit, and e^(−50/140) = 0.7.
pub const TREND_CORRELATION_TIME_H: f64 = 140.0;
/// A trend counts from so many standard errors on.
pub const TREND_SIGMAS: f64 = 3.0;
/// Shortest log whose trend the estimator is to expect (h): in shorter ones one in twenty shows a trend that is none, which costs more
/// than it helps.
pub const LEAST_TREND_H: f64 = 48.0;
/// The constant part where nobody states it, in standard deviations of the slow part.
const CONSTANT_SIGMAS: f64 = 10.0;
/// Length of a reference at rest (s).
const REFERENCE_S: f64 = 60.0;
/// Ranges that a document allows.
const TIME_RANGE_H: [f64; 2] = [0.02, 250_000.0];
const INITIAL_RANGE: [f64; 2] = [1e-6, 20_000.0];
const WALK_RANGE: [f64; 2] = [1e-8, 3000.0];
const SIGMA_RANGE: [f64; 2] = [0.0, 20_000.0];
/// An input axis within this cosine of a case axis has that axis' drift: 14°.
const SMALLEST_COSINE: f64 = 0.97;

/// Parameters of one gyro, and where each comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// As a document states them.
    pub drift: Drift,
    /// What is to be said of them.
    pub notes: Vec<String>,
}

impl Parameters {
    /// Of a gyro; `initial_sigma` (°/h) of the constant part where it is known.
    ///
    /// # Errors
    /// What is beyond the range that a document allows, in words: such a log is not one of a gyro at rest.
    pub fn of(analysis: &Analysis, initial_sigma: Option<f64>) -> Result<Self, String> {
        let mut notes = Vec::new();
        let length_h = analysis.slow.length_h();
        let (sigma, time_h) = match analysis.slow_drift() {
            // Of what is slower than the log only the random walk is seen, of size σ²/τ: that stays.
            Some((sigma, time)) if time.value > length_h => {
                notes.push(format!(
                    "the log of {length_h:.1} h is too short for the correlation time ({:.0} h fit best): the log's \
                     length is written, with the sigma of the same random walk",
                    time.value
                ));
                (sigma.value * (length_h / time.value).sqrt(), length_h)
            }
            Some((sigma, time)) => {
                if time.value > length_h / 3.0 {
                    notes.push(format!(
                        "the correlation time of {:.1} h is from a log of {length_h:.1} h: three times as much is \
                         needed to separate it from a trend",
                        time.value
                    ));
                }
                (sigma.value, time.value)
            }
            None => {
                notes.push("no slow drift exceeds the white noise: sigma is 0".to_owned());
                (0.0, length_h)
            }
        };
        let trend = trend(analysis);
        let (trend_sigma, trend_time_h) = match trend {
            Trend::Seen { slope, .. } if length_h < LEAST_TREND_H => {
                notes.push(format!(
                    "a trend of {} °/h² is possible, but in {length_h:.1} h a slow drift often looks the same: it is \
                     left out; log for {LEAST_TREND_H} h",
                    short(slope)
                ));
                (0.0, TREND_CORRELATION_TIME_H)
            }
            Trend::Seen { slope, holds_h } => (slope.abs(), holds_h),
            Trend::NotSeen { error } => {
                notes.push(format!(
                    "no trend is found; one of up to {} °/h² would not be",
                    short(TREND_SIGMAS * error)
                ));
                (0.0, TREND_CORRELATION_TIME_H)
            }
        };
        let walk = walk(analysis, &mut notes) / 60.0;
        let initial = initial_sigma.unwrap_or_else(|| {
            notes.push(format!(
                "one log at rest cannot separate the constant part from the Earth's rate: initial_sigma is \
                 {CONSTANT_SIGMAS} standard deviations of the slow part; if you know it, state --initial-sigma"
            ));
            CONSTANT_SIGMAS * analysis.slow_deviation
        });
        let inside = [
            ("sigma_deg_per_h", sigma, SIGMA_RANGE, "°/h"),
            ("initial_sigma_deg_per_h", initial, INITIAL_RANGE, "°/h"),
            ("angle_random_walk_deg_per_sqrt_h", walk, WALK_RANGE, "°/√h"),
        ];
        for (key, value, [low, high], measure) in inside {
            // False for what is no number too.
            if !(low..=high).contains(&value) {
                return Err(format!(
                    "{key} is {} {measure}, a document allows {low} to {high}: the log is not one of a gyro at rest (did the \
                     unit turn, are there spikes, is the unit of measure right?); no drift is stated for it",
                    short(value)
                ));
            }
        }
        let [shortest, longest] = TIME_RANGE_H;
        let mut time = |what: &str, time_h: f64, counts: bool| {
            if counts && !(shortest..=longest).contains(&time_h) {
                notes.push(format!(
                    "the {what} is {} h, a document allows {shortest} to {longest} h: the nearer limit replaces it",
                    short(time_h)
                ));
            }
            digits(time_h.clamp(shortest, longest))
        };
        let drift = Drift {
            sigma_deg_per_h: digits(sigma),
            correlation_time_h: time("correlation time", time_h, sigma > 0.0),
            trend_sigma_deg_per_h2: digits(trend_sigma),
            trend_correlation_time_h: time("trend's correlation time", trend_time_h, trend_sigma > 0.0),
            initial_sigma_deg_per_h: digits(initial),
            angle_random_walk_deg_per_sqrt_h: digits(walk),
        };
        Ok(Self { drift, notes })
    }
}

/// N (°/h·√s).
fn walk(analysis: &Analysis, notes: &mut Vec<String>) -> f64 {
    if let Some(noise) = analysis.stated_noise() {
        let walk = noise.of_term(Term::AngleRandomWalk);
        if let Coefficient::NotObservable { .. } = walk {
            notes.push("angle random walk is not observable: its upper limit replaces it".to_owned());
        }
        return walk.value_or_limit();
    }
    // What the estimator sees is means over a reference.
    let far = |tau: f64| libm::log(tau / REFERENCE_S).abs();
    let overlapping = analysis.allan.iter().filter_map(|row| Some((row.tau_s, row.of[1].as_ref()?.value)));
    let nearest = overlapping.min_by(|a, b| far(a.0).total_cmp(&far(b.0)));
    let (tau_s, deviation) = nearest.unwrap_or((1.0, analysis.deviation));
    notes.push(format!(
        "the five noise terms do not describe the log: the angle random walk is from means over {} s, the length of \
         a reference",
        short(tau_s)
    ));
    deviation * tau_s.sqrt()
}

/// What the log says of the trend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trend {
    /// There is one.
    Seen {
        /// Slope (readings per h).
        slope: f64,
        /// How long it holds (h), from its bend where that is seen.
        holds_h: f64,
    },
    /// There is none that stands out of drift and noise.
    NotSeen {
        /// Standard error of the slope.
        error: f64,
    },
}

/// What an analysis says of the trend, under the drift and noise that it found.
pub fn trend(analysis: &Analysis) -> Trend {
    Trend::of(analysis.slope, analysis.second_order.as_ref())
}

impl Trend {
    /// Of a slope with its standard error, and a fit with a bend.
    pub fn of(straight: Option<(f64, f64)>, second_order: Option<&Fit>) -> Self {
        let (slope, error) = straight.unwrap_or((0.0, f64::INFINITY));
        if slope.abs() <= TREND_SIGMAS * error {
            return Self::NotSeen { error };
        }
        // A bend of c2·t² changes the slope by 2·c2 per hour.
        let bend = second_order.and_then(|fit| fit.power(2));
        let seen = bend.filter(|(bend, error)| bend.abs() > TREND_SIGMAS * error);
        let holds_h = seen.map_or(TREND_CORRELATION_TIME_H, |(bend, _)| (slope / (2.0 * bend)).abs());
        Self::Seen { slope, holds_h }
    }
}

/// Four significant digits: a log knows no more.
fn digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Puts parameters along the case axes into a document. What it states of the constant part stays where that is asked for.
///
/// # Errors
/// [`Error::Refused`] where an input axis lies along no case axis, or there is another number of sensors.
pub fn put(document: &mut Document, parameters: &Found, keep_initial: bool) -> Result<(), Error> {
    let rows = &document.gyro.orientation.rows;
    let mut reasons = Vec::new();
    for (index, sensor) in document.gyro.sensor.iter_mut().enumerate() {
        let row = rows.get(index).copied().unwrap_or_default();
        let along = AXES.into_iter().zip(row).find(|(_, cosine)| cosine.abs() >= SMALLEST_COSINE);
        let Some((axis, _)) = along else {
            reasons.push(format!(
                "gyro {} of the document lies along no case axis ({row:.3?}), so corrected rates do not show its own \
                 drift: analyse the raw readings (without --calibration) and insert the figures of the page (--html) by hand",
                sensor.name
            ));
            continue;
        };
        if let Some((_, found)) = parameters.stated().find(|(name, _)| *name == axis) {
            let mut drift = found.drift.clone();
            if let Some(before) = sensor.drift.as_ref().filter(|_| keep_initial) {
                drift.initial_sigma_deg_per_h = before.initial_sigma_deg_per_h;
            }
            sensor.drift = Some(drift);
        }
    }
    if reasons.is_empty() { Ok(()) } else { Err(Error::Refused(reasons)) }
}
