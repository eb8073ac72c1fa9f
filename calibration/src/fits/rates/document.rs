//! Scale and axes on their way into a document.

use isotherm_correction::thermal::Feature;
use isotherm_correction::units::Angle;
use isotherm_protocol::document::{Curve, Document, Shape};
use toml::{Table, Value};

use super::fit::Made;
use super::model::GyroRates;
use super::over_temperature::Level;
use crate::document::{matrix, numbers, tidy};
use crate::finding::Kind;
use crate::numbers::unit;
use crate::report::Sigmas;

/// The document with new weights and, where the steps span space, new input axes. What is fitted at `deg_c` of the axes'
/// temperature is brought to their reference.
pub fn fitted(
    base: &Document,
    gyros: &[Result<GyroRates, Kind>],
    deg_c: Option<f64>,
    with_bias: bool,
) -> Document {
    let mut document = base.clone();
    let thermal = document.gyro.orientation.thermal.clone();
    for (sensor, found) in gyros.iter().enumerate() {
        let Ok(found) = found else { continue };
        let gain = found.gain[0];
        if let Some(own) = document.gyro.sensor.get_mut(sensor) {
            let weights = [&mut own.increment_weight_arcsec_per_count, &mut own.increment_weight_rad_per_rad];
            weights.into_iter().flatten().for_each(|weight| *weight = tidy(*weight / gain));
            if with_bias {
                let change = found.bias[0];
                let bias = own.terms.curve(Feature::One).map(|bias| bias.plus(change));
                let new = || Curve::new(Shape::Constant { value: tidy(change) });
                own.set(Feature::One, bias.unwrap_or_else(new));
            }
        }
        if let (Some(axis), Some(row)) = (found.axis, document.gyro.orientation.rows.get_mut(sensor)) {
            let slopes = thermal.as_ref().and_then(|thermal| {
                let away = deg_c? - thermal.reference_deg_c;
                Some(
                    thermal
                        .slopes_arcsec_per_deg_c
                        .get(sensor)?
                        .map(|slope| Angle::from_arcsec(slope).as_rad() * away),
                )
            });
            let slopes = slopes.unwrap_or_default();
            let at_reference = [0, 1, 2].map(|element| axis[element] - slopes[element]);
            *row = unit(at_reference).map(tidy);
        }
    }
    document
}

/// Standard errors of weights and axes.
pub fn sigmas(made: &Made) -> Sigmas {
    let mut sigmas = Sigmas::default();
    for (sensor, found) in made.written.document.gyro.sensor.iter().zip(&made.gyros) {
        let Ok(found) = found else { continue };
        let ppm = tidy(1e6 * found.gain[1] / found.gain[0].abs());
        sigmas.put("gyro", &sensor.name, "increment_weight_ppm", vec![ppm]);
        if found.axis.is_some() {
            let arcsec = found.axis_sigma.map(|sigma| tidy(Angle::from_rad(sigma).as_arcsec()));
            sigmas.put("gyro", &sensor.name, "axis_arcsec", arcsec.to_vec());
        }
    }
    sigmas
}

/// What goes into `origin.details`: standard errors, and what a document has no place for.
pub fn details(made: &Made) -> Table {
    let mut table = Table::new();
    if let Some(deg_c) = made.temperature_deg_c() {
        table.insert("temperature_deg_c".into(), tidy(deg_c).into());
    }
    let rates = made.steps.iter().map(|step| step.matched.step.rate_deg_per_s.into());
    table.insert("rate_deg_per_s".into(), Value::Array(rates.collect()));
    let gyros = made.gyros.iter().zip(&made.written.document.gyro.sensor).zip(&made.walk);
    let gyros = gyros.map(|((found, sensor), walk)| Value::Table(of_gyro(&sensor.name, found, *walk)));
    table.insert("gyro".into(), Value::Array(gyros.collect()));
    if let Some(over) = &made.over_temperature {
        table.insert("over_temperature".into(), Value::Array(over.levels.iter().map(of_level).collect()));
    }
    table
}

/// The axes at one temperature, with their standard errors.
fn of_level(level: &Level) -> Value {
    let rows = |of: &dyn Fn(&GyroRates) -> [f64; 3]| {
        Value::Array(level.gyros.iter().map(|found| numbers(&of(found))).collect())
    };
    let mut table = Table::new();
    table.insert("temperature_deg_c".into(), tidy(level.deg_c).into());
    table.insert("axis".into(), rows(&|found| found.axis.unwrap_or_default()));
    let arcsec = |found: &GyroRates| found.axis_sigma.map(|sigma| Angle::from_rad(sigma).as_arcsec());
    table.insert("sigma_arcsec".into(), rows(&arcsec));
    Value::Table(table)
}

fn of_gyro(name: &str, found: &Result<GyroRates, Kind>, walk: f64) -> Table {
    let mut table = Table::new();
    table.insert("name".into(), name.into());
    match found {
        Err(reason) => {
            table.insert("refused".into(), reason.to_string().into());
        }
        Ok(found) => {
            table.insert(
                "scale_factor_sigma_ppm".into(),
                tidy(1e6 * found.gain[1] / found.gain[0].abs()).into(),
            );
            if let Some([value, sigma]) = found.asymmetry {
                table.insert("asymmetry_ppm".into(), tidy(1e6 * value).into());
                table.insert("asymmetry_sigma_ppm".into(), tidy(1e6 * sigma).into());
            }
            table.insert("bias_deg_per_h".into(), tidy(found.bias[0]).into());
            table.insert("bias_sigma_deg_per_h".into(), tidy(found.bias[1]).into());
            if found.axis.is_some() {
                let sigmas = found.axis_sigma.map(|sigma| Angle::from_rad(sigma).as_arcsec());
                table.insert("axis_sigma_arcsec".into(), numbers(&sigmas));
            }
            table.insert("nonlinearity_deg_per_h".into(), numbers(&found.left));
            if found.chi_square.is_finite() {
                table.insert("chi_square_per_freedom".into(), tidy(found.chi_square).into());
            }
            table.insert("angle_random_walk_deg_per_sqrt_h".into(), tidy(walk).into());
            table.insert("covariance".into(), matrix(&found.covariance));
        }
    }
    table
}
