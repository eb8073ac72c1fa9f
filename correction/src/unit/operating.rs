//! The unit's state at work: what a command does, what each tick does to a self-test or a pre-launch calibration.

use alloc::boxed::Box;

use serde::{Deserialize, Serialize};

use super::at_rest::AtRest;
use crate::calibration::Calibration;
use crate::drift::Reference;
use crate::observation::Observation;
use crate::operation::{Command, HealthReading, Refusal, SelfTest, SelfTestReport, State};
use crate::prelaunch::{Outcome, PreLaunch, PreLaunchProgress};
use crate::sample::ChannelName;
use crate::units::Timestamp;

/// A calibration in force and its revision counter, as the states see it.
pub(super) type InForce<'a> = (&'a Calibration, u64);

/// A pre-launch calibration, at work or done.
#[derive(Debug, Clone, PartialEq)]
pub enum PreLaunchView<'a> {
    /// It goes on.
    Running(Box<PreLaunchProgress>),
    /// It has ended.
    Ended(&'a Outcome),
    /// It was given up, by a command or because the calibration changed under it; nothing has changed.
    Aborted,
}

/// State of one unit and what belongs to it.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Operating {
    pub(super) state: State,
    /// Whether somebody chose it; until then it follows the calibration.
    chosen: bool,
    self_test: Option<Box<SelfTest>>,
    /// The last self-test that ended.
    pub(super) report: Option<SelfTestReport>,
    pre_launch: Option<Box<PreLaunch>>,
    aborted: bool,
    /// Whether the unit is taken to be at rest, and whether it is.
    pub(super) rest: Option<Box<AtRest>>,
}

impl Operating {
    /// Begins in standby, or running.
    pub(super) fn new(in_standby: bool) -> Self {
        let state = if in_standby { State::Standby } else { State::RunningWithoutReversal };
        Self { state, chosen: in_standby, ..Self::default() }
    }

    /// The pre-launch calibration that is at work, or the last one.
    pub(super) fn pre_launch(&self) -> Option<PreLaunchView<'_>> {
        let pre_launch = self.pre_launch.as_ref()?;
        Some(match pre_launch.outcome() {
            Some(outcome) => PreLaunchView::Ended(outcome),
            None if self.aborted => PreLaunchView::Aborted,
            None => PreLaunchView::Running(Box::new(pre_launch.progress())),
        })
    }

    /// Carries a command out, or says why not.
    pub(super) fn command(
        &mut self,
        command: &Command,
        in_force: Option<InForce<'_>>,
    ) -> Result<State, Refusal> {
        if !self.state.allowed().contains(&command.name()) {
            return Err(Refusal::State { state: self.state, command: command.name() });
        }
        let calibrated = in_force.map(|(calibration, _)| calibration);
        let needs = || calibrated.ok_or(Refusal::Uncalibrated { command: command.name() });
        match command {
            Command::Standby | Command::Abort => {
                self.aborted |= self.pre_launch.as_ref().is_some_and(|p| p.outcome().is_none());
                self.self_test = None;
                self.state = State::Standby;
            }
            Command::SelfTest => match calibrated {
                Some(calibration) => {
                    self.self_test = Some(Box::new(SelfTest::new(calibration)));
                    self.report = None;
                    self.state = State::SelfTest;
                }
                None => self.report = Some(SelfTestReport::uncalibrated()),
            },
            Command::PreLaunch(settings) => {
                let pre_launch = PreLaunch::new(settings, needs()?).map_err(Refusal::PreLaunch)?;
                self.pre_launch = Some(Box::new(pre_launch));
                self.aborted = false;
                self.state = State::PreLaunchCalibration;
            }
            Command::Run { reversal } => {
                let known = calibrated.is_some_and(|calibration| calibration.reversal.is_some());
                if *reversal == Some(true) && !known {
                    return Err(if calibrated.is_some() {
                        Refusal::NoReversal
                    } else {
                        Refusal::Uncalibrated { command: command.name() }
                    });
                }
                self.state = running(reversal.unwrap_or(known));
            }
            Command::Rest(place) => {
                let calibration = needs()?;
                if !estimates_drift(calibration) {
                    return Err(Refusal::NoDrift);
                }
                self.rest = Some(Box::new(AtRest::new(place, calibration)));
            }
            Command::EndRest => self.rest = None,
        }
        // A rest says nothing of what the unit does.
        self.chosen |= !matches!(command, Command::Rest(_) | Command::EndRest);
        Ok(self.state)
    }

    /// Another calibration is in force: what rests on the old one is given up.
    pub(super) fn calibration_changed(&mut self, calibration: &Calibration) {
        if !self.chosen {
            self.state = running(calibration.reversal.is_some());
        }
        if self.state == State::PreLaunchCalibration {
            self.aborted = true;
            self.state = State::Standby;
        }
        if self.state == State::SelfTest {
            self.self_test = Some(Box::new(SelfTest::new(calibration)));
        }
        if let Some(rest) = &self.rest {
            self.rest =
                estimates_drift(calibration).then(|| Box::new(AtRest::new(rest.place(), calibration)));
        }
    }

    /// Whether anybody is to be shown corrected ticks: [`observe`](Self::observe) does nothing otherwise.
    pub(super) fn watches(&self) -> bool {
        self.self_test.is_some() || self.rest.is_some() || self.state == State::PreLaunchCalibration
    }

    /// Takes one corrected tick; a reference where the unit has been at rest for long enough.
    pub(super) fn observe(
        &mut self,
        seen: &Observation,
        (calibration, revision): InForce<'_>,
        temperature: &dyn Fn(&ChannelName) -> Option<f64>,
    ) -> Option<Reference> {
        if let Some(test) = &mut self.self_test
            && test.observe(seen)
        {
            self.end_self_test((calibration, revision), temperature);
        }
        if self.state == State::PreLaunchCalibration
            && let Some(pre_launch) = &mut self.pre_launch
        {
            pre_launch.observe(seen);
            if pre_launch.outcome().is_some() {
                self.state = State::Standby;
            }
        }
        self.rest.as_mut().and_then(|rest| rest.observe(seen))
    }

    /// Takes what the producer reports of itself; the last tick ends `now`.
    pub(super) fn health(&mut self, reading: &HealthReading, now: Option<Timestamp>) {
        if let Some(test) = &mut self.self_test {
            test.health(reading, now);
        }
    }

    /// Ends a self-test with what it has seen so far.
    pub(super) fn end_self_test(
        &mut self,
        (calibration, revision): InForce<'_>,
        temperature: &dyn Fn(&ChannelName) -> Option<f64>,
    ) {
        if let Some(test) = self.self_test.take() {
            self.report = Some(test.report(calibration, revision, temperature));
            self.state = State::Standby;
        }
    }

    /// The stream has ended: a pre-launch calibration gets no more ticks.
    pub(super) fn end_pre_launch(&mut self) {
        if self.state == State::PreLaunchCalibration
            && let Some(pre_launch) = &mut self.pre_launch
        {
            pre_launch.finish();
            self.state = State::Standby;
        }
    }
}

/// Whether any gyro has parameters for the drift estimator.
fn estimates_drift(calibration: &Calibration) -> bool {
    (0..calibration.gyro_count()).any(|i| calibration.drift(i).is_some())
}

/// The running state with or without mode reversal.
fn running(reversal: bool) -> State {
    if reversal { State::RunningWithReversal } else { State::RunningWithoutReversal }
}
