//! A run as short means of the rates along the gyros' own input axes, under the document that it starts from.

use std::collections::BTreeMap;

use isotherm_protocol::document::{Document, OrientationThermal};

use crate::document::Written;
use crate::error::Error;
use crate::fits::modes::cells::{along_input_axes, groups, temperature};
use crate::numbers::mean_if_any;
use crate::runs::table::{Rows, Table, Takes};
use crate::runs::{Run, Troubles};

/// Length of a bin (s).
pub const BIN_S: f64 = 0.5;
/// Means over a bin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bin {
    /// Its beginning since that of the run (s).
    pub begin_s: f64,
    /// Its length (s).
    pub length_s: f64,
    /// Time of its good ticks (s).
    pub good_s: f64,
    /// Mean rate of each gyro along its input axis (°/h), biases of the document subtracted.
    pub rate: Vec<f64>,
    /// Mean specific force along the case axes (m/s²); `None` without accelerometers.
    pub force: Option<[f64; 3]>,
    /// Whether ticks are missing before or in it.
    pub broken: bool,
    /// Whether a gyro was at its input limit.
    pub overrange: bool,
    /// Mean of the Earth's rate along the case axes (°/h); zero where it is not known.
    pub earth: [f64; 3],
}

/// A run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Binned {
    /// Its bins.
    pub bins: Vec<Bin>,
    /// Mean specific force over the first second (m/s²), for levelling; `None` without accelerometers.
    pub first_force: Option<[f64; 3]>,
    /// Mean temperature that the orientation follows (°C).
    pub axes_deg_c: Option<f64>,
    /// Mean temperatures of the channels (°C).
    pub channels_deg_c: BTreeMap<String, f64>,
    /// Mean temperature of all channels (°C).
    pub temperature_deg_c: Option<f64>,
    /// What the correction passed over.
    pub troubles: Troubles,
}

/// Bins a run.
///
/// # Errors
/// As [`Run::correct_together`].
pub fn binned(run: &Run, document: &Document) -> Result<Binned, Error> {
    let sensors = document.gyro.sensor.len();
    let mut whole = Binned::default();
    for group in groups(sensors) {
        let part = of_group(run, document, group)?;
        if whole.bins.is_empty() {
            whole = part;
            whole.bins.iter_mut().for_each(|bin| bin.rate.resize(sensors, f64::NAN));
        } else {
            for (bin, of) in whole.bins.iter_mut().zip(&part.bins) {
                group.into_iter().zip(&of.rate).for_each(|(sensor, rate)| bin.rate[sensor] = *rate);
            }
        }
    }
    Ok(whole)
}

fn of_group(run: &Run, document: &Document, group: [usize; 3]) -> Result<Binned, Error> {
    let loaded = Written::compiled(&along_input_axes(document, group))?;
    let rows = Rows { length_s: BIN_S, takes: Takes::Own, whole: None };
    let table = Table::of_rows(&run.of_gyros(group), &loaded, rows)?;
    let [good_s, force_s] = &table.taken_s;
    let at = |columns: &[Vec<f64>; 3], row: usize| columns.each_ref().map(|column| column[row]);
    let bin = |row: usize| Bin {
        begin_s: table.begin_s[row],
        length_s: table.length_s[row],
        good_s: good_s[row],
        rate: at(&table.rate_deg_per_h, row).to_vec(),
        force: (force_s[row] > 0.0).then(|| at(&table.force_m_per_s2, row)),
        broken: table.gap_before[row] || table.missed_s[row] > 0.0,
        overrange: table.overrange[row],
        earth: [0.0; 3],
    };
    let bins: Vec<Bin> = (0..table.len()).map(bin).collect();
    let of_axes = |thermal: &OrientationThermal| {
        let own = |row: usize| {
            temperature(thermal, |name| table.temperature_deg_c.get(name).map(|column| column[row]))
        };
        mean_if_any((0..table.len()).map(own))
    };
    let (mut velocity, mut felt_s) = ([0.0; 3], 0.0);
    for (bin, seconds) in bins.iter().zip(force_s) {
        let Some(force) = bin.force.filter(|_| felt_s < 1.0) else { continue };
        velocity.iter_mut().zip(force).for_each(|(sum, force)| *sum += force * seconds);
        felt_s += seconds;
    }
    Ok(Binned {
        first_force: (felt_s > 0.0).then(|| velocity.map(|sum| sum / felt_s)),
        axes_deg_c: document.gyro.orientation.thermal.as_ref().and_then(of_axes),
        channels_deg_c: table
            .temperature_deg_c
            .iter()
            .filter_map(|(name, column)| Some((name.clone(), mean_if_any(column.iter().copied())?)))
            .collect(),
        temperature_deg_c: mean_if_any(table.temperature_deg_c.values().flatten().copied()),
        troubles: table.troubles,
        bins,
    })
}
