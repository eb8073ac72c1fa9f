//! Harmless values in the place of wrong and missing ones.

use serde_json::Value as Json;
use toml::value::{Date, Datetime};
use toml::{Table, Value};

use crate::kind::{Kind, Schema, counts, properties, texts};
use crate::number::{Limits, whole_limits};

/// A value that a schema allows.
pub(crate) fn stand_in(schema: Schema<'_>, node: &Json) -> Value {
    let node = schema.resolve(node);
    match Kind::of(node) {
        Kind::Table => {
            let entry = |key: &str| Some((key.to_owned(), stand_in(schema, properties(node)?.get(key)?)));
            Value::Table(texts(node.get("required")).filter_map(entry).collect())
        }
        Kind::Forms(forms) => forms.first().map_or(Value::Table(Table::new()), |form| stand_in(schema, form)),
        Kind::Either(forms) => forms.first().map_or(Value::Boolean(false), |form| stand_in(schema, form)),
        Kind::Array => Value::Array(fill(schema, node, Vec::new())),
        Kind::Number => Value::Float(Limits::of(node).stand_in()),
        Kind::Whole => Value::Integer(whole_limits(node).0.max(0)),
        Kind::Choice(names) => Value::String(names.first().copied().unwrap_or_default().to_owned()),
        Kind::Only(value) => Value::String(value.to_owned()),
        Kind::Text => Value::String(String::new()),
        Kind::Boolean => Value::Boolean(false),
        Kind::Date => Value::Datetime(Datetime {
            date: Some(Date { year: 1970, month: 1, day: 1 }),
            time: None,
            offset: None,
        }),
        Kind::Free => Value::Table(Table::new()),
    }
}

/// A list of fixed length, cut or filled up.
pub(crate) fn fill(schema: Schema<'_>, node: &Json, mut items: Vec<Value>) -> Vec<Value> {
    if let [Some(low), Some(high)] = counts(node)
        && low == high
    {
        let item = node.get("items").map_or(Value::Boolean(false), |item| stand_in(schema, item));
        items.resize(low, item);
    }
    items
}
