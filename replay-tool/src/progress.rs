//! The progress bar: on stderr, and only where that is a terminal.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use isotherm_log::progress::Progress;

/// Events between two looks at the bar.
const STRIDE: u32 = 1024;
/// Steps of a bar over a share.
const SHARES: u32 = 100_000;

/// A bar over the bytes of a log, or over ticks.
#[derive(Debug)]
pub struct Bar {
    /// The bar itself; hidden where nobody looks.
    drawn: ProgressBar,
    /// Bytes of the log, where it is one.
    progress: Option<Progress>,
    /// Events since the last look.
    since: u32,
}

impl Bar {
    /// A bar over a log's bytes.
    #[must_use]
    pub fn over_log(progress: Progress) -> Self {
        let bar = bar(progress.total(), "{bar:30} {percent:>3} %  {msg}  {eta} left");
        Self { drawn: bar, progress: Some(progress), since: 0 }
    }

    /// A bar over this many ticks.
    #[must_use]
    pub fn over_ticks(ticks: u64) -> Self {
        let bar = bar(ticks, "{bar:30} {percent:>3} %  {pos} of {len} ticks  {eta} left");
        Self { drawn: bar, progress: None, since: 0 }
    }

    /// A bar over a share of something, from 0 to 1; how long it takes is for the message to say.
    #[must_use]
    pub fn over_share() -> Self {
        let bar = bar(u64::from(SHARES), "{bar:30} {percent:>3} %  {msg}");
        Self { drawn: bar, progress: None, since: 0 }
    }

    /// Shows a share, at once.
    pub fn share(&mut self, share: f64, message: String) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "held between 0 and 1")]
        let position = (share.clamp(0.0, 1.0) * f64::from(SHARES)) as u64;
        self.drawn.set_position(position);
        self.drawn.set_message(message);
    }

    /// Does something to the terminal while the bar is away.
    pub fn beside(&self, work: impl FnOnce()) {
        self.drawn.suspend(work);
    }

    /// One event is done; `message` is asked for only now and then.
    pub fn step(&mut self, message: impl FnOnce() -> String) {
        self.since += 1;
        if self.since >= STRIDE {
            self.show(message());
        }
    }

    /// Shows where the work is, at once.
    pub fn show(&mut self, message: String) {
        match &self.progress {
            Some(progress) => self.drawn.set_position(progress.read()),
            None => self.drawn.inc(u64::from(self.since)),
        }
        self.since = 0;
        self.drawn.set_message(message);
    }

    /// Whether anybody sees it.
    #[must_use]
    pub fn is_hidden(&self) -> bool {
        self.drawn.is_hidden()
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.drawn.finish_and_clear();
    }
}

/// A bar of a length.
fn bar(length: u64, template: &str) -> ProgressBar {
    let terminal = std::io::stderr().is_terminal();
    let target = if terminal { ProgressDrawTarget::stderr_with_hz(5) } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(length), target);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    if terminal {
        bar.enable_steady_tick(Duration::from_millis(200));
    }
    bar
}
