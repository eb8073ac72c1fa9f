//! A simulated log read back equals the simulation, to the bit.

use std::io::Write;

use isotherm_correction::sample::{GyroTick, LasingMode};
use isotherm_log::mapping::Mapping;
use isotherm_log::text::{LogEvent, LogReader};
use isotherm_replay_tool::simulated::LogWriter;
use isotherm_simulator::{Scenario, Simulation, presets};

/// Events of the simulation itself, in the order of the log.
fn simulated(scenario: &Scenario) -> Vec<LogEvent> {
    let output = scenario.instrument.gyros.output_kind();
    let mut events = Vec::new();
    for step in Simulation::new(scenario).unwrap() {
        events.extend(step.temperatures.iter().copied().map(LogEvent::Temperature));
        if let (Some(tick), Some(output)) = (step.accel, scenario.instrument.accel_output_kind()) {
            events.push(LogEvent::Accel { output, tick });
        }
        events.push(LogEvent::Gyro { output, tick: step.gyro });
    }
    events
}

/// Events of the log that is written of it.
fn read_back(scenario: &Scenario) -> Vec<LogEvent> {
    let mut writer = LogWriter::of(scenario).unwrap();
    let mapping =
        Mapping::parse(&writer.mapping(), "mapping.toml").unwrap_or_else(|problems| panic!("{problems:?}"));
    let mut file = tempfile::NamedTempFile::new().unwrap();
    writer.write_header(&mut file).unwrap();
    for step in Simulation::new(scenario).unwrap() {
        writer.write(&step, &mut file).unwrap();
    }
    file.flush().unwrap();
    let reader = LogReader::open(&mapping, &[file.path().to_path_buf()]).unwrap();
    reader.map(|event| event.unwrap_or_else(|error| panic!("{error}"))).collect()
}

/// Bits of everything that floats.
fn bits(event: &LogEvent) -> Vec<u64> {
    let values: &[f64] = match event {
        LogEvent::Gyro { tick, .. } => &tick.readings,
        LogEvent::Accel { tick, .. } => &tick.readings,
        LogEvent::Temperature(reading) => &[reading.raw],
    };
    // A count of −0 is written as a count of 0, which is what it is.
    values.iter().map(|value| if *value == 0.0 { 0 } else { value.to_bits() }).collect()
}

/// Checks one scenario, cut to this duration.
fn check(name: &str, scenario: Scenario, duration_s: f64) {
    let scenario = Scenario { duration_s, ..scenario };
    let (expected, found) = (simulated(&scenario), read_back(&scenario));
    assert_eq!(found.len(), expected.len(), "{name}");
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found, expected, "{name}");
        assert_eq!(bits(found), bits(expected), "{name}");
    }
}

#[test]
fn every_kind_of_unit_is_read_back_to_the_bit() {
    check("zeeman", presets::zeeman_sine(3), 30.0);
    check("fibre-optic", presets::fibre_optic_chamber(4, presets::judging_profile()), 10.0);
    check("mems", presets::mems_chamber(5), 20.0);
    check("skewed", presets::skewed_six(6, None), 10.0);
    check("jitter, another epoch", jittered(), 10.0);
}

/// Ticks of uneven length on a clock that counts from 1970.
fn jittered() -> Scenario {
    let scenario = presets::zeeman_sine(7);
    Scenario { start_ns: 1_763_712_000_123_456_789, tick_jitter_ns: scenario.tick_ns / 10, ..scenario }
}

#[test]
fn modes_and_switches_are_in_the_log() {
    let scenario = Scenario { duration_s: 30.0, ..presets::zeeman_sine(3) };
    let ticks: Vec<GyroTick> = read_back(&scenario)
        .into_iter()
        .filter_map(|event| match event {
            LogEvent::Gyro { tick, .. } => Some(tick),
            _ => None,
        })
        .collect();
    assert!(ticks.iter().any(|tick| tick.switch_command));
    for mode in [LasingMode::Plus, LasingMode::Minus] {
        assert!(ticks.iter().any(|tick| tick.mode == Some(mode)));
    }
}
