//! The status of a unit: what its state machine knows, with the names of its document.

use isotherm_correction::operation::{CheckItem, CheckResult};
use isotherm_correction::prelaunch::{self, ByMode, ModeTotals, Outcome};
use isotherm_correction::rest;
use isotherm_correction::sample::LasingMode;
use isotherm_correction::unit::{PreLaunchView, SensorHealth, Uncalibrated};
use isotherm_correction::units::Timestamp;

use super::revisions::Given;
use super::{Edge, Label, UnitStream};
use crate::status::{
    ActiveCalibration, AppliedCorrection, ChannelStatus, ConstantsChange, DriftStatus, MAX_FAULTS, Output,
    PendingChange, Place, PreLaunchGyro, PreLaunchMode, PreLaunchOutcome, PreLaunchProgress,
    PreLaunchVerdict, Rest, SelfTestItem, SelfTestReport, SensorKind, SensorStatus, Status,
};

impl UnitStream {
    /// What the unit says of itself, with what only its service knows.
    #[must_use]
    pub fn status(&self, edge: Edge<'_>) -> Status {
        let unit = &self.unit;
        let given = unit.calibration().and_then(|(_, counter)| self.revisions.find(counter));
        let unnamed = Label::default();
        let label = given.map_or(&unnamed, |given| &given.label);
        let (pre_launch, pre_launch_outcome) = self.pre_launch(label, &edge);
        let mut faults = edge.faults;
        faults.truncate(MAX_FAULTS);
        Status {
            unit: self.id.to_string(),
            instance: edge.instance.to_owned(),
            version: edge.version.to_owned(),
            state: unit.state(),
            output: self.output(),
            calibration: given.map(|given| active(given, edge.now_unix_s)),
            pending: self.pending(),
            swaps: edge.swaps,
            last_tick: self.last,
            channels: self.channels(),
            sensors: self.sensors(label),
            input_rates: edge.input_rates,
            applied: unit.applied().map(|applied| AppliedCorrection {
                angular_rate_rad_per_s: applied.angular_rate,
                specific_force_m_per_s2: applied.specific_force,
            }),
            drift: self.drift(label),
            rest: unit.at_rest().map(|at_rest| match at_rest.rest() {
                rest::Rest::Learning => Rest::Learning,
                rest::Rest::Still => Rest::Still,
                rest::Rest::Moved(moved) => Rest::Moved(moved.to_string()),
            }),
            self_test: unit.self_test().map(|report| SelfTestReport {
                passed: report.passed(),
                ended_ns: report.ended.map(Timestamp::as_ns),
                length_s: report.length.as_s(),
                items: report.checks.iter().map(|check| item(check, label)).collect(),
            }),
            pre_launch,
            pre_launch_outcome,
            counters: self.counters(),
            faults,
            last_fault: edge.last_fault,
            latency: edge.latency,
        }
    }

    /// What becomes of the unit's ticks.
    #[must_use]
    pub fn output(&self) -> Output {
        match (self.unit.calibration(), self.unit.settings().uncalibrated) {
            (Some(_), _) => Output::Calibrated,
            (None, Uncalibrated::PassThrough) => Output::PassThrough,
            (None, Uncalibrated::Hold) => Output::Held,
        }
    }

    /// The change that waits for its tick.
    fn pending(&self) -> Option<PendingChange> {
        let (counter, at) = self.unit.pending()?;
        let given = self.revisions.find(counter)?;
        Some(PendingChange {
            revision: given.revision,
            digest: given.label.digest,
            source: given.label.source.clone(),
            schedule: at,
            slew_s: given.slew.as_s(),
        })
    }

    fn channels(&self) -> Vec<ChannelStatus> {
        let calibration = self.unit.calibration().map(|(calibration, _)| calibration);
        let channels = self.unit.channels().enumerate().map(|(index, channel)| {
            let temperature_deg_c = channel.state.map(|state| state.temperature);
            let range = calibration.and_then(|calibration| calibration.range_of(index));
            ChannelStatus {
                name: channel.name,
                temperature_deg_c,
                rate_deg_c_per_s: channel.state.map(|state| state.rate),
                stale: channel.stale,
                warming_up: channel.warming_up,
                calibrated_range_deg_c: range,
                place: temperature_deg_c.zip(range).and_then(|(value, range)| Place::of(value, range)),
            }
        });
        channels.collect()
    }

    fn sensors(&self, label: &Label) -> Vec<SensorStatus> {
        let gyros = self.unit.gyro_health().into_iter().enumerate();
        let accels = self.unit.accel_health().into_iter().enumerate();
        let gyros = gyros.map(|(index, health)| sensor(label.gyro(index), SensorKind::Gyro, &health));
        let accels = accels.map(|(index, health)| sensor(label.accel(index), SensorKind::Accel, &health));
        gyros.chain(accels).collect()
    }

    fn drift(&self, label: &Label) -> Vec<DriftStatus> {
        let subtracted = self.unit.settings().subtract_drift;
        let estimates = self.unit.drift().into_iter().enumerate();
        let estimates = estimates.filter_map(|(index, estimate)| Some((index, estimate?)));
        let status = estimates.map(|(index, estimate)| DriftStatus {
            gyro: label.gyro(index),
            rate_rad_per_s: estimate.rate,
            sigma_rad_per_s: estimate.sigma,
            trend_rad_per_s2: estimate.trend,
            updates: estimate.updates,
            refused: estimate.refused,
            mean_nis: estimate.mean_nis,
            last_update_ns: estimate.last_update.map(Timestamp::as_ns),
            subtracted,
        });
        status.collect()
    }

    /// Progress of the pre-launch calibration that is at work, or what came of the last one.
    fn pre_launch(
        &self,
        label: &Label,
        edge: &Edge<'_>,
    ) -> (Option<PreLaunchProgress>, Option<PreLaunchOutcome>) {
        let verdict = match self.unit.pre_launch() {
            None => return (None, None),
            Some(PreLaunchView::Running(progress)) => return (Some(running(&progress, label)), None),
            Some(PreLaunchView::Aborted) => PreLaunchVerdict::Aborted,
            Some(PreLaunchView::Ended(Outcome::Accepted(constants))) => {
                let constants = constants.iter().enumerate();
                PreLaunchVerdict::Accepted(
                    constants.map(|(index, found)| change(found, label.gyro(index))).collect(),
                )
            }
            Some(PreLaunchView::Ended(Outcome::Refused(refusals))) => {
                PreLaunchVerdict::Refused(refusals.iter().map(|refusal| reason(refusal, label)).collect())
            }
        };
        let outcome = PreLaunchOutcome { ended_ns: self.pre_launch_ended_ns, verdict, overlay: edge.overlay };
        (None, Some(outcome))
    }
}

/// The calibration in force; its age by the service's clock.
fn active(given: &Given, now_unix_s: Option<i64>) -> ActiveCalibration {
    let label = &given.label;
    let age = now_unix_s.zip(label.created_unix_s).map(|(now, created)| now.saturating_sub(created));
    ActiveCalibration {
        revision: given.revision,
        digest: label.digest,
        created_unix_s: label.created_unix_s,
        age_s: age,
        source: label.source.clone(),
        overlay: label.overlay,
    }
}

fn sensor(name: String, kind: SensorKind, health: &SensorHealth) -> SensorStatus {
    SensorStatus {
        name,
        kind,
        flags: health.flags.bits(),
        ticks: health.ticks,
        invalid: health.invalid,
        overrange: health.overrange,
        not_finite: health.not_finite,
        clamped: health.clamped,
        stale: health.stale,
        excluded: health.excluded,
    }
}

fn item(check: &CheckResult, label: &Label) -> SelfTestItem {
    let (name, unit_of_measure) = match &check.item {
        CheckItem::Calibration => ("calibration".to_owned(), "revision"),
        CheckItem::Gyro(index) => (format!("gyro {}", label.gyro(*index)), "% alive"),
        CheckItem::Accel(index) => (format!("accelerometer {}", label.accel(*index)), "% alive"),
        CheckItem::Temperature(name) => (format!("temperature {name}"), "°C"),
        CheckItem::Voltage(name) => (format!("voltage {name}"), "V"),
        CheckItem::Counter(name) => (format!("counter {name}"), "increase"),
    };
    // An infinite limit is none.
    let [at_least, at_most] = check.limits.map(|limit| limit.is_finite().then_some(limit));
    let unit_of_measure = unit_of_measure.to_owned();
    SelfTestItem { name, value: check.value, at_least, at_most, unit_of_measure, passed: check.passed }
}

/// A refusal in words; the core knows gyros by their index only.
pub(super) fn reason(refusal: &prelaunch::Refusal, label: &Label) -> String {
    use prelaunch::Refusal as R;

    let words = refusal.to_string();
    match refusal {
        R::TemperatureOutOfRange { gyro, .. }
        | R::TooLittleTime { gyro, .. }
        | R::TooManyBadTicks { gyro, .. }
        | R::ModesUnbalanced { gyro, .. }
        | R::NoiseNotSeen { gyro }
        | R::ChangeBeyondLimit { gyro, .. } => {
            words.replacen(&format!("gyro {gyro}"), &format!("gyro {}", label.gyro(*gyro)), 1)
        }
        _ => words,
    }
}

fn running(progress: &prelaunch::PreLaunchProgress, label: &Label) -> PreLaunchProgress {
    let gyro = |(index, gyro): (usize, &prelaunch::GyroProgress)| PreLaunchGyro {
        name: label.gyro(index),
        modes: modes(&gyro.modes),
        sigma_rad_per_s: gyro.standard_error_rad_per_s,
    };
    PreLaunchProgress {
        elapsed_s: progress.elapsed.as_s(),
        duration_s: progress.duration.as_s(),
        gyros: progress.gyros.iter().enumerate().map(gyro).collect(),
    }
}

/// The modes in which there was a good tick.
fn modes(by_mode: &ByMode<ModeTotals>) -> Vec<PreLaunchMode> {
    let modes = [None, Some(LasingMode::Plus), Some(LasingMode::Minus)];
    let totals = modes.map(|mode| (mode, by_mode.get(mode)));
    let seen = totals.into_iter().filter(|(_, totals)| totals.ticks > 0);
    let mode = seen.map(|(mode, totals)| PreLaunchMode {
        mode,
        ticks: totals.ticks,
        time_s: totals.time_s,
        mean_temperature_deg_c: totals.mean_temperature_deg_c,
    });
    mode.collect()
}

fn change(found: &prelaunch::GyroConstants, gyro: String) -> ConstantsChange {
    ConstantsChange {
        gyro,
        static_bias_change_rad_per_s: found.static_bias_change_rad_per_s,
        static_bias_sigma_rad_per_s: found.static_bias_sigma_rad_per_s,
        magnetic_bias_change_rad_per_s: found.magnetic_bias_change_rad_per_s,
        magnetic_bias_sigma_rad_per_s: found.magnetic_bias_sigma_rad_per_s,
        earth_rate_rad_per_s: found.earth_rate_rad_per_s,
        modes: modes(&found.modes),
    }
}
