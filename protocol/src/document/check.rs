//! What the core cannot see, because it knows no names, units or keys: what is called what, and which keys go together.

mod output;

use std::collections::BTreeMap;

use super::curve::Curve;
use super::terms::{Coefficient, KeyedTerm, Regressor};
use super::types::{Document, Orientation, Sensor};
use isotherm_document::{Reader, element, join};

/// Checks everything between keys.
pub(super) fn check(r: &mut Reader<'_>, document: &Document) {
    let channels = channels(r, document);
    let channels = channels.as_deref();
    names(r, "gyro.sensor", document.gyro.sensor.iter().map(|sensor| sensor.name.as_str()));
    for (i, sensor) in document.gyro.sensor.iter().enumerate() {
        output::gyro(r, &element("gyro.sensor", i), document.gyro.output, sensor);
    }
    orientation(r, "gyro.orientation", &document.gyro.orientation, channels);
    if let Some(section) = &document.accel {
        names(r, "accel.sensor", section.sensor.iter().map(|sensor| sensor.name.as_str()));
        for (i, sensor) in section.sensor.iter().enumerate() {
            output::accel(r, &element("accel.sensor", i), section.output, sensor);
            let board = sensor.board_channel.as_deref();
            channel(r, &element("accel.sensor", i), "board_channel", board, channels);
        }
        orientation(r, "accel.orientation", &section.orientation, channels);
    }
    let sensors = document.sensors();
    for sensor in &sensors {
        channel(r, &sensor.path, "channel", sensor.channel, channels);
        terms(r, sensor, document, channels);
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
fn names<'n>(r: &mut Reader<'_>, sensors: &str, names: impl Iterator<Item = &'n str>) {
    let mut seen = BTreeMap::new();
    for (i, name) in names.enumerate() {
        if let Some(earlier) = seen.insert(name, i) {
            let path = join(&element(sensors, i), "name");
            r.refuse(&path, format!("is {name:?}, also the name of {sensors}[{earlier}]: names must differ"));
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

/// A key of a table that must name a channel.
fn channel(r: &mut Reader<'_>, table: &str, key: &str, name: Option<&str>, channels: Option<&[&str]>) {
    if let (Some(name), Some(channels)) = (name, channels)
        && !channels.contains(&name)
    {
        let known = if channels.is_empty() { "none".into() } else { channels.join(", ") };
        let message = format!("is {name:?}, not a temperature channel; the channels are: {known}");
        r.refuse(&format!("{table}.{key}"), message);
    }
}

/// Both curves of a branched coefficient over one argument; forces and channels that there are.
fn terms(r: &mut Reader<'_>, sensor: &Sensor<'_>, document: &Document, temperatures: Option<&[&str]>) {
    for keyed in &sensor.terms {
        if let [run_up, braking] = &keyed.curves().collect::<Vec<_>>()[..] {
            one_argument(r, run_up, braking);
        }
        if keyed.term.feature.is_force() && document.accel.is_none() {
            let table = keyed.path.rsplit_once('.').map_or("", |(table, _)| table);
            r.refuse(table, "needs the specific force, but there is no [accel]: add it, or remove this");
        }
        if let Some(regressor) = &keyed.stated.regressor {
            check_regressor(r, &keyed.path, regressor, document, temperatures);
        }
    }
}

/// A regressor of channels that there are; both of a difference in one unit.
fn check_regressor(
    r: &mut Reader<'_>,
    path: &str,
    Regressor { channel, minus, .. }: &Regressor,
    document: &Document,
    temperatures: Option<&[&str]>,
) {
    let Some(temperatures) = temperatures.filter(|_| !r.is_marked("auxiliary")) else { return };
    let unit = |name: &str| {
        let auxiliary = document.auxiliary.iter().find(|channel| channel.name == name);
        let temperature = temperatures.contains(&name).then_some("°C");
        auxiliary.map(|channel| channel.unit.as_str()).or(temperature)
    };
    for (part, name) in
        std::iter::once(("channel", channel)).chain(minus.iter().map(|minus| ("minus", minus)))
    {
        if unit(name).is_none() {
            let all = temperatures.iter().copied().chain(document.auxiliary.iter().map(|c| c.name.as_str()));
            let known = all.collect::<Vec<_>>().join(", ");
            let known = if known.is_empty() { "none" } else { &known };
            let message = format!("is {name:?}, not a channel; the channels are: {known}");
            r.refuse(&join(path, part), message);
        }
    }
    if let (Some(of), Some(other)) = (unit(channel), minus.as_deref().and_then(unit))
        && of != other
    {
        let message = format!("is in {other}, but the channel is in {of}: a difference needs one unit");
        r.refuse(&join(path, "minus"), message);
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
    let branched = |keyed: &KeyedTerm<'_>| matches!(keyed.stated.coefficient, Coefficient::Branched { .. });
    let Some(sensor) = sensors.iter().find(|sensor| sensor.terms.iter().any(branched)) else { return };
    if filter.branch_dead_band_deg_c2_per_s3.is_none() {
        let message =
            format!("is missing: the run-up and braking curves of {} need it, add `{KEY}`", sensor.path);
        r.refuse(&join("temperature.filter", KEY), message);
    }
}

/// Channels that an orientation follows.
fn orientation<P>(r: &mut Reader<'_>, path: &str, orientation: &Orientation<P>, channels: Option<&[&str]>) {
    for (i, name) in orientation.thermal.iter().flat_map(|thermal| &thermal.channels).enumerate() {
        channel(r, path, &element("thermal.channels", i), Some(name), channels);
    }
}
