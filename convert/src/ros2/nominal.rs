//! Raw readings in SI units at nominal scale: what an Imu message of an uncorrected unit can say.
//!
//! Nothing is corrected here: no temperature, bias, mode or misalignment enters. x, y and z are the input axes of the
//! first, second and third sensor, not the case axes.

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind};
use isotherm_correction::units::{Angle, Span};
use isotherm_log::plot::nominal_forces;
use isotherm_protocol::document::{AccelOutput, Document};

/// Nominal scale of a unit's raw readings.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Nominal {
    /// Angle per count (rad) of three gyros; `None` without a document that says it.
    per_count: Option<[f64; 3]>,
    /// Specific force per unit of the reading (m/s²) of three accelerometers; `None` without a document that says it.
    per_reading: Option<[f64; 3]>,
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
        let are_three = document.gyro.sensor.len() == 3;
        let per_count = match (weight(0), weight(1), weight(2)) {
            (Some(x), Some(y), Some(z)) if are_three => Some([x, y, z]),
            _ => None,
        };
        let per_reading = document.accel.as_ref().and_then(|accel| match accel.output {
            AccelOutput::MetresPerSecondSquared => Some([1.0; 3]),
            AccelOutput::Counts | AccelOutput::Volts => three(&nominal_forces(document)),
        });
        Self {
            per_count,
            per_reading,
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
            OutputKind::Counts => per_second(scaled(readings, self.per_count?), tick.duration),
        }
    }

    /// Specific forces along the three input axes (m/s²), where a document says what the readings are.
    #[must_use]
    pub(crate) fn force(&self, output: OutputKind, tick: &AccelTick) -> Option<[f64; 3]> {
        let forces = scaled(three(&tick.readings)?, self.per_reading?);
        if output == OutputKind::Mean { Some(forces) } else { per_second(forces, tick.duration) }
    }

    /// A raw reading of a channel as °C, where the document has the channel.
    #[must_use]
    pub(crate) fn temperature(&self, channel: &str, raw: f64) -> Option<f64> {
        let (_, coefficients) = self.channels.iter().find(|(name, _)| name == channel)?;
        Some(coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * raw + coefficient))
    }
}

/// Each reading by its scale.
fn scaled([x, y, z]: [f64; 3], [by_x, by_y, by_z]: [f64; 3]) -> [f64; 3] {
    [x * by_x, y * by_y, z * by_z]
}

/// What was counted in a tick, by its duration.
fn per_second(counted: [f64; 3], duration: Span) -> Option<[f64; 3]> {
    let duration_s = duration.as_s();
    (duration_s > 0.0).then(|| counted.map(|counted| counted / duration_s))
}

/// Three readings, where there are three.
fn three(readings: &[f64]) -> Option<[f64; 3]> {
    readings.try_into().ok()
}

#[cfg(test)]
mod tests {
    use isotherm_correction::units::Timestamp;

    use super::*;

    #[test]
    fn raw_readings_are_stated_only_where_their_unit_is_known() {
        let text = std::fs::read_to_string(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../config/calibration/ZLG-0001.toml"
        ));
        let laser_document = Document::parse(&text.unwrap(), None).unwrap().document;
        let laser = Nominal::of(&laser_document);
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
        let accel = |reading: f64| AccelTick {
            readings: [reading, 0.0, -reading].into_iter().collect(),
            duration: Span::from_ms(10),
            ..AccelTick::default()
        };
        assert_eq!(unknown.force(OutputKind::Mean, &accel(1.0)), None, "volts or m/s²?");
        let [per_count_per_s, ..] = three(&nominal_forces(&laser_document)).unwrap();
        let force = laser.force(OutputKind::Counts, &accel(0.01 / per_count_per_s)).unwrap();
        assert!((force[0] - 1.0).abs() < 1e-12 && force[1] == 0.0 && force[2] < 0.0, "{force:?}");
    }
}
