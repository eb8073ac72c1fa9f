//! The whole way of a message: raw frames in, corrected frames out.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};
use isotherm_protocol::stream::UnitStream;

use super::codec::{TICKS, compare};
use super::{Kernel, unit};
use crate::error::Error;

/// A unit's stream between its frames.
pub(super) struct Stream {
    name: String,
    calibration: Arc<Calibration>,
    id: UnitId,
    frames: Vec<(RawStream, Vec<u8>)>,
    /// Sequence number of every tick.
    sequences: Vec<u64>,
    room: Vec<u8>,
}

impl Stream {
    /// Frames of the Zeeman unit: temperatures when they are due, ticks in batches of `size`.
    pub(super) fn of(size: usize) -> Result<Self, Error> {
        let unit = unit::zeeman()?;
        let gyros: Vec<_> = unit.gyro_ticks().take(TICKS).cloned().collect();
        let accels: Vec<_> = unit.accel_ticks().take(TICKS).cloned().collect();
        let readings: Vec<_> = unit.temperatures().copied().collect();
        let mut readings = readings.chunk_by(|a, b| a.time == b.time).peekable();
        let mut frames = Vec::new();
        for (gyros, accels) in gyros.chunks(size).zip(accels.chunks(size)) {
            let end_time = gyros.last().map(|tick| tick.end_time);
            while let Some(readings) = readings.next_if(|at| at.first().map(|it| it.time) < end_time) {
                let readings = TemperatureBatch { readings: readings.to_vec() };
                frames.extend(codec::encode(&readings).map(|frame| (RawStream::Temperature, frame)));
            }
            let accels = AccelBatch { output: unit.accel_output, ticks: accels.to_vec() };
            let gyros = GyroBatch { output: unit.output, ticks: gyros.to_vec() };
            frames.extend(codec::encode(&accels).map(|frame| (RawStream::Accel, frame)));
            frames.extend(codec::encode(&gyros).map(|frame| (RawStream::Gyro, frame)));
        }
        let id = UnitId::new("ZLG-0001").map_err(Error::of("kernel"))?;
        Ok(Self {
            name: format!("raw frames in, corrected frames out, batches of {size}"),
            calibration: unit.calibration,
            id,
            frames,
            sequences: gyros.iter().map(|tick| tick.sequence).collect(),
            room: Vec::new(),
        })
    }

    fn drive(&mut self, each: &mut dyn FnMut(&[u8])) {
        let mut stream = UnitStream::new(self.id.clone(), UnitSettings::default());
        stream.install(Arc::clone(&self.calibration), [7; 8]);
        for (kind, frame) in &self.frames {
            // What is not taken is missed by the check.
            let _ = stream.receive(*kind, frame);
            while stream.next_frame(&mut self.room).is_some() {
                each(&self.room);
            }
        }
        stream.flush();
        while stream.next_frame(&mut self.room).is_some() {
            each(&self.room);
        }
    }
}

impl Kernel for Stream {
    fn name(&self) -> &str {
        &self.name
    }

    fn ticks(&self) -> usize {
        self.sequences.len()
    }

    #[inline(never)]
    #[expect(clippy::cast_precision_loss, reason = "lengths of frames")]
    fn pass(&mut self) -> f64 {
        let mut sum = 0.0;
        self.drive(&mut |frame| sum += frame.len() as f64);
        sum
    }

    fn check(&mut self) -> Result<(), Error> {
        let mut back = Vec::new();
        self.drive(&mut |frame| {
            if let Ok(batch) = codec::decode::<CorrectedBatch>(frame) {
                back.extend(batch.ticks.iter().map(|tick| tick.sequence));
            }
        });
        compare(&self.name, &back, &self.sequences)
    }
}
