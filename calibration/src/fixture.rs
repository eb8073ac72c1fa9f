//! Simulated runs for tests.

use isotherm_log::offline::unit_id;
use isotherm_log::text::LogEvent;
use isotherm_simulator::{Scenario, Simulation, Step};

use crate::run::Run;

/// A scenario as a run in memory; `each` sees every step with its truth.
pub(crate) fn simulated(scenario: &Scenario, mut each: impl FnMut(&Step)) -> Run {
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
    Run::of_events(format!("{} simulated", scenario.unit), unit_id(&scenario.unit).unwrap(), events)
}
