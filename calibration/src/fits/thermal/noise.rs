//! What the noise of a thermometer adds to the columns, and with them to what the corrector puts out.
//!
//! A service cannot smooth both ways: each reading's noise goes through its filter into every term. White noise of σ in readings Δ apart
//! makes, of a column that answers a single reading with h(t), a variance of σ²/Δ·∫h² dt in each tick; the answers are the corrector's
//! own. Of two columns likewise a covariance Σ, and coefficients c add cᵀΣc to the mean square of the output.

use std::collections::BTreeMap;

use isotherm_correction::sample::{ChannelName, MAX_SENSORS, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};

use super::columns::{Basis, Effect, Term};
use super::samples::Samples;
use crate::error::Error;

/// Parts of a reading's length that its answer is taken at.
const PARTS: f64 = 2.0;
/// How long an answer is followed (s, readings, smoothings with their derivatives).
const FOLLOWED_S: f64 = 300.0;
const FOLLOWED_READINGS: f64 = 20.0;
const FOLLOWED_FILTERS: f64 = 2.0;
/// Readings before the one that is answered.
const BEFORE: u32 = 3;

/// A thermometer as its readings show it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Thermometer {
    /// A reading in the middle of them (raw).
    pub usual: f64,
    /// Standard deviation of a reading's noise (raw).
    pub sigma: f64,
    /// Distance of readings (s).
    pub step_s: f64,
}

impl Thermometer {
    /// One for several runs.
    fn of(runs: &[Samples], channel: &str) -> Option<Self> {
        let known = || runs.iter().filter_map(|run| run.thermometers.get(channel));
        let first = *known().next()?;
        let sigma = known().map(|one| one.sigma).fold(0.0, f64::max);
        Some(Self { sigma, ..first })
    }
}

/// Covariances of the terms that follow a channel without powers of temperature, by pairs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    known: BTreeMap<(Term, Term), f64>,
}

/// A term without its power of temperature; `None` for one that no reading's noise gets into as it stands.
fn bare(term: Term) -> Option<Term> {
    match term.effect {
        Effect::Scale => None,
        Effect::Static => (term.power > 0).then_some(Effect::Static.power(1)),
        other => Some(other.power(0)),
    }
}

impl Noise {
    /// Of the terms over a channel of some runs.
    ///
    /// # Errors
    /// [`Error::Document`].
    pub(super) fn of(basis: &Basis, runs: &[Samples], terms: &[Term]) -> Result<Self, Error> {
        let mut wanted: Vec<Term> = terms.iter().filter_map(|term| bare(*term)).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let thermometer = Thermometer::of(runs, &basis.channel.name).filter(|one| one.sigma > 0.0);
        let Some(thermometer) = thermometer.filter(|one| one.step_s > 0.0) else {
            return Ok(Self::default());
        };
        let one = one_reading(basis, &thermometer);
        let mut answers: Vec<Vec<f64>> = Vec::new();
        for group in wanted.chunks(MAX_SENSORS) {
            answers.extend(basis.drive(&one, group)?);
        }
        let before =
            one.time_s.iter().take_while(|time| **time < thermometer.step_s * f64::from(BEFORE)).count();
        let share = one.window_s / thermometer.step_s;
        let mut known = BTreeMap::new();
        for (a, of_a) in wanted.iter().zip(&answers) {
            for (b, of_b) in wanted.iter().zip(&answers) {
                let level = |of: &[f64]| of.get(before.saturating_sub(1)).copied().unwrap_or_default();
                let (rest_a, rest_b) = (level(of_a), level(of_b));
                let pairs = of_a.iter().zip(of_b).skip(before);
                let sum: f64 =
                    pairs.map(|(x, y)| (x - rest_a) * (y - rest_b)).filter(|x| x.is_finite()).sum();
                known.insert((*a, *b), share * sum);
            }
        }
        Ok(Self { known })
    }

    /// Covariance of two terms in the mean over some temperatures (°C less the basis' reference).
    pub(super) fn covariance(&self, a: Term, b: Term, away: &[f64]) -> f64 {
        let Some(known) = bare(a).zip(bare(b)).and_then(|pair| self.known.get(&pair)) else { return 0.0 };
        // A power of temperature moves by its derivative, a gain stays.
        let part = |Term { effect, power, .. }: Term, x: f64| match effect {
            Effect::Static => (1..=power).map(|_| integer_power(x, power - 1)).sum(),
            _ => integer_power(x, power),
        };
        let good = away.iter().filter(|x| x.is_finite());
        let (sum, count) =
            good.fold((0.0, 0.0), |(sum, count), x| (sum + part(a, *x) * part(b, *x), count + 1.0));
        if count > 0.0 { known * sum / count } else { 0.0 }
    }
}

/// A run with one reading that is off by the noise.
fn one_reading(basis: &Basis, thermometer: &Thermometer) -> Samples {
    let Thermometer { usual, sigma, step_s } = *thermometer;
    let filter = &basis.filter;
    let filtered = FOLLOWED_FILTERS * (filter.smoothing_s + 4.0 * filter.derivative_step_s);
    let length_s = (FOLLOWED_READINGS * step_s).max(FOLLOWED_S) + filtered;
    let window_s = step_s / PARTS;
    let times = |first: f64, step_s: f64| {
        (0_u32..)
            .map(move |index| (f64::from(index) + first) * step_s)
            .take_while(move |time| *time <= length_s)
    };
    let readings = (0_u32..).zip(times(0.0, step_s)).map(|(index, time)| TemperatureReading {
        channel: ChannelName::from(&basis.channel.name).unwrap_or_default(),
        time: Timestamp::from_ns(Span::from_s(time).as_ns()),
        raw: if index == BEFORE { usual + sigma } else { usual },
    });
    let temperatures = [(basis.channel.name.clone(), readings.collect())].into();
    Samples { window_s, time_s: times(0.5, window_s).collect(), temperatures, ..Samples::default() }
}

fn integer_power(x: f64, power: usize) -> f64 {
    (0..power).fold(1.0, |product, _| product * x)
}
