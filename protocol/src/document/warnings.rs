//! What is doubtful about a document that is valid.

use std::collections::BTreeSet;

use isotherm_correction::thermal::{Feature, TermForm};

use super::curve::Curve;
use super::measure::Argument;
use super::terms::KeyedTerm;
use super::types::{Document, Filter, Orientation, Sensor};
use isotherm_document::Problem;
use isotherm_document::{Reader, element, join};

/// Everything doubtful, in the order of the text.
pub(super) fn warnings(r: &Reader<'_>, document: &Document) -> Vec<Problem> {
    let mut found = Vec::new();
    if let Some(filter) = &document.temperature.filter {
        grid(r, filter, &mut found);
    }
    unused_channels(r, document, &mut found);
    for sensor in document.sensors() {
        for (path, curve) in sensor.terms.iter().flat_map(KeyedTerm::curves) {
            out_of_range(r, document, (&path, curve), sensor.channel, &mut found);
        }
        without_channel(r, &sensor, &mut found);
    }
    for (i, sensor) in document.gyro.sensor.iter().enumerate() {
        if sensor.terms.has(Feature::LasingMode) && document.mode_reversal.is_none() {
            let why = "changes its sign with the lasing mode, but there is no [mode_reversal]: switches are not bridged";
            found.push(r.warning(&format!("gyro.sensor[{i}].magnetic_bias"), why));
        }
    }
    parity(r, "gyro.orientation.parity", &document.gyro.orientation, &mut found);
    if let Some(accel) = &document.accel {
        for (i, sensor) in accel.sensor.iter().enumerate() {
            let board = sensor.board_channel.as_deref();
            let curves = [
                ("scale_factor", sensor.channel.as_deref(), Some(&sensor.scale_factor)),
                ("board_ratio_error", board, sensor.board_ratio_error.as_ref()),
            ];
            for (key, channel, curve) in curves {
                let Some(curve) = curve else { continue };
                out_of_range(r, document, (&format!("accel.sensor[{i}].{key}"), curve), channel, &mut found);
            }
        }
        parity(r, "accel.orientation.parity", &accel.orientation, &mut found);
    }
    found.sort_by_key(|problem| (problem.line, problem.column));
    found
}

/// Lengths that are no whole number of grid steps are rounded.
fn grid(r: &Reader<'_>, filter: &Filter, found: &mut Vec<Problem>) {
    for (key, length) in
        [("smoothing_s", filter.smoothing_s), ("derivative_step_s", filter.derivative_step_s)]
    {
        let steps = (length / filter.grid_step_s).round().max(1.0);
        let rounded = steps * filter.grid_step_s;
        if length > 0.0 && (rounded - length).abs() > 1e-6 * filter.grid_step_s {
            let message = format!("is {length} s, not a whole number of grid steps: {rounded} s is used");
            found.push(r.warning(&join("temperature.filter", key), message));
        }
    }
}

/// A channel that nothing follows.
fn unused_channels(r: &Reader<'_>, document: &Document, found: &mut Vec<Problem>) {
    let used: BTreeSet<&str> = document.channels_named().into_iter().map(|(_, name, _)| name).collect();
    let temperatures = document.temperature.channel.iter().map(|channel| &channel.name).enumerate();
    let temperatures = temperatures.map(|(i, name)| (element("temperature.channel", i), name));
    let auxiliaries = document.auxiliary.iter().map(|channel| &channel.name).enumerate();
    let auxiliaries = auxiliaries.map(|(i, name)| (element("auxiliary", i), name));
    for (path, name) in temperatures.chain(auxiliaries).filter(|(_, name)| !used.contains(name.as_str())) {
        let message = format!("is {name:?}, followed by no sensor and no orientation");
        found.push(r.warning(&join(&path, "name"), message));
    }
}

/// Terms that need a temperature that moves.
fn without_channel(r: &Reader<'_>, sensor: &Sensor<'_>, found: &mut Vec<Problem>) {
    for KeyedTerm { term, path, .. } in sensor.terms.iter().filter(|_| sensor.channel.is_none()) {
        if matches!(term.form, TermForm::Branches | TermForm::Each(_)) {
            let why = "has no effect: the sensor follows no temperature channel";
            found.push(r.warning(path, why));
        }
    }
}

/// A parity check that cannot check anything.
fn parity<P>(r: &Reader<'_>, path: &str, orientation: &Orientation<P>, found: &mut Vec<Problem>) {
    if orientation.parity.is_some() && orientation.rows.len() <= 3 {
        found.push(r.warning(path, "has no effect: three sensors leave no parity residual"));
    }
}

/// A curve that is fitted beyond the physical range of the channel that it follows.
fn out_of_range(
    r: &Reader<'_>,
    document: &Document,
    (path, curve): (&str, &Curve),
    channel: Option<&str>,
    found: &mut Vec<Problem>,
) {
    let range = curve.range().filter(|_| curve.argument() == Some(Argument::DegC));
    let followed = document.temperature.channel.iter().find(|of| Some(of.name.as_str()) == channel);
    let (Some([low, high]), Some(channel)) = (range, followed) else { return };
    let [coldest, hottest] = channel.range_deg_c;
    if low < coldest || high > hottest {
        let message = format!(
            "is fitted from {low} to {high} °C, but channel {:?} rejects readings outside {coldest} to {hottest} °C",
            channel.name
        );
        found.push(r.warning(path, message));
    }
}
