//! Any message of the second generation.

use isotherm_protocol::control::Schedule;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::raw::{HealthBatch, HealthReading, HealthTick, MAX_HEALTH};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::service_status::{
    BadDocument, FolderState, FolderStatus, ServiceStatus, StoreStatus, UnitSummary,
};
use isotherm_protocol::status::{
    ActiveCalibration, AppliedCorrection, ChannelStatus, ConstantsChange, Counter, DriftStatus, Fault,
    InputRates, LastTick, Latency, LatencyBucket, Output, PendingChange, Place, PreLaunchGyro, PreLaunchMode,
    PreLaunchOutcome, PreLaunchProgress, PreLaunchVerdict, Rest, SelfTestItem, SelfTestReport, SensorKind,
    SensorStatus, State, Status, Swaps,
};
use proptest::option::of;

use super::*;

fn state() -> impl Strategy<Value = State> {
    select(State::ALL.to_vec())
}

fn output() -> impl Strategy<Value = Output> {
    select(vec![Output::Calibrated, Output::PassThrough, Output::Held])
}

fn digest() -> impl Strategy<Value = Option<Digest>> {
    of(any::<[u8; 32]>().prop_map(Digest))
}

fn fault() -> impl Strategy<Value = Fault> {
    any::<(String, u64, String, i64)>().prop_map(|(kind, count, first, last_unix_ms)| Fault {
        kind,
        count,
        first,
        last_unix_ms,
    })
}

prop_compose! {
    fn calibration()(
        revision in revision(),
        (digest, overlay) in (digest(), digest()),
        (created_unix_s, age_s, source) in any::<(Option<i64>, Option<i64>, String)>(),
    ) -> ActiveCalibration {
        ActiveCalibration { revision, digest, created_unix_s, age_s, source, overlay }
    }
}

fn schedule() -> impl Strategy<Value = Schedule> {
    prop_oneof![
        Just(Schedule::NextTick),
        any::<u64>().prop_map(Schedule::Sequence),
        any::<i64>().prop_map(Schedule::TimeNs),
    ]
}

prop_compose! {
    fn pending()(
        revision in revision(),
        digest in digest(),
        source: String,
        schedule in schedule(),
        slew_s in number(),
    ) -> PendingChange {
        PendingChange { revision, digest, source, schedule, slew_s }
    }
}

prop_compose! {
    fn channel_status()(
        name in channel(),
        (temperature_deg_c, rate_deg_c_per_s) in (of(number()), of(number())),
        (stale, warming_up) in any::<(bool, bool)>(),
        calibrated_range_deg_c in of([number(), number()]),
        place in of(select(vec![Place::Below, Place::Inside, Place::Above])),
    ) -> ChannelStatus {
        ChannelStatus { name, temperature_deg_c, rate_deg_c_per_s, stale, warming_up, calibrated_range_deg_c, place }
    }
}

prop_compose! {
    fn sensor()(
        name: String,
        kind in select(vec![SensorKind::Gyro, SensorKind::Accel]),
        flags: u8,
        [ticks, invalid, overrange, not_finite, clamped, stale, excluded] in any::<[u64; 7]>(),
    ) -> SensorStatus {
        SensorStatus { name, kind, flags, ticks, invalid, overrange, not_finite, clamped, stale, excluded }
    }
}

prop_compose! {
    fn drift()(
        (gyro, updates, refused, last_update_ns, subtracted) in any::<(String, u64, u64, Option<i64>, bool)>(),
        [rate_rad_per_s, sigma_rad_per_s, trend_rad_per_s2] in [number(), number(), number()],
        mean_nis in of(number()),
    ) -> DriftStatus {
        DriftStatus {
            gyro, rate_rad_per_s, sigma_rad_per_s, trend_rad_per_s2, updates, refused, mean_nis, last_update_ns, subtracted,
        }
    }
}

prop_compose! {
    fn self_test()(
        (passed, ended_ns) in any::<(bool, Option<i64>)>(),
        length_s in number(),
        items in vec((any::<(String, String, bool)>(), of(number()), of(number()), of(number())), 0..5),
    ) -> SelfTestReport {
        let item = |((name, unit_of_measure, passed), value, at_least, at_most)| SelfTestItem {
            name, value, at_least, at_most, unit_of_measure, passed,
        };
        SelfTestReport { passed, ended_ns, length_s, items: items.into_iter().map(item).collect() }
    }
}

fn modes() -> impl Strategy<Value = Vec<PreLaunchMode>> {
    let mode = (mode(), any::<u64>(), number(), of(number()));
    let mode = mode.prop_map(|(mode, ticks, time_s, mean_temperature_deg_c)| PreLaunchMode {
        mode,
        ticks,
        time_s,
        mean_temperature_deg_c,
    });
    vec(mode, 0..=3)
}

prop_compose! {
    fn constants()(
        gyro: String,
        [change, sigma, earth_rate_rad_per_s] in [number(), number(), number()],
        magnetic in of((number(), number())),
        modes in modes(),
    ) -> ConstantsChange {
        ConstantsChange {
            gyro,
            static_bias_change_rad_per_s: change,
            static_bias_sigma_rad_per_s: sigma,
            magnetic_bias_change_rad_per_s: magnetic.map(|(change, _)| change),
            magnetic_bias_sigma_rad_per_s: magnetic.map(|(_, sigma)| sigma),
            earth_rate_rad_per_s,
            modes,
        }
    }
}

fn pre_launch() -> impl Strategy<Value = PreLaunchProgress> {
    let gyro = (any::<String>(), modes(), of(number()));
    let gyro = gyro.prop_map(|(name, modes, sigma_rad_per_s)| PreLaunchGyro { name, modes, sigma_rad_per_s });
    (number(), number(), vec(gyro, 0..=MAX_SENSORS))
        .prop_map(|(elapsed_s, duration_s, gyros)| PreLaunchProgress { elapsed_s, duration_s, gyros })
}

fn outcome() -> impl Strategy<Value = PreLaunchOutcome> {
    let verdict = prop_oneof![
        vec(constants(), 0..=MAX_SENSORS).prop_map(PreLaunchVerdict::Accepted),
        vec(any::<String>(), 0..=64).prop_map(PreLaunchVerdict::Refused),
        Just(PreLaunchVerdict::Aborted),
    ];
    (any::<Option<i64>>(), verdict, digest()).prop_map(|(ended_ns, verdict, overlay)| PreLaunchOutcome {
        ended_ns,
        verdict,
        overlay,
    })
}

fn rest() -> impl Strategy<Value = Rest> {
    prop_oneof![Just(Rest::Learning), Just(Rest::Still), any::<String>().prop_map(Rest::Moved)]
}

fn latency() -> impl Strategy<Value = Latency> {
    let bucket = any::<(u64, u64)>().prop_map(|(up_to_ns, count)| LatencyBucket { up_to_ns, count });
    (any::<[u64; 4]>(), vec(bucket, 0..40)).prop_map(|([p50_ns, p99_ns, p999_ns, max_ns], buckets)| Latency {
        p50_ns,
        p99_ns,
        p999_ns,
        max_ns,
        buckets,
    })
}

prop_compose! {
    fn input_rates()([gyro, accel, temperature, messages] in [number(), number(), number(), number()]) -> InputRates {
        InputRates {
            gyro_ticks_per_s: gyro,
            accel_ticks_per_s: accel,
            temperature_readings_per_s: temperature,
            messages_per_s: messages,
        }
    }
}

/// What a status says of the unit's operation; the rest is left as it is by default.
fn operation() -> impl Strategy<Value = Status> {
    let states = (state(), output(), of(calibration()), of(pending()));
    let results = (vec(drift(), 0..=8), of(rest()), of(self_test()), of(pre_launch()), of(outcome()));
    (states, results).prop_map(|((state, output, calibration, pending), results)| {
        let (drift, rest, self_test, pre_launch, pre_launch_outcome) = results;
        Status {
            state,
            output,
            calibration,
            pending,
            drift,
            rest,
            self_test,
            pre_launch,
            pre_launch_outcome,
            ..Status::default()
        }
    })
}

prop_compose! {
    pub(super) fn status()(
        [unit, instance, version] in any::<[String; 3]>(),
        operation in operation(),
        (accepted, refused, last_refusal, last_fault) in any::<(u64, u64, Option<String>, Option<String>)>(),
        last_tick in any::<Option<(i64, u64, u64)>>(),
        channels in vec(channel_status(), 0..20),
        sensors in vec(sensor(), 0..=16),
        applied in of(([number(), number(), number()], [number(), number(), number()])),
        counters in vec(any::<(String, u64)>(), 0..60),
        faults in vec(fault(), 0..=32),
        (input_rates, latency) in (input_rates(), latency()),
    ) -> Status {
        Status {
            unit,
            instance,
            version,
            swaps: Swaps { accepted, refused, last_refusal },
            last_tick: last_tick.map(|(end_time_ns, sequence, series)| LastTick { end_time_ns, sequence, series }),
            channels,
            sensors,
            input_rates,
            applied: applied.map(|(angular_rate_rad_per_s, specific_force_m_per_s2)| AppliedCorrection {
                angular_rate_rad_per_s,
                specific_force_m_per_s2,
            }),
            counters: counters.into_iter().map(|(name, value)| Counter { name, value }).collect(),
            faults,
            last_fault,
            latency,
            ..operation
        }
    }
}

prop_compose! {
    pub(super) fn service_status()(
        [instance, version] in any::<[String; 2]>(),
        (pid, started_unix_ms, swaps_accepted, swaps_refused) in any::<(Option<u32>, i64, u64, u64)>(),
        uptime_s in number(),
        units in vec((any::<String>(), state(), output()), 0..20),
        folder in of((
            any::<(String, Option<String>)>(),
            select(vec![FolderState::Watching, FolderState::Polling, FolderState::Gone]),
        )),
        bad_documents in vec(any::<(String, String, u64)>(), 0..=64),
        store in any::<Option<(String, u64)>>(),
        faults in vec(fault(), 0..=32),
        settings_digest in digest(),
    ) -> ServiceStatus {
        let unit = |(unit, state, output)| UnitSummary { unit, state, output };
        let bad = |(file, problem, problems)| BadDocument { file, problem, problems };
        ServiceStatus {
            instance,
            version,
            pid,
            started_unix_ms,
            uptime_s,
            units: units.into_iter().map(unit).collect(),
            calibrations: folder.map(|((path, reason), state)| FolderStatus { path, state, reason }),
            bad_documents: bad_documents.into_iter().map(bad).collect(),
            store: store.map(|(path, audit_entries)| StoreStatus { path, audit_entries }),
            faults,
            settings_digest,
            swaps_accepted,
            swaps_refused,
        }
    }
}

pub(super) fn health_batch() -> impl Strategy<Value = HealthBatch> {
    let reading = (channel(), number()).prop_map(|(name, value)| HealthReading { name, value });
    let tick = (any::<i64>(), vec(reading, 0..=MAX_HEALTH))
        .prop_map(|(time_ns, readings)| HealthTick { time_ns, readings });
    vec(tick, 1..20).prop_map(|ticks| HealthBatch { ticks })
}

pub(super) fn reference() -> impl Strategy<Value = Reference> {
    let finite = || any::<f64>().prop_filter("finite", |value| value.is_finite());
    let span = any::<(i64, i64)>().prop_filter("a span", |(start, end)| start != end);
    (span, [finite(), finite(), finite()], finite()).prop_map(|((one, other), rate, sigma)| Reference {
        start_ns: one.min(other),
        end_ns: one.max(other),
        angular_rate_rad_per_s: rate,
        sigma_rad_per_s: sigma.abs(),
    })
}
