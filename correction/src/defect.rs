//! What can be wrong with stated numbers, and where.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use thiserror::Error;

use crate::curve::{Curve, CurveParts};
use crate::orientation::{CONDITION_LIMIT, ROW_NORM_TOLERANCE, WEIGHT_RATIO_LIMIT};
use crate::reversal::MIN_ADAPTIVE_READINGS;
use crate::sample::ChannelName;
use crate::stated::{AtDegC, Shown};

/// Largest finite magnitude that a coefficient may have: far beyond any instrument, safe to multiply.
pub(crate) const HUGE: f64 = 1e100;

/// One thing that is wrong with a set of parts.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{path}: {kind}")]
pub struct Defect {
    /// Path of its key in a calibration document, but for the unit that keys end with: `gyro.sensor[1].static_bias.knots[2]`.
    /// Of a part that is looked at by itself, the path within the part.
    pub path: String,
    /// What.
    pub kind: DefectKind,
}

/// Kinds of wrongness.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DefectKind {
    /// A time that the filter's grid cannot resolve.
    #[error("is {} s, must be at least temperature.filter.grid_step_s, {} s", Shown(*time_s), Shown(*grid_step_s))]
    BelowGridStep {
        /// The time (s).
        time_s: f64,
        /// Step of the grid (s).
        grid_step_s: f64,
    },
    /// Not a finite number, or outside its limits.
    #[error("is {}, must be {} to {}", Shown(*value), Shown(*low), Shown(*high))]
    OutOfRange {
        /// The value.
        value: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// Too few or too many.
    #[error("has {count} entries, must have {low} to {high}")]
    Count {
        /// How many there are.
        count: usize,
        /// Fewest allowed.
        low: usize,
        /// Most allowed.
        high: usize,
    },
    /// A list has neither one entry per sensor nor none.
    #[error("has {got} entries, must have {sensors}: one for each sensor")]
    ListCount {
        /// Entries stated.
        got: usize,
        /// Sensors that there are.
        sensors: usize,
    },
    /// Lower limit at or above the upper one.
    #[error("runs from {} to {}: the first must be below the second", Shown(*low), Shown(*high))]
    InvertedRange {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// An index that names no channel.
    #[error("names channel {index}, but there are {channels}")]
    NoSuchChannel {
        /// The index.
        index: usize,
        /// How many channels there are.
        channels: usize,
    },
    /// Two things of one name.
    #[error("is also the name of {of}[{other}]: names must differ")]
    DuplicateName {
        /// What list the earlier one is in.
        of: &'static str,
        /// Its index.
        other: usize,
    },
    /// Correlations that no numbers can have.
    #[error(
        "is not a correlation matrix of these σ: it must be symmetric, with 1 in its diagonal and no negative \
        variance"
    )]
    NoCovariance,
    /// A name without a letter.
    #[error("is empty, must be a name")]
    NoName,
    /// Zero where a divisor or a weight is needed.
    #[error("is zero {}, must not be zero anywhere in its range", AtDegC(*.at))]
    Zero {
        /// Argument at which it is zero.
        at: f64,
    },
    /// A term that works on counts, for gyros with another output.
    #[error("needs gyros with output = \"counts\"")]
    NeedsCounts,
    /// Needed because another part is there.
    #[error("is missing: {needed_by} needs it")]
    Missing {
        /// What needs it.
        needed_by: &'static str,
    },
    /// A knot's argument is not above the one before it.
    #[error("knot {index} is at {got}, not above the one before it at {previous}")]
    KnotsNotIncreasing {
        /// Index of the offending knot, from 0.
        index: usize,
        /// Argument of the knot before it.
        previous: f64,
        /// Argument of the knot.
        got: f64,
    },
    /// Somewhere in its range a curve is too large for a number of 64 bits.
    #[error("values near argument {near} overflow")]
    Overflow {
        /// Where: first argument of the offending stretch.
        near: f64,
    },
    /// A row of `C_0` is not a unit vector.
    #[error("has norm {norm:.6}, must be 1 within {ROW_NORM_TOLERANCE}: a unit vector")]
    RowNorm {
        /// Its norm.
        norm: f64,
    },
    /// The axes are too close to one plane at the reference or an end of the range.
    #[error("condition number {got:.1} {}; at most {CONDITION_LIMIT} is allowed", AtDegC(*.temperature_deg_c))]
    Condition {
        /// The temperature (°C).
        temperature_deg_c: f64,
        /// Condition number there.
        got: f64,
    },
    /// The axes come too close to one plane at a temperature within the range.
    #[error(
        "C(T) has condition number {got:.1} at {temperature_deg_c:.1} °C, within range_deg_c; at most {CONDITION_LIMIT} is \
        allowed: check sign and unit of the slopes, or narrow range_deg_c"
    )]
    ConditionInside {
        /// The temperature (°C).
        temperature_deg_c: f64,
        /// Condition number there.
        got: f64,
    },
    /// The weights of sensors differ beyond what can be inverted.
    #[error("largest weight is {got} times the smallest; at most {WEIGHT_RATIO_LIMIT} is allowed")]
    WeightRatio {
        /// Largest weight over smallest.
        got: f64,
    },
    /// Too few readings about a mode switch to tell noise from motion.
    #[error(
        "\"adaptive\" has {readings} readings before and after a switch to choose from, at least {MIN_ADAPTIVE_READINGS} are \
        needed: raise fit_readings_before and fit_readings_after"
    )]
    AdaptiveNeedsReadings {
        /// Readings on both sides.
        readings: u8,
    },
    /// A polynomial has more coefficients than readings to fit them to.
    #[error("is {got} with {readings} readings, must be below their number")]
    DegreeNeedsReadings {
        /// The degree.
        got: u8,
        /// Readings of that fit.
        readings: u8,
    },
}

/// Collects defects.
#[derive(Debug, Default)]
pub(crate) struct Checker {
    pub(crate) defects: Vec<Defect>,
    table: String,
}

impl Checker {
    /// What is looked at from now on stands in this table.
    pub(crate) fn at(&mut self, table: &str) -> &mut Self {
        table.clone_into(&mut self.table);
        self
    }

    /// Likewise in an element of a list of tables.
    pub(crate) fn element(&mut self, list: &str, index: usize) -> &mut Self {
        self.at(&format!("{list}[{index}]"))
    }

    pub(crate) fn push(&mut self, field: &str, kind: DefectKind) {
        self.defects.push(Defect { path: joined(&self.table, field), kind });
    }

    pub(crate) fn within(&mut self, field: &str, value: f64, low: f64, high: f64) {
        if !(low..=high).contains(&value) {
            self.push(field, DefectKind::OutOfRange { value, low, high });
        }
    }

    pub(crate) fn positive(&mut self, field: &str, value: f64) {
        self.within(field, value, f64::MIN_POSITIVE, HUGE);
    }

    /// A number above zero, however small or large.
    pub(crate) fn above_zero(&mut self, field: &str, value: f64) {
        self.within(field, value, f64::from_bits(1), f64::MAX);
    }

    /// A number, whatever it is.
    pub(crate) fn finite(&mut self, field: &str, value: f64) {
        self.within(field, value, f64::MIN, f64::MAX);
    }

    /// Numbers of the rows of a list.
    pub(crate) fn finite_rows<const N: usize>(&mut self, list: &str, rows: &[[f64; N]]) {
        for (index, row) in rows.iter().enumerate() {
            if let Some(broken) = row.iter().find(|number| !number.is_finite()) {
                self.finite(&format!("{list}[{index}]"), *broken);
            }
        }
    }

    pub(crate) fn count(&mut self, field: &str, count: usize, low: usize, high: usize) {
        if !(low..=high).contains(&count) {
            self.push(field, DefectKind::Count { count, low, high });
        }
    }

    /// Coefficients of a polynomial, at least one of them.
    pub(crate) fn coefficients(&mut self, field: &str, coefficients: &[f64], most: usize) {
        self.count(field, coefficients.len(), 1, most);
        for &coefficient in coefficients {
            self.within(field, coefficient, -HUGE, HUGE);
        }
    }

    /// A range that runs upwards and lies within limits.
    pub(crate) fn range(&mut self, field: &str, [from, to]: [f64; 2], low: f64, high: f64) {
        if from >= to {
            self.push(field, DefectKind::InvertedRange { low: from, high: to });
        }
        for end in [from, to] {
            self.within(field, end, low, high);
        }
    }

    /// A name that none of the earlier things has; each of these with what it is, its index and its name.
    pub(crate) fn unique(
        &mut self,
        name: ChannelName,
        mut earlier: impl Iterator<Item = (&'static str, usize, ChannelName)>,
    ) {
        if let Some((of, other, _)) = earlier.find(|(.., taken)| *taken == name) {
            self.push("name", DefectKind::DuplicateName { of, other });
        }
    }

    /// A curve, compiled.
    pub(crate) fn curve(&mut self, field: &str, parts: &CurveParts) -> Option<Curve> {
        self.compiled(field, Curve::new(parts).map_err(|defect| [defect]))
    }

    /// What was compiled; its defects otherwise.
    pub(crate) fn compiled<T>(
        &mut self,
        field: &str,
        compiled: Result<T, impl IntoIterator<Item = Defect>>,
    ) -> Option<T> {
        let defects = compiled.map_err(|defects| {
            for Defect { path, kind } in defects {
                self.push(&joined(field, &path), kind);
            }
        });
        defects.ok()
    }

    /// What was found first, where anything is wrong.
    pub(crate) fn first(&mut self) -> Result<(), Defect> {
        if self.defects.is_empty() { Ok(()) } else { Err(self.defects.swap_remove(0)) }
    }

    /// What was made, where nothing is wrong.
    pub(crate) fn finish<T>(self, made: T) -> Result<T, Vec<Defect>> {
        if self.defects.is_empty() { Ok(made) } else { Err(self.defects) }
    }
}

fn joined(table: &str, field: &str) -> String {
    match (table, field) {
        ("", path) | (path, "") => path.to_owned(),
        _ => format!("{table}.{field}"),
    }
}
