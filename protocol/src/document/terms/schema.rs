//! JSON schema of a sensor's terms, one property for each declaration.

use std::borrow::Cow;

use isotherm_correction::thermal::{Term, TermForm};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value as Json, json};

use super::super::curve::definition;
use super::{Regressor, SensorKind, Terms, arguments, unit};

impl<K: SensorKind> JsonSchema for Terms<K> {
    fn schema_name() -> Cow<'static, str> {
        "Terms".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut properties = Map::new();
        for term in K::TERMS {
            let property = described(term.meaning, property::<K>(generator, term));
            match (term.form, term.key.split_once('.')) {
                (TermForm::PartOf(meaning), Some((table, part))) => {
                    let empty = || {
                        described(
                            meaning,
                            json!({ "type": "object", "properties": {}, "additionalProperties": false }),
                        )
                    };
                    let parts = properties.entry(table).or_insert_with(empty).pointer_mut("/properties");
                    parts.and_then(Json::as_object_mut).map(|parts| parts.insert(part.into(), property));
                }
                _ => drop(properties.insert(term.key.into(), property)),
            }
        }
        json_schema!({ "type": "object", "properties": properties })
    }
}

/// What a term is stated as.
fn property<K: SensorKind>(generator: &mut SchemaGenerator, term: &Term) -> Json {
    let mut units: Vec<_> = K::BIAS.iter().map(|bias| unit(term, *bias)).collect();
    units.dedup();
    let curve = definition(generator, &units, &arguments(term));
    let list = |most: usize, items: Json| json!({ "type": "array", "items": items, "maxItems": most });
    match term.form {
        TermForm::Curve | TermForm::PartOf(_) => curve,
        TermForm::Branches => {
            let branches = [
                ("run_up", "\"+\" curve: Ṫ·T̈ > 0. Source: 000."),
                ("braking", "\"−\" curve, over the same argument: Ṫ·T̈ < 0. Source: 000."),
            ];
            let properties = branches.map(|(key, meaning)| (key.into(), described(meaning, curve.clone())));
            table(properties, &["run_up", "braking"])
        }
        TermForm::Each(parameter) => {
            let [least, most] = parameter.range;
            let number = json!({ "type": "number", "minimum": least, "maximum": most });
            let properties = [
                (parameter.key.into(), described(parameter.meaning, number)),
                ("gain".into(), described("g(T).", curve)),
            ];
            list(parameter.most, table(properties, &[parameter.key, "gain"]))
        }
        TermForm::Regressors(most) => {
            let mut regressor = Regressor::json_schema(generator);
            if let Some(Json::Object(properties)) = regressor.get_mut("properties") {
                properties.insert("gain".into(), described("g(T).", curve));
            }
            if let Some(Json::Array(required)) = regressor.get_mut("required") {
                required.push("gain".into());
            }
            list(most, regressor.to_value())
        }
    }
}

fn table<const N: usize>(properties: [(String, Json); N], required: &[&str]) -> Json {
    let properties = Map::from_iter(properties);
    json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": false })
}

fn described(meaning: &str, mut schema: Json) -> Json {
    if let Some(schema) = schema.as_object_mut() {
        schema.insert("description".into(), meaning.into());
    }
    schema
}
