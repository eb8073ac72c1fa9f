//! JSON schema of the curves: one form for each kind, unit and argument.

use isotherm_correction::curve::{MAX_COEFFICIENTS, MAX_KNOTS, MIN_KNOTS};
use isotherm_correction::thermal::Per;
use schemars::{Schema, SchemaGenerator};
use serde_json::{Map, Value as Json, json};

use super::super::measure::{Argument, BaseUnit, Unit};
use super::super::terms::{Accels, SensorKind};
use super::Keys;

/// Relative deviation from one.
pub(in super::super) fn relative(generator: &mut SchemaGenerator) -> Schema {
    reference(generator, &[Unit::PPM], Argument::DegC)
}

/// The same over the rate of a gyro.
pub(in super::super) fn relative_over_rate(generator: &mut SchemaGenerator) -> Schema {
    reference(generator, &[Unit::PPM], Argument::DegPerS)
}

/// Rest frequency of the dither.
pub(in super::super) fn frequency(generator: &mut SchemaGenerator) -> Schema {
    reference(generator, &[Unit::HZ], Argument::DegC)
}

/// Scale factor of an accelerometer.
pub(in super::super) fn scale_factor(generator: &mut SchemaGenerator) -> Schema {
    let units: Vec<_> = Accels::BIAS.iter().map(|bias: &BaseUnit| bias.per(Per::M_PER_S2)).collect();
    reference(generator, &units, Argument::DegC)
}

fn reference(generator: &mut SchemaGenerator, units: &[Unit], argument: Argument) -> Schema {
    definition(generator, units, &[argument]).try_into().unwrap_or_default()
}

/// Refers to the definition of a curve whose keys may name these units and arguments.
pub(in super::super) fn definition(
    generator: &mut SchemaGenerator,
    units: &[Unit],
    arguments: &[Argument],
) -> Json {
    let suffixes: Vec<_> = units.iter().map(|unit| unit.suffix()).collect();
    let over: Vec<_> = arguments.iter().map(|argument| argument.suffix()).collect();
    let name = format!("CurveOf_{}_over_{}", suffixes.join("_or_"), over.join("_or_"));
    let reference = json!({ "$ref": format!("#/definitions/{name}") });
    generator.definitions_mut().entry(name).or_insert_with(|| curve(units, arguments));
    reference
}

/// A curve in each of its forms.
fn curve(units: &[Unit], arguments: &[Argument]) -> Json {
    let mut forms = Vec::new();
    for &unit in units {
        let value = |keys: Keys| vec![(keys.value, number(&format!("The value ({}).", unit.symbol())))];
        forms.push(form("constant", "the same value everywhere", value(Keys::new(unit, Argument::DegC))));
        for &argument in arguments {
            let (symbol, over) = (unit.symbol(), argument.symbol());
            let keys = Keys::new(unit, argument);
            let pair = format!("Pairs [argument in {over}, value in {symbol}], arguments increasing.");
            let knots = pairs(&pair);
            let polynomial = vec![
                (keys.reference, number(&format!("Origin of the powers ({over})."))),
                (
                    keys.coefficients,
                    coefficients(&format!("Coefficients of power j = 0, 1, … ({symbol} per ({over})ʲ).")),
                ),
                (keys.range, range(&format!("Fitted range; the argument is clamped to it ({over})."))),
            ];
            forms.push(form("polynomial", "Σ cⱼ·(x − reference)ʲ", polynomial));
            forms.push(form(
                "piecewise-linear",
                "straight lines between knots",
                vec![(keys.knots.clone(), knots.clone())],
            ));
            forms.push(form("spline", "natural cubic spline through the knots", vec![(keys.knots, knots)]));
        }
    }
    let units: Vec<_> = units.iter().map(|unit| unit.symbol()).collect();
    let over: Vec<_> = arguments.iter().map(|argument| argument.symbol()).collect();
    json!({
        "title": format!("Curve of {} over {}", units.join(" or "), over.join(" or ")),
        "type": "object",
        "oneOf": forms,
    })
}

/// One form of a curve: its kind and the keys that go with it, all of them required.
fn form(kind: &str, meaning: &str, keys: Vec<(String, Json)>) -> Json {
    let required: Vec<_> = std::iter::once("kind").chain(keys.iter().map(|(key, _)| key.as_str())).collect();
    let required = json!(required);
    let mut properties = Map::new();
    properties.insert("kind".into(), json!({ "const": kind, "description": format!("{kind}: {meaning}.") }));
    properties.extend(keys);
    json!({ "type": "object", "title": kind, "properties": properties, "required": required, "additionalProperties": false })
}

fn number(description: &str) -> Json {
    json!({ "type": "number", "description": description })
}

fn coefficients(description: &str) -> Json {
    json!({
        "type": "array", "items": { "type": "number" }, "minItems": 1, "maxItems": MAX_COEFFICIENTS,
        "description": description,
    })
}

fn range(description: &str) -> Json {
    json!({
        "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2, "description": description,
        "x-rising": true,
    })
}

fn pairs(description: &str) -> Json {
    json!({
        "type": "array", "items": { "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 },
        "minItems": MIN_KNOTS, "maxItems": MAX_KNOTS, "description": description,
    })
}
