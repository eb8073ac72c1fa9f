//! What real sensors do beyond the models of each kind: drift with acceleration, scale factors that depend on the rate,
//! accelerometers away from the reference point and with a square in them, friction in what follows temperature.
//!
//! A scenario states each where it wants it; a unit without any is the same as ever, to the bit.

use isotherm_correction::sample::Sensors;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::gyros::TickTime;
use crate::thermal::Interval;
use crate::trajectory::{Increments, Trajectory};
use crate::vector::{Vector, cross, dot, minus, plus, scale};

/// Length over which a rate or a force counts as the one at its middle (s).
const INSTANT_S: f64 = 1e-6;
/// Parts of a tick over which squares are averaged, each by three Gauss–Legendre nodes: enough for eight periods in a tick.
const PANELS: u8 = 8;

/// Effects of all sensors of a unit; none where a list is empty.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Effects {
    /// One entry per gyro, or none.
    #[serde(default)]
    pub gyros: Vec<GyroEffects>,
    /// One entry per accelerometer, or none.
    #[serde(default)]
    pub accelerometers: Vec<AccelerometerEffects>,
    /// Supply voltage, where sensors depend on it.
    #[serde(default)]
    pub supply: Option<Supply>,
    /// Friction in what turns the gyros' axes with the housing's temperature.
    #[serde(default)]
    pub gyro_axes: Option<AxesPlay>,
    /// Friction in what turns the accelerometers' axes.
    #[serde(default)]
    pub accelerometer_axes: Option<AxesPlay>,
}

impl Effects {
    /// Whether there are none.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// Effects of one gyro.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GyroEffects {
    /// Drift by the specific force along each case axis (rad/s per m/s²); adds to the input rate [IEEE 528].
    #[schemars(inner(range(min = -1.0, max = 1.0)))]
    pub acceleration_rad_per_s_per_m_per_s2: [f64; 3],
    /// Its change with the gyro's temperature (rad/s per m/s² per K).
    #[schemars(inner(range(min = -1.0, max = 1.0)))]
    pub acceleration_per_k: [f64; 3],
    /// Temperature to which the former refers (°C).
    #[schemars(range(min = -100.0, max = 200.0))]
    pub reference_deg_c: f64,
    /// Asymmetry a of the scale (dimensionless): the gyro senses R·(1 + a) of a positive rate, R·(1 − a) of a negative one.
    #[schemars(range(min = -0.1, max = 0.1))]
    pub scale_asymmetry: f64,
    /// Curvature c of the scale over the rate ((rad/s)⁻²): the gyro senses R·(1 + c·R²), R the mean rate of the tick.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub scale_curvature_s2_per_rad2: f64,
    /// By how much of a tick its reading lags: a tick's is that of a span so much earlier.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub delay_ticks: f64,
    /// Friction in what follows temperature.
    pub play: Option<Play>,
    /// Bias by the gradient across it, its own temperature less that of the housing (rad/s per K).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub gradient_rad_per_s_per_k: f64,
    /// Bias by the supply voltage beyond its nominal value (rad/s per V).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub supply_rad_per_s_per_v: f64,
}

/// Effects of one accelerometer.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AccelerometerEffects {
    /// Where it sits from the point whose motion is the truth, in case axes (m).
    #[schemars(inner(range(min = -10.0, max = 10.0)))]
    pub position_m: [f64; 3],
    /// Second-order term K2 (1/(m/s²)): it senses f + K2·f², f along its axis at every instant.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub second_order_s2_per_m: f64,
    /// By how much of a tick its reading lags, as for gyros.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub delay_ticks: f64,
    /// Friction in what follows temperature.
    pub play: Option<Play>,
    /// Error by the gradient across it, its own temperature less that of the housing (m/s² per K).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub gradient_m_per_s2_per_k: f64,
    /// Error by the supply voltage beyond its nominal value (m/s² per V).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub supply_m_per_s2_per_v: f64,
}

/// Supply voltage of a unit, which swings with its load; read with the thermometers, as a channel of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Supply {
    /// Name of its channel, 1…24 bytes.
    #[schemars(length(min = 1, max = 24))]
    pub channel: String,
    /// Nominal voltage (V), about which it swings.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub nominal_v: f64,
    /// Amplitude of the swing (V).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub swing_v: f64,
    /// Period of the swing (s, > 0).
    #[schemars(range(min = 1e-12, max = 1e12))]
    pub period_s: f64,
}

impl Supply {
    /// Voltage beyond the nominal one at a time (V).
    pub(crate) fn beyond_v(&self, time_s: f64) -> f64 {
        self.swing_v * libm::sin(core::f64::consts::TAU * time_s / self.period_s)
    }
}

/// A play: something dragged along by temperature with a slack, so that the way up is not the way down [Prandtl, Ishlinskii].
///
/// p = T at the start, then always the nearest to its last value within T ± w; the error is g·(p − T): −g·w after enough of
/// heating, +g·w after enough of cooling, and a loop of 2·g·w between.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Play {
    /// Half width w of the slack (K, > 0).
    #[schemars(range(min = 1e-12, max = 1e12))]
    pub half_width_k: f64,
    /// Error g by which the sensor is off per kelvin that the play is behind (rad/s or m/s² per K).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub per_k: f64,
}

/// A play in the mounts of sensors: this share of the turning of their axes is dragged along, the rest follows at once \[004\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxesPlay {
    /// Half width w of the slack (K, > 0).
    #[schemars(range(min = 1e-12, max = 1e12))]
    pub half_width_k: f64,
    /// Share of the turning.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub share: f64,
}

/// A play with its memory.
#[derive(Debug, Clone, Copy, Default)]
struct PlayState {
    /// Temperature to which it has followed (°C); `None` before the first.
    followed_deg_c: Option<f64>,
    error: Interval,
}

impl PlayState {
    fn step(&mut self, play: Option<Play>, deg_c: f64) {
        let Some(Play { half_width_k, per_k }) = play else { return };
        let last = self.followed_deg_c.unwrap_or(deg_c);
        let followed = last.max(deg_c - half_width_k).min(deg_c + half_width_k);
        self.followed_deg_c = Some(followed);
        self.error.advance(per_k * (followed - deg_c));
    }
}

/// The effects of a unit with their memory.
#[derive(Debug, Clone)]
pub(crate) struct EffectsState {
    gyros: Sensors<(GyroEffects, PlayState)>,
    accelerometers: Sensors<(AccelerometerEffects, PlayState)>,
    pub(crate) gyro_axes: AxesState,
    pub(crate) accel_axes: AxesState,
    pub(crate) supply: Option<Supply>,
}

/// Axes of the sensors of one kind with the play in their mounts, if any: by how much they are behind the housing (K).
#[derive(Debug, Clone)]
pub(crate) struct AxesState(Option<Play>, PlayState);

impl AxesState {
    fn new(axes: Option<AxesPlay>) -> Self {
        let play = axes.map(|axes| Play { half_width_k: axes.half_width_k, per_k: axes.share });
        Self(play, PlayState::default())
    }

    /// Temperature as which they turn (°C), in a housing of `housing_deg_c`.
    pub(crate) fn deg_c(&self, housing_deg_c: f64, share: f64) -> f64 {
        if self.0.is_some() { housing_deg_c + self.1.error.at(share) } else { housing_deg_c }
    }
}

/// What the accelerometers sense of one tick beside the specific force at the reference point.
struct Felt {
    /// Mean rate (rad/s) and its mean change (rad/s²).
    mean_change: Vector,
    /// Integral of the specific force (m/s).
    velocity: Vector,
    /// Rate and specific force at instants of the tick, each with its share of it.
    instants: Vec<(f64, (Vector, Vector))>,
}

impl EffectsState {
    pub(crate) fn new(effects: &Effects) -> Self {
        Self {
            gyros: effects.gyros.iter().map(|gyro| (*gyro, PlayState::default())).collect(),
            accelerometers: effects
                .accelerometers
                .iter()
                .map(|accel| (*accel, PlayState::default()))
                .collect(),
            gyro_axes: AxesState::new(effects.gyro_axes),
            accel_axes: AxesState::new(effects.accelerometer_axes),
            supply: effects.supply.clone(),
        }
    }

    /// Follows the temperatures of sensors and housing (°C) at the end of a step of the thermal clock.
    pub(crate) fn thermal_step(&mut self, gyros_deg_c: &[f64], accels_deg_c: &[f64], housing_deg_c: f64) {
        for AxesState(play, state) in [&mut self.gyro_axes, &mut self.accel_axes] {
            state.step(*play, housing_deg_c);
        }
        for ((gyro, play), deg_c) in self.gyros.iter_mut().zip(gyros_deg_c) {
            play.step(gyro.play, *deg_c);
        }
        for ((accel, play), deg_c) in self.accelerometers.iter_mut().zip(accels_deg_c) {
            play.step(accel.play, *deg_c);
        }
    }

    /// By how much of a tick a gyro's reading lags.
    pub(crate) fn gyro_delay_ticks(&self, index: usize) -> f64 {
        self.gyros.get(index).map_or(0.0, |(gyro, _)| gyro.delay_ticks)
    }

    /// Supply voltage beyond the nominal one (V).
    fn beyond_v(&self, time_s: f64) -> f64 {
        self.supply.as_ref().map_or(0.0, |supply| supply.beyond_v(time_s))
    }

    /// Changes the input angles (rad) of both halves of a tick, over which the increments are `parts`; gives what
    /// adds to each gyro's drift (rad/s).
    pub(crate) fn sense(
        &self,
        halves: &mut Sensors<[f64; 2]>,
        parts: &[Increments; 2],
        TickTime { middle_s, length_s, share, housing_deg_c, .. }: TickTime,
        sensors_deg_c: &[f64],
    ) -> Sensors<f64> {
        let beyond_v = self.beyond_v(middle_s);
        let gyros = self.gyros.iter().zip(halves).zip(sensors_deg_c);
        let sense = |(((gyro, play), halves), deg_c): ((&(GyroEffects, PlayState), &mut [f64; 2]), &f64)| {
            let away_k = deg_c - gyro.reference_deg_c;
            let by_force =
                plus(gyro.acceleration_rad_per_s_per_m_per_s2, scale(gyro.acceleration_per_k, away_k));
            let rate = (halves[0] + halves[1]) / length_s;
            let sign = if rate < 0.0 { -1.0 } else { 1.0 };
            let factor = 1.0 + gyro.scale_asymmetry * sign + gyro.scale_curvature_s2_per_rad2 * rate * rate;
            let slow = play.error.at(share)
                + gyro.gradient_rad_per_s_per_k * (deg_c - housing_deg_c)
                + gyro.supply_rad_per_s_per_v * beyond_v;
            // Halves of gyros without dither are the whole tick and nothing.
            let of_tick = if parts[1] == Increments::default() { [1.0, 0.0] } else { [0.5, 0.5] };
            let mut drift_rad = 0.0;
            for ((half, part), share) in halves.iter_mut().zip(parts).zip(of_tick) {
                let own = dot(by_force, part.velocity) + slow * share * length_s;
                *half = factor * *half + own;
                drift_rad += own;
            }
            drift_rad / length_s
        };
        gyros.map(sense).collect()
    }

    /// What each accelerometer with input axes `axes` senses beside the specific force at the reference point (m/s²), mean of the
    /// tick.
    pub(crate) fn feel(
        &self,
        trajectory: &Trajectory,
        TickTime { middle_s, length_s, share, housing_deg_c, .. }: TickTime,
        sensors_deg_c: &[f64],
        axes: &[Vector],
    ) -> Sensors<f64> {
        if self.accelerometers.is_empty() {
            return Sensors::new();
        }
        let on_time = Felt::of(trajectory, middle_s, length_s);
        let beyond_v = self.beyond_v(middle_s);
        let sensors = self.accelerometers.iter().zip(axes).zip(sensors_deg_c);
        sensors
            .map(|(((accel, play), &axis), deg_c)| {
                let arm = accel.position_m;
                let late = (accel.delay_ticks != 0.0)
                    .then(|| Felt::of(trajectory, middle_s - accel.delay_ticks * length_s, length_s));
                let felt = late.as_ref().unwrap_or(&on_time);
                let mut sum = dot(axis, cross(felt.mean_change, arm));
                if let Some(late) = &late {
                    sum += dot(axis, scale(minus(late.velocity, on_time.velocity), 1.0 / length_s));
                }
                for (weight, (rate, force)) in &felt.instants {
                    let along = dot(axis, *force);
                    let centripetal = dot(axis, cross(*rate, cross(*rate, arm)));
                    sum += weight * (centripetal + accel.second_order_s2_per_m * along * along);
                }
                sum + play.error.at(share)
                    + accel.gradient_m_per_s2_per_k * (deg_c - housing_deg_c)
                    + accel.supply_m_per_s2_per_v * beyond_v
            })
            .collect()
    }
}

impl Felt {
    fn of(trajectory: &Trajectory, middle_s: f64, length_s: f64) -> Self {
        const NODES: [(f64, f64); 3] = [
            (-0.774_596_669_241_483_4, 5.0 / 18.0),
            (0.0, 8.0 / 18.0),
            (0.774_596_669_241_483_4, 5.0 / 18.0),
        ];
        let at = |time_s: f64| {
            let Increments { angle, velocity } = trajectory.increments(time_s, INSTANT_S);
            (scale(angle, 1.0 / INSTANT_S), scale(velocity, 1.0 / INSTANT_S))
        };
        let ends = [0.5, -0.5].map(|side| at(middle_s + side * length_s).0);
        let panel_s = length_s / f64::from(PANELS);
        let centres_s =
            (0..PANELS).map(|panel| middle_s - 0.5 * length_s + (f64::from(panel) + 0.5) * panel_s);
        let nodes = centres_s.flat_map(|centre_s| {
            NODES.map(|(node, weight)| (weight / f64::from(PANELS), centre_s + 0.5 * node * panel_s))
        });
        let instants = nodes.map(|(weight, time_s)| (weight, at(time_s)));
        Self {
            mean_change: scale(minus(ends[0], ends[1]), 1.0 / length_s),
            velocity: trajectory.increments(middle_s, length_s).velocity,
            instants: instants.collect(),
        }
    }
}

#[cfg(test)]
mod tests;
