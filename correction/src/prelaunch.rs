//! Pre-launch calibration: the constants C0 and B0 of each gyro, from a unit at rest [003; models §7].
//!
//! At rest a gyro feels the Earth, and what is left of its rate is bias. Per gyro and lasing mode m the rate beyond the bias
//! that the calibration models is averaged over the good ticks,
//!
//! ```text
//! δ_m = Σ(K·P − Ω·Δt)/ΣΔt − C(T)·ω_E
//! ```
//!
//! and the changes of the constants follow from the two modes:
//!
//! ```text
//! δ₊ = ΔC0 + ΔB0,   δ₋ = ΔC0 − ΔB0        ⇒        ΔC0 = (δ₊ + δ₋)/2,   ΔB0 = (δ₊ − δ₋)/2
//! ```
//!
//! models §7 takes the mean rate and the mean temperature of each mode, puts the temperature into the terms and solves
//! for the constants, the shapes kept. That is the same thing while the terms are linear in T, for then the mean of the term is the
//! term of the mean. For a curved term it is not: the mean over a range of T differs from the value at T̄ by half the
//! curvature times the variance of T. Subtracting the term tick by tick has no such error, and keeps lags, thermal rate,
//! trend and servo too. That the modes see different temperatures is in it either way.
//!
//! An instrument without modes has only δ, which is ΔC0.
//!
//! Nothing in the calibration changes here: the owner makes an overlay of the result, or does not.

mod gyro;
mod outcome;
mod scatter;
mod settings;

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use gyro::{Gathered, GyroRun};
pub use outcome::{
    BiasConstant, GyroConstants, GyroProgress, ModeTotals, Outcome, PreLaunchProgress, Refusal,
};
pub use settings::{DURATION_RANGE_S, PreLaunchError, PreLaunchLimits, PreLaunchSettings};

pub use crate::by_mode::ByMode;
use crate::calibration::Calibration;
use crate::earth::Place;
use crate::observation::{GyroSeen, Observation};
use crate::orientation::Orientation;
use crate::rest::{Rest, RestMonitor};
use crate::sample::{LasingMode, SensorFlags, Sensors, TickFlags};
use crate::units::{Span, Timestamp};
use crate::vector::TimeMean;

/// A pre-launch calibration that is running, or over.
///
/// It belongs to the calibration that it was made with: where another one is installed, drop it. Dropping it leaves no
/// trace. Nothing is allocated per tick.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PreLaunch {
    settings: PreLaunchSettings,
    place: Place,
    orientation: Orientation,
    rest: RestMonitor,
    gyros: Sensors<GyroRun>,
    /// Ticks that the stream announced as missing.
    missed: u64,
    /// Start of the first tick and end of the last one.
    span: Option<(Timestamp, Timestamp)>,
    /// Specific force in case axes (m/s²).
    force: TimeMean,
    outcome: Option<Outcome>,
}

impl PreLaunch {
    /// Begins with the next tick.
    ///
    /// # Errors
    /// Everything that is wrong with the settings for a unit with this calibration.
    pub fn new(settings: &PreLaunchSettings, calibration: &Calibration) -> Result<Self, Vec<PreLaunchError>> {
        let errors = settings.validate(calibration);
        let Some(place) = settings.place.filter(|_| errors.is_empty()) else {
            return Err(errors);
        };
        Ok(Self {
            settings: *settings,
            place,
            orientation: calibration.gyro_orientation.clone(),
            rest: RestMonitor::new(&settings.limits.rest, calibration),
            gyros: calibration.count_rad().map(GyroRun::new).collect(),
            missed: 0,
            span: None,
            force: TimeMean::default(),
            outcome: None,
        })
    }

    /// Takes one tick. Once there is an outcome, further ticks change nothing.
    pub fn observe(&mut self, observation: &Observation) {
        if self.outcome.is_none() {
            let outcome = self.gather(observation);
            self.outcome = outcome.unwrap_or_else(|refusal| Some(Outcome::Refused(alloc::vec![refusal])));
        }
    }

    /// Takes one tick while there is no outcome; the outcome once its time has passed, or a refusal that is certain.
    fn gather(&mut self, observation: &Observation) -> Result<Option<Outcome>, Refusal> {
        let end = observation.end_time;
        if let Some((_, last)) = &mut self.span {
            if observation.flags.contains(TickFlags::RESTART) {
                return Err(Refusal::Restarted);
            }
            self.missed = self.missed.saturating_add(observation.missed);
            *last = end;
        } else {
            self.span = Some((end - observation.duration, end));
        }
        if let Rest::Moved(moved) = self.rest.observe(observation) {
            return Err(Refusal::Moved(moved));
        }
        if let Some(force) = observation.specific_force {
            self.force.add(force, observation.duration.as_s());
        }
        self.gather_rates(observation)?;
        if self.elapsed() < self.settings.duration {
            return Ok(None);
        }
        // The last second may have been a nudge.
        let rest = self.rest.finish(end);
        Ok(Some(self.conclude(rest)))
    }

    /// Says what came of it once it is over: when its time has passed, or as soon as a refusal is certain.
    #[must_use]
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// Ends it where the stream has ended; what is not complete by then is refused as too short.
    pub fn finish(&mut self) -> &Outcome {
        let (elapsed, duration) = (self.elapsed(), self.settings.duration);
        self.outcome
            .get_or_insert_with(|| Outcome::Refused(alloc::vec![Refusal::TooShort { elapsed, duration }]))
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self) -> PreLaunchProgress {
        let gyro = |run: &GyroRun| GyroProgress {
            modes: run.modes.map(Gathered::totals),
            standard_error_rad_per_s: run.sigma_rad_per_s(),
        };
        PreLaunchProgress {
            elapsed: self.elapsed(),
            duration: self.settings.duration,
            gyros: self.gyros.iter().map(gyro).collect(),
        }
    }

    fn elapsed(&self) -> Span {
        self.span.map_or(Span::ZERO, |(start, end)| end.since(start))
    }

    fn gather_rates(&mut self, observation: &Observation) -> Result<(), Refusal> {
        // The bias rests on derivatives that are not known yet, or holds a transient that was not measured.
        let unknown = TickFlags::WARM_UP | TickFlags::UNCALIBRATED | TickFlags::SERVO_UNMEASURED;
        let usable = observation.settled && !observation.flags.intersects(unknown);
        let bad = SensorFlags::STALE_TEMPERATURE
            | SensorFlags::EXCLUDED
            | SensorFlags::OVERRANGE
            | SensorFlags::NOT_FINITE;
        let duration_s = observation.duration.as_s();
        let mut outside = None;
        for (index, run) in self.gyros.iter_mut().enumerate() {
            if observation.missed > 0 {
                run.cut();
            }
            let Some(GyroSeen { rate, bias, temperature_deg_c, flags, .. }) = observation.gyros.get(index)
            else {
                run.bad();
                continue;
            };
            if !usable || !flags.contains(SensorFlags::VALID) || flags.intersects(bad) {
                run.bad();
                continue;
            }
            if flags.contains(SensorFlags::CLAMPED_TEMPERATURE) {
                outside = Some(Refusal::TemperatureOutOfRange { gyro: index, temperature_deg_c });
            }
            run.good(observation.mode, rate - bias, temperature_deg_c, duration_s);
        }
        outside.map_or(Ok(()), Err)
    }

    /// The constants, or every reason against them.
    fn conclude(&self, rest: Rest) -> Outcome {
        let mut refusals = Vec::new();
        match rest {
            Rest::Still => {}
            Rest::Learning => refusals.push(Refusal::RestNotSeen),
            Rest::Moved(moved) => refusals.push(Refusal::Moved(moved)),
        }
        let mean_force = self.force.mean();
        let earth = self.place.earth_rate_in_case(mean_force);
        if earth.is_none() {
            refusals.push(Refusal::NotLevelled { mean_force_m_per_s2: mean_force });
        }
        for (index, run) in self.gyros.iter().enumerate() {
            self.check_coverage(index, run, &mut refusals);
        }
        let Some(earth) = earth.filter(|_| refusals.is_empty()) else {
            return Outcome::Refused(refusals);
        };
        let mut constants = Vec::with_capacity(self.gyros.len());
        for (index, run) in self.gyros.iter().enumerate() {
            match self.solve(index, run, earth) {
                Some(solved) => {
                    self.check_change(index, &solved, &mut refusals);
                    constants.push(solved);
                }
                None => refusals.push(Refusal::NoiseNotSeen { gyro: index }),
            }
        }
        if refusals.is_empty() { Outcome::Accepted(constants) } else { Outcome::Refused(refusals) }
    }

    /// Whether a gyro has seen enough.
    fn check_coverage(&self, gyro: usize, run: &GyroRun, refusals: &mut Vec<Refusal>) {
        let limits = &self.settings.limits;
        let least_s = limits.time_per_mode.as_s();
        let ByMode { without, plus, minus } = run.modes.map(|gathered| gathered.ticks);
        // A tick without a mode says nothing of an instrument that has modes.
        let (needed, good, stray): (&[Option<LasingMode>], _, _) = if run.has_modes() {
            (&[Some(LasingMode::Plus), Some(LasingMode::Minus)], plus + minus, without)
        } else {
            (&[None], without, 0)
        };
        for &mode in needed {
            let &Gathered { time_s, ticks, .. } = run.modes.get(mode);
            // The last digits of a long sum are those of no tick: too little is what lacks half of one.
            if time_s + 0.5 * time_s / real(ticks.max(1)) < least_s {
                refusals.push(Refusal::TooLittleTime { gyro, mode, time_s, limit_s: least_s });
            }
        }
        let good = real(good);
        let all = good + real(run.bad_ticks + stray) + real(self.missed);
        let (good_share, limit) = (good / all.max(1.0), limits.good_share);
        if good_share < limit {
            refusals.push(Refusal::TooManyBadTicks { gyro, good_share, limit });
        }
        if run.has_modes() {
            let (plus, minus) = (real(plus), real(minus));
            let (imbalance, limit) = ((plus - minus).abs() / (plus + minus), limits.mode_imbalance);
            if imbalance > limit {
                refusals.push(Refusal::ModesUnbalanced { gyro, imbalance, limit });
            }
        }
    }

    /// Solves the pair of equations of one gyro; `None` where its noise is not known.
    fn solve(&self, index: usize, run: &GyroRun, earth: [f64; 3]) -> Option<GyroConstants> {
        let modes = run.modes.map(Gathered::totals);
        let input = self.orientation.forward(mean_temperature(&modes)?, earth);
        let earth_rate_rad_per_s = *input.get(index)?;
        let sigma = run.sigma_rad_per_s()?;
        let excess = |gathered: &Gathered| Some(gathered.rate_rad_per_s()? - earth_rate_rad_per_s);
        let (static_bias, magnetic_bias) = if run.has_modes() {
            let (plus, minus) = (excess(&run.modes.plus)?, excess(&run.modes.minus)?);
            (0.5 * (plus + minus), Some(0.5 * (plus - minus)))
        } else {
            (excess(&run.modes.without)?, None)
        };
        Some(GyroConstants {
            static_bias_change_rad_per_s: static_bias,
            static_bias_sigma_rad_per_s: sigma,
            magnetic_bias_change_rad_per_s: magnetic_bias,
            magnetic_bias_sigma_rad_per_s: magnetic_bias.map(|_| sigma),
            earth_rate_rad_per_s,
            modes,
        })
    }

    fn check_change(&self, gyro: usize, constants: &GyroConstants, refusals: &mut Vec<Refusal>) {
        let limits = &self.settings.limits;
        let static_bias = Some(constants.static_bias_change_rad_per_s);
        let magnetic_bias = constants.magnetic_bias_change_rad_per_s;
        for (constant, change, limit_rad_per_s) in [
            (BiasConstant::Static, static_bias, limits.static_bias_change_rad_per_s),
            (BiasConstant::Magnetic, magnetic_bias, limits.magnetic_bias_change_rad_per_s),
        ] {
            // What is no number is beyond any limit.
            let beyond = change.filter(|change| change.is_nan() || change.abs() > limit_rad_per_s);
            refusals.extend(beyond.map(|change_rad_per_s| Refusal::ChangeBeyondLimit {
                gyro,
                constant,
                change_rad_per_s,
                limit_rad_per_s,
            }));
        }
    }
}

/// Mean over the good time of all modes (°C); `None` without any.
fn mean_temperature(modes: &ByMode<ModeTotals>) -> Option<f64> {
    let each = modes.each();
    let time_s: f64 = each.iter().map(|mode| mode.time_s).sum();
    let sum: f64 = each.iter().filter_map(|mode| Some(mode.mean_temperature_deg_c? * mode.time_s)).sum();
    (time_s > 0.0).then(|| sum / time_s)
}

/// A number of ticks as a real number.
#[expect(clippy::cast_precision_loss, reason = "a day at 10 kHz has fewer than 2³⁰ ticks")]
fn real(ticks: u64) -> f64 {
    ticks as f64
}

#[cfg(test)]
mod tests;
