"""Layout of the wire messages.

Generated from protocol/layout.toml; change that file, not this one.
"""

from __future__ import annotations

from typing import Any

ALL_SENSORS = 16
BAD_DOCUMENTS = 64
BUCKETS = 1024
CHANNEL_NAME_BYTES = 24
CHANNELS = 16
ENTRIES = 256
FAULTS = 32
FRAME_BYTES = 1048576
FRAME_BYTES_LEAST = 6
HEALTH_READINGS = 64
MODES = 3
PARITY = 5
PART_BYTES = 524288
PARTS = 64
REASONS = 64
SENSORS = 8
TICKS = 4096
UNIT_BYTES = 64
UNITS = 4096

RAW_GYRO = 1
RAW_ACCEL = 2
RAW_TEMPERATURE = 3
CORRECTED = 4
STATUS = 5
RAW_HEALTH = 6
SERVICE_STATUS = 7
REFERENCE = 8
JOURNAL = 9

# Kind: key, types of its versions from 1, rules.
KINDS: dict[int, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    1: ("imu/{unit}/raw/gyro", ("gyro_batch",), ("alike",)),
    2: ("imu/{unit}/raw/accel", ("accelerometer_batch",), ("alike",)),
    3: ("imu/{unit}/raw/temp", ("temperature_batch",), ("per_channel",)),
    4: ("imu/{unit}/corrected", ("corrected_batch", "corrected_batch_2", "corrected_batch_3",), ()),
    5: ("imu/{unit}/status", ("status_1", "status",), ()),
    6: ("imu/{unit}/raw/health", ("health_batch",), ()),
    7: ("isotherm/{instance}/status", ("service_status",), ()),
    8: ("imu/{unit}/reference", ("rate_reference",), ("span",)),
    9: ("imu/{unit}/journal", ("journal_part",), ("part",)),
}

TICK_FLAGS: dict[str, int] = {
    "INTERPOLATED": 1 << 0,
    "GAP": 1 << 1,
    "ACCELEROMETER_MISSING": 1 << 2,
    "WARM_UP": 1 << 3,
    "UNCALIBRATED": 1 << 4,
    "ANGLE_RESTORED": 1 << 5,
    "SWITCH_UNRESOLVED": 1 << 6,
    "CONING_SCULLING": 1 << 7,
    "RESTART": 1 << 8,
    "PARITY_EXCEEDED": 1 << 9,
    "ANGLE_INVALID": 1 << 10,
    "VELOCITY_INVALID": 1 << 11,
    "SERVO_TRANSIENT": 1 << 12,
    "SERVO_UNMEASURED": 1 << 13,
    "TIME_STEP": 1 << 14,
}

SENSOR_FLAGS: dict[str, int] = {
    "VALID": 1 << 0,
    "OVERRANGE": 1 << 1,
    "CLAMPED_TEMPERATURE": 1 << 2,
    "STALE_TEMPERATURE": 1 << 3,
    "NOT_FINITE": 1 << 4,
    "EXCLUDED": 1 << 5,
    "CLAMPED_RATE": 1 << 6,
}

# Type: fields (name, form) of a struct, or variants (name, form or None) of an enum.
STRUCTS: dict[str, tuple[tuple[str, Any], ...]] = {
    "gyro_batch": (
        ("first_sequence", "u64"),
        ("series", "u64"),
        ("ticks", ("list", ("named", "gyro_tick"), 1, 4096)),
    ),
    "gyro_tick": (
        ("end_time_ns", "i64"),
        ("duration_ns", "u64"),
        ("readings", ("named", "readings")),
        ("mode", ("option", ("named", "mode"))),
        ("switch_command", "bool"),
        ("meander", ("option", ("named", "mode"))),
        ("half_periods", ("list", ("named", "half_period"), 0, 8)),
    ),
    "half_period": (
        ("positive", "i32"),
        ("negative", "i32"),
    ),
    "accelerometer_batch": (
        ("first_sequence", "u64"),
        ("ticks", ("list", ("named", "accelerometer_tick"), 1, 4096)),
    ),
    "accelerometer_tick": (
        ("end_time_ns", "i64"),
        ("duration_ns", "u64"),
        ("readings", ("named", "readings")),
    ),
    "temperature_batch": (
        ("channels", ("list", ("string", 24), 0, 16)),
        ("ticks", ("list", ("named", "temperature_tick"), 1, 4096)),
    ),
    "temperature_tick": (
        ("time_ns", "i64"),
        ("raw", ("list", "f64", 0, 16)),
    ),
    "health_batch": (
        ("ticks", ("list", ("named", "health_tick"), 1, 4096)),
    ),
    "health_tick": (
        ("time_ns", "i64"),
        ("readings", ("list", ("named", "health_reading"), 0, 64)),
    ),
    "health_reading": (
        ("name", ("string", 24)),
        ("value", "f64"),
    ),
    "rate_reference": (
        ("start_ns", "i64"),
        ("end_ns", "i64"),
        ("angular_rate_rad_per_s", ("array", "f64", 3)),
        ("sigma_rad_per_s", "f64"),
    ),
    "corrected_batch": (
        ("unit", ("string", 1048576)),
        ("revision", ("named", "revision")),
        ("temperatures", ("list", ("named", "applied_temperature"), 0, 16)),
        ("ticks", ("list", ("named", "corrected_tick"), 1, 4096)),
    ),
    "corrected_batch_2": (
        ("unit", ("string", 1048576)),
        ("revision", ("named", "revision")),
        ("temperatures", ("list", ("named", "applied_temperature"), 0, 16)),
        ("ticks", ("list", ("named", "corrected_tick"), 1, 4096)),
        ("sigmas", ("list", ("named", "sigma"), 1, 4096)),
    ),
    "corrected_batch_3": (
        ("unit", ("string", 1048576)),
        ("series", "u64"),
        ("revision", ("named", "revision")),
        ("temperatures", ("list", ("named", "applied_temperature"), 0, 16)),
        ("ticks", ("list", ("named", "corrected_tick"), 1, 4096)),
        ("sigmas", ("list", ("named", "sigma"), 0, 4096)),
    ),
    "sigma": (
        ("from_tick", "u16"),
        ("angle_noise_rad", ("array", "f64", 3)),
        ("angle_restoration_rad", ("array", "f64", 3)),
        ("angle_calibration_rad", ("array", "f64", 3)),
        ("angle_clamping_rad", ("array", "f64", 3)),
        ("velocity_noise_m_per_s", ("array", "f64", 3)),
        ("velocity_restoration_m_per_s", ("array", "f64", 3)),
        ("velocity_calibration_m_per_s", ("array", "f64", 3)),
        ("velocity_clamping_m_per_s", ("array", "f64", 3)),
    ),
    "applied_temperature": (
        ("channel", ("string", 24)),
        ("temperature_deg_c", "f64"),
        ("rate_deg_c_per_s", "f64"),
    ),
    "revision": (
        ("counter", "u64"),
        ("digest", ("digest", 8)),
    ),
    "corrected_tick": (
        ("sequence", "u64"),
        ("end_time_ns", "i64"),
        ("duration_ns", "u64"),
        ("ticks", "u16"),
        ("missed", "u64"),
        ("delta_angle_rad", ("array", "f64", 3)),
        ("delta_velocity_m_per_s", ("array", "f64", 3)),
        ("mode", ("option", ("named", "mode"))),
        ("flags", "u16"),
        ("gyro_flags", ("list", "u8", 0, 8)),
        ("accel_flags", ("list", "u8", 0, 8)),
        ("gyro_parity_rad_per_s", ("list", "f64", 0, 5)),
        ("accel_parity_m_per_s2", ("list", "f64", 0, 5)),
    ),
    "status": (
        ("unit", ("string", 1048576)),
        ("instance", ("string", 1048576)),
        ("version", ("string", 1048576)),
        ("state", ("named", "state")),
        ("output", ("named", "output")),
        ("calibration", ("option", ("named", "active_calibration"))),
        ("pending", ("option", ("named", "pending_change"))),
        ("swaps", ("named", "swaps")),
        ("last_tick", ("option", ("named", "last_tick"))),
        ("channels", ("list", ("named", "channel_status"), 0, 256)),
        ("sensors", ("list", ("named", "sensor_status"), 0, 16)),
        ("input_rates", ("named", "input_rates")),
        ("applied", ("option", ("named", "applied_correction"))),
        ("drift", ("list", ("named", "drift_status"), 0, 16)),
        ("rest", ("option", ("named", "rest"))),
        ("self_test", ("option", ("named", "self_test_report"))),
        ("pre_launch", ("option", ("named", "pre_launch_progress"))),
        ("pre_launch_outcome", ("option", ("named", "pre_launch_outcome"))),
        ("counters", ("list", ("named", "counter"), 0, 256)),
        ("faults", ("list", ("named", "fault"), 0, 32)),
        ("last_fault", ("option", ("string", 1048576))),
        ("latency", ("named", "latency")),
    ),
    "active_calibration": (
        ("revision", ("named", "revision")),
        ("digest", ("option", ("digest", 32))),
        ("created_unix_s", ("option", "i64")),
        ("age_s", ("option", "i64")),
        ("source", ("string", 1048576)),
        ("overlay", ("option", ("digest", 32))),
    ),
    "pending_change": (
        ("revision", ("named", "revision")),
        ("digest", ("option", ("digest", 32))),
        ("source", ("string", 1048576)),
        ("schedule", ("named", "schedule")),
        ("slew_s", "f64"),
    ),
    "swaps": (
        ("accepted", "u64"),
        ("refused", "u64"),
        ("last_refusal", ("option", ("string", 1048576))),
    ),
    "last_tick": (
        ("end_time_ns", "i64"),
        ("sequence", "u64"),
        ("series", "u64"),
    ),
    "channel_status": (
        ("name", ("string", 24)),
        ("temperature_deg_c", ("option", "f64")),
        ("rate_deg_c_per_s", ("option", "f64")),
        ("stale", "bool"),
        ("warming_up", "bool"),
        ("calibrated_range_deg_c", ("option", ("array", "f64", 2))),
        ("place", ("option", ("named", "place"))),
    ),
    "sensor_status": (
        ("name", ("string", 1048576)),
        ("kind", ("named", "sensor_kind")),
        ("flags", "u8"),
        ("ticks", "u64"),
        ("invalid", "u64"),
        ("overrange", "u64"),
        ("not_finite", "u64"),
        ("clamped", "u64"),
        ("stale", "u64"),
        ("excluded", "u64"),
    ),
    "input_rates": (
        ("gyro_ticks_per_s", "f64"),
        ("accel_ticks_per_s", "f64"),
        ("temperature_readings_per_s", "f64"),
        ("messages_per_s", "f64"),
    ),
    "applied_correction": (
        ("angular_rate_rad_per_s", ("array", "f64", 3)),
        ("specific_force_m_per_s2", ("array", "f64", 3)),
    ),
    "drift_status": (
        ("gyro", ("string", 1048576)),
        ("rate_rad_per_s", "f64"),
        ("sigma_rad_per_s", "f64"),
        ("trend_rad_per_s2", "f64"),
        ("updates", "u64"),
        ("refused", "u64"),
        ("mean_nis", ("option", "f64")),
        ("last_update_ns", ("option", "i64")),
        ("subtracted", "bool"),
    ),
    "self_test_report": (
        ("passed", "bool"),
        ("ended_ns", ("option", "i64")),
        ("length_s", "f64"),
        ("items", ("list", ("named", "self_test_item"), 0, 256)),
    ),
    "self_test_item": (
        ("name", ("string", 1048576)),
        ("value", ("option", "f64")),
        ("at_least", ("option", "f64")),
        ("at_most", ("option", "f64")),
        ("unit_of_measure", ("string", 1048576)),
        ("passed", "bool"),
    ),
    "pre_launch_progress": (
        ("elapsed_s", "f64"),
        ("duration_s", "f64"),
        ("gyros", ("list", ("named", "pre_launch_gyro"), 0, 8)),
    ),
    "pre_launch_gyro": (
        ("name", ("string", 1048576)),
        ("modes", ("list", ("named", "pre_launch_mode"), 0, 3)),
        ("sigma_rad_per_s", ("option", "f64")),
    ),
    "pre_launch_mode": (
        ("mode", ("option", ("named", "mode"))),
        ("ticks", "u64"),
        ("time_s", "f64"),
        ("mean_temperature_deg_c", ("option", "f64")),
    ),
    "pre_launch_outcome": (
        ("ended_ns", ("option", "i64")),
        ("verdict", ("named", "verdict")),
        ("overlay", ("option", ("digest", 32))),
    ),
    "constants_change": (
        ("gyro", ("string", 1048576)),
        ("static_bias_change_rad_per_s", "f64"),
        ("static_bias_sigma_rad_per_s", "f64"),
        ("magnetic_bias_change_rad_per_s", ("option", "f64")),
        ("magnetic_bias_sigma_rad_per_s", ("option", "f64")),
        ("earth_rate_rad_per_s", "f64"),
        ("modes", ("list", ("named", "pre_launch_mode"), 0, 3)),
    ),
    "counter": (
        ("name", ("string", 1048576)),
        ("value", "u64"),
    ),
    "fault": (
        ("kind", ("string", 1048576)),
        ("count", "u64"),
        ("first", ("string", 1048576)),
        ("last_unix_ms", "i64"),
    ),
    "latency": (
        ("p50_ns", "u64"),
        ("p99_ns", "u64"),
        ("p999_ns", "u64"),
        ("max_ns", "u64"),
        ("buckets", ("list", ("named", "latency_bucket"), 0, 1024)),
    ),
    "latency_bucket": (
        ("up_to_ns", "u64"),
        ("count", "u64"),
    ),
    "status_1": (
        ("unit", ("string", 1048576)),
        ("service_version", ("string", 1048576)),
        ("state", ("named", "state_1")),
        ("revision", ("named", "revision")),
        ("last_end_time_ns", ("option", "i64")),
        ("last_sequence", ("option", "u64")),
        ("channels", ("list", ("named", "channel_status_1"), 0, 256)),
        ("counters", ("list", ("named", "counter"), 0, 256)),
        ("last_fault", ("option", ("string", 1048576))),
        ("added_latency_p50_ns", "u64"),
        ("added_latency_p99_ns", "u64"),
    ),
    "channel_status_1": (
        ("channel", ("string", 24)),
        ("temperature_deg_c", ("option", "f64")),
        ("rate_deg_c_per_s", ("option", "f64")),
        ("stale", "bool"),
        ("warming_up", "bool"),
    ),
    "service_status": (
        ("instance", ("string", 1048576)),
        ("version", ("string", 1048576)),
        ("pid", ("option", "u32")),
        ("started_unix_ms", "i64"),
        ("uptime_s", "f64"),
        ("units", ("list", ("named", "unit_summary"), 0, 4096)),
        ("calibrations", ("option", ("named", "folder_status"))),
        ("bad_documents", ("list", ("named", "bad_document"), 0, 64)),
        ("store", ("option", ("named", "store_status"))),
        ("faults", ("list", ("named", "fault"), 0, 32)),
        ("settings_digest", ("option", ("digest", 32))),
        ("swaps_accepted", "u64"),
        ("swaps_refused", "u64"),
    ),
    "unit_summary": (
        ("unit", ("string", 1048576)),
        ("state", ("named", "state")),
        ("output", ("named", "output")),
    ),
    "folder_status": (
        ("path", ("string", 1048576)),
        ("state", ("named", "folder_state")),
        ("reason", ("option", ("string", 1048576))),
    ),
    "bad_document": (
        ("file", ("string", 1048576)),
        ("problem", ("string", 1048576)),
        ("problems", "u64"),
    ),
    "store_status": (
        ("path", ("string", 1048576)),
        ("audit_entries", "u64"),
    ),
    "journal_part": (
        ("unit", ("string", 1048576)),
        ("instance", ("string", 1048576)),
        ("number", "u64"),
        ("part", "u32"),
        ("parts", "u32"),
        ("bytes", ("list", "u8", 1, 524288)),
    ),
}
ENUMS: dict[str, tuple[tuple[str, Any], ...]] = {
    "readings": (
        ("Counts", ("list", "i32", 0, 8)),
        ("Means", ("list", "f64", 0, 8)),
    ),
    "mode": (
        ("Plus", None),
        ("Minus", None),
    ),
    "state": (
        ("standby", None),
        ("self-test", None),
        ("pre-launch calibration", None),
        ("running with mode reversal", None),
        ("running without mode reversal", None),
    ),
    "output": (
        ("calibrated", None),
        ("pass-through", None),
        ("held", None),
    ),
    "schedule": (
        ("next-tick", None),
        ("sequence", "u64"),
        ("time-ns", "i64"),
    ),
    "place": (
        ("below", None),
        ("inside", None),
        ("above", None),
    ),
    "sensor_kind": (
        ("gyro", None),
        ("accel", None),
    ),
    "rest": (
        ("learning", None),
        ("still", None),
        ("moved", ("string", 1048576)),
    ),
    "verdict": (
        ("accepted", ("list", ("named", "constants_change"), 0, 8)),
        ("refused", ("list", ("string", 1048576), 0, 64)),
        ("aborted", None),
    ),
    "state_1": (
        ("Uncalibrated", None),
        ("Held", None),
        ("Running", None),
    ),
    "folder_state": (
        ("watching", None),
        ("polling", None),
        ("gone", None),
    ),
}
