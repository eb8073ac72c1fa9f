//! Units of measure as the document's keys spell them, and their size in SI.

use isotherm_correction::units::{Angle, AngularRate, STANDARD_GRAVITY_M_PER_S2};

/// rad/s in one °/h.
pub(super) const DEG_PER_H: f64 = AngularRate::from_deg_per_h(1.0).as_rad_per_s();
/// rad/s in one °/s.
pub(super) const DEG_PER_S: f64 = AngularRate::from_deg_per_s(1.0).as_rad_per_s();
/// rad in one ″.
pub(super) const ARCSEC: f64 = Angle::from_arcsec(1.0).as_rad();
/// rad/√s in one °/√h.
pub(super) const DEG_PER_SQRT_H: f64 = Angle::from_deg(1.0).as_rad() / 60.0;
/// One part per million.
pub(super) const PPM: f64 = 1e-6;
/// Seconds in an hour.
pub(super) const HOUR: f64 = 3600.0;

/// Unit of a curve's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unit {
    /// °/h.
    DegPerH,
    /// (°/h)/(°C/s).
    DegPerHPerDegCPerS,
    /// (°/h)/(°C/s²).
    DegPerHPerDegCPerS2,
    /// 10⁻⁶.
    Ppm,
    /// Hz.
    Hz,
    /// (counts/s)/(m/s²).
    CountsPerSPerMPerS2,
    /// V/(m/s²).
    VPerMPerS2,
    /// (m/s²)/(m/s²).
    MPerS2PerMPerS2,
    /// counts/s.
    CountsPerS,
    /// V.
    V,
    /// m/s².
    MPerS2,
    /// (counts/s)/(°C/s).
    CountsPerSPerDegCPerS,
    /// V/(°C/s).
    VPerDegCPerS,
    /// (m/s²)/(°C/s).
    MPerS2PerDegCPerS,
    /// (°/h)/g, g the standard gravity.
    DegPerHPerG,
    /// µg/g².
    MicroGPerG2,
    /// (°/h)/°C.
    DegPerHPerDegC,
    /// (counts/s)/°C.
    CountsPerSPerDegC,
    /// V/°C.
    VPerDegC,
    /// (m/s²)/°C.
    MPerS2PerDegC,
    /// °/h per unit of a channel.
    DegPerHPerUnit,
    /// counts/s per unit of a channel.
    CountsPerSPerUnit,
    /// V per unit of a channel.
    VPerUnit,
    /// m/s² per unit of a channel.
    MPerS2PerUnit,
}

impl Unit {
    /// All of them.
    pub const ALL: [Self; 24] = [
        Self::DegPerH,
        Self::DegPerHPerDegCPerS,
        Self::DegPerHPerDegCPerS2,
        Self::Ppm,
        Self::Hz,
        Self::CountsPerSPerMPerS2,
        Self::VPerMPerS2,
        Self::MPerS2PerMPerS2,
        Self::CountsPerS,
        Self::V,
        Self::MPerS2,
        Self::CountsPerSPerDegCPerS,
        Self::VPerDegCPerS,
        Self::MPerS2PerDegCPerS,
        Self::DegPerHPerG,
        Self::MicroGPerG2,
        Self::DegPerHPerDegC,
        Self::CountsPerSPerDegC,
        Self::VPerDegC,
        Self::MPerS2PerDegC,
        Self::DegPerHPerUnit,
        Self::CountsPerSPerUnit,
        Self::VPerUnit,
        Self::MPerS2PerUnit,
    ];

    /// Spelling in keys.
    #[must_use]
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::DegPerH => "deg_per_h",
            Self::DegPerHPerDegCPerS => "deg_per_h_per_deg_c_per_s",
            Self::DegPerHPerDegCPerS2 => "deg_per_h_per_deg_c_per_s2",
            Self::Ppm => "ppm",
            Self::Hz => "hz",
            Self::CountsPerSPerMPerS2 => "counts_per_s_per_m_per_s2",
            Self::VPerMPerS2 => "v_per_m_per_s2",
            Self::MPerS2PerMPerS2 => "m_per_s2_per_m_per_s2",
            Self::CountsPerS => "counts_per_s",
            Self::V => "v",
            Self::MPerS2 => "m_per_s2",
            Self::CountsPerSPerDegCPerS => "counts_per_s_per_deg_c_per_s",
            Self::VPerDegCPerS => "v_per_deg_c_per_s",
            Self::MPerS2PerDegCPerS => "m_per_s2_per_deg_c_per_s",
            Self::DegPerHPerG => "deg_per_h_per_g",
            Self::MicroGPerG2 => "micro_g_per_g2",
            Self::DegPerHPerDegC => "deg_per_h_per_deg_c",
            Self::CountsPerSPerDegC => "counts_per_s_per_deg_c",
            Self::VPerDegC => "v_per_deg_c",
            Self::MPerS2PerDegC => "m_per_s2_per_deg_c",
            Self::DegPerHPerUnit => "deg_per_h_per_unit",
            Self::CountsPerSPerUnit => "counts_per_s_per_unit",
            Self::VPerUnit => "v_per_unit",
            Self::MPerS2PerUnit => "m_per_s2_per_unit",
        }
    }

    /// Spelling for readers.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::DegPerH => "°/h",
            Self::DegPerHPerDegCPerS => "(°/h)/(°C/s)",
            Self::DegPerHPerDegCPerS2 => "(°/h)/(°C/s²)",
            Self::Ppm => "ppm",
            Self::Hz => "Hz",
            Self::CountsPerSPerMPerS2 => "(counts/s)/(m/s²)",
            Self::VPerMPerS2 => "V/(m/s²)",
            Self::MPerS2PerMPerS2 => "(m/s²)/(m/s²)",
            Self::CountsPerS => "counts/s",
            Self::V => "V",
            Self::MPerS2 => "m/s²",
            Self::CountsPerSPerDegCPerS => "(counts/s)/(°C/s)",
            Self::VPerDegCPerS => "V/(°C/s)",
            Self::MPerS2PerDegCPerS => "(m/s²)/(°C/s)",
            Self::DegPerHPerG => "(°/h)/g",
            Self::MicroGPerG2 => "µg/g²",
            Self::DegPerHPerDegC => "(°/h)/°C",
            Self::CountsPerSPerDegC => "(counts/s)/°C",
            Self::VPerDegC => "V/°C",
            Self::MPerS2PerDegC => "(m/s²)/°C",
            Self::DegPerHPerUnit => "(°/h)/unit",
            Self::CountsPerSPerUnit => "(counts/s)/unit",
            Self::VPerUnit => "V/unit",
            Self::MPerS2PerUnit => "(m/s²)/unit",
        }
    }

    /// How much of the core's unit it is (rad/s, 1, Hz, counts/s, V, m/s² or s²/m; per °C, °C/s, °C/s² or m/s² where it says so).
    #[must_use]
    pub const fn in_core_units(self) -> f64 {
        match self {
            Self::DegPerH
            | Self::DegPerHPerDegC
            | Self::DegPerHPerUnit
            | Self::DegPerHPerDegCPerS
            | Self::DegPerHPerDegCPerS2 => DEG_PER_H,
            Self::Ppm => PPM,
            Self::DegPerHPerG => DEG_PER_H / STANDARD_GRAVITY_M_PER_S2,
            Self::MicroGPerG2 => 1e-6 / STANDARD_GRAVITY_M_PER_S2,
            _ => 1.0,
        }
    }
}

/// Unit of a curve's argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Argument {
    /// Temperature, °C.
    DegC,
    /// Its rate, °C/s.
    DegCPerS,
    /// Its acceleration, °C/s².
    DegCPerS2,
    /// Angular rate, °/s.
    DegPerS,
}

impl Argument {
    /// Spelling in keys.
    #[must_use]
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::DegC => "deg_c",
            Self::DegCPerS => "deg_c_per_s",
            Self::DegCPerS2 => "deg_c_per_s2",
            Self::DegPerS => "deg_per_s",
        }
    }

    /// How much of the core's unit it is (°C, °C/s, °C/s² or rad/s).
    #[must_use]
    pub const fn in_core_units(self) -> f64 {
        match self {
            Self::DegC | Self::DegCPerS | Self::DegCPerS2 => 1.0,
            Self::DegPerS => DEG_PER_S,
        }
    }

    /// Spelling for readers.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::DegC => "°C",
            Self::DegCPerS => "°C/s",
            Self::DegCPerS2 => "°C/s²",
            Self::DegPerS => "°/s",
        }
    }
}

/// Spellings at the end of a key that state its unit, the longest first, with the symbol for readers.
#[cfg(test)]
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
#[cfg(test)]
pub(super) fn unit_of_key(key: &str) -> Option<&'static str> {
    KEY_UNITS.iter().find(|(suffix, _)| key.ends_with(suffix)).map(|(_, symbol)| *symbol)
}
