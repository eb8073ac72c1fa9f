//! What a part of a schema asks for.

use serde_json::{Map, Value as Json};

/// A schema with its definitions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Schema<'s>(pub(crate) &'s Json);

impl<'s> Schema<'s> {
    /// The definition that a part of the schema refers to, or the part itself.
    pub(crate) fn resolve(self, node: &'s Json) -> &'s Json {
        let only = node.get("allOf").and_then(|all| all.get(0)).unwrap_or(node);
        let path = only.get("$ref").and_then(Json::as_str).and_then(|path| path.strip_prefix('#'));
        path.and_then(|path| self.0.pointer(path)).unwrap_or(only)
    }
}

/// What a part of a schema asks for.
#[derive(Debug)]
pub(crate) enum Kind<'s> {
    /// A table with stated keys.
    Table,
    /// A table in one of several forms, told apart by its key `kind`.
    Forms(&'s [Json]),
    /// A value of one of several types.
    Either(&'s [Json]),
    /// An array.
    Array,
    /// A number, whole or not.
    Number,
    /// A whole number.
    Whole,
    /// One of several words.
    Choice(Vec<&'s str>),
    /// This word: the `kind` of a form.
    Only(&'s str),
    /// A text.
    Text,
    /// True or false.
    Boolean,
    /// A date, or a date and time with offset.
    Date,
    /// Anything whose numbers are finite.
    Free,
}

impl<'s> Kind<'s> {
    pub(crate) fn of(node: &'s Json) -> Self {
        let list = |key| node.get(key).and_then(Json::as_array).map(Vec::as_slice);
        let is_date = |form: &Json| form.get("format").is_some_and(|format| format == "date");
        if list("anyOf").is_some_and(|forms| forms.iter().any(is_date)) {
            return Self::Date;
        }
        if let Some(forms) = list("anyOf") {
            return Self::Either(forms);
        }
        if let Some(word) = node.get("const").and_then(Json::as_str) {
            return Self::Only(word);
        }
        if let Some(forms) = list("oneOf").or(list("enum")) {
            let word = |form: &'s Json| form.get("const").unwrap_or(form).as_str();
            return forms.iter().map(word).collect::<Option<_>>().map_or(Self::Forms(forms), Self::Choice);
        }
        match node.get("type").and_then(Json::as_str) {
            Some("object") if node.get("properties").is_some() => Self::Table,
            Some("array") => Self::Array,
            Some("number") => Self::Number,
            Some("integer") => Self::Whole,
            Some("string") => Self::Text,
            Some("boolean") => Self::Boolean,
            _ => Self::Free,
        }
    }
}

/// Stated keys of a table.
pub(crate) fn properties(node: &Json) -> Option<&Map<String, Json>> {
    node.get("properties").and_then(Json::as_object)
}

/// The same, none where there are none.
pub(crate) fn properties_of(node: &Json) -> impl Iterator<Item = (&String, &Json)> {
    properties(node).into_iter().flatten()
}

/// The words of a list.
pub(crate) fn texts(list: Option<&Json>) -> impl Iterator<Item = &str> {
    list.and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str)
}

/// Fewest and most items of an array, where they are stated.
pub(crate) fn counts(node: &Json) -> [Option<usize>; 2] {
    ["minItems", "maxItems"].map(|key| usize::try_from(node.get(key)?.as_u64()?).ok())
}
