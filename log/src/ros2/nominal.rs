//! Raw readings in SI units at nominal scale: what an Imu message of an uncorrected unit can say.
//!
//! Nothing is corrected here: no temperature, bias, mode or misalignment enters. x, y and z are the input axes of the
//! first, second and third sensor, not the case axes.

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind};
use isotherm_correction::units::Angle;
use isotherm_protocol::document::{AccelOutput, Document};

/// Nominal scale of a unit's raw readings.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Nominal {
    /// Angle per count (rad) of three gyros; `None` without a document that says it.
    per_count: Option<[f64; 3]>,
    /// The accelerometers' means are m/s².
    means_are_forces: bool,
    /// Coefficients of each temperature channel's conversion to °C.
    channels: Vec<(String, Vec<f64>)>,
}

impl Nominal {
    /// As a calibration document has it.
    #[must_use]
    pub fn of(document: &Document) -> Self {
        let weight = |sensor: usize| {
            let weight = document.gyro.sensor.get(sensor)?.increment_weight_arcsec_per_count?;
            Some(Angle::from_arcsec(weight).as_rad())
        };
        let three = document.gyro.sensor.len() == 3;
        let per_count = match (weight(0), weight(1), weight(2)) {
            (Some(x), Some(y), Some(z)) if three => Some([x, y, z]),
            _ => None,
        };
        let forces = |output| output == AccelOutput::MetresPerSecondSquared;
        Self {
            per_count,
            means_are_forces: document.accel.as_ref().is_some_and(|accel| forces(accel.output)),
            channels: document
                .temperature
                .channel
                .iter()
                .map(|channel| (channel.name.clone(), channel.conversion_deg_c.clone()))
                .collect(),
        }
    }

    /// Whether the readings of three gyros can be stated in rad/s: means as they stand, counts by a document.
    #[must_use]
    pub fn states(&self, output: OutputKind, sensors: usize) -> bool {
        sensors == 3 && (output == OutputKind::Mean || self.per_count.is_some())
    }

    /// Rates about the three input axes (rad/s).
    #[must_use]
    pub fn rate(&self, output: OutputKind, tick: &GyroTick) -> Option<[f64; 3]> {
        let readings = three(&tick.readings)?;
        match output {
            OutputKind::Mean => Some(readings),
            OutputKind::Counts => {
                let [x, y, z] = self.per_count?;
                let duration_s = tick.duration.as_s();
                let [px, py, pz] = readings;
                (duration_s > 0.0).then(|| [x * px, y * py, z * pz].map(|angle| angle / duration_s))
            }
        }
    }

    /// Specific forces along the three input axes (m/s²), where the document says that the readings are such.
    #[must_use]
    pub fn force(&self, output: OutputKind, tick: &AccelTick) -> Option<[f64; 3]> {
        (self.means_are_forces && output == OutputKind::Mean).then(|| three(&tick.readings)).flatten()
    }

    /// A raw reading of a channel as °C, where the document has the channel.
    #[must_use]
    pub fn temperature(&self, channel: &str, raw: f64) -> Option<f64> {
        let (_, coefficients) = self.channels.iter().find(|(name, _)| name == channel)?;
        Some(coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * raw + coefficient))
    }
}

/// Three readings, where there are three.
fn three(readings: &[f64]) -> Option<[f64; 3]> {
    readings.try_into().ok()
}
