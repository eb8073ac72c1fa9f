//! The walk through a text by its schema: every value is checked once, and what is wrong is reported and replaced.

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::net::SocketAddr;

use isotherm_correction::stated::Shown;
use regex_lite::Regex;
use serde_json::{Value as Json, json};
use toml::de::{DeTable, DeValue};
use toml::value::Datetime;

use crate::kind::{Kind, Schema, counts, properties, properties_of, texts};
use crate::number::{Limits, number, whole, whole_limits};
use crate::reader::{Reader, Value, element, join};
use crate::schema::Form;
use crate::stand_in::{fill, stand_in};
use crate::suggest::{closest, nearest};

/// A walk under way.
#[derive(Debug)]
pub(crate) struct Walk<'r, 't, 's> {
    reader: &'r mut Reader<'t>,
    schema: Schema<'s>,
}

impl<'r, 't, 's> Walk<'r, 't, 's> {
    pub(crate) fn new(reader: &'r mut Reader<'t>, form: &'s Form) -> Self {
        Self { reader, schema: Schema(&form.schema) }
    }

    /// The whole text.
    pub(crate) fn document(&mut self, root: &DeTable<'_>) -> toml::Table {
        let node = self.schema.0;
        self.table(&[node], "", 0, root)
    }

    /// A value, or a stand-in for one that is wrong.
    fn value(&mut self, node: &'s Json, path: &str, value: &Value<'_>) -> toml::Value {
        self.reader.note(path, value);
        let stated = node;
        let node = self.schema.resolve(node);
        let read = match Kind::of(node) {
            Kind::Table => match value.get_ref().as_table() {
                Some(entries) => Ok(toml::Value::Table(self.table(&[node], path, value.span().start, entries))),
                None => Err("a table".to_owned()),
            },
            Kind::Forms(forms) => match value.get_ref().as_table() {
                Some(entries) => Ok(self.forms(forms, path, value.span().start, entries)),
                None => word(forms, value),
            },
            Kind::Either(forms) => match forms.iter().find(|form| self.is_of_type(form, value)) {
                Some(form) => Ok(self.value(form, path, value)),
                None => Err("of another type".to_owned()),
            },
            Kind::Array => self.array(node, path, value),
            Kind::Number => {
                let (limits, number) = (Limits::of(node), number(value.get_ref()));
                let allowed = number.filter(|number| limits.allow(*number));
                allowed.map(toml::Value::Float).ok_or_else(|| limits.must_be(number))
            }
            Kind::Whole => {
                let (low, high) = whole_limits(node);
                let allowed = whole(value.get_ref())
                    .filter(|whole| (low..=high).contains(whole) && node.pointer("/not/const") != Some(&json!(whole)));
                let limits = || format!("a whole number from {low} to {high}");
                allowed.map(toml::Value::Integer).ok_or_else(limits)
            }
            Kind::Choice(names) => text(value, |text| names.contains(&text)).ok_or_else(|| one_of(&names)),
            Kind::Only(word) => text(value, |text| text == word).ok_or_else(|| format!("{word:?}")),
            Kind::Text => text(value, |text| is_fit(node, text)).ok_or_else(|| text_must_be(node)),
            Kind::Boolean => {
                value.get_ref().as_bool().map(toml::Value::Boolean).ok_or_else(|| "true or false".to_owned())
            }
            Kind::Date => date(value).map(toml::Value::Datetime).ok_or_else(|| {
                "a date (2026-11-21), or a date and time with offset (2026-11-21T08:00:00Z), without quotes".to_owned()
            }),
            Kind::Free if node.get("type").is_some() && !value.get_ref().is_table() => Err("a table".to_owned()),
            Kind::Free => {
                let free = self.free(path, value);
                self.reader.keep_free(path, &free);
                Ok(free)
            }
        };
        read.unwrap_or_else(|must_be| {
            let words = [stated, node].iter().find_map(|node| node.get("x-must-be")?.as_str());
            self.reader.refuse_value(path, value, words.unwrap_or(&must_be));
            stand_in(self.schema, node)
        })
    }

    /// Whether a value is of the type that a schema asks for, whatever it says.
    fn is_of_type(&self, node: &'s Json, value: &Value<'_>) -> bool {
        let value = value.get_ref();
        match Kind::of(self.schema.resolve(node)) {
            Kind::Table | Kind::Forms(_) => value.is_table(),
            Kind::Array => value.is_array(),
            Kind::Number => value.is_float() || value.is_integer(),
            Kind::Whole => value.is_integer(),
            Kind::Choice(_) | Kind::Only(_) | Kind::Text => value.is_str(),
            Kind::Boolean => value.is_bool(),
            Kind::Date => value.is_datetime(),
            Kind::Either(_) | Kind::Free => true,
        }
    }

    /// A table. Of several forms, all of one kind, the first is the one whose keys are there.
    fn table(&mut self, forms: &[&'s Json], path: &str, start: usize, entries: &DeTable<'_>) -> toml::Table {
        let mut table = toml::Table::new();
        let Some(form) = forms.first() else { return table };
        let Some(properties) = properties(form) else { return table };
        let required: Vec<_> = texts(form.get("required")).collect();
        for (index, (key, property)) in properties.iter().enumerate() {
            let at = join(path, key);
            if let Some(value) = entries.get(key.as_str()) {
                table.insert(key.clone(), self.value(property, &at, value));
            } else if required.contains(&key.as_str()) {
                let others = forms
                    .iter()
                    .filter_map(|form| properties_of(form).nth(index))
                    .map(|(key, _)| key.as_str());
                let message = self.missing(property, &at, others);
                self.reader.report_at(start, &at, message);
                self.reader.damage(&at);
                table.insert(key.clone(), stand_in(self.schema, property));
            }
        }
        self.unknown_keys(forms, path, entries);
        table
    }

    /// What is said of a key that is missing.
    fn missing(&self, property: &'s Json, path: &str, keys: impl Iterator<Item = &'s str>) -> String {
        let property = self.schema.resolve(property);
        if let (true, [Some(low), Some(high)]) = (self.is_list_of_tables(property), counts(property)) {
            return format!("is missing: {} of {low} to {high}", header(path));
        }
        let mut names: Vec<_> = keys.map(|key| format!("`{key}`")).collect();
        names.dedup();
        format!("is missing: add {}", names.join(" or "))
    }

    fn is_list_of_tables(&self, node: &'s Json) -> bool {
        node.get("items").is_some_and(|items| matches!(Kind::of(self.schema.resolve(items)), Kind::Table))
    }

    /// Reports every key that the schema does not have.
    fn unknown_keys(&mut self, forms: &[&'s Json], path: &str, entries: &DeTable<'_>) {
        let mut known: Vec<&str> = Vec::new();
        for (key, _) in forms.iter().flat_map(|form| properties_of(form)) {
            if !known.contains(&key.as_str()) {
                known.push(key);
            }
        }
        for key in entries.keys() {
            let name = key.get_ref().as_ref();
            if known.contains(&name) {
                continue;
            }
            if self.reader.is_full() {
                self.reader.pass_over();
                continue;
            }
            let free: Vec<_> = known.iter().copied().filter(|known| !entries.contains_key(*known)).collect();
            // A table that is there already may be meant: it is written in several pieces.
            let is_table = |known: &&str| {
                entries.get(*known).is_some_and(|value| matches!(value.get_ref(), DeValue::Table(_)))
            };
            let tables = known.iter().copied().filter(is_table);
            let advice = match closest(name, free.iter().copied()).or_else(|| closest(name, tables)) {
                Some(word) => format!("did you mean `{word}`?"),
                None if free.is_empty() => "remove it".into(),
                None => format!("remove it; keys not used here: {}", free.join(", ")),
            };
            self.reader.report_at(
                key.span().start,
                &join(path, name),
                format!("is not a known key: {advice}"),
            );
        }
    }

    /// A table in one of several forms: that of its `kind`, or the one whose keys are there.
    fn forms(&mut self, forms: &'s [Json], path: &str, start: usize, entries: &DeTable<'_>) -> toml::Value {
        const TAG: &str = "kind";
        let tag_of = |form: &'s Json| properties(form)?.get(TAG)?.get("const")?.as_str();
        let mut fitting: Vec<_> = forms.iter().filter(|form| properties(form).is_some()).collect();
        if fitting.iter().any(|form| tag_of(form).is_some()) {
            let tag = entries.get(TAG).and_then(|value| value.get_ref().as_str());
            fitting.retain(|form| tag.is_some() && tag_of(form) == tag);
            if fitting.is_empty() {
                let mut names: Vec<_> = forms.iter().filter_map(tag_of).collect();
                let mut seen = BTreeSet::new();
                names.retain(|name| seen.insert(*name));
                self.wrong_kind(&names, &join(path, TAG), start, entries.get(TAG));
                // Without its kind nothing can be said about the other keys.
                self.reader.damage(path);
                return forms
                    .first()
                    .map_or_else(|| toml::Table::new().into(), |form| stand_in(self.schema, form));
            }
        }
        // Where several have as many of the keys, the one that misspelled keys are nearest to.
        let likeness = |form: &&Json| {
            let Some(known) = properties(form) else { return (Reverse(0), 0) };
            let unknown =
                entries.keys().map(|key| key.get_ref().as_ref()).filter(|key| !known.contains_key(*key));
            let there = known.keys().filter(|key| entries.contains_key(key.as_str())).count();
            (Reverse(there), unknown.map(|key| nearest(key, known.keys().map(String::as_str))).sum::<usize>())
        };
        fitting.sort_by_cached_key(likeness);
        let best = fitting.first().map(likeness);
        fitting.retain(|form| Some(likeness(form)) == best);
        toml::Value::Table(self.table(&fitting, path, start, entries))
    }

    /// Reports a `kind` that is missing or none of those that there are.
    fn wrong_kind(&mut self, names: &[&str], path: &str, start: usize, value: Option<&Value<'_>>) {
        if let Some(value) = value {
            self.reader.note(path, value);
            self.reader.refuse_value(path, value, &one_of(names));
        } else {
            self.reader.report_at(start, path, "is missing: add `kind`");
        }
    }

    /// An array.
    fn array(&mut self, node: &'s Json, path: &str, value: &Value<'_>) -> Result<toml::Value, String> {
        let items = node.get("items");
        let Some(array) = value.get_ref().as_array() else {
            let tables =
                self.is_list_of_tables(node).then(|| format!("an array of tables: {}", header(path)));
            return Err(tables.unwrap_or_else(|| "an array".to_owned()));
        };
        let [low, high] = counts(node);
        let (low, high) = (low.unwrap_or(0), high.unwrap_or(usize::MAX));
        if !(low..=high).contains(&array.len()) {
            let must_have = match (low, high) {
                (low, high) if low == high => low.to_string(),
                (low, usize::MAX) => format!("{low} or more"),
                (low, high) => format!("{low} to {high}"),
            };
            let entries = if array.len() == 1 { "entry" } else { "entries" };
            let message = format!("has {} {entries}, must have {must_have}", array.len());
            self.reader.report_at(value.span().start, path, message);
            self.reader.damage(path);
        }
        let mut read = Vec::new();
        for (index, item) in array.iter().enumerate().take(high) {
            let at = element(path, index);
            read.push(match items {
                Some(node) => self.value(node, &at, item),
                None => self.free(&at, item),
            });
        }
        let read = fill(self.schema, node, read);
        Ok(toml::Value::Array(if node.get("x-rising").is_some() { self.rising(path, read) } else { read }))
    }

    /// Two numbers, of which the first must be below the second.
    fn rising(&mut self, path: &str, pair: Vec<toml::Value>) -> Vec<toml::Value> {
        let [low, high] =
            [pair.first(), pair.get(1)].map(|end| end.and_then(toml::Value::as_float).unwrap_or(0.0));
        if low >= high {
            self.reader.refuse(
                path,
                format!("runs from {} to {}: the first must be below the second", Shown(low), Shown(high)),
            );
        }
        if self.reader.is_damaged(path) { [0.0, 1.0].map(toml::Value::Float).to_vec() } else { pair }
    }

    /// Anything goes, as long as its numbers are finite. The depth is bounded by the parser, which refuses nesting beyond 80
    /// levels.
    fn free(&mut self, path: &str, value: &Value<'_>) -> toml::Value {
        match value.get_ref() {
            DeValue::String(text) => toml::Value::String(text.to_string()),
            DeValue::Boolean(boolean) => toml::Value::Boolean(*boolean),
            DeValue::Datetime(datetime) => toml::Value::Datetime(*datetime),
            DeValue::Integer(_) | DeValue::Float(_) => {
                if let Some(whole) = whole(value.get_ref()) {
                    return toml::Value::Integer(whole);
                }
                let (limits, number) = (Limits::of(&Json::Null), number(value.get_ref()));
                toml::Value::Float(number.filter(|number| limits.allow(*number)).unwrap_or_else(|| {
                    self.reader.refuse_value(path, value, &limits.must_be(number));
                    limits.stand_in()
                }))
            }
            DeValue::Array(array) => {
                let items = array.iter().enumerate();
                toml::Value::Array(items.map(|(i, value)| self.free(&element(path, i), value)).collect())
            }
            DeValue::Table(entries) => {
                let entry = |(key, value): (&toml::Spanned<toml::de::DeString<'_>>, &Value<'_>)| {
                    (key.get_ref().to_string(), self.free(&join(path, key.get_ref()), value))
                };
                toml::Value::Table(entries.iter().map(entry).collect())
            }
        }
    }
}

/// A word that stands for a form without keys.
fn word(forms: &[Json], value: &Value<'_>) -> Result<toml::Value, String> {
    let words: Vec<_> = forms.iter().flat_map(words).collect();
    let must_be = || match words.as_slice() {
        [] => "a table".to_owned(),
        words => format!("a table, or {}", one_of(words)),
    };
    text(value, |text| words.contains(&text)).ok_or_else(must_be)
}

/// Words that stand for a form without keys.
fn words(form: &Json) -> impl Iterator<Item = &str> {
    form.get("const").and_then(Json::as_str).into_iter().chain(texts(form.get("enum")))
}

fn one_of(names: &[&str]) -> String {
    let names: Vec<_> = names.iter().map(|name| format!("{name:?}")).collect();
    format!("one of {}", names.join(", "))
}

/// How tables of an array are written.
fn header(path: &str) -> String {
    let mut depth = 0;
    let without_indices = path.chars().filter(|c| {
        depth += i32::from(*c == '[');
        let keep = depth == 0;
        depth -= i32::from(*c == ']');
        keep
    });
    format!("write `[[{}]]` above each", without_indices.collect::<String>())
}

/// A text that is fit for something.
fn text(value: &Value<'_>, fit: impl Fn(&str) -> bool) -> Option<toml::Value> {
    value.get_ref().as_str().filter(|text| fit(text)).map(|text| toml::Value::String(text.to_owned()))
}

/// Length of a text in bytes.
fn length(node: &Json) -> Option<(u64, u64)> {
    let bound = |key| node.get(key).and_then(Json::as_u64);
    match (bound("minLength"), bound("maxLength")) {
        (None, None) => None,
        (low, high) => Some((low.unwrap_or(0), high.unwrap_or(u64::MAX))),
    }
}

fn is_fit(node: &Json, text: &str) -> bool {
    let is_address = node.get("format").is_some_and(|format| format == "socket-address");
    let pattern = node.get("pattern").and_then(Json::as_str).and_then(|pattern| Regex::new(pattern).ok());
    length(node).is_none_or(|(low, high)| (low..=high).contains(&(text.len() as u64)))
        && pattern.is_none_or(|pattern| pattern.is_match(text))
        && (!is_address || text.parse::<SocketAddr>().is_ok())
}

fn text_must_be(node: &Json) -> String {
    match (length(node), node.get("pattern")) {
        (Some((1, u64::MAX)), _) => "a string that is not empty".to_owned(),
        (Some((low, high)), _) => format!("a string of {low} to {high} bytes"),
        (None, Some(pattern)) => format!("a string of the form {pattern}"),
        (None, None) => "a string".to_owned(),
    }
}

/// Whether it is a date, or a date and time with offset.
#[must_use]
pub fn is_complete(datetime: &Datetime) -> bool {
    datetime.date.is_some() && datetime.time.is_some() == datetime.offset.is_some()
}

/// A date, or a date and time with offset.
fn date(value: &Value<'_>) -> Option<Datetime> {
    let DeValue::Datetime(datetime) = value.get_ref() else { return None };
    is_complete(datetime).then_some(*datetime)
}
