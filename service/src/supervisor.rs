//! What the service tells the manager that started it (systemd, `Type=notify`); nothing where `NOTIFY_SOCKET` is not set.

use std::time::Duration;

use sd_notify::NotifyState;
use tokio::time::{MissedTickBehavior, interval};

use crate::receive::pulse::Stuck;

/// How often the receive path is looked at where nobody asks for a watchdog.
const INTERVAL: Duration = Duration::from_secs(1);
/// Looks at the receive path within the watchdog's time: one that comes late does no harm.
const LOOKS: u32 = 4;

/// A shorter time is none that a watchdog could have.
const SHORTEST: Duration = Duration::from_millis(10);

/// Says what the start waits for, and gives it in words for the log.
pub(crate) fn waiting_for(awaited: &str) -> String {
    let words = format!("nothing is corrected yet: waiting for {awaited}");
    tell(&[NotifyState::Status(&words)]);
    words
}

/// Says that the service is at work.
pub(crate) fn ready(words: &str) {
    tell(&[NotifyState::Ready, NotifyState::Status(words)]);
}

/// Says that the service is about to end.
pub(crate) fn stopping() {
    tell(&[NotifyState::Stopping, NotifyState::Status("stopping: publishing what was received")]);
}

/// Feeds the manager's watchdog as long as `look` finds the receive path alive; never ends.
pub(crate) async fn watch(ready: String, look: impl Fn() -> Result<(), Stuck>) {
    let watchdog = sd_notify::watchdog_enabled().filter(|time| *time >= SHORTEST);
    let mut interval = interval(watchdog.map_or(INTERVAL, |time| time / LOOKS));
    interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut watch = Watch { feeds: watchdog.is_some(), ready, stuck: false };
    loop {
        interval.tick().await;
        watch.seen(look(), tell);
    }
}

/// The receive path from look to look.
struct Watch {
    /// Whether there is a watchdog.
    feeds: bool,
    /// What the service says of itself while all is well.
    ready: String,
    stuck: bool,
}

impl Watch {
    fn seen(&mut self, seen: Result<(), Stuck>, tell: impl Fn(&[NotifyState<'_>])) {
        let was_stuck = std::mem::replace(&mut self.stuck, seen.is_err());
        match seen {
            Ok(()) => {
                if was_stuck {
                    tracing::info!("the receive path is alive again");
                    tell(&[NotifyState::Status(&self.ready)]);
                }
                if self.feeds {
                    tell(&[NotifyState::Watchdog]);
                }
            }
            Err(stuck) => {
                if !was_stuck {
                    tracing::error!("{stuck}");
                }
                tell(&[NotifyState::Status(&stuck.to_string())]);
            }
        }
    }
}

fn tell(state: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(state) {
        tracing::debug!("systemd cannot be notified: {error}");
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[test]
    fn a_path_that_hangs_is_not_fed_and_one_that_lives_again_is() {
        let told = RefCell::new(Vec::new());
        let tell = |state: &[NotifyState<'_>]| {
            told.borrow_mut().extend(state.iter().map(ToString::to_string));
        };
        let mut watch = Watch { feeds: true, ready: "ready".to_owned(), stuck: false };
        let hangs = Err(Stuck::Message(Duration::from_millis(2100)));
        for seen in [Ok(()), hangs, hangs, Ok(()), Ok(())] {
            watch.seen(seen, tell);
        }
        insta::assert_snapshot!(told.into_inner().join("\n"));
    }
}
