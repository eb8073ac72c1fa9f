//! Units of measure as the document's keys spell them, and their size in SI.

use isotherm_correction::thermal::{ACCEL_TERMS, GYRO_TERMS, Per};
use isotherm_correction::units::{Angle, AngularRate};

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

/// Unit of a curve's values, but for what it is per.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BaseUnit {
    /// °/h.
    DegPerH,
    /// 10⁻⁶.
    Ppm,
    /// 10⁻⁶ of standard gravity.
    MicroG,
    /// Hz.
    Hz,
    /// counts/s.
    CountsPerS,
    /// V.
    V,
    /// m/s².
    MPerS2,
}

impl BaseUnit {
    const ALL: [Self; 7] =
        [Self::DegPerH, Self::Ppm, Self::MicroG, Self::Hz, Self::CountsPerS, Self::V, Self::MPerS2];

    /// Spelling in keys and for readers, and how much of the core's unit it is (rad/s, 1, Hz, counts/s, V, m/s²; of a force per its
    /// square, s²/m).
    const fn spelled(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::DegPerH => ("deg_per_h", "°/h", DEG_PER_H),
            Self::Ppm => ("ppm", "ppm", PPM),
            Self::MicroG => ("micro_g", "µg", 1e-6),
            Self::Hz => ("hz", "Hz", 1.0),
            Self::CountsPerS => ("counts_per_s", "counts/s", 1.0),
            Self::V => ("v", "V", 1.0),
            Self::MPerS2 => ("m_per_s2", "m/s²", 1.0),
        }
    }

    /// It, per unit of a feature.
    #[must_use]
    pub const fn per(self, per: Per) -> Unit {
        Unit { base: self, per }
    }
}

/// Unit of a curve's values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// The unit by itself.
    pub base: BaseUnit,
    /// Per unit of what.
    pub per: Per,
}

impl Unit {
    /// ppm.
    pub const PPM: Self = BaseUnit::Ppm.per(Per::ONE);
    /// Hz.
    pub const HZ: Self = BaseUnit::Hz.per(Per::ONE);

    /// The unit of a spelling in keys.
    #[must_use]
    pub fn of_suffix(suffix: &str) -> Option<Self> {
        let terms = GYRO_TERMS.iter().chain(&ACCEL_TERMS).map(|term| term.per).chain([Per::M_PER_S2]);
        let mut all = terms.flat_map(|per| BaseUnit::ALL.map(|base| base.per(per)));
        all.find(|unit| unit.suffix() == suffix)
    }

    /// Spelling in keys.
    #[must_use]
    pub fn suffix(self) -> String {
        [self.base.spelled().0, self.per.key].concat()
    }

    /// Spelling for readers.
    #[must_use]
    pub fn symbol(self) -> String {
        let whole =
            |symbol: &str| if symbol.contains('/') { format!("({symbol})") } else { symbol.to_owned() };
        let (base, per) = (self.base.spelled().1, self.per.symbol);
        if per.is_empty() { base.to_owned() } else { format!("{}/{}", whole(base), whole(per)) }
    }

    /// How much of the core's unit it is.
    #[must_use]
    pub fn in_core_units(self) -> f64 {
        self.base.spelled().2 / self.per.size
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
    pub(super) const ALL: [Self; 4] = [Self::DegC, Self::DegCPerS, Self::DegCPerS2, Self::DegPerS];

    /// Spelling in keys and for readers, and how much of the core's unit it is (°C, °C/s, °C/s² or rad/s).
    const fn spelled(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::DegC => ("deg_c", "°C", 1.0),
            Self::DegCPerS => ("deg_c_per_s", "°C/s", 1.0),
            Self::DegCPerS2 => ("deg_c_per_s2", "°C/s²", 1.0),
            Self::DegPerS => ("deg_per_s", "°/s", DEG_PER_S),
        }
    }

    /// The argument of a spelling in keys.
    #[must_use]
    pub fn of_suffix(suffix: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|argument| argument.suffix() == suffix)
    }

    /// Spelling in keys.
    #[must_use]
    pub const fn suffix(self) -> &'static str {
        self.spelled().0
    }

    /// How much of the core's unit it is (°C, °C/s, °C/s² or rad/s).
    #[must_use]
    pub const fn in_core_units(self) -> f64 {
        self.spelled().2
    }

    /// Spelling for readers.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        self.spelled().1
    }
}
