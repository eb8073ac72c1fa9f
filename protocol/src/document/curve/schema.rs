//! JSON schema of the curves: one form for each kind, unit and argument.

use std::borrow::Cow;

use isotherm_correction::curve::{MAX_COEFFICIENTS, MAX_KNOTS, MIN_KNOTS};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value as Json, json};

use super::super::measure::Argument;
use super::{Curve, Keys, Quantity};

impl<Q: Quantity> JsonSchema for Curve<Q> {
    fn schema_name() -> Cow<'static, str> {
        Q::NAME.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let mut forms = Vec::new();
        for &unit in Q::UNITS {
            let value = |keys: Keys| vec![(keys.value, number(&format!("The value ({}).", unit.symbol())))];
            forms.push(form("constant", "the same value everywhere", value(Keys::new(unit, Argument::DegC))));
            for &argument in Q::ARGUMENTS {
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
                forms.push(form(
                    "spline",
                    "natural cubic spline through the knots",
                    vec![(keys.knots, knots)],
                ));
            }
        }
        let units: Vec<_> = Q::UNITS.iter().map(|unit| unit.symbol()).collect();
        let over: Vec<_> = Q::ARGUMENTS.iter().map(|argument| argument.symbol()).collect();
        json_schema!({
            "title": format!("Curve of {} over {}", units.join(" or "), over.join(" or ")),
            "type": "object",
            "oneOf": forms,
        })
    }
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
