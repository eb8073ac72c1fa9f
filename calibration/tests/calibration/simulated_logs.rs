//! Small simulated logs as files.

use std::borrow::Borrow;
use std::fmt::Write as _;
use std::path::Path;

use isotherm_calibration::runs::Run;
use isotherm_log::message::{Message, Topic};
use isotherm_log::offline::unit_id;
use isotherm_log::recording::{RecordingOptions, RecordingWriter};
use isotherm_log::text::LogEvent;
use isotherm_protocol::raw::Batcher;
use isotherm_simulator::{Scenario, Simulation};

/// Chunks so short that a recording which is cut loses its end only.
const OPTIONS: RecordingOptions =
    RecordingOptions { compress: true, chunk_bytes: 20_000, overwrite: false, json: false };

/// The fibre-optic unit through the beginning of the judging profile, one tick a second.
pub(crate) fn fibre_optic(seed: u64, unit: &str, seconds: f64) -> Scenario {
    let profile = isotherm_simulator::presets::judging_profile();
    let scenario = isotherm_simulator::presets::fibre_optic_chamber(seed, profile);
    Scenario { unit: unit.into(), duration_s: seconds, tick_ns: 1_000_000_000, ..scenario }
}

/// Writes a scenario as a recording, 256 ticks a message.
pub(crate) fn record(path: &Path, scenario: &Scenario) {
    record_events(path, &scenario.unit, events(scenario));
}

/// What a scenario's unit reads.
pub(crate) fn events(scenario: &Scenario) -> impl Iterator<Item = LogEvent> + use<> {
    let output = scenario.instrument.gyros.output_kind();
    let accel_output = scenario.instrument.accel_output_kind();
    Simulation::new(scenario).unwrap().flat_map(move |step| {
        let accel = accel_output.zip(step.accel).map(|(output, tick)| LogEvent::Accel { output, tick });
        let temperatures = step.temperatures.into_iter().map(LogEvent::Temperature);
        let events: Vec<_> =
            temperatures.chain(accel).chain([LogEvent::Gyro { output, tick: step.gyro }]).collect();
        events
    })
}

/// The same of a run that goes on after so many ticks.
pub(crate) fn events_after(scenario: &Scenario, ticks: u64) -> impl Iterator<Item = LogEvent> {
    events(scenario).map(move |mut event| {
        match &mut event {
            LogEvent::Gyro { tick, .. } => tick.sequence += ticks,
            LogEvent::Accel { tick, .. } => tick.sequence += ticks,
            LogEvent::Temperature(_) => {}
        }
        event
    })
}

/// A run in memory.
pub(crate) fn run(name: &str, unit: &str, events: impl IntoIterator<Item = LogEvent>) -> Run {
    Run::of_events(name.to_owned(), unit_id(unit).unwrap(), events.into_iter().collect())
}

/// Writes what a unit read as a recording, 256 ticks a message.
pub(crate) fn record_events<E: Borrow<LogEvent>>(
    path: &Path,
    unit: &str,
    events: impl IntoIterator<Item = E>,
) {
    let mut writer = RecordingWriter::create(path, OPTIONS).unwrap();
    messages(unit, events, |message| writer.write(&message).unwrap());
    writer.finish().unwrap();
}

/// Writes what several units read as one recording, in the order of their times.
pub(crate) fn record_units(path: &Path, units: &[(&str, Vec<LogEvent>)]) {
    let mut all = Vec::new();
    for (unit, events) in units {
        messages(unit, events, |message| all.push(message));
    }
    all.sort_by_key(|message| message.received_ns);
    let mut writer = RecordingWriter::create(path, OPTIONS).unwrap();
    for message in &all {
        writer.write(message).unwrap();
    }
    writer.finish().unwrap();
}

/// What a unit read as messages.
fn messages<E: Borrow<LogEvent>>(
    unit: &str,
    events: impl IntoIterator<Item = E>,
    mut each: impl FnMut(Message),
) {
    let unit = unit_id(unit).unwrap();
    let mut batcher = Batcher::new(256);
    let mut write = |batcher: &mut Batcher| {
        while let Some(frame) = batcher.next_frame().transpose().unwrap() {
            let topic = Topic::Raw(unit.clone(), frame.stream);
            let received_ns = u64::try_from(frame.time.as_ns()).unwrap();
            each(Message { topic, received_ns, frame: frame.frame });
        }
    };
    for event in events {
        match event.borrow() {
            LogEvent::Temperature(reading) => batcher.temperature(*reading),
            LogEvent::Accel { output, tick } => batcher.accel(*output, tick.clone()),
            LogEvent::Gyro { output, tick } => {
                batcher.gyro(*output, tick.clone());
                write(&mut batcher);
            }
        }
    }
    batcher.flush();
    write(&mut batcher);
}

/// Writes a scenario as a text log with the mapping that reads it: mean rates in rad/s, accelerometers and temperatures as
/// they are.
pub(crate) fn write_text(log: &Path, mapping: &Path, scenario: &Scenario) {
    let mut text = String::new();
    let mut channels = Vec::new();
    let mut temperatures: Vec<f64> = Vec::new();
    for step in Simulation::new(scenario).unwrap() {
        for reading in &step.temperatures {
            let name = reading.channel.to_string();
            let place = channels.iter().position(|channel| *channel == name).unwrap_or_else(|| {
                channels.push(name);
                temperatures.push(0.0);
                channels.len() - 1
            });
            temperatures[place] = reading.raw;
        }
        write!(text, "{}", step.gyro.end_time.as_ns()).unwrap();
        let accel = step.accel.unwrap();
        for value in step.gyro.readings.iter().chain(accel.readings.iter()).chain(&temperatures) {
            write!(text, ",{value:?}").unwrap();
        }
        text.push('\n');
    }
    std::fs::write(log, text).unwrap();
    let sensors = |from: usize, unit: &str| {
        let one = |column| format!("{{ column = {column}, unit = \"{unit}\" }}");
        [from, from + 1, from + 2].map(one).join(", ")
    };
    let accels = match scenario.instrument.accel_output_kind().unwrap() {
        isotherm_correction::sample::OutputKind::Counts => ("counts", "counts"),
        isotherm_correction::sample::OutputKind::Mean => ("mean", "raw"),
    };
    let mut words = format!(
        "version = 1\n[[file]]\ndelimiter = \"comma\"\n[file.time]\ncolumn = 1\nunit = \"ns\"\ntick_ms = {}\n\
         [file.gyro]\noutput = \"mean\"\nsensors = [{}]\n[file.accel]\noutput = \"{}\"\nsensors = [{}]\n",
        scenario.tick_ns / 1_000_000,
        sensors(2, "rad_per_s"),
        accels.0,
        sensors(5, accels.1),
    );
    for (index, channel) in channels.iter().enumerate() {
        write!(
            words,
            "[[file.temperature]]\nchannel = \"{channel}\"\ncolumn = {}\nunit = \"raw\"\n",
            index + 8
        )
        .unwrap();
    }
    std::fs::write(mapping, words).unwrap();
}
