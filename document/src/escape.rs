//! Text of others shown to people: file names, notes, serials, what a document says.
//!
//! A line break in a file name would forge a line of the log, an escape sequence would paint the operator's screen, and a
//! character that turns the direction of writing would show a name that is another one. All of them are shown by their
//! code instead, in the spelling of JSON, so that a line of JSON stays what it was.

use std::borrow::Cow;
use std::fmt::{Display, Write};

/// A text on one line: line breaks, control characters and marks of direction are shown by their codes.
#[must_use]
pub fn escaped(text: &str) -> Cow<'_, str> {
    replaced(text, is_unfit)
}

/// A text of several lines: as [`escaped`], but line breaks and tabs stay.
#[must_use]
pub fn escaped_lines(text: &str) -> Cow<'_, str> {
    replaced(text, |c| is_unfit(c) && !matches!(c, '\n' | '\t'))
}

/// A text on one line of at most so many characters: of a longer one the beginning and an ellipsis.
#[must_use]
pub fn clipped(text: &str, longest: usize) -> String {
    // Each character of a text becomes at least one.
    let end = text.char_indices().nth(longest).map_or(text.len(), |(end, _)| end);
    let shown = escaped(text.get(..end).unwrap_or_default());
    if end == text.len() && shown.chars().nth(longest).is_none() {
        return shown.into_owned();
    }
    shown.chars().take(longest.saturating_sub(1)).chain(['…']).collect()
}

/// What something says of itself, [`escaped`].
#[must_use]
pub fn shown(of: &impl Display) -> String {
    escaped(&of.to_string()).into_owned()
}

/// Whether a character is no part of a line of text.
#[must_use]
pub fn is_unfit(c: char) -> bool {
    let breaks = matches!(c, '\u{2028}' | '\u{2029}');
    // Marks, embeddings, overrides and isolates of the direction of writing (Unicode annex 9).
    let turns =
        matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control() || breaks || turns
}

fn replaced(text: &str, unfit: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&unfit) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match c {
            c if !unfit(c) => shown.push(c),
            '\n' => shown.push_str("\\n"),
            '\r' => shown.push_str("\\r"),
            '\t' => shown.push_str("\\t"),
            // All of them lie in the first plane. Writing to a string cannot fail.
            c => drop(write!(shown, "\\u{:04x}", u32::from(c))),
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_ends_in_an_ellipsis() {
        for (text, longest, clipped_text) in [
            ("abc", 3, "abc"),
            ("abcd", 3, "ab…"),
            ("ééé", 3, "ééé"),
            ("é\né", 3, "é\\…"),
            ("\n", 2, "\\n"),
            ("", 0, ""),
        ] {
            assert_eq!(clipped(text, longest), clipped_text);
        }
    }

    #[test]
    fn what_would_forge_a_line_or_turn_a_name_round_is_shown_by_its_code() {
        assert_eq!(
            escaped("a\nb\t\u{1b}[2J\u{202e}c\u{2066}\u{85}"),
            "a\\nb\\t\\u001b[2J\\u202ec\\u2066\\u0085"
        );
        assert_eq!(escaped_lines("a\n\tb\r\u{202c}"), "a\n\tb\\r\\u202c");
        assert_eq!(shown(&"x\ny"), "x\\ny");
        assert!(matches!(escaped("Größe 25 °C, 温度, עברית"), Cow::Borrowed(_)));
        let json = serde_json::to_string("a\u{202e}\u{2028}").unwrap();
        assert_eq!(serde_json::from_str::<String>(&escaped(&json)).unwrap(), "a\u{202e}\u{2028}");
    }
}
