//! One unit of a log, as far as a page shows it.

use std::collections::BTreeMap;

use isotherm_correction::sample::{LasingMode, OutputKind, SensorFlags, TickFlags};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick, Revision};
use isotherm_protocol::digest::Digits;
use isotherm_protocol::document::Document;
use isotherm_protocol::journal::{Joiner, JournalEvent, JournalPart};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};
use isotherm_protocol::status::{Output, Status};

use super::nominal::{DEG_PER_H, Nominal};
use super::time::{Clock, Stream};
use super::track::Track;
use crate::date::seconds;
use crate::message::Message;
use crate::streams::decoded::{Decoded, decode};
use isotherm_pages::Ink;

/// Most marks, stretches or channels of each kind; further ones are counted.
const MAX_LISTED: usize = 2000;
/// Most sensors of one kind.
const SENSORS: usize = isotherm_correction::sample::MAX_SENSORS;
/// First bit of the flags of any gyro, behind those of the tick.
pub(super) const GYRO_FLAGS: u32 = u16::BITS - TickFlags::all().bits().leading_zeros();
/// Flags of a sensor; its first, `VALID`, is not shown.
const SENSOR_FLAGS: u32 = u8::BITS - SensorFlags::all().bits().leading_zeros() - 1;
/// First bit of the flags of any accelerometer.
pub(super) const ACCEL_FLAGS: u32 = GYRO_FLAGS + SENSOR_FLAGS;
/// Bit of the lasing mode +1.
pub(super) const MODE_PLUS: u32 = ACCEL_FLAGS + SENSOR_FLAGS;
/// Bit of the lasing mode −1.
pub(super) const MODE_MINUS: u32 = MODE_PLUS + 1;
/// Bit of a switch that is commanded.
pub(super) const SWITCH: u32 = MODE_MINUS + 1;
const _: () = assert!(SWITCH < u32::BITS, "all flags of a tick have a bit of their own");

/// What is the case from some time on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Since {
    pub(super) at_ns: i64,
    pub(super) label: String,
    pub(super) ink: Ink,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Happening {
    pub(super) at_ns: i64,
    pub(super) kind: &'static str,
    pub(super) words: String,
    pub(super) ink: Ink,
}

/// Raw ticks of one kind of sensor.
#[derive(Debug)]
pub(super) struct RawTrack {
    pub(super) kind: OutputKind,
    /// Most sensors in a tick.
    pub(super) sensors: usize,
    pub(super) track: Track,
    next_sequence: u64,
}

/// One unit.
#[derive(Debug, Default)]
pub(super) struct UnitPlot {
    detail: usize,
    pub(super) clock: Clock,
    /// Rates (°/h), specific forces (m/s²), flags.
    pub(super) corrected: Option<Track>,
    pub(super) gyro: Option<RawTrack>,
    pub(super) accel: Option<RawTrack>,
    /// Temperatures as they were sent, by channel.
    pub(super) readings: BTreeMap<String, Track>,
    /// Temperatures as they were applied (°C), by channel.
    pub(super) applied: BTreeMap<String, Track>,
    pub(super) states: Vec<Since>,
    pub(super) revisions: Vec<Since>,
    pub(super) happenings: Vec<Happening>,
    /// Happenings beyond those listed.
    pub(super) unlisted: u64,
    pub(super) nominal: Option<Nominal>,
    pub(super) missed: u64,
    /// Corrected ticks that are not drawn: raw readings pass through them unscaled.
    pub(super) uncalibrated: u64,
    pub(super) unreadable: u64,
    revision: Option<Revision>,
    joiner: Joiner,
}

impl UnitPlot {
    /// Nothing seen; its time is moved by so much on the axis.
    pub(super) fn new(detail: usize, nominal: Option<Nominal>, moved_ns: i64) -> Self {
        Self { detail, clock: Clock::moved(moved_ns), nominal, ..Self::default() }
    }

    /// Takes a message of the unit; corrected ticks with a calibration are handed on with their time on the axis (ns).
    pub(super) fn take(&mut self, message: &Message, corrected: &mut dyn FnMut(i64, &CorrectedTick)) {
        if self.read(message, corrected).is_none() {
            self.unreadable += 1;
        }
    }

    fn read(&mut self, message: &Message, corrected: &mut dyn FnMut(i64, &CorrectedTick)) -> Option<()> {
        let Some((_, decoded)) = decode(message).ok()? else { return Some(()) };
        match decoded {
            Decoded::Gyro(batch) => self.take_gyro(&batch),
            Decoded::Accel(batch) => self.take_accel(&batch),
            Decoded::Temperature(batch) => self.take_temperatures(&batch),
            Decoded::Corrected(batch) => self.take_corrected(&batch, corrected),
            Decoded::Status(status) => self.take_status(&status),
            Decoded::Journal => self.take_journal(codec::decode(&message.frame).ok()?),
            Decoded::Health(_) | Decoded::Reference(_) => {}
        }
        Some(())
    }

    /// Place on the axis (ns) of a time of the producer's clock.
    fn time(&mut self, stream: Stream, event: Timestamp) -> i64 {
        let (at_ns, jumped) = self.clock.axis(stream, event.as_ns());
        if let Some(by_ns) = jumped {
            let by = seconds(by_ns);
            let words = format!("the producer's clock jumps by {by:.3} s; the axis goes on");
            self.happen(at_ns, "clock jump", words, Ink::Alert);
        }
        at_ns
    }

    fn happen(&mut self, at_ns: i64, kind: &'static str, words: String, ink: Ink) {
        if self.happenings.len() < MAX_LISTED {
            self.happenings.push(Happening { at_ns, kind, words, ink });
        } else {
            self.unlisted += 1;
        }
    }

    fn take_gyro(&mut self, batch: &GyroBatch) {
        let mut track = self.gyro.take().unwrap_or_else(|| RawTrack::new(batch.output, self.detail));
        if let Some(first) = batch.ticks.first() {
            track.begin(first.sequence, self.time(Stream::Gyro, first.end_time));
        }
        for tick in &batch.ticks {
            let bits = mode_bit(tick.mode) | u32::from(tick.switch_command) << SWITCH;
            let at_ns = self.time(Stream::Gyro, tick.end_time);
            track.push(at_ns, tick.duration, &tick.readings, bits);
        }
        self.gyro = Some(track);
    }

    fn take_accel(&mut self, batch: &AccelBatch) {
        let mut track = self.accel.take().unwrap_or_else(|| RawTrack::new(batch.output, self.detail));
        if let Some(first) = batch.ticks.first() {
            track.begin(first.sequence, self.time(Stream::Accel, first.end_time));
        }
        for tick in &batch.ticks {
            let at_ns = self.time(Stream::Accel, tick.end_time);
            track.push(at_ns, tick.duration, &tick.readings, 0);
        }
        self.accel = Some(track);
    }

    fn take_temperatures(&mut self, batch: &TemperatureBatch) {
        for tick in batch.ticks() {
            let Some(first) = tick.first() else { continue };
            let at_ns = self.time(Stream::Temperature, first.time);
            for reading in tick {
                push(&mut self.readings, &reading.channel, self.detail, at_ns, reading.raw);
            }
        }
    }

    fn take_corrected(&mut self, batch: &CorrectedBatch, corrected: &mut dyn FnMut(i64, &CorrectedTick)) {
        let mut last_ns = None;
        for tick in &batch.ticks {
            let at_ns = self.time(Stream::Corrected, tick.end_time);
            if last_ns.is_none() && self.revision != Some(batch.revision) {
                self.change(at_ns, batch.revision, tick.sequence);
            }
            let track = self.corrected.get_or_insert_with(|| Track::new(6, self.detail));
            if tick.missed > 0 && tick.missed < u64::MAX {
                self.missed = self.missed.saturating_add(tick.missed);
                let until = at_ns.saturating_sub(tick.duration.as_ns());
                track.gap(until);
            }
            if tick.flags.contains(TickFlags::UNCALIBRATED) {
                self.uncalibrated += 1;
                track.push(at_ns, &[], flags(tick));
            } else {
                track.push(at_ns, &increments(tick), flags(tick));
                corrected(at_ns, tick);
            }
            last_ns = Some(at_ns);
        }
        if let Some(at_ns) = last_ns {
            for applied in &batch.temperatures {
                push(&mut self.applied, &applied.channel, self.detail, at_ns, applied.temperature_deg_c);
            }
        }
    }

    /// Another revision makes the ticks from here on.
    fn change(&mut self, at_ns: i64, revision: Revision, sequence: u64) {
        let label = if revision.counter == 0 { "none".to_owned() } else { named(revision) };
        if self.revision.is_some() {
            let words = format!("calibration {label} from tick {sequence} on");
            self.happen(at_ns, "calibration change", words, Ink::Second);
        }
        self.revision = Some(revision);
        if self.revisions.len() < MAX_LISTED {
            self.revisions.push(Since { at_ns, label, ink: Ink::Second });
        }
    }

    fn take_status(&mut self, status: &Status) {
        let Some(at_ns) = self.clock.now() else { return };
        let output = match status.output {
            Output::Calibrated => "",
            Output::PassThrough => ", uncalibrated",
            Output::Held => ", held: no calibration",
        };
        let state = status.state;
        let label = format!("{state}{output}");
        let known = self.states.last().is_some_and(|last| last.label == label);
        if !known && self.states.len() < MAX_LISTED {
            let ink = if state.is_running() { Ink::Corrected } else { Ink::Third };
            self.states.push(Since { at_ns, label, ink });
        }
    }

    fn take_journal(&mut self, part: JournalPart) {
        // What is wrong with a journal is `info`'s to say.
        let Ok(Some(entry)) = self.joiner.join(part) else { return };
        let at_ns = self.clock.now().unwrap_or(0);
        match entry.event {
            JournalEvent::Memory { document: Some(document), .. } => self.learn(&document),
            JournalEvent::Changed { revision, document, source, .. } => {
                if let Some(document) = document {
                    self.learn(&document);
                }
                let words = format!("calibration {} given: {source}", named(revision));
                self.happen(at_ns, "calibration given", words, Ink::Fourth);
            }
            JournalEvent::Commanded { command, accepted, words } => {
                let verdict = if accepted { "" } else { "refused: " };
                let words = format!("command {}: {verdict}{words}", command.name());
                self.happen(at_ns, "command", words, Ink::Third);
            }
            JournalEvent::Began { .. } if self.clock.now().is_some() => {
                self.happen(at_ns, "unit restarted", "the service restarted the unit".to_owned(), Ink::Alert);
            }
            JournalEvent::Ended => {
                self.happen(at_ns, "service stopped", "the service stopped".to_owned(), Ink::Alert);
            }
            _ => {}
        }
    }

    /// Notes a document's nominal scale.
    fn learn(&mut self, document: &str) {
        if let Ok(parsed) = Document::parse(document, None) {
            self.nominal = Some(Nominal::of(&parsed.document));
        }
    }

    /// All tracks.
    pub(super) fn tracks(&mut self) -> impl Iterator<Item = &mut Track> {
        let raw = self.gyro.iter_mut().chain(&mut self.accel).map(|raw| &mut raw.track);
        let temperatures = self.readings.values_mut().chain(self.applied.values_mut());
        self.corrected.iter_mut().chain(raw).chain(temperatures)
    }
}

impl RawTrack {
    fn new(kind: OutputKind, detail: usize) -> Self {
        Self { kind, sensors: 0, track: Track::new(SENSORS, detail), next_sequence: 0 }
    }

    /// A batch begins with this tick.
    fn begin(&mut self, sequence: u64, at_ns: i64) {
        if self.track.ticks() > 0 && sequence > self.next_sequence {
            self.track.gap(at_ns);
        }
        self.next_sequence = sequence;
    }

    fn push(&mut self, at_ns: i64, duration: Span, readings: &[f64], bits: u32) {
        self.next_sequence = self.next_sequence.saturating_add(1);
        self.sensors = self.sensors.max(readings.len());
        let per_reading = match self.kind {
            OutputKind::Counts => per_second(duration),
            OutputKind::Mean => 1.0,
        };
        let mut values = [f64::NAN; SENSORS];
        for (value, reading) in values.iter_mut().zip(readings) {
            *value = reading * per_reading;
        }
        self.track.push(at_ns, &values, bits);
    }
}

/// Temperatures change slowly and are many: each has this share of the others' bins.
const TEMPERATURE_SHARE: usize = 8;

/// Enters a value of a channel; new channels only as far as they are listed.
fn push(tracks: &mut BTreeMap<String, Track>, channel: &str, detail: usize, at_ns: i64, value: f64) {
    let room = tracks.len() < SENSORS * 4;
    match tracks.get_mut(channel) {
        Some(track) => track.push(at_ns, &[value], 0),
        None if room => {
            let mut track = Track::new(1, detail / TEMPERATURE_SHARE);
            track.push(at_ns, &[value], 0);
            tracks.insert(channel.to_owned(), track);
        }
        None => {}
    }
}

/// Rates (°/h) and specific forces (m/s²) of a tick.
pub(super) fn increments(tick: &CorrectedTick) -> [f64; 6] {
    let per_second = per_second(tick.duration);
    let [roll, pitch, yaw] = tick.delta_angle.map(|angle| angle * per_second * DEG_PER_H);
    let [fx, fy, fz] = tick.delta_velocity.map(|velocity| velocity * per_second);
    [roll, pitch, yaw, fx, fy, fz]
}

/// What to multiply increments with (1/s); not a number for no time at all.
fn per_second(duration: Span) -> f64 {
    let span_s = seconds(duration.as_ns());
    if duration == Span::ZERO { f64::NAN } else { 1.0 / span_s }
}

fn mode_bit(mode: Option<LasingMode>) -> u32 {
    match mode {
        Some(LasingMode::Plus) => 1 << MODE_PLUS,
        Some(LasingMode::Minus) => 1 << MODE_MINUS,
        None => 0,
    }
}

/// All flags of a tick in one word.
fn flags(tick: &CorrectedTick) -> u32 {
    // A flag that is not known would fall on another's bit.
    let any = |flags: &[SensorFlags]| {
        let any = flags.iter().fold(SensorFlags::empty(), |any, flags| any | *flags);
        u32::from((any & SensorFlags::all()).bits() >> 1)
    };
    let mode = mode_bit(tick.mode);
    let tick_flags = u32::from((tick.flags & TickFlags::all()).bits());
    tick_flags | any(&tick.gyro_flags) << GYRO_FLAGS | any(&tick.accel_flags) << ACCEL_FLAGS | mode
}

/// A revision's counter and the first digits of its digest.
fn named(revision: Revision) -> String {
    match (revision.counter, revision.digest) {
        // A CSV of corrected ticks has no digest.
        (counter, [0, 0, 0, 0, 0, 0, 0, 0]) => counter.to_string(),
        (counter, digest) => format!("{counter} ({})", Digits(digest.split_at(4).0)),
    }
}
