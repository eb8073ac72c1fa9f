//! Small tables that people write as TOML, or as CSV: a line that names the columns, then a row for each thing; empty lines and those that
//! begin with `#` do not count.

use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

use isotherm_document::{listed, parse};
use isotherm_log::file::read_small_text;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use crate::error::Error;
use crate::report::counted;

/// One row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Row<'a> {
    line: usize,
    cells: BTreeMap<&'a str, &'a str>,
}

/// What a file has: CSV where its name ends so, else TOML. `action` is what could not be done, such as "read the plan", and `hint` goes
/// behind what is wrong.
///
/// # Errors
/// [`Error::Log`] where it cannot be read, [`Error::Usage`] with what is wrong in it.
pub(crate) fn read<T: DeserializeOwned + JsonSchema>(
    path: &Path,
    (action, hint): (&'static str, &str),
    of_csv: impl FnOnce(&str) -> Result<T, String>,
) -> Result<T, Error> {
    let text = read_small_text(path, action)?;
    let name = path.display().to_string();
    let is_csv = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    let found = if is_csv {
        of_csv(&text).map_err(|what| format!("{name}: {what}"))
    } else {
        parse(&text, &name).map_err(|problems| listed(&problems))
    };
    found.map_err(|what| Error::Usage(format!("{what}{hint}")))
}

/// What the rows of a text make, whose columns are among those that are known.
///
/// # Errors
/// What is wrong with which line.
pub(crate) fn rows<'a, T>(
    text: &'a str,
    known: &[&str],
    made: impl Fn(Row<'a>) -> Result<T, String>,
) -> Result<Vec<T>, String> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (first, head) = lines.next().ok_or("it is empty")?;
    let head: Vec<&str> = head.split(',').map(str::trim).collect();
    if let Some(name) = head.iter().find(|name| !known.contains(name)) {
        return Err(format!("line {first}: column {name:?} is not one of {}", known.join(", ")));
    }
    if let Some(name) =
        head.iter().enumerate().find_map(|(at, name)| head[..at].iter().find(|other| *other == name))
    {
        return Err(format!("line {first}: column {name:?} is given twice"));
    }
    let row = |(line, text): (usize, &'a str)| {
        let cells: Vec<&str> = text.split(',').map(str::trim).collect();
        if cells.len() != head.len() {
            let fields = counted(cells.len(), "field", "fields");
            return Err(format!("line {line}: {fields}, the first line has {}", head.len()));
        }
        let cells = head.iter().copied().zip(cells).filter(|(_, cell)| !cell.is_empty());
        made(Row { line, cells: cells.collect() })
    };
    lines.map(row).collect()
}

impl Row<'_> {
    /// The value of a column, where the row has one.
    ///
    /// # Errors
    /// That it is none.
    pub(crate) fn get<T: FromStr>(&self, name: &str) -> Result<Option<T>, String> {
        let number = |cell: &&str| {
            cell.parse().map_err(|_| format!("line {}: {name} is {cell:?}, not a number", self.line))
        };
        self.cells.get(name).map(number).transpose()
    }

    /// The value of a column that every row must have.
    ///
    /// # Errors
    /// That it is none, or missing.
    pub(crate) fn need<T: FromStr>(&self, name: &str) -> Result<T, String> {
        self.get(name)?.ok_or_else(|| format!("line {}: {name} is missing", self.line))
    }

    /// What is wrong with it, with its line.
    pub(crate) fn wrong(&self, what: &str) -> String {
        format!("line {}: {what}", self.line)
    }
}
