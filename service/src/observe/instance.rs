//! What the service says of itself: in its status, its metrics and its health.

use std::sync::Arc;
use std::time::Instant;

use isotherm_cli::stderr::dropped_lines;
use isotherm_operator::status::unix_ms;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::service_status::{MAX_UNITS, ServiceStatus};
use isotherm_protocol::status::{Fault, MAX_FAULTS};

use crate::control::ControlStatus;
use crate::observe::subscribers::Subscribers;
use crate::pair::Pair;
use crate::receive::fault::standing;
use crate::receive::intake::Intake;

/// Kind of the fault of log lines that nobody took.
pub(super) const LOG_LINES_DROPPED: &str = "log_lines_dropped";

/// This instance of the service.
#[derive(Debug)]
pub(crate) struct Instance {
    pub(super) intake: Arc<Intake>,
    pub(super) pair: Arc<Pair>,
    pub(super) control_status: Arc<ControlStatus>,
    pub(crate) subscribers: Arc<Subscribers>,
    started: (Instant, i64),
    settings_digest: Option<Digest>,
}

impl Instance {
    pub(crate) fn new(
        intake: Arc<Intake>,
        pair: Arc<Pair>,
        control_status: Arc<ControlStatus>,
        settings_digest: Option<Digest>,
    ) -> Self {
        let (started, subscribers) = ((Instant::now(), unix_ms()), Arc::default());
        Self { intake, pair, control_status, subscribers, started, settings_digest }
    }

    /// Its Zenoh id as text.
    pub(super) fn id(&self) -> &str {
        &self.pair.me().instance
    }

    /// Its status now.
    pub(super) fn status(&self) -> ServiceStatus {
        self.complete(self.news(&self.control_status.read()))
    }

    /// What of its status is news where it changes, with what the swap manager has posted.
    pub(super) fn news(&self, posted: &ServiceStatus) -> ServiceStatus {
        let mut units = self.intake.each_unit(|actor| actor.summary());
        units.truncate(MAX_UNITS);
        ServiceStatus {
            instance: self.id().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: Some(std::process::id()),
            started_unix_ms: self.started.1,
            units,
            settings_digest: self.settings_digest,
            ..posted.clone()
        }
    }

    /// The rest of it: time and other faults go on all the time.
    pub(super) fn complete(&self, news: ServiceStatus) -> ServiceStatus {
        let last_unix_ms = unix_ms();
        let posted = news.faults.into_iter().map(|fault| Fault { last_unix_ms, ..fault });
        let mut faults: Vec<_> = posted.chain(self.intake.missing_other()).collect();
        faults.extend(self.intake.faults());
        faults.extend(self.intake.awaited());
        faults.extend(lost_log_lines());
        faults.extend(self.subscribers.fault());
        faults.truncate(MAX_FAULTS);
        ServiceStatus { uptime_s: self.started.0.elapsed().as_secs_f64(), faults, ..news }
    }
}

/// That the log had to leave lines out.
pub(super) fn lost_log_lines() -> Option<Fault> {
    let words = "log lines were dropped: stderr was blocked (a stopped terminal, a full pipe)";
    Some(dropped_lines())
        .filter(|dropped| *dropped > 0)
        .map(|dropped| standing(LOG_LINES_DROPPED, dropped, words.to_owned()))
}
