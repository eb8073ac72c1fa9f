//! A unit's state machine, event by event, and what each did.

use isotherm_correction::sample::{CorrectedTick, LasingMode};
use isotherm_correction::unit::{ChannelReport, Counters, Unit};
use isotherm_correction::units::{AngularRate, SpecificForce};
use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::key::{Input, RawStream};
use isotherm_protocol::raw::GyroBatch;
use isotherm_protocol::stream::UnitStream;
use serde::Serialize;

use super::{Done, Replica, entry_words};
use crate::error::Error;
use crate::part::{LogFiles, Messages, Part};
use crate::streams::decoded::Decoded;

/// What happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum What {
    /// A frame came in.
    Frame {
        /// Of which input.
        input: &'static str,
        /// Sequence number of its first tick, of gyro and accelerometer frames.
        first_sequence: Option<u64>,
        /// How many ticks or readings it has.
        ticks: usize,
        /// End of the first tick, or time of the first reading (ns on the producer's clock).
        from_ns: Option<i64>,
        /// End of the last tick, or time of the last reading (ns on the producer's clock).
        to_ns: Option<i64>,
        /// Why it could not be read, if so.
        bad: Option<String>,
    },
    /// An entry of the journal.
    Entry {
        /// Its number.
        number: u64,
        /// What it says.
        words: String,
        /// Left out on purpose.
        left_out: bool,
    },
    /// Something that is to be said of the recording.
    Notice {
        /// It in words.
        words: String,
    },
    /// The log is over, and what waited was released.
    Flushed,
}

/// A temperature as it is applied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Temperature {
    /// Name of the channel.
    pub channel: String,
    /// Smoothed (°C); `None` before the first reading.
    pub temperature_deg_c: Option<f64>,
    /// Its rate (°C/s), likewise.
    pub rate_deg_c_per_s: Option<f64>,
    /// Missing, rejected or too old.
    pub stale: bool,
    /// Its derivatives do not rest on readings alone yet.
    pub warming_up: bool,
}

/// A tick that came out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TickOut {
    /// Sequence number of the (last) raw gyro tick.
    pub sequence: u64,
    /// Its end (ns on the producer's clock).
    pub end_time_ns: i64,
    /// Raw ticks missing before it.
    pub missed: u64,
    /// Angle increments (rad).
    pub delta_angle_rad: [f64; 3],
    /// Velocity increments (m/s).
    pub delta_velocity_m_per_s: [f64; 3],
    /// Lasing mode: 1 or −1.
    pub mode: Option<i8>,
    /// Its flags, by name.
    pub flags: Vec<&'static str>,
    /// Counter of the calibration that made it.
    pub revision: u64,
}

/// A counter that has grown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Counted {
    /// Its name.
    pub name: &'static str,
    /// By how much.
    pub by: u64,
    /// To what.
    pub to: u64,
}

/// One event and what the state machine did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// Number of the event, from 1.
    pub number: u64,
    /// When it was received (ns since 1970-01-01 UTC; of a text log ns on the producer's clock, counted from its beginning where that is before 0).
    pub received_ns: u64,
    /// What happened.
    pub what: What,
    /// The unit's state afterwards; `None` while there is no stream.
    pub state: Option<&'static str>,
    /// Counter of the calibration in force; 0 while there is none.
    pub revision: u64,
    /// Counter of the calibration that waits for its tick.
    pub pending: Option<u64>,
    /// Gyro ticks that wait inside for their accelerometer tick or a missing neighbour.
    pub waiting_ticks: usize,
    /// Ticks that came out.
    pub out: Vec<TickOut>,
    /// Temperatures as they are applied.
    pub temperatures: Vec<Temperature>,
    /// Bias that is subtracted about each case axis (°/h), all terms; `None` before the first corrected tick.
    pub bias_deg_per_h: Option<[f64; 3]>,
    /// Bias that is subtracted along each case axis (mg), likewise.
    pub bias_mg: Option<[f64; 3]>,
    /// Counters that have grown.
    pub counters: Vec<Counted>,
}

/// Goes through the events of one unit.
#[derive(Debug)]
pub struct Stepper {
    messages: Messages,
    replica: Replica,
    number: u64,
    received_ns: u64,
    /// Events received earlier are gone through without a word (ns since 1970-01-01 UTC).
    from_ns: u64,
    over: bool,
    /// The last gyro tick that [`Stepper::go_to`] passed over.
    passed: Option<u64>,
    counters: Counters,
    out: Vec<CorrectedTick>,
}

impl Stepper {
    /// Over the part of a log, whose messages are of the replica's unit alone; what comes before the part is gone through too.
    ///
    /// # Errors
    /// As [`LogFiles::from_beginning`].
    pub fn open(mut files: LogFiles, mut part: Part, replica: Replica) -> Result<Self, Error> {
        let from_ns = files.from_beginning(&mut part)?;
        let (messages, counters) = (files.open(&part)?, Counters::default());
        Ok(Self {
            messages,
            replica,
            number: 0,
            received_ns: 0,
            from_ns,
            over: false,
            passed: None,
            counters,
            out: Vec::new(),
        })
    }

    /// The next event.
    ///
    /// # Errors
    /// Those of reading.
    pub fn next_step(&mut self) -> Result<Option<Step>, Error> {
        Ok(self.advance()?.map(|done| self.describe(&done)))
    }

    /// Goes on, without a word, to the first frame that has gyro tick `sequence` or a later one.
    ///
    /// # Errors
    /// Those of reading.
    pub fn go_to(&mut self, sequence: u64) -> Result<Option<Step>, Error> {
        while let Some(done) = self.advance()? {
            if let Done::Frame { input: Input::Raw(RawStream::Gyro), frame, .. } = &done
                && let Ok(batch) = codec::decode::<GyroBatch>(frame)
                && let Some(last) = batch.ticks.last()
            {
                if last.sequence >= sequence {
                    return Ok(Some(self.describe(&done)));
                }
                self.passed = Some(last.sequence);
            }
        }
        Ok(None)
    }

    /// The last gyro tick that [`Self::go_to`] passed over.
    #[must_use]
    pub fn passed(&self) -> Option<u64> {
        self.passed
    }

    /// The replica.
    #[must_use]
    pub fn replica(&self) -> &Replica {
        &self.replica
    }

    /// Does the next thing.
    fn advance(&mut self) -> Result<Option<Done>, Error> {
        loop {
            self.counters = self.replica.stream().map(|stream| *stream.unit().counters()).unwrap_or_default();
            self.out.clear();
            let out = &mut self.out;
            if let Some(done) = self.replica.step(&mut |stream| out.extend(stream.take_ready())) {
                if let Some(stream) = self.replica.stream_mut() {
                    self.out.extend(stream.take_ready());
                }
                if let Done::Frame { received_ns, .. } | Done::Entry { received_ns, .. } = &done {
                    self.received_ns = *received_ns;
                }
                self.number += 1;
                if self.received_ns < self.from_ns {
                    continue;
                }
                return Ok(Some(done));
            }
            match self.messages.next_message()? {
                Some(message) => self.replica.take(message),
                None if self.over => return Ok(None),
                None => {
                    self.over = true;
                    self.replica.finish();
                }
            }
        }
    }

    fn describe(&self, done: &Done) -> Step {
        let what = match done {
            Done::Frame { input, frame, taken, .. } => in_frame(*input, frame, taken),
            Done::Entry { entry, left_out, .. } => {
                What::Entry { number: entry.number, words: entry_words(entry), left_out: *left_out }
            }
            Done::Notice(notice) => What::Notice { words: notice.to_string() },
            Done::Flushed => What::Flushed,
        };
        let stream = self.replica.stream();
        let unit = stream.map(UnitStream::unit);
        let counters = unit.map(|unit| *unit.counters()).unwrap_or_default();
        let grown = self.counters.iter().zip(counters.iter());
        let grown = grown.filter(|((_, before), (_, after))| before != after);
        let applied = unit.and_then(Unit::applied);
        Step {
            number: self.number,
            received_ns: self.received_ns,
            what,
            state: unit.map(|unit| unit.state().name()),
            revision: stream.map_or(0, |stream| stream.revision().counter),
            pending: unit.and_then(Unit::pending).map(|(counter, _)| counter),
            waiting_ticks: unit.map_or(0, Unit::waiting_ticks),
            out: self.out.iter().map(tick_out).collect(),
            temperatures: unit.into_iter().flat_map(Unit::channels).map(temperature).collect(),
            bias_deg_per_h: applied.map(|applied| {
                applied.angular_rate.map(|rate| AngularRate::from_rad_per_s(rate).as_deg_per_h())
            }),
            bias_mg: applied.map(|applied| {
                applied.specific_force.map(|force| SpecificForce::from_m_per_s2(force).as_g() * 1e3)
            }),
            counters: grown
                .map(|((name, before), (_, after))| Counted {
                    name,
                    by: after.saturating_sub(before),
                    to: after,
                })
                .collect(),
        }
    }
}

fn temperature(channel: ChannelReport) -> Temperature {
    Temperature {
        channel: channel.name.to_string(),
        temperature_deg_c: channel.state.map(|state| state.temperature),
        rate_deg_c_per_s: channel.state.map(|state| state.rate),
        stale: channel.stale,
        warming_up: channel.warming_up,
    }
}

fn tick_out(tick: &CorrectedTick) -> TickOut {
    TickOut {
        sequence: tick.sequence,
        end_time_ns: tick.end_time.as_ns(),
        missed: tick.missed,
        delta_angle_rad: tick.delta_angle,
        delta_velocity_m_per_s: tick.delta_velocity,
        mode: tick.mode.map(|mode| if mode == LasingMode::Plus { 1 } else { -1 }),
        flags: tick.flags.iter_names().map(|(name, _)| name).collect(),
        revision: tick.revision,
    }
}

/// What is in a frame.
fn in_frame(input: Input, frame: &[u8], taken: &Result<(), CodecError>) -> What {
    let bad = taken.as_ref().err().map(ToString::to_string);
    let decoded = Decoded::of_input(input, frame).ok();
    let (first_sequence, ticks) = match &decoded {
        Some(Decoded::Gyro(batch)) => (batch.ticks.first().map(|first| first.sequence), batch.ticks.len()),
        Some(Decoded::Accel(batch)) => (batch.ticks.first().map(|first| first.sequence), batch.ticks.len()),
        Some(Decoded::Temperature(batch)) => (None, batch.ticks().count()),
        Some(Decoded::Health(batch)) => (None, batch.ticks.len()),
        other => (None, usize::from(other.is_some())),
    };
    let times = decoded.and_then(|decoded| decoded.times());
    let [from_ns, to_ns] = [0, 1].map(|end| times.map(|times| times[end].as_ns()));
    What::Frame { input: input.name(), first_sequence, ticks, from_ns, to_ns, bad }
}
