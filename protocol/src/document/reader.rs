//! Reading that goes on after an error: every value that is wrong is reported and replaced by a harmless one,
//! so that whatever else is wrong with the document is found in the same go.
//!
//! A replaced value leaves a mark on its path. What later checks have to say about a marked path is dropped:
//! it would only repeat, about a number nobody wrote, what is already known.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::problem::{Lines, Problem};
use super::suggest::closest;

/// Most problems that are listed; a document with more is not worth reading to its end.
pub(crate) const MAX_PROBLEMS: usize = 256;
/// Elements of an array that can be pointed at; longer arrays are pointed at as a whole.
const MAX_PLACED_ELEMENTS: usize = 128;
/// Longest key that is shown in full.
const LONGEST_KEY: usize = 64;

/// A value and where it stands.
pub(crate) type Value<'d> = Spanned<DeValue<'d>>;

/// Collects problems while a document is walked.
#[derive(Debug)]
pub(crate) struct Reader<'t> {
    file: Option<&'t str>,
    lines: Lines<'t>,
    problems: Vec<(usize, Problem)>,
    unlisted: usize,
    damaged: BTreeSet<String>,
    places: BTreeMap<String, usize>,
    /// Every key that the walk asked for, indices left out.
    #[cfg(test)]
    pub(crate) asked: BTreeSet<String>,
}

impl<'t> Reader<'t> {
    pub(crate) fn new(text: &'t str, file: Option<&'t str>) -> Self {
        Self {
            file,
            lines: Lines::new(text),
            problems: Vec::new(),
            unlisted: 0,
            damaged: BTreeSet::new(),
            places: BTreeMap::new(),
            #[cfg(test)]
            asked: BTreeSet::new(),
        }
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
    pub(crate) fn report(&mut self, path: &str, message: impl Into<String>) {
        if !self.is_damaged(path) {
            self.report_at(self.place(path), path, message);
        }
    }

    /// A problem that is returned instead of collected: a warning.
    pub(crate) fn warning(&self, path: &str, message: impl Into<String>) -> Problem {
        self.problem_at(self.place(path), path, message.into())
    }

    fn problem_at(&self, offset: usize, key: &str, message: String) -> Problem {
        let (line, column) = self.lines.position(offset);
        Problem { file: self.file.map(Into::into), line, column, key: key.into(), message }
    }

    /// Marks a path: its value is a stand-in.
    pub(crate) fn damage(&mut self, path: &str) {
        self.damaged.insert(path.into());
    }

    /// Whether a path, a part of it or what it belongs to is a stand-in.
    pub(crate) fn is_damaged(&self, path: &str) -> bool {
        let within = |outer: &str, inner: &str| {
            inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        self.damaged.iter().any(|damaged| within(damaged, path) || within(path, damaged))
    }

    /// Whether the value of exactly this path is a stand-in.
    pub(crate) fn is_marked(&self, path: &str) -> bool {
        self.damaged.contains(path)
    }

    /// Line and column of every path that was walked over.
    pub(crate) fn positions(&self) -> BTreeMap<String, (usize, usize)> {
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
    pub(crate) fn into_problems(mut self) -> Option<Vec<Problem>> {
        if self.problems.is_empty() {
            return None;
        }
        self.problems.sort_by_key(|(offset, _)| *offset);
        let mut problems: Vec<_> = self.problems.into_iter().map(|(_, problem)| problem).collect();
        if self.unlisted > 0 {
            let message = format!("and {} more problems that are not listed", self.unlisted);
            problems.push(Problem {
                file: self.file.map(Into::into),
                line: 1,
                column: 1,
                key: String::new(),
                message,
            });
        }
        Some(problems)
    }

    /// Whether no further problem would be listed.
    fn is_full(&self) -> bool {
        self.problems.len() >= MAX_PROBLEMS
    }

    /// The source text of a span, shortened to what fits in a message.
    pub(crate) fn excerpt(&self, span: Range<usize>) -> String {
        self.lines.excerpt(span)
    }

    /// "is …, must be …" for a value of the wrong type or outside its limits.
    pub(crate) fn refuse(&mut self, path: &str, value: &Value<'_>, must_be: &str) {
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

/// Path of an element of an array.
pub(crate) fn element(path: &str, index: usize) -> String {
    format!("{path}[{index}]")
}

/// Path of a key in a table.
pub(crate) fn join(path: &str, key: &str) -> String {
    let bare = !key.is_empty() && key.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    let mut key: Cow<'_, str> = if bare { key.into() } else { format!("{key:?}").into() };
    if let Some((end, _)) = key.char_indices().nth(LONGEST_KEY) {
        key = format!("{}…", key.get(..end).unwrap_or_default()).into();
    }
    if path.is_empty() { key.into_owned() } else { format!("{path}.{key}") }
}

/// One table of the document and the keys it was asked for.
#[derive(Debug)]
pub(crate) struct Table<'d> {
    /// `None` for a stand-in, about which nothing is reported.
    entries: Option<&'d DeTable<'d>>,
    path: String,
    known: Vec<Cow<'static, str>>,
    span: Range<usize>,
}

impl<'d> Table<'d> {
    /// The document itself.
    pub(crate) fn root(entries: &'d DeTable<'d>) -> Self {
        Self { entries: Some(entries), path: String::new(), known: Vec::new(), span: 0..0 }
    }

    /// A value as a table, or a stand-in and a problem if it is none.
    pub(crate) fn of(reader: &mut Reader<'_>, path: String, value: &'d Value<'d>) -> Self {
        reader.note(&path, value);
        let entries = value.get_ref().as_table();
        if entries.is_none() {
            reader.refuse(&path, value, "a table");
        }
        Self { entries, path, known: Vec::new(), span: value.span() }
    }

    /// A stand-in for a table that is not there.
    pub(crate) fn stand_in(path: String) -> Self {
        Self { entries: None, path, known: Vec::new(), span: 0..0 }
    }

    /// The same table with nothing to be said about it.
    pub(crate) fn into_stand_in(self) -> Self {
        Self::stand_in(self.path)
    }

    /// Path of the table.
    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    /// Path of one of its keys.
    pub(crate) fn path_of(&self, key: &str) -> String {
        join(&self.path, key)
    }

    /// Whether a key is there, without taking it.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.entries.is_some_and(|entries| entries.contains_key(key))
    }

    /// Whether this is a stand-in.
    pub(crate) fn is_stand_in(&self) -> bool {
        self.entries.is_none()
    }

    /// Takes a key: from here on it is known.
    pub(crate) fn take(
        &mut self,
        reader: &mut Reader<'_>,
        key: impl Into<Cow<'static, str>>,
    ) -> Option<&'d Value<'d>> {
        let key = key.into();
        let value = self.entries.and_then(|entries| entries.get(key.as_ref()));
        let path = self.path_of(&key);
        #[cfg(test)]
        reader.asked.insert(without_indices(&path));
        if let Some(value) = value {
            reader.note(&path, value);
            if let DeValue::Array(array) = value.get_ref() {
                for (i, item) in array.iter().enumerate().take(MAX_PLACED_ELEMENTS) {
                    reader.note(&element(&path, i), item);
                }
            }
        }
        self.known.push(key);
        value
    }

    /// Insists on a value: `None` is reported as missing and replaced.
    pub(crate) fn need<T>(&self, reader: &mut Reader<'_>, key: &str, value: Option<T>, stand_in: T) -> T {
        value.unwrap_or_else(|| {
            self.missing(reader, key, &format!("is missing: add `{key}`"));
            stand_in
        })
    }

    /// Reports that a key is missing.
    pub(crate) fn missing(&self, reader: &mut Reader<'_>, key: &str, message: &str) {
        let path = self.path_of(key);
        if !self.is_stand_in() {
            reader.report_at(self.span.start, &path, message);
        }
        reader.damage(&path);
    }

    /// Takes a key that must not be there, and says why.
    pub(crate) fn forbid(&mut self, reader: &mut Reader<'_>, key: impl Into<Cow<'static, str>>, why: &str) {
        let key = key.into();
        let path = self.path_of(&key);
        if self.take(reader, key).is_some() {
            reader.report(&path, why);
        }
    }

    /// Reports every key that was not asked for.
    pub(crate) fn finish(self, reader: &mut Reader<'_>) {
        let known = || self.known.iter().map(AsRef::as_ref);
        for key in self.entries.into_iter().flat_map(DeTable::keys) {
            let name = key.get_ref().as_ref();
            if known().any(|known| known == name) {
                continue;
            }
            if reader.is_full() {
                reader.unlisted += 1;
                continue;
            }
            let free = known().filter(|known| !self.has(known)).collect::<Vec<_>>();
            let advice = match closest(name, free.iter().copied()) {
                Some(word) => format!("did you mean `{word}`?"),
                None if free.is_empty() => "remove it".into(),
                None => format!("remove it; not yet used here: {}", free.join(", ")),
            };
            reader.report_at(key.span().start, &self.path_of(name), format!("is not a known key: {advice}"));
        }
    }
}

/// `a[3].b` → `a.b`.
pub(crate) fn without_indices(path: &str) -> String {
    let mut depth = 0;
    path.chars()
        .filter(|c| {
            depth += i32::from(*c == '[');
            let keep = depth == 0;
            depth -= i32::from(*c == ']');
            keep
        })
        .collect()
}
