//! What the sink reads of a frame while the clock runs: only its head, so that it costs the sink little and as much whatever
//! stood in the middle. What is behind it is checked afterwards, on the frames that were kept.

use arrayvec::ArrayVec;
use isotherm_protocol::corrected::{AppliedTemperature, Revision};
use isotherm_protocol::raw::MAX_CHANNELS;
use serde::Deserialize;

use crate::chain::Subject;

/// Bytes of one tick in what the Python script writes.
pub(crate) const PLAIN_TICK: usize = 48;
/// Bytes in front of them: the sequence number.
pub(crate) const PLAIN_HEAD: usize = 8;

/// What a message is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Head {
    /// Sequence number of its first tick.
    pub(crate) first: u64,
    /// Its ticks.
    pub(crate) ticks: u64,
    /// Revision of the calibration, where there is one.
    pub(crate) revision: u64,
}

/// What stands in front of the ticks of a corrected batch, and the first field of the first of them.
#[derive(Deserialize)]
struct Corrected<'a> {
    #[serde(borrow)]
    _unit: &'a str,
    revision: Revision,
    _temperatures: ArrayVec<AppliedTemperature, MAX_CHANNELS>,
    ticks: u64,
    first: u64,
}

/// Reads the head of a frame of what stands in the middle; `None` where it has none.
pub(crate) fn read(subject: Subject, frame: &[u8]) -> Option<Head> {
    // Kind and version; the checksum is behind the body.
    let body = frame.get(2..)?;
    match subject {
        Subject::Relay | Subject::Keyed => {
            let ((first, _series, ticks), _) = postcard::take_from_bytes::<(u64, u64, u64)>(body).ok()?;
            Some(Head { first, ticks, revision: 0 })
        }
        Subject::Service => {
            let (head, _) = postcard::take_from_bytes::<Corrected<'_>>(body).ok()?;
            Some(Head { first: head.first, ticks: head.ticks, revision: head.revision.counter })
        }
        Subject::Python => {
            let (first, ticks) = frame.split_first_chunk::<PLAIN_HEAD>()?;
            let whole = !ticks.is_empty() && ticks.len() % PLAIN_TICK == 0;
            whole.then(|| Head {
                first: u64::from_le_bytes(*first),
                ticks: (ticks.len() / PLAIN_TICK) as u64,
                revision: 0,
            })
        }
    }
}

/// Number of the unit in a key such as `imu/BENCH-00042/corrected`.
pub(crate) fn unit_of(key: &str) -> Option<usize> {
    key.split('/').nth(1)?.strip_prefix("BENCH-")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use isotherm_protocol::codec;
    use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick};
    use isotherm_protocol::raw::GyroBatch;

    use super::*;
    use crate::chain::Case;
    use crate::part::frames::Instrument;
    use crate::part::unit_name;

    #[test]
    fn the_head_is_what_the_whole_frame_says() {
        let message =
            Instrument::simulate(1000).unwrap().message(&Case::paced(1, 1000, 3, 0.1), 4, 7).unwrap();
        let raw: GyroBatch = codec::decode(&message.gyro).unwrap();
        assert_eq!(read(Subject::Relay, &message.gyro), Some(Head { first: 21, ticks: 3, revision: 0 }));
        assert_eq!((raw.ticks[0].sequence, raw.ticks.len()), (21, 3));

        let tick = CorrectedTick { sequence: 300, ticks: 1, ..CorrectedTick::default() };
        let batch = CorrectedBatch {
            unit: unit_name(42).unwrap().to_string(),
            series: 0,
            revision: Revision { counter: 1000, digest: [9; 8] },
            temperatures: ArrayVec::new(),
            ticks: vec![tick.clone(), tick],
            sigmas: Vec::new(),
        };
        let frame = codec::encode(&batch).unwrap();
        assert_eq!(read(Subject::Service, &frame), Some(Head { first: 300, ticks: 2, revision: 1000 }));

        let plain = [&7_u64.to_le_bytes()[..], &[0; 2 * PLAIN_TICK]].concat();
        assert_eq!(read(Subject::Python, &plain), Some(Head { first: 7, ticks: 2, revision: 0 }));
        assert_eq!(read(Subject::Python, &plain[..60]), None);
    }

    #[test]
    fn the_unit_is_read_from_its_key() {
        let key = isotherm_protocol::key::corrected(&unit_name(42).unwrap());
        assert_eq!(unit_of(&key), Some(42));
        assert_eq!(unit_of("imu/MEMS-0001/corrected"), None);
    }
}
