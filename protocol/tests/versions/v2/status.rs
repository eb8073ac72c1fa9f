//! Version 2 of the status, and version 1 as it is read today.

use isotherm_correction::sample::LasingMode as Mode;
use isotherm_protocol::status::{
    ActiveCalibration, AppliedCorrection, ChannelStatus, ConstantsChange, DriftStatus, InputRates, LastTick,
    PendingChange, Place, PreLaunchGyro, PreLaunchMode, PreLaunchOutcome, PreLaunchProgress,
    PreLaunchVerdict, Rest, SelfTestItem, SelfTestReport, SensorKind, SensorStatus, Swaps,
};

use super::super::v1;
use super::*;

fn known_channel(name: &str, temperature_deg_c: f64, place: Place) -> ChannelStatus {
    ChannelStatus {
        name: channel(name),
        temperature_deg_c: Some(temperature_deg_c),
        rate_deg_c_per_s: Some(-0.0166),
        stale: false,
        warming_up: true,
        calibrated_range_deg_c: Some([-40.0, 60.0]),
        place: Some(place),
    }
}

fn mode(mode: Option<Mode>, ticks: u64) -> PreLaunchMode {
    PreLaunchMode { mode, ticks, time_s: 0.005, mean_temperature_deg_c: Some(25.5) }
}

/// A self-test with a check without an upper limit and one of which nothing came.
fn self_test() -> SelfTestReport {
    SelfTestReport {
        passed: false,
        ended_ns: Some(10_000_000_000),
        length_s: 10.0,
        items: vec![
            SelfTestItem {
                name: "calibration".to_owned(),
                value: Some(3.0),
                at_least: Some(1.0),
                at_most: None,
                unit_of_measure: "revision".to_owned(),
                passed: true,
            },
            SelfTestItem {
                name: "voltage u-half-x".to_owned(),
                value: None,
                at_least: Some(38.0),
                at_most: Some(44.0),
                unit_of_measure: "V".to_owned(),
                passed: false,
            },
        ],
    }
}

fn constants() -> ConstantsChange {
    ConstantsChange {
        gyro: "x".to_owned(),
        static_bias_change_rad_per_s: 1.5e-8,
        static_bias_sigma_rad_per_s: 1e-9,
        magnetic_bias_change_rad_per_s: Some(-2e-8),
        magnetic_bias_sigma_rad_per_s: Some(2e-9),
        earth_rate_rad_per_s: 4.18e-5,
        modes: vec![mode(Some(Mode::Plus), 60_000), mode(Some(Mode::Minus), 59_000)],
    }
}

fn sensor(name: &str, kind: SensorKind, flags: u8, invalid: u64) -> SensorStatus {
    SensorStatus {
        name: name.to_owned(),
        kind,
        flags,
        ticks: 1005,
        invalid,
        overrange: 2,
        not_finite: 3,
        clamped: 4,
        stale: 5,
        excluded: 6,
    }
}

fn unknown_channel() -> ChannelStatus {
    ChannelStatus {
        name: channel("coil"),
        temperature_deg_c: None,
        rate_deg_c_per_s: None,
        stale: true,
        warming_up: true,
        calibrated_range_deg_c: None,
        place: None,
    }
}

/// A running unit on which everything has happened.
fn running() -> Status {
    Status {
        unit: "ZLG-0042".to_owned(),
        instance: "d36a8f01".to_owned(),
        version: "0.2.0".to_owned(),
        state: State::RunningWithReversal,
        output: Output::Calibrated,
        calibration: Some(ActiveCalibration {
            revision: revision(3, 1),
            digest: Some(digest(1)),
            created_unix_s: Some(1_700_000_000),
            age_s: Some(86_400),
            source: "bus, by ann".to_owned(),
            overlay: Some(digest(0x21)),
        }),
        pending: Some(PendingChange {
            revision: revision(4, 0x11),
            digest: Some(digest(0x11)),
            source: "folder zlg-0042.toml".to_owned(),
            schedule: Schedule::Sequence(2000),
            slew_s: 2.5,
        }),
        swaps: Swaps {
            accepted: 3,
            refused: 1,
            last_refusal: Some("unit: is ZLG-0041, must be ZLG-0042".to_owned()),
        },
        last_tick: Some(LastTick {
            end_time_ns: 40_000_000,
            sequence: 1007,
            series: 1_700_000_000_000_000_000,
        }),
        channels: vec![
            known_channel("body", 25.125, Place::Inside),
            known_channel("board", 60.5, Place::Above),
            known_channel("case", -41.0, Place::Below),
            unknown_channel(),
        ],
        sensors: vec![sensor("x", SensorKind::Gyro, 1, 7), sensor("ax", SensorKind::Accel, 5, 0)],
        input_rates: InputRates {
            gyro_ticks_per_s: 200.0,
            accel_ticks_per_s: 200.0,
            temperature_readings_per_s: 6.0,
            messages_per_s: 42.0,
        },
        applied: Some(AppliedCorrection {
            angular_rate_rad_per_s: [3.5e-7, -1.25e-6, 2e-6],
            specific_force_m_per_s2: [0.0, -0.001, 0.049],
        }),
        drift: vec![DriftStatus {
            gyro: "x".to_owned(),
            rate_rad_per_s: 1e-8,
            sigma_rad_per_s: 2e-9,
            trend_rad_per_s2: -1e-13,
            updates: 12,
            refused: 1,
            mean_nis: Some(1.125),
            last_update_ns: Some(39_000_000),
            subtracted: true,
        }],
        rest: Some(Rest::Still),
        self_test: Some(self_test()),
        pre_launch: None,
        pre_launch_outcome: Some(PreLaunchOutcome {
            ended_ns: Some(39_000_000),
            verdict: PreLaunchVerdict::Accepted(vec![constants()]),
            overlay: Some(digest(0x21)),
        }),
        counters: vec![
            Counter { name: "gyro_ticks_in".to_owned(), value: 1005 },
            Counter { name: "bad_frames".to_owned(), value: 3 },
        ],
        faults: vec![fault()],
        last_fault: Some(fault().first),
        latency: Latency {
            p50_ns: 21_000,
            p99_ns: 140_000,
            p999_ns: 200_000,
            max_ns: 512_000,
            buckets: vec![
                LatencyBucket { up_to_ns: 21_503, count: 999 },
                LatencyBucket { up_to_ns: 524_287, count: 2 },
            ],
        },
    }
}

#[test]
fn status_of_a_running_unit() {
    holds("status-2", 2, &running());
}

#[test]
fn status_in_every_state() {
    let gyro = PreLaunchGyro {
        name: "1".to_owned(),
        modes: vec![
            mode(None, 300),
            PreLaunchMode { mean_temperature_deg_c: None, ..mode(Some(Mode::Plus), 0) },
        ],
        sigma_rad_per_s: None,
    };
    let outcome = |verdict| Some(PreLaunchOutcome { ended_ns: None, verdict, overlay: None });
    let pending = |schedule| Some(PendingChange { schedule, ..PendingChange::default() });
    let pre_launch = Status {
        state: State::PreLaunchCalibration,
        output: Output::Calibrated,
        pre_launch: Some(PreLaunchProgress { elapsed_s: 1.5, duration_s: 600.0, gyros: vec![gyro] }),
        rest: Some(Rest::Moved("turned by 0.1 ° about z, at most 0.02 ° is rest".to_owned())),
        pending: pending(Schedule::TimeNs(-5)),
        ..Status::default()
    };
    holds("status-2-pre-launch", 2, &pre_launch);
    let refused = Status {
        state: State::Standby,
        output: Output::Held,
        rest: Some(Rest::Learning),
        pending: pending(Schedule::NextTick),
        pre_launch_outcome: outcome(PreLaunchVerdict::Refused(vec!["it moved".to_owned(), String::new()])),
        ..Status::default()
    };
    holds("status-2-refused", 2, &refused);
    let aborted = Status {
        state: State::SelfTest,
        pre_launch_outcome: outcome(PreLaunchVerdict::Aborted),
        calibration: Some(ActiveCalibration {
            revision: Revision { counter: u64::MAX, digest: [0xff; 8] },
            created_unix_s: Some(i64::MIN),
            age_s: Some(-1),
            ..ActiveCalibration::default()
        }),
        ..Status::default()
    };
    holds("status-2-edges", 2, &aborted);
    holds("status-2-new", 2, &Status::default());
    assert_eq!(Status::default().state, State::RunningWithoutReversal);
}

/// Version 1 is still read, as what it says and nothing more.
#[test]
fn version_1_is_read_as_version_2() {
    let old = |name: &str| {
        let found = v1::FRAMES.iter().find(|(other, _)| *other == name);
        decode::<Status>(&bytes(found.expect("a frame of this name").1)).expect("a good frame")
    };
    let known = known_channel("body", 25.125, Place::Inside);
    let typical = Status {
        unit: "ZLG-0042".to_owned(),
        version: "0.1.0".to_owned(),
        output: Output::Calibrated,
        calibration: Some(ActiveCalibration {
            revision: Revision { counter: 1, digest: [1, 2, 3, 4, 5, 6, 7, 8] },
            ..ActiveCalibration::default()
        }),
        last_tick: Some(LastTick { end_time_ns: 40_000_000, sequence: 1007, series: 0 }),
        channels: vec![
            ChannelStatus { calibrated_range_deg_c: None, place: None, ..known },
            unknown_channel(),
        ],
        counters: vec![
            Counter { name: "gyro_ticks_in".to_owned(), value: 1005 },
            Counter { name: "bad_frames".to_owned(), value: 0 },
        ],
        last_fault: Some("raw/gyro: body is malformed".to_owned()),
        latency: Latency { p50_ns: 21_000, p99_ns: 140_000, ..Latency::default() },
        ..Status::default()
    };
    assert_eq!(old("status"), typical);
    let edges = old("status-edges");
    assert_eq!((edges.output, edges.calibration.as_ref()), (Output::Held, None));
    let last = LastTick { end_time_ns: i64::MIN, sequence: u64::MAX, series: 0 };
    assert_eq!(edges.last_tick, Some(last));
    let new = old("status-new");
    assert_eq!((new.output, new.last_tick), (Output::PassThrough, None));
    assert_eq!(new.revision(), Revision::default());
}
