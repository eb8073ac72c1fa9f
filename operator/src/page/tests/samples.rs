//! Units as operators may meet them, for tests.

use isotherm_correction::sample::LasingMode as Mode;
use isotherm_correction::sample::SensorFlags;
use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2};
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::pair::{self, Member, PairReport, Role, UnitRole};
use isotherm_protocol::service_status::{
    BadDocument, FolderState, FolderStatus, ServiceStatus, StoreStatus, UnitSummary,
};
use isotherm_protocol::status::*;

use super::Level;

/// The present time of all samples (ms since 1970-01-01 UTC).
pub(crate) const NOW_UNIX_MS: i64 = 1_795_000_000_000;
/// The instance that they all belong to.
pub(crate) const INSTANCE: &str = "1f2e3d4c5b6a79880123456789abcdef";

/// An instance of a pair, by its name, with what it does for units; the other is north.
pub(crate) fn instance(name: &str, units: &[(&str, Role)]) -> PairReport {
    let unit = |(unit, role): &(&str, Role)| UnitRole {
        unit: (*unit).to_owned(),
        role: *role,
        ticks_compared: 1000,
        ticks_differing: 0,
        takeovers: 1,
        last_difference: None,
    };
    let member = Member {
        instance: name.to_owned(),
        name: name.to_owned(),
        mode: pair::Mode::Standby,
        priority: 1,
        started_unix_ms: 0,
        group: String::new(),
    };
    PairReport {
        member,
        takes: Vec::new(),
        units: units.iter().map(unit).collect(),
        passed_over: Vec::new(),
        others: vec!["north".to_owned()],
        addresses: vec!["tcp/10.0.0.1:7447".to_owned()],
    }
}

fn deg_per_h(rate: f64) -> f64 {
    AngularRate::from_deg_per_h(rate).as_rad_per_s()
}

fn channel(name: &str, temperature_deg_c: f64, rate_deg_c_per_s: f64) -> ChannelStatus {
    let range = [-40.0, 55.0];
    ChannelStatus {
        name: name.try_into().unwrap(),
        temperature_deg_c: Some(temperature_deg_c),
        rate_deg_c_per_s: Some(rate_deg_c_per_s),
        stale: false,
        warming_up: false,
        calibrated_range_deg_c: Some(range),
        place: Place::of(temperature_deg_c, range),
    }
}

fn sensor(name: &str, kind: SensorKind) -> SensorStatus {
    let flags = SensorFlags::VALID.bits();
    let (overrange, not_finite, clamped, stale, excluded) = (0, 0, 0, 0, 0);
    let (name, ticks, invalid) =
        (name.to_owned(), 1_728_000, if kind == SensorKind::Gyro { 5_184 } else { 0 });
    SensorStatus { name, kind, flags, ticks, invalid, overrange, not_finite, clamped, stale, excluded }
}

fn buckets() -> Vec<LatencyBucket> {
    let bucket = |up_to_ns, count| LatencyBucket { up_to_ns, count };
    vec![
        bucket(9_727, 12),
        bucket(14_335, 4_211),
        bucket(18_431, 88_123),
        bucket(24_575, 61_007),
        bucket(38_911, 14_220),
        bucket(65_535, 3_107),
        bucket(98_303, 811),
        bucket(131_071, 97),
        bucket(294_911, 12),
        bucket(1_245_183, 1),
    ]
}

fn counters(pairs: &[(&str, u64)]) -> Vec<Counter> {
    pairs.iter().map(|(name, value)| Counter { name: (*name).to_owned(), value: *value }).collect()
}

/// A unit that runs, and of which there is nothing to say.
pub(crate) fn running(serial: &str) -> Status {
    let digest = Digest::of(serial.as_bytes());
    let axes = ["x", "y", "z"];
    let gyros = axes.map(|axis| sensor(axis, SensorKind::Gyro));
    let accels = axes.map(|axis| sensor(axis, SensorKind::Accel));
    let rates = [12.3456, -3.21, 0.0123].map(deg_per_h);
    let forces = [1.234, -0.56, 12.0].map(|mg| mg * 1e-3 * STANDARD_GRAVITY_M_PER_S2);
    Status {
        unit: serial.to_owned(),
        instance: INSTANCE.to_owned(),
        version: "0.2.0".to_owned(),
        state: State::RunningWithReversal,
        output: Output::Calibrated,
        calibration: Some(ActiveCalibration {
            revision: Revision { counter: 4, digest: digest.head() },
            digest: Some(digest),
            created_unix_s: Some(NOW_UNIX_MS / 1000 - 52 * 86_400),
            age_s: Some(52 * 86_400),
            source: "folder zlg-0001.toml".to_owned(),
            overlay: None,
        }),
        swaps: Swaps { accepted: 3, refused: 0, last_refusal: None },
        last_tick: Some(LastTick { end_time_ns: 8_640_005_000_000, sequence: 1_728_000, series: 1_790_000 }),
        channels: vec![
            channel("gyro-x", 23.41, 0.002),
            channel("gyro-y", 23.87, 0.0018),
            channel("gyro-z", 24.02, -0.0004),
            channel("board", 31.5, 0.0),
        ],
        sensors: gyros.into_iter().chain(accels).collect(),
        input_rates: InputRates {
            gyro_ticks_per_s: 200.02,
            accel_ticks_per_s: 199.98,
            temperature_readings_per_s: 4.0,
            messages_per_s: 61.0,
        },
        applied: Some(AppliedCorrection { angular_rate_rad_per_s: rates, specific_force_m_per_s2: forces }),
        counters: counters(&[
            ("gyro_ticks_in", 1_728_003),
            ("accel_ticks_in", 1_728_003),
            ("temperature_readings_in", 138_240),
            ("ticks_out", 1_728_000),
            ("gaps", 0),
            ("ticks_interpolated", 5_184),
            ("switches_restored", 1_728),
        ]),
        latency: Latency {
            p50_ns: 17_400,
            p99_ns: 64_100,
            p999_ns: 121_000,
            max_ns: 1_204_311,
            buckets: buckets(),
        },
        ..Status::default()
    }
}

/// A unit with all there can be to tell, and a fault that is there now.
pub(crate) fn faulty(serial: &str) -> Status {
    let mut status = running(serial);
    let fault = |kind: &str, count, first: &str, ago_s: i64| Fault {
        kind: kind.to_owned(),
        count,
        first: first.to_owned(),
        last_unix_ms: NOW_UNIX_MS - 1000 * ago_s,
    };
    status.faults = vec![
        fault(
            "bad_frames_checksum",
            12,
            "the checksum of imu/ZLG-0005/raw/gyro is 0x1234abcd, must be 0x00c0ffee",
            3,
        ),
        fault(
            "ticks_unpublished",
            1,
            "cannot publish on imu/ZLG-0005/corrected: the session is closed",
            4000,
        ),
    ];
    status.last_fault = Some(status.faults[0].first.clone());
    status.counters.extend(counters(&[
        ("bad_frames", 12),
        ("bad_frames_checksum", 12),
        ("gyro_duplicates", 3),
        ("gyro_late", 1),
        ("temperature_late", 7),
        ("ticks_missed", 41),
        ("ticks_unpublished", 1),
    ]));
    status.counters.iter_mut().filter(|c| c.name == "gaps").for_each(|c| c.value = 5);
    status.drift = ["x", "y", "z"]
        .map(|gyro| DriftStatus {
            gyro: gyro.to_owned(),
            rate_rad_per_s: deg_per_h(0.0123),
            sigma_rad_per_s: deg_per_h(0.0031),
            trend_rad_per_s2: deg_per_h(-0.002) / 3600.0,
            updates: 96,
            refused: 2,
            mean_nis: Some(1.04),
            last_update_ns: Some(8_640_000_000_000),
            subtracted: gyro == "x",
        })
        .to_vec();
    status.rest = Some(Rest::Moved("gyro y by 0.031 °/s, at most 0.01 °/s".to_owned()));
    status.pending = Some(PendingChange {
        revision: Revision { counter: 5, digest: [7; 8] },
        digest: None,
        source: "bus, by ann".to_owned(),
        schedule: Schedule::Sequence(1_730_000),
        slew_s: 2.0,
    });
    status.swaps = Swaps {
        accepted: 3,
        refused: 1,
        last_refusal: Some("new.toml:12:9: gyro.sensor.weight: is -3, must be above 0".to_owned()),
    };
    status.pre_launch_outcome = Some(PreLaunchOutcome {
        ended_ns: Some(1),
        verdict: PreLaunchVerdict::Accepted(
            ["x", "y", "z"]
                .map(|gyro| ConstantsChange {
                    gyro: gyro.to_owned(),
                    static_bias_change_rad_per_s: deg_per_h(0.0312),
                    static_bias_sigma_rad_per_s: deg_per_h(0.0021),
                    magnetic_bias_change_rad_per_s: Some(deg_per_h(-0.0078)),
                    magnetic_bias_sigma_rad_per_s: Some(deg_per_h(0.0022)),
                    earth_rate_rad_per_s: deg_per_h(8.6),
                    modes: Vec::new(),
                })
                .to_vec(),
        ),
        overlay: Some(Digest::of(b"overlay")),
    });
    status
}

/// A self-test's report, good or with a gyro that gives nothing.
pub(crate) fn self_test(passed: bool) -> SelfTestReport {
    let item = |name: &str, value, passed| SelfTestItem {
        name: name.to_owned(),
        value,
        at_least: Some(1990.0),
        at_most: Some(2010.0),
        unit_of_measure: "ticks".to_owned(),
        passed,
    };
    let items = vec![item("gyro x", Some(2000.0), true), item("gyro y", None, passed)];
    SelfTestReport { passed, ended_ns: Some(5), length_s: 10.0, items }
}

/// A pre-launch calibration that has been running for a while.
pub(crate) fn pre_launch(serial: &str) -> Status {
    let mode = |mode, ticks: u32| PreLaunchMode {
        mode: Some(mode),
        ticks: u64::from(ticks),
        time_s: f64::from(ticks) * 0.005,
        mean_temperature_deg_c: Some(23.4),
    };
    let gyros = ["x", "y", "z"].map(|name| PreLaunchGyro {
        name: name.to_owned(),
        modes: vec![mode(Mode::Plus, 26_100), mode(Mode::Minus, 25_400)],
        sigma_rad_per_s: Some(deg_per_h(0.0041)),
    });
    let progress = PreLaunchProgress { elapsed_s: 258.0, duration_s: 600.0, gyros: gyros.to_vec() };
    Status { state: State::PreLaunchCalibration, pre_launch: Some(progress), ..running(serial) }
}

/// One unit for each kind of trouble: its level, and a part of the first remark.
pub(crate) fn troubles() -> Vec<(&'static str, Status, Level)> {
    let with = |change: &dyn Fn(&mut Status)| {
        let mut status = running("U");
        change(&mut status);
        status
    };
    let excluded = SensorFlags::EXCLUDED.bits();
    let refused = PreLaunchVerdict::Refused(vec!["too short".to_owned()]);
    let outcome = PreLaunchOutcome { ended_ns: None, verdict: refused, overlay: None };
    vec![
        ("fault", faulty("U"), Level::Fault),
        ("sensor", with(&|s| s.sensors[1].flags = excluded), Level::Fault),
        ("self-test", with(&|s| s.self_test = Some(self_test(false))), Level::Fault),
        ("above", with(&|s| s.channels[2] = channel("gyro-z", 61.25, 0.1)), Level::Warning),
        ("below", with(&|s| s.channels[0] = channel("gyro-x", -45.0, 0.1)), Level::Warning),
        ("stale", with(&|s| s.channels[3].stale = true), Level::Warning),
        ("raw", with(&|s| (s.output, s.calibration) = (Output::PassThrough, None)), Level::Warning),
        ("held", with(&|s| (s.output, s.calibration) = (Output::Held, None)), Level::Warning),
        ("silent", with(&|s| s.input_rates = InputRates::default()), Level::Warning),
        ("refused", with(&|s| s.pre_launch_outcome = Some(outcome.clone())), Level::Warning),
        ("pending", with(&|s| s.pending = faulty("U").pending), Level::Note),
        ("pre-launch", pre_launch("U"), Level::Note),
        ("warm-up", with(&|s| s.channels[1].warming_up = true), Level::Note),
        ("standby", with(&|s| s.state = State::Standby), Level::Fine),
        (
            "old service",
            with(&|s| (s.instance, s.input_rates) = (String::new(), InputRates::default())),
            Level::Fine,
        ),
    ]
}

/// So many units, most of them well, each with numbers of its own.
pub(crate) fn fleet(count: usize) -> Vec<Status> {
    let serial = |index: usize| format!("ZLG-{:04}", index + 1);
    (0..count)
        .map(|index| {
            let serial = serial(index);
            let mut status = match index % 25 {
                2 => Status { state: State::Standby, ..running(&serial) },
                4 => faulty(&serial),
                5 => pre_launch(&serial),
                6 => Status {
                    calibration: None,
                    output: Output::PassThrough,
                    applied: None,
                    channels: Vec::new(),
                    ..running(&serial)
                },
                11 => Status { state: State::RunningWithoutReversal, ..running(&serial) },
                13 => Status { state: State::SelfTest, ..running(&serial) },
                17 => Status { input_rates: InputRates::default(), ..running(&serial) },
                _ => running(&serial),
            };
            let step = f64::from(u32::try_from(index).unwrap());
            for channel in &mut status.channels {
                let temperature = channel.temperature_deg_c.unwrap() + 7.0 * (step * 0.7).sin();
                channel.temperature_deg_c = Some(temperature);
                channel.rate_deg_c_per_s = Some(0.004 * (step * 1.3).cos());
            }
            if index % 8 == 3 && !status.channels.is_empty() {
                status.channels[0] = channel("gyro-x", 61.25, 0.05);
            }
            if index % 40 == 9 && !status.channels.is_empty() {
                status.channels[3].stale = true;
            }
            status.latency.p99_ns += 977 * u64::try_from(index * index % 91).unwrap();
            status
        })
        .collect()
}

/// The service of these units.
pub(crate) fn service(units: &[Status]) -> ServiceStatus {
    let summary = |s: &Status| UnitSummary { unit: s.unit.clone(), state: s.state, output: s.output };
    ServiceStatus {
        instance: INSTANCE.to_owned(),
        version: "0.2.0".to_owned(),
        pid: Some(4711),
        started_unix_ms: NOW_UNIX_MS - 273_600_000,
        uptime_s: 273_600.0,
        units: units.iter().map(summary).collect(),
        calibrations: Some(FolderStatus {
            path: "config/calibration".to_owned(),
            state: FolderState::Watching,
            reason: None,
        }),
        bad_documents: vec![BadDocument {
            file: "config/calibration/zlg-0007.toml".to_owned(),
            problem: "config/calibration/zlg-0007.toml:12:9: gyro.sensor.weight: is -3, must be above 0"
                .to_owned(),
            problems: 2,
        }],
        store: Some(StoreStatus { path: "/var/lib/isotherm".to_owned(), audit_entries: 1_204 }),
        swaps_accepted: 12,
        swaps_refused: 1,
        ..ServiceStatus::default()
    }
}
