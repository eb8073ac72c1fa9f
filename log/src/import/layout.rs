//! How the bytes of a log become rows and cells.

use std::io::{ErrorKind, Read};
use std::path::Path;
use std::sync::Arc;

use super::units::is_unit;
use super::{Hints, refuse};
use crate::error::Error;
use crate::mapping::{Delimiter, Encoding, TimeUnit};
use crate::text::{is_date, open_decoded, open_raw, parse_float, split_cells, stamp_ns};

/// Bytes by which an encoding is told.
const SAMPLE_BYTES: u64 = 1 << 18;
/// Lines by which a layout is told.
const SAMPLE_LINES: usize = 600;
/// Most rows of other figures in front of the data.
const MOST_ODD: usize = 10;
/// Prefixes of lines that are no data.
const COMMENTS: [&str; 5] = ["//", "#", "%", ";", "!"];
/// Delimiters in the order in which they are preferred.
const DELIMITERS: [Delimiter; 5] =
    [Delimiter::Tab, Delimiter::Semicolon, Delimiter::Comma, Delimiter::Pipe, Delimiter::Whitespace];

/// What was found of a file's form.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) encoding: Encoding,
    pub(super) delimiter: Delimiter,
    pub(super) decimal_mark: u8,
    pub(super) comment: Option<&'static str>,
    pub(super) skip_lines: usize,
    /// Names of the columns as they stand in the header; `None` without one.
    pub(super) header: Option<Vec<String>>,
    /// The mapping can name columns by the header.
    pub(super) by_name: bool,
    /// Cells of a row of units below the header.
    pub(super) units: Vec<String>,
    pub(super) drop_rows: usize,
    /// Rows of other figures before the data.
    pub(super) odd: usize,
    pub(super) width: usize,
    /// Columns of the date and of the time of day, where they are two.
    pub(super) date_and_time: Option<(usize, usize)>,
    /// Lines before the data, for what they say of rates.
    pub(super) preamble: Vec<String>,
    /// First rows of data.
    pub(super) rows: Vec<String>,
}

/// Cells of a line.
pub(super) fn cells(line: &str, delimiter: Delimiter) -> Vec<String> {
    split_cells(line, delimiter).unwrap_or_default()
}

/// Finds the form of a file.
pub(super) fn find(path: &Path, hints: &Hints) -> Result<Found, Error> {
    let encoding = match hints.encoding {
        Some(encoding) => encoding,
        None => encoding_of(&sample(path)?),
    };
    let lines = first_lines(path, encoding)?;
    if lines.first().is_some_and(|line| line.starts_with("#RAWIMU") || line.starts_with("%RAWIMU")) {
        return Err(refuse(
            path,
            "is a NovAtel ASCII log, whose last cell carries a checksum: convert it to CSV first (NovAtel Convert, `RAWIMU` to ASCII columns)",
        ));
    }
    let delimiters = hints.delimiter.map_or(DELIMITERS.to_vec(), |delimiter| vec![delimiter]);
    let marks = match hints.decimal_mark {
        Some(',') => vec![b','],
        Some(_) => vec![b'.'],
        None => vec![b'.', b','],
    };
    let both = delimiters.into_iter().flat_map(|split| marks.iter().map(move |mark| (split, *mark)));
    let apart = both.filter(|(delimiter, mark)| delimiter.byte() != Some(*mark));
    let best = apart.filter_map(|(delimiter, mark)| block(&lines, delimiter, mark)).reduce(better);
    let (_, mut block) = best.ok_or_else(|| {
        refuse(path, format!("no rows of numbers in the first {} lines: is it a text log?", lines.len()))
    })?;
    block.start = beginning(path, &lines, block)?;
    Ok(dressed(&lines, block, encoding))
}

/// How well a delimiter and a decimal mark explain the lines: rows, then share of cells that are numbers (in thousandths).
type Score = (usize, usize);

/// The longest run of rows of numbers.
#[derive(Debug, Clone, Copy)]
struct Block {
    delimiter: Delimiter,
    mark: u8,
    start: usize,
    width: usize,
}

/// The better of two, the first where they are as good.
fn better(first: (Score, Block), second: (Score, Block)) -> (Score, Block) {
    if second.0 > first.0 { second } else { first }
}

/// The longest run of lines that are rows of numbers of one width.
fn block(lines: &[String], delimiter: Delimiter, mark: u8) -> Option<(Score, Block)> {
    // Where a run begins, its width, its rows, and the sum of their shares of numbers.
    let mut runs: Vec<(usize, usize, usize, usize)> = Vec::new();
    let mut goes_on = false;
    for (index, line) in lines.iter().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        match numeric(line, delimiter, mark) {
            Some((width, share)) => {
                match runs.last_mut().filter(|(_, of_run, ..)| goes_on && *of_run == width) {
                    Some((.., rows, sum)) => (*rows, *sum) = (*rows + 1, *sum + share),
                    None => runs.push((index, width, 1, share)),
                }
                goes_on = true;
            }
            // A comment between rows ends no run.
            None if comments(delimiter).any(|prefix| line.trim_start().starts_with(prefix)) => {}
            None => goes_on = false,
        }
    }
    let scored = runs
        .into_iter()
        .map(|(start, width, rows, sum)| ((rows, sum / rows), Block { delimiter, mark, start, width }));
    scored.reduce(better)
}

/// Width of a row of numbers, and the share of its filled cells that are numbers (in thousandths); `None` for another line.
fn numeric(line: &str, delimiter: Delimiter, mark: u8) -> Option<(usize, usize)> {
    let cells = cells(line, delimiter);
    let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
    let is_stamp = |cell: &str| {
        let units = [TimeUnit::DateTime, TimeUnit::DayFirst, TimeUnit::MonthFirst, TimeUnit::TimeOfDay];
        cell.contains(':') && units.into_iter().any(|unit| stamp_ns(cell.as_bytes(), unit).is_some())
    };
    let is_number = |cell: &&String| parse_float(cell, mark).is_some() || is_date(cell) || is_stamp(cell);
    let numbers = cells.iter().filter(is_number).count();
    (numbers >= 2 && numbers * 2 > filled).then(|| (cells.len(), numbers * 1000 / filled))
}

/// Index of the first line of the table that a run of rows belongs to: a header that is repeated, or a row that is odd, parts runs and
/// not tables. Rows that would be lost in front of it are refused.
fn beginning(path: &Path, lines: &[String], block: Block) -> Result<usize, Error> {
    let Block { delimiter, mark, start, width } = block;
    let (before, behind) = lines.split_at(start);
    let is_comment = |line: &str| comments(delimiter).any(|prefix| line.trim_start().starts_with(prefix));
    let is_row = |line: &str| numeric(line, delimiter, mark).is_some_and(|(of_row, _)| of_row == width);
    let named = |line: &str| cells(line, delimiter).first().is_some_and(|first| is_word(first, mark));
    // What lines in front state begins with its name.
    let may_be_named = behind.iter().any(|line| is_row(line) && named(line));
    let is_of_table = |line: &str| is_row(line) && (may_be_named || !named(line));
    let is_header = |line: &&String| {
        let cells = cells(line, delimiter);
        let has_numbers = cells.iter().any(|cell| parse_float(cell, mark).is_some());
        cells.len().abs_diff(width) <= 1 && is_wordy(&cells, mark) && !has_numbers
    };
    // A table goes on behind its own header only.
    let goes_on = |index: usize| {
        let (above, below) = before.split_at(index);
        below.iter().filter(is_header).all(|header| above.contains(header))
    };
    let rows = before.iter().enumerate().filter(|(_, line)| !is_comment(line));
    let rows: Vec<_> = rows.filter(|(_, line)| numeric(line, delimiter, mark).is_some()).collect();
    let first = rows.iter().find(|(index, line)| is_of_table(line) && goes_on(*index));
    let first = first.map_or(start, |(index, _)| *index);
    let left: Vec<_> = rows.into_iter().filter(|(index, _)| *index < first).collect();
    // One row like those of the table may number the columns; a few others say something of the log.
    let too_many = left.len() > MOST_ODD || left.iter().filter(|(_, line)| is_of_table(line)).count() > 1;
    match left.last() {
        Some((last, _)) if too_many => Err(refuse(
            path,
            format!(
                "{} rows of numbers would be lost before line {}, where another table begins: make two logs, or delete that line",
                left.len(),
                last + 2
            ),
        )),
        _ => Ok(first),
    }
}

/// Whether a cell is neither empty nor a number.
fn is_word(cell: &str, mark: u8) -> bool {
    cell.chars().any(char::is_alphabetic) && parse_float(cell, mark).is_none()
}

/// Whether most cells of a line are words.
fn is_wordy(cells: &[String], mark: u8) -> bool {
    cells.len() >= 2 && cells.iter().filter(|cell| is_word(cell, mark)).count() * 2 > cells.len()
}

/// Adds what stands before the rows.
fn dressed(lines: &[String], block: Block, encoding: Encoding) -> Found {
    let Block { delimiter, mark, start, width } = block;
    let before: Vec<&String> = lines.iter().take(start).filter(|line| !line.trim().is_empty()).collect();
    let wordy = |cells: &[String]| is_wordy(cells, mark);
    let mut units = Vec::new();
    let mut header_at = before.len().checked_sub(1);
    if let Some(at) = header_at {
        let last = cells(before[at], delimiter);
        let bracketed = |cell: &String| cell.is_empty() || cell == "-" || cell.starts_with(['(', '[']);
        let in_brackets = last.iter().all(bracketed) && last.iter().any(|cell| cell.len() > 2);
        let filled = last.iter().filter(|cell| !cell.is_empty()).count();
        let bare = last.iter().filter(|cell| is_unit(cell)).count();
        let below_names = at.checked_sub(1).is_some_and(|above| wordy(&cells(before[above], delimiter)));
        if last.len().abs_diff(width) <= 1 && (in_brackets || below_names && bare >= 3 && bare * 2 > filled) {
            units = last;
            header_at = at.checked_sub(1);
        }
    }
    let header_at = header_at.filter(|at| {
        let names = cells(before[*at], delimiter);
        names.len().abs_diff(width) <= 1 && wordy(&names)
    });
    let drop_rows = usize::from(!units.is_empty());
    let preamble: Vec<String> =
        before.iter().take(header_at.unwrap_or(before.len())).map(|line| (*line).clone()).collect();
    let header_line = header_at.map(|at| before[at].clone());
    let comment = comment(lines, header_line.as_deref(), delimiter);
    let skipped = |upto: usize| {
        let is_comment = |line: &str| comment.is_some_and(|prefix| line.trim_start().starts_with(prefix));
        before.iter().take(upto).filter(|line| !is_comment(line)).count()
    };
    let header = header_line.map(|line| cells(&line, delimiter));
    // The reader wants as many names as cells, each once.
    let by_name = header.as_ref().is_some_and(|names| {
        let mut sorted: Vec<_> = names.iter().filter(|name| !name.is_empty()).collect();
        sorted.sort();
        sorted.windows(2).all(|pair| pair[0] != pair[1]) && names.len() == width
    });
    let skip_lines = match header_at {
        Some(at) if by_name => skipped(at),
        // By numbers: the header is one of the lines in front.
        Some(_) => skipped(before.len()) - drop_rows,
        None => skipped(before.len()),
    };
    let mut rows: Vec<String> =
        lines.iter().skip(start).filter(|line| !line.trim().is_empty()).cloned().collect();
    let odd = if header_at.is_none() { odd_rows(&rows, delimiter, mark) } else { 0 };
    rows.drain(..odd);
    let date_and_time = date_and_time(&rows, block, comment);
    Found {
        encoding,
        delimiter,
        decimal_mark: mark,
        comment,
        skip_lines: skip_lines + odd,
        header,
        by_name,
        units,
        drop_rows,
        odd,
        width,
        date_and_time,
        preamble,
        rows,
    }
}

/// Columns of dates and of times of day, where each row has both.
fn date_and_time(rows: &[String], block: Block, comment: Option<&str>) -> Option<(usize, usize)> {
    let Block { delimiter, mark, width, .. } = block;
    // The last line may be cut.
    let whole = rows.split_last().map_or(rows, |(_, before)| before).iter();
    let data = whole.filter(|row| !comment.is_some_and(|prefix| row.trim_start().starts_with(prefix)));
    let of_width =
        data.filter(|row| numeric(row, delimiter, mark).is_some_and(|(of_row, _)| of_row == width));
    let rows: Vec<_> = of_width.map(|row| cells(row, delimiter)).collect();
    let column = |is: &dyn Fn(&String) -> bool| {
        (0..rows.first()?.len()).find(|index| rows.iter().all(|row| row.get(*index).is_some_and(is)))
    };
    let is_time = |cell: &String| stamp_ns(cell.as_bytes(), TimeUnit::TimeOfDay).is_some();
    column(&|cell| is_date(cell)).zip(column(&is_time))
}

/// Rows of other figures in front of the data: their last is the last of the first rows with a fraction in a column of whole numbers.
fn odd_rows(rows: &[String], delimiter: Delimiter, mark: u8) -> usize {
    if rows.len() < 4 * MOST_ODD {
        return 0;
    }
    let whole = |row: &String| -> Vec<bool> {
        let is_whole = |cell: &String| {
            parse_float(cell, mark)
                .is_none_or(|number| number.fract() == 0.0 && !cell.contains(char::from(mark)))
        };
        cells(row, delimiter).iter().map(is_whole).collect()
    };
    let (front, data) = rows.split_at(MOST_ODD);
    let mut of_data = vec![true; data.first().map_or(0, |row| whole(row).len())];
    for row in data {
        of_data.iter_mut().zip(whole(row)).for_each(|(all, this)| *all &= this);
    }
    let odd = |row: &String| whole(row).iter().zip(&of_data).any(|(this, all)| *all && !this);
    front.iter().rposition(odd).map_or(0, |last| last + 1)
}

/// Prefixes that comments may have: a line that begins with the delimiter is a row whose first cell is empty.
fn comments(delimiter: Delimiter) -> impl Iterator<Item = &'static str> {
    let splits = move |prefix: &str| delimiter.byte().is_some_and(|byte| prefix.as_bytes() == [byte]);
    COMMENTS.into_iter().filter(move |prefix| !splits(prefix))
}

/// The prefix of lines that are passed over: one that a line other than the header has, and the header has not.
fn comment(lines: &[String], header: Option<&str>, delimiter: Delimiter) -> Option<&'static str> {
    comments(delimiter).find(|prefix| {
        lines.iter().any(|line| line.trim_start().starts_with(prefix))
            && !header.is_some_and(|header| header.trim_start().starts_with(prefix))
    })
}

/// The first bytes of a file, decompressed.
fn sample(path: &Path) -> Result<Vec<u8>, Error> {
    let (source, _) = open_raw(path, &Arc::default())?;
    let mut bytes = Vec::new();
    match source.take(SAMPLE_BYTES).read_to_end(&mut bytes) {
        Err(error) if error.kind() != ErrorKind::UnexpectedEof => {
            Err(Error::file(path, "read the log", error))
        }
        _ => Ok(bytes),
    }
}

/// The encoding by its mark; without one, UTF-16 by the zero bytes of Latin letters, UTF-8 where it is valid, else Latin-1.
fn encoding_of(bytes: &[u8]) -> Encoding {
    let zeros = |odd: usize| bytes.iter().skip(odd).step_by(2).filter(|byte| **byte == 0).count();
    let most = bytes.len() / 4;
    match bytes {
        [0xff, 0xfe, ..] => Encoding::Utf16Le,
        [0xfe, 0xff, ..] => Encoding::Utf16Be,
        _ if bytes.len() > 8 && zeros(1) > most && zeros(0) == 0 => Encoding::Utf16Le,
        _ if bytes.len() > 8 && zeros(0) > most && zeros(1) == 0 => Encoding::Utf16Be,
        // A character that the sample cuts is in order.
        _ if std::str::from_utf8(bytes).map_or_else(|error| error.error_len().is_none(), |_| true) => {
            Encoding::Utf8
        }
        _ => Encoding::Latin1,
    }
}

/// The first lines, without their ends.
fn first_lines(path: &Path, encoding: Encoding) -> Result<Vec<String>, Error> {
    let mut lines = open_decoded(path, encoding)?;
    let mut first = Vec::new();
    while first.len() < SAMPLE_LINES {
        match lines.next_line().map_err(|error| Error::file(path, "read the log", error))? {
            Some(line) => first.push(line),
            None => break,
        }
    }
    Ok(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings_are_told_by_mark_zeros_and_validity() {
        let wide = |text: &str, big: bool| -> Vec<u8> {
            text.encode_utf16()
                .flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() })
                .collect()
        };
        for (bytes, expected) in [
            (b"\xef\xbb\xbfa,b".to_vec(), Encoding::Utf8),
            ("Temp [°C]".as_bytes().to_vec(), Encoding::Utf8),
            ("Temp [°C]".as_bytes()[..7].to_vec(), Encoding::Utf8),
            (b"Temp [\xb0C]".to_vec(), Encoding::Latin1),
            (wide("\u{feff}time,gx", false), Encoding::Utf16Le),
            (wide("\u{feff}time,gx", true), Encoding::Utf16Be),
            (wide("time,gx,gy,gz", false), Encoding::Utf16Le),
            (wide("time,gx,gy,gz", true), Encoding::Utf16Be),
        ] {
            assert_eq!(encoding_of(&bytes), expected, "{bytes:?}");
        }
    }
}
