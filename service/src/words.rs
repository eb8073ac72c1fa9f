//! What commands say: words to stderr, results to stdout.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

use crate::exit::Exit;

/// Says a line on stderr; where stderr is gone or full, the exit code tells the rest.
pub(crate) fn say(line: impl Display) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Prints a result on stdout and gives the exit code: `exit`, or [`Exit::Failed`] where it cannot be written.
///
/// A reader that has closed its end of the pipe, as `head` does, has what it wanted.
pub(crate) fn print(text: &str, exit: Exit) -> Exit {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            say(format_args!("isotherm: cannot write to standard output: {error}"));
            if exit == Exit::Ok { Exit::Failed } else { exit }
        }
        _ => exit,
    }
}
