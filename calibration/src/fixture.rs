//! Simulated runs, and noise, for tests.

use isotherm_log::offline::unit_id;
use isotherm_log::text::LogEvent;
use isotherm_simulator::{Scenario, Simulation, Step};

use crate::runs::Run;

/// White noise of standard deviation 1, nearly normal, the same every time.
#[expect(clippy::cast_precision_loss, reason = "53 bits")]
pub(crate) fn noise() -> impl FnMut() -> f64 {
    let mut seed = 1_u64;
    move || {
        let mut sum = 0.0;
        for _ in 0..12 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (seed >> 11) as f64 / 9_007_199_254_740_992.0;
        }
        sum - 6.0
    }
}

/// What a scenario's unit reads; `each` sees every step with its truth.
pub(crate) fn events_seen(scenario: &Scenario, mut each: impl FnMut(&Step)) -> Vec<LogEvent> {
    let output = scenario.instrument.gyros.output_kind();
    let accel_output = scenario.instrument.accel_output_kind();
    let mut events = Vec::new();
    for step in Simulation::new(scenario).unwrap() {
        each(&step);
        events.extend(step.temperatures.into_iter().map(LogEvent::Temperature));
        if let (Some(output), Some(tick)) = (accel_output, step.accel) {
            events.push(LogEvent::Accel { output, tick });
        }
        events.push(LogEvent::Gyro { output, tick: step.gyro });
    }
    events
}

/// What a scenario's unit reads.
pub(crate) fn events(scenario: &Scenario) -> Vec<LogEvent> {
    events_seen(scenario, |_| ())
}

/// A scenario as a run in memory; `each` sees every step with its truth.
pub(crate) fn simulated(scenario: &Scenario, each: impl FnMut(&Step)) -> Run {
    let (name, unit) = (format!("{} simulated", scenario.unit), unit_id(&scenario.unit).unwrap());
    Run::of_events(name, unit, events_seen(scenario, each))
}
