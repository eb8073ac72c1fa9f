//! Results on stdout.

use std::io::{self, ErrorKind, Write};
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use isotherm_document::escape::{escaped, escaped_lines};
use serde::Serialize;

use crate::exit::Exit;
use crate::stderr::failed;

/// What begins a change of colour, and ends it: "ESC [ 1;31 m".
const COLOUR: (&str, char) = ("\u{1b}[", 'm');

/// Lines whose colours stay, and whose other control characters are shown by their codes.
#[must_use]
pub fn coloured(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(COLOUR.0) {
        shown.push_str(&escaped_lines(before));
        let colour = after.split_once(COLOUR.1);
        let colour = colour.filter(|(code, _)| code.chars().all(|c| c.is_ascii_digit() || c == ';'));
        if let Some((code, behind)) = colour {
            shown.extend([COLOUR.0, code, "m"]);
            rest = behind;
        } else {
            shown.push_str(&escaped(COLOUR.0));
            rest = after;
        }
    }
    shown.push_str(&escaped_lines(rest));
    shown
}

/// A number of things in full, thousands set apart.
#[must_use]
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Writes to stdout. A reader that has closed its end of the pipe, as `head` does, has what it wanted.
///
/// # Errors
/// Where stdout cannot be written.
pub fn to_stdout(bytes: &[u8]) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// A result as JSON, indented.
#[must_use]
pub fn json(result: &impl Serialize) -> String {
    // Results are plain structures of numbers and texts, which always serialise.
    serde_json::to_string_pretty(result).unwrap_or_default() + "\n"
}

/// Prints a result on stdout and gives the exit code: `exit`, or [`Exit::Failed`] where it cannot be written.
///
/// Colours stay; other control characters, but for line breaks and tabs, are shown by their codes.
#[must_use]
pub fn print(text: &str, exit: Exit) -> Exit {
    match to_stdout(coloured(text).as_bytes()) {
        Ok(()) => exit,
        Err(error) => failed(format_args!("cannot write to standard output: {error}"), exit.or_failed()),
    }
}

/// Prints a result as [`print()`] does, and goes on without it where stdout takes nothing for so long: a terminal that is
/// stopped or a full pipe must not hold up the end of a service.
#[must_use]
pub fn print_within(limit: Duration, text: String, exit: Exit) -> Exit {
    let (sender, printed) = sync_channel(1);
    let thread = std::thread::Builder::new().spawn(move || sender.send(print(&text, exit)));
    let printed = thread.ok().and_then(|_| printed.recv_timeout(limit).ok());
    printed.unwrap_or(exit.or_failed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_stay_and_other_control_characters_are_shown() {
        let text = "\u{1b}[1;31mred\u{1b}[0m\n\u{1b}[2Jgone\u{7}\u{202e}\u{1b}[";
        assert_eq!(coloured(text), "\u{1b}[1;31mred\u{1b}[0m\n\\u001b[2Jgone\\u0007\\u202e\\u001b[");
    }

    #[test]
    fn thousands_stand_apart() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1 000", "1 234 567"]);
    }
}
