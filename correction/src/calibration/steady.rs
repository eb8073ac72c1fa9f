//! The correction at a stated thermal state, without memory: what two calibrations are compared by.

use alloc::vec::Vec;

use super::Calibration;
use crate::channel::ThermalState;
use crate::earth::EARTH_RATE;
use crate::lanes::Lanes;
use crate::orientation::{Inverse, Orientation, SensorMask};
use crate::sample::{ChannelName, LasingMode, MAX_SENSORS, OutputKind, Sensors};
use crate::thermal::{Follows, Motion, MotionTerms};
use crate::units::STANDARD_GRAVITY_M_PER_S2;

/// What a calibration does to a unit that has been on for long and whose temperatures move steadily.
///
/// Lags have settled on the ramp, the trend since turn-on has reached the end of its interval, no switch of the mode
/// is near, and the slow meander has the sign +. The drift estimate is no part of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Steady {
    /// Ω: bias of each gyro (rad/s), in the sense of its input axis; subtracted.
    pub gyro_bias: Sensors<f64>,
    /// K(T): increment weight of each gyro (rad per count, or rad per rad); multiplies.
    pub gyro_weight: Sensors<f64>,
    /// Input axis of each gyro in case axes: the rows of C(T).
    pub gyro_axes: Sensors<[f64; 3]>,
    /// `C⁺·Ω`: the rate that the biases take away, in case axes (rad/s).
    pub gyro_rate_in_case: [f64; 3],
    /// Drift of each gyro by the specific force along each case axis (rad/s per m/s²); subtracted. No part of `gyro_bias`.
    pub gyro_drift_by_force: Sensors<[f64; 3]>,
    /// K2: second-order term of each accelerometer (s²/m). No part of `accel_bias`.
    pub accel_second_order: Sensors<f64>,
    /// `S·r/K`: bias of each accelerometer as a specific force (m/s²); subtracted.
    pub accel_bias: Sensors<f64>,
    /// `K/r`: output of each accelerometer per specific force, its board included (V, counts/s or m/s² per m/s²);
    /// divides.
    pub accel_scale: Sensors<f64>,
    /// Input axis of each accelerometer in case axes.
    pub accel_axes: Sensors<[f64; 3]>,
    /// The specific force that the biases take away, in case axes (m/s²); zero without accelerometers.
    pub accel_force_in_case: [f64; 3],
    /// Channels, by index, whose temperature is outside [`Calibration::range_of`].
    pub outside: Vec<usize>,
    outputs: (OutputKind, OutputKind),
    gyro_inverse: Option<Inverse>,
    accel_inverse: Option<Inverse>,
}

/// By how much the output of a unit at rest steps when one calibration follows another, in case axes.
///
/// What the biases do is known; what weights, scale factors and axes do depends on how the unit stands. Each number is
/// the difference of the biases, made larger by the most that the rest can do at any attitude: to the Earth's rate and
/// to 1 g.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Step of the corrected angular rate (rad/s).
    pub angular_rate: [f64; 3],
    /// Step of the corrected specific force (m/s²); zero without accelerometers.
    pub specific_force: [f64; 3],
}

impl Calibration {
    /// The correction at the temperatures that `thermal` gives by the channel's name, and in a lasing mode.
    ///
    /// A channel without a temperature, and a sensor without a channel, stand at the assumed one. Without a mode the
    /// magnetic bias has the sign +, as in the state machine.
    #[must_use]
    pub fn steady(
        &self,
        thermal: impl Fn(&ChannelName) -> Option<ThermalState>,
        mode: Option<LasingMode>,
    ) -> Steady {
        let known: Vec<Option<ThermalState>> =
            self.channels.iter().map(|channel| thermal(channel.name())).collect();
        let assumed = ThermalState { temperature: self.filter.assumed_deg_c, ..ThermalState::default() };
        let state =
            |channel: Option<usize>| channel.and_then(|channel| *known.get(channel)?).unwrap_or(assumed);
        let mean = |following: &[usize]| {
            let known = following.iter().filter_map(|&channel| *known.get(channel)?);
            let (sum, count) = known.fold((0.0, 0.0), |(sum, n), state| (sum + state.temperature, n + 1.0));
            if count > 0.0 { sum / count } else { assumed.temperature }
        };
        let others = |source| Some(known.get(self.place(source)).copied()??.temperature);
        let sign = mode.map_or(1.0, LasingMode::sign);

        let trends: Lanes =
            self.trends.as_ref().map_or([0.0; MAX_SENSORS], |trends| trends.at(f64::INFINITY));
        let gyros = self.gyros.iter().zip(trends).map(|(gyro, trend)| {
            let [weight, bias, magnetic, meander] = gyro.steady(&state(gyro.channel), &self.filter, &others);
            (bias + trend + sign * magnetic + meander, weight)
        });
        let (gyro_bias, gyro_weight): (Sensors<_>, Sensors<_>) = gyros.unzip();
        let accels = self.accels.iter().map(|accel| {
            let thermal = state(accel.channel);
            let [bias, _] = accel.steady(&thermal, &self.filter, &others);
            let ratio = accel.board_ratio.at(state(accel.board_channel).temperature).value;
            let scale = accel.scale_factor.at(thermal.temperature).value / ratio;
            (bias / scale, scale)
        });
        let (accel_bias, accel_scale): (Sensors<_>, Sensors<_>) = accels.unzip();
        let in_motion = |sensors: fn(&Motion) -> &Vec<MotionTerms>| {
            let sensors = self.motion.as_deref().map_or(&[][..], |motion| sensors(motion));
            let lines = |sensor: &MotionTerms| sensor.steady(&state(sensor.channel), &self.filter, &others);
            sensors.iter().map(lines).collect::<Sensors<[f64; 4]>>()
        };
        let gyros_in_motion = in_motion(|motion| &motion.gyros);
        let accels_in_motion = in_motion(|motion| &motion.accels);
        let gyro_temperature = mean(&self.gyro_orientation_channels);
        let accel_temperature = mean(&self.accel_orientation_channels);
        let accel_orientation = self.accel_orientation.as_ref();
        let gyro_inverse = inverse(&self.gyro_orientation, gyro_temperature);
        let accel_inverse = accel_orientation.and_then(|axes| inverse(axes, accel_temperature));
        let in_case = |inverse: &Option<Inverse>, bias: &[f64]| {
            inverse.as_ref().map(|inverse| inverse.apply(bias)).unwrap_or_default()
        };
        let outside = known.iter().take(self.temperatures).enumerate().filter(|(channel, state)| {
            let range = self.range_of(*channel);
            range.zip(**state).is_some_and(|([low, high], state)| !(low..=high).contains(&state.temperature))
        });
        Steady {
            gyro_axes: rows(&self.gyro_orientation, gyro_temperature),
            gyro_rate_in_case: in_case(&gyro_inverse, &gyro_bias),
            accel_axes: accel_orientation.map(|axes| rows(axes, accel_temperature)).unwrap_or_default(),
            accel_force_in_case: in_case(&accel_inverse, &accel_bias),
            outside: outside.map(|(channel, _)| channel).collect(),
            outputs: (self.gyro_output, self.accel_output),
            gyro_drift_by_force: gyros_in_motion.iter().map(|[x, y, z, _]| [*x, *y, *z]).collect(),
            accel_second_order: accels_in_motion.iter().map(|[square, ..]| *square).collect(),
            gyro_bias,
            gyro_weight,
            accel_bias,
            accel_scale,
            gyro_inverse,
            accel_inverse,
        }
    }
}

impl Steady {
    /// The step when `next` follows this one.
    ///
    /// `None` where the two are not for the same readings (number of sensors, kind of output), so that there is no such
    /// step, or where one of them is no number.
    #[must_use]
    pub fn jump(&self, next: &Self) -> Option<Jump> {
        let counts = |steady: &Self| (steady.gyro_bias.len(), steady.accel_bias.len(), steady.outputs);
        if counts(self) != counts(next) {
            return None;
        }
        let gyro_ratios = next.gyro_weight.iter().zip(&self.gyro_weight).map(|(new, old)| new / old);
        let gyro_ratios = gyro_ratios.collect::<Sensors<f64>>();
        let gyro_inverse = next.gyro_inverse.as_ref()?;
        let mut angular_rate = step(
            (&self.gyro_axes, &self.gyro_bias),
            (gyro_inverse, &next.gyro_bias),
            &gyro_ratios,
            EARTH_RATE.as_rad_per_s(),
        );
        let drifts = (&self.gyro_drift_by_force[..], &next.gyro_drift_by_force[..]);
        widen(&mut angular_rate, by_force(gyro_inverse, &gyro_ratios, drifts));
        let accel_ratios = self.accel_scale.iter().zip(&next.accel_scale).map(|(old, new)| old / new);
        let specific_force = match &next.accel_inverse {
            Some(inverse) => {
                let ratios = accel_ratios.collect::<Sensors<f64>>();
                let (axes, next_bias) = ((&self.accel_axes[..], &self.accel_bias[..]), &next.accel_bias);
                let mut step = step(axes, (inverse, next_bias), &ratios, STANDARD_GRAVITY_M_PER_S2);
                let squares = (&self.accel_second_order[..], &next.accel_second_order[..]);
                widen(&mut step, by_square(inverse, ratios.len(), squares));
                step
            }
            None if next.accel_bias.is_empty() => [0.0; 3],
            None => return None,
        };
        let finite = angular_rate.iter().chain(&specific_force).all(|x| x.is_finite());
        finite.then_some(Jump { angular_rate, specific_force })
    }
}

/// Change of the output for the worst input of a given size.
///
/// A sensor that reads s under the first calibration reads ρ·(s + b) − b′ under the second, ρ being the ratio of the
/// weights. With s = C·v the output changes by `C′⁺·(ρ·b − b′) + (C′⁺·ρ·C − 1)·v`.
fn step(
    (axes, bias): (&[[f64; 3]], &[f64]),
    (inverse, next_bias): (&Inverse, &[f64]),
    ratios: &[f64],
    size: f64,
) -> [f64; 3] {
    let biases = ratios.iter().zip(bias).zip(next_bias).map(|((ratio, old), new)| ratio * old - new);
    let mut step = inverse.apply(&biases.collect::<Sensors<f64>>());
    let mut turned = columns(inverse, ratios, |sensor, axis| ratios[sensor] * axes[sensor][axis]);
    (0..3).for_each(|axis| turned[axis][axis] -= 1.0);
    widen(&mut step, largest(turned, size));
    step
}

/// `C⁺·M` by columns, M by sensor and case axis.
fn columns(inverse: &Inverse, sensors: &[f64], of: impl Fn(usize, usize) -> f64) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|axis| {
        inverse.apply(&(0..sensors.len()).map(|sensor| of(sensor, axis)).collect::<Sensors<f64>>())
    })
}

/// Most that a matrix makes of a vector of a size along each axis, whatever its direction.
fn largest(columns: [[f64; 3]; 3], size: f64) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let square: f64 = columns.iter().map(|column| column[axis] * column[axis]).sum();
        libm::sqrt(square) * size
    })
}

/// Makes a step larger in its own direction.
fn widen(step: &mut [f64; 3], by: [f64; 3]) {
    step.iter_mut().zip(by).for_each(|(step, by)| *step += libm::copysign(by, *step));
}

/// Most that the difference of two sets of drifts with force does at 1 g, whatever its direction (rad/s).
fn by_force(inverse: &Inverse, ratios: &[f64], (old, new): (&[[f64; 3]], &[[f64; 3]])) -> [f64; 3] {
    let along = |drifts: &[[f64; 3]], gyro: usize, axis| drifts.get(gyro).map_or(0.0, |drift| drift[axis]);
    let step = |gyro, axis| ratios[gyro] * along(old, gyro, axis) - along(new, gyro, axis);
    largest(columns(inverse, ratios, step), STANDARD_GRAVITY_M_PER_S2)
}

/// Most that the difference of two sets of second-order terms does at 1 g along every input axis (m/s²).
fn by_square(inverse: &Inverse, sensors: usize, (old, new): (&[f64], &[f64])) -> [f64; 3] {
    let mut most = [0.0; 3];
    for sensor in 0..sensors {
        let of = |terms: &[f64]| terms.get(sensor).copied().unwrap_or_default();
        let step = (of(old) - of(new)) * STANDARD_GRAVITY_M_PER_S2 * STANDARD_GRAVITY_M_PER_S2;
        let column = inverse.column(sensor);
        most.iter_mut().zip(column).for_each(|(most, share)| *most += (share * step).abs());
    }
    most
}

/// C⁺ of all sensors.
fn inverse(orientation: &Orientation, temperature_deg_c: f64) -> Option<Inverse> {
    orientation.inverse(temperature_deg_c, SensorMask::all(orientation.sensors()))
}

/// Rows of C.
fn rows(orientation: &Orientation, temperature_deg_c: f64) -> Sensors<[f64; 3]> {
    orientation.rows_at(temperature_deg_c).into_iter().take(orientation.sensors()).collect()
}
