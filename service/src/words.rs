//! What commands say: words to stderr, results to stdout.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use isotherm_protocol::escape::{escaped, escaped_lines};

use crate::exit::Exit;
use crate::logging::to_stderr;

/// What begins a change of colour, and ends it: "ESC [ 1;31 m".
const COLOUR: (&str, char) = ("\u{1b}[", 'm');

/// Lines whose colours stay, and whose other control characters are shown by their codes.
pub(crate) fn coloured(text: &str) -> String {
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

/// Says a line on stderr.
pub fn say(line: impl Display) {
    to_stderr(format!("{}\n", escaped(&line.to_string())));
}

/// Says several lines on stderr.
pub(crate) fn say_lines(lines: impl Display) {
    to_stderr(format!("{}\n", escaped_lines(&lines.to_string())));
}

/// Prints a result as [`print()`] does, and goes on without it where stdout takes nothing for so long: a terminal that is
/// stopped or a full pipe must not hold up the end of a service.
#[must_use]
pub fn print_within(limit: Duration, text: String, exit: Exit) -> Exit {
    let (sender, printed) = sync_channel(1);
    let thread = std::thread::Builder::new().spawn(move || sender.send(print(&text, exit)));
    let printed = thread.ok().and_then(|_| printed.recv_timeout(limit).ok());
    printed.unwrap_or(if exit == Exit::Ok { Exit::Failed } else { exit })
}

/// Prints a result on stdout and gives the exit code: `exit`, or [`Exit::Failed`] where it cannot be written.
///
/// Colours stay; other control characters, but for line breaks and tabs, are shown by their codes.
///
/// A reader that has closed its end of the pipe, as `head` does, has what it wanted.
#[must_use]
pub fn print(text: &str, exit: Exit) -> Exit {
    let text = coloured(text);
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            say(format_args!("isotherm: cannot write to standard output: {error}"));
            if exit == Exit::Ok { Exit::Failed } else { exit }
        }
        _ => exit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_stay_and_other_control_characters_are_shown() {
        let text = "\u{1b}[1;31mred\u{1b}[0m\n\u{1b}[2Jgone\u{7}\u{202e}\u{1b}[";
        assert_eq!(coloured(text), "\u{1b}[1;31mred\u{1b}[0m\n\\u001b[2Jgone\\u0007\\u202e\\u001b[");
    }
}
