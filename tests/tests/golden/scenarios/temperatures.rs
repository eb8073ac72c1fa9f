//! Temperatures: absent, late, broken, quick.

use isotherm_correction::sample::{ChannelName, TemperatureReading};
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::encode;
use isotherm_protocol::key::{Input, RawStream};
use isotherm_protocol::raw::TemperatureBatch;
use isotherm_tests::lives::skewed;
use isotherm_tests::script::{Scenario, Script, Step};

use crate::plain::{rich_script, told};

/// None at first, then some, then none for longer than they hold.
pub(crate) fn temperatures_missing_and_stale() -> Scenario {
    let mut script = rich_script(61);
    (script.batch, script.thermometers) = (2, false);
    script.ticks(100);
    script.thermometers = true;
    script.ticks(300);
    script.thermometers = false;
    script.ticks(250);
    // One channel only.
    script.temperature("board", 33.0, 0);
    script.ticks(150);
    script.thermometers = true;
    script.ticks(200);
    told(script)
}

/// Readings at times at which they are just not stale, and just stale: the limit is half a second, the delay 50 ms.
pub(crate) fn temperatures_at_the_edge_of_stale() -> Scenario {
    let mut script = rich_script(62);
    (script.batch, script.thermometers) = (1, false);
    for edge_ns in [0, -1, 1, 5_000_000, -5_000_000] {
        script.temperature("t", 24.5, edge_ns);
        script.temperature("board", 31.0, edge_ns);
        script.ticks(125);
    }
    told(script)
}

pub(crate) fn temperature_spikes() -> Scenario {
    let mut script = rich_script(63);
    script.batch = 2;
    for raw in [60.0, -30.0, 44.5, 43.5, 1e6, f64::NAN, f64::INFINITY, -99.0, 151.0] {
        script.ticks(30);
        script.temperature("t", raw, -2_000_000);
    }
    // A step that stays is believed.
    script.channels[0].1 = 55.0;
    script.ticks(300);
    told(script)
}

pub(crate) fn temperatures_unknown_late_and_out_of_order() -> Scenario {
    let mut script = rich_script(64);
    script.batch = 2;
    for round in 0..12 {
        script.ticks(20);
        script.temperature("nobody", 21.0, 0);
        script.temperature("t", 24.3, -30_000_000 * round);
        script.temperature("t", 24.2, -10_000_000 * round - 60_000_000);
        script.temperature("board", 30.5, 40_000_000 * round);
        script.temperature("board", 30.6, 10_000_000 * round);
    }
    script.ticks(200);
    let settings = UnitSettings { temperature_delay: Span::ZERO, ..UnitSettings::default() };
    script.scenario("", settings, Vec::new())
}

/// More readings from the future than are kept.
pub(crate) fn temperatures_too_many() -> Scenario {
    let mut script = rich_script(65);
    script.ticks(40);
    let names: Vec<String> = (0..14).map(|index| format!("c{index}")).collect();
    let names = ["t", "board"].into_iter().chain(names.iter().map(String::as_str));
    let channels: Vec<ChannelName> = names.map(|name| name.try_into().unwrap()).collect();
    for batch in 0..3 {
        let time = |tick: i64| script.now_ns + 4_000_000_000_000 + (batch * 4096 + tick) * 1_000_000;
        let of_time = |tick| {
            let time = Timestamp::from_ns(time(tick));
            channels.iter().map(move |&channel| TemperatureReading { channel, time, raw: 24.0 })
        };
        let batch = TemperatureBatch { readings: (0..4096).flat_map(of_time).collect() };
        script.steps.push(Step::Frame(Input::Raw(RawStream::Temperature), encode(&batch).unwrap()));
    }
    script.ticks(40);
    script.restart();
    script.ticks(40);
    told(script)
}

/// Up, to a stand, down, and up again, so that every branch of the thermal terms is gone through; lags, over a restart too.
pub(crate) fn thermal_branches_and_lags() -> Scenario {
    let mut script = rich_script(66);
    script.batch = 5;
    for (raw, warming) in [(24.0, 0.2), (28.0, 0.0), (50.0, -0.15), (30.0, -0.01), (20.0, 0.1)] {
        script.channels[0].1 = raw;
        script.warming = warming;
        script.ticks(250);
    }
    script.restart();
    script.ticks(200);
    told(script)
}

/// Outside the temperatures that the terms were fitted over.
pub(crate) fn temperatures_outside_the_fitted_range() -> Scenario {
    let mut script = Script::new(67, &skewed(0.0), &[("t", 85.0)]);
    (script.batch, script.warming) = (4, 0.5);
    script.ticks(700);
    script.channels[0].1 = -59.0;
    script.ticks(400);
    told(script)
}
