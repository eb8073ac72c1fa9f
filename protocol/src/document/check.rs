//! What holds between keys: names that must be known, curves that must be sound, lists that must be of one length.
//!
//! The core checks most of this again when it compiles the parts; it is checked here first because here the key
//! and its line are known. A path that was reported is marked, so that the core does not report it once more.

mod output;

use std::collections::BTreeMap;

use isotherm_correction::curve::{Curve as CoreCurve, CurveError};
use isotherm_correction::orientation::ROW_NORM_TOLERANCE;
use isotherm_correction::thermal::Feature;

use super::curve::CurveForm;
use super::terms::StatedTerm;
use super::types::{AccelSensor, Document, Filter, GyroSensor, Orientation, SelfTest};
use isotherm_document::{Reader, element, join};

/// Checks everything between keys.
pub(super) fn check(r: &mut Reader<'_>, document: &Document) {
    let channels = channels(r, document);
    let channels = channels.as_deref();
    names(r, "gyro.sensor", document.gyro.sensor.iter().map(|sensor| sensor.name.as_str()));
    for (i, sensor) in document.gyro.sensor.iter().enumerate() {
        output::gyro(r, &element("gyro.sensor", i), document.gyro.output, sensor);
        gyro(r, &element("gyro.sensor", i), sensor, channels);
        if sensor.acceleration_sensitive_drift.is_some() && document.accel.is_none() {
            let path = join(&element("gyro.sensor", i), "acceleration_sensitive_drift");
            r.refuse(&path, "needs the specific force, but there is no [accel]: add it, or remove this");
        }
        terms(r, &element("gyro.sensor", i), &sensor.terms(), document.temperature.filter.as_ref());
        regressors(r, &element("gyro.sensor", i), &sensor.terms(), document, channels);
    }
    orientation(r, "gyro", &document.gyro.orientation, document.gyro.sensor.len(), channels);
    filter(r, document);
    if let Some(section) = &document.accel {
        names(r, "accel.sensor", section.sensor.iter().map(|sensor| sensor.name.as_str()));
        for (i, sensor) in section.sensor.iter().enumerate() {
            output::accel(r, &element("accel.sensor", i), section.output, sensor);
            accel(r, &element("accel.sensor", i), sensor, channels);
            terms(r, &element("accel.sensor", i), &sensor.terms(), document.temperature.filter.as_ref());
            regressors(r, &element("accel.sensor", i), &sensor.terms(), document, channels);
        }
        orientation(r, "accel", &section.orientation, section.sensor.len(), channels);
    }
    if document.mode_reversal.as_ref().is_some_and(|reversal| reversal.transition_s.is_some()) {
        let key = "mode_reversal.transition_ticks";
        if r.has(key) {
            r.refuse(key, "duplicates `transition_s`: give one of the two");
        }
    }
    if let Some(section) = &document.self_test {
        self_test_names(r, section);
    }
}

/// No two sensors of a kind have one name.
fn names<'n>(r: &mut Reader<'_>, sensors: &str, names: impl Iterator<Item = &'n str>) {
    let mut seen = BTreeMap::new();
    for (i, name) in names.enumerate() {
        if let Some(earlier) = seen.insert(name, i) {
            let path = join(&element(sensors, i), "name");
            r.refuse(&path, format!("is {name:?}, also the name of {sensors}[{earlier}]: names must differ"));
        }
    }
}

/// No two voltages or counters of the self-test have one name: both kinds come in on one topic.
fn self_test_names(r: &mut Reader<'_>, self_test: &SelfTest) {
    let voltages = self_test.voltage.iter().map(|voltage| voltage.name.as_str());
    let counters = self_test.counter.iter().map(|counter| counter.name.as_str());
    names(r, "self_test.voltage", voltages.clone());
    names(r, "self_test.counter", counters.clone());
    for (i, name) in counters.enumerate() {
        if let Some(earlier) = voltages.clone().position(|voltage| voltage == name) {
            let path = join(&element("self_test.counter", i), "name");
            let voltage = element("self_test.voltage", earlier);
            r.refuse(&path, format!("is {name:?}, also the name of {voltage}: names must differ"));
        }
    }
}

/// Names of the channels; `None` where one of them is not known.
fn channels<'d>(r: &Reader<'_>, document: &'d Document) -> Option<Vec<&'d str>> {
    let name = |i| join(&element("temperature.channel", i), "name");
    let channels = document.temperature.channel.iter().enumerate();
    let known = channels.map(|(i, channel)| (!r.is_marked(&name(i))).then_some(channel.name.as_str()));
    known
        .collect::<Option<Vec<_>>>()
        .filter(|_| !r.is_marked("temperature") && !r.is_marked("temperature.channel"))
}

/// A name that must be that of a channel.
fn channel(r: &mut Reader<'_>, path: &str, name: Option<&str>, channels: Option<&[&str]>) {
    if let (Some(name), Some(channels)) = (name, channels)
        && !channels.contains(&name)
    {
        let known = if channels.is_empty() { "none".into() } else { channels.join(", ") };
        r.refuse(path, format!("is {name:?}, not a temperature channel; the channels are: {known}"));
    }
}

fn gyro(r: &mut Reader<'_>, path: &str, sensor: &GyroSensor, channels: Option<&[&str]>) {
    channel(r, &join(path, "channel"), sensor.channel.as_deref(), channels);
    let over_rate = sensor.increment_weight_over_rate.as_deref();
    curve(r, &join(path, "increment_weight_over_rate"), over_rate);
    curve(
        r,
        &join_dotted(path, "servo.rest_frequency"),
        sensor.servo.as_ref().map(|servo| &*servo.rest_frequency),
    );
}

/// Curves of every term; both curves of a branched coefficient over one argument; lags no shorter than the grid's step.
fn terms(r: &mut Reader<'_>, path: &str, terms: &[StatedTerm<'_>], filter: Option<&Filter>) {
    for term in terms {
        let curves = term.curves();
        for (key, form) in &curves {
            curve(r, &format!("{path}.{key}"), Some(form));
        }
        if let [(run_up, first), (braking, second)] = &curves[..] {
            let path = |key: &str| format!("{path}.{key}");
            one_argument(r, (&path(run_up), first), (&path(braking), second));
        }
        let (Feature::Lag, Some(tau)) = (term.feature, term.parameter) else { continue };
        let Some(Filter { grid_step_s, .. }) = filter else { continue };
        if tau < *grid_step_s && !r.is_damaged("temperature.filter.grid_step_s") {
            let path = format!("{path}.{}.time_constant_s", term.key);
            r.refuse(
                &path,
                format!("is {tau} s, must be at least temperature.filter.grid_step_s, {grid_step_s} s"),
            );
        }
    }
}

/// Regressors of channels that there are; both of a difference in one unit.
fn regressors(
    r: &mut Reader<'_>,
    path: &str,
    terms: &[StatedTerm<'_>],
    document: &Document,
    temperatures: Option<&[&str]>,
) {
    let Some(temperatures) = temperatures.filter(|_| !r.is_marked("auxiliary")) else { return };
    let unit = |name: &str| {
        let auxiliary = document.auxiliary.iter().find(|channel| channel.name == name);
        let temperature = temperatures.contains(&name).then_some("°C");
        auxiliary.map(|channel| channel.unit.as_str()).or(temperature)
    };
    for (key, stated) in terms.iter().filter_map(|term| Some((&term.key, term.regressor?))) {
        let names = [("channel", Some(stated.channel)), ("minus", stated.minus)];
        for (part, name) in names.into_iter().filter_map(|(part, name)| Some((part, name?))) {
            if unit(name).is_none() {
                let all =
                    temperatures.iter().copied().chain(document.auxiliary.iter().map(|c| c.name.as_str()));
                let known = all.collect::<Vec<_>>().join(", ");
                let known = if known.is_empty() { "none" } else { &known };
                let path = format!("{path}.{key}.{part}");
                r.refuse(&path, format!("is {name:?}, not a channel; the channels are: {known}"));
            }
        }
        if let (Some(of), Some(other)) = (unit(stated.channel), stated.minus.and_then(unit))
            && of != other
        {
            let path = format!("{path}.{key}.minus");
            r.refuse(
                &path,
                format!("is in {other}, but the channel is in {of}: a difference needs one unit"),
            );
        }
    }
}

fn accel(r: &mut Reader<'_>, path: &str, sensor: &AccelSensor, channels: Option<&[&str]>) {
    channel(r, &join(path, "channel"), sensor.channel.as_deref(), channels);
    channel(r, &join(path, "board_channel"), sensor.board_channel.as_deref(), channels);
    curve(r, &join(path, "scale_factor"), Some(&*sensor.scale_factor));
    curve(r, &join(path, "board_ratio_error"), sensor.board_ratio_error.as_deref());
}

/// A curve that the core must be able to compile.
fn curve(r: &mut Reader<'_>, path: &str, curve: Option<&CurveForm>) {
    let Some(curve) = curve else { return };
    if r.is_damaged(path) {
        return;
    }
    let Err(error) = CoreCurve::new(&curve.to_parts(0.0)) else { return };
    let keys = curve.keys();
    let place = match error {
        CurveError::KnotsNotIncreasing { index, .. } => element(&join(path, &keys.knots), index),
        CurveError::EmptyRange { .. } => join(path, &keys.range),
        _ => path.to_owned(),
    };
    r.refuse(&place, error.to_string());
}

/// Both curves of a branched coefficient have one argument.
fn one_argument(
    r: &mut Reader<'_>,
    (run_up_path, run_up): (&str, &CurveForm),
    (braking_path, braking): (&str, &CurveForm),
) {
    if let (Some(first), Some(second)) = (run_up.argument(), braking.argument())
        && first != second
        && !r.is_damaged(run_up_path)
    {
        let (first, second) = (first.symbol(), second.symbol());
        r.refuse(
            braking_path,
            format!("is over {second}, but run_up is over {first}: both must have the same argument"),
        );
    }
}

/// The filter and its dead band are there where something needs them.
fn filter(r: &mut Reader<'_>, document: &Document) {
    const KEY: &str = "branch_dead_band_deg_c2_per_s3";
    let Some(filter) = &document.temperature.filter else {
        let needed_by = match (&document.temperature.channel[..], &document.auxiliary[..]) {
            ([], []) => return,
            ([], _) => "auxiliary[0]",
            _ => "temperature.channel[0]",
        };
        let message = format!("is missing: {needed_by} needs it, add `[temperature.filter]`");
        r.refuse("temperature.filter", message);
        return;
    };
    let mut sensors = document.gyro.sensor.iter();
    let branched = |sensor: &GyroSensor| sensor.terms().iter().any(|term| term.curves().len() > 1);
    let Some(i) = sensors.position(branched) else { return };
    if filter.branch_dead_band_deg_c2_per_s3.is_none() {
        let why = "run-up and braking curves of";
        r.refuse(
            &join("temperature.filter", KEY),
            format!("is missing: the {why} gyro.sensor[{i}] need it, add `{KEY}`"),
        );
    }
}

/// Rows, weights and slopes for each sensor; rows of norm one; known channels.
fn orientation<P>(
    r: &mut Reader<'_>,
    section: &str,
    orientation: &Orientation<P>,
    sensors: usize,
    channels: Option<&[&str]>,
) {
    let path = join(section, "orientation");
    let thermal = orientation.thermal.as_ref();
    for (key, count) in [
        ("rows", Some(orientation.rows.len())),
        ("weights", orientation.weights.as_ref().map(Vec::len)),
        ("thermal.slopes_arcsec_per_deg_c", thermal.map(|thermal| thermal.slopes_arcsec_per_deg_c.len())),
    ] {
        let path = join_dotted(&path, key);
        if count.is_some_and(|count| count != sensors) && !r.is_marked(&join(section, "sensor")) {
            let count = count.unwrap_or_default();
            r.refuse(
                &path,
                format!("has {count} entries, must have {sensors}: one for each {section}.sensor"),
            );
        }
    }
    for (i, row) in orientation.rows.iter().enumerate() {
        let norm = row.iter().map(|c| c * c).sum::<f64>().sqrt();
        if (norm - 1.0).abs() > ROW_NORM_TOLERANCE {
            let path = element(&join(&path, "rows"), i);
            r.refuse(
                &path,
                format!("has norm {norm:.6}, must be 1 within {ROW_NORM_TOLERANCE}: a unit vector"),
            );
        }
    }
    for (i, name) in thermal.iter().flat_map(|thermal| &thermal.channels).enumerate() {
        channel(r, &element(&join_dotted(&path, "thermal.channels"), i), Some(name), channels);
    }
}

/// Path of a key of a table within a table.
fn join_dotted(path: &str, keys: &str) -> String {
    keys.split('.').fold(path.to_owned(), |path, key| join(&path, key))
}
