//! A line cut into cells.

use crate::mapping::Delimiter;

/// Where a cell is in its line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cell {
    /// First byte of what it holds.
    pub(super) start: usize,
    /// Byte behind it.
    pub(super) end: usize,
    /// Column in the line as written, from 1.
    pub(super) column: u32,
}

/// A quote that does not end on its line, at this index of a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct OpenQuote(pub(super) usize);

/// Cuts a line into cells, reusing `cells`. Quoted cells are unquoted in place.
pub(super) fn split(line: &mut [u8], delimiter: Delimiter, cells: &mut Vec<Cell>) -> Result<(), OpenQuote> {
    cells.clear();
    match delimiter.byte() {
        None => split_whitespace(line, cells),
        Some(character) if line.contains(&b'"') => return split_quoted(line, character, cells),
        Some(character) => {
            let mut start = 0;
            for piece in line.split(|byte| *byte == character) {
                push_trimmed(line, start, start + piece.len(), cells);
                start += piece.len() + 1;
            }
        }
    }
    Ok(())
}

/// Cuts at runs of spaces and tabs.
fn split_whitespace(line: &[u8], cells: &mut Vec<Cell>) {
    let mut start = None;
    for (index, byte) in line.iter().enumerate() {
        match (start, byte.is_ascii_whitespace()) {
            (None, false) => start = Some(index),
            (Some(first), true) => {
                cells.push(cell(first, index));
                start = None;
            }
            _ => {}
        }
    }
    if let Some(first) = start {
        cells.push(cell(first, line.len()));
    }
}

/// Cuts at a character outside quotes; `""` inside quotes is one quote.
fn split_quoted(line: &mut [u8], delimiter: u8, cells: &mut Vec<Cell>) -> Result<(), OpenQuote> {
    let (mut read, mut write) = (0, 0);
    loop {
        let (start, column) = (write, read);
        let mut quote = None;
        // What is written never overtakes what is read, so a cell can be unquoted where it stands.
        while let Some(&byte) = line.get(read) {
            if quote.is_none() && byte == delimiter {
                break;
            }
            read += 1;
            if byte == b'"' {
                let doubled = quote.is_some() && line.get(read) == Some(&b'"');
                if !doubled {
                    quote = if quote.is_some() { None } else { Some(read - 1) };
                    continue;
                }
                read += 1;
            }
            if let Some(place) = line.get_mut(write) {
                *place = byte;
            }
            write += 1;
        }
        if let Some(at) = quote {
            return Err(OpenQuote(at));
        }
        push_trimmed(line, start, write, cells);
        if let Some(last) = cells.last_mut() {
            last.column = u32::try_from(column + 1).unwrap_or(u32::MAX);
        }
        if read >= line.len() {
            return Ok(());
        }
        read += 1;
    }
}

/// Adds a cell without the spaces around it.
fn push_trimmed(line: &[u8], start: usize, end: usize, cells: &mut Vec<Cell>) {
    let text = line.get(start..end).unwrap_or_default();
    let leading = text.len() - text.trim_ascii_start().len();
    let trailing = text.len() - text.trim_ascii_end().len();
    cells.push(if leading == text.len() {
        cell(start, start)
    } else {
        cell(start + leading, end - trailing)
    });
}

/// A cell whose column is that of its first byte.
fn cell(start: usize, end: usize) -> Cell {
    Cell { start, end, column: u32::try_from(start + 1).unwrap_or(u32::MAX) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells as text with their columns.
    fn cells(line: &str, delimiter: Delimiter) -> Vec<(String, u32)> {
        let mut line = line.as_bytes().to_vec();
        let mut cells = Vec::new();
        split(&mut line, delimiter, &mut cells).unwrap();
        cells
            .iter()
            .map(|c| (String::from_utf8_lossy(&line[c.start..c.end]).into_owned(), c.column))
            .collect()
    }

    #[test]
    fn cells_and_their_columns() {
        type Case<'a> = (&'a str, Delimiter, &'a [(&'a str, u32)]);
        let table: &[Case<'_>] = &[
            ("  1 \t 22  3 ", Delimiter::Whitespace, &[("1", 3), ("22", 7), ("3", 11)]),
            ("", Delimiter::Whitespace, &[]),
            ("1,, 3 ", Delimiter::Comma, &[("1", 1), ("", 3), ("3", 5)]),
            ("1\t2\t", Delimiter::Tab, &[("1", 1), ("2", 3), ("", 5)]),
            ("\"a,b\",\"c\"\"d\",5", Delimiter::Comma, &[("a,b", 1), ("c\"d", 7), ("5", 14)]),
            ("\"\",\"x\"", Delimiter::Comma, &[("", 1), ("x", 4)]),
        ];
        for (line, delimiter, expected) in table {
            let expected: Vec<_> =
                expected.iter().map(|(text, column)| ((*text).to_owned(), *column)).collect();
            assert_eq!(cells(line, *delimiter), expected, "{line}");
        }
    }

    #[test]
    fn a_quote_must_end_on_its_line() {
        let mut line = b"1,\"2,3".to_vec();
        assert_eq!(split(&mut line, Delimiter::Comma, &mut Vec::new()), Err(OpenQuote(2)));
    }
}
