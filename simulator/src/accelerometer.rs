//! Pendulous accelerometer: quartz with a pulse output, or micromechanical with an output in m/s².

use isotherm_correction::sample::{OutputKind, Readings, Sensors};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::counter::Counter;
use crate::gyros::TickTime;
use crate::noise::{Noise, Purpose};
use crate::orientation::Orientation;
use crate::polynomial;
use crate::thermal::{Node, NodeState};
use crate::vector::dot;

/// One accelerometer: output `U = K(T)·f/r(T_board) + S(T)`, f the specific force along its input axis.
///
/// K leads from the input to the output (the direction opposite to the gyros'); `r = K_ref/K(T_board)` is 1 at
/// the reference temperature. U is in volts for a quartz accelerometer and in m/s² for one that is digital; the
/// text below writes "V" for either.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Accelerometer {
    /// Thermal node behind the housing.
    pub node: Node,
    /// Reference temperature T₀ of K, S and r (°C).
    #[schemars(range(min = -100.0, max = 200.0))]
    pub reference_deg_c: f64,
    /// K (V per m/s²) by powers of T − T₀, 0…2.
    #[schemars(inner(range(min = -1e12, max = 1e12)))]
    pub scale_v_per_m_per_s2: [f64; 3],
    /// S (V) by powers of T − T₀, 0…2.
    #[schemars(inner(range(min = -1e12, max = 1e12)))]
    pub bias_v: [f64; 3],
    /// r (dimensionless) by powers of the board's T − T₀, 0…2; the first is 1.
    pub board_ratio: [f64; 3],
    /// Velocity random walk (m/s/√s, ≥ 0).
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub velocity_random_walk_m_per_s_per_sqrt_s: f64,
}

/// What leaves the accelerometers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AccelerometerOutput {
    /// Counts of a voltage-to-frequency converter over the tick.
    Counts {
        /// Converter gain (Hz/V, > 0): a corrector that takes counts as U·Δt has K and S times this.
        #[schemars(range(min = 1e-12, max = 1e12))]
        hz_per_v: f64,
        /// Whole counts, with the fraction carried over; otherwise exact reals.
        quantised: bool,
    },
    /// Mean of U over the tick.
    Mean,
}

/// All accelerometers of a unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Accelerometers {
    /// What leaves them.
    pub output: AccelerometerOutput,
    /// The sensors, 3…8.
    #[schemars(length(min = 3, max = 8))]
    pub sensors: Vec<Accelerometer>,
    /// Their input axes.
    pub orientation: Orientation,
}

impl Accelerometers {
    /// What the readings stand for.
    #[must_use]
    pub fn output_kind(&self) -> OutputKind {
        match self.output {
            AccelerometerOutput::Counts { .. } => OutputKind::Counts,
            AccelerometerOutput::Mean => OutputKind::Mean,
        }
    }
}

/// All accelerometers of a unit with their memory.
#[derive(Debug, Clone)]
pub(crate) struct AccelerometersState {
    output: AccelerometerOutput,
    pub(crate) orientation: Orientation,
    sensors: Vec<AccelerometerState>,
}

#[derive(Debug, Clone)]
struct AccelerometerState {
    sensor: Accelerometer,
    node: NodeState,
    noise: Noise,
    counter: Counter,
}

impl AccelerometersState {
    pub(crate) fn new(block: &Accelerometers, seed: u64, step_s: f64, initial: impl Fn(Node) -> f64) -> Self {
        let sensor = |(sensor, index): (&Accelerometer, u32)| {
            let mut noise = Noise::new(seed, Purpose::Accelerometer(index));
            AccelerometerState {
                sensor: *sensor,
                node: NodeState::new(sensor.node, step_s, initial(sensor.node)),
                counter: Counter::starting_at(noise.uniform()),
                noise,
            }
        };
        Self {
            output: block.output,
            orientation: block.orientation.clone(),
            sensors: block.sensors.iter().zip(0..).map(sensor).collect(),
        }
    }

    pub(crate) fn thermal_step(&mut self, from_deg_c: f64, to_deg_c: f64) {
        for state in &mut self.sensors {
            state.node.step(from_deg_c, to_deg_c);
        }
    }

    pub(crate) fn deg_c(&self, share: f64) -> Sensors<f64> {
        self.sensors.iter().map(|state| state.node.deg_c.at(share)).collect()
    }

    /// Readings of a tick with these input axes; `extra` is added to each sensor's specific force (m/s²).
    pub(crate) fn tick(
        &mut self,
        velocity_m_per_s: [f64; 3],
        time: TickTime,
        axes: &[[f64; 3]],
        board_deg_c: f64,
        extra: impl Fn(usize) -> f64,
    ) -> Readings {
        let output = self.output;
        let states = self.sensors.iter_mut().zip(axes).enumerate();
        let read = |(index, (state, &axis)): (usize, (&mut AccelerometerState, &[f64; 3]))| {
            let force = dot(axis, velocity_m_per_s) / time.length_s + extra(index);
            state.read(force, time, board_deg_c, output)
        };
        states.map(read).collect()
    }
}

impl AccelerometerState {
    fn read(&mut self, force: f64, time: TickTime, board_deg_c: f64, output: AccelerometerOutput) -> f64 {
        let TickTime { length_s, share, .. } = time;
        let sensor = &self.sensor;
        let away_k = self.node.deg_c.at(share) - sensor.reference_deg_c;
        let noise = self.noise.mean(sensor.velocity_random_walk_m_per_s_per_sqrt_s, length_s);
        let scale = polynomial::at(&sensor.scale_v_per_m_per_s2, away_k);
        let ratio = polynomial::at(&sensor.board_ratio, board_deg_c - sensor.reference_deg_c);
        let volts = scale * (force + noise) / ratio + polynomial::at(&sensor.bias_v, away_k);
        match output {
            AccelerometerOutput::Mean => volts,
            AccelerometerOutput::Counts { hz_per_v, quantised } => {
                self.counter.count(volts * hz_per_v * length_s, quantised)
            }
        }
    }
}
