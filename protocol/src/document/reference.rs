//! The reference of every key, made from the schema: `docs/calibration-document.md`.

use std::fmt::Write as _;

use serde_json::{Map, Value as Json};

use super::measure::unit_of_key;
use super::schema;
use crate::overlay::overlay_schema;

/// What stands above the tables.
const INTRODUCTION: &str = include_str!("introduction.md");
/// What stands above the overlay's tables.
const OVERLAY: &str = include_str!("overlay.md");
/// Head of every table of keys.
const HEAD: &str =
    "| key | type | unit | range | default | meaning | source |\n|---|---|---|---|---|---|---|\n";

/// The reference of the calibration document and of the overlay, in Markdown.
#[must_use]
pub fn reference() -> String {
    let schema = schema();
    let mut text = INTRODUCTION.to_owned();
    let writer = Writer { schema: &schema, of: "" };
    writer.table(&mut text, "", false, &schema);
    text.push_str("\n## Curves\n");
    text.push_str(CURVES);
    for (name, definition) in schema.get("definitions").and_then(Json::as_object).into_iter().flatten() {
        if name.starts_with(CURVE) {
            curve(&mut text, name, definition);
        }
    }
    text.push_str(OVERLAY);
    let schema = overlay_schema();
    Writer { schema: &schema, of: "Overlay: " }.table(&mut text, "", false, &schema);
    text
}

/// Start of the names of curve definitions.
const CURVE: &str = "CurveOf";

/// What is said of curves in general.
const CURVES: &str = "
A curve is a table, inline or with a header of its own. `kind` chooses its form, and with it the keys that it must
have; there are no others. Outside `range_…`, or beyond the first and last knot, the argument is clamped, never
extrapolated, and the output is flagged. The unit of the values is in the key. The argument is temperature unless a key says
`…_deg_c_per_s` or `…_deg_c_per_s2`.
";

/// Writes tables of keys.
struct Writer<'s> {
    schema: &'s Json,
    /// What the tables belong to, before their names; empty for the document.
    of: &'static str,
}

impl<'s> Writer<'s> {
    /// The definition behind a reference, or the schema itself, and the name of the definition.
    fn resolve(&self, node: &'s Json) -> (&'s Json, Option<&'s str>) {
        let only = node.get("allOf").and_then(|all| all.get(0)).unwrap_or(node);
        let name =
            only.get("$ref").and_then(Json::as_str).and_then(|path| path.strip_prefix("#/definitions/"));
        let definition = name.and_then(|name| self.schema.get("definitions")?.get(name));
        (definition.unwrap_or(node), name)
    }

    /// One table of the document and the tables within it.
    fn table(&self, text: &mut String, path: &str, array: bool, node: &'s Json) {
        let Some(properties) = node.get("properties").and_then(Json::as_object) else { return };
        let header = match (path, array) {
            ("", _) if self.of.is_empty() => "Top level".to_owned(),
            ("", _) => "top level".to_owned(),
            (path, false) => format!("`[{path}]`"),
            (path, true) => format!("`[[{path}]]`"),
        };
        let _ = write!(text, "\n## {}{header}\n\n{}\n\n{HEAD}", self.of, paragraph(node));
        self.rows(text, properties, node.get("required"));
        for (key, property) in properties {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            let (inner, name) = self.resolve(property);
            if name.is_some_and(|name| name.starts_with(CURVE)) {
                continue;
            }
            match property.get("items") {
                Some(items) => self.table(text, &path, true, self.resolve(items).0),
                None => self.table(text, &path, false, inner),
            }
        }
    }

    fn rows(&self, text: &mut String, properties: &'s Map<String, Json>, required: Option<&Json>) {
        let required =
            |key: &str| required.and_then(Json::as_array).is_some_and(|keys| keys.iter().any(|k| k == key));
        for (key, property) in properties {
            let (meaning, source) = split_source(description(property));
            let default = match property.get("default") {
                Some(default) if default.as_array().is_none_or(|items| !items.is_empty()) => {
                    format!("`{default}`")
                }
                _ if required(key) => "required".to_owned(),
                _ => "—".to_owned(),
            };
            let (kind, range) = (self.kind(property), range(property));
            let unit = unit_of_key(key).unwrap_or("—");
            let _ =
                writeln!(text, "| `{key}` | {kind} | {unit} | {range} | {default} | {meaning} | {source} |");
        }
    }

    /// What a value is.
    fn kind(&self, property: &'s Json) -> String {
        let (definition, name) = self.resolve(property);
        if name.is_some_and(|name| name.starts_with(CURVE)) {
            let title = definition.get("title").and_then(Json::as_str).unwrap_or_default();
            return format!(
                "[{}](#curves)",
                title.to_lowercase().replace("hz", "Hz").replace("°c", "°C").replace(" v", " V")
            );
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
            (Some(kind), _) => kind.replace("number", "float"),
            (None, _) if definition.get("oneOf").is_some() => "string".into(),
            (None, _) => "—".into(),
        }
    }
}

/// The forms of one quantity's curves.
fn curve(text: &mut String, name: &str, definition: &Json) {
    let title = definition.get("title").and_then(Json::as_str).unwrap_or(name);
    let _ = write!(text, "\n### {title}\n\n| `kind` | key | meaning |\n|---|---|---|\n");
    for form in definition.get("oneOf").and_then(Json::as_array).into_iter().flatten() {
        let kind = form.get("title").and_then(Json::as_str).unwrap_or_default();
        for (key, property) in form.get("properties").and_then(Json::as_object).into_iter().flatten() {
            if key != "kind" {
                let _ = writeln!(text, "| `\"{kind}\"` | `{key}` | {} |", description(property));
            }
        }
    }
}

fn description(node: &Json) -> String {
    node.get("description").and_then(Json::as_str).unwrap_or_default().replace('\n', " ")
}

/// A table's description as a paragraph.
fn paragraph(node: &Json) -> String {
    node.get("description").and_then(Json::as_str).unwrap_or_default().to_owned()
}

/// "… Source: 003." → the meaning and the source.
fn split_source(description: String) -> (String, String) {
    match description.split_once("Source: ") {
        Some((meaning, source)) => (meaning.trim().to_owned(), source.trim_end_matches('.').to_owned()),
        None => (description, "—".to_owned()),
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

/// Limits of a number, or of the numbers of an array.
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
    let names: Vec<_> = names.map(|name| format!("`\"{name}\"`")).collect();
    if names.is_empty() { "—".into() } else { names.join(", ") }
}
