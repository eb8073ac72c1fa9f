//! Raw readings in SI units at nominal scale: what an Imu message of an uncorrected unit can say.
//!
//! Nothing is corrected here: no temperature, bias, mode or misalignment enters. x, y and z are the input axes of the
//! first, second and third sensor, not the case axes.

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind};
use isotherm_correction::units::Angle;
use isotherm_protocol::document::{AccelOutput, Document};

/// Nominal scale of a unit's raw readings.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Nominal {
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
    pub(crate) fn of(document: &Document) -> Self {
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
    pub(crate) fn states(&self, output: OutputKind, sensors: usize) -> bool {
        sensors == 3 && (output == OutputKind::Mean || self.per_count.is_some())
    }

    /// Rates about the three input axes (rad/s).
    #[must_use]
    pub(crate) fn rate(&self, output: OutputKind, tick: &GyroTick) -> Option<[f64; 3]> {
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
    pub(crate) fn force(&self, output: OutputKind, tick: &AccelTick) -> Option<[f64; 3]> {
        (self.means_are_forces && output == OutputKind::Mean).then(|| three(&tick.readings)).flatten()
    }

    /// A raw reading of a channel as °C, where the document has the channel.
    #[must_use]
    pub(crate) fn temperature(&self, channel: &str, raw: f64) -> Option<f64> {
        let (_, coefficients) = self.channels.iter().find(|(name, _)| name == channel)?;
        Some(coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * raw + coefficient))
    }
}

/// Three readings, where there are three.
fn three(readings: &[f64]) -> Option<[f64; 3]> {
    readings.try_into().ok()
}

#[cfg(test)]
mod tests {
    use isotherm_correction::units::{Span, Timestamp};

    use super::*;

    #[test]
    fn raw_readings_are_stated_only_where_their_unit_is_known() {
        let text = std::fs::read_to_string(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../config/calibration/ZLG-0001.toml"
        ));
        let laser = Nominal::of(&Document::parse(&text.unwrap(), None).unwrap().document);
        let unknown = Nominal::default();
        let tick = |readings: &[f64]| GyroTick {
            readings: readings.iter().copied().collect(),
            duration: Span::from_ms(10),
            end_time: Timestamp::from_ns(0),
            ..GyroTick::default()
        };
        assert_eq!(unknown.rate(OutputKind::Mean, &tick(&[1.0, 2.0, 3.0])), Some([1.0, 2.0, 3.0]));
        assert_eq!(unknown.rate(OutputKind::Mean, &tick(&[1.0, 2.0, 3.0, 4.0])), None);
        assert_eq!(unknown.rate(OutputKind::Counts, &tick(&[1.0, 2.0, 3.0])), None);
        assert!(!unknown.states(OutputKind::Counts, 3) && laser.states(OutputKind::Counts, 3));
        let rate = laser.rate(OutputKind::Counts, &tick(&[1000.0, -1000.0, 0.0])).unwrap();
        // A count of a laser gyro is around one second of arc: 1000 of them in 10 ms are some 0.5 rad/s.
        assert!(
            (0.05..5.0).contains(&rate[0].abs()) && rate[0] * rate[1] < 0.0 && rate[2] == 0.0,
            "{rate:?}"
        );
        let accel = AccelTick { readings: [1.0, 2.0, 3.0].into_iter().collect(), ..AccelTick::default() };
        assert_eq!(unknown.force(OutputKind::Mean, &accel), None, "volts or m/s²?");
    }
}
