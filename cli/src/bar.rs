//! Progress: on stderr, and only where that is a terminal.

use std::borrow::Cow;
use std::fmt;
use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Events between two looks at how far a log was read.
const STRIDE: u32 = 256;
/// Steps of a bar over a share.
const SHARES: u32 = 100_000;
/// Time between two frames of a bar of which nothing is known to move.
const TICK: Duration = Duration::from_millis(200);

/// Where the work is, where it can be asked.
type Position = Box<dyn Fn() -> u64 + Send + Sync>;

/// A bar that nobody sees where stderr is no terminal.
pub struct Bar {
    drawn: ProgressBar,
    /// How much of a log has been read, where it is one.
    position: Option<Position>,
    /// Events since the last look.
    since: u32,
}

impl fmt::Debug for Bar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bar").field("since", &self.since).finish_non_exhaustive()
    }
}

impl Bar {
    /// Over the bytes of logs, one after the other: see [`Bar::begin`].
    #[must_use]
    pub fn over_logs(message: &'static str) -> Self {
        Self::new(None, "{bar:30} {percent:>3} %  {msg}  {eta} left", message)
    }

    /// Over the bytes of a log: how many there are, and how many have been read.
    #[must_use]
    pub fn over_log((total, read): (u64, impl Fn() -> u64 + Send + Sync + 'static)) -> Self {
        let mut bar = Self::over_logs("");
        bar.begin((total, read));
        bar
    }

    /// Over this many ticks.
    #[must_use]
    pub fn over_ticks(ticks: u64) -> Self {
        Self::new(Some(ticks), "{bar:30} {percent:>3} %  {pos} of {len} ticks  {eta} left", "")
    }

    /// Over a share of something, from 0 to 1; how long it takes is for the message to say.
    #[must_use]
    pub fn over_share() -> Self {
        Self::new(Some(u64::from(SHARES)), "{bar:30} {percent:>3} %  {msg}", "")
    }

    /// Over so many things, done one by one.
    #[must_use]
    pub fn counting(what: &'static str, total: usize) -> Self {
        Self::new(Some(total as u64), "{bar:30} {pos} of {len} {msg}  {eta} left", what)
    }

    /// Over seconds: see [`Bar::seconds`].
    #[must_use]
    pub fn over_seconds() -> Self {
        Self::new(Some(0), "{bar:30} {pos} of {len} s  {msg}", "")
    }

    /// Without an end in sight.
    #[must_use]
    pub fn at_work(message: &'static str) -> Self {
        Self::new(None, "{spinner} {msg}", message)
    }

    /// Lines instead of a bar: those that are said last.
    #[must_use]
    pub fn lines() -> Self {
        Self::new(None, "{msg}", "")
    }

    /// That nobody sees, for what is done beside other things.
    #[must_use]
    pub fn hidden() -> Self {
        Self { drawn: ProgressBar::hidden(), position: None, since: 0 }
    }

    fn new(length: Option<u64>, template: &str, message: &'static str) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target =
            if terminal { ProgressDrawTarget::stderr_with_hz(5) } else { ProgressDrawTarget::hidden() };
        let drawn = ProgressBar::with_draw_target(length, target);
        if let Ok(style) = ProgressStyle::with_template(template) {
            drawn.set_style(style);
        }
        drawn.set_message(message);
        if terminal {
            drawn.enable_steady_tick(TICK);
        }
        Self { drawn, position: None, since: 0 }
    }

    /// Another log begins.
    pub fn begin(&mut self, (total, read): (u64, impl Fn() -> u64 + Send + Sync + 'static)) {
        self.drawn.reset();
        self.drawn.set_length(total);
        self.position = Some(Box::new(read));
    }

    /// One event of many is done.
    pub fn step(&mut self) {
        self.step_saying(|| None);
    }

    /// One event of many is done; `message` is asked for only now and then.
    pub fn step_saying(&mut self, message: impl FnOnce() -> Option<String>) {
        self.since += 1;
        if self.since >= STRIDE {
            self.look();
            if let Some(message) = message() {
                self.say(message);
            }
        }
    }

    /// Shows where the work is, at once.
    pub fn show(&mut self, message: String) {
        self.look();
        self.say(message);
    }

    /// Says what is being done.
    pub fn say(&self, message: impl Into<Cow<'static, str>>) {
        self.drawn.set_message(message);
    }

    /// Shows a share, at once.
    pub fn share(&self, share: f64, message: String) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "held between 0 and 1")]
        let position = (share.clamp(0.0, 1.0) * f64::from(SHARES)) as u64;
        self.at(position);
        self.say(message);
    }

    /// So many are done; from any thread.
    pub fn at(&self, done: u64) {
        self.drawn.set_position(done);
    }

    /// One more is done.
    pub fn done_one(&self) {
        self.drawn.inc(1);
    }

    /// So many seconds of these have passed.
    pub fn seconds(&self, passed: u64, all: u64) {
        self.drawn.set_length(all);
        self.at(passed);
    }

    fn look(&mut self) {
        match &self.position {
            Some(position) => self.at(position()),
            None => self.drawn.inc(u64::from(self.since)),
        }
        self.since = 0;
    }

    /// Does something to the terminal while the bar is away.
    pub fn beside(&self, work: impl FnOnce()) {
        self.drawn.suspend(work);
    }

    /// Whether nobody sees it.
    #[must_use]
    pub fn is_hidden(&self) -> bool {
        self.drawn.is_hidden()
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.drawn.finish_and_clear();
    }
}
