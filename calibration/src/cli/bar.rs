//! Progress: on stderr, and only where that is a terminal.

use std::io::{self, IsTerminal};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use isotherm_log::progress::Progress;

/// Steps between two looks at the progress.
const STRIDE: u32 = 64;

/// A bar that nobody sees where stderr is no terminal.
pub(crate) struct Bar {
    drawn: ProgressBar,
    progress: Option<Progress>,
    since: u32,
}

impl Bar {
    /// Over the bytes of a log.
    pub(crate) fn over_log(progress: Progress) -> Self {
        Self::new(Some(progress), "{bar:30} {percent:>3} %  reading  {eta} left")
    }

    /// Without an end in sight.
    pub(crate) fn at_work(message: &'static str) -> Self {
        let bar = Self::new(None, "{spinner} {msg}");
        bar.drawn.set_message(message);
        bar.drawn.tick();
        bar
    }

    fn new(progress: Option<Progress>, template: &str) -> Self {
        let terminal = io::stderr().is_terminal();
        let target =
            if terminal { ProgressDrawTarget::stderr_with_hz(5) } else { ProgressDrawTarget::hidden() };
        let drawn = ProgressBar::with_draw_target(progress.as_ref().map(Progress::total), target);
        if let Ok(style) = ProgressStyle::with_template(template) {
            drawn.set_style(style);
        }
        Self { drawn, progress, since: 0 }
    }

    /// One step is done.
    pub(crate) fn step(&mut self) {
        self.since += 1;
        if self.since >= STRIDE {
            self.since = 0;
            match &self.progress {
                Some(progress) => self.drawn.set_position(progress.read()),
                None => self.drawn.tick(),
            }
        }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        self.drawn.finish_and_clear();
    }
}
