//! The line that shows where playing is.

use std::io::{Write, stderr};
use std::time::Duration;

use indicatif::HumanDuration;
use isotherm_cli::Bar;

use super::show;
use crate::keyboard::KEYS;
use crate::play::{Position, Watch};

/// The progress bar, and what is said beside it.
pub(super) struct Screen {
    bar: Bar,
    /// The terminal does not go to a line's beginning by itself.
    raw: bool,
}

impl Screen {
    /// With the keys, where somebody is at the keyboard.
    pub(super) fn new(keyboard: bool) -> Self {
        let screen = Self { bar: Bar::over_share(), raw: keyboard };
        if keyboard {
            screen.line(KEYS);
        }
        screen
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
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
}

impl Watch for Screen {
    fn at(&self, position: &Position) {
        let bar = &self.bar;
        if bar.is_hidden() {
            return;
        }
        let Position { log_s, ticks_sent, pass, speed, actual_speed, left, .. } = *position;
        let speed =
            if position.paused { "paused".to_owned() } else { format!("{actual_speed:.1}× of {speed}") };
        let pass = if pass > 1 { format!("  pass {pass}") } else { String::new() };
        // Whole seconds: what is left is an estimate.
        let left = left.map(|left| Duration::from_secs(left.as_secs()));
        let left = left.map_or_else(String::new, |left| format!("  {:#} left", HumanDuration(left)));
        bar.share(position.share, format!("{log_s:.2} s{pass}  {ticks_sent} ticks  {speed}{left}"));
    }

    fn say(&self, words: &str) {
        if self.bar.is_hidden() {
            show::warn(words);
        } else {
            self.line(&format!("warning: {words}"));
        }
    }
}
