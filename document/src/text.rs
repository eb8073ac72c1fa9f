//! From bytes to the root of a TOML text: size, UTF-8, syntax, version. What is wrong here ends the matter.

use std::ops::Range;

use toml::Spanned;
use toml::de::DeTable;
use toml_parser::Source;
use toml_parser::lexer::TokenKind;

use crate::looks::{doubt, looks_like};
use crate::problem::Problem;
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
        let open = unclosed(text).filter(|_| !errors.is_empty());
        if let Some((opening, closing)) = open {
            let opened = self.excerpt(opening..opening + 1);
            let message = format!("TOML: `{opened}` is not closed: put `{closing}` where it ends");
            self.report_at(opening, "", message);
        }
        let lost = open.map(|(opening, _)| {
            let line = text.get(opening..).and_then(|rest| rest.find('\n'));
            (opening, line.map_or(text.len(), |length| opening + length))
        });
        let mut told_until = 0;
        for error in &errors {
            let span = error.span().unwrap_or(0..0);
            let number = misspelt_number(text, span.start);
            // To the parser nothing behind an open bracket makes sense; numbers in its line are wrong all the same.
            let is_lost = lost.is_some_and(|(opening, end)| {
                span.start >= opening && (number.is_none() || span.start >= end)
            });
            // It finds fault with each part of a number.
            if is_lost || span.start < told_until {
                continue;
            }
            let message = match (error.message(), number) {
                (DUPLICATE_KEY, _) => {
                    format!("TOML: {DUPLICATE_KEY} `{}`: remove one", self.excerpt(span.clone()))
                }
                (_, Some((item, advice))) => {
                    let written = text.get(item.clone()).unwrap_or_default().trim();
                    told_until = item.end;
                    format!("TOML: `{written}` {advice}")
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

/// The first bracket that is never closed, and what closes it.
fn unclosed(text: &str) -> Option<(usize, char)> {
    let mut open = Vec::new();
    for token in Source::new(text).lex() {
        let start = token.span().start();
        match (token.kind(), open.last()) {
            (TokenKind::LeftSquareBracket, _) => open.push((start, ']')),
            (TokenKind::LeftCurlyBracket, _) => open.push((start, '}')),
            (TokenKind::RightSquareBracket, Some((_, ']')))
            | (TokenKind::RightCurlyBracket, Some((_, '}'))) => {
                open.pop();
            }
            (TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket, top) => return top.copied(),
            _ => {}
        }
    }
    open.first().copied()
}

/// A number that is written as people write it, at the offset of an error: where, and what to write.
fn misspelt_number(text: &str, offset: usize) -> Option<(Range<usize>, String)> {
    let (before, after) = text.split_at_checked(offset)?;
    let length = |characters: &mut dyn Iterator<Item = char>, ends: &str| -> usize {
        characters.take(LONGEST_NUMBER).take_while(|c| !ends.contains(*c)).map(char::len_utf8).sum()
    };
    let start = offset - length(&mut before.chars().rev(), "[]{}=,#\r\n");
    let end = offset + length(&mut after.chars(), "[]{}=,#\r\n");
    let item = text.get(start..end)?.trim();
    let number = |written: &str| {
        (written.contains(|c: char| c.is_ascii_digit()) && written.parse::<f64>().is_ok())
            .then(|| written.to_owned())
    };
    if item.contains(char::is_whitespace)
        && let Some(number) = number(&item.split_whitespace().collect::<String>())
    {
        let in_list = text.get(..start).is_some_and(|before| before.ends_with(['[', ',']));
        let comma = if in_list { ", or put a comma between" } else { "" };
        return Some((start..end, format!("has blanks between its digits: write {number}{comma}")));
    }
    let prefix = |(end, _)| {
        number(item.get(..end)?).map(|number| (number, item.get(end..).unwrap_or_default().trim()))
    };
    if let Some((first, unit)) = item.char_indices().rev().find_map(prefix)
        && unit.starts_with(|c: char| c.is_alphabetic() || "°%″′\"".contains(c))
        && !unit.contains(|c: char| c.is_ascii_digit())
    {
        return Some((start..end, format!("is a number with a unit: write {first}, the key names the unit")));
    }
    let end = offset + length(&mut after.chars(), "[]{}=#\r\n");
    let with_point = number(&text.get(start..end)?.trim().replacen(',', ".", 1))?;
    after.starts_with(',').then(|| (start..end, format!("has a decimal comma: write {with_point}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_as_people_write_it_is_told_once_with_what_to_write() {
        let told = [
            "1 440",
            "12\u{202f}345.5 # pasted",
            "[1, -1\u{a0}440, 2]",
            "[-40 60 80]",
            "25,5",
            "-0,5e-3 # V",
            "25.0°C",
            "[1, 25 ppm]",
        ]
        .map(|value| {
            let text = &format!("a = 1\nb = {value}\n");
            let mut reader = Reader::new(text, Some("f"));
            assert!(reader.root(&Form { schema: serde_json::Value::Null, versions: None }).is_none());
            let problems = reader.into_problems().unwrap();
            assert_eq!(problems.len(), 1, "{problems:?}");
            problems[0].to_string()
        });
        insta::assert_snapshot!(told.join("\n"));
        assert_eq!(misspelt_number("a = b 1\n", 4), None);
    }

    #[test]
    fn a_bracket_that_is_not_closed_is_told_where_it_stands_and_nothing_of_what_follows() {
        let rest = "\n[accel]\nscale = [\n1,\n2]\n[[sensor]]\nname = \"x\"\n";
        let mut told = String::new();
        for line in
            ["b = { kind = \"a}\", c = [1, 2]", "b = [1, 2 # ]", "b = { c = [1, 2 }", "b = { c = 1 440"]
        {
            for text in
                [format!("a = 1\n{line}{rest}"), format!("a = 1\n{line}"), format!("a = =\n{line}{rest}")]
            {
                let mut reader = Reader::new(&text, Some("f"));
                assert!(reader.root(&Form { schema: serde_json::Value::Null, versions: None }).is_none());
                let problems = reader.into_problems().unwrap();
                told += &problems.iter().map(|problem| format!("{problem}\n")).collect::<String>();
            }
        }
        insta::assert_snapshot!(told);
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
