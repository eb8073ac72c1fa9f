//! Raw readings by nominal scale factors alone, where a calibration is known.

use isotherm_correction::curve::Curve;
use isotherm_correction::sample::OutputKind;
use isotherm_protocol::document::Document;

use super::AXES;
use super::unit::RawTrack;

/// Radians per second in degrees per hour.
pub(super) const DEG_PER_H: f64 = ARCSEC;
/// Radians in seconds of arc.
pub(super) const ARCSEC: f64 = 180.0 / std::f64::consts::PI * 3600.0;
/// A sensor whose input axis has this much of a case axis is said to be along it.
const ALONG: f64 = 0.9;

/// By what the raw values of a kind of sensor are multiplied, and along which axis each one is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    /// What the raw values stand for.
    pub(super) kind: OutputKind,
    /// Factor of each sensor, with the sign that turns it into the direction of the case axis.
    pub(super) factors: Vec<f64>,
    /// Case axis of each sensor where there are three, each along another one; else empty.
    pub(super) axes: Vec<usize>,
}

/// Nominal scale of a unit's sensors.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Nominal {
    pub(super) gyro: Scale,
    pub(super) accel: Option<Scale>,
}

impl Nominal {
    pub(super) fn of(document: &Document) -> Self {
        let parts = document.to_parts();
        let gyro = Scale::new(
            parts.gyro_output,
            parts.gyros.iter().map(|gyro| gyro.increment_weight * DEG_PER_H).collect(),
            &parts.gyro_orientation.rows,
        );
        let accel = parts.accel_orientation.as_ref();
        let accel = accel
            .map(|orientation| Scale::new(parts.accel_output, nominal_forces(document), &orientation.rows));
        Self { gyro, accel }
    }
}

/// Specific force (m/s²) that each accelerometer of a document reads 1 at, as a mean or as counts per second, by its scale factor at the
/// assumed temperature.
#[must_use]
pub fn nominal_forces(document: &Document) -> Vec<f64> {
    let parts = document.to_parts();
    let factor = |curve: Curve| 1.0 / curve.at(parts.filter.assumed_deg_c).value;
    let curves = parts.accels.iter().map(|accel| Curve::new(&accel.scale_factor).ok());
    curves.map(|curve| curve.map_or(f64::NAN, factor)).collect()
}

impl Scale {
    /// Whether these raw values are those of its sensors.
    pub(super) fn is_of(&self, raw: &RawTrack) -> bool {
        (self.kind, self.factors.len()) == (raw.kind, raw.sensors)
    }

    /// That of means which are what they say: rates in °/h by [`DEG_PER_H`], forces by 1.
    pub(super) fn of_means(sensors: usize, factor: f64) -> Self {
        let axes = if sensors == AXES.len() { vec![0, 1, 2] } else { Vec::new() };
        Self { kind: OutputKind::Mean, factors: vec![factor; sensors], axes }
    }

    fn new(kind: OutputKind, mut factors: Vec<f64>, rows: &[[f64; 3]]) -> Self {
        let along: Vec<_> = rows
            .iter()
            .filter_map(|row| row.iter().position(|part| part.abs() >= ALONG).map(|axis| (axis, row)))
            .collect();
        let mut axes: Vec<_> = along.iter().map(|(axis, _)| *axis).collect();
        axes.sort_unstable();
        if rows.len() != AXES.len() || axes != [0, 1, 2] {
            return Self { kind, factors, axes: Vec::new() };
        }
        for (factor, (axis, row)) in factors.iter_mut().zip(&along) {
            *factor *= row.get(*axis).map_or(1.0, |part| part.signum());
        }
        Self { kind, factors, axes: along.into_iter().map(|(axis, _)| axis).collect() }
    }
}

/// The unit of raw readings of which no scale is known.
pub(super) fn unscaled(kind: OutputKind) -> &'static str {
    match kind {
        OutputKind::Counts => "counts/s",
        OutputKind::Mean => "as sent",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_along_the_case_axes_are_known_as_such() {
        let rows = [[0.0, -0.999, 0.01], [1.0, 0.0, 0.0], [0.0, 0.02, 1.0]];
        let kind = OutputKind::Counts;
        let scale = Scale::new(kind, vec![2.0, 3.0, 4.0], &rows);
        assert_eq!(scale, Scale { kind, factors: vec![-2.0, 3.0, 4.0], axes: vec![1, 0, 2] });
        let skewed = [[0.8, 0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.6, 0.8]];
        assert_eq!(Scale::new(kind, vec![1.0; 3], &skewed).axes, Vec::<usize>::new());
        assert_eq!(Scale::new(kind, vec![1.0; 4], &[[1.0, 0.0, 0.0]; 4]).axes, Vec::<usize>::new());
    }

    #[test]
    fn a_document_gives_degrees_per_hour() {
        let text = include_str!("../../../config/calibration/MEMS-0001.toml");
        let nominal = Nominal::of(&Document::parse(text, None).unwrap().document);
        assert!(nominal.gyro.factors.iter().all(|factor| factor.is_finite() && *factor != 0.0));
    }
}
