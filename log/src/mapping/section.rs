//! A table of the mapping that knows its path, and notes what is wrong with it.

use std::cell::RefCell;
use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::problem::{Problem, place};

/// Collects the problems of one text.
#[derive(Debug)]
pub(super) struct Notes<'t> {
    /// Name of the file, for messages.
    file: &'t str,
    /// Its text.
    text: &'t str,
    /// What was found so far.
    problems: RefCell<Vec<Problem>>,
}

impl<'t> Notes<'t> {
    /// Nothing found yet.
    pub(super) fn new(file: &'t str, text: &'t str) -> Self {
        Self { file, text, problems: RefCell::new(Vec::new()) }
    }

    /// Notes a problem at a place in the text.
    pub(super) fn add(&self, at: usize, key: String, value: String, message: impl Into<String>) {
        let (line, column) = place(self.text, at);
        let message = message.into();
        let problem = Problem { file: self.file.to_owned(), line, column, key, value, message };
        self.problems.borrow_mut().push(problem);
    }

    /// Everything found, in the order of lines.
    pub(super) fn into_problems(self) -> Vec<Problem> {
        let mut problems = self.problems.into_inner();
        problems.sort_by_key(|problem| (problem.line, problem.column));
        problems
    }

    /// The text of a span on one line.
    fn written(&self, span: Range<usize>) -> String {
        let text = self.text.get(span).unwrap_or_default();
        let first = text.lines().next().unwrap_or_default();
        if first.len() < text.trim_end().len() { format!("{first} …") } else { first.to_owned() }
    }
}

/// A value with its place and the path to it.
#[derive(Debug, Clone)]
pub(super) struct Item<'a, 't> {
    /// Where problems go.
    notes: &'a Notes<'t>,
    /// Path to it.
    path: String,
    /// The value.
    value: &'a Spanned<DeValue<'t>>,
}

impl<'a, 't> Item<'a, 't> {
    /// Notes that the value is wrong.
    pub(super) fn refuse(&self, message: impl Into<String>) {
        let span = self.value.span();
        self.notes.add(span.start, self.path.clone(), self.notes.written(span), message);
    }

    /// Notes that the value is of another type.
    fn refuse_type(&self, need: &str) {
        self.refuse(format!("is {}, must be {need}", article(self.value.get_ref().type_str())));
    }

    /// As text.
    pub(super) fn string(&self) -> Option<&'a str> {
        let text = self.value.get_ref().as_str();
        if text.is_none() {
            self.refuse_type("a text in quotes");
        }
        text
    }

    /// As a whole number within limits.
    pub(super) fn integer(&self, limits: RangeInclusive<i64>) -> Option<i64> {
        let Some(integer) = self.value.get_ref().as_integer() else {
            self.refuse_type("a whole number");
            return None;
        };
        let number = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
        let number = number.filter(|number| limits.contains(number));
        if number.is_none() {
            self.refuse(format!("must be {} to {}", limits.start(), limits.end()));
        }
        number
    }

    /// As a finite number.
    pub(super) fn number(&self) -> Option<f64> {
        let text = match self.value.get_ref() {
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
            DeValue::Float(float) => float.as_str(),
            _ => {
                self.refuse_type("a number");
                return None;
            }
        };
        let number = text.parse().ok().filter(|number: &f64| number.is_finite());
        if number.is_none() {
            self.refuse("must be finite");
        }
        number
    }

    /// As a number above zero.
    pub(super) fn positive(&self) -> Option<f64> {
        let number = self.number()?;
        if number <= 0.0 {
            self.refuse("must be above 0");
            return None;
        }
        Some(number)
    }

    /// As yes or no.
    pub(super) fn boolean(&self) -> Option<bool> {
        let boolean = self.value.get_ref().as_bool();
        if boolean.is_none() {
            self.refuse_type("true or false");
        }
        boolean
    }

    /// As one of several words.
    pub(super) fn choice<T: Copy>(&self, words: &[(&str, T)]) -> Option<T> {
        let text = self.string()?;
        let found = words.iter().find(|(word, _)| *word == text).map(|(_, meaning)| *meaning);
        if found.is_none() {
            let list: Vec<_> = words.iter().map(|(word, _)| format!("{word:?}")).collect();
            self.refuse(format!("must be one of {}", list.join(", ")));
        }
        found
    }

    /// As a column: its name, or its number from 1.
    pub(super) fn column(&self) -> Option<super::Column> {
        match self.value.get_ref() {
            DeValue::String(name) if name.trim().is_empty() => {
                self.refuse("is empty, must be the column's name in the header, or its number from 1");
                None
            }
            DeValue::String(name) => Some(super::Column::Name(name.trim().to_owned())),
            DeValue::Integer(_) => {
                let number = self.integer(1..=4096)?;
                Some(super::Column::Index(usize::try_from(number - 1).ok()?))
            }
            _ => {
                self.refuse_type("the column's name in the header, or its number from 1");
                None
            }
        }
    }

    /// As a table.
    pub(super) fn section(&self) -> Option<Section<'a, 't>> {
        let table = self.value.get_ref().as_table();
        if table.is_none() {
            self.refuse_type("a table");
        }
        let at = self.value.span().start;
        Some(Section::new(self.notes, self.path.clone(), at, table?))
    }

    /// As a list.
    pub(super) fn list(&self) -> Option<Vec<Self>> {
        let Some(array) = self.value.get_ref().as_array() else {
            self.refuse_type("a list");
            return None;
        };
        let item =
            |(index, value)| Item { notes: self.notes, path: format!("{}[{index}]", self.path), value };
        Some(array.iter().enumerate().map(item).collect())
    }
}

/// A table of the mapping; whatever is not asked for is unknown.
#[derive(Debug)]
pub(super) struct Section<'a, 't> {
    /// Where problems go.
    notes: &'a Notes<'t>,
    /// Path to it.
    path: String,
    /// Where it starts.
    at: usize,
    /// Its keys.
    table: &'a DeTable<'t>,
    /// Keys that were asked for.
    known: RefCell<Vec<&'static str>>,
}

impl<'a, 't> Section<'a, 't> {
    /// A table at a place of the text.
    pub(super) fn new(notes: &'a Notes<'t>, path: String, at: usize, table: &'a DeTable<'t>) -> Self {
        Self { notes, path, at, table, known: RefCell::new(Vec::new()) }
    }

    /// Path to a key of this table.
    fn key(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// The value of a key, where the table has it.
    pub(super) fn get(&self, key: &'static str) -> Option<Item<'a, 't>> {
        self.known.borrow_mut().push(key);
        let value = self.table.get(key)?;
        Some(Item { notes: self.notes, path: self.key(key), value })
    }

    /// The value of a key that must be there.
    pub(super) fn need(&self, key: &'static str, what: &str) -> Option<Item<'a, 't>> {
        let item = self.get(key);
        if item.is_none() {
            self.missing(key, what);
        }
        item
    }

    /// Notes that a key is missing.
    pub(super) fn missing(&self, key: &str, what: &str) {
        self.notes.add(self.at, self.key(key), String::new(), format!("is missing: {what}"));
    }

    /// Notes every key that was not asked for.
    pub(super) fn finish(self) {
        let known = self.known.into_inner();
        for (key, value) in self.table {
            if known.contains(&key.get_ref().as_ref()) {
                continue;
            }
            let path = if self.path.is_empty() {
                key.get_ref().to_string()
            } else {
                format!("{}.{}", self.path, key.get_ref())
            };
            let value = self.notes.written(value.span());
            let message = format!("unknown key, must be one of {}", known.join(", "));
            self.notes.add(key.span().start, path, value, message);
        }
    }
}

/// A type's name with its article.
fn article(name: &str) -> String {
    let an = name.starts_with(['a', 'e', 'i', 'o', 'u']);
    format!("{} {name}", if an { "an" } else { "a" })
}
