//! What is wrong with a document, and where.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::escape::escaped;

/// Most names that a sentence has.
const FEW: usize = 8;

/// One thing that is wrong with (or doubtful about) a document.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// Name of the file, where the caller gave one.
    pub file: Option<String>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Dotted path with indices from 0, such as `gyro.sensor[1].static_bias.range_deg_c`; empty where the
    /// document as a whole is meant.
    pub key: String,
    /// The value, the limit and what to do.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}:", escaped(file))?;
        }
        write!(f, "{}:{}: ", self.line, self.column)?;
        if !self.key.is_empty() {
            write!(f, "{}: ", escaped(&self.key))?;
        }
        f.write_str(&escaped(&self.message))
    }
}

impl std::error::Error for Problem {}

/// Problems, a line each.
#[must_use]
pub fn listed(problems: &[Problem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// Names for a sentence: the first of them where they are many.
#[must_use]
pub fn few<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let names: Vec<_> = names.into_iter().collect();
    let first: Vec<_> = names.iter().take(FEW).map(AsRef::as_ref).collect();
    match names.len() {
        0 => "none".to_owned(),
        all if all > FEW => format!("{} and {} more", first.join(", "), all - FEW),
        _ => first.join(", "),
    }
}

/// Byte offset → line and column.
#[derive(Debug, Default)]
pub(crate) struct Lines<'t> {
    pub(crate) text: &'t str,
    /// Offset of the first byte of each line.
    starts: Vec<usize>,
}

impl<'t> Lines<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        Self { text, starts: std::iter::once(0).chain(breaks).collect() }
    }

    /// Line and column, both from 1; an offset beyond the end is taken for the end.
    pub(crate) fn position(&self, offset: usize) -> (usize, usize) {
        let mut offset = offset.min(self.text.len());
        while !self.text.is_char_boundary(offset) {
            offset -= 1;
        }
        let line = self.starts.partition_point(|start| *start <= offset);
        let start = self.starts.get(line.saturating_sub(1)).copied().unwrap_or(0);
        let column = self.text.get(start..offset).map_or(0, |before| before.chars().count());
        (line, column + 1)
    }

    /// The source text of a span, shortened to what fits in a message.
    pub(crate) fn excerpt(&self, span: std::ops::Range<usize>) -> String {
        const LONGEST: usize = 40;
        let text = self.text.get(span).unwrap_or_default();
        let line = text.lines().next().unwrap_or_default();
        let mut shown: String = line.chars().take(LONGEST).collect();
        if shown.len() < text.len() {
            shown.push('…');
        }
        shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_become_lines_and_columns_in_characters() {
        let lines = Lines::new("é = 1\r\nb = 2\n");
        for (offset, expected) in
            [(0, (1, 1)), (1, (1, 1)), (2, (1, 2)), (8, (2, 1)), (14, (3, 1)), (99, (3, 1))]
        {
            assert_eq!(lines.position(offset), expected, "{offset}");
        }
    }
}
