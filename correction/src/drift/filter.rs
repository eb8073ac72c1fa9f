//! Kalman filter of one gyro's drift over (ε0, ε1, χ), with a gate against wrong references.

use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};
use serde::{Deserialize, Serialize};

use super::moments::Step;
use super::{DriftEstimate, DriftModel, DriftParts};
use crate::recent::Recent;
use crate::units::Timestamp;

/// An innovation beyond this many of its sigmas is refused.
pub const GATE_SIGMAS: f64 = 5.0;
/// So many refusals in a row that agree with each other are believed: the drift itself has stepped.
pub const BELIEF_REFUSALS: u32 = 10;
/// Innovations beyond this many initial sigmas of the whole drift are never believed: that is no drift.
pub const BELIEF_LIMIT: f64 = 10.0;
/// Updates over which the normalised innovation squared is averaged: an hour of references at rest.
pub const INNOVATIONS_KEPT: usize = 60;
/// 95 % bounds of the mean normalised innovation squared over [`INNOVATIONS_KEPT`] updates of a consistent filter:
/// those of χ² with as many degrees of freedom, divided by them.
pub const MEAN_NIS_BOUNDS: [f64; 2] = [0.6747, 1.3883];

type SquareMatrix<const N: usize> = SMatrix<f64, N, N>;

/// A measurement counts for no better than this share of the prediction's variance: beyond it rounding would eat up the
/// covariance. The next one goes on from there.
const FINEST: f64 = 1e-10;

/// Refusals in a row that agree with each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Refusals {
    count: u32,
    innovation: f64,
    variance: f64,
}

/// The measured mean drift over a span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Measured {
    pub(super) start: Timestamp,
    pub(super) end: Timestamp,
    /// Mean over the span (rad/s).
    pub(super) mean: f64,
    /// Its variance without the white noise of the gyro ((rad/s)²).
    pub(super) variance: f64,
}

/// The filter of one gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Filter {
    pub(super) model: DriftModel,
    /// Time of state and covariance; `None` before the first tick.
    time: Option<Timestamp>,
    /// ε0 (rad/s), ε1 (rad/s), χ (rad/s²).
    state: Vector3<f64>,
    covariance: Matrix3<f64>,
    refusals: Option<Refusals>,
    /// Normalised innovations squared of the last measurements taken.
    innovations: Recent<f64, INNOVATIONS_KEPT>,
    last_innovation: Option<f64>,
    last_update: Option<Timestamp>,
    updates: u64,
    refused: u64,
    believed: u64,
}

impl Filter {
    pub(super) fn new(model: DriftModel) -> Self {
        Self {
            model,
            time: None,
            state: Vector3::zeros(),
            covariance: Matrix3::from_diagonal(&initial_variances(&model)),
            refusals: None,
            innovations: Recent::default(),
            last_innovation: None,
            last_update: None,
            updates: 0,
            refused: 0,
            believed: 0,
        }
    }

    /// Says at what time the initial state holds; later calls change nothing.
    pub(super) fn start(&mut self, time: Timestamp) {
        self.time.get_or_insert(time);
    }

    /// The producer's clock stepped back, so nobody knows how long it was away: what changes with time is forgotten, the
    /// constant part may be another one by its initial sigma.
    pub(super) fn lose_time(&mut self) {
        let [constant, markov, trend] = initial_variances(&self.model).into();
        self.state = Vector3::new(self.state.x, 0.0, 0.0);
        let grown = self.covariance.m11 + constant;
        self.covariance = Matrix3::from_diagonal(&Vector3::new(grown, markov, trend));
        self.time = None;
        self.refusals = None;
        self.last_update = None;
    }

    /// Predicted drift at `time` (rad/s).
    pub(super) fn rate_at(&self, time: Timestamp) -> f64 {
        let parts = self.model.parts();
        let since_s = self.time.map_or(0.0, |t| time.seconds_from(t));
        let markov = libm::exp(-since_s / parts.correlation_time_s);
        let tau = parts.trend_correlation_time_s;
        let trend_s = -tau * libm::expm1(-since_s / tau);
        self.state.x + markov * self.state.y + trend_s * self.state.z
    }

    /// The drift as it is known at `time`.
    pub(super) fn estimate(&self, time: Timestamp) -> DriftEstimate {
        let since_s = self.time.map_or(0.0, |t| time.since(t).as_s());
        let (state, covariance) = self.predicted(since_s);
        let drift = Vector3::new(1.0, 1.0, 0.0);
        let variance = drift.dot(&(covariance * drift));
        let sigma = |variance: f64| libm::sqrt(variance.max(0.0));
        // Summed anew, so that no rounding collects.
        let (squares, kept) =
            self.innovations.iter().fold((0.0, 0.0), |(sum, n), square| (sum + square, n + 1.0));
        DriftEstimate {
            rate: self.rate_at(time),
            sigma: sigma(variance),
            trend: state.z,
            trend_sigma: sigma(covariance.m33),
            updates: self.updates,
            refused: self.refused,
            believed: self.believed,
            last_update: self.last_update,
            normalised_innovation: self.last_innovation,
            mean_nis: (kept > 0.0).then(|| squares / kept),
        }
    }

    /// State and covariance this long after the last update (s).
    fn predicted(&self, since_s: f64) -> (Vector3<f64>, Matrix3<f64>) {
        let step = Step::over(since_s, self.model.parts());
        let transition: Matrix3<f64> = step.transition.fixed_view::<3, 3>(0, 0).into_owned();
        let noise: Matrix3<f64> = step.noise.fixed_view::<3, 3>(0, 0).into_owned();
        (transition * self.state, propagated(&transition, &self.covariance, &noise))
    }

    /// Takes the mean drift over a span that starts no earlier than the last one ended; whether it is within the gate, or
    /// believed after refusals that agree with it.
    pub(super) fn update(&mut self, measured: &Measured) -> bool {
        let parts = *self.model.parts();
        let span_s = measured.end.since(measured.start).as_s();
        let since_s = self.time.map_or(0.0, |t| measured.start.since(t).as_s());
        let white = parts.angle_random_walk_rad_per_sqrt_s;
        let variance = measured.variance + white * white / span_s;

        let (state, mut covariance) = self.predicted(since_s);
        let posterior = |covariance: &Matrix3<f64>| {
            Posterior::new(&state, covariance, span_s, &parts, measured.mean, variance)
        };
        let mut after = posterior(&covariance);
        if !after.plausible() {
            if !self.believes(&after) {
                self.refused += 1;
                return false;
            }
            // The step is taken to be one of the constant part, of the size that it shows.
            self.believed += 1;
            covariance.m11 += after.innovation * after.innovation;
            after = posterior(&covariance);
        }
        let normalised = after.innovation / libm::sqrt(after.innovation_variance);
        (self.state, self.covariance, self.refusals) = (after.state, after.covariance, None);
        (self.time, self.last_update) = (Some(measured.end), Some(measured.end));
        self.last_innovation = Some(normalised);
        self.innovations.push(normalised * normalised);
        self.updates += 1;
        true
    }

    /// Whether this implausible measurement ends a row of refusals that agree with each other.
    fn believes(&mut self, posterior: &Posterior) -> bool {
        let Posterior { innovation, innovation_variance: variance, .. } = *posterior;
        let count = match self.refusals {
            Some(last) if agree((last.innovation, last.variance), (innovation, variance)) => last.count + 1,
            _ => 1,
        };
        self.refusals = Some(Refusals { count, innovation, variance });
        let [constant, markov, _] = initial_variances(&self.model).into();
        let limit = BELIEF_LIMIT * libm::sqrt(constant + markov);
        count >= BELIEF_REFUSALS && innovation.abs() <= limit && variance.is_finite()
    }
}

/// Whether two innovations, each with its variance, may be the same one.
fn agree((a, a_variance): (f64, f64), (b, b_variance): (f64, f64)) -> bool {
    (a - b).abs() <= GATE_SIGMAS * libm::sqrt(a_variance + b_variance)
}

/// Variances of ε0, ε1 and χ before anything was measured.
fn initial_variances(model: &DriftModel) -> Vector3<f64> {
    let parts = model.parts();
    let sigmas =
        Vector3::new(parts.initial_sigma_rad_per_s, parts.sigma_rad_per_s, parts.trend_sigma_rad_per_s2);
    sigmas.component_mul(&sigmas)
}

/// State after a measurement of the mean over a span, if it is taken.
struct Posterior {
    innovation: f64,
    innovation_variance: f64,
    state: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl Posterior {
    /// From state and covariance at the start of the span. The integral of ε over the span is carried along as a fourth
    /// state that starts as zero: its quotient by the span is what was measured, at no approximation.
    fn new(
        state: &Vector3<f64>,
        covariance: &Matrix3<f64>,
        span_s: f64,
        parts: &DriftParts,
        mean: f64,
        variance: f64,
    ) -> Self {
        let step = Step::over(span_s, parts);
        let state = step.transition * state.push(0.0);
        let mut start = Matrix4::zeros();
        start.fixed_view_mut::<3, 3>(0, 0).copy_from(covariance);
        let before = propagated(&step.transition, &start, &step.noise);

        let h = Vector4::new(0.0, 0.0, 0.0, 1.0 / span_s);
        let innovation = mean - h.dot(&state);
        let predicted_variance = h.dot(&(before * h));
        let variance = variance.max(FINEST * predicted_variance);
        let innovation_variance = predicted_variance + variance;
        let gain = before * h / innovation_variance;
        // Joseph's form: it stays positive whatever the rounding of the gain.
        let rest = Matrix4::identity() - gain * h.transpose();
        let after = rest * before * rest.transpose() + gain * gain.transpose() * variance;
        let state = state + gain * innovation;
        let covariance: Matrix3<f64> = after.fixed_view::<3, 3>(0, 0).into_owned();
        Self { innovation, innovation_variance, state: state.xyz(), covariance: symmetric(&covariance) }
    }

    /// Within the gate; a variance that is no number says that the readings were none.
    fn plausible(&self) -> bool {
        self.innovation_variance.is_finite()
            && self.innovation.abs() <= GATE_SIGMAS * libm::sqrt(self.innovation_variance)
    }
}

/// Covariance after a transition, with its noise.
fn propagated<const N: usize>(
    transition: &SquareMatrix<N>,
    covariance: &SquareMatrix<N>,
    noise: &SquareMatrix<N>,
) -> SquareMatrix<N> {
    symmetric(&(transition * covariance * transition.transpose() + noise))
}

/// The symmetric part: rounding would otherwise let the two halves drift apart.
fn symmetric<const N: usize>(matrix: &SquareMatrix<N>) -> SquareMatrix<N> {
    (matrix + matrix.transpose()) * 0.5
}

#[cfg(test)]
mod tests;
