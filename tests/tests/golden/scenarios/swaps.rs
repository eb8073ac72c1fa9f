//! Changes of calibration: when, over what time, to what.

use std::sync::Arc;

use isotherm_correction::sample::OutputKind;
use isotherm_correction::unit::{At, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{Feature, PutTerms, compile, constant, polynomial};
use isotherm_tests::lives::{FULL_CHANNELS, full, skewed};
use isotherm_tests::script::{Scenario, Script};

use crate::plain::{redundant, rich, rich_parts, rich_script, told, with_outputs, without_accels};

pub(crate) fn swaps_at_once_at_a_sequence_and_at_a_time() -> Scenario {
    let mut script = rich_script(101);
    script.batch = 3;
    script.ticks(90);
    script.give(rich(0.2), At::NextTick, Span::ZERO);
    script.ticks(60);
    let (next, now_ns) = (script.next, script.now_ns);
    script.give(rich(0.4), At::Sequence(next + 31), Span::ZERO);
    script.ticks(60);
    script.give(rich(-0.4), At::TimeNs(now_ns + 450_000_000), Span::ZERO);
    script.ticks(60);
    // Between two ticks, in a gap, and in the past.
    script.give(rich(0.1), At::TimeNs(script.now_ns + 100_000_001), Span::ZERO);
    script.ticks(60);
    script.give(rich(0.2), At::Sequence(script.next + 5), Span::ZERO);
    script.gap(20);
    script.ticks(30);
    script.give(rich(0.3), At::Sequence(3), Span::from_ms(20));
    script.ticks(30);
    // The run that it was meant for ends.
    script.give(rich(0.5), At::Sequence(script.next + 900), Span::from_ms(500));
    script.ticks(30);
    script.restart();
    script.ticks(60);
    told(script)
}

pub(crate) fn swaps_slewed() -> Scenario {
    let mut script = rich_script(102);
    (script.batch, script.switches) = (2, 90);
    script.give(rich(0.7), At::NextTick, Span::from_ms(400));
    script.ticks(60);
    script.give(rich(0.3), At::NextTick, Span::from_ms(500));
    script.ticks(140);
    // Twice in mid-way.
    for tweak in [0.9, -0.9, 0.1] {
        let mut parts = rich_parts(tweak);
        parts.gyro_orientation.rows[0] = [1.0, 1e-4 * tweak, 0.0];
        parts.accel_orientation.as_mut().unwrap().rows[1] = [2e-4 * tweak, 1.0, 0.0];
        script.give(compile(&parts), At::NextTick, Span::from_ms(600));
        script.ticks(50);
    }
    script.gap(70);
    script.ticks(60);
    script.give(rich(0.0), At::NextTick, Span::from_ms(600));
    script.ticks(40);
    script.restart();
    script.ticks(60);
    told(script)
}

/// Lags, filter, channels and axes that are carried over a swap, and those that are not.
pub(crate) fn swaps_with_other_terms_and_channels() -> Scenario {
    let mut script = rich_script(103);
    (script.batch, script.warming) = (5, 0.1);
    let base = rich_parts(0.0);
    let mut other_lags = base.clone();
    other_lags.gyros[0].terms.lags([(2.0, constant(3e-4))]);
    other_lags.accels[1].terms.lags([(0.4, constant(2e-3))]);
    let mut other_filter = base.clone();
    other_filter.filter.smoothing_s = 0.3;
    let mut other_channel = base.clone();
    other_channel.channels[0].conversion = vec![0.5, 1.0];
    let mut following_the_board = base.clone();
    following_the_board.gyros[1].channel = Some(1);
    following_the_board.gyro_orientation_channels = vec![0, 1];
    let mut one_gyro = base.clone();
    one_gyro.gyros[2].terms.curve(Feature::One, polynomial(&[3e-4]));
    let mut stiff = base.clone();
    stiff.gyro_orientation.slopes_per_deg_c.clear();
    for parts in
        [&other_lags, &other_filter, &base, &other_channel, &following_the_board, &one_gyro, &stiff, &base]
    {
        script.ticks(80);
        script.give(compile(parts), At::NextTick, Span::from_ms(150));
    }
    script.ticks(80);
    told(script)
}

pub(crate) fn swaps_to_another_number_of_sensors() -> Scenario {
    let mut script = rich_script(104);
    script.batch = 2;
    let sets = [
        redundant(6, 10),
        rich(0.0),
        compile(&without_accels(rich_parts(0.0))),
        compile(&with_outputs(rich_parts(0.0), OutputKind::Counts, OutputKind::Mean)),
        redundant(8, 10),
        full(),
    ];
    for (index, set) in sets.into_iter().enumerate() {
        script.ticks(50);
        // The old producer goes on for a while; the new one begins where the change does.
        let at = if index % 2 == 0 { At::NextTick } else { At::Sequence(script.next + 10) };
        script.give(Arc::clone(&set), at, Span::from_ms(100));
        script.ticks(if index == 2 { 0 } else { 10 });
        script.calibration = set;
    }
    script.ticks(80);
    told(script)
}

pub(crate) fn swaps_to_the_same_document() -> Scenario {
    let mut script = Script::new(105, &full(), &FULL_CHANNELS);
    (script.batch, script.switches) = (4, 80);
    for slew_ms in [0, 0, 300] {
        script.ticks(160);
        script.give(full(), At::NextTick, Span::from_ms(slew_ms));
    }
    script.ticks(160);
    told(script)
}

/// At each tick of a transition, and of what follows it.
pub(crate) fn swaps_in_the_middle_of_a_mode_transition() -> Scenario {
    let mut script = rich_script(106);
    (script.batch, script.switches) = (1, 40);
    for place in 0..10 {
        script.ticks(40 + 40 - script.next % 40 + place);
        let slew = if place % 2 == 0 { Span::ZERO } else { Span::from_ms(40) };
        script.give(if place % 3 == 0 { rich(0.3) } else { rich(0.0) }, At::NextTick, slew);
    }
    script.ticks(40);
    told(script)
}

pub(crate) fn swaps_replaced_before_their_time() -> Scenario {
    let mut script = rich_script(107);
    script.batch = 2;
    for (tweak, ticks) in [(0.1, 50), (0.2, 40), (0.3, 90), (0.4, 10)] {
        script.ticks(20);
        script.give(rich(tweak), At::Sequence(script.next + ticks), Span::ZERO);
    }
    script.ticks(40);
    script.give(rich(0.5), At::Sequence(script.next + 40), Span::ZERO);
    script.ticks(10);
    script.give(rich(0.6), At::NextTick, Span::from_ms(100));
    script.ticks(60);
    told(script)
}

/// Estimates of the drift, and which of them a change leaves.
pub(crate) fn swaps_and_the_drift() -> Scenario {
    let sets = [skewed(0.0), skewed(0.0), skewed(0.01), redundant(6, 10), skewed(0.0)];
    let mut script = Script::new(108, &sets[0], &[("t", 24.0)]);
    (script.batch, script.tick, script.scatter) = (4, Span::from_ms(50), 0.5);
    for set in &sets {
        for _ in 0..3 {
            script.ticks(40);
            script.reference();
        }
        script.ticks(40);
        script.give(Arc::clone(set), At::NextTick, Span::from_ms(500));
    }
    script.ticks(60);
    let settings = UnitSettings { subtract_drift: true, ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}
