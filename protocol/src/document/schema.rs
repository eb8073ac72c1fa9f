//! The document's JSON schema, made from its types, for editors.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value as Json;

use super::types::Document;

/// JSON schema (draft 07) of the document, as published in `config/calibration.schema.json`.
#[must_use]
pub fn schema() -> Json {
    of::<Document>()
}

/// The schema of a type, without what TOML and editors do not know.
pub(crate) fn of<T: JsonSchema>() -> Json {
    let mut schema = SchemaSettings::draft07().into_generator().into_root_schema_for::<T>().to_value();
    tidy(&mut schema);
    schema
}

/// Takes out what TOML does not have (null) and what editors do not know (formats of numbers).
fn tidy(schema: &mut Json) {
    match schema {
        Json::Array(items) => items.iter_mut().for_each(tidy),
        Json::Object(object) => {
            object.values_mut().for_each(tidy);
            if let Some(Json::Array(types)) = object.get_mut("type") {
                types.retain(|name| name != "null");
                if let [only] = types.as_slice() {
                    let only = only.clone();
                    object.insert("type".into(), only);
                }
            }
            if let Some(Json::Array(any)) = object.get_mut("anyOf") {
                any.retain(|form| form.get("type").is_none_or(|name| name != "null"));
                if any.len() == 1
                    && let Some(only) = object.remove("anyOf")
                {
                    object.insert("allOf".into(), only);
                }
            }
            if let Some(Json::Array(values)) = object.get_mut("enum") {
                values.retain(|value| !value.is_null());
            }
            if object.get("default").is_some_and(Json::is_null) {
                object.remove("default");
            }
            if object.get("format").and_then(Json::as_str).is_some_and(|name| !name.starts_with("date")) {
                object.remove("format");
            }
        }
        _ => {}
    }
}
