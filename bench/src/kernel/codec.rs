//! Decoding and encoding apart, per batch size.

use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, Revision};
use isotherm_protocol::raw::GyroBatch;
use isotherm_correction::sample::{CorrectedTick, GyroTick, OutputKind};

use super::Kernel;
use super::unit::{UnitCase, unit_cases};
use crate::error::Error;

/// Batch sizes, with what their rows are called.
const SIZES: [(usize, &str, &str); 3] = [
    (1, "decode raw gyros, batches of 1", "encode corrected, batches of 1"),
    (10, "decode raw gyros, batches of 10", "encode corrected, batches of 10"),
    (100, "decode raw gyros, batches of 100", "encode corrected, batches of 100"),
];
/// Ticks of a pass.
const TICKS: usize = 20_000;

/// Decoding of frames of raw gyro ticks, to what the core takes.
struct Decode {
    name: &'static str,
    frames: Vec<Vec<u8>>,
    ticks: Vec<GyroTick>,
    room: Vec<GyroTick>,
}

/// Encoding of corrected ticks.
struct Encode {
    name: &'static str,
    batches: Vec<Vec<CorrectedTick>>,
    room: Vec<u8>,
}

/// All batch sizes, on ticks of the Zeeman unit, which have the most in them.
pub(crate) fn codec_cases() -> Vec<Box<dyn Kernel>> {
    let mut cases: Vec<Box<dyn Kernel>> = Vec::new();
    let Ok(units) = unit_cases() else { return cases };
    let Some(unit) = units.iter().find(|unit| unit.output() == OutputKind::Counts) else { return cases };
    let (raw, corrected) = ticks(unit);
    for (size, decode, encode) in SIZES {
        let frames = raw.chunks(size).filter_map(|ticks| {
            codec::encode(&GyroBatch::from_core(unit.output(), ticks)?).ok()
        });
        cases.push(Box::new(Decode { name: decode, frames: frames.collect(), ticks: raw.clone(), room: Vec::new() }));
        let batches = corrected.chunks(size).map(<[_]>::to_vec).collect();
        cases.push(Box::new(Encode { name: encode, batches, room: Vec::new() }));
    }
    cases
}

fn ticks(unit: &UnitCase) -> (Vec<GyroTick>, Vec<CorrectedTick>) {
    let corrected = unit.corrected().into_iter().take(TICKS).collect();
    (unit.gyro_ticks().take(TICKS).cloned().collect(), corrected)
}

impl Decode {
    fn decode(&mut self, each: &mut dyn FnMut(&GyroTick)) {
        for frame in &self.frames {
            let Ok(batch) = codec::decode::<GyroBatch>(frame) else { continue };
            self.room.clear();
            self.room.extend(batch.to_core());
            self.room.iter().for_each(&mut *each);
        }
    }
}

impl Kernel for Decode {
    fn name(&self) -> &'static str {
        self.name
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

    #[expect(clippy::cast_precision_loss, reason = "some ten thousand ticks")]
    fn check(&mut self) -> Result<(), Error> {
        let mut back = Vec::new();
        self.decode(&mut |tick| back.push(tick.clone()));
        let differ = back.iter().zip(&self.ticks).filter(|(back, tick)| back != tick).count();
        let value = (differ + back.len().abs_diff(self.ticks.len())) as f64;
        if value > 0.0 {
            return Err(Error::Wrong { case: self.name, what: "number of ticks that differ", value, limit: 0.0 });
        }
        Ok(())
    }
}

impl Encode {
    fn encode(&mut self, each: &mut dyn FnMut(&[u8])) {
        for ticks in &self.batches {
            let batch = CorrectedBatch {
                unit: "ZLG-0001".to_owned(),
                revision: Revision { counter: 1, digest: [7; 8] },
                temperatures: Default::default(),
                ticks: ticks.iter().map(Into::into).collect(),
            };
            if codec::encode_into(&batch, &mut self.room).is_ok() {
                each(&self.room);
            }
        }
    }
}

impl Kernel for Encode {
    fn name(&self) -> &'static str {
        self.name
    }

    fn ticks(&self) -> usize {
        self.batches.iter().map(Vec::len).sum()
    }

    #[inline(never)]
    #[expect(clippy::cast_precision_loss, reason = "lengths of frames")]
    fn pass(&mut self) -> f64 {
        let mut sum = 0.0;
        self.encode(&mut |frame| sum += frame.len() as f64);
        sum
    }

    #[expect(clippy::cast_precision_loss, reason = "some ten thousand ticks")]
    fn check(&mut self) -> Result<(), Error> {
        let expected: Vec<CorrectedTick> = self.batches.concat();
        let mut back = Vec::new();
        self.encode(&mut |frame| {
            if let Ok(batch) = codec::decode::<CorrectedBatch>(frame) {
                back.extend(batch.ticks);
            }
        });
        let wire: Vec<isotherm_protocol::corrected::CorrectedTick> = expected.iter().map(Into::into).collect();
        let differ = back.iter().zip(&wire).filter(|(back, tick)| back != tick).count();
        let value = (differ + back.len().abs_diff(wire.len())) as f64;
        if value > 0.0 {
            return Err(Error::Wrong { case: self.name, what: "number of ticks that differ", value, limit: 0.0 });
        }
        Ok(())
    }
}
