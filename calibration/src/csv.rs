//! Small tables that people write as CSV: a line that names the columns, then a row for each thing; empty lines and those that begin with
//! `#` do not count.

use std::collections::BTreeMap;
use std::str::FromStr;

use crate::report::counted;

/// One row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Row<'a> {
    line: usize,
    cells: BTreeMap<&'a str, &'a str>,
}

/// The rows of a text whose columns are among those that are known.
///
/// # Errors
/// What is wrong with which line.
pub(crate) fn rows<'a>(text: &'a str, known: &[&str]) -> Result<Vec<Row<'a>>, String> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (first, head) = lines.next().ok_or("it is empty")?;
    let head: Vec<&str> = head.split(',').map(str::trim).collect();
    if let Some(name) = head.iter().find(|name| !known.contains(name)) {
        return Err(format!("line {first}: column {name:?} is not one of {}", known.join(", ")));
    }
    let row = |(line, text): (usize, &'a str)| {
        let cells: Vec<&str> = text.split(',').map(str::trim).collect();
        if cells.len() != head.len() {
            let fields = counted(cells.len(), "field", "fields");
            return Err(format!("line {line}: {fields}, the first line has {}", head.len()));
        }
        let cells = head.iter().copied().zip(cells).filter(|(_, cell)| !cell.is_empty());
        Ok(Row { line, cells: cells.collect() })
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
