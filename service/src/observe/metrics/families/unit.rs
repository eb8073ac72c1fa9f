//! Metrics of each unit, its counters excepted.

use std::fmt;

use isotherm_correction::operation::State;
use isotherm_protocol::pair::Role;
use isotherm_protocol::status::{ChannelStatus, LatencyBucket, Output, Place, SensorKind};

use super::super::page::Samples;
use super::super::source::UnitLook;
use super::Family;
use crate::receive::fault::FaultKind;

/// All of them.
pub(super) const FAMILIES: &[Family] = &[
    Family::unit_gauge(
        ("isotherm_unit_state", ""),
        &["unit", "state"],
        "1 for the present state",
        |unit, look, out| {
            let present = State::from(look.status.state);
            State::ALL.iter().try_for_each(|state| out.flag(&[unit, state.name()], *state == present))
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_output", ""),
        &["unit", "output"],
        "1 for what happens to ticks in a running state",
        |unit, look, out| {
            let outputs = [
                ("calibrated", Output::Calibrated),
                ("pass-through", Output::PassThrough),
                ("held", Output::Held),
            ];
            let mut outputs = outputs.into_iter();
            outputs.try_for_each(|(name, output)| out.flag(&[unit, name], output == look.status.output))
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_speaking", ""),
        &["unit"],
        "1 if this instance publishes the unit's ticks, 0 if it stands by for another",
        |unit, look, out| out.flag(&[unit], look.role.role == Role::Speaking),
    ),
    Family::unit_counter(
        ("isotherm_unit_takeovers", ""),
        &["unit"],
        "Takeovers by this instance from another",
        |unit, look, out| out.counter(&[unit], look.role.takeovers),
    ),
    Family::unit_counter(
        ("isotherm_unit_ticks_compared", ""),
        &["unit"],
        "Corrected ticks compared with another instance's, bit by bit",
        |unit, look, out| out.counter(&[unit], look.role.ticks_compared),
    ),
    Family::unit_counter(
        ("isotherm_unit_ticks_differing", ""),
        &["unit"],
        "Ticks that differed: alarm on any",
        |unit, look, out| out.counter(&[unit], look.role.ticks_differing),
    ),
    Family::unit_gauge(
        ("isotherm_unit_stalled", ""),
        &["unit"],
        "1 if raw ticks arrive but corrected ones, though due, are not published",
        |unit, look, out| out.flag(&[unit], look.stalled),
    ),
    Family::unit_gauge(
        ("isotherm_unit_revision", ""),
        &["unit"],
        "Revision counter of the calibration in force; 0 without one",
        |unit, look, out| out.whole(&[unit], look.status.revision().counter),
    ),
    Family::unit_gauge(
        ("isotherm_unit_calibration_age", "seconds"),
        &["unit"],
        "Age of the document in force; absent if it states no date",
        |unit, look, out| {
            let calibration = look.status.calibration.as_ref();
            #[expect(clippy::cast_precision_loss, reason = "whole seconds, of fewer than 2⁵³")]
            let age_s = calibration.and_then(|calibration| calibration.age_s).map(|age_s| age_s as f64);
            age_s.map_or(Ok(()), |age_s| out.gauge(&[unit], age_s))
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_swap_pending", ""),
        &["unit"],
        "1 if a calibration waits for its tick",
        |unit, look, out| out.flag(&[unit], look.status.pending.is_some()),
    ),
    Family::unit_counter(
        ("isotherm_unit_swaps", ""),
        &["unit", "outcome"],
        "Swaps accepted and refused for the unit",
        |unit, look, out| {
            out.counter(&[unit, "accepted"], look.status.swaps.accepted)?;
            out.counter(&[unit, "refused"], look.status.swaps.refused)
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_self_test_passed", ""),
        &["unit"],
        "1 if the last self-test passed; absent before the first",
        |unit, look, out| {
            look.status.self_test.as_ref().map_or(Ok(()), |report| out.flag(&[unit], report.passed))
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_input_rate", "per_second"),
        &["unit", "input"],
        "Gyro ticks, accelerometer ticks, temperature readings, messages, over the last status interval",
        |unit, look, out| {
            let rates = &look.status.input_rates;
            out.gauge(&[unit, "gyro_ticks"], rates.gyro_ticks_per_s)?;
            out.gauge(&[unit, "accel_ticks"], rates.accel_ticks_per_s)?;
            out.gauge(&[unit, "temperature_readings"], rates.temperature_readings_per_s)?;
            out.gauge(&[unit, "messages"], rates.messages_per_s)
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_temperature", "celsius"),
        &["unit", "channel"],
        "Smoothed temperature of a channel; absent before the first reading",
        |unit, look, out| {
            each_channel(unit, look, |labels, channel| {
                channel.temperature_deg_c.map_or(Ok(()), |value| out.gauge(labels, value))
            })
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_temperature_rate", "celsius_per_second"),
        &["unit", "channel"],
        "Rate of the smoothed temperature",
        |unit, look, out| {
            each_channel(unit, look, |labels, channel| {
                channel.rate_deg_c_per_s.map_or(Ok(()), |value| out.gauge(labels, value))
            })
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_temperature_outside_range", ""),
        &["unit", "channel"],
        "1 if it is outside the range of the fit; absent if either is unknown",
        |unit, look, out| {
            each_channel(unit, look, |labels, channel| {
                channel.place.map_or(Ok(()), |place| out.flag(labels, place != Place::Inside))
            })
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_temperature_stale", ""),
        &["unit", "channel"],
        "1 if the channel's reading is missing, rejected or too old",
        |unit, look, out| each_channel(unit, look, |labels, channel| out.flag(labels, channel.stale)),
    ),
    Family::unit_gauge(
        ("isotherm_unit_applied_rate", "radians_per_second"),
        &["unit", "axis"],
        "Correction subtracted from the angular rate about a case axis",
        |unit, look, out| {
            let applied = look.status.applied.map(|applied| applied.angular_rate_rad_per_s);
            each_axis(applied, |axis, value| out.gauge(&[unit, axis], value))
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_applied_force", "meters_per_second_squared"),
        &["unit", "axis"],
        "Correction subtracted from the specific force along a case axis",
        |unit, look, out| {
            let applied = look.status.applied.map(|applied| applied.specific_force_m_per_s2);
            each_axis(applied, |axis, value| out.gauge(&[unit, axis], value))
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_drift", "radians_per_second"),
        &["unit", "gyro"],
        "Estimated drift of a gyro, in addition to its calibrated bias",
        |unit, look, out| {
            let mut drift = look.status.drift.iter();
            drift.try_for_each(|drift| out.gauge(&[unit, &drift.gyro], drift.rate_rad_per_s))
        },
    ),
    Family::unit_gauge(
        ("isotherm_unit_drift_sigma", "radians_per_second"),
        &["unit", "gyro"],
        "Standard error of the estimated drift",
        |unit, look, out| {
            let mut drift = look.status.drift.iter();
            drift.try_for_each(|drift| out.gauge(&[unit, &drift.gyro], drift.sigma_rad_per_s))
        },
    ),
    Family::unit_counter(
        ("isotherm_unit_sensor_invalid_ticks", ""),
        &["unit", "kind", "sensor"],
        "Corrected ticks that did not use a sensor's reading as read",
        |unit, look, out| {
            look.status.sensors.iter().try_for_each(|sensor| {
                let kind = match sensor.kind {
                    SensorKind::Gyro => "gyro",
                    SensorKind::Accel => "accel",
                };
                out.counter(&[unit, kind, &sensor.name], sensor.invalid)
            })
        },
    ),
    Family::unit_counter(
        ("isotherm_unit_faults", ""),
        &["unit", "kind"],
        "Messages refused, corrected ticks not published, alarms",
        |unit, look, out| {
            let mut kinds = FaultKind::ALL.iter().filter(|kind| concerns_units(**kind));
            kinds.try_for_each(|kind| out.counter(&[unit, kind.name()], look.status.counter(kind.name())))
        },
    ),
    Family::unit_histogram(
        ("isotherm_unit_added_latency", "seconds"),
        &["unit"],
        "Time from receiving a raw message to having published the result",
        latency,
    ),
];

/// Exponents of two of the latency bounds (ns): 16 µs to 268 ms.
const LATENCY_BOUNDS: std::ops::RangeInclusive<u32> = 14..=28;

/// The histogram of one unit.
fn latency(unit: &str, look: &UnitLook, out: &mut Samples<'_>) -> fmt::Result {
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
    out.histogram(&[unit], seconds(look.latency_sum_ns), total, &buckets)
}

/// How many latencies were below a power of two: the service's own, finer buckets end one nanosecond before each.
fn cumulative(buckets: &[LatencyBucket], bound_ns: u64) -> u64 {
    buckets.iter().take_while(|bucket| bucket.up_to_ns < bound_ns).map(|bucket| bucket.count).sum()
}

#[expect(clippy::cast_precision_loss, reason = "beyond 2⁵³ ns, 104 days, a nanosecond does not matter")]
fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

/// Whether units count it; the others belong to the service.
fn concerns_units(kind: FaultKind) -> bool {
    use FaultKind as K;

    match kind {
        K::Length
        | K::Kind
        | K::Version
        | K::Checksum
        | K::Body
        | K::Unpublished
        | K::JournalUnpublished
        | K::TwoProducers
        | K::Alarm => true,
        K::UnknownStream | K::BadSerial | K::Deletion | K::TooManyUnits | K::OtherBits | K::TwoSpeak => false,
    }
}

/// Calls `visit` with labels and status of each channel of a unit.
fn each_channel(
    unit: &str,
    look: &UnitLook,
    mut visit: impl FnMut(&[&str], &ChannelStatus) -> fmt::Result,
) -> fmt::Result {
    look.status.channels.iter().try_for_each(|channel| visit(&[unit, &channel.name], channel))
}

/// Calls `visit` with name and value of each axis; not at all where there are none yet.
fn each_axis(
    values: Option<[f64; 3]>,
    mut visit: impl FnMut(&'static str, f64) -> fmt::Result,
) -> fmt::Result {
    values
        .into_iter()
        .flat_map(|values| ["x", "y", "z"].into_iter().zip(values))
        .try_for_each(|(axis, value)| visit(axis, value))
}
