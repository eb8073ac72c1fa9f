//! From bytes to the root of a TOML text: size, UTF-8, syntax, version. What is wrong here ends the matter.

use toml::Spanned;
use toml::de::DeTable;
use toml_parser::Source;
use toml_parser::lexer::TokenKind;

use crate::looks::{doubt, looks_like};
use crate::problem::Problem;
use crate::reader::{MAX_PROBLEMS, Reader};
use crate::schema::Form;
use crate::slips::slip;

/// Longest text that is read, in bytes.
pub const MAX_BYTES: usize = 1 << 20;

/// What the TOML parser says of a key that is given twice.
const DUPLICATE_KEY: &str = "duplicate key";

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
            let slip = slip(text, span.start);
            // To the parser nothing behind an open bracket makes sense; slips in its line are wrong all the same.
            let is_lost = lost
                .is_some_and(|(opening, end)| span.start >= opening && (slip.is_none() || span.start >= end));
            // It finds fault with each part of a value.
            if is_lost || span.start < told_until {
                continue;
            }
            let message = match (error.message(), slip) {
                (DUPLICATE_KEY, _) => match header(text, span.start) {
                    Some((path, end)) => {
                        // All its keys stand there already.
                        told_until = end;
                        format!(
                            "TOML: a second table `{path}`: join the two, or write [[{path}]] for each of several"
                        )
                    }
                    None => format!("TOML: {DUPLICATE_KEY} `{}`: remove one", self.excerpt(span.clone())),
                },
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

/// The path of a table whose header stands at an offset, and where the next table begins.
fn header(text: &str, offset: usize) -> Option<(&str, usize)> {
    let (before, _) = text.split_at_checked(offset)?;
    let start = before.rfind('\n').map_or(0, |end| end + 1);
    let line = text.get(start..)?.lines().next()?;
    let header = line.trim_start().strip_prefix('[').filter(|header| !header.starts_with('['))?;
    let (path, _) = header.split_once(']')?;
    let next = text.get(offset..)?.find("\n[").map_or(text.len(), |next| offset + next);
    Some((path, next))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is wrong with the syntax of a text.
    fn problems(text: &str) -> Vec<Problem> {
        let mut reader = Reader::new(text, Some("f"));
        let _ = reader.root(&Form { schema: serde_json::Value::Null, versions: None });
        reader.into_problems().unwrap_or_default()
    }

    /// The parser finds fault with each part of it.
    #[test]
    fn a_slip_is_told_once_with_what_to_write() {
        let told = [
            "1 440",
            "12\u{202f}345.5 # pasted",
            "[1, -1\u{a0}440, 2]",
            "[-40 60 80]",
            "[0.45 0.008]",
            "25,5",
            "-0,5e-3 # V",
            "25.0°C",
            "[1, 25 ppm]",
            "−1",
            "“x”",
            "21.11.2026",
        ]
        .map(|value| {
            let text = format!("a = 1\nb = {value}\n");
            let problems = problems(&text);
            // The parser finds fault with each part of some of them.
            assert_eq!(problems.len(), 1, "{problems:?}");
            problems[0].to_string()
        });
        insta::assert_snapshot!(told.join("\n"));
    }

    #[test]
    fn a_table_that_should_be_one_of_several_is_told_once() {
        let sensor = |name: &str| format!("[gyro.sensor]\nname = \"{name}\"\nchannel = \"c\"\n");
        let text = sensor("x") + &sensor("y") + &sensor("z") + "[accel]\na = 1\na = 2\n";
        let told: String = problems(&text).iter().map(|problem| problem.to_string() + "\n").collect();
        insta::assert_snapshot!(told);
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
                told += &problems(&text).iter().map(|problem| problem.to_string() + "\n").collect::<String>();
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
