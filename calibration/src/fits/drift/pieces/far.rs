//! Readings far beyond the noise: single ones, or a time in which the unit was moved.

use crate::fits::drift::columns::Columns;
use crate::report::{counted, short};

/// Readings farther than this from the middle one (robust standard deviations).
const FAR: f64 = 50.0;
/// Far readings in a row that are no longer single ones.
pub const SINGLE: usize = 3;

/// Which readings of a column are far beyond its noise.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Far {
    /// Their ticks.
    ticks: Vec<usize>,
    /// Whether never more than a few follow each other.
    are_single: bool,
}

impl Far {
    /// Of a column with its middle and the standard deviation of its noise; none where that is zero.
    pub(super) fn of(column: &[f64], (middle, sigma): (f64, f64)) -> Self {
        let is_far = |reading: &f64| (reading - middle).abs() > FAR * sigma;
        let looked = column.iter().enumerate().filter(|(_, reading)| sigma > 0.0 && is_far(reading));
        let ticks: Vec<usize> = looked.map(|(tick, _)| tick).collect();
        let runs = ticks.chunk_by(|a, b| a + 1 == *b).map(<[usize]>::len);
        Self { are_single: runs.max().unwrap_or(0) <= SINGLE, ticks }
    }

    /// The ticks of single ones; none where the unit was moved.
    pub(super) fn single(self) -> Vec<usize> {
        if self.are_single { self.ticks } else { Vec::new() }
    }

    /// What is to be said of them.
    pub(super) fn words(&self, called: &str, columns: &Columns, column: &[f64]) -> Option<String> {
        let (first, last) = (*self.ticks.first()?, *self.ticks.last()?);
        let count = self.ticks.len();
        let measure = columns.kind.measure();
        let value = short(column.get(first).copied().unwrap_or_default());
        let (at, until) = (columns.since_s(first), columns.since_s(last));
        let wide = if columns.corrected { " on all axes, because the correction couples them" } else { "" };
        Some(if self.are_single {
            format!(
                "warning: {called}: {} far beyond the noise (more than {FAR} standard deviations), the first at \
                 {at:.2} s: {value} {measure}; left out{wide}: find their cause",
                counted(count, "single reading is", "single readings are")
            )
        } else {
            format!(
                "warning: {called}: {count} readings between {at:.2} s and {until:.2} s are far beyond the noise \
                 (more than {FAR} standard deviations), the first is {value} {measure}: did the unit turn, or was \
                 it knocked? Cut the log to the part at rest with --start and --duration"
            )
        })
    }
}

/// Makes no numbers of the readings at these ticks, for the sensor they were found in: see [`Far::words`].
pub(super) fn leave_out(columns: &mut Columns, ticks: &[Vec<usize>]) {
    let everywhere = columns.corrected;
    for (index, column) in columns.values.iter_mut().enumerate() {
        let found = ticks.iter().enumerate().filter(|(of, _)| everywhere || *of == index);
        for tick in found.flat_map(|(_, ticks)| ticks) {
            if let Some(reading) = column.get_mut(*tick) {
                *reading = f64::NAN;
            }
        }
    }
}
