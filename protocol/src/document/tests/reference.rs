//! The lists of keys in `docs/calibration-document.md`, made from the schema.

use std::fmt::Write as _;

use serde_json::{Map, Value as Json};

use super::super::schema;
use super::units::unit_of_key;
use crate::overlay::overlay_schema;

/// Start of the names of curve definitions.
const CURVE: &str = "CurveOf";

/// The page's generated regions, by name.
pub(super) fn regions() -> [(&'static str, String); 3] {
    let (document, overlay) = (schema(), overlay_schema());
    [
        ("keys", tables_of_keys(&document, "Top level")),
        ("units of curves", units_of_curves(&document)),
        ("overlay keys", tables_of_keys(&overlay, "Top level of an overlay")),
    ]
}

/// The tables of keys of a schema; tables with the same keys are written once, under all their names.
fn tables_of_keys(schema: &Json, top: &str) -> String {
    let mut tables = Vec::new();
    Reader { schema }.tables(top.to_owned(), "", schema, &mut tables);
    let mut text = String::new();
    while let Some((_, body)) = tables.first().cloned() {
        let (same, others): (Vec<_>, Vec<_>) = tables.into_iter().partition(|(_, other)| *other == body);
        let names: Vec<_> = same.into_iter().map(|(name, _)| name).collect();
        let _ = write!(text, "\n### {}\n\n{body}", names.join(", "));
        tables = others;
    }
    text
}

/// The units of the values of curves, as keys spell them.
fn units_of_curves(schema: &Json) -> String {
    let mut units = Vec::new();
    for (key, _) in curve_forms(schema).into_iter().flat_map(keys_of) {
        if let Some(unit) = key.strip_prefix("value_").map(|unit| format!("`{unit}`"))
            && !units.contains(&unit)
        {
            units.push(unit);
        }
    }
    format!("\n{}\n", units.join(", "))
}

/// Every form of every curve.
pub(super) fn curve_forms(schema: &Json) -> Vec<&Json> {
    let definitions = schema.get("definitions").and_then(Json::as_object).into_iter().flatten();
    let curves = definitions.filter(|(name, _)| name.starts_with(CURVE));
    curves.filter_map(|(_, curve)| curve.get("oneOf")?.as_array()).flatten().collect()
}

/// The keys of a table.
pub(super) fn keys_of(node: &Json) -> impl Iterator<Item = (&str, &Json)> {
    let properties = node.get("properties").and_then(Json::as_object).into_iter().flatten();
    properties.map(|(key, property)| (key.as_str(), property))
}

/// Reads tables from a schema.
struct Reader<'s> {
    schema: &'s Json,
}

impl<'s> Reader<'s> {
    /// The definition behind a reference, or the schema itself, and the name of the definition.
    fn resolve(&self, node: &'s Json) -> (&'s Json, Option<&'s str>) {
        let only = node.get("allOf").and_then(|all| all.get(0)).unwrap_or(node);
        let name =
            only.get("$ref").and_then(Json::as_str).and_then(|path| path.strip_prefix("#/definitions/"));
        let definition = name.and_then(|name| self.schema.get("definitions")?.get(name));
        (definition.unwrap_or(node), name)
    }

    /// Name and text of a table and of the tables within it.
    fn tables(&self, name: String, path: &str, node: &'s Json, tables: &mut Vec<(String, String)>) {
        let Some(properties) = node.get("properties").and_then(Json::as_object) else { return };
        // The first paragraph stands in the row of the table above.
        let paragraphs =
            description(node).split("\n\n").skip(1).map(|paragraph| paragraph.to_owned() + "\n\n");
        let mut text: String = paragraphs.collect();
        self.rows(&mut text, properties, node.get("required"));
        tables.push((name, text));
        for (key, property) in properties {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            let (inner, name) = self.resolve(property);
            if name.is_some_and(|name| name.starts_with(CURVE)) {
                continue;
            }
            match property.get("items") {
                Some(items) => self.tables(format!("`[[{path}]]`"), &path, self.resolve(items).0, tables),
                None => self.tables(format!("`[{path}]`"), &path, inner, tables),
            }
        }
    }

    fn rows(&self, text: &mut String, properties: &'s Map<String, Json>, required: Option<&Json>) {
        let required =
            |key: &str| required.and_then(Json::as_array).is_some_and(|keys| keys.iter().any(|k| k == key));
        for (key, property) in properties {
            let default = property
                .get("default")
                .filter(|value| value.as_array().is_none_or(|items| !items.is_empty()));
            let default = default.map(|value| format!("default: {value}")).unwrap_or_default();
            let unit = unit_of_key(key).unwrap_or_default();
            let kind = self.kind(property, unit);
            // A number of ticks, readings or time constants: the key says so.
            let shown = if unit.contains(|c: char| !c.is_ascii_alphabetic() && c != ' ') || unit.len() <= 2 {
                unit
            } else {
                ""
            };
            let parts = [kind, shown.to_owned(), range(property), default];
            let parts: Vec<_> = parts.into_iter().filter(|part| !part.is_empty()).collect();
            let bold = if required(key) { "**" } else { "" };
            let _ = writeln!(
                text,
                "- {bold}`{key}`{bold} ({}): {}",
                parts.join(", "),
                meaning(description(property))
            );
        }
    }

    /// What a value is; nothing for a float with a unit of measure.
    fn kind(&self, property: &'s Json, unit: &str) -> String {
        let (definition, name) = self.resolve(property);
        if name.is_some_and(|name| name.starts_with(CURVE)) {
            let title = definition.get("title").and_then(Json::as_str).unwrap_or_default();
            let of = title.trim_start_matches("Curve of ").split(" over ").next().unwrap_or_default();
            return format!("[curve](#curves), {of}");
        }
        let kind = definition.get("type").and_then(Json::as_str);
        match (kind, property.get("items")) {
            (Some("array"), Some(items)) => {
                let count = counts(property);
                match self.resolve(items).0.get("type").and_then(Json::as_str) {
                    Some("object") => format!("{count} tables"),
                    Some("array") => format!("{count} arrays of {} numbers", counts(items)),
                    Some(other) => format!("{count} {other}s"),
                    None => "array".into(),
                }
            }
            (Some("object"), _) => "table".into(),
            (Some("number"), _) if unit.is_empty() => "float".into(),
            (Some("number"), _) => String::new(),
            (Some("string"), _) if !range(property).is_empty() => String::new(),
            (Some(kind), _) => kind.to_owned(),
            (None, _)
                if property
                    .pointer("/allOf/0/anyOf/0/format")
                    .or(property.pointer("/anyOf/0/format"))
                    .is_some() =>
            {
                "date".into()
            }
            (None, _) => String::new(),
        }
    }
}

fn description(node: &Json) -> &str {
    node.get("description").and_then(Json::as_str).unwrap_or_default()
}

/// "… Source: models §2, 003." → "… [§2, 003]".
fn meaning(description: &str) -> String {
    let text = description.replace('\n', " ");
    match text.split_once(" Source: ") {
        Some((meaning, source)) => {
            let source = source.trim_end_matches('.').replace("models ", "");
            format!("{} [{source}]", meaning.trim_end_matches('.'))
        }
        None => text.trim_end_matches('.').to_owned(),
    }
}

/// Fewest to most entries.
fn counts(node: &Json) -> String {
    let bound = |key| node.get(key).and_then(Json::as_u64);
    match (bound("minItems"), bound("maxItems")) {
        (Some(low), Some(high)) if low == high => format!("{low}"),
        (Some(low), Some(high)) => format!("{low}…{high}"),
        (None, Some(high)) => format!("0…{high}"),
        _ => "any number of".into(),
    }
}

/// Limits of a number, or of the numbers of an array; the values of an enumeration.
fn range(property: &Json) -> String {
    let limits = |node: &Json| {
        let bound = |key| node.get(key).and_then(Json::as_f64);
        match (bound("minimum"), bound("maximum"), bound("exclusiveMinimum")) {
            (Some(low), Some(high), _) => Some(format!("{low}…{high}")),
            (Some(low), None, _) => Some(format!("≥ {low}")),
            (None, _, Some(low)) => Some(format!("> {low}")),
            _ => None,
        }
    };
    if let Some(limits) = limits(property).or_else(|| property.get("items").and_then(limits)) {
        return limits;
    }
    if property.pointer("/not/const").is_some() {
        return "≠ 0".into();
    }
    let forms = property.get("oneOf").or_else(|| property.get("enum")).and_then(Json::as_array);
    let names = forms.into_iter().flatten().filter_map(|form| form.get("const").unwrap_or(form).as_str());
    names.map(|name| format!("`\"{name}\"`")).collect::<Vec<_>>().join(", ")
}
