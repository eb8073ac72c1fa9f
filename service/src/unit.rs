//! One unit's part of the service: its stream, its calibration, its faults and its outlet.

mod quiet;

use std::sync::Arc;
use std::time::Instant;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::key::{RawStream, UnitId};
use isotherm_protocol::status::{Counter, Status};
use isotherm_protocol::stream::UnitStream;

use crate::calibrations::Installable;
use crate::fault::{FaultKind, FaultLog};
use crate::latency::Histogram;
use crate::totals::UnitTotals;
use quiet::Quiet;

pub use quiet::QuietSettings;

/// Where corrected frames go; `Err` is an output that could not be published.
pub type Outlet = Box<dyn FnMut(Vec<u8>) -> Result<(), zenoh::Error> + Send>;

/// Counters of gyro ticks that were refused, duplicates excepted. Those of the kind and number of sensors count
/// accelerometer ticks too.
const REFUSALS: [&str; 5] =
    ["gyro_late", "gyro_implausible", "wrong_sensor_count", "wrong_output_kind", "bad_duration"];

/// One unit: frames in, frames out, everything counted. Knows nothing of sessions and threads.
pub struct UnitActor {
    stream: UnitStream,
    installed: Option<Installable>,
    outlet: Outlet,
    frame: Vec<u8>,
    faults: FaultLog,
    latency: Histogram,
    quiet: Quiet,
    /// Counters of streams that were given up after an alarm.
    before_reset: Vec<Counter>,
    status_due: bool,
}

impl std::fmt::Debug for UnitActor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("UnitActor")
            .field("unit", self.stream.id())
            .field("revision", &self.stream.revision())
            .finish_non_exhaustive()
    }
}

impl UnitActor {
    /// A unit that has seen nothing and has no calibration.
    #[must_use]
    pub fn new(id: UnitId, settings: UnitSettings, quiet: QuietSettings, outlet: Outlet) -> Self {
        Self {
            stream: UnitStream::new(id, settings),
            installed: None,
            outlet,
            frame: Vec::new(),
            faults: FaultLog::default(),
            latency: Histogram::default(),
            quiet: Quiet::new(quiet),
            before_reset: Vec::new(),
            status_due: true,
        }
    }

    /// Puts a calibration in force from the next tick on: the only way by which a unit ever gets one.
    pub fn install(&mut self, calibration: Arc<Calibration>, digest: [u8; 8]) -> Revision {
        self.installed = Some(Installable { calibration: Arc::clone(&calibration), digest, file: None });
        self.status_due = true;
        self.stream.install(calibration, digest)
    }

    /// Takes one raw frame that arrived at `arrival`, and publishes what it released.
    pub fn receive(&mut self, stream: RawStream, frame: &[u8], arrival: Instant) {
        let first_output = self.stream.ready().is_empty() && self.latency.total() == 0;
        if stream == RawStream::Gyro {
            self.quiet.heard(arrival);
        }
        if let Err(error) = self.stream.receive(stream, frame) {
            self.fault(FaultKind::from(&error), 1, || format!("raw/{}: {error}", stream.chunk()));
            return;
        }
        if self.publish() {
            self.latency.record(u64::try_from(arrival.elapsed().as_nanos()).unwrap_or(u64::MAX));
            self.status_due |= first_output;
        }
    }

    /// Releases and publishes what waits inside, if the gyro topic has been silent for long enough.
    pub fn flush_if_quiet(&mut self, now: Instant) {
        if self.stream.is_waiting() && self.quiet.is_over(now) {
            self.flush();
        }
    }

    /// Releases and publishes what waits inside.
    pub fn flush(&mut self) {
        self.stream.flush();
        self.publish();
    }

    /// Publishes every corrected tick that is ready; whether there was one.
    fn publish(&mut self) -> bool {
        let mut published = false;
        while let ready @ 1.. = self.stream.ready().len() {
            let encoded = self.stream.next_frame(&mut self.frame);
            let taken = (ready - self.stream.ready().len()) as u64;
            let sent = if encoded {
                (self.outlet)(std::mem::take(&mut self.frame))
            } else {
                Err("cannot be encoded".into())
            };
            match sent {
                Ok(()) => published = true,
                Err(error) => self.fault(FaultKind::Unpublished, taken, || {
                    format!("corrected: {}", isotherm_bus::words(&error))
                }),
            }
            if taken == 0 {
                // Not to be reached: the stream says that ticks are ready and gives none. Rather lose them than loop.
                let lost = self.stream.take_ready().len() as u64;
                self.fault(FaultKind::Unpublished, lost, || {
                    "corrected: the stream does not give its ticks".to_owned()
                });
            }
        }
        published
    }

    /// Counts a fault, and logs the first of its kind.
    fn fault(&mut self, kind: FaultKind, count: u64, words: impl FnOnce() -> String) {
        if self.faults.note(kind, count, words) {
            self.status_due = true;
            let words = self.faults.last().unwrap_or_default();
            tracing::warn!(unit = %self.stream.id(), kind = kind.name(), "{words}; further ones are counted only");
        }
    }

    /// Gives the unit's memory up after an event thought impossible: counted as an alarm, always logged.
    ///
    /// The calibration stays in force under the revision that it had.
    pub fn reset(&mut self, cause: &str) {
        let id = self.stream.id().clone();
        tracing::error!(unit = %id, "alarm: {cause}; the unit starts anew");
        self.before_reset = self.counters();
        let revision = self.stream.revision();
        self.stream = UnitStream::new(id, *self.stream.unit().settings());
        if let Some(Installable { calibration, digest, .. }) = &self.installed {
            while self.stream.revision().counter < revision.counter {
                self.stream.install(Arc::clone(calibration), *digest);
            }
        }
        self.faults.note(FaultKind::Alarm, 1, || format!("alarm: {cause}"));
        self.status_due = true;
    }

    /// Counters of the stream, those before a reset included.
    fn counters(&self) -> Vec<Counter> {
        let mut counters = self.stream.counters();
        for counter in &mut counters {
            let before = self.before_reset.iter().find(|before| before.name == counter.name);
            counter.value += before.map_or(0, |before| before.value);
        }
        counters
    }

    /// What the unit says of itself.
    #[must_use]
    pub fn status(&self) -> Status {
        let latency = [self.latency.quantile(0.5), self.latency.quantile(0.99)];
        let mut status = self.stream.status(env!("CARGO_PKG_VERSION"), self.faults.last(), latency);
        status.counters = self.counters();
        status.counters.extend(self.faults.counters());
        status
    }

    /// Whether something happened that subscribers of the status should hear of at once; asking settles it.
    pub fn take_status_due(&mut self) -> bool {
        std::mem::take(&mut self.status_due)
    }

    /// Whether [`UnitActor::take_status_due`] would say yes.
    #[must_use]
    pub fn is_status_due(&self) -> bool {
        self.status_due
    }

    /// The account of the unit since the service started.
    #[must_use]
    pub fn totals(&self) -> UnitTotals {
        let counters = self.counters();
        let value = |name: &str| {
            counters.iter().find(|counter| counter.name == name).map_or(0, |counter| counter.value)
        };
        UnitTotals {
            ticks_in: value("gyro_ticks_in"),
            ticks_out: value("ticks_out"),
            gaps: value("gaps"),
            ticks_missed: value("ticks_missed"),
            ticks_refused: REFUSALS.iter().map(|name| value(name)).sum(),
            bad: self.faults.refused(),
            unpublished: self.faults.count(FaultKind::Unpublished),
            alarms: self.faults.count(FaultKind::Alarm),
            added_latency_p50_ns: self.latency.quantile(0.5),
            added_latency_p99_ns: self.latency.quantile(0.99),
        }
    }

    /// Serial of the unit.
    #[must_use]
    pub fn id(&self) -> &UnitId {
        self.stream.id()
    }
}

#[cfg(test)]
mod tests;
