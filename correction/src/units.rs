//! Units of measure: one newtype per quantity, SI inside.
//!
//! Catalogue units (°/h, ″, ppm) appear only in constructor and getter names, so that a number never
//! crosses a boundary without its unit being spelled. Inside a model's inner loop the numbers are bare `f64`
//! in SI with the unit in the variable's name.

use core::ops::{Add, Sub};

use serde::{Deserialize, Serialize};

/// π/180 (rad per °).
const RAD_PER_DEG: f64 = core::f64::consts::PI / 180.0;
/// rad/s in one °/h.
const RAD_PER_S_IN_DEG_PER_H: f64 = RAD_PER_DEG / 3600.0;
/// rad in one ″.
const RAD_PER_ARCSEC: f64 = RAD_PER_DEG / 3600.0;
/// Standard acceleration of free fall (m/s²), CGPM 1901.
pub const STANDARD_GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Defines a newtype over `f64` with one constructor and one getter per unit.
macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident { $($(#[$udoc:meta])* $from:ident / $as:ident = $factor:expr;)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
        #[repr(transparent)]
        pub struct $name(f64);

        impl $name {
            $(
                $(#[$udoc])*
                #[must_use]
                pub const fn $from(value: f64) -> Self { Self(value * $factor) }
                $(#[$udoc])*
                #[must_use]
                pub const fn $as(self) -> f64 { self.0 / $factor }
            )+
        }
    };
}

quantity! {
    /// Angular rate.
    AngularRate {
        /// Radians per second.
        from_rad_per_s / as_rad_per_s = 1.0;
        /// Degrees per second.
        from_deg_per_s / as_deg_per_s = RAD_PER_DEG;
        /// Degrees per hour.
        from_deg_per_h / as_deg_per_h = RAD_PER_S_IN_DEG_PER_H;
    }
}
quantity! {
    /// Plane angle.
    Angle {
        /// Radians.
        from_rad / as_rad = 1.0;
        /// Degrees.
        from_deg / as_deg = RAD_PER_DEG;
        /// Seconds of arc.
        from_arcsec / as_arcsec = RAD_PER_ARCSEC;
    }
}
quantity! {
    /// Specific force: what an accelerometer senses.
    SpecificForce {
        /// Metres per second squared.
        from_m_per_s2 / as_m_per_s2 = 1.0;
        /// Standard gravities.
        from_g / as_g = STANDARD_GRAVITY_M_PER_S2;
    }
}
/// A span of event time in nanoseconds, never negative.
///
/// Range: 0…2⁶³−1 ns (292 years); construction from seconds saturates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[repr(transparent)]
pub struct Span(i64);

impl Span {
    /// No time at all.
    pub const ZERO: Self = Self(0);
    /// An hour.
    pub(crate) const HOUR: Self = Self(3_600_000_000_000);

    /// From nanoseconds; negative values become zero.
    #[must_use]
    pub const fn from_ns(ns: i64) -> Self {
        Self(if ns < 0 { 0 } else { ns })
    }

    /// From milliseconds, saturating.
    #[must_use]
    pub const fn from_ms(ms: u32) -> Self {
        Self(ms as i64 * 1_000_000)
    }

    /// From seconds, rounded to the nearest nanosecond; NaN and negative values become zero.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "float-to-int `as` saturates, which is the documented behaviour"
    )]
    pub fn from_s(s: f64) -> Self {
        Self(libm::round(s.max(0.0) * 1e9) as i64)
    }

    /// In nanoseconds.
    #[must_use]
    pub const fn as_ns(self) -> i64 {
        self.0
    }

    /// In seconds.
    #[must_use]
    pub const fn as_s(self) -> f64 {
        seconds(self.0)
    }

    /// Half of it, in whole nanoseconds.
    #[must_use]
    pub const fn half(self) -> Self {
        // A span is never negative.
        Self(self.0 >> 1)
    }
}

/// An instant on the producer's own clock: nanoseconds since that clock's epoch.
///
/// Arithmetic saturates, so that no time stamp, however broken, can stop a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[repr(transparent)]
pub struct Timestamp(i64);

impl Timestamp {
    /// From nanoseconds since the producer's epoch.
    #[must_use]
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// Nanoseconds since the producer's epoch.
    #[must_use]
    pub const fn as_ns(self) -> i64 {
        self.0
    }

    /// Time from `earlier` to `self`; zero where `earlier` is the later one.
    #[inline]
    #[must_use]
    pub const fn since(self, earlier: Self) -> Span {
        Span::from_ns(self.ns_from(earlier))
    }

    /// Signed time from `other` to `self` (s).
    #[must_use]
    pub const fn seconds_from(self, other: Self) -> f64 {
        seconds(self.ns_from(other))
    }

    /// Signed time from `other` to `self` (ns), as `saturating_sub` gives it, with a branch that is never taken in place of what that
    /// always computes.
    #[inline]
    const fn ns_from(self, other: Self) -> i64 {
        match self.0.checked_sub(other.0) {
            Some(ns) => ns,
            None => ends_apart(self.0),
        }
    }

    /// Number of the cell that it lies in, where time since the epoch is divided into cells of this length.
    pub(crate) const fn cell(self, length: Span) -> i64 {
        self.0.div_euclid(length.0)
    }

    /// Start of the cell of this number.
    pub(crate) const fn of_cell(number: i64, length: Span) -> Self {
        Self(number.saturating_mul(length.0))
    }
}

/// Nanoseconds as seconds.
#[expect(clippy::cast_precision_loss, reason = "what is handled as seconds is far below 2⁵³ ns (104 days)")]
const fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

/// The saturated difference of two times that are too far apart, the first of which is `from`.
#[cold]
const fn ends_apart(from: i64) -> i64 {
    if from < 0 { i64::MIN } else { i64::MAX }
}

impl Add<Span> for Timestamp {
    type Output = Self;
    fn add(self, span: Span) -> Self {
        // A span is never negative: there is one end to stop at.
        Self(self.0.checked_add(span.0).unwrap_or(i64::MAX))
    }
}

impl Sub<Span> for Timestamp {
    type Output = Self;
    fn sub(self, span: Span) -> Self {
        Self(self.0.checked_sub(span.0).unwrap_or(i64::MIN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_hour_of_one_degree_per_hour_is_one_degree() {
        let rate = AngularRate::from_deg_per_h(1.0);
        assert!((Angle::from_rad(rate.as_rad_per_s() * 3600.0).as_deg() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn time_arithmetic_saturates_instead_of_wrapping() {
        let last = Timestamp::from_ns(i64::MAX);
        assert_eq!(last + Span::from_ms(1), last);
        assert_eq!(last.since(Timestamp::from_ns(i64::MIN)).as_ns(), i64::MAX);
        assert_eq!(Timestamp::from_ns(0).since(last), Span::ZERO);
        assert_eq!(Span::from_s(f64::NAN), Span::ZERO);
    }
}
