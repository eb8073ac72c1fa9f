//! The parts of a mapping that say what the columns hold.

use std::f64::consts::PI;

use isotherm_correction::sample::{ChannelName, MAX_CHANNEL_NAME, MAX_SENSORS, OutputKind};
use isotherm_correction::units::{Angle, AngularRate, SpecificForce};

use super::layout::TIME_UNITS;
use super::section::{Item, Section};
use super::{
    Column, Conversion, GyroMapping, ModeMapping, SensorMapping, SwitchMapping, TemperatureMapping,
    TickMapping, TimeColumn,
};

/// A unit of measure: its word, the factor to what the core takes, and whether it is an increment over the tick.
type Unit = (&'static str, (f64, bool));

/// Units of a gyro's mean output.
const GYRO_UNITS: [Unit; 8] = [
    ("rad_per_s", (1.0, false)),
    ("deg_per_s", (AngularRate::from_deg_per_s(1.0).as_rad_per_s(), false)),
    ("deg_per_h", (AngularRate::from_deg_per_h(1.0).as_rad_per_s(), false)),
    ("rad", (1.0, true)),
    ("deg", (PI / 180.0, true)),
    ("arcsec", (Angle::from_arcsec(1.0).as_rad(), true)),
    ("raw", (1.0, false)),
    ("raw_per_tick", (1.0, true)),
];
/// Units of an accelerometer's mean output.
const ACCEL_UNITS: [Unit; 7] = [
    ("m_per_s2", (1.0, false)),
    ("g", (SpecificForce::from_g(1.0).as_m_per_s2(), false)),
    ("mg", (SpecificForce::from_g(0.001).as_m_per_s2(), false)),
    ("m_per_s", (1.0, true)),
    ("volt", (1.0, false)),
    ("raw", (1.0, false)),
    ("raw_per_tick", (1.0, true)),
];
/// Units of a temperature reading, with what is added to it: −0 leaves every reading as it is, to the sign of a zero.
const TEMPERATURE_UNITS: &[(&str, f64)] =
    &[("deg_c", -0.0), ("kelvin", -273.15), ("volt", -0.0), ("raw", -0.0)];

/// Reads a `gyro` table.
pub(super) fn gyro(section: Section<'_, '_>) -> Option<GyroMapping> {
    let ticks = ticks(&section, &GYRO_UNITS);
    let mode = section.get("mode").and_then(|item| mode(&item));
    let switch = section.get("switch").and_then(|item| switch(&item, mode.is_some()));
    let meander = section.get("meander").and_then(|item| self::mode(&item));
    let halves_item = section.get("half_periods");
    let halves: Option<Vec<_>> = match &halves_item {
        Some(item) => item.list().and_then(|pairs| pairs.iter().map(half_period).collect()),
        None => Some(Vec::new()),
    };
    if let (Some(item), Some(halves), Some(ticks)) = (&halves_item, &halves, &ticks)
        && halves.len() != ticks.sensors.len()
    {
        item.refuse(format!(
            "has {} pairs, must have one for each of the {} sensors",
            halves.len(),
            ticks.sensors.len()
        ));
    }
    section.finish();
    Some(GyroMapping { ticks: ticks?, mode, switch, meander, half_periods: halves? })
}

/// Reads an `accel` table.
pub(super) fn accel(section: Section<'_, '_>) -> Option<TickMapping> {
    let ticks = ticks(&section, &ACCEL_UNITS);
    section.finish();
    ticks
}

/// Reads what gyros and accelerometers have in common.
fn ticks(section: &Section<'_, '_>, units: &[Unit]) -> Option<TickMapping> {
    let output = section.need("output", "\"counts\" accumulated over the tick, or its \"mean\"");
    let output =
        output.and_then(|item| item.choice(&[("counts", OutputKind::Counts), ("mean", OutputKind::Mean)]));
    let sensors = section.need("sensors", "a list with one { column = …, unit = … } for each sensor");
    let sensors = sensors.and_then(|item| sensors_of(&item, output, units));
    let sequence = section.get("sequence_column").map(|item| item.column());
    let duration_unit = section.get("duration_unit").and_then(|item| item.choice(TIME_UNITS));
    let duration = section.get("duration_column").map(|item| {
        if duration_unit.is_none() {
            section.missing("duration_unit", "unit of the duration column: \"ns\", \"us\", \"ms\" or \"s\"");
        }
        Some(TimeColumn { column: item.column()?, unit: duration_unit? })
    });
    let may_be_empty = may_be_empty(section);
    Some(TickMapping {
        output: output?,
        sensors: sensors?,
        sequence: flip(sequence)?,
        duration: flip(duration)?,
        may_be_empty,
    })
}

/// A key that may be missing but must be right where it is there.
#[expect(clippy::option_option, reason = "outer: sound or not; inner: there or not")]
fn flip<T>(item: Option<Option<T>>) -> Option<Option<T>> {
    match item {
        Some(None) => None,
        Some(found) => Some(found),
        None => Some(None),
    }
}

/// Whether empty cells mean that there is nothing.
fn may_be_empty(section: &Section<'_, '_>) -> bool {
    section.get("may_be_empty").and_then(|item| item.boolean()).unwrap_or(false)
}

/// Reads the list of sensors.
fn sensors_of(item: &Item<'_, '_>, output: Option<OutputKind>, units: &[Unit]) -> Option<Vec<SensorMapping>> {
    let list = item.list()?;
    if list.is_empty() || list.len() > MAX_SENSORS {
        item.refuse(format!("has {} sensors, must have 1 to {MAX_SENSORS}", list.len()));
        return None;
    }
    // Every sensor is read before any is missed, so that all problems are noted.
    let sensors: Vec<_> = list.iter().map(|item| sensor(item, output, units)).collect();
    sensors.into_iter().collect()
}

/// Reads one sensor.
fn sensor(item: &Item<'_, '_>, output: Option<OutputKind>, units: &[Unit]) -> Option<SensorMapping> {
    let section = item.section()?;
    let column =
        section.need("column", "its name in the header, or its number from 1").and_then(|item| item.column());
    let sign = section.get("sign").map_or(Some(1.0), |item| sign(&item));
    let conversion = match output {
        Some(OutputKind::Counts) => counts(&section, sign),
        Some(OutputKind::Mean) => mean(&section, sign, units),
        None => {
            for key in ["unit", "scale", "mid_scale"] {
                let _ = section.get(key);
            }
            None
        }
    };
    section.finish();
    Some(SensorMapping { column: column?, conversion: conversion? })
}

/// Conversion of counts: the sign alone, so that they stay exact.
fn counts(section: &Section<'_, '_>, sign: Option<f64>) -> Option<Conversion> {
    let unit = section.get("unit").map_or(Some(()), |item| item.choice(&[("counts", ())]));
    for key in ["scale", "mid_scale"] {
        if let Some(item) = section.get(key) {
            item.refuse("counts are passed on exactly as they stand: leave this key out, the scale is in the calibration document");
        }
    }
    unit?;
    Some(Conversion { mid_scale: 0.0, factor: sign?, per_tick: false })
}

/// Conversion of a mean.
fn mean(section: &Section<'_, '_>, sign: Option<f64>, units: &[Unit]) -> Option<Conversion> {
    let unit = section
        .need("unit", "unit of the column, e.g. \"deg_per_s\" or \"m_per_s2\"")
        .and_then(|item| item.choice(units));
    let scale = section.get("scale").map_or(Some(1.0), |item| item.positive());
    let mid_scale = section.get("mid_scale").map_or(Some(0.0), |item| item.number());
    let (unit, per_tick) = unit?;
    Some(Conversion { mid_scale: mid_scale?, factor: sign? * scale? * unit, per_tick })
}

/// Reads a sign.
fn sign(item: &Item<'_, '_>) -> Option<f64> {
    match item.integer(-1..=1)? {
        1 => Some(1.0),
        -1 => Some(-1.0),
        _ => {
            item.refuse("must be 1 or -1");
            None
        }
    }
}

/// Reads a column of two states.
fn mode(item: &Item<'_, '_>) -> Option<ModeMapping> {
    let section = item.section()?;
    let column =
        section.need("column", "its name in the header, or its number from 1").and_then(|item| item.column());
    let plus = section.get("plus").map_or(Some("1"), |item| item.string());
    let minus_item = section.get("minus");
    let minus = minus_item.as_ref().map_or(Some("-1"), Item::string);
    if let Some(item) = minus_item.filter(|_| plus == minus) {
        item.refuse("is the same as `plus`: the two states could not be told apart");
    }
    let may_be_empty = may_be_empty(&section);
    section.finish();
    let (plus, minus) = (plus?.trim().to_owned(), minus?.trim().to_owned());
    Some(ModeMapping { column: column?, plus, minus, may_be_empty })
}

/// Reads where switch commands come from.
fn switch(item: &Item<'_, '_>, has_mode: bool) -> Option<SwitchMapping> {
    let section = item.section()?;
    let column = section.get("column").map(|item| item.column());
    let from = section.get("from").map(|item| (item.choice(&[("mode_change", ())]), item));
    section.finish();
    match (column, from) {
        (Some(column), None) => column.map(SwitchMapping::Column),
        (None, Some((_, item))) if !has_mode => {
            item.refuse("needs the `mode` column beside it");
            None
        }
        (None, Some((found, _))) => found.map(|()| SwitchMapping::ModeChange),
        _ => {
            item.refuse("must have either `column = …` or `from = \"mode_change\"`");
            None
        }
    }
}

/// Reads the two columns of a half-period pair.
fn half_period(item: &Item<'_, '_>) -> Option<(Column, Column)> {
    let section = item.section()?;
    let column = |key| {
        section
            .need(key, "the column's name in the header, or its number from 1")
            .and_then(|item| item.column())
    };
    let (positive, negative) = (column("positive"), column("negative"));
    section.finish();
    Some((positive?, negative?))
}

/// Reads one temperature channel.
pub(super) fn temperature(section: Section<'_, '_>) -> Option<TemperatureMapping> {
    let channel = section.need("channel", "name of the channel, as the calibration document spells it");
    let channel = channel.and_then(|item| {
        let name = item.string()?;
        let sound = ChannelName::from(name).ok().filter(|name| !name.trim().is_empty());
        if sound.is_none() {
            item.refuse(format!("must have 1 to {MAX_CHANNEL_NAME} characters"));
        }
        sound
    });
    let column =
        section.need("column", "its name in the header, or its number from 1").and_then(|item| item.column());
    let unit = section
        .need("unit", "\"deg_c\", \"kelvin\", \"volt\" or \"raw\"")
        .and_then(|item| item.choice(TEMPERATURE_UNITS));
    let every = section.get("every_rows").map_or(Some(1), |item| item.integer(1..=1_000_000));
    let may_be_empty = may_be_empty(&section);
    section.finish();
    Some(TemperatureMapping {
        channel: channel?,
        column: column?,
        shift: unit?,
        every_rows: every?.unsigned_abs(),
        may_be_empty,
    })
}
