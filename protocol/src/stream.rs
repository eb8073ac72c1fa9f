//! Frames in, frames out for one unit: the one path that service and offline correction share.
//!
//! The service feeds it from Zenoh, the replay tool from a file. Both therefore give the same corrected ticks, bit
//! for bit.

mod carry_out;
mod edge;
mod label;
mod memory;
mod outgoing;
mod revisions;
mod status;
#[cfg(test)]
mod tests;
pub mod unfit;

use std::cell::RefCell;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::operation::{Command, HealthReading, Refusal, State};
use isotherm_correction::sample::{AccelTick, CorrectedTick, GyroTick, TemperatureReading};
use isotherm_correction::unit::{At, Change, Event, Unit, UnitSettings};
use isotherm_correction::units::Span;
use serde::{Deserialize, Serialize};

pub use carry_out::JournalError;
pub use edge::Edge;
pub use label::Label;
pub use memory::{MEMORY_VERSION, MemoryError};
use outgoing::Last;
pub use outgoing::Outgoing;
pub use revisions::InForce;
use revisions::{Given, Revisions};

use crate::codec::{self, CodecError};
use crate::control::Schedule;
use crate::corrected::{Head, Revision};
use crate::digest::Digest;
use crate::journal::JournalEvent;
use crate::key::{Input, RawStream, UnitId};
use crate::raw::{self, HealthBatch, TickReader};
use crate::reference::Reference;
use crate::status::{Counter, LastTick};

/// What a message is read into. One thread deals with a message from its first byte to its last corrected tick, so that
/// units need no such room of their own.
#[derive(Debug, Default)]
struct Scratch {
    gyros: TickReader<GyroTick>,
    accels: TickReader<AccelTick>,
    readings: Vec<TemperatureReading>,
    health: Vec<HealthReading>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// The frames that a stream was given of one input, bad ones included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct Heard {
    /// How many.
    pub frames: u64,
    /// The last four bytes of the last one, little-endian: the checksum of a good frame. 0 before the first frame, and
    /// for one of fewer than four bytes.
    pub crc: u32,
}

impl Heard {
    /// One frame more.
    pub fn note(&mut self, frame: &[u8]) {
        self.frames += 1;
        self.crc = frame.last_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    }
}

/// One unit's stream.
///
/// [`UnitStream::memory`] writes all of it down; what is read back goes on to the same bits.
#[derive(Debug, Serialize, Deserialize)]
pub struct UnitStream {
    id: UnitId,
    /// By [`Input::index`].
    heard: [Heard; Input::ALL.len()],
    unit: Unit,
    revisions: Revisions,
    outgoing: Outgoing,
    bad_frames: u64,
    last: Option<LastTick>,
    /// Series of the last raw gyro tick.
    incoming_series: u64,
    /// End of the last pre-launch calibration (ns on the producer's clock).
    pre_launch_ended_ns: Option<i64>,
}

impl UnitStream {
    /// A stream that has seen nothing and has no calibration.
    #[must_use]
    pub fn new(id: UnitId, settings: UnitSettings) -> Self {
        Self {
            id,
            heard: [Heard::default(); Input::ALL.len()],
            unit: Unit::new(settings),
            revisions: Revisions::new(0),
            outgoing: Outgoing::default(),
            bad_frames: 0,
            last: None,
            incoming_series: 0,
            pre_launch_ended_ns: None,
        }
    }

    /// The same stream for whoever wants the ticks rather than frames: they are kept as they are, and
    /// [`UnitStream::next_frame`] writes them when it is called. Not part of its memory.
    #[must_use]
    pub fn keeping_ticks(mut self) -> Self {
        self.outgoing.keep_ticks();
        self
    }

    /// Lets the revision counter go on behind `highest`, the highest that the unit was ever given; at the start only.
    #[must_use]
    pub fn with_revision(mut self, highest: u64) -> Self {
        self.revisions = Revisions::new(highest);
        self
    }

    /// Counter of the next revision.
    #[must_use]
    pub fn next_counter(&self) -> u64 {
        self.revisions.next_counter()
    }

    /// Puts a calibration in force from the next tick on; the digest is the head of its document's SHA-256.
    pub fn install(&mut self, calibration: Arc<Calibration>, digest: [u8; 8]) -> Revision {
        let revision = Revision { counter: self.next_counter(), digest };
        self.install_as(calibration, revision, Label::default());
        revision
    }

    /// Puts a calibration in force from the next tick on, under a stated revision.
    pub fn install_as(&mut self, calibration: Arc<Calibration>, revision: Revision, label: Label) {
        let change = Change { calibration, revision: revision.counter, at: At::NextTick, slew: Span::ZERO };
        self.change(change, revision, label);
    }

    /// Has a calibration take effect at its tick.
    ///
    /// The counter must be above all that were given before ([`UnitStream::next_counter`]). Gives the counter of a change
    /// that was waiting and is replaced by this one.
    pub fn schedule(&mut self, change: Change, label: Label) -> Option<u64> {
        let digest = label.digest.map(|digest| digest.head()).unwrap_or_default();
        let revision = Revision { counter: change.revision, digest };
        self.change(change, revision, label)
    }

    fn change(&mut self, change: Change, revision: Revision, label: Label) -> Option<u64> {
        self.revisions.give(revision, label, change.slew);
        self.outgoing.forget_head();
        let replaced = self.watching_pre_launch(|unit| unit.schedule(change));
        let in_force = self.unit.calibration().map(|(_, counter)| counter);
        let pending = self.unit.pending().map(|(counter, _)| counter);
        self.revisions.drop_replaced([in_force, pending, self.unit.summing()]);
        replaced
    }

    /// Carries a command out before the next tick; the state that it leads to.
    ///
    /// # Errors
    /// [`Refusal`]: the state is as before.
    pub fn command(&mut self, command: &Command) -> Result<State, Refusal> {
        self.watching_pre_launch(|unit| unit.command(command))
    }

    /// Ends a self-test that gets no ticks with what it has seen: for the owner's clock.
    pub fn expire_self_test(&mut self) {
        self.unit.expire_self_test();
    }

    /// Ends a pre-launch calibration whose stream has ended: it is refused as too short.
    pub fn end_pre_launch(&mut self) {
        self.watching_pre_launch(Unit::end_pre_launch);
    }

    /// Takes one frame.
    ///
    /// # Errors
    /// [`CodecError`] for a frame that cannot be read: it is counted, and nothing else changes.
    pub fn receive(&mut self, input: impl Into<Input>, frame: &[u8]) -> Result<(), CodecError> {
        let input = input.into();
        if let Some(heard) = self.heard.get_mut(input.index()) {
            heard.note(frame);
        }
        let received = SCRATCH.with(|scratch| match scratch.try_borrow_mut() {
            Ok(mut scratch) => self.read(input, frame, &mut scratch),
            Err(_) => self.read(input, frame, &mut Scratch::default()),
        });
        self.bad_frames += u64::from(received.is_err());
        received
    }

    /// Reads a frame, and has the unit take what it says.
    fn read(&mut self, input: Input, frame: &[u8], scratch: &mut Scratch) -> Result<(), CodecError> {
        let Scratch { gyros, accels, readings, health } = scratch;
        match input {
            Input::Raw(RawStream::Gyro) => {
                let (output, ticks) = gyros.read(frame)?;
                self.handle(Event::Gyro { output, ticks });
            }
            Input::Raw(RawStream::Accel) => {
                let (output, ticks) = accels.read(frame)?;
                self.handle(Event::Accel { output, ticks });
            }
            Input::Raw(RawStream::Temperature) => {
                raw::read_temperatures(frame, readings)?;
                self.handle(Event::Temperature(readings));
            }
            Input::Raw(RawStream::Health) => {
                let batch: HealthBatch = codec::decode(frame)?;
                health.clear();
                health.extend(batch.to_core());
                self.handle(Event::Health(health));
            }
            Input::Reference => {
                let reference: Reference = codec::decode(frame)?;
                self.handle(Event::Reference(&reference.to_core()));
            }
        }
        Ok(())
    }

    /// Takes one event that is no frame, or no longer.
    pub fn handle(&mut self, event: Event<'_>) {
        if let Event::Gyro { ticks, .. } = event {
            self.incoming_series = ticks.last().map_or(self.incoming_series, |tick| tick.series);
        }
        let state = self.unit.state();
        let Self { unit, outgoing, revisions, .. } = self;
        unit.handle(event, &mut |tick: &CorrectedTick| {
            if revisions.is_new(tick.revision) {
                revisions.released(tick.revision, |revision| InForce {
                    revision,
                    series: tick.series,
                    sequence: tick.sequence.saturating_sub(u64::from(tick.ticks.saturating_sub(1))),
                    end_time_ns: tick.end_time.as_ns(),
                });
            }
            outgoing.push(tick);
        });
        self.note_pre_launch(state);
    }

    /// Does something with the unit that may end a pre-launch calibration.
    fn watching_pre_launch<T>(&mut self, work: impl FnOnce(&mut Unit) -> T) -> T {
        let state = self.unit.state();
        let done = work(&mut self.unit);
        self.note_pre_launch(state);
        done
    }

    /// Notes the time where a pre-launch calibration has ended since the unit was in state `before`.
    fn note_pre_launch(&mut self, before: State) {
        if before == State::PreLaunchCalibration && self.unit.state() != before {
            self.pre_launch_ended_ns = self.unit.observation().map(|seen| seen.end_time.as_ns());
        }
    }

    /// Releases everything that waits.
    pub fn flush(&mut self) {
        self.handle(Event::Flush);
    }

    /// Corrected ticks that have not been taken yet.
    #[must_use]
    pub fn ready(&self) -> &Outgoing {
        &self.outgoing
    }

    /// Takes the corrected ticks as they are.
    pub fn take_ready(&mut self) -> Vec<CorrectedTick> {
        let (ticks, last) = self.outgoing.take();
        if let Some(last) = last {
            self.note_taken(last);
        }
        ticks
    }

    /// Makes the next frame of corrected ticks, all of one revision and series, in the place of `frame`, whose capacity the stream keeps
    /// for the one after it; how many ticks are in it, `None` where there is none.
    #[inline]
    pub fn next_frame(&mut self, frame: &mut Vec<u8>) -> Option<usize> {
        // Asked for after every message: mostly there is none.
        if self.outgoing.is_empty() {
            return None;
        }
        let Self { id, unit, revisions, outgoing, .. } = self;
        let (last, ticks) = outgoing.next_frame(frame, unit.temperature_changes(), |head, last, ticks| {
            let temperatures = unit.temperatures().take(raw::MAX_CHANNELS);
            let temperatures = temperatures.map(|(name, state)| (name, [state.temperature, state.rate]));
            let (unit, revision) = (id.as_str(), revisions.revision(last.revision));
            Head { unit, series: last.series, revision, temperatures, ticks }.append(head);
        })?;
        self.note_taken(last);
        Some(ticks)
    }

    /// Gives up the ready ticks: they were taken.
    pub fn drop_ready(&mut self) {
        let last = self.outgoing.clear();
        if let Some(last) = last {
            self.note_taken(last);
        }
    }

    /// The first output of each revision, in order and once each; ask after every frame.
    pub fn take_in_force(&mut self) -> Option<InForce> {
        self.revisions.take_in_force()
    }

    /// Remembers the last tick taken, and drops revisions of which nothing can be waiting any more.
    fn note_taken(&mut self, Last { end_time_ns, sequence, revision, series }: Last) {
        self.last = Some(LastTick { end_time_ns, sequence, series });
        self.revisions.taken(revision);
    }

    /// What it was given, by [`Input::index`]. A unit that has started anew goes on counting.
    #[must_use]
    pub fn heard(&self) -> [Heard; Input::ALL.len()] {
        self.heard
    }

    /// Series of the last raw gyro tick.
    #[must_use]
    pub fn incoming_series(&self) -> u64 {
        self.incoming_series
    }

    /// Every counter of the unit, by name.
    #[must_use]
    pub fn counters(&self) -> Vec<Counter> {
        let references = self.unit.reference_counters();
        let references = references.iter().map(|(name, value)| (format!("references_{name}"), value));
        let counters = self.unit.counters().iter().map(|(name, value)| (name.to_owned(), value));
        let own = [("bad_frames".to_owned(), self.bad_frames)];
        let all = counters.chain(references).chain(own);
        all.map(|(name, value)| Counter { name, value }).collect()
    }

    /// Serial of the unit.
    #[must_use]
    pub fn id(&self) -> &UnitId {
        &self.id
    }

    /// The calibration in force; counter 0 while there is none.
    #[must_use]
    pub fn revision(&self) -> Revision {
        self.unit
            .calibration()
            .map_or_else(Revision::default, |(_, counter)| self.revisions.revision(counter))
    }

    /// The calibrations that the unit was given and has not passed, as a journal says it: the one in force, and one that waits for its
    /// tick. `text` finds a document by its digest.
    pub fn given(&self, text: impl Fn(&Digest) -> Option<String>) -> impl Iterator<Item = JournalEvent> {
        let in_force = self.unit.calibration().map(|(_, counter)| (counter, Schedule::NextTick));
        in_force.into_iter().chain(self.unit.pending()).filter_map(move |(counter, at)| {
            let Given { revision, label, slew, .. } = self.revisions.find(counter)?;
            Some(JournalEvent::Changed {
                revision: *revision,
                at,
                slew_ns: slew.as_ns(),
                document: label.digest.as_ref().and_then(&text),
                overlay: label.overlay,
                source: label.source.clone(),
            })
        })
    }

    /// The unit's state machine, to look at.
    #[must_use]
    pub fn unit(&self) -> &Unit {
        &self.unit
    }

    /// Whether ticks wait inside for something that may still come.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.unit.is_waiting()
    }
}
