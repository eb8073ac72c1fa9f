//! I2 over the two paths of a tick: by the plan, sensor beside sensor, or by the general path, sensor after sensor. Frames,
//! first outputs and memory are the same bytes.

use proptest::prelude::*;

use super::script::Scenario;
use super::{run, run_stream, scenarios};

fn same(scenario: &Scenario) {
    let plain = run(scenario, |_, _| false);
    let general = run_stream(scenario, scenario.stream().by_general_path(), |_, _| false);
    let differs = plain.frames.iter().zip(&general.frames).position(|(a, b)| a != b);
    assert!(plain == general, "{}: differs from frame {differs:?} on", scenario.name);
    assert!(plain.frames.len() > 20, "{}: it gives something out", scenario.name);
}

#[test]
fn i2_plain_ticks_give_the_bits_of_the_general_path() {
    scenarios::all().iter().for_each(same);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn i2_whatever_happens_plain_ticks_give_the_bits_of_the_general_path(seed in any::<u64>()) {
        same(&scenarios::anything(seed, 300));
    }
}
