//! Walking a TOML document without stopping at the first problem.

use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};

use isotherm_protocol::document::{Problem, parse_toml};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Most errors of syntax that are listed.
const MAX_SYNTAX_ERRORS: usize = 256;

/// Collects problems while a document is walked.
#[derive(Debug)]
pub(super) struct Walk<'t> {
    text: &'t str,
    file: String,
    problems: Vec<(usize, Problem)>,
}

impl<'t> Walk<'t> {
    pub(super) fn new(text: &'t str, path: &Path) -> Self {
        Self { text, file: path.display().to_string(), problems: Vec::new() }
    }

    /// Parses the text and walks it; `None` where its syntax is wrong.
    pub(super) fn document<T>(
        &mut self,
        text: &str,
        walk: impl FnOnce(&mut Self, Table<'_>) -> T,
    ) -> Option<T> {
        let (root, errors) = parse_toml(text);
        // Each is looked up in the text; beyond these nobody reads them.
        for error in errors.iter().take(MAX_SYNTAX_ERRORS) {
            let offset = error.span().map_or(0, |span| span.start);
            self.report(offset, "", format!("TOML: {}", error.message()));
        }
        // After any other error the walk would find fault with what the author never wrote.
        let walkable = errors.iter().all(|error| error.message() == "duplicate key");
        let root = Table { entries: Some(root.get_ref()), name: "", span: 0..0, known: Vec::new() };
        walkable.then(|| walk(self, root))
    }

    /// What was read, if there was no problem.
    pub(super) fn finish<T>(mut self, read: Option<T>) -> Result<T, Vec<Problem>> {
        match read {
            Some(read) if self.problems.is_empty() => Ok(read),
            _ => {
                self.problems.sort_by_key(|(offset, _)| *offset);
                Err(self.problems.into_iter().map(|(_, problem)| problem).collect())
            }
        }
    }

    fn report(&mut self, offset: usize, key: &str, message: String) {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        let file = Some(self.file.clone());
        self.problems.push((offset, Problem { file, line, column, key: key.to_owned(), message }));
    }

    /// "is …, must be …".
    fn refuse(&mut self, key: &str, value: &Spanned<DeValue<'_>>, must_be: &str) {
        let excerpt = self.text.get(value.span()).unwrap_or_default();
        let excerpt: String = excerpt.lines().next().unwrap_or_default().chars().take(80).collect();
        self.report(value.span().start, key, format!("is {excerpt}, must be {must_be}"));
    }
}

/// A table of the document; the keys that are asked for are the ones that it may have.
#[derive(Debug)]
pub(super) struct Table<'d> {
    entries: Option<&'d DeTable<'d>>,
    name: &'static str,
    span: Range<usize>,
    known: Vec<&'static str>,
}

impl<'d> Table<'d> {
    fn path_of(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    fn take(&mut self, key: &'static str) -> Option<&'d Spanned<DeValue<'d>>> {
        self.known.push(key);
        self.entries.and_then(|entries| entries.get(key))
    }

    /// Whether a key is there, right or wrong.
    pub(super) fn has(&self, key: &str) -> bool {
        self.entries.is_some_and(|entries| entries.contains_key(key))
    }

    /// Takes a value; one that `convert` does not like is reported.
    pub(super) fn value<T>(
        &mut self,
        walk: &mut Walk<'_>,
        key: &'static str,
        must_be: &str,
        convert: impl FnOnce(&'d DeValue<'d>) -> Option<T>,
    ) -> Option<T> {
        let value = self.take(key)?;
        let converted = convert(value.get_ref());
        if converted.is_none() {
            walk.refuse(&self.path_of(key), value, must_be);
        }
        converted
    }

    pub(super) fn boolean(&mut self, walk: &mut Walk<'_>, key: &'static str) -> Option<bool> {
        self.value(walk, key, "true or false", DeValue::as_bool)
    }

    pub(super) fn integer(
        &mut self,
        walk: &mut Walk<'_>,
        key: &'static str,
        min: u32,
        max: u32,
    ) -> Option<u32> {
        self.value(walk, key, &format!("a whole number from {min} to {max}"), |value| {
            let integer = value.as_integer()?;
            let number = u32::from_str_radix(integer.as_str(), integer.radix()).ok()?;
            (min..=max).contains(&number).then_some(number)
        })
    }

    /// Takes a number; a whole one will do.
    pub(super) fn number(
        &mut self,
        walk: &mut Walk<'_>,
        key: &'static str,
        min: f64,
        max: f64,
    ) -> Option<f64> {
        self.value(walk, key, &format!("a number from {min} to {max}"), |value| {
            let number: f64 = match value {
                DeValue::Float(float) => float.as_str().parse().ok()?,
                DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok()?,
                _ => return None,
            };
            (min..=max).contains(&number).then_some(number)
        })
    }

    pub(super) fn choice<T: Copy>(
        &mut self,
        walk: &mut Walk<'_>,
        key: &'static str,
        choices: &[(&str, T)],
    ) -> Option<T> {
        let names: Vec<_> = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        self.value(walk, key, &names.join(" or "), |value| {
            let text = value.as_str()?;
            choices.iter().find(|(name, _)| *name == text).map(|(_, choice)| *choice)
        })
    }

    pub(super) fn string(&mut self, walk: &mut Walk<'_>, key: &'static str) -> Option<&'d str> {
        self.value(walk, key, "a string that is not empty", |value| {
            value.as_str().filter(|text| !text.is_empty())
        })
    }

    pub(super) fn strings(&mut self, walk: &mut Walk<'_>, key: &'static str) -> Vec<String> {
        let strings = self.value(walk, key, "a list of strings", |value| {
            value.as_array()?.iter().map(|item| item.get_ref().as_str().map(ToOwned::to_owned)).collect()
        });
        strings.unwrap_or_default()
    }

    /// Takes a path that must pass a test; relative ones count from `folder`.
    pub(super) fn path(
        &mut self,
        walk: &mut Walk<'_>,
        key: &'static str,
        folder: &Path,
        test: fn(&Path) -> bool,
        must_be: &str,
    ) -> Option<PathBuf> {
        let value = self.take(key)?;
        let path = value.get_ref().as_str().filter(|text| !text.is_empty()).map(|text| folder.join(text));
        match path {
            Some(path) if test(&path) => Some(path),
            Some(path) => {
                walk.refuse(&self.path_of(key), value, &format!("{must_be}; looked for {}", path.display()));
                None
            }
            None => {
                walk.refuse(&self.path_of(key), value, must_be);
                None
            }
        }
    }

    /// Takes a path of which nothing need exist yet; relative ones count from `folder`.
    pub(super) fn new_path(
        &mut self,
        walk: &mut Walk<'_>,
        key: &'static str,
        folder: &Path,
    ) -> Option<PathBuf> {
        self.string(walk, key).map(|text| folder.join(text))
    }

    /// Takes a table; an empty one stands in where there is none.
    pub(super) fn table(&mut self, walk: &mut Walk<'_>, key: &'static str) -> Table<'d> {
        let span = self.entries.and_then(|entries| entries.get(key)).map_or(0..0, Spanned::span);
        let entries = self.value(walk, key, "a table", |value| value.as_table());
        Table { entries, name: key, span, known: Vec::new() }
    }

    /// Reports a problem with the table as a whole.
    pub(super) fn report(&self, walk: &mut Walk<'_>, message: &dyn Display) {
        walk.report(self.span.start, self.name, message.to_string());
    }

    /// Reports every key that was not asked for.
    pub(super) fn finish(self, walk: &mut Walk<'_>) {
        for key in self.entries.into_iter().flat_map(DeTable::keys) {
            let name = key.get_ref().as_ref();
            if !self.known.contains(&name) {
                let message = format!("is not a known key; known here: {}", self.known.join(", "));
                walk.report(key.span().start, &self.path_of(name), message);
            }
        }
    }
}
