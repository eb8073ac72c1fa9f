//! A metric for each counter of a unit, under the counter's own name (`docs/wire.md`).

use std::fmt;

use super::super::page::{Samples, Type};
use super::super::source::Look;
use super::Family;

/// Declares the metric of each counter.
macro_rules! counters {
    ($($name:literal: $help:literal,)+) => {
        /// All of them.
        pub(super) const FAMILIES: &[Family] = &[$(Family {
            name: concat!("isotherm_unit_", $name),
            unit: "",
            kind: Type::Counter,
            labels: &["unit"],
            help: $help,
            samples: |look, out| samples(look, out, $name),
        },)+];
    };
}

/// A counter of every unit.
fn samples(look: &Look, out: &mut Samples<'_>, name: &str) -> fmt::Result {
    look.units.iter().try_for_each(|unit| out.counter(&[&unit.status.unit], unit.status.counter(name)))
}

counters! {
    "gyro_ticks_in": "Raw gyro ticks received, whatever became of them",
    "accel_ticks_in": "Raw accelerometer ticks received, whatever became of them",
    "temperature_readings_in": "Temperature readings received, whatever became of them",
    "ticks_out": "Raw ticks given out corrected",
    "gaps": "Gaps announced",
    "ticks_missed": "Raw gyro ticks announced as missing in those gaps",
    "gyro_duplicates": "Gyro ticks that had been taken before",
    "gyro_late": "Gyro ticks that came after their gap had been announced",
    "gyro_implausible": "Gyro ticks refused, or waiting to be believed: sequence and time contradict what came before",
    "restarts": "Restarts of the producer's sequence or clock that were followed",
    "wrong_sensor_count": "Ticks refused: another number of sensors than the calibration has",
    "wrong_output_kind": "Ticks refused: counts where the calibration says means, or the reverse",
    "bad_duration": "Ticks refused: duration zero or beyond 10 s",
    "pending_overflow": "Gyro ticks released without waiting because too many were pending",
    "accel_duplicates": "Accelerometer ticks that had been taken before",
    "accel_late": "Accelerometer ticks that came after their gyro tick had gone",
    "accel_unpaired": "Accelerometer ticks dropped because no gyro tick ended with them",
    "accel_missing": "Corrected ticks without an accelerometer tick",
    "temperature_late": "Temperature readings that came after ticks which should have felt them",
    "temperature_out_of_order": "Temperature readings not newer than the channel's last one",
    "temperature_rejected": "Temperature readings rejected: not finite, out of range, or a spike",
    "temperature_unknown_channel": "Temperature readings of a channel that the calibration does not have",
    "temperature_overflow": "Temperature readings dropped because too many were waiting to take effect",
    "not_finite_readings": "Sensor readings that were not finite",
    "overrange_readings": "Sensor readings at or beyond the input range",
    "sensors_excluded": "Sensors excluded by the parity check",
    "ticks_interpolated": "Ticks predicted over a mode switch",
    "switches_restored": "Mode switches whose angle was restored",
    "switches_unresolved": "Mode switches that could not be bridged from both sides",
    "servo_unmeasured": "Ticks after a mode switch without the half-period counts that the servo's transient is taken from",
    "ticks_held": "Ticks not published: the unit is in no running state, or holds back without a calibration",
    "references_received": "Rate references received, and those made at rest",
    "references_used": "Rate references that at least one gyro's estimate was updated with",
    "references_late": "Rate references that came after ticks which should have felt them",
    "references_no_drift": "Rate references refused: no gyro of the calibration states a drift",
    "references_not_plausible": "Rate references refused: far outside what can be",
    "references_too_short": "Rate references refused: a span below 1 s",
    "references_too_long": "Rate references refused: a span beyond 120 s",
    "references_overflow": "Rate references dropped because too many were waiting to take effect",
    "references_too_old": "Rate references refused: the readings of their time are no longer kept",
    "references_overlap": "Rate references refused: their span overlaps one that was used, or lies before it",
    "references_gap": "Rate references refused: too many readings of their span are missing or unusable",
    "references_gated": "Rate references refused: too far from every gyro's estimate",
    "references_restarted": "Rate references dropped: the producer restarted before they took effect",
    "bad_frames": "Raw and reference frames refused, for whatever reason",
}
