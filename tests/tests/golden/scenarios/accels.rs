//! Accelerometer ticks that are missing or late, and outputs of other kinds.

use isotherm_correction::sample::OutputKind;
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Span;
use isotherm_protocol::key::{Input, RawStream};
use isotherm_tests::calibrations::compile;
use isotherm_tests::script::{Accels, Scenario, Script, Step};

use crate::plain::{RICH_CHANNELS, rich_parts, rich_script, told, with_outputs};

pub(crate) fn accelerometers_some_missing() -> Scenario {
    let mut script = rich_script(91);
    script.batch = 2;
    for percent in [5, 40, 90] {
        script.accels = Accels::Lost(percent);
        script.ticks(150);
    }
    script.accels = Accels::Before;
    script.ticks(60);
    told(script)
}

pub(crate) fn accelerometers_all_missing() -> Scenario {
    let mut script = rich_script(92);
    (script.batch, script.accels) = (3, Accels::Lost(100));
    script.ticks(200);
    let settings = UnitSettings { pairing_window: Span::ZERO, ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}

pub(crate) fn accelerometers_behind_and_late() -> Scenario {
    let mut script = rich_script(93);
    for (batch, accels) in [
        (1, Accels::After),
        (4, Accels::After),
        (1, Accels::Late(3)),
        (2, Accels::Late(4)),
        (2, Accels::Late(12)),
        (1, Accels::Late(10)),
        (5, Accels::Before),
    ] {
        (script.batch, script.accels) = (batch, accels);
        script.ticks(90);
    }
    script.accels = Accels::After;
    script.restart();
    script.ticks(60);
    script.restart();
    script.ticks(60);
    told(script)
}

/// Their ticks end up to half a tick beside those of the gyros: these still go together, or no longer.
pub(crate) fn accelerometers_beside_their_gyro_ticks() -> Scenario {
    let mut script = rich_script(94);
    script.batch = 1;
    let mut accels = Script::new(95, &script.calibration.clone(), &[]);
    accels.batch = 1;
    for by_ns in [0, 1_000_000, -1_000_000, 2_499_999, 2_500_000, -2_499_999, -2_500_000, 2_500_001] {
        for _ in 0..12 {
            (script.accels, accels.now_ns) = (Accels::Lost(100), script.now_ns + by_ns);
            let from = accels.steps.len();
            accels.ticks(1);
            let accel = accels.steps.drain(from..).find(|step| {
                let accel = Input::Raw(RawStream::Accel);
                matches!(step, Step::Frame(input, _) if *input == accel)
            });
            script.steps.extend(accel);
            script.ticks(1);
        }
    }
    script.accels = Accels::Before;
    script.ticks(40);
    told(script)
}

fn outputs(seed: u64, gyro: OutputKind, accel: OutputKind) -> Scenario {
    let parts = with_outputs(rich_parts(0.0), gyro, accel);
    let mut script = Script::new(seed, &compile(&parts), &RICH_CHANNELS);
    (script.batch, script.swing, script.switches, script.mishaps) = (4, 60.0, 110, 1);
    script.ticks(400);
    told(script)
}

pub(crate) fn outputs_counts_and_counts() -> Scenario {
    outputs(96, OutputKind::Counts, OutputKind::Counts)
}

pub(crate) fn outputs_counts_and_means() -> Scenario {
    outputs(97, OutputKind::Counts, OutputKind::Mean)
}

pub(crate) fn outputs_means_and_counts() -> Scenario {
    outputs(98, OutputKind::Mean, OutputKind::Counts)
}

pub(crate) fn outputs_means_and_means() -> Scenario {
    outputs(99, OutputKind::Mean, OutputKind::Mean)
}
