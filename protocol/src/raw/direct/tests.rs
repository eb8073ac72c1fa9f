//! Both readings of a frame are one.

use proptest::prelude::*;

use super::*;
use crate::raw::{self, HalfPeriod, Mode, Readings};

fn mode() -> impl Strategy<Value = Option<Mode>> {
    prop_oneof![Just(None), Just(Some(Mode::Plus)), Just(Some(Mode::Minus))]
}

fn some_readings() -> impl Strategy<Value = Readings> {
    prop_oneof![
        prop::collection::vec(any::<i32>(), 0..=MAX_SENSORS)
            .prop_map(|counts| Readings::Counts(counts.into_iter().collect())),
        prop::collection::vec(any::<f64>(), 0..=MAX_SENSORS)
            .prop_map(|means| Readings::Means(means.into_iter().collect())),
    ]
}

prop_compose! {
    fn gyro_tick(readings: Readings)(
        end_time_ns in any::<i64>(),
        duration_ns in any::<u64>(),
        mode in mode(),
        switch_command in any::<bool>(),
        meander in mode(),
        halves in prop_oneof![Just(0), Just(readings.len()), 0..=MAX_SENSORS],
        half in any::<(i32, i32)>(),
        readings in prop_oneof![9 => Just(readings), 1 => some_readings()],
    ) -> raw::GyroTick {
        let half = HalfPeriod { positive: half.0, negative: half.1 };
        let half_periods = core::iter::repeat_n(half, halves).collect();
        raw::GyroTick { end_time_ns, duration_ns, readings, mode, switch_command, meander, half_periods }
    }
}

fn gyro_batch() -> impl Strategy<Value = GyroBatch> {
    let ticks = some_readings().prop_flat_map(|readings| prop::collection::vec(gyro_tick(readings), 0..6));
    (any::<u64>(), any::<u64>(), ticks).prop_map(|(first_sequence, series, ticks)| GyroBatch {
        first_sequence,
        series,
        ticks,
    })
}

/// The frame of a batch that may be wrong, with one byte of its body changed, taken out or put in.
fn frame_of<M: codec::Message>(batch: &M, damage: Option<(prop::sample::Index, u8, u8)>) -> Vec<u8> {
    let mut frame = Vec::new();
    codec::encode_as::<M>(batch, &mut frame).unwrap();
    if let Some((place, how, byte)) = damage {
        frame.truncate(frame.len() - 4);
        let place = 2 + place.index(frame.len() - 2);
        match how % 3 {
            0 => frame[place] = byte,
            1 => drop(frame.remove(place)),
            _ => frame.insert(place, byte),
        }
        let checksum = crc32fast::hash(&frame);
        frame.extend(checksum.to_le_bytes());
    }
    frame
}

fn damage() -> impl Strategy<Value = Option<(prop::sample::Index, u8, u8)>> {
    prop::option::of(any::<(prop::sample::Index, u8, u8)>())
}

/// Compared as text, where numbers that are none are equal too.
fn words<T: core::fmt::Debug>(read: &Result<(OutputKind, Vec<T>), CodecError>) -> String {
    format!("{read:?}")
}

proptest! {
    #[test]
    fn a_gyro_frame_reads_as_its_batch(batch in gyro_batch(), damage in damage()) {
        let frame = frame_of(&batch, damage);
        let mut ticks = vec![GyroTick::default(); 3];
        let direct = read_gyro(&frame, &mut ticks).map(|output| (output, ticks));
        let decoded = codec::decode::<GyroBatch>(&frame);
        prop_assert_eq!(words(&direct), words(&decoded.map(|batch| (batch.output(), batch.to_core().collect()))));
    }

    #[test]
    fn an_accelerometer_frame_reads_as_its_batch(batch in gyro_batch(), damage in damage()) {
        let ticks = batch.ticks.into_iter().map(|tick| raw::AccelTick {
            end_time_ns: tick.end_time_ns,
            duration_ns: tick.duration_ns,
            readings: tick.readings,
        });
        let batch = AccelBatch { first_sequence: batch.first_sequence, ticks: ticks.collect() };
        let frame = frame_of(&batch, damage);
        let mut ticks = Vec::new();
        let direct = read_accel(&frame, &mut ticks).map(|output| (output, ticks));
        let decoded = codec::decode::<AccelBatch>(&frame);
        prop_assert_eq!(words(&direct), words(&decoded.map(|batch| (batch.output(), batch.to_core().collect()))));
    }

    #[test]
    fn a_temperature_frame_reads_as_its_batch(
        channels in 0..=MAX_CHANNELS,
        ticks in prop::collection::vec((any::<i64>(), any::<f64>(), prop::option::of(0..=MAX_CHANNELS)), 0..6),
        damage in damage(),
    ) {
        let name = |index| ChannelName::from(&format!("channel {index}")).unwrap();
        let tick = |(time_ns, raw, other): (i64, f64, Option<usize>)| raw::TemperatureTick {
            time_ns,
            raw: core::iter::repeat_n(raw, other.filter(|_| raw > 0.0).unwrap_or(channels)).collect(),
        };
        let batch = TemperatureBatch {
            channels: (0..channels).map(name).collect(),
            ticks: ticks.into_iter().map(tick).collect(),
        };
        let frame = frame_of(&batch, damage);
        let mut readings = Vec::new();
        let direct = read_temperatures(&frame, &mut readings).map(|()| (OutputKind::Mean, readings));
        let decoded = codec::decode::<TemperatureBatch>(&frame);
        prop_assert_eq!(words(&direct), words(&decoded.map(|batch| (OutputKind::Mean, batch.to_core().collect()))));
    }
}
