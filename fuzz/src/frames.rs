//! Frames of every kind.

use isotherm_protocol::codec::{CodecError, Kind, Message, decode, encode};
use isotherm_protocol::raw::{RawBatch, RawTick, TemperatureBatch, TickReader, read_temperatures};

use crate::said::in_few_words;

/// A frame, as it is and with a kind and a checksum that fit: what is taken is written and read back as the same.
pub fn frame<M: Message>(input: &[u8]) {
    as_it_is_and_sealed::<M>(input, |frame| written_again::<M>(frame).map(drop));
}

/// Likewise, for frames that are also read into room that is used again.
pub fn raw<T: RawTick + Clone>(input: &[u8]) {
    // What an earlier frame left there.
    let mut reader = TickReader::<T>::default();
    as_it_is_and_sealed::<RawBatch<T>>(input, |frame| {
        let written = written_again::<RawBatch<T>>(frame);
        let read = reader.read(frame).map(|(output, ticks)| RawBatch { output, ticks: ticks.to_vec() });
        match &written {
            Ok(written) => {
                let batch = read.expect("both readers take it");
                assert_eq!(encode(&batch).as_ref(), Ok(written), "both readers read the same");
            }
            Err(error) => assert_eq!(read.map(drop), Err(error.clone()), "both readers refuse it"),
        }
        written.map(drop)
    });
}

/// Likewise, for temperatures.
pub fn temperature(input: &[u8]) {
    let mut readings = Vec::new();
    as_it_is_and_sealed::<TemperatureBatch>(input, |frame| {
        let written = written_again::<TemperatureBatch>(frame);
        let read = read_temperatures(frame, &mut readings);
        match &written {
            Ok(written) => {
                read.expect("both readers take it");
                let batch = TemperatureBatch { readings: std::mem::take(&mut readings) };
                assert_eq!(&encode(&batch).unwrap_or_default(), written, "both readers read the same");
                readings = batch.readings;
            }
            Err(error) => assert_eq!(read.as_ref(), Err(error), "both readers refuse it"),
        }
        written.map(drop)
    });
}

/// The frame with its kind's byte and its checksum put right: else hardly a change would be looked at.
#[must_use]
pub fn sealed<M: Message>(frame: &[u8]) -> Option<Vec<u8>> {
    let (body, checksum) = frame.split_last_chunk::<4>()?;
    let mut sealed = body.to_vec();
    *sealed.first_mut()? = M::KIND as u8;
    let fitting = crc32fast::hash(&sealed).to_le_bytes();
    let fits = frame.first() == sealed.first() && fitting == *checksum;
    sealed.extend(fitting);
    (!fits).then_some(sealed)
}

fn as_it_is_and_sealed<M: Message>(input: &[u8], mut read: impl FnMut(&[u8]) -> Result<(), CodecError>) {
    for frame in [Some(input.to_vec()), sealed::<M>(input)].into_iter().flatten() {
        if let Err(error) = read(&frame) {
            in_few_words(&error);
        }
    }
}

/// What a frame says, written by this version.
fn written_again<M: Message>(frame: &[u8]) -> Result<Vec<u8>, CodecError> {
    let message = decode::<M>(frame)?;
    let written = match encode(&message) {
        // Ticks without channels are read, and leave nothing to write. Of a channel that is named twice a unit counts the second
        // reading as out of order.
        Err(CodecError::Ticks { count: 0 } | CodecError::MixedReadings { .. })
            if M::KIND == Kind::RawTemperature =>
        {
            return Ok(Vec::new());
        }
        written => written.expect("what is read can be written"),
    };
    let again = decode::<M>(&written).expect("what is written can be read");
    assert_eq!(encode(&again).as_ref(), Ok(&written), "and says the same");
    Ok(written)
}
