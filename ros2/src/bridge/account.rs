//! One unit: its account, and what is known of it at present.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use isotherm_bus::Continuity;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::status::Status;
use tokio::sync::Notify;

use super::feeding::Input;
use crate::feed::{Refusal, Ticks};
use crate::mapping::UnitMapping;
use crate::noise::Noise;
use crate::totals::UnitTotals;

/// A unit of the bridge, shared by what works on it.
#[derive(Debug)]
pub(super) struct Unit {
    pub(super) mapping: UnitMapping,
    /// Told when nothing more comes.
    pub(super) end: Notify,
    state: Mutex<State>,
    /// Told when something has come back.
    back: Notify,
}

/// What changes.
#[derive(Debug, Default)]
struct State {
    totals: UnitTotals,
    /// Messages that wait.
    waiting: usize,
    frame_id: String,
    noise: Noise,
    status: Option<(Status, Instant)>,
    /// Number of the tick that was sent last, and of the one that came back last.
    sent: Option<u64>,
    back: Option<u64>,
    jitter: Jitter,
    last_refusal: Option<String>,
}

/// How far stamps are from even.
#[derive(Debug, Clone, Copy, Default)]
struct Jitter {
    sum_ns2: f64,
    count: u32,
}

/// What is said of a unit once a second.
#[derive(Debug, Clone)]
pub(super) struct Look {
    pub(super) totals: UnitTotals,
    /// The status and its age, where a service has told one.
    pub(super) status: Option<(Status, Duration)>,
    /// Standard deviation of a stamp since the last look (s), if intervals differ by the noise of both ends.
    pub(super) jitter_s: Option<f64>,
    pub(super) last_refusal: Option<String>,
}

impl Unit {
    pub(super) fn new(mapping: UnitMapping) -> Self {
        let frame_id = mapping.frame_id.clone().unwrap_or_default();
        let state = State { frame_id, ..State::default() };
        Self { mapping, end: Notify::new(), state: Mutex::new(state), back: Notify::new() }
    }

    pub(super) fn id(&self) -> &UnitId {
        &self.mapping.unit
    }

    /// Nothing that is done under the lock leaves the state half changed.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn totals(&self) -> UnitTotals {
        self.state().totals.clone()
    }

    /// Changes the account.
    pub(super) fn count(&self, change: impl FnOnce(&mut UnitTotals)) {
        change(&mut self.state().totals);
    }

    /// A message waits; how many do.
    pub(super) fn wait(&self) -> usize {
        let mut state = self.state();
        state.waiting += 1;
        state.waiting
    }

    /// One waits no more.
    pub(super) fn waited(&self) {
        let mut state = self.state();
        state.waiting = state.waiting.saturating_sub(1);
    }

    /// Counts a refusal; the first of its kind is logged.
    pub(super) fn refuse(&self, input: Input, refusal: &Refusal) {
        let topic = match input {
            Input::Imu => self.mapping.raw.as_str(),
            Input::Temperature(index) => {
                self.mapping.temperatures.get(index).map_or("", |temperature| &temperature.topic)
            }
        };
        let first = {
            let mut state = self.state();
            let count = state.totals.refused.entry(refusal.kind()).or_default();
            *count += 1;
            let first = *count == 1;
            state.last_refusal = Some(format!("{topic}: {refusal}"));
            first
        };
        if first {
            let unit = self.id().as_str();
            tracing::warn!(
                unit,
                topic,
                kind = refusal.kind(),
                "a message {refusal}; further ones are only counted"
            );
        }
    }

    /// Ticks of a message are about to be sent.
    pub(super) fn take(&self, ticks: &Ticks) {
        let mut state = self.state();
        state.totals.imu_in += 1;
        state.totals.missing += ticks.missing;
        state.totals.gaps += u64::from(ticks.missing > 0);
        state.totals.runs += u64::from(ticks.restart);
        state.sent = Some(ticks.gyro.sequence);
        if self.mapping.frame_id.is_none() && state.frame_id != ticks.frame_id {
            state.frame_id.clone_from(&ticks.frame_id);
        }
        if let Some(deviation_ns) = ticks.deviation_ns {
            #[expect(clippy::cast_precision_loss, reason = "a deviation within a tick")]
            let deviation_ns = deviation_ns as f64;
            state.jitter.sum_ns2 += deviation_ns * deviation_ns;
            state.jitter.count += 1;
        }
    }

    /// Frame and noise of what goes out now.
    pub(super) fn outgoing(&self) -> (String, Noise) {
        let state = self.state();
        (state.frame_id.clone(), state.noise.clone())
    }

    pub(super) fn know(&self, mut noise: Noise) {
        let mut state = self.state();
        if let Some((status, _)) = &state.status {
            noise.update(&status.drift);
        }
        state.noise = noise;
    }

    pub(super) fn hear(&self, status: Status) {
        let mut state = self.state();
        state.noise.update(&status.drift);
        state.status = Some((status, Instant::now()));
    }

    /// A tick has come back.
    pub(super) fn came_back(&self, sequence: u64, account: &Continuity) {
        {
            let mut state = self.state();
            state.back = Some(sequence);
            state.totals.ticks_out = account.ticks;
            state.totals.announced_missing = account.announced_missing;
            state.totals.lost = account.lost;
        }
        self.back.notify_one();
    }

    /// Waits until the last tick sent has come back.
    pub(super) async fn settled(&self) {
        loop {
            let (sent, back) = {
                let state = self.state();
                (state.sent, state.back)
            };
            if sent.is_none() || sent == back {
                return;
            }
            self.back.notified().await;
        }
    }

    /// What is to be said now; what is measured begins anew.
    pub(super) fn look(&self) -> Look {
        let mut state = self.state();
        let Jitter { sum_ns2, count } = std::mem::take(&mut state.jitter);
        let jitter_s = (count > 0).then(|| (sum_ns2 / f64::from(count) / 2.0).sqrt() * 1e-9);
        let status = state.status.as_ref().map(|(status, heard)| (status.clone(), heard.elapsed()));
        Look { totals: state.totals.clone(), status, jitter_s, last_refusal: state.last_refusal.take() }
    }
}
