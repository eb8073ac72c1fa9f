//! Drift in running mode: what a navigator gets over whole reversal periods, bridged ticks and all.

use std::slice;
use std::sync::Arc;

use isotherm_protocol::document::Sample;

use crate::axes::AXES;
use crate::document::written::Written;
use crate::error::Error;
use crate::report::Curve;
use crate::report::curve::channel_of;
use crate::runs::table::{Rows, Table, Takes};
use crate::runs::{Run, Watch};

/// Share of a window whose ticks must count.
const WHOLE: f64 = 1.0 - 1e-9;

/// A run before and after, by case axis, less the Earth rate (°/h); where that is not known, each less its own mean.
///
/// # Errors
/// As [`Run::correct`].
pub fn judged<W: Watch>(
    run: &Run,
    sample: Sample,
    [before, after]: [&Written; 2],
    earth: Option<[f64; 3]>,
    window_s: f64,
    mut watch: impl FnMut() -> W,
) -> Result<Vec<Curve>, Error> {
    let rows = Rows { length_s: window_s, takes: Takes::Bridged };
    // What was bridged may be another tick under another document.
    let mut of = |written: &Written| -> Result<Table, Error> {
        let mut tables = Table::together(run, slice::from_ref(&written.loaded), rows, watch())?;
        Ok(tables.pop().unwrap_or_default().whole(WHOLE))
    };
    let (before_of, after_of) = (of(before)?, of(after)?);
    let channels = [0, 1, 2].map(|axis| channel_of(&after.document, true, axis));
    let temperature = |axis: usize| {
        let own =
            channels.get(axis).and_then(Option::as_ref).and_then(|name| after_of.temperature_deg_c.get(name));
        own.cloned().unwrap_or_else(|| vec![f64::NAN; after_of.len()])
    };
    let time_s: Arc<[f64]> = after_of.time_s.as_slice().into();
    let less = |values: &[f64], axis: usize| -> Vec<f64> {
        let truth = earth.map_or_else(|| crate::size::Size::of(values).mean, |earth| earth[axis]);
        values.iter().map(|value| value - truth).collect()
    };
    let curve = |(axis, name): (usize, &str)| Curve {
        of: format!("gyro {name}"),
        measure: "°/h".to_owned(),
        run: run.name.clone(),
        sample,
        window_s,
        time_s: Arc::clone(&time_s),
        temperature_deg_c: temperature(axis),
        before: less(before_of.rate(axis), axis),
        after: less(after_of.rate(axis), axis),
    };
    let with_values = |curve: &Curve| curve.after.iter().any(|value| value.is_finite());
    Ok(AXES.into_iter().enumerate().map(curve).filter(with_values).collect())
}
