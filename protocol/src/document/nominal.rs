//! What is left of a document without its errors.

use isotherm_correction::thermal::Feature;

use super::Document;

impl Document {
    /// The nominal calibration of the unit: scale and axes at their reference, and nothing that knows of temperature, bias or mode.
    /// Accelerometers keep scale factor and bias as they are at the temperature that is assumed without a reading.
    #[must_use]
    pub fn nominal(&self) -> Self {
        let mut document = self.clone();
        document.mode_reversal = None;
        document.gyro.orientation.thermal = None;
        for sensor in &mut document.gyro.sensor {
            sensor.terms.retain(Feature::follows_motion);
            sensor.trend = None;
            sensor.servo = None;
        }
        let assumed = self.temperature.assumed_deg_c;
        if let Some(accel) = &mut document.accel {
            accel.orientation.thermal = None;
            for sensor in &mut accel.sensor {
                sensor.board_ratio_error = None;
                sensor.scale_factor = sensor.scale_factor.held_at(assumed);
                let bias = sensor.terms.curve(Feature::One).map(|bias| bias.held_at(assumed));
                sensor.terms.retain(Feature::follows_motion);
                sensor.set(Feature::One, bias);
            }
        }
        document
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{Curve, Shape};

    #[test]
    fn nominal_documents_hold_and_know_nothing_of_temperature() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration");
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|extension| extension != "toml") {
                continue;
            }
            let document = Document::parse(&std::fs::read_to_string(&path).unwrap(), None).unwrap().document;
            let nominal = document.nominal();
            let text = nominal.to_toml().unwrap();
            assert_eq!(Document::parse(&text, None).unwrap().document, nominal, "{}", path.display());
            let sensors = nominal.accel.iter().flat_map(|accel| &accel.sensor);
            for sensor in sensors {
                assert!(matches!(sensor.scale_factor.shape(), Shape::Constant { .. }), "{}", path.display());
            }
            assert_eq!(nominal.nominal(), nominal);
        }
    }

    #[test]
    fn a_held_curve_has_the_value_of_the_service() {
        let knots = vec![[-40.0, 1.0], [0.0, 3.0], [40.0, 2.0]];
        let curve = Curve::new(Shape::PiecewiseLinear { knots: knots.clone() });
        assert_eq!(curve.held_at(-20.0).shape(), &Shape::Constant { value: 2.0 });
        assert_eq!(curve.held_at(90.0).shape(), &Shape::Constant { value: 2.0 });
        let spline = Shape::Spline { knots };
        assert_eq!([-40.0, 0.0, 40.0].map(|x| spline.at(x)), [Some(1.0), Some(3.0), Some(2.0)]);
        assert_eq!(Shape::Spline { knots: vec![[0.0, 1.0]] }.at(0.0), None, "no curve");
    }
}
