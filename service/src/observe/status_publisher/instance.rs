//! What the service says of itself.

use std::sync::Arc;
use std::time::Instant;

use isotherm_operator::status::unix_ms;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::service_status::{MAX_UNITS, ServiceStatus};
use isotherm_protocol::status::MAX_FAULTS;
use zenoh::Session;

use crate::control::ControlStatus;
use crate::observe::subscribers::Subscribers;
use crate::receive::fault::standing;
use crate::receive::intake::Intake;
use isotherm_cli::stderr::dropped_lines;

/// When the service's status is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// In any case.
    Always,
    /// Where something has changed since the last time.
    IfNews,
    /// Likewise, where units have not.
    IfPosted,
}

/// This instance of the service.
pub(super) struct Instance {
    name: String,
    started: (Instant, i64),
    settings_digest: Option<Digest>,
    control_status: Arc<ControlStatus>,
    subscribers: Arc<Subscribers>,
    /// What was said last, as far as a change of it is news.
    said: Option<ServiceStatus>,
    /// What the swap manager had posted then.
    posted: Option<Arc<ServiceStatus>>,
}

impl Instance {
    pub(super) fn new(
        session: &Session,
        settings_digest: Option<Digest>,
        control_status: Arc<ControlStatus>,
        subscribers: Arc<Subscribers>,
    ) -> Self {
        Self {
            name: session.zid().to_string(),
            started: (Instant::now(), unix_ms()),
            settings_digest,
            control_status,
            subscribers,
            said: None,
            posted: None,
        }
    }

    /// Its Zenoh id as text.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Its status, where something has changed since the last time, or in any case.
    pub(super) fn status(&mut self, intake: &Intake, look: Look) -> Option<ServiceStatus> {
        let posted = self.control_status.read();
        if look == Look::IfPosted && self.posted.as_ref().is_some_and(|before| Arc::ptr_eq(before, &posted)) {
            return None;
        }
        let mut units = intake.each_unit(|actor| actor.summary());
        units.truncate(MAX_UNITS);
        let news = ServiceStatus {
            instance: self.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: Some(std::process::id()),
            started_unix_ms: self.started.1,
            units,
            settings_digest: self.settings_digest,
            ..(*posted).clone()
        };
        self.posted = Some(posted);
        if look != Look::Always && self.said.as_ref() == Some(&news) {
            return None;
        }
        self.said = Some(news.clone());
        let now_unix_ms = unix_ms();
        let mut faults = news.faults.clone();
        for fault in &mut faults {
            fault.last_unix_ms = now_unix_ms;
        }
        faults.extend(intake.missing_other());
        faults.extend(intake.faults());
        faults.extend(intake.awaited());
        let dropped = dropped_lines();
        if dropped > 0 {
            let words = "log lines were dropped: stderr was blocked (a stopped terminal, a full pipe)";
            faults.push(standing("log_lines_dropped", dropped, words.to_owned()));
        }
        faults.extend(self.subscribers.fault());
        faults.truncate(MAX_FAULTS);
        // Time and other faults go on all the time: no news by themselves.
        Some(ServiceStatus { uptime_s: self.started.0.elapsed().as_secs_f64(), faults, ..news })
    }
}
