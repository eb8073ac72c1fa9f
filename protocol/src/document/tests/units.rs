//! Units of measure of keys, for the reference page and the check that every number names its own.

/// Spellings at the end of a key that state its unit, the longest first, with the symbol for readers.
const KEY_UNITS: [(&str, &str); 34] = [
    ("_m_per_s2_per_sqrt_h", "(m/s²)/√h"),
    ("_deg_per_h_per_sqrt_h", "(°/h)/√h"),
    ("_m_per_s_per_sqrt_h", "(m/s)/√h"),
    ("_deg_per_h_per_deg_c", "(°/h)/°C"),
    ("_m_per_s2_per_deg_c", "(m/s²)/°C"),
    ("_arcsec_per_deg_c", "″/°C"),
    ("_arcsec_per_count", "″/count"),
    ("_counts_per_tick", "counts/tick"),
    ("_deg_c2_per_s3", "°C²/s³"),
    ("_rad_per_rad", "rad/rad"),
    ("_time_constants", "time constants"),
    ("_deg_c_per_s", "°C/s"),
    ("_deg_per_sqrt_h", "°/√h"),
    ("_deg_per_h2", "°/h²"),
    ("_deg_per_h", "°/h"),
    ("_deg_per_s", "°/s"),
    ("_m_per_s2", "m/s²"),
    ("_m_per_s", "m/s"),
    ("_arcsec", "″"),
    ("_ppm", "10⁻⁶"),
    ("_readings", "readings"),
    ("_readings_before", "readings"),
    ("_readings_after", "readings"),
    ("_degree", "degree"),
    ("_deg_c", "°C"),
    ("_deg", "°"),
    ("_ticks", "ticks"),
    ("_ratio", "1"),
    ("_h", "h"),
    ("_ns", "ns"),
    ("_s", "s"),
    ("_m", "m"),
    ("_v", "V"),
    ("_hz", "Hz"),
];

/// Symbol of the unit that a key ends with; `None` for a key without one.
pub(super) fn unit_of_key(key: &str) -> Option<&'static str> {
    KEY_UNITS.iter().find(|(suffix, _)| key.ends_with(suffix)).map(|(_, symbol)| *symbol)
}
