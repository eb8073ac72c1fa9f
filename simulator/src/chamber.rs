//! Thermal chamber: a programme of ramps and holds, as a chamber's operator writes it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Programme of a thermal chamber. After its last segment the chamber holds its temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Temperature at the start (°C, −100…200).
    #[schemars(range(min = -100.0, max = 200.0))]
    pub start_deg_c: f64,
    /// What the chamber does, in order.
    #[serde(default)]
    pub segments: Vec<Segment>,
}

/// One segment of a chamber programme.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Segment {
    /// Temperature changes linearly with time.
    Ramp {
        /// Temperature at the end of the ramp (°C, −100…200).
        #[schemars(range(min = -100.0, max = 200.0))]
        to_deg_c: f64,
        /// Rate of change, its sign given by the direction (°C/min, > 0).
        #[schemars(range(min = 1e-3, max = 1e3))]
        rate_deg_c_per_min: f64,
    },
    /// Temperature stays.
    Hold {
        /// For how long (min, ≥ 0).
        #[schemars(range(min = 0.0, max = 1e7))]
        minutes: f64,
    },
}

impl Profile {
    /// A chamber that never changes its temperature.
    #[must_use]
    pub fn constant(deg_c: f64) -> Self {
        Self { start_deg_c: deg_c, segments: Vec::new() }
    }

    /// The same programme with a ramp at its end.
    #[must_use]
    pub fn ramp(mut self, to_deg_c: f64, rate_deg_c_per_min: f64) -> Self {
        self.segments.push(Segment::Ramp { to_deg_c, rate_deg_c_per_min });
        self
    }

    /// The same programme with a hold at its end.
    #[must_use]
    pub fn hold(mut self, minutes: f64) -> Self {
        self.segments.push(Segment::Hold { minutes });
        self
    }

    /// Duration of the whole programme (s).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        Chamber::new(self).knots.last().map_or(0.0, |knot| knot.0)
    }
}

/// A programme that is ready to be read at any time.
#[derive(Debug, Clone, PartialEq)]
pub struct Chamber {
    /// (time in s, temperature in °C), times never falling; at least one.
    knots: Vec<(f64, f64)>,
}

impl Chamber {
    /// Lays the programme out on the time axis. A ramp with a rate that is not positive takes no time.
    #[must_use]
    pub fn new(profile: &Profile) -> Self {
        let (mut time_s, mut deg_c) = (0.0, profile.start_deg_c);
        let mut knots = vec![(time_s, deg_c)];
        for segment in &profile.segments {
            match *segment {
                Segment::Ramp { to_deg_c, rate_deg_c_per_min } => {
                    if rate_deg_c_per_min > 0.0 {
                        time_s += 60.0 * libm::fabs(to_deg_c - deg_c) / rate_deg_c_per_min;
                    }
                    deg_c = to_deg_c;
                }
                Segment::Hold { minutes } => time_s += 60.0 * minutes.max(0.0),
            }
            knots.push((time_s, deg_c));
        }
        Self { knots }
    }

    /// Temperature at `time_s` seconds from the start (°C).
    #[must_use]
    pub fn deg_c(&self, time_s: f64) -> f64 {
        let after = self.knots.partition_point(|knot| knot.0 <= time_s);
        match (after.checked_sub(1).and_then(|before| self.knots.get(before)), self.knots.get(after)) {
            (Some(&(t0, a)), Some(&(t1, b))) => a + (b - a) * (time_s - t0) / (t1 - t0),
            (Some(&(_, only)), None) | (None, Some(&(_, only))) => only,
            (None, None) => f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ramps_take_the_time_that_their_rate_says_and_holds_hold() {
        let profile = Profile::constant(20.0).ramp(-40.0, 1.0).hold(30.0).ramp(60.0, 2.0);
        let chamber = Chamber::new(&profile);
        let cases = [
            ("before the start", -5.0, 20.0),
            ("start", 0.0, 20.0),
            ("half way down", 1800.0, -10.0),
            ("bottom", 3600.0, -40.0),
            ("hold", 4000.0, -40.0),
            ("half way up", 3600.0 + 1800.0 + 1500.0, 10.0),
            ("end", 8400.0, 60.0),
            ("after the end", 1e9, 60.0),
        ];
        for (name, time_s, expected) in cases {
            assert!((chamber.deg_c(time_s) - expected).abs() < 1e-9, "{name}: {}", chamber.deg_c(time_s));
        }
        assert!((profile.duration_s() - 8400.0).abs() < 1e-9);
    }
}
