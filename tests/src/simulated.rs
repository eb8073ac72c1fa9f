//! A simulated unit through the state machine, beside its truth.

use std::collections::VecDeque;
use std::slice;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::sample::CorrectedTick;
use isotherm_correction::unit::Event;
use isotherm_correction::units::AngularRate;
use isotherm_simulator::{Scenario, ScenarioErrors, Simulation, Step};

use crate::drive;

/// Runs a scenario through a unit with a calibration; `each` sees every step beside its corrected tick.
///
/// # Errors
/// What is wrong with the scenario.
pub fn run(
    calibration: &Arc<Calibration>,
    scenario: &Scenario,
    mut each: impl FnMut(&Step, &CorrectedTick),
) -> Result<(), ScenarioErrors> {
    let output = scenario.instrument.gyros.output_kind();
    let accel_output = scenario.instrument.accel_output_kind();
    let mut unit = drive::unit(calibration);
    let mut waiting = VecDeque::<Step>::new();
    let mut out = VecDeque::new();
    let mut pair = |waiting: &mut VecDeque<Step>, out: &mut VecDeque<CorrectedTick>| {
        while let Some(tick) = out.pop_front() {
            // A simulation drops nothing and a unit with a calibration drops nothing of it.
            if let Some(step) = waiting.pop_front() {
                each(&step, &tick);
            }
        }
    };
    for step in Simulation::new(scenario)? {
        let mut emit = |tick: &CorrectedTick| out.push_back(tick.clone());
        unit.handle(Event::Temperature(&step.temperatures), &mut emit);
        if let (Some(output), Some(tick)) = (accel_output, &step.accel) {
            unit.handle(Event::Accel { output, ticks: slice::from_ref(tick) }, &mut emit);
        }
        unit.handle(Event::Gyro { output, ticks: slice::from_ref(&step.gyro) }, &mut emit);
        waiting.push_back(step);
        pair(&mut waiting, &mut out);
    }
    unit.handle(Event::Flush, &mut |tick| out.push_back(tick.clone()));
    pair(&mut waiting, &mut out);
    Ok(())
}

/// Mean rates over windows of equal length.
#[derive(Debug, Clone)]
pub struct Windows {
    length_s: f64,
    angle: [f64; 3],
    filled_s: f64,
    /// Mean of each full window (°/h).
    pub means: Vec<[f64; 3]>,
}

impl Windows {
    /// Windows of a length (s).
    #[must_use]
    pub fn new(length_s: f64) -> Self {
        Self { length_s, angle: [0.0; 3], filled_s: 0.0, means: Vec::new() }
    }

    /// Adds an angle (rad) that was gathered over a time (s).
    pub fn add(&mut self, angle: [f64; 3], duration_s: f64) {
        for (sum, angle) in self.angle.iter_mut().zip(angle) {
            *sum += angle;
        }
        self.filled_s += duration_s;
        if self.filled_s > self.length_s - 0.5 * duration_s {
            let seconds = std::mem::take(&mut self.filled_s);
            let angle = std::mem::take(&mut self.angle);
            self.means.push(angle.map(|angle| AngularRate::from_rad_per_s(angle / seconds).as_deg_per_h()));
        }
    }

    /// The means about one axis.
    pub fn axis(&self, axis: usize) -> impl Iterator<Item = f64> + '_ {
        self.means.iter().filter_map(move |mean| mean.get(axis).copied())
    }
}

/// Size of a set of errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Standard deviation about the mean.
    pub deviation: f64,
    /// Largest less smallest.
    pub peak_to_peak: f64,
}

impl Size {
    /// Of some values; NaN without any.
    #[must_use]
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values {
            (count, sum, squares) = (count + 1.0, sum + value, squares + value * value);
            (low, high) = (low.min(value), high.max(value));
        }
        let (mean, square) = (sum / count, squares / count);
        let deviation = (square - mean * mean).max(0.0).sqrt();
        Self { mean, rms: square.sqrt(), deviation, peak_to_peak: high - low }
    }
}

/// Errors of a calibration's rates against the truth, averaged over windows (°/h).
///
/// # Errors
/// What is wrong with the scenario.
pub fn rate_errors(
    calibration: &Arc<Calibration>,
    scenario: &Scenario,
    averaging_s: f64,
) -> Result<Windows, ScenarioErrors> {
    let mut windows = Windows::new(averaging_s);
    run(calibration, scenario, |step, tick| {
        let truth = step.truth.delta_angle;
        let error = [0, 1, 2].map(|axis| tick.delta_angle[axis] - truth[axis]);
        windows.add(error, tick.duration.as_s());
    })?;
    Ok(windows)
}
