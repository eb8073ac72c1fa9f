//! Colours and what they mean. Each of them repeats what a mark or a word says, so that nothing is lost without them.

use std::fmt::Write;

use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;

/// As the terminal writes.
pub const PLAIN: Style = Style::new();
/// Heads of tables, titles.
pub const HEAD: Style = Style::new().add_modifier(Modifier::BOLD);
/// Of no weight at present: standby, gone, zero.
pub const DIM: Style = Style::new().add_modifier(Modifier::DIM);
/// As it should be.
pub const GOOD: Style = Style::new().fg(Color::Green);
/// Outside the range, stale, no calibration.
pub const WARNING: Style = Style::new().fg(Color::Yellow);
/// Fault.
pub const FAULT: Style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);

/// Lines as text, with the terminal's codes for colours or without.
///
/// Control characters are left out: what others wrote into a status must not reach the terminal as a command.
#[must_use]
pub fn text(lines: &[Line<'_>], colours: bool) -> String {
    let mut text = String::new();
    for line in lines {
        let start = text.len();
        for span in line {
            let style = line.style.patch(span.style);
            let codes = if colours { codes(style) } else { String::new() };
            let words: String = span.content.chars().filter(|c| !c.is_control()).collect();
            // Writing to a string cannot fail.
            let _ = if codes.is_empty() {
                write!(text, "{words}")
            } else {
                write!(text, "\x1b[{codes}m{words}\x1b[0m")
            };
        }
        let end = text.get(start..).map_or(0, |line| line.trim_end().len());
        text.truncate(start + end);
        text.push('\n');
    }
    text
}

/// The parameters of "select graphic rendition" for the styles above.
fn codes(style: Style) -> String {
    let colour = match style.fg {
        Some(Color::Green) => Some("32"),
        Some(Color::Yellow) => Some("33"),
        Some(Color::Red) => Some("31"),
        _ => None,
    };
    let bold = style.add_modifier.contains(Modifier::BOLD).then_some("1");
    let dim = style.add_modifier.contains(Modifier::DIM).then_some("2");
    [bold, dim, colour].into_iter().flatten().collect::<Vec<_>>().join(";")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_colours_there_are_only_words() {
        let line = Line::from_iter([
            ratatui::text::Span::styled("bad\x1b[2J\n", FAULT),
            ratatui::text::Span::raw(" good   "),
        ]);
        assert_eq!(text(std::slice::from_ref(&line), false), "bad[2J good\n");
        assert_eq!(text(&[line], true), "\x1b[1;31mbad[2J\x1b[0m good\n");
    }
}
