//! From the keys of a mapping to what they mean, and what must hold between them.

use std::f64::consts::PI;
use std::sync::LazyLock;

use isotherm_correction::sample::OutputKind;
use isotherm_correction::units::{Angle, AngularRate, Span, SpecificForce};
use isotherm_document::{Form, Problem, Reader, element, join};

use super::keys::{
    AccelUnit, DurationRule, FileKeys, GyroKeys, GyroUnit, MappingKeys, SensorKeys, SwitchKeys, TickKeys,
    TimeKeys,
};
use super::{
    Column, Conversion, Delimiter, FileMapping, GyroMapping, Mapping, Marks, ModeMapping, SensorMapping,
    StatusMapping, SwitchMapping, TickMapping, TimeColumn, TimeMapping, TimeUnit, VERSION,
};

static FORM: LazyLock<Form> = LazyLock::new(|| Form::of::<MappingKeys>().versions("version", [VERSION; 2]));

/// Reads a mapping, or everything that is wrong with it.
pub(super) fn parse(text: &str, file: &str) -> Result<Mapping, Vec<Problem>> {
    let mut reader = Reader::new(text, Some(file));
    let mapping = reader.read(&FORM).map(|keys| mapping(&mut reader, keys));
    reader.finish(mapping)
}

fn mapping(r: &mut Reader<'_>, keys: MappingKeys) -> Mapping {
    let files: Vec<_> =
        keys.file.into_iter().enumerate().map(|(i, keys)| file(r, &element("file", i), keys)).collect();
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
    Mapping { files }
}

fn file(r: &mut Reader<'_>, path: &str, keys: FileKeys) -> FileMapping {
    let FileKeys { name, layout, .. } = keys;
    let (delimiter, header) = (layout.delimiter, layout.header);
    if delimiter == Delimiter::Character(layout.decimal_mark as u8) {
        let why = "is also the delimiter: choose another";
        r.report(&join(path, "decimal_mark"), why);
    }
    if keys.gyro.is_none() && keys.accel.is_none() && keys.temperature.is_empty() {
        let what = "is missing: the file must have a [file.gyro], a [file.accel] or a [[file.temperature]]";
        r.report(&join(path, "gyro"), what);
    }
    let own_durations = keys.gyro.as_ref().is_none_or(|gyro| gyro.ticks.duration_column.is_some())
        && keys.accel.as_ref().is_none_or(|accel| accel.duration_column.is_some());
    let file = FileMapping {
        name,
        layout,
        time: time(r, &join(path, "time"), keys.time, own_durations),
        gyro: keys.gyro.map(|keys| gyro(r, &join(path, "gyro"), keys)),
        accel: keys.accel.map(|keys| ticks(r, &join(path, "accel"), keys)),
        temperatures: keys.temperature,
        status: keys.status.map(|keys| status(r, &join(path, "status"), keys)),
    };
    if let Some(name) = file.columns().find_map(Column::name).filter(|_| !header) {
        r.report(path, format!("column {name:?} is given by name, but the file has no header: set header = true, or use numbers from 1"));
    }
    let ticks = file.gyro.as_ref().map(|gyro| &gyro.ticks).into_iter().chain(&file.accel);
    let empties =
        ticks.map(|ticks| ticks.may_be_empty).chain(file.temperatures.iter().map(|t| t.may_be_empty));
    if delimiter == Delimiter::Whitespace && empties.into_iter().any(|may| may) {
        r.report(path, "may_be_empty needs a delimiter other than whitespace");
    }
    file
}

/// `own_durations`: every stream of the file has a duration column of its own.
fn time(r: &mut Reader<'_>, path: &str, keys: TimeKeys, own_durations: bool) -> TimeMapping {
    let tick = nominal(r, path, &keys);
    let TimeKeys { column, unit, marks, duration, gap_after_ticks, origin_ns, .. } = keys;
    let stamped = column.is_some() || r.is_damaged(&join(path, "column"));
    if stamped && unit.is_none() {
        r.report(
            &join(path, "unit"),
            "is missing: unit of the stamps, \"ns\", \"us\", \"ms\", \"s\" or \"iso\"",
        );
    }
    for key in ["unit", "marks", "duration", "gap_after_ticks"] {
        let at = join(path, key);
        if !stamped && r.has(&at) {
            r.report(&at, "needs a time column: add `column`, or remove this key");
        }
    }
    if tick.is_none() && !(stamped && own_durations && gap_after_ticks.is_none()) {
        let what = if stamped {
            "the first tick has no stamp before it, so the nominal duration is needed, e.g. tick_ms = 10.0"
        } else {
            "without a time column, rows need a nominal duration, e.g. tick_ms = 10.0"
        };
        r.report(&join(path, "tick_ms"), format!("is missing: {what}"));
    }
    TimeMapping {
        stamps: column.zip(unit).map(|(column, unit)| TimeColumn { column, unit }),
        marks: marks.unwrap_or(Marks::End),
        tick,
        measured: duration.map_or(stamped, |duration| duration == DurationRule::Measured),
        gap_after_ticks,
        origin_ns,
    }
}

/// The nominal tick from whichever of its keys is there.
fn nominal(r: &mut Reader<'_>, path: &str, keys: &TimeKeys) -> Option<Span> {
    let mut tick = None;
    for (key, stated, ns) in [
        ("tick_ns", keys.tick_ns, 1.0),
        ("tick_us", keys.tick_us, 1e3),
        ("tick_ms", keys.tick_ms, 1e6),
        ("tick_s", keys.tick_s, 1e9),
    ] {
        let Some(nanoseconds) = stated.map(|stated| stated * ns) else { continue };
        let at = join(path, key);
        if tick.is_some() {
            r.report(&at, "gives the tick again: keep one of tick_ns, tick_us, tick_ms, tick_s");
        }
        tick = Some(Span::from_s(nanoseconds * 1e-9));
    }
    tick
}

fn gyro(r: &mut Reader<'_>, path: &str, keys: GyroKeys) -> GyroMapping {
    let (pairs, sensors) = (keys.half_periods.len(), keys.ticks.sensors.len());
    let halves = join(path, "half_periods");
    if r.has(&halves) && pairs != sensors {
        r.report(&halves, format!("has {pairs} pairs, must have one for each of the {sensors} sensors"));
    }
    let switch =
        keys.switch.and_then(|switch| self::switch(r, &join(path, "switch"), switch, keys.mode.is_some()));
    let [mode, meander] = [("mode", keys.mode), ("meander", keys.meander)].map(|(key, mode)| {
        let mode = mode.map(ModeMapping::trimmed);
        if mode.as_ref().is_some_and(|mode| mode.plus == mode.minus) {
            let why = "is the same as `plus`: they must differ";
            r.report(&join(&join(path, key), "minus"), why);
        }
        mode
    });
    GyroMapping { ticks: ticks(r, path, keys.ticks), mode, switch, meander, half_periods: keys.half_periods }
}

fn ticks<U: SensorUnit>(r: &mut Reader<'_>, path: &str, keys: TickKeys<U>) -> TickMapping {
    let output = keys.output.into();
    TickMapping {
        output,
        duration: duration(r, path, keys.duration_column, keys.duration_unit),
        sensors: sensors(r, path, output, keys.sensors),
        sequence: keys.sequence_column,
        may_be_empty: keys.may_be_empty,
    }
}

fn duration(
    r: &mut Reader<'_>,
    path: &str,
    column: Option<Column>,
    unit: Option<TimeUnit>,
) -> Option<TimeColumn> {
    let column = column?;
    if unit.is_none() {
        let what = "is missing: unit of the duration column, \"ns\", \"us\", \"ms\" or \"s\"";
        r.report(&join(path, "duration_unit"), what);
    }
    if unit == Some(TimeUnit::DateTime) {
        r.report(
            &join(path, "duration_unit"),
            "is \"iso\", must be \"ns\", \"us\", \"ms\" or \"s\": a duration has no date",
        );
    }
    Some(TimeColumn { column, unit: unit? })
}

/// The unit of a sensor's column.
pub trait SensorUnit: Copy {
    /// How much it is in SI, and whether it is an increment over the tick; `None` for counts.
    fn in_si(self) -> Option<(f64, bool)>;
}

impl SensorUnit for GyroUnit {
    fn in_si(self) -> Option<(f64, bool)> {
        Some(match self {
            Self::Counts => return None,
            Self::RadPerS | Self::Raw => (1.0, false),
            Self::DegPerS => (AngularRate::from_deg_per_s(1.0).as_rad_per_s(), false),
            Self::DegPerH => (AngularRate::from_deg_per_h(1.0).as_rad_per_s(), false),
            Self::Rad | Self::RawPerTick => (1.0, true),
            Self::Deg => (PI / 180.0, true),
            Self::Arcsec => (Angle::from_arcsec(1.0).as_rad(), true),
        })
    }
}

impl SensorUnit for AccelUnit {
    fn in_si(self) -> Option<(f64, bool)> {
        Some(match self {
            Self::Counts => return None,
            Self::MPerS2 | Self::Volt | Self::Raw => (1.0, false),
            Self::G => (SpecificForce::from_g(1.0).as_m_per_s2(), false),
            Self::Mg => (SpecificForce::from_g(0.001).as_m_per_s2(), false),
            Self::MPerS | Self::RawPerTick => (1.0, true),
        })
    }
}

fn sensors<U: SensorUnit>(
    r: &mut Reader<'_>,
    path: &str,
    output: OutputKind,
    sensors: Vec<SensorKeys<U>>,
) -> Vec<SensorMapping> {
    // What the readings stand for is not known: nothing can be said of their units.
    let known = !r.is_damaged(&join(path, "output"));
    let path = join(path, "sensors");
    let sensor = |(index, keys): (usize, SensorKeys<U>)| {
        let at = element(&path, index);
        let unit = keys.unit.and_then(SensorUnit::in_si);
        if known && output == OutputKind::Counts {
            if unit.is_some() {
                r.report(&join(&at, "unit"), "must be \"counts\", or left out: the output is \"counts\"");
            }
            for (key, stated) in [("scale", keys.scale), ("mid_scale", keys.mid_scale)] {
                if stated.is_some() {
                    r.report(
                        &join(&at, key),
                        "counts are passed on unchanged: remove this key, the scale is in the \
                                               calibration document",
                    );
                }
            }
        } else if known && keys.unit.is_none() {
            r.report(
                &join(&at, "unit"),
                "is missing: unit of the column, e.g. \"deg_per_s\" or \"m_per_s2\"",
            );
        } else if known && unit.is_none() {
            r.report(
                &join(&at, "unit"),
                "is \"counts\", but the output is \"mean\": give the unit of the mean",
            );
        }
        let (sign, scale) = (keys.sign.map_or(1.0, f64::from), keys.scale.unwrap_or(1.0));
        let (unit, per_tick) = unit.unwrap_or((1.0, false));
        let conversion = match output {
            OutputKind::Counts => Conversion { mid_scale: 0.0, factor: sign, per_tick: false },
            OutputKind::Mean => {
                Conversion { mid_scale: keys.mid_scale.unwrap_or(0.0), factor: sign * scale * unit, per_tick }
            }
        };
        SensorMapping { column: keys.column, conversion }
    };
    sensors.into_iter().enumerate().map(sensor).collect()
}

fn switch(r: &mut Reader<'_>, path: &str, keys: SwitchKeys, has_mode: bool) -> Option<SwitchMapping> {
    match (keys.column, keys.from) {
        (Some(column), None) => Some(SwitchMapping::Column(column)),
        (None, Some(_)) => {
            if !has_mode {
                r.report(&join(path, "from"), "needs the `mode` column too");
            }
            Some(SwitchMapping::ModeChange)
        }
        _ => {
            r.report(path, "must have either `column = …` or `from = \"mode_change\"`");
            None
        }
    }
}

fn status(r: &mut Reader<'_>, path: &str, keys: StatusMapping) -> StatusMapping {
    if keys.good.is_empty() == keys.bad_bits.is_none() {
        r.report(path, "must have either `good = [\"0\"]`, the cells of valid rows, or `bad_bits = 3`");
    }
    StatusMapping { good: keys.good.iter().map(|cell| cell.trim().to_owned()).collect(), ..keys }
}

impl ModeMapping {
    fn trimmed(self) -> Self {
        Self { plus: self.plus.trim().to_owned(), minus: self.minus.trim().to_owned(), ..self }
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
