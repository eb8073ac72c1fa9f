//! What the core cannot see, because it knows no names, units or keys: what is called what, and which keys go together.

mod output;

use std::collections::BTreeMap;

use super::curve::Curve;
use super::terms::{KeyedTerm, Regressor};
use super::types::{Document, Sensor};
use isotherm_document::{Reader, element, join};

/// Checks everything between keys.
pub(super) fn check(r: &mut Reader<'_>, document: &Document) {
    let sensors = document.sensors();
    names(r, &sensors);
    for (i, sensor) in document.gyro.sensor.iter().enumerate() {
        output::gyro(r, &element("gyro.sensor", i), document.gyro.output, sensor);
    }
    if let Some(accel) = &document.accel {
        for (i, sensor) in accel.sensor.iter().enumerate() {
            output::accel(r, &element("accel.sensor", i), accel.output, sensor);
        }
    }
    channels(r, document);
    for keyed in sensors.iter().flat_map(|sensor| &sensor.terms) {
        term(r, keyed, document);
    }
    filter(r, document, &sensors);
    if document.mode_reversal.as_ref().is_some_and(|reversal| reversal.transition_s.is_some()) {
        let key = "mode_reversal.transition_ticks";
        if r.has(key) {
            r.refuse(key, "duplicates `transition_s`: give one of the two");
        }
    }
}

/// No two sensors of a kind have one name.
fn names(r: &mut Reader<'_>, sensors: &[Sensor<'_>]) {
    let mut seen = BTreeMap::new();
    for Sensor { path, name, .. } in sensors {
        let kind = path.split_once('[').map(|(kind, _)| kind);
        if let Some(earlier) = seen.insert((kind, name), path) {
            let why = format!("is {name:?}, also the name of {earlier}: names must differ");
            r.refuse(&join(path, "name"), why);
        }
    }
}

/// Whatever names a channel names one that there is, as far as all of them are known.
fn channels(r: &mut Reader<'_>, document: &Document) {
    let temperatures = &document.temperature.channel;
    let is_known = |i| !r.is_marked(&join(&element("temperature.channel", i), "name"));
    if ["temperature", "temperature.channel"].iter().any(|path| r.is_marked(path))
        || !(0..temperatures.len()).all(is_known)
    {
        return;
    }
    let temperatures = temperatures.iter().map(|channel| channel.name.as_str());
    let auxiliaries = document.auxiliary.iter().map(|channel| channel.name.as_str());
    for (path, name, any) in document.channels_named() {
        let known: Vec<_> = temperatures.clone().chain(auxiliaries.clone().filter(|_| any)).collect();
        if known.contains(&name) || any && r.is_marked("auxiliary") {
            continue;
        }
        let known = if known.is_empty() { "none".into() } else { known.join(", ") };
        let what = if any { "a channel" } else { "a temperature channel" };
        r.refuse(&path, format!("is {name:?}, not {what}; the channels are: {known}"));
    }
}

/// Both curves of a branched coefficient over one argument; forces that there are; differences of one unit.
fn term(r: &mut Reader<'_>, keyed: &KeyedTerm<'_>, document: &Document) {
    if let [run_up, braking] = &keyed.curves().collect::<Vec<_>>()[..] {
        one_argument(r, run_up, braking);
    }
    if keyed.term.feature.is_force() && document.accel.is_none() {
        let table = keyed.path.rsplit_once('.').map_or("", |(table, _)| table);
        r.refuse(table, "needs the specific force, but there is no [accel]: add it, or remove this");
    }
    let Some(Regressor { channel, minus: Some(minus), .. }) = &keyed.stated.regressor else { return };
    let unit = |name: &String| {
        let auxiliary = document.auxiliary.iter().find(|channel| channel.name == *name);
        let is_temperature = || document.temperature.channel.iter().any(|channel| channel.name == *name);
        auxiliary.map(|channel| channel.unit.as_str()).or_else(|| is_temperature().then_some("°C"))
    };
    if let (Some(of), Some(other)) = (unit(channel), unit(minus))
        && of != other
    {
        let message = format!("is in {other}, but the channel is in {of}: a difference needs one unit");
        r.refuse(&join(&keyed.path, "minus"), message);
    }
}

/// Both curves of a branched coefficient have one argument.
fn one_argument(
    r: &mut Reader<'_>,
    (run_up_path, run_up): &(String, &Curve),
    (braking_path, braking): &(String, &Curve),
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
fn filter(r: &mut Reader<'_>, document: &Document, sensors: &[Sensor<'_>]) {
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
    let branched = |keyed: &KeyedTerm<'_>| keyed.stated.braking.is_some();
    let Some(sensor) = sensors.iter().find(|sensor| sensor.terms.iter().any(branched)) else { return };
    if filter.branch_dead_band_deg_c2_per_s3.is_none() {
        let message =
            format!("is missing: the run-up and braking curves of {} need it, add `{KEY}`", sensor.path);
        r.refuse(&join("temperature.filter", KEY), message);
    }
}
