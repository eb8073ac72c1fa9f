//! What comes out of a stream, as digests.

use std::fmt::Write as _;

use isotherm_correction::sample::{CorrectedTick, LasingMode, SensorFlags};
use isotherm_protocol::codec::decode;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::stream::{InForce, Label, UnitStream};
use isotherm_tests::script::{Scenario, Step};
use sha2::{Digest as _, Sha256};

use crate::look;

/// Steps between two looks at what a stream knows.
const LOOK_EVERY: usize = 64;

/// A corrected tick: its number, and what is left of its bits.
pub(crate) struct Tick {
    pub(crate) sequence: u64,
    pub(crate) digest: u8,
}

/// Something beside ticks that came out.
pub(crate) struct Entry {
    pub(crate) text: String,
    pub(crate) digest: u8,
}

/// Everything that came out.
#[derive(Default)]
pub(crate) struct Recording {
    pub(crate) ticks: Vec<Tick>,
    pub(crate) entries: Vec<Entry>,
    frames: Sha256,
    journal: Sha256,
    /// What the last frame said beside its ticks.
    said: String,
}

impl Recording {
    /// Takes a corrected frame.
    pub(crate) fn frame(&mut self, frame: &[u8]) {
        self.frames.update((frame.len() as u64).to_le_bytes());
        self.frames.update(frame);
        let batch: CorrectedBatch = decode(frame).unwrap();
        let said = said(&batch);
        if said != self.said {
            let from = self.ticks.len();
            self.entry(format!("frames from tick {from} on: {said}"));
            self.said = said;
        }
        for tick in &batch.ticks {
            self.ticks.push(Tick { sequence: tick.sequence, digest: head(&bits(tick)) });
        }
    }

    /// Takes something else.
    pub(crate) fn entry(&mut self, text: String) {
        self.journal.update(text.as_bytes());
        self.journal.update(b"\n");
        let digest = head(text.as_bytes());
        self.entries.push(Entry { text, digest });
    }

    /// SHA-256 of all frames, and of all entries.
    pub(crate) fn digests(&self) -> [String; 2] {
        [&self.frames, &self.journal].map(|sha| hex(&sha.clone().finalize()))
    }
}

/// Drives a stream through a scenario.
pub(crate) fn record(scenario: &Scenario) -> Recording {
    let mut recording = Recording::default();
    let mut stream = scenario.stream();
    for (index, step) in scenario.steps.iter().enumerate() {
        if !matches!(step, Step::Frame(..)) {
            // What it ends may not be seen any more behind it.
            look::at(&stream, index, &mut recording);
        }
        if let Some(said) = give(&mut stream, step) {
            recording.entry(format!("step {index}: {said}"));
        }
        let first = take_out(&mut stream, &mut recording);
        if first || index % LOOK_EVERY == LOOK_EVERY - 1 {
            look::at(&stream, index, &mut recording);
        }
    }
    look::at(&stream, scenario.steps.len(), &mut recording);
    look::at_the_end(&stream, &mut recording);
    recording
}

/// Does one step; what there is to say of it.
pub(crate) fn give(stream: &mut UnitStream, step: &Step) -> Option<String> {
    match step {
        // A bad frame is part of what happens.
        Step::Frame(input, frame) => stream.receive(*input, frame).err().map(|_| "bad frame".to_owned()),
        Step::Event(event) => {
            let words =
                stream.carry_out(event).map_or_else(|error| error.to_string(), |()| "done".to_owned());
            Some(format!("{}: {words}", event.name()))
        }
        Step::Give(change) => {
            let replaced = stream.schedule(change.clone(), Label::default());
            Some(format!("given revision {}: replaces {replaced:?}", change.revision))
        }
    }
}

/// Takes everything out; whether there was the first output of a revision.
fn take_out(stream: &mut UnitStream, recording: &mut Recording) -> bool {
    let (mut frame, mut first) = (Vec::new(), false);
    while stream.next_frame(&mut frame).is_some() {
        recording.frame(&frame);
    }
    while let Some(InForce { revision, series, sequence, end_time_ns }) = stream.take_in_force() {
        let counter = revision.counter;
        first = true;
        recording.entry(format!("revision {counter} in force: {series} {sequence} {end_time_ns}"));
    }
    first
}

/// What a frame says beside its ticks.
fn said(batch: &CorrectedBatch) -> String {
    let mut said = format!("{} {} {}", batch.unit, batch.revision.counter, hex(&batch.revision.digest));
    for applied in &batch.temperatures {
        let temperature = look::bits([applied.temperature_deg_c, applied.rate_deg_c_per_s]);
        write!(said, " {} {temperature}", applied.channel).unwrap();
    }
    said
}

/// The bits of a tick, from numbers alone: names of types and fields may change.
fn bits(tick: &CorrectedTick) -> Vec<u8> {
    let mut bits = Vec::new();
    let mode = match tick.mode {
        None => 0,
        Some(LasingMode::Plus) => 1,
        Some(LasingMode::Minus) => 2,
    };
    let times = [tick.end_time.as_ns(), tick.duration.as_ns()].map(i64::cast_unsigned);
    for number in [tick.sequence, times[0], times[1], tick.missed] {
        bits.extend(number.to_le_bytes());
    }
    for number in [tick.ticks, tick.flags.bits(), mode] {
        bits.extend(number.to_le_bytes());
    }
    for value in tick.delta_angle.iter().chain(&tick.delta_velocity) {
        bits.extend(value.to_bits().to_le_bytes());
    }
    for flags in [&tick.gyro_flags, &tick.accel_flags] {
        bits.push(u8::try_from(flags.len()).unwrap());
        bits.extend(flags.iter().map(SensorFlags::bits));
    }
    for parity in [&tick.gyro_parity, &tick.accel_parity] {
        bits.push(u8::try_from(parity.len()).unwrap());
        bits.extend(parity.iter().flat_map(|value| value.to_bits().to_le_bytes()));
    }
    bits
}

fn head(bytes: &[u8]) -> u8 {
    Sha256::digest(bytes)[0]
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}
