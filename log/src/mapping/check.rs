//! What must hold between the keys of a mapping.

use isotherm_correction::sample::OutputKind;
use isotherm_document::{Reader, element, join};

use super::{
    Column, Delimiter, FileMapping, GyroMapping, Mapping, ModeMapping, SensorUnit, SwitchMapping,
    TickMapping, TimeMapping,
};

pub(super) fn check(r: &mut Reader<'_>, Mapping { files, .. }: &Mapping) {
    files.iter().enumerate().for_each(|(i, file)| check_file(r, &element("file", i), file));
    let gyros = files.iter().filter(|file| file.gyro.is_some()).count();
    if gyros != 1 {
        r.report(
            "file",
            format!("{gyros} of the files have a [file.gyro], must be exactly one: gyro ticks set the pace of the log"),
        );
    }
    if files.iter().filter(|file| file.accel.is_some()).count() > 1 {
        r.report("file", "more than one file has a [file.accel], must be at most one");
    }
    let channels: Vec<_> = files.iter().flat_map(|file| &file.temperatures).map(|t| t.channel).collect();
    for (index, channel) in channels.iter().enumerate() {
        if channels.iter().take(index).any(|earlier| earlier == channel) {
            r.report("file", format!("temperature channel {channel:?} is given twice"));
        }
    }
}

fn check_file(r: &mut Reader<'_>, path: &str, file: &FileMapping) {
    let (delimiter, gyro, accel) = (file.layout.delimiter, file.gyro.as_ref(), file.accel.as_ref());
    if delimiter.byte() == Some(file.layout.decimal_mark as u8) {
        r.report(&join(path, "decimal_mark"), "is also the delimiter: choose another");
    }
    if gyro.is_none() && accel.is_none() && file.temperatures.is_empty() {
        let what = "is missing: the file must have a [file.gyro], a [file.accel] or a [[file.temperature]]";
        r.report(&join(path, "gyro"), what);
    }
    let own_durations = gyro.is_none_or(|gyro| gyro.ticks.duration_column.is_some())
        && accel.is_none_or(|accel| accel.duration_column.is_some());
    time(r, &join(path, "time"), &file.time, own_durations);
    if let Some(gyro) = gyro {
        states(r, &join(path, "gyro"), gyro);
        ticks(r, &join(path, "gyro"), &gyro.ticks);
    }
    if let Some(accel) = accel {
        ticks(r, &join(path, "accel"), accel);
    }
    if file.status.as_ref().is_some_and(|status| status.good.is_empty() == status.bad_bits.is_none()) {
        let what = "must have either `good = [\"0\"]`, the cells of valid rows, or `bad_bits = 3`";
        r.report(&join(path, "status"), what);
    }
    let name = |column: &mut Column| column.name().map(str::to_owned);
    if let Some(name) = file.clone().columns_mut().find_map(name).filter(|_| !file.layout.header) {
        r.report(path, format!("column {name:?} is given by name, but the file has no header: set header = true, or use numbers from 1"));
    }
    let empties = [gyro.is_some_and(|gyro| gyro.ticks.may_be_empty), accel.is_some_and(|a| a.may_be_empty)];
    let empties = empties.into_iter().chain(file.temperatures.iter().map(|t| t.may_be_empty));
    if delimiter == Delimiter::Whitespace && empties.into_iter().any(|may| may) {
        r.report(path, "may_be_empty needs a delimiter other than whitespace");
    }
}

/// `own_durations`: every stream of the file has a duration column of its own.
fn time(r: &mut Reader<'_>, path: &str, time: &TimeMapping, own_durations: bool) {
    let at = |key| join(path, key);
    let stated = ["tick_ns", "tick_us", "tick_ms", "tick_s"].map(at);
    for again in stated.iter().filter(|key| r.has(key)).skip(1).collect::<Vec<_>>() {
        r.report(again, "gives the tick again: keep one of tick_ns, tick_us, tick_ms, tick_s");
    }
    let stamped = r.has(&at("column"));
    if stamped && !r.has(&at("unit")) {
        let what = "is missing: unit of the stamps, \"ns\", \"us\", \"ms\", \"s\", \"min\", \"h\", \"iso\", \"dmy\", \"mdy\" or \"time_of_day\"";
        r.report(&at("unit"), what);
    }
    if time.stamps.as_ref().is_some_and(|stamps| stamps.date.is_some() && !stamps.unit.has_date()) {
        let what = "needs the unit \"iso\", \"dmy\" or \"mdy\", by which dates are read";
        r.report(&at("date_column"), what);
    }
    for key in ["unit", "date_column", "marks", "duration", "gap_after_ticks"].map(at) {
        if !stamped && r.has(&key) {
            r.report(&key, "needs a time column: add `column`, or remove this key");
        }
    }
    if time.tick.is_none() && !(stamped && own_durations && time.gap_after_ticks.is_none()) {
        let what = if stamped {
            "the first tick has no stamp before it, so the nominal duration is needed, e.g. tick_ms = 10.0"
        } else {
            "without a time column, rows need a nominal duration, e.g. tick_ms = 10.0"
        };
        r.report(&at("tick_ms"), format!("is missing: {what}"));
    }
}

/// What gyros have beside their readings.
fn states(r: &mut Reader<'_>, path: &str, gyro: &GyroMapping) {
    let (pairs, sensors) = (gyro.half_periods.len(), gyro.ticks.sensors.len());
    let halves = join(path, "half_periods");
    if r.has(&halves) && pairs != sensors {
        r.report(&halves, format!("has {pairs} pairs, must have one for each of the {sensors} sensors"));
    }
    let switch = join(path, "switch");
    match &gyro.switch {
        Some(SwitchMapping { column: None, from: Some(_) }) if gyro.mode.is_none() => {
            r.report(&join(&switch, "from"), "needs the `mode` column too");
        }
        Some(SwitchMapping { column, from }) if column.is_some() == from.is_some() => {
            r.report(&switch, "must have either `column = …` or `from = \"mode_change\"`");
        }
        _ => {}
    }
    let same = |mode: &ModeMapping| mode.plus.trim() == mode.minus.trim();
    for (key, mode) in [("mode", &gyro.mode), ("meander", &gyro.meander)] {
        if mode.as_ref().is_some_and(same) {
            let why = "is the same as `plus`: they must differ";
            r.report(&join(&join(path, key), "minus"), why);
        }
    }
}

fn ticks<U: SensorUnit>(r: &mut Reader<'_>, path: &str, ticks: &TickMapping<U>) {
    let unit = join(path, "duration_unit");
    if ticks.duration_column.is_some() && ticks.duration_unit.is_none() {
        r.report(&unit, "is missing: unit of the duration column, \"ns\", \"us\", \"ms\" or \"s\"");
    }
    if ticks.duration_column.is_some() && ticks.duration_unit.is_some_and(|unit| unit.scale().is_none()) {
        r.report(&unit, "must be \"ns\", \"us\", \"ms\" or \"s\": a duration has no date");
    }
    if ticks.duration_column.is_none() && r.has(&unit) {
        r.report(&unit, "needs a `duration_column`: add it, or remove this key");
    }
    // What the readings stand for is not known: nothing can be said of their units.
    if r.is_damaged(&join(path, "output")) {
        return;
    }
    let sensors = join(path, "sensors");
    if ticks.sensors.iter().all(|sensor| sensor.column.is_none()) {
        r.report(&sensors, "has no column: one of the sensors must have one");
    }
    for (index, sensor) in ticks.sensors.iter().enumerate() {
        let at = |key| join(&element(&sensors, index), key);
        let (unit, is_counts) = (at("unit"), sensor.unit.in_si().is_none());
        if sensor.column.is_some() == sensor.constant.is_some() {
            r.report(
                &element(&sensors, index),
                "must have either `column = …` or, for a sensor that the log does not have, `constant = 0`",
            );
        }
        if ticks.output == OutputKind::Counts
            && sensor.constant.is_some_and(|constant| constant.fract() != 0.0)
        {
            r.report(&at("constant"), "must be a whole number: the output is \"counts\"");
        }
        if ticks.output == OutputKind::Counts {
            if !is_counts {
                r.report(&unit, "must be \"counts\", or left out: the output is \"counts\"");
            }
            for key in ["scale", "mid_scale"].map(at) {
                if r.has(&key) {
                    let why = "counts are passed on unchanged: remove this key, the scale is in the calibration document";
                    r.report(&key, why);
                }
            }
        } else if !r.has(&unit) {
            r.report(&unit, "is missing: unit of the column, e.g. \"deg_per_s\" or \"m_per_s2\"");
        } else if is_counts {
            r.report(&unit, "is \"counts\", but the output is \"mean\": give the unit of the mean");
        }
    }
}

impl Column {
    /// Its name, where it is given by name.
    fn name(&self) -> Option<&str> {
        match self {
            Self::Name(name) => Some(name),
            Self::Index(_) => None,
        }
    }
}
