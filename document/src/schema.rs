//! The schema of a type: what its texts are read by, and what editors get.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value as Json;

/// The form of a text: the schema that it is read by, and its versions.
#[derive(Debug)]
pub struct Form {
    pub(crate) schema: Json,
    pub(crate) versions: Option<(&'static str, [u32; 2])>,
}

impl Form {
    /// The form of a type's texts.
    #[must_use]
    pub fn of<T: JsonSchema>() -> Self {
        let mut schema = SchemaSettings::draft07().into_generator().into_root_schema_for::<T>().to_value();
        without_null(&mut schema);
        Self { schema, versions: None }
    }

    /// The same for a text that states its version: the first and last that are read. Of another version nothing else is read.
    #[must_use]
    pub fn versions(self, key: &'static str, versions: [u32; 2]) -> Self {
        Self { versions: Some((key, versions)), ..self }
    }
}

/// The JSON schema (draft 07) of a type as editors understand it.
#[must_use]
pub fn published<T: JsonSchema>() -> Json {
    let mut schema = Form::of::<T>().schema;
    for_editors(&mut schema);
    schema
}

/// Takes out what TOML does not have: null.
fn without_null(schema: &mut Json) {
    match schema {
        Json::Array(items) => items.iter_mut().for_each(without_null),
        Json::Object(object) => {
            object.values_mut().for_each(without_null);
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
        }
        _ => {}
    }
}

/// Takes out what only the reader here understands, and formats of numbers.
fn for_editors(schema: &mut Json) {
    match schema {
        Json::Array(items) => items.iter_mut().for_each(for_editors),
        Json::Object(object) => {
            object.values_mut().for_each(for_editors);
            object.retain(|key, _| !key.starts_with("x-"));
            if object.get("format").and_then(Json::as_str).is_some_and(|name| !name.starts_with("date")) {
                object.remove("format");
            }
        }
        _ => {}
    }
}
