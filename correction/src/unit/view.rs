//! What a unit shows of itself.

use alloc::sync::Arc;

use super::correct::Corrector;
use super::{Applied, At, AtRest, ChannelReport, Counters, PreLaunchView, SensorHealth, Unit, UnitSettings};
use crate::calibration::Calibration;
use crate::channel::ThermalState;
use crate::drift::{DriftEstimate, ReferenceCounters};
use crate::observation::Observation;
use crate::operation::{SelfTestReport, State};
use crate::sample::{ChannelName, Sensors};
use crate::units::Timestamp;

impl Unit {
    /// What corrects under the calibration in force.
    fn corrector(&self) -> Option<&Corrector> {
        self.pipeline.active.as_ref().map(|active| &active.corrector)
    }

    /// What has been counted.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.pipeline.counters
    }

    /// The calibration in force and its revision.
    #[must_use]
    pub fn calibration(&self) -> Option<(&Arc<Calibration>, u64)> {
        self.pipeline.active.as_ref().map(|active| (&active.calibration, active.revision))
    }

    /// The change that waits for its tick: its revision, and when it takes effect.
    #[must_use]
    pub fn pending(&self) -> Option<(u64, At)> {
        self.pipeline.pending.as_ref().map(|change| (change.revision, change.at))
    }

    /// The temperature channels as they stand at the last tick; none without a calibration.
    pub fn channels(&self) -> impl Iterator<Item = ChannelReport> + '_ {
        self.reports(false)
    }

    /// The auxiliary channels likewise; their states are in units of their own.
    pub fn auxiliaries(&self) -> impl Iterator<Item = ChannelReport> + '_ {
        self.reports(true)
    }

    fn reports(&self, auxiliaries: bool) -> impl Iterator<Item = ChannelReport> + '_ {
        self.pipeline.active.iter().flat_map(move |active| {
            let calibration = &active.calibration;
            let temperatures = calibration.temperatures;
            let [skipped, taken] = if auxiliaries { [temperatures, usize::MAX] } else { [0, temperatures] };
            let reports = active.corrector.thermal().report(calibration, self.pipeline.last_end);
            reports.skip(skipped).take(taken)
        })
    }

    /// The temperatures in use, by the channel's name; none without a calibration, and of a channel that was not read yet.
    pub fn temperatures(&self) -> impl Iterator<Item = (&ChannelName, ThermalState)> + Clone {
        let active = self.pipeline.active.iter();
        active.flat_map(|active| active.corrector.thermal().temperatures(&active.calibration))
    }

    /// How often [`temperatures`](Self::temperatures) may have changed since the unit was made or read back.
    #[must_use]
    pub fn temperature_changes(&self) -> u64 {
        self.corrector().map_or(0, |corrector| corrector.thermal().changes)
    }

    /// Revision of the navigation step that is being summed.
    #[must_use]
    pub fn summing(&self) -> Option<u64> {
        self.pipeline.steps.revision()
    }

    /// Whether ticks wait for their accelerometer tick, a missing neighbour, or the end of a navigation step.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        !self.gyros.is_empty() || !self.pipeline.steps.is_empty()
    }

    /// Gyro ticks that wait for their accelerometer tick or a missing neighbour.
    #[must_use]
    pub fn waiting_ticks(&self) -> usize {
        self.gyros.len()
    }

    /// Sequence number and end of the newest gyro tick that was taken, corrected or waiting; `None` before the first.
    #[must_use]
    pub fn newest_tick(&self) -> Option<(u64, Timestamp)> {
        self.gyros.newest()
    }

    /// The settings it was made with.
    #[must_use]
    pub fn settings(&self) -> &UnitSettings {
        &self.pipeline.settings
    }

    /// What the unit is doing.
    #[must_use]
    pub fn state(&self) -> State {
        self.pipeline.operating.state
    }

    /// The last tick that was corrected, taken apart; `None` before the first one under a calibration.
    #[must_use]
    pub fn observation(&self) -> Option<&Observation> {
        self.corrector().map(|corrector| &corrector.seen).filter(|seen| seen.gyros.count > 0)
    }

    /// Account of each gyro, in the order of the calibration; empty without one.
    #[must_use]
    pub fn gyro_health(&self) -> Sensors<SensorHealth> {
        self.corrector().map(|it| it.gyro_health.with(it.seen.gyros.flags)).unwrap_or_default()
    }

    /// Account of each accelerometer, likewise.
    #[must_use]
    pub fn accel_health(&self) -> Sensors<SensorHealth> {
        self.corrector().map(|it| it.accel_health.with(it.seen.accels.flags)).unwrap_or_default()
    }

    /// What is presently subtracted from the readings, in case axes; `None` before the first corrected tick.
    #[must_use]
    pub fn applied(&self) -> Option<Applied> {
        self.observation()?;
        self.pipeline.active.as_ref().map(|active| active.corrector.applied(&active.calibration))
    }

    /// Result of the last self-test that ended.
    #[must_use]
    pub fn self_test(&self) -> Option<&SelfTestReport> {
        self.pipeline.operating.report.as_ref()
    }

    /// The pre-launch calibration that is at work, or the last one.
    #[must_use]
    pub fn pre_launch(&self) -> Option<PreLaunchView<'_>> {
        self.pipeline.operating.pre_launch()
    }

    /// The rest that the operator has declared.
    #[must_use]
    pub fn at_rest(&self) -> Option<&AtRest> {
        self.pipeline.operating.rest.as_deref()
    }

    /// Estimated drift of each gyro at the last tick; `None` for one whose calibration has no parameters for it.
    #[must_use]
    pub fn drift(&self) -> Sensors<Option<DriftEstimate>> {
        self.corrector().into_iter().flat_map(|corrector| corrector.drift.estimates()).collect()
    }

    /// What became of the references.
    #[must_use]
    pub fn reference_counters(&self) -> ReferenceCounters {
        self.corrector().map(|corrector| *corrector.drift.counters()).unwrap_or_default()
    }

    /// Ends a self-test that gets no ticks with what it has seen: for the owner's clock.
    pub fn expire_self_test(&mut self) {
        if let Some(active) = &self.pipeline.active {
            let temperature = |name: &_| {
                active.corrector.thermal().alive(&active.calibration, name, self.pipeline.last_end)
            };
            self.pipeline.operating.end_self_test((&active.calibration, active.revision), &temperature);
        }
    }

    /// Ends a pre-launch calibration whose stream has ended: it is refused as too short.
    pub fn end_pre_launch(&mut self) {
        self.pipeline.operating.end_pre_launch();
    }
}
