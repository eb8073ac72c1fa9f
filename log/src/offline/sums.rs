//! Figures of corrected ticks: how many, what was flagged, mean rates and specific forces.

use std::collections::BTreeMap;

use isotherm_correction::sample::{CorrectedTick, SensorFlags};
use isotherm_correction::units::{AngularRate, Span};
use serde::Serialize;

/// What a unit on the ground does not read over a whole log (m/s², °/s).
const FORCES: std::ops::RangeInclusive<f64> = 5.0..=15.0;
const MOST_RATE: f64 = 100.0;
/// One of so many outputs may have no fresh temperature.
const STALE: u64 = 20;

/// Sums over corrected ticks.
#[derive(Debug, Clone, Default)]
pub struct Sums {
    /// Raw ticks that are in the outputs.
    ticks: u64,
    /// Outputs.
    outputs: u64,
    /// Raw ticks that outputs announced as missing.
    missed: u64,
    /// Outputs that announced any.
    gaps: u64,
    /// Time covered (ns).
    duration_ns: i64,
    /// Angles turned (rad).
    angle_rad: [f64; 3],
    /// Velocity gained (m/s).
    velocity_m_per_s: [f64; 3],
    /// The same, whatever its direction.
    speed_m_per_s: f64,
    flags: FlagCounts,
}

/// Outputs by their flags.
#[derive(Debug, Clone, Default)]
pub(crate) struct FlagCounts {
    /// With each flag, by its name.
    pub(crate) ticks: BTreeMap<&'static str, u64>,
    /// In which any sensor has a flag other than `VALID`, by its name.
    pub(crate) sensors: BTreeMap<&'static str, u64>,
}

impl FlagCounts {
    /// Counts one output.
    pub(crate) fn add(&mut self, tick: &CorrectedTick) {
        for (name, _) in tick.flags.iter_names() {
            *self.ticks.entry(name).or_default() += 1;
        }
        let sensors = tick.gyro_flags.iter().chain(&tick.accel_flags);
        let any = sensors.fold(SensorFlags::empty(), |any, flags| any | *flags);
        for (name, _) in (any - SensorFlags::VALID).iter_names() {
            *self.sensors.entry(name).or_default() += 1;
        }
    }
}

/// What the sums come to.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Raw ticks that are in the outputs.
    pub ticks: u64,
    /// Outputs; fewer than ticks where ticks are summed to navigation steps.
    pub outputs: u64,
    /// Gaps that were announced.
    pub gaps: u64,
    /// Raw ticks that are missing in them.
    pub missed_ticks: u64,
    /// Time covered (s).
    pub duration_s: f64,
    /// Mean rates about the case axes (°/h).
    pub mean_rate_deg_per_h: [f64; 3],
    /// Mean specific force along the case axes (m/s²).
    pub mean_specific_force_m_per_s2: [f64; 3],
    /// Mean size of the specific force (m/s²).
    #[serde(skip)]
    pub mean_force_m_per_s2: f64,
    /// Outputs with each flag that occurred.
    pub flags: BTreeMap<&'static str, u64>,
    /// Outputs in which any sensor has a flag other than `VALID`, for each that occurred.
    pub sensor_flags: BTreeMap<&'static str, u64>,
}

impl Sums {
    /// Adds one output.
    pub fn add(&mut self, tick: &CorrectedTick) {
        self.ticks += u64::from(tick.ticks);
        self.outputs += 1;
        self.missed = self.missed.saturating_add(tick.missed);
        self.gaps += u64::from(tick.missed > 0);
        self.duration_ns = self.duration_ns.saturating_add(tick.duration.as_ns());
        for (sum, delta) in self.angle_rad.iter_mut().zip(tick.delta_angle) {
            *sum += delta;
        }
        for (sum, delta) in self.velocity_m_per_s.iter_mut().zip(tick.delta_velocity) {
            *sum += delta;
        }
        self.speed_m_per_s += size(tick.delta_velocity);
        self.flags.add(tick);
    }

    /// Raw ticks so far.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// What the sums come to; means are 0 where no time was covered.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let duration_s = Span::from_ns(self.duration_ns).as_s();
        let mean = |sum: f64| if duration_s > 0.0 { sum / duration_s } else { 0.0 };
        Summary {
            ticks: self.ticks,
            outputs: self.outputs,
            gaps: self.gaps,
            missed_ticks: self.missed,
            duration_s,
            mean_rate_deg_per_h: self
                .angle_rad
                .map(|sum| AngularRate::from_rad_per_s(mean(sum)).as_deg_per_h()),
            mean_specific_force_m_per_s2: self.velocity_m_per_s.map(mean),
            mean_force_m_per_s2: mean(self.speed_m_per_s),
            flags: self.flags.ticks.clone(),
            sensor_flags: self.flags.sensors.clone(),
        }
    }
}

/// The size of a vector.
fn size(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}

impl Summary {
    /// What looks like a wrong unit or scale, or like temperatures of another time, in words.
    #[must_use]
    pub fn doubts(&self) -> Vec<String> {
        let (rate, force) = (size(self.mean_rate_deg_per_h) / 3600.0, self.mean_force_m_per_s2);
        let check = "unless the unit moved so, check the units in the mapping and the calibration";
        let rate =
            (rate > MOST_RATE).then(|| format!("the mean rate of the whole log is {rate:.1} °/s: {check}"));
        // Without accelerometers it is zero.
        let force = (force > 0.0 && !FORCES.contains(&force)).then(|| {
            format!("the mean specific force of the whole log is {force:.3} m/s², far from gravity: {check}")
        });
        let stale = self.sensor_flags.get("STALE_TEMPERATURE").copied().unwrap_or(0);
        let stale = (stale > self.outputs / STALE).then(|| {
            format!(
                "{stale} of {} outputs have no fresh temperature (STALE_TEMPERATURE): check that the log's temperatures begin and end \
                 with its gyros, on one clock (`isotherm-replay info LOG` shows it)",
                self.outputs
            )
        });
        [rate, force, stale].into_iter().flatten().collect()
    }
}
