//! Reading that goes on after an error: every value that is wrong is reported and replaced by a harmless one,
//! so that whatever else is wrong with the document is found in the same go.
//!
//! A replaced value leaves a mark on its path. What later checks have to say about a marked path is dropped:
//! it would only repeat, about a number nobody wrote, what is already known.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::DeValue;

use crate::problem::{Lines, Problem};
use crate::schema::Form;
use crate::text::unplaced;
use crate::walk::Walk;

/// Most problems that are listed; a document with more is not worth reading to its end.
pub(crate) const MAX_PROBLEMS: usize = 256;
/// Longest key that is shown in full.
const LONGEST_KEY: usize = 64;

/// A value and where it stands.
pub(crate) type Value<'d> = Spanned<DeValue<'d>>;

/// Collects problems while a document is walked.
#[derive(Debug, Default)]
pub struct Reader<'t> {
    file: Option<&'t str>,
    lines: Lines<'t>,
    problems: Vec<(usize, Problem)>,
    unlisted: usize,
    damaged: BTreeSet<String>,
    places: BTreeMap<String, usize>,
    free: BTreeMap<String, toml::Table>,
}

impl<'t> Reader<'t> {
    /// A reader of a text; `file` is the name that problems are to carry.
    #[must_use]
    pub fn new(text: &'t str, file: Option<&'t str>) -> Self {
        Self { file, lines: Lines::new(text), ..Self::default() }
    }

    /// Reads the text. What is wrong is reported and replaced; `None` where the text as a whole makes no sense.
    pub fn read<T: DeserializeOwned>(&mut self, form: &Form) -> Option<T> {
        let root = self.root(form)?;
        let table = Walk::new(self, form).document(root.get_ref());
        let read = T::deserialize(toml::Value::Table(table));
        // Every value is one that the schema allows: what is left is what the type says beyond its schema.
        read.map_err(|error| self.report_at(0, "", error.message())).ok()
    }

    /// A table in which anything may stand, as it was written: what is read of it through serde has texts for dates.
    pub fn free_table(&mut self, path: &str) -> Option<toml::Table> {
        self.free.remove(path)
    }

    pub(crate) fn keep_free(&mut self, path: &str, value: &toml::Value) {
        self.free.extend(value.as_table().map(|table| (path.to_owned(), table.clone())));
    }

    pub(crate) fn text(&self) -> &'t str {
        self.lines.text
    }

    /// Whether there is something at a path.
    #[must_use]
    pub fn has(&self, path: &str) -> bool {
        self.places.contains_key(path)
    }

    /// The path of what stands where only a stem of each key is known, the unit left out: `drift.sigma` for
    /// `drift.sigma_deg_per_h`. What stands nowhere keeps its stem.
    #[must_use]
    pub fn spelled(&self, stems: &str) -> String {
        let spell = |path: String, stem: &str| {
            let (name, index) = stem.split_at(stem.find('[').unwrap_or(stem.len()));
            let at = join(&path, name);
            let longer = format!("{at}_");
            let others = self.places.range(longer.clone()..).map(|(path, _)| path.as_str());
            let others = others.take_while(|path| path.starts_with(&longer));
            let mut keys = others.filter(|path| !path.split_at(longer.len()).1.contains(['.', '[']));
            let key = match (self.has(&at), keys.next(), keys.next()) {
                (false, Some(only), None) => only.to_owned(),
                _ => at.clone(),
            };
            format!("{key}{index}")
        };
        stems.split('.').fold(String::new(), spell)
    }

    /// Reports, and marks what was reported, so that later checks say nothing about it.
    pub fn refuse(&mut self, path: &str, message: impl Into<String>) {
        self.report(path, message);
        self.damage(path);
    }

    /// Reports a problem at a byte offset.
    pub(crate) fn report_at(&mut self, offset: usize, key: &str, message: impl Into<String>) {
        if self.is_full() {
            self.unlisted += 1;
        } else {
            let problem = self.problem_at(offset, key, message.into());
            self.problems.push((offset, problem));
        }
    }

    /// Reports a problem with what stands at a path, unless the path is marked as damaged.
    pub fn report(&mut self, path: &str, message: impl Into<String>) {
        if !self.is_damaged(path) {
            self.report_at(self.place(path), path, message);
        }
    }

    /// A problem that is returned instead of collected: a warning.
    #[must_use]
    pub fn warning(&self, path: &str, message: impl Into<String>) -> Problem {
        self.problem_at(self.place(path), path, message.into())
    }

    fn problem_at(&self, offset: usize, key: &str, message: String) -> Problem {
        let (line, column) = self.lines.position(offset);
        Problem { file: self.file.map(Into::into), line, column, key: key.into(), message }
    }

    /// Marks a path: its value is a stand-in.
    pub fn damage(&mut self, path: &str) {
        self.damaged.insert(path.into());
    }

    /// Whether a path, a part of it or what it belongs to is a stand-in.
    #[must_use]
    pub fn is_damaged(&self, path: &str) -> bool {
        let within = |outer: &str, inner: &str| {
            inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        self.damaged.iter().any(|damaged| within(damaged, path) || within(path, damaged))
    }

    /// Whether the value of exactly this path is a stand-in.
    #[must_use]
    pub fn is_marked(&self, path: &str) -> bool {
        self.damaged.contains(path)
    }

    /// Line and column of every path that was walked over.
    #[must_use]
    pub fn positions(&self) -> BTreeMap<String, (usize, usize)> {
        self.places.iter().map(|(path, offset)| (path.clone(), self.lines.position(*offset))).collect()
    }

    /// Offset of what stands at a path, or of the nearest thing around it.
    fn place(&self, path: &str) -> usize {
        let mut path = path;
        loop {
            if let Some(place) = self.places.get(path) {
                return *place;
            }
            let Some(end) = path.rfind(['.', '[']) else { return 0 };
            path = path.get(..end).unwrap_or_default();
        }
    }

    /// All problems in the order of the text; `None` if there is none.
    #[must_use]
    pub fn into_problems(mut self) -> Option<Vec<Problem>> {
        if self.problems.is_empty() {
            return None;
        }
        self.problems.sort_by_key(|(offset, _)| *offset);
        let mut problems: Vec<_> = self.problems.into_iter().map(|(_, problem)| problem).collect();
        if self.unlisted > 0 {
            let message = format!("and {} more problems that are not listed", self.unlisted);
            problems.push(unplaced(self.file, message));
        }
        Some(problems)
    }

    /// What was read, where nothing is wrong with it.
    ///
    /// # Errors
    /// Every problem, in the order of the text.
    pub fn finish<T>(self, read: Option<T>) -> Result<T, Vec<Problem>> {
        match (self.into_problems(), read) {
            (None, Some(read)) => Ok(read),
            (problems, _) => Err(problems.unwrap_or_default()),
        }
    }

    /// Whether no further problem would be listed.
    pub(crate) fn is_full(&self) -> bool {
        self.problems.len() >= MAX_PROBLEMS
    }

    /// One problem more than are listed.
    pub(crate) fn pass_over(&mut self) {
        self.unlisted += 1;
    }

    /// The source text of a span, shortened to what fits in a message.
    pub(crate) fn excerpt(&self, span: Range<usize>) -> String {
        self.lines.excerpt(span)
    }

    /// "is …, must be …" for a value of the wrong type or outside its limits.
    pub(crate) fn refuse_value(&mut self, path: &str, value: &Value<'_>, must_be: &str) {
        let excerpt = self.lines.excerpt(value.span());
        let type_name = match value.get_ref() {
            DeValue::Table(_) => Some("a table"),
            DeValue::Array(_) => Some("an array"),
            DeValue::String(_) => Some("a string"),
            DeValue::Boolean(_) => Some("a boolean"),
            DeValue::Datetime(_) => Some("a date or time"),
            DeValue::Integer(_) | DeValue::Float(_) => None,
        };
        let is = match type_name {
            Some(name @ ("a table" | "an array")) => name.into(),
            Some(name) => format!("{excerpt} ({name})"),
            None => excerpt,
        };
        self.report_at(value.span().start, path, format!("is {is}, must be {must_be}"));
        self.damage(path);
    }

    /// Remembers where a path stands.
    pub(crate) fn note(&mut self, path: &str, value: &Value<'_>) {
        self.places.insert(path.into(), value.span().start);
    }
}

/// Reads a text about which nothing is to be checked but what its schema says; `file` is for messages.
///
/// # Errors
/// Every problem, in the order of the text.
pub fn parse<T: JsonSchema + DeserializeOwned>(text: &str, file: &str) -> Result<T, Vec<Problem>> {
    let mut reader = Reader::new(text, Some(file));
    let read = reader.read(&Form::of::<T>());
    reader.finish(read)
}

/// Path of an element of an array.
#[must_use]
pub fn element(path: &str, index: usize) -> String {
    format!("{path}[{index}]")
}

/// Path of a key in a table.
#[must_use]
pub fn join(path: &str, key: &str) -> String {
    let bare = !key.is_empty() && key.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    let mut key: Cow<'_, str> = if bare { key.into() } else { format!("{key:?}").into() };
    if let Some((end, _)) = key.char_indices().nth(LONGEST_KEY) {
        key = format!("{}…", key.get(..end).unwrap_or_default()).into();
    }
    if path.is_empty() { key.into_owned() } else { format!("{path}.{key}") }
}
