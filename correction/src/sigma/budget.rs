//! The standard errors of a tick, added up.

use core::array;

use serde::{Deserialize, Serialize};

use super::parts::SigmaParts;
use super::{Causes, Sigma, SigmaModel};
use crate::calibration::Calibration;
use crate::curve::Curve;
use crate::lanes::Lanes;
use crate::observation::Observation;
use crate::orientation::{Inverse, Rows};
use crate::reversal::{Gain, Restoration, Substitution};
use crate::sample::{CorrectedTick, MAX_SENSORS, SensorFlags, TickFlags};
use crate::thermal::AccelModel;
use crate::vector::{cross, dot};

/// Flat part of the Allan deviation over B: √(2 ln 2/π) [IEEE 952].
const FLICKER: f64 = 0.664_280_2;
/// Variance of the angular acceleration (rad²/s⁴) per variance of an angle increment over Δt⁴: that of (3ω₀ − 4ω₁ + ω₂)/2Δt.
const ACCELERATION_GAIN: f64 = 6.5;

/// What a tick was corrected with, as σ needs it.
#[derive(Debug)]
pub(crate) struct Watched<'a> {
    pub(crate) calibration: &'a Calibration,
    pub(crate) seen: &'a Observation,
    pub(crate) out: &'a CorrectedTick,
    /// Its flags and those of the tick before, without those that they have of others.
    pub(crate) own_flags: [TickFlags; 2],
    /// What part of a tick each gyro is held back; `None` where none is.
    pub(crate) held_back_ticks: Option<Lanes>,
    pub(crate) substitution: &'a Substitution,
    pub(crate) since_turn_on_s: f64,
    pub(crate) gyros: Resolved<'a>,
    pub(crate) accels: Option<Resolved<'a>>,
    /// σ of what the drift estimator has subtracted (rad/s); NaN where it subtracts nothing.
    pub(crate) drift_sigma: Lanes,
}

/// Axes of a kind of sensor and how they stand at a tick.
#[derive(Debug)]
pub(crate) struct Resolved<'a> {
    pub(crate) sensors: usize,
    /// The input axes.
    pub(crate) rows: Rows,
    pub(crate) inverse: Option<Inverse>,
    /// The axes' temperature is outside its range.
    pub(crate) clamped: bool,
    pub(crate) temperature_deg_c: &'a Lanes,
}

/// What σ has to remember from tick to tick.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct SigmaMemory {
    restoration: Restoration,
    /// Variances of what fits have in the gyros' increments of the last two ticks (rad²), newest first, where gyros are held back.
    bridged: Option<[Lanes; 2]>,
}

/// Variances of one sensor's increment, by cause (rad² or m²/s²).
#[derive(Debug, Clone, Copy, Default)]
struct Variances([f64; 4]);

impl SigmaMemory {
    /// σ of a tick, which is followed in any case.
    pub(crate) fn of(&mut self, model: &SigmaModel, tick: &Watched<'_>) -> Sigma {
        let Watched { calibration, out, .. } = *tick;
        let restored = match calibration.reversal {
            Some(reversal) => {
                let span = (out.end_time, out.duration);
                self.restoration.follow(tick.substitution, reversal, span, tick.own_flags[0])
            }
            None => None,
        };
        let duration_s = out.duration.as_s();
        let bridged = self.hold_back(tick.held_back_ticks.as_ref(), bridged(model, restored.as_ref()));
        let angle = if out.flags.contains(TickFlags::ANGLE_INVALID) {
            Causes::UNKNOWN
        } else {
            let rate = out.delta_angle.map(|angle| angle / duration_s);
            tick.gyros.causes(|lane| tick.of_gyro(model, lane, &rate, &bridged))
        };
        let velocity = match (&tick.accels, tick.seen.specific_force) {
            (Some(accels), Some(force)) if !out.flags.contains(TickFlags::VELOCITY_INVALID) => {
                accels.causes(|lane| tick.of_accel(model, accels, lane, &force, &angle))
            }
            _ => Causes::UNKNOWN,
        };
        Sigma { angle, velocity }
    }

    /// Variances of what fits have in the gyros' increments (rad²), where these are held back by `ticks` (models §3): one error spread
    /// over all ticks that have part of it.
    fn hold_back(&mut self, ticks: Option<&Lanes>, bridged: Lanes) -> Lanes {
        let Some(ticks) = ticks else {
            self.bridged = None;
            return bridged;
        };
        let [last, one_before] = self.bridged.unwrap_or_default();
        self.bridged = Some([bridged, last]);
        array::from_fn(|lane| {
            let (held, bend) = (ticks[lane], 0.5 * ticks[lane] * (1.0 - ticks[lane]));
            let shares = [1.0 - held - bend, held + 2.0 * bend, -bend];
            let parts = shares.into_iter().zip([bridged[lane], last[lane], one_before[lane]]);
            // What has no share may be unknown.
            let parts = parts.filter(|(share, _)| *share != 0.0);
            let sum: f64 = parts.map(|(share, variance)| share * libm::sqrt(variance)).sum();
            sum * sum
        })
    }
}

impl Watched<'_> {
    /// Whether a gyro's increment has nothing of a reading but through fits.
    fn is_lost(&self, lane: usize) -> bool {
        let [now, last] = self.own_flags.map(|flags| flags.contains(TickFlags::INTERPOLATED));
        now && (last || self.held_back_ticks.is_none_or(|ticks| ticks[lane] == 0.0))
    }

    fn of_gyro(&self, model: &SigmaModel, lane: usize, rate: &[f64; 3], bridged: &Lanes) -> Variances {
        let Some(parts) = model.gyros.get(lane) else { return Variances::default() };
        let duration_s = self.out.duration.as_s();
        let (white, instants) = fast(parts);
        let own = if self.is_lost(lane) { 0.0 } else { white * duration_s + 2.0 * instants };
        let along = dot(self.gyros.rows[lane], *rate);
        let bias = if self.drift_sigma[lane].is_nan() {
            bias(parts, self.gyros.temperature_deg_c[lane])
        } else {
            self.drift_sigma[lane] * self.drift_sigma[lane]
        };
        let flags = self.seen.gyros.flags[lane];
        let curves = self.calibration.gyros.get(lane).map(|gyro| gyro.terms.curves_over_temperature());
        Variances([
            own + self.slow(parts),
            bridged[lane] + self.transient(lane, white * duration_s + 6.0 * instants),
            self.calibrated(parts, bias, along, rate),
            self.clamped(parts, flags, &self.gyros, lane, curves.into_iter().flatten()),
        ])
    }

    fn of_accel(
        &self,
        model: &SigmaModel,
        accels: &Resolved<'_>,
        lane: usize,
        force: &[f64; 3],
        angle: &Causes,
    ) -> Variances {
        let Some(parts) = model.accels.get(lane) else { return Variances::default() };
        let duration_s = self.out.duration.as_s();
        let (white, instants) = fast(parts);
        let along = dot(accels.rows[lane], *force);
        let flags = self.seen.accels.flags[lane];
        let curves = self.calibration.accels.get(lane).map(AccelModel::curves_over_temperature);
        Variances([
            white * duration_s + 2.0 * instants + self.slow(parts) + self.size_effect(accels, lane, angle),
            0.0,
            self.calibrated(parts, bias(parts, accels.temperature_deg_c[lane]), along, force),
            self.clamped(parts, flags, accels, lane, curves.into_iter().flatten()),
        ])
    }

    /// Bias instability and rate random walk.
    fn slow(&self, parts: &SigmaParts) -> f64 {
        let flicker = FLICKER * parts.instability;
        let walk = parts.rate_random_walk * parts.rate_random_walk * self.since_turn_on_s;
        self.times_duration(flicker * flicker + walk)
    }

    /// Variance of a rate → of its increment.
    fn times_duration(&self, variance: f64) -> f64 {
        let duration_s = self.out.duration.as_s();
        variance * duration_s * duration_s
    }

    /// A servo transient that was subtracted: at most the noise of its half-period counts, as far as the halves do not cancel.
    fn transient(&self, lane: usize, halves: f64) -> f64 {
        let servo = self.calibration.gyros.get(lane).and_then(|gyro| gyro.servo.as_ref());
        let Some(servo) = servo else { return 0.0 };
        if self.out.flags.contains(TickFlags::SERVO_UNMEASURED) {
            f64::NAN
        } else if self.out.flags.contains(TickFlags::SERVO_TRANSIENT) {
            let unbalance = servo.unbalance(self.out.duration);
            unbalance * unbalance * halves
        } else {
            0.0
        }
    }

    fn calibrated(&self, parts: &SigmaParts, bias: f64, along: f64, vector: &[f64; 3]) -> f64 {
        if self.out.flags.contains(TickFlags::WARM_UP) {
            return f64::NAN;
        }
        let stated = |sigma: Option<f64>| sigma.unwrap_or(f64::NAN);
        let across = (vector.iter().map(|c| c * c).sum::<f64>() - along * along).max(0.0);
        let (scale, misalignment) = (stated(parts.scale) * along, stated(parts.misalignment));
        self.times_duration(bias + scale * scale + misalignment * misalignment * across)
    }

    /// Beyond the range of the sensor's own curves it is as much as stated; of all else that is clamped or stale nobody knows.
    fn clamped<'c>(
        &self,
        parts: &SigmaParts,
        flags: SensorFlags,
        of: &Resolved<'_>,
        lane: usize,
        curves: impl Iterator<Item = &'c Curve>,
    ) -> f64 {
        let unknown = SensorFlags::CLAMPED_RATE | SensorFlags::STALE_TEMPERATURE;
        if flags.intersects(unknown) {
            return f64::NAN;
        }
        if !flags.contains(SensorFlags::CLAMPED_TEMPERATURE) {
            return 0.0;
        }
        let deg_c = of.temperature_deg_c[lane];
        let beyond = curves.map(Curve::range).map(|[low, high]| (low - deg_c).max(deg_c - high));
        let beyond = beyond.fold(0.0, f64::max);
        if of.clamped || beyond <= 0.0 {
            return f64::NAN;
        }
        let sigma = parts.clamping_per_deg_c.map_or(f64::NAN, |sigma| sigma * beyond);
        self.times_duration(sigma * sigma)
    }

    /// What the gyros' noise does through α × r along the input axis of an accelerometer away from the reference point.
    fn size_effect(&self, accels: &Resolved<'_>, lane: usize, angle: &Causes) -> f64 {
        let Some(motion) = self.calibration.motion.as_deref().filter(|motion| motion.has_positions) else {
            return 0.0;
        };
        let position = array::from_fn(|axis| motion.positions_m[axis][lane]);
        let (arm, duration_s) = (cross(position, accels.rows[lane]), self.out.duration.as_s());
        let per_s = ACCELERATION_GAIN / (duration_s * duration_s);
        let axes = arm.iter().zip(angle.noise).zip(angle.restoration);
        let felt = axes.map(|((arm, noise), restored)| match *arm {
            0.0 => 0.0,
            arm => arm * arm * (noise * noise + restored * restored),
        });
        per_s * felt.sum::<f64>()
    }
}

impl Resolved<'_> {
    /// Case axes from sensors, cause by cause.
    fn causes(&self, of: impl Fn(usize) -> Variances) -> Causes {
        let Some(inverse) = &self.inverse else { return Causes::UNKNOWN };
        let mut sums = [[0.0; 3]; 4];
        for lane in 0..self.sensors {
            let (column, Variances(variances)) = (inverse.column(lane), of(lane));
            for (sum, variance) in sums.iter_mut().zip(variances) {
                for (sum, share) in sum.iter_mut().zip(column).filter(|(_, share)| *share != 0.0) {
                    *sum += share * share * variance;
                }
            }
        }
        let [noise, restoration, calibration, clamping] = sums.map(|sum| sum.map(libm::sqrt));
        Causes { noise, restoration, calibration, clamping }
    }
}

/// Variances of what fits have in the gyros' increments (rad²).
fn bridged(model: &SigmaModel, gains: Option<&[Gain; MAX_SENSORS]>) -> Lanes {
    let mut bridged = [0.0; MAX_SENSORS];
    let known = model.gyros.iter().zip(gains.into_iter().flatten());
    for (bridged, (parts, gain)) in bridged.iter_mut().zip(known) {
        let (white, instants) = fast(parts);
        *bridged = white * gain.white + instants * gain.instants;
    }
    bridged
}

/// N² and Q².
fn fast(parts: &SigmaParts) -> (f64, f64) {
    let square = |stated: Option<f64>| stated.map_or(f64::NAN, |sigma| sigma * sigma);
    (square(parts.random_walk), square(parts.quantisation))
}

/// Variance of a bias at a temperature (°C).
fn bias(parts: &SigmaParts, temperature_deg_c: f64) -> f64 {
    parts.bias.as_ref().map_or(f64::NAN, |bias| bias.variance(temperature_deg_c))
}
