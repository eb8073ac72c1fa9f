//! From bytes to the root of a TOML text: size, UTF-8, syntax, version. What is wrong here ends the matter.

use std::ops::Range;

use toml::Spanned;
use toml::de::DeTable;

use crate::looks::{doubt, looks_like};
use crate::problem::{Lines, Problem};
use crate::reader::{MAX_PROBLEMS, Reader};
use crate::schema::Form;

/// Longest text that is read, in bytes.
pub const MAX_BYTES: usize = 1 << 20;

/// What the TOML parser says of a key that is given twice.
const DUPLICATE_KEY: &str = "duplicate key";

/// How far from an error a number with blanks is looked for (characters).
const LONGEST_NUMBER: usize = 40;

/// Length up to which a text is read in one go (bytes).
const FIRST_PART: usize = 1 << 12;

/// The root of a TOML text, and what is wrong with it.
///
/// A text with more errors than are listed is not read to its end: a megabyte of broken TOML has a million of them. What was read
/// of it up to there counts.
#[must_use]
pub fn parse_toml(text: &str) -> (Spanned<DeTable<'_>>, Vec<toml::de::Error>) {
    let mut length = FIRST_PART;
    while length < text.len() {
        // Within a line it would be an error of ours; one within an array of several lines is one of many.
        let end = (0..=length).rev().find(|end| text.is_char_boundary(*end)).unwrap_or_default();
        let part = text.get(..end).and_then(|part| part.rsplit_once('\n'));
        if let Some((part, _)) = part {
            let (root, errors) = DeTable::parse_recoverable(part);
            if errors.len() > MAX_PROBLEMS {
                return (root, errors);
            }
        }
        length *= 4;
    }
    DeTable::parse_recoverable(text)
}

/// Bytes as text.
///
/// # Errors
/// The place of the first bytes that are not UTF-8.
pub fn utf8<'b>(bytes: &'b [u8], file: Option<&str>) -> Result<&'b str, Vec<Problem>> {
    std::str::from_utf8(bytes).map_err(|error| {
        let valid = error.valid_up_to();
        let before =
            bytes.get(..valid).and_then(|before| std::str::from_utf8(before).ok()).unwrap_or_default();
        let (line, column) = Lines::new(before).position(valid);
        let message = format!("is not UTF-8 at byte {valid}: {}", doubt(bytes));
        vec![Problem { line, column, ..unplaced(file, message) }]
    })
}

/// A problem of the text as a whole.
#[must_use]
pub fn unplaced(file: Option<&str>, message: String) -> Problem {
    Problem { file: file.map(Into::into), line: 1, column: 1, key: String::new(), message }
}

impl<'t> Reader<'t> {
    /// The root table of the text; `None` where it is not worth walking, which has been reported then.
    pub(crate) fn root(&mut self, form: &Form) -> Option<Spanned<DeTable<'t>>> {
        let text = self.text();
        if text.len() > MAX_BYTES {
            self.report_at(0, "", format!("has {} bytes, may have {MAX_BYTES}", text.len()));
            return None;
        }
        let (root, errors) = parse_toml(text);
        if !errors.is_empty() && looks_like(text.as_bytes()).is_some() {
            self.report_at(0, "", format!("is no TOML: {}", doubt(text.as_bytes())));
            return None;
        }
        let mut spaced_until = 0;
        for error in &errors {
            let span = error.span().unwrap_or(0..0);
            // The parser finds fault with each part of a number with blanks.
            if span.start < spaced_until {
                continue;
            }
            let message = match (error.message(), spaced_number(text, span.start)) {
                (DUPLICATE_KEY, _) => {
                    format!("TOML: {DUPLICATE_KEY} `{}`: remove one", self.excerpt(span.clone()))
                }
                (_, Some((item, number))) => {
                    let spaced = text.get(item.clone()).unwrap_or_default().trim();
                    let comma = if text.get(..item.start).is_some_and(|before| before.ends_with(['[', ','])) {
                        ", or put a comma between"
                    } else {
                        ""
                    };
                    spaced_until = item.end;
                    format!("TOML: `{spaced}` has blanks between its digits: write {number}{comma}")
                }
                (other, None) => format!("TOML: {other}"),
            };
            self.report_at(span.start, "", message);
        }
        // After a duplicate key (the first one counts) the walk can go on; after any other error of syntax it
        // would find fault with what the author never wrote.
        let broken = errors.iter().any(|error| error.message() != DUPLICATE_KEY);
        (!broken && !self.is_foreign(root.get_ref(), form)).then_some(root)
    }

    /// Refuses a text of another version before anything else is said about its keys.
    fn is_foreign(&mut self, root: &DeTable<'_>, form: &Form) -> bool {
        let Some((key, [oldest, newest])) = form.versions else { return false };
        let Some(value) = root.get(key) else { return false };
        let version = value.get_ref().as_integer().map(|integer| integer.as_str().parse::<u32>());
        let Some(Ok(version)) = version else { return false };
        let foreign = !(oldest..=newest).contains(&version);
        if foreign {
            let known = if oldest == newest { format!("{newest}") } else { format!("{oldest} to {newest}") };
            let message = format!("is version {version}; this release reads {known}: the rest was not read");
            self.report_at(value.span().start, key, message);
        }
        foreign
    }
}

/// The number with blanks between its digits that stands at an offset: where, and as it must be written.
fn spaced_number(text: &str, offset: usize) -> Option<(Range<usize>, String)> {
    let is_part = |c: &char| !"[]{}=,#\r\n".contains(*c);
    let (before, after) = text.split_at_checked(offset)?;
    let before: usize =
        before.chars().rev().take(LONGEST_NUMBER).take_while(is_part).map(char::len_utf8).sum();
    let after: usize = after.chars().take(LONGEST_NUMBER).take_while(is_part).map(char::len_utf8).sum();
    let place = offset - before..offset + after;
    let item = text.get(place.clone())?.trim();
    let number: String = item.split_whitespace().collect();
    let is_number = number.contains(|c: char| c.is_ascii_digit()) && number.parse::<f64>().is_ok();
    (is_number && item.contains(char::is_whitespace)).then_some((place, number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_with_blanks_between_its_digits_is_told_once_with_what_to_write() {
        for (text, spaced, number) in [
            ("a = 1\nb = 1 440\n", "1 440", "1440"),
            ("a = 1\nb = 12\u{202f}345.5 # pasted\n", "12\u{202f}345.5", "12345.5"),
            ("a = 1\nb = [1, -1\u{a0}440, 2]\n", "-1\u{a0}440", "-1440, or put a comma between"),
            ("a = 1\nb = [-40 60 80]\n", "-40 60 80", "-406080, or put a comma between"),
        ] {
            let mut reader = Reader::new(text, Some("f"));
            assert!(reader.root(&Form { schema: serde_json::Value::Null, versions: None }).is_none());
            let problems = reader.into_problems().unwrap();
            let words = format!("TOML: `{spaced}` has blanks between its digits: write {number}");
            assert_eq!(problems.len(), 1, "{problems:?}");
            assert_eq!((problems[0].line, &problems[0].message), (2, &words));
        }
        assert_eq!(spaced_number("a = 1 b\n", 6), None);
    }

    /// As fast as they are listed: a service reads what anyone sends.
    #[test]
    fn a_line_of_a_million_errors_is_read_as_a_short_one() {
        let text = format!("a = [{}\n", ",".repeat(MAX_BYTES - 10));
        let mut reader = Reader::new(&text, Some("f"));
        assert!(reader.root(&Form { schema: serde_json::Value::Null, versions: None }).is_none());
        assert!(reader.into_problems().unwrap().len() <= MAX_PROBLEMS + 1);
    }

    #[test]
    fn a_text_with_more_errors_than_are_listed_is_not_read_to_its_end() {
        let broken = "=\n".repeat(MAX_BYTES / 2);
        let (_, errors) = parse_toml(&broken);
        assert!(errors.len() > MAX_PROBLEMS && errors.len() < broken.len() / 100, "{}", errors.len());
        let late = "# fine\n".repeat(20_000) + &broken;
        let (_, errors) = parse_toml(&late);
        assert!(errors.len() < broken.len() / 2, "{}", errors.len());
    }

    #[test]
    fn a_long_text_is_read_whole() {
        // Its one array does not end within the first part.
        let text = format!("a = [\n{}]\nb = 2\n", "1,\n".repeat(200_000));
        let (root, errors) = parse_toml(&text);
        assert!(errors.is_empty() && root.get_ref().contains_key("b"), "{errors:?}");
        let late = text + "=\n";
        assert!((1..MAX_PROBLEMS).contains(&parse_toml(&late).1.len()));
    }
}
