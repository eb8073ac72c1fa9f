//! Decoding and encoding apart, per batch size, as the service does them.

use arrayvec::ArrayVec;
use isotherm_correction::sample::GyroTick;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, Revision};
use isotherm_protocol::raw::{GyroBatch, TickReader};

use super::{Kernel, unit};
use crate::error::Error;

/// Ticks of a pass.
pub(super) const TICKS: usize = 20_000;

/// Decoding of frames of raw gyro ticks of the Zeeman unit, which have the most in them, to what the core takes.
pub(super) struct Decode {
    name: String,
    frames: Vec<Vec<u8>>,
    ticks: Vec<GyroTick>,
    reader: TickReader<GyroTick>,
}

/// Encoding of corrected ticks of the Zeeman unit.
pub(super) struct Encode {
    name: String,
    batches: Vec<CorrectedBatch>,
    room: Vec<u8>,
}

impl Decode {
    /// Batches of `size`.
    pub(super) fn of(size: usize) -> Result<Self, Error> {
        let unit = unit::zeeman()?;
        let ticks: Vec<_> = unit.gyro_ticks().take(TICKS).cloned().collect();
        let batches =
            ticks.chunks(size).map(|ticks| GyroBatch { output: unit.output, ticks: ticks.to_vec() });
        let frames = batches.filter_map(|batch| codec::encode(&batch).ok());
        let name = format!("decode raw gyros, batches of {size}");
        Ok(Self { name, frames: frames.collect(), ticks, reader: TickReader::default() })
    }

    fn decode(&mut self, each: &mut dyn FnMut(&GyroTick)) {
        for frame in &self.frames {
            if let Ok((_, ticks)) = self.reader.read(frame) {
                ticks.iter().for_each(&mut *each);
            }
        }
    }
}

/// Whether so many of so many ticks came back as they were.
#[expect(clippy::cast_precision_loss, reason = "some ten thousand ticks")]
pub(super) fn compare<T: PartialEq>(case: &str, back: &[T], ticks: &[T]) -> Result<(), Error> {
    let differ = back.iter().zip(ticks).filter(|(back, tick)| back != tick).count();
    let value = (differ + back.len().abs_diff(ticks.len())) as f64;
    if value > 0.0 {
        let (case, what) = (case.to_owned(), "number of ticks that differ");
        return Err(Error::Wrong { case, what, value, limit: 0.0 });
    }
    Ok(())
}

impl Kernel for Decode {
    fn name(&self) -> &str {
        &self.name
    }

    fn ticks(&self) -> usize {
        self.ticks.len()
    }

    #[inline(never)]
    fn pass(&mut self) -> f64 {
        let mut sum = 0.0;
        self.decode(&mut |tick| sum += tick.readings.first().copied().unwrap_or(0.0));
        sum
    }

    fn check(&mut self) -> Result<(), Error> {
        let mut back = Vec::new();
        self.decode(&mut |tick| back.push(tick.clone()));
        compare(&self.name, &back, &self.ticks)
    }
}

impl Encode {
    /// Batches of `size`.
    pub(super) fn of(size: usize) -> Result<Self, Error> {
        let corrected: Vec<_> = unit::zeeman()?.corrected().into_iter().take(TICKS).collect();
        let batches = corrected.chunks(size).map(|ticks| CorrectedBatch {
            unit: "ZLG-0001".to_owned(),
            series: ticks.first().map_or(0, |tick| tick.series),
            revision: Revision { counter: 1, digest: [7; 8] },
            temperatures: ArrayVec::new(),
            ticks: ticks.to_vec(),
            sigmas: Vec::new(),
        });
        let name = format!("encode corrected, batches of {size}");
        Ok(Self { name, batches: batches.collect(), room: Vec::new() })
    }

    fn encode(&mut self, each: &mut dyn FnMut(&[u8])) {
        for batch in &self.batches {
            if codec::encode_into(batch, &mut self.room).is_ok() {
                each(&self.room);
            }
        }
    }
}

impl Kernel for Encode {
    fn name(&self) -> &str {
        &self.name
    }

    fn ticks(&self) -> usize {
        self.batches.iter().map(|batch| batch.ticks.len()).sum()
    }

    #[inline(never)]
    #[expect(clippy::cast_precision_loss, reason = "lengths of frames")]
    fn pass(&mut self) -> f64 {
        let mut sum = 0.0;
        self.encode(&mut |frame| sum += frame.len() as f64);
        sum
    }

    fn check(&mut self) -> Result<(), Error> {
        let mut back = Vec::new();
        self.encode(&mut |frame| {
            if let Ok(batch) = codec::decode::<CorrectedBatch>(frame) {
                back.extend(batch.ticks);
            }
        });
        let ticks: Vec<_> = self.batches.iter().flat_map(|batch| batch.ticks.iter().cloned()).collect();
        compare(&self.name, &back, &ticks)
    }
}
