//! Laws of the codec, for any message and any bytes.

mod journal;
mod status;

use std::fmt::Debug;

use isotherm_correction::sample::{LasingMode as Mode, MAX_CHANNEL_NAME, MAX_PARITY, MAX_SENSORS};
use isotherm_protocol::codec::{CodecError, Message, decode, encode};
use isotherm_protocol::corrected::{AppliedTemperature, Revision};
use isotherm_protocol::raw::MAX_CHANNELS;
use proptest::collection::{hash_set, vec};
use proptest::prelude::*;
use proptest::sample::select;

use super::form::{
    AccelBatch, AccelTick, CorrectedBatch, CorrectedTick, Form, GyroBatch, GyroTick, HalfPeriod, Readings,
    TemperatureBatch, TemperatureTick,
};
use super::{bytes, decode_as, frames};

/// Any binary64 at all: every NaN, infinities, subnormal numbers.
fn number() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits)
}

fn mode() -> impl Strategy<Value = Option<Mode>> {
    select(vec![None, Some(Mode::Plus), Some(Mode::Minus)])
}

/// Readings of ticks that can stand in one batch: one kind, one number of sensors.
fn readings(ticks: usize) -> impl Strategy<Value = Vec<Readings>> {
    (any::<bool>(), 0..=MAX_SENSORS).prop_flat_map(move |(counts, sensors)| {
        let means = vec(number(), sensors).prop_map(|v| Readings::Means(v.into_iter().collect()));
        let counts_ = vec(any::<i32>(), sensors).prop_map(|v| Readings::Counts(v.into_iter().collect()));
        if counts { vec(counts_.boxed(), ticks) } else { vec(means.boxed(), ticks) }
    })
}

prop_compose! {
    fn gyro_tick(readings: Readings)(
        end_time_ns in any::<i64>(),
        duration_ns in any::<u64>(),
        mode in mode(),
        switch_command in any::<bool>(),
        meander in mode(),
        half_periods in prop_oneof![Just(Vec::new()), vec(any::<(i32, i32)>(), readings.len())],
        readings in Just(readings),
    ) -> GyroTick {
        let half_periods =
            half_periods.into_iter().map(|(positive, negative)| HalfPeriod { positive, negative }).collect();
        GyroTick { end_time_ns, duration_ns, readings, mode, switch_command, meander, half_periods }
    }
}

fn gyro_batch() -> impl Strategy<Value = GyroBatch> {
    let ticks = (1..20usize)
        .prop_flat_map(readings)
        .prop_flat_map(|all| all.into_iter().map(gyro_tick).collect::<Vec<_>>());
    (any::<(u64, u64)>(), ticks).prop_map(|((first_sequence, series), ticks)| GyroBatch {
        first_sequence,
        series,
        ticks,
    })
}

fn accel_batch() -> impl Strategy<Value = AccelBatch> {
    let tick = |readings| {
        any::<(i64, u64)>().prop_map(move |(end_time_ns, duration_ns)| AccelTick {
            end_time_ns,
            duration_ns,
            readings: Readings::clone(&readings),
        })
    };
    let ticks = (1..20usize)
        .prop_flat_map(readings)
        .prop_flat_map(move |all| all.into_iter().map(tick).collect::<Vec<_>>());
    (any::<u64>(), ticks).prop_map(|(first_sequence, ticks)| AccelBatch { first_sequence, ticks })
}

/// A channel name of up to 24 bytes, cut at a character.
fn channel() -> impl Strategy<Value = isotherm_correction::sample::ChannelName> {
    any::<String>().prop_map(|text| {
        let end = (0..=MAX_CHANNEL_NAME.min(text.len())).rev().find(|&end| text.is_char_boundary(end));
        text[..end.unwrap_or(0)].try_into().expect("short enough")
    })
}

fn temperature_batch() -> impl Strategy<Value = TemperatureBatch> {
    hash_set(channel(), 1..=MAX_CHANNELS).prop_flat_map(|channels| {
        let tick = (any::<i64>(), vec(number(), channels.len()))
            .prop_map(|(time_ns, raw)| TemperatureTick { time_ns, raw: raw.into_iter().collect() });
        vec(tick, 1..20)
            .prop_map(move |ticks| TemperatureBatch { channels: channels.iter().copied().collect(), ticks })
    })
}

fn revision() -> impl Strategy<Value = Revision> {
    any::<(u64, [u8; 8])>().prop_map(|(counter, digest)| Revision { counter, digest })
}

prop_compose! {
    fn corrected_tick()(
        (sequence, end_time_ns, duration_ns) in any::<(u64, i64, u64)>(),
        (ticks, missed, flags) in any::<(u16, u64, u16)>(),
        mode in mode(),
        increments in [number(), number(), number(), number(), number(), number()],
        gyro_flags in vec(any::<u8>(), 0..=MAX_SENSORS),
        accel_flags in vec(any::<u8>(), 0..=MAX_SENSORS),
        gyro_parity in vec(number(), 0..=MAX_PARITY),
        accel_parity in vec(number(), 0..=MAX_PARITY),
    ) -> CorrectedTick {
        let [a, b, c, x, y, z] = increments;
        CorrectedTick {
            sequence,
            end_time_ns,
            duration_ns,
            ticks,
            missed,
            delta_angle_rad: [a, b, c],
            delta_velocity_m_per_s: [x, y, z],
            mode,
            flags,
            gyro_flags: gyro_flags.into_iter().collect(),
            accel_flags: accel_flags.into_iter().collect(),
            gyro_parity_rad_per_s: gyro_parity.into_iter().collect(),
            accel_parity_m_per_s2: accel_parity.into_iter().collect(),
        }
    }
}

fn corrected_batch() -> impl Strategy<Value = CorrectedBatch> {
    let temperature = (channel(), number(), number()).prop_map(|(channel, temperature_deg_c, rate)| {
        AppliedTemperature { channel, temperature_deg_c, rate_deg_c_per_s: rate }
    });
    (any::<String>(), revision(), vec(temperature, 0..=MAX_CHANNELS), vec(corrected_tick(), 1..20)).prop_map(
        |(unit, revision, temperatures, ticks)| {
            let temperatures = temperatures.into_iter().collect();
            CorrectedBatch { unit, revision, temperatures, ticks }
        },
    )
}

/// What is encoded decodes to the same, and encodes to the same bytes again.
///
/// The messages are compared as bytes: a NaN is not equal to itself, but must keep its bits.
fn comes_back<M: Message + Debug>(message: &M) -> Result<(), TestCaseError> {
    let frame = encode(message).expect("a message within its limits");
    let decoded: M = decode(&frame).expect("its frame");
    prop_assert_eq!(format!("{:?}", message), format!("{:?}", decoded));
    prop_assert_eq!(encode(&decoded).expect("the same message"), frame);
    Ok(())
}

proptest! {
    #[test]
    fn messages_come_back(
        gyro in gyro_batch(),
        accel in accel_batch(),
        temperature in temperature_batch(),
        corrected in corrected_batch(),
        series: u64,
        status in status::status(),
        service in status::service_status(),
        health in status::health_batch(),
        reference in status::reference(),
    ) {
        comes_back(&gyro.message())?;
        comes_back(&accel.message())?;
        comes_back(&temperature.message())?;
        let mut corrected = corrected.message();
        comes_back(&corrected)?;
        corrected.series = series;
        corrected.ticks.iter_mut().for_each(|tick| tick.series = series);
        comes_back(&corrected)?;
        comes_back(&status)?;
        comes_back(&service)?;
        comes_back(&health)?;
        comes_back(&reference)?;
    }

    #[test]
    fn no_bytes_make_the_decoder_panic(frame in vec(any::<u8>(), 0..300), kind in 1..=9u8) {
        let _ = decode_as(kind, &frame);
    }

    /// Behind a good header and checksum, where the body itself is looked at.
    #[test]
    fn no_body_makes_the_decoder_panic(body in vec(any::<u8>(), 0..300), kind in 1..=9u8, version in 1..=3u8) {
        let _ = decode_as(kind, &sealed(kind, version, &body));
    }

    /// Nearly good: one byte of a good body replaced, the checksum made to fit.
    #[test]
    fn no_damage_makes_the_decoder_panic(which: prop::sample::Index, place in any::<prop::sample::Index>(), byte: u8) {
        let all: Vec<_> = frames().collect();
        let mut frame = bytes(all[which.index(all.len())].1);
        let body = 2..frame.len() - 4;
        frame[body.start + place.index(body.len())] = byte;
        let _ = decode_as(frame[0], &sealed(frame[0], frame[1], &frame[body]));
    }
}

/// A frame with the checksum that it must have.
fn sealed(kind: u8, version: u8, body: &[u8]) -> Vec<u8> {
    let mut frame = vec![kind, version];
    frame.extend(body);
    let Err(CodecError::Checksum { need, .. }) = decode_as(kind, &[&frame[..], &[0; 4]].concat()) else {
        // Zero was right by chance.
        return [&frame[..], &[0; 4]].concat();
    };
    frame.extend(need.to_le_bytes());
    frame
}

#[test]
fn every_flipped_bit_is_noticed() {
    for (name, hex) in frames() {
        let good = bytes(hex);
        for bit in 0..good.len() * 8 {
            let mut frame = good.clone();
            frame[bit / 8] ^= 1 << (bit % 8);
            assert!(decode_as(good[0], &frame).is_err(), "{name}: bit {bit}");
        }
    }
}

#[test]
fn every_frame_that_ends_too_early_is_noticed() {
    for (name, hex) in frames() {
        let good = bytes(hex);
        for length in 0..good.len() {
            assert!(decode_as(good[0], &good[..length]).is_err(), "{name}: {length} bytes");
        }
        let body = &good[2..good.len() - 4];
        for length in 0..body.len() {
            let cut = sealed(good[0], good[1], &body[..length]);
            assert!(decode_as(good[0], &cut).is_err(), "{name}: {length} bytes of the body");
        }
    }
}
