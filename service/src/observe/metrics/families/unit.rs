//! Metrics of each unit.

use isotherm_correction::operation::State;
use isotherm_protocol::pair::Role;
use isotherm_protocol::status::{ChannelStatus, LatencyBucket, Output, Place, SensorKind};

use super::{Family, Sample, Source, Type, Value, each, families, known, one};
use crate::observe::metrics::source::UnitLook;
use crate::receive::fault::FaultKind;

/// What may happen to ticks.
const OUTPUTS: [(&str, Output); 3] =
    [("calibrated", Output::Calibrated), ("pass-through", Output::PassThrough), ("held", Output::Held)];

families! { Unit "isotherm_unit_":
    Gauge "state" "" ["state"] "1 for the present state"
        |look| each(State::ALL.iter().map(|state| (state.name(), *state == look.status.state)));
    Gauge "output" "" ["output"] "1 for what happens to ticks in a running state"
        |look| each(OUTPUTS.map(|(name, output)| (name, output == look.status.output)));
    Gauge "speaking" "" [] "1 if this instance publishes the unit's ticks, 0 if it stands by for another"
        |look| one(look.role.role == Role::Speaking);
    Counter "takeovers" "" [] "Takeovers by this instance from another"
        |look| one(look.role.takeovers);
    Counter "ticks_compared" "" [] "Corrected ticks compared with another instance's, bit by bit"
        |look| one(look.role.ticks_compared);
    Counter "ticks_differing" "" [] "Ticks that differed: alarm on any"
        |look| one(look.role.ticks_differing);
    Gauge "stalled" "" [] "1 if raw ticks arrive but corrected ones, though due, are not published"
        |look| one(look.stalled);
    Gauge "revision" "" [] "Revision counter of the calibration in force; 0 without one"
        |look| one(look.status.revision().counter);
    Gauge "calibration_age" "seconds" [] "Age of the document in force; absent if it states no date"
        |look| known(age_s(look));
    Gauge "swap_pending" "" [] "1 if a calibration waits for its tick"
        |look| one(look.status.pending.is_some());
    Counter "swaps" "" ["outcome"] "Swaps accepted and refused for the unit"
        |look| each([("accepted", look.status.swaps.accepted), ("refused", look.status.swaps.refused)]);
    Gauge "self_test_passed" "" [] "1 if the last self-test passed; absent before the first"
        |look| known(look.status.self_test.as_ref().map(|report| report.passed));
    Gauge "input_rate" "per_second" ["input"] "Gyro ticks, accelerometer ticks, temperature readings, messages, over the last status interval"
        |look| input_rates(look);
    Gauge "temperature" "celsius" ["channel"] "Smoothed temperature of a channel; absent before the first reading"
        |look| channels(look, |channel| channel.temperature_deg_c);
    Gauge "temperature_rate" "celsius_per_second" ["channel"] "Rate of the smoothed temperature"
        |look| channels(look, |channel| channel.rate_deg_c_per_s);
    Gauge "temperature_outside_range" "" ["channel"] "1 if it is outside the range of the fit; absent if either is unknown"
        |look| channels(look, |channel| channel.place.map(|place| place != Place::Inside));
    Gauge "temperature_stale" "" ["channel"] "1 if the channel's reading is missing, rejected or too old"
        |look| channels(look, |channel| Some(channel.stale));
    Gauge "applied_rate" "radians_per_second" ["axis"] "Correction subtracted from the angular rate about a case axis"
        |look| axes(look.status.applied.map(|applied| applied.angular_rate_rad_per_s));
    Gauge "applied_force" "meters_per_second_squared" ["axis"] "Correction subtracted from the specific force along a case axis"
        |look| axes(look.status.applied.map(|applied| applied.specific_force_m_per_s2));
    Gauge "drift" "radians_per_second" ["gyro"] "Estimated drift of a gyro, in addition to its calibrated bias"
        |look| each(look.status.drift.iter().map(|drift| (drift.gyro.as_str(), drift.rate_rad_per_s)));
    Gauge "drift_sigma" "radians_per_second" ["gyro"] "Standard error of the estimated drift"
        |look| each(look.status.drift.iter().map(|drift| (drift.gyro.as_str(), drift.sigma_rad_per_s)));
    Counter "sensor_invalid_ticks" "" ["kind", "sensor"] "Corrected ticks that did not use a sensor's reading as read"
        |look| invalid(look);
    Counter "faults" "" ["kind"] "Messages refused, corrected ticks not published, alarms"
        |look| each(FaultKind::of_units().map(|kind| (kind.name(), look.status.counter(kind.name()))));
    Histogram "added_latency" "seconds" [] "Time from receiving a raw message to having published the result"
        |look| one(latency(look));
}

#[expect(clippy::cast_precision_loss, reason = "whole seconds, of fewer than 2⁵³")]
fn age_s(look: &UnitLook) -> Option<f64> {
    look.status.calibration.as_ref()?.age_s.map(|age_s| age_s as f64)
}

fn input_rates(look: &UnitLook) -> Vec<Sample<'_>> {
    let rates = &look.status.input_rates;
    each([
        ("gyro_ticks", rates.gyro_ticks_per_s),
        ("accel_ticks", rates.accel_ticks_per_s),
        ("temperature_readings", rates.temperature_readings_per_s),
        ("messages", rates.messages_per_s),
    ])
}

/// What is known of each channel.
fn channels<V: Into<Value>>(look: &UnitLook, of: fn(&ChannelStatus) -> Option<V>) -> Vec<Sample<'_>> {
    each(look.status.channels.iter().filter_map(|channel| Some((channel.name.as_str(), of(channel)?))))
}

/// A value for each axis; none where there are none yet.
fn axes<'l>(values: Option<[f64; 3]>) -> Vec<Sample<'l>> {
    each(values.into_iter().flat_map(|values| ["x", "y", "z"].into_iter().zip(values)))
}

fn invalid(look: &UnitLook) -> Vec<Sample<'_>> {
    let sensors = look.status.sensors.iter().map(|sensor| {
        let kind = match sensor.kind {
            SensorKind::Gyro => "gyro",
            SensorKind::Accel => "accel",
        };
        Sample { labels: vec![kind, &sensor.name], value: sensor.invalid.into() }
    });
    sensors.collect()
}

/// Exponents of two of the latency bounds (ns): 16 µs to 268 ms.
const LATENCY_BOUNDS: std::ops::RangeInclusive<u32> = 14..=28;

/// The histogram of one unit.
fn latency(look: &UnitLook) -> Value {
    let latency = &look.status.latency.buckets;
    let total: u64 = latency.iter().map(|bucket| bucket.count).sum();
    let mut before = 0;
    let mut buckets = Vec::new();
    for exponent in LATENCY_BOUNDS {
        let bound_ns = 1_u64 << exponent;
        let below = cumulative(latency, bound_ns);
        buckets.push((seconds(bound_ns), below - before));
        before = below;
    }
    buckets.push((f64::INFINITY, total - before));
    Value::Histogram(seconds(look.latency_sum_ns), total, buckets)
}

/// How many latencies were below a power of two: the service's own, finer buckets end one nanosecond before each.
fn cumulative(buckets: &[LatencyBucket], bound_ns: u64) -> u64 {
    buckets.iter().take_while(|bucket| bucket.up_to_ns < bound_ns).map(|bucket| bucket.count).sum()
}

#[expect(clippy::cast_precision_loss, reason = "beyond 2⁵³ ns, 104 days, a nanosecond does not matter")]
fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}
