//! The form of raw batches is postcard's: frames are held against plain structures that serde writes and reads.

use arrayvec::ArrayVec;
use isotherm_correction::sample::{ChannelName, HalfPeriodCounts, LasingMode, TemperatureReading};
use proptest::prelude::*;
use serde::{Deserialize, Serialize};

use super::*;
use crate::codec::{bounded, decode, encode, seal, whole};

#[derive(Debug, Clone, Serialize, Deserialize)]
enum Readings {
    Counts(ArrayVec<i32, MAX_SENSORS>),
    Means(ArrayVec<f64, MAX_SENSORS>),
}

/// End (ns), duration (ns), readings.
type PlainAccel = (i64, u64, Readings);
/// Likewise; mode, switch command, meander, half periods.
type PlainGyro =
    (i64, u64, Readings, Option<LasingMode>, bool, Option<LasingMode>, ArrayVec<(i32, i32), MAX_SENSORS>);

#[derive(Debug, Serialize, Deserialize)]
struct Ticks<T>(
    #[serde(
        deserialize_with = "bounded::<_, _, MAX_TICKS>",
        bound = "T: Serialize + for<'a> Deserialize<'a>"
    )]
    Vec<T>,
);

/// First sequence number, series.
type PlainGyros = (u64, u64, Ticks<PlainGyro>);
type PlainAccels = (u64, Ticks<PlainAccel>);
type PlainTemperatures = (ArrayVec<ChannelName, MAX_CHANNELS>, Ticks<(i64, ArrayVec<f64, MAX_CHANNELS>)>);

impl Readings {
    fn output(&self) -> OutputKind {
        match self {
            Self::Counts(_) => OutputKind::Counts,
            Self::Means(_) => OutputKind::Mean,
        }
    }

    fn values(&self) -> Sensors<f64> {
        match self {
            Self::Counts(counts) => counts.iter().copied().map(f64::from).collect(),
            Self::Means(means) => means.clone(),
        }
    }
}

fn check_plain<'a>(
    mut readings: impl ExactSizeIterator<Item = &'a Readings>,
) -> Result<OutputKind, CodecError> {
    let count = readings.len();
    let like = |readings: &Readings| (readings.output(), readings.values().len());
    let Some(first) = readings.next() else { return Err(CodecError::Ticks { count }) };
    match readings.position(|readings| like(readings) != like(first)) {
        Some(index) => Err(CodecError::MixedReadings { index: index + 1 }),
        None => Ok(first.output()),
    }
}

fn span(ns: u64) -> Span {
    Span::from_ns(i64::try_from(ns).unwrap_or(i64::MAX))
}

fn gyros((first, series, Ticks(plain)): PlainGyros) -> Result<GyroBatch, CodecError> {
    let output = check_plain(plain.iter().map(|tick| &tick.2))?;
    for (index, tick) in plain.iter().enumerate() {
        let (got, need) = (tick.6.len(), tick.2.values().len());
        if got != 0 && got != need {
            return Err(CodecError::HalfPeriods { index, got, need });
        }
    }
    let tick = |(index, (end_ns, duration_ns, readings, mode, switch_command, meander, halves)): (
        u64,
        PlainGyro,
    )| GyroTick {
        sequence: first.saturating_add(index),
        end_time: Timestamp::from_ns(end_ns),
        duration: span(duration_ns),
        readings: readings.values().into(),
        mode,
        switch_command,
        meander,
        half_periods: halves
            .into_iter()
            .map(|(positive, negative)| HalfPeriodCounts { positive, negative })
            .collect(),
        series,
    };
    Ok(GyroBatch { output, ticks: (0..).zip(plain).map(tick).collect() })
}

fn accels((first, Ticks(plain)): PlainAccels) -> Result<AccelBatch, CodecError> {
    let output = check_plain(plain.iter().map(|tick| &tick.2))?;
    let tick = |(index, (end_ns, duration_ns, readings)): (u64, PlainAccel)| AccelTick {
        sequence: first.saturating_add(index),
        end_time: Timestamp::from_ns(end_ns),
        duration: span(duration_ns),
        readings: readings.values().into(),
    };
    Ok(AccelBatch { output, ticks: (0..).zip(plain).map(tick).collect() })
}

fn temperatures((channels, Ticks(plain)): PlainTemperatures) -> Result<TemperatureBatch, CodecError> {
    if plain.is_empty() {
        return Err(CodecError::Ticks { count: 0 });
    }
    let need = channels.len();
    if let Some(index) = plain.iter().position(|tick| tick.1.len() != need) {
        return Err(CodecError::ChannelReadings { index, got: plain[index].1.len(), need });
    }
    let tick = |(time_ns, raw): (i64, ArrayVec<f64, MAX_CHANNELS>)| {
        let time = Timestamp::from_ns(time_ns);
        let reading = move |(channel, raw)| TemperatureReading { channel, time, raw };
        channels.clone().into_iter().zip(raw).map(reading)
    };
    Ok(TemperatureBatch { readings: plain.into_iter().flat_map(tick).collect() })
}

fn mode() -> impl Strategy<Value = Option<LasingMode>> {
    prop_oneof![Just(None), Just(Some(LasingMode::Plus)), Just(Some(LasingMode::Minus))]
}

fn any_readings() -> impl Strategy<Value = Readings> {
    prop_oneof![
        prop::collection::vec(any::<i32>(), 0..=MAX_SENSORS)
            .prop_map(|counts| Readings::Counts(counts.into_iter().collect())),
        prop::collection::vec(any::<f64>(), 0..=MAX_SENSORS)
            .prop_map(|means| Readings::Means(means.into_iter().collect())),
    ]
}

prop_compose! {
    fn plain_gyro(readings: Readings)(
        end_ns in any::<i64>(),
        // Few are longer than the longest span.
        duration_ns in prop_oneof![9 => 0..1_u64 << 63, 1 => any::<u64>()],
        mode in mode(),
        switch_command in any::<bool>(),
        meander in mode(),
        halves in prop_oneof![3 => Just(0), 5 => Just(readings.values().len()), 1 => 0..=MAX_SENSORS],
        half in any::<(i32, i32)>(),
        readings in prop_oneof![19 => Just(readings), 1 => any_readings()],
    ) -> PlainGyro {
        (end_ns, duration_ns, readings, mode, switch_command, meander, std::iter::repeat_n(half, halves).collect())
    }
}

fn plain_gyros() -> impl Strategy<Value = PlainGyros> {
    let ticks = any_readings().prop_flat_map(|readings| prop::collection::vec(plain_gyro(readings), 0..6));
    (any::<u64>(), any::<u64>(), ticks.prop_map(Ticks))
}

/// The frame of a body, with one byte of it changed, taken out or put in.
fn frame_of<M: Message>(body: &impl Serialize, damage: Option<(prop::sample::Index, u8, u8)>) -> Vec<u8> {
    let mut frame = vec![M::KIND as u8, M::VERSIONS.current];
    frame.extend(postcard::to_allocvec(body).unwrap());
    if let Some((place, how, byte)) = damage {
        let place = 2 + place.index(frame.len() - 2);
        match how % 3 {
            0 => frame[place] = byte,
            1 => drop(frame.remove(place)),
            _ => frame.insert(place, byte),
        }
    }
    seal(&mut frame);
    frame
}

fn damage() -> impl Strategy<Value = Option<(prop::sample::Index, u8, u8)>> {
    prop::option::of(any::<(prop::sample::Index, u8, u8)>())
}

/// A frame is read as serde reads it, or refused for the same reason; what is not damaged is written with the same bytes.
fn holds<M, P>(
    body: &P,
    damage: Option<(prop::sample::Index, u8, u8)>,
    of_plain: fn(P) -> Result<M, CodecError>,
    is_written: bool,
) -> Result<(), TestCaseError>
where
    M: Message + std::fmt::Debug,
    P: Serialize + for<'de> Deserialize<'de>,
{
    let frame = frame_of::<M>(body, damage);
    // Serde does not say which limit a body exceeds.
    let read = decode::<M>(&frame).map_err(|error| match error {
        CodecError::Value { .. } | CodecError::Ticks { count: MAX_TICKS.. } => CodecError::Malformed,
        error => error,
    });
    let plain = whole::<P>(&frame[2..frame.len() - 4]).and_then(of_plain);
    // Compared as text, where numbers that are none are equal too.
    prop_assert_eq!(format!("{:?}", read), format!("{:?}", plain));
    if let (Ok(batch), None, true) = (read, damage, is_written) {
        prop_assert_eq!(encode(&batch), Ok(frame));
    }
    Ok(())
}

proptest! {
    #[test]
    fn gyro_frames_are_those_of_postcard(body in plain_gyros(), damage in damage()) {
        let fits = body.2.0.iter().all(|tick| i64::try_from(tick.1).is_ok());
        holds(&body, damage, gyros, fits)?;
    }

    #[test]
    fn accelerometer_frames_are_those_of_postcard(body in plain_gyros(), damage in damage()) {
        let (first, _, Ticks(ticks)) = body;
        let ticks: Vec<_> = ticks.into_iter().map(|tick| (tick.0, tick.1, tick.2)).collect();
        let fits = ticks.iter().all(|tick| i64::try_from(tick.1).is_ok());
        holds(&(first, Ticks(ticks)), damage, accels, fits)?;
    }

    #[test]
    fn temperature_frames_are_those_of_postcard(
        channels in 0..=MAX_CHANNELS,
        ticks in prop::collection::vec((any::<i64>(), any::<f64>(), prop::option::of(0..=MAX_CHANNELS)), 0..6),
        damage in damage(),
    ) {
        let name = |index| ChannelName::from(&format!("channel {index}")).unwrap();
        let tick = |(time_ns, raw, other): (i64, f64, Option<usize>)| {
            let count = other.filter(|_| raw > 0.0).unwrap_or(channels);
            (time_ns, std::iter::repeat_n(raw, count).collect())
        };
        let body: PlainTemperatures =
            ((0..channels).map(name).collect(), Ticks(ticks.into_iter().map(tick).collect()));
        holds(&body, damage, temperatures, channels > 0)?;
    }
}

#[test]
fn a_frame_beyond_a_limit_is_refused_for_that_limit() {
    let channels = || (0..2).map(|_| ChannelName::default()).collect();
    let temperatures = |ticks, readings| -> PlainTemperatures {
        (channels(), Ticks(vec![(0, std::iter::repeat_n(1.0, readings).collect()); ticks]))
    };
    let refused = |frame: &[u8]| decode::<TemperatureBatch>(frame).unwrap_err();
    let frame = frame_of::<TemperatureBatch>(&temperatures(2, 3), None);
    assert_eq!(refused(&frame), CodecError::ChannelReadings { index: 0, got: 3, need: 2 });
    let frame = frame_of::<TemperatureBatch>(&temperatures(4097, 2), None);
    assert_eq!(refused(&frame), CodecError::Ticks { count: 4097 });
    let accels = |ticks, readings| (0_u64, vec![(0_i64, 1_u64, 0_u8, vec![1_i32; readings]); ticks]);
    let frames = [(4097, 1), (2, 9), (2, 8)].map(|(ticks, readings)| accels(ticks, readings));
    let read = frames.map(|plain| decode::<AccelBatch>(&frame_of::<AccelBatch>(&plain, None)).map(drop));
    let readings = CodecError::Value { field: "readings", must_be: "0 to 8 per tick" };
    assert_eq!(read, [Err(CodecError::Ticks { count: 4097 }), Err(readings), Ok(())]);
}

#[test]
fn what_a_frame_cannot_carry_is_not_written() {
    let tick = |readings: &[f64], halves: usize| GyroTick {
        readings: readings.iter().copied().collect(),
        half_periods: (0..halves).map(|_| HalfPeriodCounts::default()).collect(),
        ..GyroTick::default()
    };
    let written = |output, ticks: Vec<GyroTick>| encode(&GyroBatch { output, ticks }).unwrap_err();
    let (counts, mean) = (OutputKind::Counts, OutputKind::Mean);
    assert_eq!(written(counts, vec![]), CodecError::Ticks { count: 0 });
    assert_eq!(written(mean, vec![tick(&[0.5], 0); 4097]), CodecError::Ticks { count: 4097 });
    assert_eq!(written(mean, vec![tick(&[1.0], 0), tick(&[], 0)]), CodecError::MixedReadings { index: 1 });
    let halves = CodecError::HalfPeriods { index: 1, got: 1, need: 2 };
    assert_eq!(written(mean, vec![tick(&[0.0; 2], 2), tick(&[0.0; 2], 1)]), halves);
    for reading in [0.5, f64::NAN, 2_147_483_648.0] {
        assert_eq!(
            written(counts, vec![tick(&[0.0], 0), tick(&[reading], 0)]),
            CodecError::NotCounts { index: 1 }
        );
    }
    let reading = |channel, time_ns| TemperatureReading {
        channel: ChannelName::from(channel).unwrap(),
        time: Timestamp::from_ns(time_ns),
        raw: 0.0,
    };
    let readings = vec![reading("a", 1), reading("b", 1), reading("a", 2)];
    assert_eq!(encode(&TemperatureBatch { readings }), Err(CodecError::MixedReadings { index: 1 }));
}
