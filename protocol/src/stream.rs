//! Frames in, frames out for one unit: the one path that service and offline correction share.
//!
//! The service feeds it from Zenoh, the replay tool from a file. Both therefore give the same corrected ticks, bit
//! for bit.

use std::collections::VecDeque;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::sample::{AccelTick, CorrectedTick, GyroTick, TemperatureReading};
use isotherm_correction::unit::{Event, Uncalibrated, Unit, UnitSettings};

use crate::codec::{self, CodecError, MAX_TICKS};
use crate::corrected::{AppliedTemperature, CorrectedBatch, Revision};
use crate::key::{RawStream, UnitId};
use crate::raw::{AccelBatch, GyroBatch, TemperatureBatch};
use crate::status::{ChannelStatus, Counter, State, Status};

/// One unit's stream.
#[derive(Debug)]
pub struct UnitStream {
    id: UnitId,
    unit: Unit,
    revision: Revision,
    /// Revisions whose ticks may still be waiting to be taken; the last is the one in force.
    digests: VecDeque<Revision>,
    ready: VecDeque<CorrectedTick>,
    bad_frames: u64,
    last: Option<(i64, u64)>,
    gyro_ticks: Vec<GyroTick>,
    accel_ticks: Vec<AccelTick>,
    readings: Vec<TemperatureReading>,
}

impl UnitStream {
    /// A stream that has seen nothing and has no calibration.
    #[must_use]
    pub fn new(id: UnitId, settings: UnitSettings) -> Self {
        Self {
            id,
            unit: Unit::new(settings),
            revision: Revision::default(),
            digests: VecDeque::from([Revision::default()]),
            ready: VecDeque::new(),
            bad_frames: 0,
            last: None,
            gyro_ticks: Vec::new(),
            accel_ticks: Vec::new(),
            readings: Vec::new(),
        }
    }

    /// Puts a calibration in force from the next tick on; the digest is the head of its document's SHA-256.
    pub fn install(&mut self, calibration: Arc<Calibration>, digest: [u8; 8]) -> Revision {
        self.revision = Revision { counter: self.revision.counter + 1, digest };
        self.unit.install(calibration, self.revision.counter);
        self.digests.push_back(self.revision);
        self.revision
    }

    /// Takes one raw frame.
    ///
    /// # Errors
    /// [`CodecError`] for a frame that cannot be read: it is counted, and nothing else changes.
    pub fn receive(&mut self, stream: RawStream, frame: &[u8]) -> Result<(), CodecError> {
        let received = self.receive_frame(stream, frame);
        self.bad_frames += u64::from(received.is_err());
        received
    }

    fn receive_frame(&mut self, stream: RawStream, frame: &[u8]) -> Result<(), CodecError> {
        let ready = &mut self.ready;
        let mut emit = |tick: &CorrectedTick| ready.push_back(tick.clone());
        match stream {
            RawStream::Gyro => {
                let batch: GyroBatch = codec::decode(frame)?;
                self.gyro_ticks.clear();
                self.gyro_ticks.extend(batch.to_core());
                self.unit.handle(Event::Gyro { output: batch.output(), ticks: &self.gyro_ticks }, &mut emit);
            }
            RawStream::Accel => {
                let batch: AccelBatch = codec::decode(frame)?;
                self.accel_ticks.clear();
                self.accel_ticks.extend(batch.to_core());
                self.unit
                    .handle(Event::Accel { output: batch.output(), ticks: &self.accel_ticks }, &mut emit);
            }
            RawStream::Temperature => {
                let batch: TemperatureBatch = codec::decode(frame)?;
                self.readings.clear();
                self.readings.extend(batch.to_core());
                self.unit.handle(Event::Temperature(&self.readings), &mut emit);
            }
        }
        Ok(())
    }

    /// Takes one event that never was a frame.
    pub fn handle(&mut self, event: Event<'_>) {
        let ready = &mut self.ready;
        self.unit.handle(event, &mut |tick| ready.push_back(tick.clone()));
    }

    /// Releases everything that waits.
    pub fn flush(&mut self) {
        self.handle(Event::Flush);
    }

    /// Corrected ticks that have not been taken yet.
    #[must_use]
    pub fn ready(&self) -> &VecDeque<CorrectedTick> {
        &self.ready
    }

    /// Takes the corrected ticks as they are.
    pub fn take_ready(&mut self) -> Vec<CorrectedTick> {
        let ticks: Vec<_> = self.ready.drain(..).collect();
        self.note_taken(ticks.last());
        ticks
    }

    /// Encodes the next batch of corrected ticks, all of one revision, into `frame`; `false` where there is none.
    pub fn next_frame(&mut self, frame: &mut Vec<u8>) -> bool {
        let Some(first) = self.ready.front() else { return false };
        let counter = first.revision;
        let count = self.ready.iter().take(MAX_TICKS).take_while(|tick| tick.revision == counter).count();
        let taken: Vec<_> = self.ready.drain(..count).collect();
        self.note_taken(taken.last());
        let revision = self.digests.iter().find(|r| r.counter == counter).copied();
        let batch = CorrectedBatch {
            unit: self.id.to_string(),
            revision: revision.unwrap_or(Revision { counter, ..Revision::default() }),
            temperatures: self.temperatures().collect(),
            ticks: taken.iter().map(Into::into).collect(),
        };
        codec::encode_into(&batch, frame).is_ok()
    }

    /// Remembers the last tick taken, and drops revisions of which nothing can be waiting any more.
    fn note_taken(&mut self, last: Option<&CorrectedTick>) {
        let Some(last) = last else { return };
        self.last = Some((last.end_time.as_ns(), last.sequence));
        while self.digests.len() > 1 && self.digests.front().is_some_and(|r| r.counter < last.revision) {
            self.digests.pop_front();
        }
    }

    fn temperatures(&self) -> impl Iterator<Item = AppliedTemperature> + '_ {
        let channels = self.unit.channels().take(crate::raw::MAX_CHANNELS);
        channels.filter_map(|channel| {
            let state = channel.state?;
            Some(AppliedTemperature {
                channel: channel.name,
                temperature_deg_c: state.temperature,
                rate_deg_c_per_s: state.rate,
            })
        })
    }

    /// Every counter of the unit, by name.
    #[must_use]
    pub fn counters(&self) -> Vec<Counter> {
        let counters = self.unit.counters().iter();
        let mut counters: Vec<_> =
            counters.map(|(name, value)| Counter { name: name.to_owned(), value }).collect();
        counters.push(Counter { name: "bad_frames".to_owned(), value: self.bad_frames });
        counters
    }

    /// What the unit says of itself. `added_latency_ns` is median and 99th percentile.
    #[must_use]
    pub fn status(
        &self,
        service_version: &str,
        last_fault: Option<&str>,
        added_latency_ns: [u64; 2],
    ) -> Status {
        let [added_latency_p50_ns, added_latency_p99_ns] = added_latency_ns;
        let state = match (self.unit.calibration(), self.unit.settings().uncalibrated) {
            (Some(_), _) => State::Running,
            (None, Uncalibrated::PassThrough) => State::Uncalibrated,
            (None, Uncalibrated::Hold) => State::Held,
        };
        let channels = self.unit.channels().map(|channel| ChannelStatus {
            channel: channel.name,
            temperature_deg_c: channel.state.map(|state| state.temperature),
            rate_deg_c_per_s: channel.state.map(|state| state.rate),
            stale: channel.stale,
            warming_up: channel.warming_up,
        });
        Status {
            unit: self.id.to_string(),
            service_version: service_version.to_owned(),
            state,
            revision: self.revision,
            last_end_time_ns: self.last.map(|(end_time, _)| end_time),
            last_sequence: self.last.map(|(_, sequence)| sequence),
            channels: channels.collect(),
            counters: self.counters(),
            last_fault: last_fault.map(ToOwned::to_owned),
            added_latency_p50_ns,
            added_latency_p99_ns,
        }
    }

    /// Serial of the unit.
    #[must_use]
    pub fn id(&self) -> &UnitId {
        &self.id
    }

    /// The calibration in force; counter 0 while there is none.
    #[must_use]
    pub fn revision(&self) -> Revision {
        self.revision
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
