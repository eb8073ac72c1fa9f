//! Version 1, byte by byte.
//!
//! If a test here fails, do not change the test: the change to the messages has broken every producer and every
//! consumer in the field. Make a new version instead (`protocol/src/version.rs` has the policy) and leave this file as it
//! is. It may be deleted only when `MIN` is raised beyond 1.
//!
//! While 1 is also the version that is written, both directions hold. The status has a version 2: the body of version 1
//! is a type of its own, and for it both directions hold too.

use isotherm_correction::sample::LasingMode as Mode;
use isotherm_protocol::codec::{Message, decode, encode};
use isotherm_protocol::corrected::{AppliedTemperature, Revision};
use isotherm_protocol::status::Counter;
use isotherm_protocol::status::v1::{ChannelStatus, State, Status};

use super::bytes;
use super::form::{
    AccelBatch, AccelTick, CorrectedBatch, CorrectedTick, Form, GyroBatch, GyroTick, HalfPeriod, Readings,
    TemperatureBatch, TemperatureTick,
};

mod frames;

pub(super) use frames::FRAMES;

/// The frozen frame of a name.
fn frame(name: &str) -> Vec<u8> {
    let found = FRAMES.iter().find(|(other, _)| *other == name);
    bytes(found.expect("a frame of this name").1)
}

/// The frame is read as the message, and the message is written as the frame.
///
/// Compared as text: every digit of every number, and NaN is like NaN.
fn holds<M: Message + std::fmt::Debug>(name: &str, message: &M) {
    let frame = frame(name);
    let read: M = decode(&frame).expect("a good frame");
    assert_eq!(format!("{read:?}"), format!("{message:?}"), "{name} is read");
    if M::VERSIONS.current == 1 {
        assert_eq!(encode(message).expect("a good message"), frame, "{name} is written");
    }
}

/// The same of a message in its plain form: that has the bytes too, whatever the library makes of them.
fn form_holds<F: Form>(name: &str, form: &F) {
    let frame = frame(name);
    assert_eq!(postcard::to_allocvec(form).expect("bytes"), frame[2..frame.len() - 4], "{name} has its form");
    if form.is_written() {
        holds(name, &form.message());
    } else {
        let read: F::Message = decode(&frame).expect("a good frame");
        assert_eq!(format!("{read:?}"), format!("{:?}", form.message()), "{name} is read");
    }
}

fn channel(name: &str) -> isotherm_correction::sample::ChannelName {
    name.try_into().expect("a short name")
}

#[test]
fn raw_gyro() {
    let half = |positive, negative| HalfPeriod { positive, negative };
    let counts = GyroTick {
        end_time_ns: 5_000_000,
        duration_ns: 5_000_000,
        readings: Readings::Counts([1234, -567, 0].into_iter().collect()),
        mode: Some(Mode::Plus),
        switch_command: false,
        meander: None,
        half_periods: [half(1000, 234), half(-300, -267), half(64, -64)].into_iter().collect(),
    };
    let switch = GyroTick {
        end_time_ns: 10_000_123,
        duration_ns: 5_000_123,
        readings: Readings::Counts([12, 3, -4].into_iter().collect()),
        mode: Some(Mode::Minus),
        switch_command: true,
        meander: Some(Mode::Plus),
        half_periods: [].into_iter().collect(),
    };
    form_holds(
        "raw-gyro-counts",
        &GyroBatch { first_sequence: 1000, series: 1_700_000_000_000_000_000, ticks: vec![counts, switch] },
    );

    let means = GyroTick {
        end_time_ns: -1,
        duration_ns: 10_000_000,
        readings: Readings::Means(
            [0.5, -0.25, 1e-3, -1e-3, 0.0, -0.0, f64::NAN, 7.29e-5].into_iter().collect(),
        ),
        mode: None,
        switch_command: false,
        meander: None,
        half_periods: [].into_iter().collect(),
    };
    form_holds("raw-gyro-means", &GyroBatch { first_sequence: 0, series: 0, ticks: vec![means] });

    let edges = GyroTick {
        end_time_ns: i64::MIN,
        duration_ns: u64::MAX,
        readings: Readings::Counts([i32::MIN, i32::MAX, -1, 1, 63, -64, 64, -65].into_iter().collect()),
        mode: Some(Mode::Minus),
        switch_command: true,
        meander: Some(Mode::Minus),
        half_periods: [half(i32::MIN, i32::MAX); 8].into_iter().collect(),
    };
    form_holds(
        "raw-gyro-edges",
        &GyroBatch { first_sequence: u64::MAX, series: u64::MAX, ticks: vec![edges] },
    );

    let empty = GyroTick {
        end_time_ns: 0,
        duration_ns: 0,
        readings: Readings::Counts([].into_iter().collect()),
        mode: None,
        switch_command: false,
        meander: None,
        half_periods: [].into_iter().collect(),
    };
    form_holds("raw-gyro-empty", &GyroBatch { first_sequence: 128, series: 0, ticks: vec![empty] });
}

#[test]
fn raw_accel() {
    let counts = |end_time_ns, counts: [i32; 3]| AccelTick {
        end_time_ns,
        duration_ns: 5_000_000,
        readings: Readings::Counts(counts.into_iter().collect()),
    };
    let ticks = vec![counts(5_000_000, [0, -1, 392]), counts(10_000_000, [1, -2, 393])];
    form_holds("raw-accel-counts", &AccelBatch { first_sequence: 300, ticks });

    let means = AccelTick {
        end_time_ns: i64::MAX,
        duration_ns: 1,
        readings: Readings::Means([9.80665, -0.125, 0.0, -9.75].into_iter().collect()),
    };
    form_holds("raw-accel-means", &AccelBatch { first_sequence: 1 << 32, ticks: vec![means] });
}

#[test]
fn raw_temperature() {
    let tick = |time_ns, raw: [f64; 2]| TemperatureTick { time_ns, raw: raw.into_iter().collect() };
    let channels = [channel("body"), channel("катушка")].into_iter().collect();
    let ticks = vec![tick(1_000_000_000, [0.5125, f64::NAN]), tick(1_500_000_000, [0.5, -40.25])];
    form_holds("raw-temp", &TemperatureBatch { channels, ticks });

    let empty = TemperatureTick { time_ns: 7, raw: [].into_iter().collect() };
    form_holds(
        "raw-temp-empty",
        &TemperatureBatch { channels: [].into_iter().collect(), ticks: vec![empty] },
    );
}

#[test]
fn nan_keeps_its_bits() {
    let batch: isotherm_protocol::raw::TemperatureBatch = decode(&frame("raw-temp")).unwrap();
    assert_eq!(batch.readings[1].raw.to_bits(), 0x7ff8_0000_0000_0000);
}

#[test]
fn corrected() {
    let first = CorrectedTick {
        sequence: 1000,
        end_time_ns: 5_000_000,
        duration_ns: 5_000_000,
        ticks: 1,
        missed: 0,
        delta_angle_rad: [3.5e-7, -1.25e-5, 2e-6],
        delta_velocity_m_per_s: [0.0, -0.001, 0.049],
        mode: Some(Mode::Plus),
        flags: 1 << 3,
        gyro_flags: [1, 1, 1 | 1 << 2].into_iter().collect(),
        accel_flags: [1, 1, 1].into_iter().collect(),
        gyro_parity_rad_per_s: [].into_iter().collect(),
        accel_parity_m_per_s2: [].into_iter().collect(),
    };
    // A step of four ticks behind a gap of three, two-way generation lost in one of them.
    let second = CorrectedTick {
        sequence: 1007,
        end_time_ns: 40_000_000,
        duration_ns: 20_000_000,
        ticks: 4,
        missed: 3,
        delta_angle_rad: [1.5e-6, -5e-5, 8e-6],
        delta_velocity_m_per_s: [0.0, 0.0, 0.0],
        mode: Some(Mode::Minus),
        flags: 1 | 1 << 1 | 1 << 2 | 1 << 11,
        gyro_flags: [0, 0, 0].into_iter().collect(),
        accel_flags: [0, 0, 0].into_iter().collect(),
        gyro_parity_rad_per_s: [1e-9].into_iter().collect(),
        accel_parity_m_per_s2: [].into_iter().collect(),
    };
    let body =
        AppliedTemperature { channel: channel("body"), temperature_deg_c: 25.125, rate_deg_c_per_s: -0.0166 };
    let batch = CorrectedBatch {
        unit: "ZLG-0042".to_owned(),
        revision: Revision { counter: 3, digest: [0x01, 0x23, 0x45, 0x67, 0x89, 0xab, 0xcd, 0xef] },
        temperatures: [body].into_iter().collect(),
        ticks: vec![first, second],
    };
    form_holds("corrected", &batch);

    let edges = CorrectedTick {
        sequence: u64::MAX,
        end_time_ns: i64::MIN,
        duration_ns: u64::MAX,
        ticks: u16::MAX,
        missed: u64::MAX,
        delta_angle_rad: [1e300, -0.0, 5e-324],
        delta_velocity_m_per_s: [f64::NAN, -1e300, 0.1],
        mode: None,
        flags: u16::MAX,
        gyro_flags: [1, 2, 4, 8, 16, 32, 128, 255].into_iter().collect(),
        accel_flags: [].into_iter().collect(),
        gyro_parity_rad_per_s: [0.1, -0.2, 0.3, -0.4, 0.5].into_iter().collect(),
        accel_parity_m_per_s2: [-1.5].into_iter().collect(),
    };
    let batch = CorrectedBatch {
        unit: "x".to_owned(),
        revision: Revision { counter: u64::MAX, digest: [0xff; 8] },
        temperatures: [].into_iter().collect(),
        ticks: vec![edges],
    };
    form_holds("corrected-edges", &batch);
}

#[test]
fn status() {
    let known = ChannelStatus {
        channel: channel("body"),
        temperature_deg_c: Some(25.125),
        rate_deg_c_per_s: Some(-0.0166),
        stale: false,
        warming_up: true,
    };
    let unknown = ChannelStatus {
        channel: channel("coil"),
        temperature_deg_c: None,
        rate_deg_c_per_s: None,
        stale: true,
        warming_up: true,
    };
    let counter = |name: &str, value| Counter { name: name.to_owned(), value };
    let typical = Status {
        unit: "ZLG-0042".to_owned(),
        service_version: "0.1.0".to_owned(),
        state: State::Running,
        revision: Revision { counter: 1, digest: [1, 2, 3, 4, 5, 6, 7, 8] },
        last_end_time_ns: Some(40_000_000),
        last_sequence: Some(1007),
        channels: vec![known, unknown],
        counters: vec![counter("gyro_ticks_in", 1005), counter("bad_frames", 0)],
        last_fault: Some("raw/gyro: body is malformed".to_owned()),
        added_latency_p50_ns: 21_000,
        added_latency_p99_ns: 140_000,
    };
    holds("status", &typical);

    let edges = Status {
        unit: "x".to_owned(),
        service_version: String::new(),
        state: State::Held,
        revision: Revision { counter: 0, digest: [0; 8] },
        last_end_time_ns: Some(i64::MIN),
        last_sequence: Some(u64::MAX),
        channels: vec![],
        counters: vec![counter("", u64::MAX)],
        last_fault: None,
        added_latency_p50_ns: 0,
        added_latency_p99_ns: u64::MAX,
    };
    holds("status-edges", &edges);

    let new = Status {
        state: State::Uncalibrated,
        last_end_time_ns: None,
        last_sequence: None,
        counters: vec![],
        ..edges
    };
    holds("status-new", &new);
}
