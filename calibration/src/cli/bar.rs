//! Progress of what reads logs.

use isotherm_cli::Bar;
use isotherm_log::progress::Progress;

use crate::runs::Watch;

/// A bar over the readings of logs, one after the other.
pub(crate) fn reading() -> Bar {
    Bar::over_logs("reading")
}

impl Watch for Bar {
    fn begin(&mut self, progress: Progress) {
        self.begin(progress.watch());
    }

    fn step(&mut self) {
        self.step();
    }

    fn end(&mut self) {
        self.finish();
    }
}
