//! The fifth generation, byte by byte: corrected batches that say their series.
//!
//! If a test here fails, do not change the test: the change to the messages makes readers in the field fail. Make a new version
//! instead (`protocol/src/version.rs` has the policy) and leave this file as it is.

use isotherm_protocol::codec::{decode, encode};
use isotherm_protocol::corrected::{CorrectedBatch, are_same};

use super::{bytes, v1, v4};

mod frames;

pub(super) use frames::FRAMES;

const SERIES: u64 = 1_700_000_000_000_000_000;

/// The batch of an older generation, of a series.
fn batch(name: &str) -> CorrectedBatch {
    let (_, hex) = v1::FRAMES.iter().chain(v4::FRAMES).find(|(other, _)| *other == name).expect("a frame");
    let mut batch: CorrectedBatch = decode(&bytes(hex)).expect("a good frame");
    batch.series = SERIES;
    batch.ticks.iter_mut().for_each(|tick| tick.series = SERIES);
    batch
}

#[test]
fn corrected_of_a_series() {
    for ((name, hex), old) in FRAMES.iter().zip(["corrected", "corrected-sigma"]) {
        let (frozen, batch) = (bytes(hex), batch(old));
        assert_eq!(encode(&batch).expect("a batch"), frozen, "{name} is written");
        let read: CorrectedBatch = decode(&frozen).expect("a good frame");
        assert_eq!((read.series, &read.sigmas), (SERIES, &batch.sigmas), "{name} is read");
        assert!(
            read.ticks.iter().zip(&batch.ticks).all(|(read, tick)| are_same(read, tick)),
            "{name}: ticks"
        );
        assert!(read.ticks.iter().all(|tick| tick.series == SERIES), "{name}: series of the ticks");
    }
}
