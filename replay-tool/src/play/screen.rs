//! The line that shows where playing is.

use std::io::{Write, stderr};

use isotherm_cli::{Bar, say_lines};

use crate::keyboard::KEYS;

/// The progress bar, and what is said beside it.
pub(crate) struct Screen {
    bar: Bar,
    /// The terminal does not go to a line's beginning by itself.
    raw: bool,
}

impl Screen {
    /// With the keys, where somebody is at the keyboard.
    pub(crate) fn new(keyboard: bool) -> Self {
        let screen = Self { bar: Bar::over_share(), raw: keyboard };
        if keyboard {
            screen.line(KEYS);
        }
        screen
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        self.bar.finish();
    }

    /// Prints a line above the bar.
    fn line(&self, words: &str) {
        let end = if self.raw { "\r\n" } else { "\n" };
        self.bar.beside(|| {
            // A reader that has gone away is no error.
            let _ = write!(stderr(), "{words}{end}");
        });
    }

    /// Whether nobody sees it.
    pub(super) fn is_hidden(&self) -> bool {
        self.bar.is_hidden()
    }

    /// Which share of everything that is to be played has been, and more in words.
    pub(super) fn at(&self, share: f64, words: String) {
        self.bar.share(share, words);
    }

    /// Something that must be said now.
    pub(super) fn say(&self, words: &str) {
        let warning = format!("warning: {words}");
        if self.is_hidden() { say_lines(warning) } else { self.line(&warning) }
    }
}
