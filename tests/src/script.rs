//! What happens to a stream, written down step by step.

mod frames;
mod readings;

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::operation::Command;
use isotherm_correction::sample::{ChannelName, LasingMode};
use isotherm_correction::unit::{At, Change, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::codec::encode;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::document::Document;
use isotherm_protocol::journal::JournalEvent;
use isotherm_protocol::key::{Input, UnitId};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::stream::UnitStream;

use crate::dice::Dice;
pub use readings::{Kind, Odd};

/// One thing that happens.
#[derive(Debug, Clone)]
pub enum Step {
    /// A frame comes in, sound or not.
    Frame(Input, Vec<u8>),
    /// The service does something beside giving frames.
    Event(JournalEvent),
    /// A calibration is given.
    Give(Change),
}

/// Whether a stream is in the midst of something, and what that is.
pub type Meets = (&'static str, fn(&UnitStream) -> bool);

/// What happens, and what of it a cut must meet.
#[derive(Debug)]
pub struct Scenario {
    /// What it is about.
    pub name: &'static str,
    /// Settings of the unit.
    pub settings: UnitSettings,
    /// What happens.
    pub steps: Vec<Step>,
    /// What a cut must meet.
    pub meets: Vec<Meets>,
}

impl Scenario {
    /// A stream to which nothing has happened yet.
    ///
    /// # Panics
    /// Never: the serial is sound.
    #[must_use]
    pub fn stream(&self) -> UnitStream {
        UnitStream::new(UnitId::new(UNIT).expect("a serial"), self.settings)
    }
}

/// Serial of the unit of every scenario.
pub const UNIT: &str = "U-1";

/// When accelerometer ticks come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accels {
    /// Before the gyro ticks that they go with.
    #[default]
    Before,
    /// Behind them.
    After,
    /// Behind the gyro ticks of so many messages later.
    Late(usize),
    /// So many of a hundred messages are lost.
    Lost(u64),
}

/// Writes the steps of a producer's life.
#[derive(Debug)]
pub struct Script {
    /// Chance of mishaps and readings.
    pub dice: Dice,
    /// What was written so far.
    pub steps: Vec<Step>,
    /// What the producer's ticks are made for.
    pub calibration: Arc<Calibration>,
    /// Temperature channels: name and raw value.
    pub channels: Vec<(ChannelName, f64)>,
    /// Sequence number of the next tick.
    pub next: u64,
    /// Its end.
    pub now_ns: i64,
    /// The producer's run.
    pub series: u64,
    revision: u64,
    /// Duration of a tick.
    pub tick: Span,
    /// Ticks of a message.
    pub batch: u64,
    /// How many of a hundred messages are lost, doubled, late, broken: each.
    pub mishaps: u64,
    /// Ticks between two switches of the lasing mode; 0 for an instrument without.
    pub switches: u64,
    /// More ticks at whose start a switch is commanded.
    pub commands: Vec<u64>,
    /// Ticks after a switch is commanded until the reported mode is the new one.
    pub mode_late: u64,
    /// Half-period counts come with the ticks of an instrument with modes.
    pub halves: bool,
    /// Frequency of the dither that they are counts of (Hz).
    pub dither_hz: f64,
    /// The dither turns with the lasing mode: its negative half comes first in the minus mode.
    pub dither_turns: bool,
    /// Ticks of half a period of the slow meander; 0 where it stays as it is.
    pub meander: u64,
    /// A gyro that fails, and from which tick on.
    pub fails: Option<(usize, u64)>,
    /// Readings that are not what they should be.
    pub odd: Vec<Odd>,
    /// Ticks of another duration.
    pub durations: Vec<(u64, Span)>,
    /// How much the readings scatter (counts, or a millionth of their unit of measure).
    pub scatter: f64,
    /// How much the unit swings (counts, or a thousandth of the readings' unit of measure).
    pub swing: f64,
    /// Share of a raw temperature by which it rises with each tick, in thousandths.
    pub warming: f64,
    /// Temperatures come.
    pub thermometers: bool,
    /// What each accelerometer reads at rest (thousandths of m/s²); none: the third points up, the others lie.
    pub forces: Vec<f64>,
    /// When accelerometer ticks come.
    pub accels: Accels,
    late_accels: Vec<Step>,
    mode: LasingMode,
    /// Ticks since the last switch.
    since_switch: u64,
}

impl Script {
    /// The life of a producer whose unit is given a calibration first; channels with a raw value each.
    ///
    /// # Panics
    /// Where a channel's name is too long.
    #[must_use]
    pub fn new(seed: u64, calibration: &Arc<Calibration>, channels: &[(&str, f64)]) -> Self {
        let channels = channels.iter().map(|(name, raw)| (channel(name), *raw));
        let mut script = Self {
            dice: Dice::new(seed),
            steps: Vec::new(),
            calibration: Arc::clone(calibration),
            channels: channels.collect(),
            next: 1000,
            now_ns: 1_000_000_000_000,
            series: 7,
            revision: 0,
            tick: Span::from_ms(5),
            batch: 4,
            mishaps: 0,
            switches: 0,
            commands: Vec::new(),
            mode_late: 0,
            halves: true,
            dither_hz: 60_000.0,
            dither_turns: false,
            meander: 0,
            fails: None,
            odd: Vec::new(),
            durations: Vec::new(),
            scatter: 2.0,
            swing: 0.0,
            warming: 2e-4,
            thermometers: true,
            forces: Vec::new(),
            accels: Accels::Before,
            late_accels: Vec::new(),
            mode: LasingMode::Plus,
            since_switch: u64::MAX,
        };
        let calibration = Arc::clone(calibration);
        script.give(calibration, At::NextTick, Span::ZERO);
        script
    }

    /// What was written, as a scenario.
    #[must_use]
    pub fn scenario(self, name: &'static str, settings: UnitSettings, meets: Vec<Meets>) -> Scenario {
        Scenario { name, settings, steps: self.steps, meets }
    }

    /// A change of calibration.
    pub fn give(&mut self, calibration: Arc<Calibration>, at: At, slew: Span) {
        self.revision += 1;
        self.steps.push(Step::Give(Change { calibration, revision: self.revision, at, slew }));
    }

    /// The same at a tick that is still to come.
    ///
    /// # Panics
    /// Where it is too far away.
    pub fn give_later(&mut self, calibration: &Arc<Calibration>, ticks: u64, slew: Span) {
        let at = if self.dice.below(2) == 0 {
            At::Sequence(self.next + ticks)
        } else {
            let span_ns = self.tick.as_ns() * whole(ticks);
            At::TimeNs(self.now_ns + span_ns)
        };
        self.give(Arc::clone(calibration), at, slew);
    }

    /// A change of calibration as the journal tells it: with the text of a document.
    ///
    /// # Panics
    /// Where the document is not sound.
    pub fn document(&mut self, text: &str, at: Schedule, slew: Span) {
        self.revision += 1;
        let digest = Document::parse(text, None).expect("a sound document").digest;
        self.event(JournalEvent::Changed {
            revision: Revision { counter: self.revision, digest: digest.head() },
            at,
            slew_ns: slew.as_ns(),
            document: Some(text.to_owned()),
            overlay: None,
            source: "bus".to_owned(),
        });
    }

    /// A command, whatever becomes of it.
    pub fn command(&mut self, command: Command, accepted: bool) {
        self.steps.push(Step::Event(JournalEvent::Commanded { command, accepted, words: String::new() }));
    }

    /// Something that the service does.
    pub fn event(&mut self, event: JournalEvent) {
        self.steps.push(Step::Event(event));
    }

    /// The producer is switched off and on.
    ///
    /// # Panics
    /// Never: the time is a short one.
    pub fn restart(&mut self) {
        self.series += 1;
        self.next = self.dice.below(100);
        self.now_ns = whole(self.dice.below(1_000_000_000));
    }

    /// Ticks that never come; the modes are switched meanwhile.
    ///
    /// # Panics
    /// Where they are too many.
    pub fn gap(&mut self, ticks: u64) {
        let behind = self.next + ticks;
        let periodic = match self.switches {
            0 => 0,
            period => (behind - 1) / period - (self.next - 1) / period,
        };
        let commanded = self.commands.iter().filter(|tick| (self.next..behind).contains(*tick)).count();
        if !(periodic + commanded as u64).is_multiple_of(2) {
            self.mode = self.mode.reversed();
        }
        self.next = behind;
        self.now_ns += self.tick.as_ns() * whole(ticks);
    }

    /// A rate reference over the last second.
    ///
    /// # Panics
    /// Never: it can be encoded.
    pub fn reference(&mut self) {
        let angular_rate_rad_per_s = [(); 3].map(|()| 1e-6 * self.dice.between_minus_one_and_one());
        self.reference_of(-1_500_000_000..-500_000_000, angular_rate_rad_per_s, 1e-6);
    }

    /// A rate reference over a span about now (ns).
    ///
    /// # Panics
    /// Never: it can be encoded.
    pub fn reference_of(&mut self, span_ns: std::ops::Range<i64>, rate: [f64; 3], sigma: f64) {
        let reference = Reference {
            start_ns: self.now_ns.saturating_add(span_ns.start),
            end_ns: self.now_ns.saturating_add(span_ns.end),
            angular_rate_rad_per_s: rate,
            sigma_rad_per_s: sigma,
        };
        self.steps.push(Step::Frame(Input::Reference, encode(&reference).expect("it can be encoded")));
    }
}

/// Name of a temperature channel.
fn channel(name: &str) -> ChannelName {
    ChannelName::from(name).expect("a short name")
}

/// A number of ticks or nanoseconds that is not too large.
fn whole(number: u64) -> i64 {
    i64::try_from(number).expect("not too large")
}
