//! Counters of a unit, in the words of `docs/wire.md`.

use super::{Family, Source, Type, one};

/// Declares the metrics, each by the name that its counter has in a status.
macro_rules! counters {
    ($($name:literal: $help:literal,)+) => {
        super::families! { Unit "isotherm_unit_":
            $(Counter $name "" [] $help |look| one(look.status.counter($name));)+
        }
    };
}

counters! {
    "gyro_ticks_in": "Raw gyro ticks received",
    "accel_ticks_in": "Raw accelerometer ticks received",
    "temperature_readings_in": "Temperature readings received",
    "ticks_out": "Raw ticks corrected and sent",
    "gaps": "Gaps announced",
    "ticks_missed": "Gyro ticks announced as missing",
    "gyro_duplicates": "Gyro ticks received before",
    "gyro_late": "Gyro ticks too late for their gap",
    "gyro_implausible": "Gyro ticks that contradict earlier ones",
    "restarts": "Restarts of the producer",
    "wrong_sensor_count": "Ticks with another number of sensors than calibrated",
    "wrong_output_kind": "Ticks with counts instead of means, or the reverse",
    "bad_duration": "Ticks of duration 0 or above 10 s",
    "pending_overflow": "Gyro ticks released early, too many waiting",
    "accel_duplicates": "Accelerometer ticks received before",
    "accel_late": "Accelerometer ticks too late for their gyro tick",
    "accel_unpaired": "Accelerometer ticks without a gyro tick",
    "accel_missing": "Corrected ticks without an accelerometer tick",
    "temperature_late": "Temperature readings too late for their ticks",
    "temperature_out_of_order": "Temperature readings not newer than the last",
    "temperature_rejected": "Temperature readings not finite, out of range, or spikes",
    "temperature_unknown_channel": "Temperature readings of unknown channels",
    "temperature_overflow": "Temperature readings dropped, too many waiting",
    "not_finite_readings": "Sensor readings that are not finite",
    "overrange_readings": "Sensor readings at or beyond the input limit",
    "sensors_excluded": "Sensors excluded by the parity check",
    "ticks_interpolated": "Ticks predicted over mode switches",
    "switches_restored": "Mode switches restored",
    "switches_unresolved": "Mode switches not restored",
    "servo_unmeasured": "Ticks of a servo transient without usable half-period counts",
    "ticks_held": "Ticks withheld: no running state, or no calibration",
    "references_received": "References received, and made at rest",
    "references_used": "References used",
    "references_late": "References too late for their ticks",
    "references_no_drift": "References without a gyro that states a drift",
    "references_not_plausible": "References that are implausible",
    "references_too_short": "References below 1 s",
    "references_too_long": "References above 120 s",
    "references_overflow": "References dropped, too many waiting",
    "references_too_old": "References older than the readings kept",
    "references_overlap": "References that overlap a used one",
    "references_gap": "References with too many unusable readings",
    "references_gated": "References too far from every estimate",
    "references_restarted": "References dropped at a restart",
    "bad_frames": "Raw and reference frames refused",
}
