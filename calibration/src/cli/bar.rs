//! Progress: on stderr, and only where that is a terminal.

use std::io::{self, IsTerminal};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use isotherm_log::progress::Progress;

use crate::runs::Watch;

/// Steps between two looks at the progress.
const STRIDE: u32 = 64;

/// A bar that nobody sees where stderr is no terminal.
pub(crate) struct Bar {
    drawn: ProgressBar,
    progress: Option<Progress>,
    since: u32,
}

impl Bar {
    /// Over the readings of logs, one after the other.
    pub(crate) fn reading() -> Self {
        Self::new("{bar:30} {percent:>3} %  reading  {eta} left")
    }

    /// Without an end in sight.
    pub(crate) fn at_work(message: &'static str) -> Self {
        let bar = Self::new("{spinner} {msg}");
        bar.drawn.set_message(message);
        bar.drawn.tick();
        bar
    }

    /// Over so many things, done one by one.
    pub(crate) fn counting(what: &'static str, total: usize) -> Self {
        let bar = Self::new("{bar:30} {pos}/{len} {msg}");
        bar.drawn.set_length(total as u64);
        bar.drawn.set_message(what);
        bar
    }

    /// That nobody sees, for what is done beside other things.
    pub(crate) fn hidden() -> Self {
        Self { drawn: ProgressBar::hidden(), progress: None, since: 0 }
    }

    /// So many are done; from any thread.
    pub(crate) fn at(&self, done: usize) {
        self.drawn.set_position(done as u64);
    }

    fn new(template: &str) -> Self {
        let terminal = io::stderr().is_terminal();
        let target =
            if terminal { ProgressDrawTarget::stderr_with_hz(5) } else { ProgressDrawTarget::hidden() };
        let drawn = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template(template) {
            drawn.set_style(style);
        }
        Self { drawn, progress: None, since: 0 }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        self.drawn.finish_and_clear();
    }
}

impl Watch for Bar {
    fn begin(&mut self, progress: Progress) {
        self.drawn.reset();
        self.drawn.set_length(progress.total());
        self.progress = Some(progress);
    }

    fn step(&mut self) {
        self.since += 1;
        if self.since >= STRIDE {
            self.since = 0;
            match &self.progress {
                Some(progress) => self.drawn.set_position(progress.read()),
                None => self.drawn.tick(),
            }
        }
    }

    fn end(&mut self) {
        self.finish();
    }
}
