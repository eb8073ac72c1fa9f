//! What was found, as a document.

use isotherm_correction::thermal::{ACCEL_TERMS, Feature};
use isotherm_correction::units::Angle;
use isotherm_protocol::document::{AccelSensor, Curve, Document, OrientationThermal, Shape, Unit};

use super::fit::Analysis;
use super::model::Sensor;
use crate::document::{accel_name, accelerometers, scale_at, tidy, turned};
use crate::numbers::{ends, hull, mean, unit};

/// Room around the temperatures that were taken (°C), for the stand's chamber does not meet them to the degree.
const ROOM_DEG_C: f64 = 1.0;

/// Puts what was found into a document.
pub fn complete(base: &Document, analysis: &Analysis, gravity: f64) -> Document {
    let mut document = base.clone();
    let Some(accel) = &mut document.accel else { return document };
    let scale_unit = accel.output.scale_unit();
    let found = analysis.fit.sensors.iter().zip(&analysis.sensors_deg_c);
    let signs = signs(base, analysis);
    for ((sensor, sign), (found, deg_c)) in accel.sensor.iter_mut().zip(&signs).zip(found) {
        let range = with_room(ends(deg_c.iter().copied()));
        let scale: Vec<f64> = found.scale.iter().map(|k| sign * k / gravity).collect();
        if analysis.levels_deg_c.len() > 1 {
            sensor.scale_factor = curve(analysis, &scale, range).in_unit(scale_unit);
            sensor.set(Feature::One, curve(analysis, &found.bias, range));
        } else {
            level(sensor, scale[0], found.bias[0], mean(deg_c), scale_unit);
        }
    }
    orient(accel, analysis, &signs);
    document
}

/// What readings at rest have besides K·f + S by the document at hand, and would be held by S once more: the reasons not to fit.
pub(crate) fn held_twice(document: &Document) -> Vec<String> {
    let kept = [Feature::Play, Feature::Regressor, Feature::ForceSquared];
    let of = |(index, sensor): (usize, &AccelSensor)| {
        let terms =
            ACCEL_TERMS.iter().filter(|term| kept.contains(&term.feature) && sensor.terms.has(term.feature));
        let keys: Vec<&str> = terms.map(|term| term.key).collect();
        (!keys.is_empty()).then(|| {
            format!(
                "accelerometer {}: the document has {}, whose part bias and scale factor would hold once more: take it out of the \
                 document, fit, and fit it again afterwards",
                accel_name(document, index),
                keys.join(", ")
            )
        })
    };
    accelerometers(document).iter().enumerate().filter_map(of).collect()
}

/// Signs of the scale factors that a document states: what was found has them positive, and along the opposite axis is the same.
fn signs(document: &Document, analysis: &Analysis) -> Vec<f64> {
    let stated = accelerometers(document).iter().zip(&analysis.sensors_deg_c);
    stated.map(|(sensor, deg_c)| scale_at(sensor, mean(deg_c)).signum()).collect()
}

/// Range of the document (°C): of all curves, and of the axes.
pub fn range(analysis: &Analysis) -> [f64; 2] {
    let own = analysis.sensors_deg_c.iter().map(|deg_c| ends(deg_c.iter().copied()));
    with_room(hull(own.chain([analysis.range_deg_c])).unwrap_or(analysis.range_deg_c))
}

/// Range of a curve (°C), in whole degrees.
pub(crate) fn with_room([low, high]: [f64; 2]) -> [f64; 2] {
    [(low - ROOM_DEG_C).floor(), (high + ROOM_DEG_C).ceil()]
}

/// A polynomial over temperature from coefficients over scaled temperature.
fn curve(analysis: &Analysis, scaled: &[f64], range: [f64; 2]) -> Curve {
    let mut factor = 1.0;
    let coefficients = scaled.iter().map(|c| {
        let coefficient = tidy(c * factor);
        factor /= analysis.half_deg_c;
        coefficient
    });
    Curve::new(Shape::Polynomial {
        reference: analysis.reference_deg_c,
        coefficients: coefficients.collect(),
        range,
    })
}

/// Moves an accelerometer's curves to what one temperature says, keeping their shape.
pub(crate) fn level(sensor: &mut AccelSensor, scale: f64, bias: f64, deg_c: f64, scale_unit: Unit) {
    let constant = |value: f64| Shape::Constant { value: tidy(value) };
    let shape = sensor.scale_factor.shape();
    let shape = match shape.at(deg_c) {
        Some(old) if old != 0.0 => times(shape, scale / old),
        _ => constant(scale),
    };
    sensor.scale_factor = Curve::new(shape).in_unit(scale_unit);
    let old = sensor.terms.curve(Feature::One);
    let moved = old.and_then(|curve| Some(curve.plus(bias - curve.shape().at(deg_c)?)));
    let shape = moved.map_or_else(|| constant(bias), |curve| times(curve.shape(), 1.0));
    sensor.set(Feature::One, Curve::new(shape));
}

/// A shape with all values multiplied.
fn times(shape: &Shape, factor: f64) -> Shape {
    let knots = |knots: &[[f64; 2]]| knots.iter().map(|[x, value]| [*x, tidy(value * factor)]).collect();
    match shape {
        Shape::Constant { value } => Shape::Constant { value: tidy(value * factor) },
        Shape::Polynomial { reference, coefficients, range } => Shape::Polynomial {
            reference: *reference,
            coefficients: coefficients.iter().map(|c| tidy(c * factor)).collect(),
            range: *range,
        },
        Shape::PiecewiseLinear { knots: of } => Shape::PiecewiseLinear { knots: knots(of) },
        Shape::Spline { knots: of } => Shape::Spline { knots: knots(of) },
    }
}

/// Puts C into the document: rows at the reference, and slopes where there are several temperatures. With one, the slopes of the
/// old document stay, and the rows at their reference follow.
fn orient(accel: &mut isotherm_protocol::document::Accel, analysis: &Analysis, signs: &[f64]) {
    let orientation = &mut accel.orientation;
    let sensors = || analysis.fit.sensors.iter().zip(signs);
    let axis = |(sensor, sign): (&Sensor, &f64), power: usize| {
        sensor.axis.get(power).copied().unwrap_or_default().map(|c| sign * c)
    };
    if analysis.levels_deg_c.len() > 1 {
        orientation.rows = sensors().map(|of| axis(of, 0).map(tidy)).collect();
        let slope = |of| axis(of, 1).map(|c| tidy(Angle::from_rad(c / analysis.half_deg_c).as_arcsec()));
        let stated = orientation.thermal.take();
        orientation.thermal = Some(OrientationThermal {
            channels: analysis.channels.clone(),
            reference_deg_c: analysis.reference_deg_c,
            range_deg_c: with_room(analysis.range_deg_c),
            slopes_arcsec_per_deg_c: sensors().map(slope).collect(),
            hysteresis: stated.map(|thermal| thermal.hysteresis).unwrap_or_default(),
        });
        return;
    }
    let at_reference = |(index, of)| {
        let found = axis(of, 0);
        let turned = turned(orientation.thermal.as_ref(), index, analysis.slopes_deg_c);
        let row = [0, 1, 2].map(|i| found[i] - turned[i]);
        unit(row).map(tidy)
    };
    orientation.rows = sensors().enumerate().map(at_reference).collect();
}
