//! I2 over the two paths of a tick: by the plan, sensor beside sensor, or by the general path, sensor after sensor. Frames,
//! first outputs and memory are the same bytes.

use isotherm_tests::lives;
use isotherm_tests::script::Scenario;
use proptest::prelude::*;

use super::{run, run_stream};

/// Compares the two; in how many of its steps the plan held.
fn same(scenario: &Scenario) -> usize {
    let mut planned = 0;
    let plain = run(scenario, |_, stream| {
        planned += usize::from(stream.unit().has_plan());
        false
    });
    let general = run_stream(scenario, scenario.stream().by_general_path(), |_, _| false);
    let differs = plain.frames.iter().zip(&general.frames).position(|(a, b)| a != b);
    assert!(plain == general, "{}: differs from frame {differs:?} on", scenario.name);
    assert!(plain.frames.len() > 20, "{}: it gives something out", scenario.name);
    planned
}

#[test]
fn i2_plain_ticks_give_the_bits_of_the_general_path() {
    for scenario in lives::all() {
        let planned = same(&scenario);
        assert!(
            planned > 100,
            "{}: the plan held in {planned} of {} steps",
            scenario.name,
            scenario.steps.len()
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn i2_whatever_happens_plain_ticks_give_the_bits_of_the_general_path(seed in any::<u64>()) {
        same(&lives::anything(seed, 300));
    }
}
