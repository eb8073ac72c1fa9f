//! A static log as columns of one kind of reading, ready for analysis.

use std::path::PathBuf;

use isotherm_cli::Bar;
use isotherm_correction::sample::{CorrectedTick, OutputKind, SensorFlags};
use isotherm_log::diff::CorrectedLog;
use isotherm_log::offline::{Loaded, unit_id};
use isotherm_log::part::Part;
use isotherm_protocol::key::UnitId;

use super::DEG_PER_H_IN_RAD_PER_S;
use super::allan::Term;
use super::pieces::checks;
use crate::axes::{AXES, sensor_name};
use crate::error::Error;
use crate::fits::thermal::bare::DEG_C;
use crate::fits::thermal::checks::SMALLEST_RANGE_DEG_C;
use crate::numbers::{percentile, seconds};
use crate::runs::Run;
use crate::runs::cut::Cut;
use crate::runs::series::{Channel, Series, Ticks};

/// What a column measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Angular rate (°/h).
    Rate,
    /// Specific force (m/s²), or the accelerometer's output (V) where the log has that.
    Force,
}

/// Factors from readings and seconds to the units of measure that coefficients are stated in, and their symbols: of rates and of forces,
/// by [`Term::ALL`].
const STATED_IN: [[(f64, &str); 2]; 5] = [
    [(1.0, "″"), (1.0, "m/s")],
    [(1.0 / 60.0, "°/√h"), (60.0, "m/s/√h")],
    [(1.0, "°/h"), (1.0, "m/s²")],
    [(60.0, "°/h/√h"), (60.0, "m/s²/√h")],
    [(3600.0, "°/h²"), (3600.0, "m/s²/h")],
];

/// Factor from readings and seconds to the unit of measure that a coefficient is stated in, and its symbol.
pub(super) fn stated_in(term: Term, kind: Kind) -> (f64, &'static str) {
    STATED_IN[term as usize][kind as usize]
}

/// Readings of several sensors at the same ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    /// The unit.
    pub unit: UnitId,
    /// What they measure.
    pub kind: Kind,
    /// Names of the sensors or axes.
    pub names: Vec<String>,
    /// Whether they are along the case axes, after a correction.
    pub corrected: bool,
    /// Where in the log the part begins that was read (s).
    pub start_s: f64,
    /// Ends of the ticks (ns on the producer's clock).
    pub end_ns: Vec<i64>,
    /// How long the ticks last (s), as the mapping or the producer states it.
    pub duration_s: Vec<f64>,
    /// Readings by sensor; what is no good reading is no number.
    pub values: Vec<Vec<f64>>,
    /// Where raw readings stay exactly the same for long.
    pub frozen: Vec<String>,
    /// What is to be said of the reading.
    pub notes: Vec<String>,
}

/// What the unit of a log is called that has no serial, where nobody says one and no document is written of it.
///
/// # Errors
/// None: the name is a serial as others are.
pub fn unnamed() -> Result<UnitId, Error> {
    Ok(unit_id("unnamed")?)
}

impl Columns {
    /// From raw ticks of a kind; counts of gyros need the angle that one stands for (″).
    ///
    /// # Errors
    /// [`Error::Refused`] where there are none, or counts without a weight.
    pub fn raw(series: Series, kind: Kind, increment_weight_arcsec: Option<f64>) -> Result<Self, Error> {
        let moving = moving(&series, |_, raw| raw);
        let Series { unit, start_s, gyros, accels, .. } = series;
        let (ticks, instead, scale, weight) = match kind {
            Kind::Rate => (
                gyros,
                "for the accelerometers use --accelerometers",
                DEG_PER_H_IN_RAD_PER_S,
                "the angle per count with --increment-weight ARCSEC, or ",
            ),
            Kind::Force => (accels, "for the gyros remove --accelerometers", 1.0, ""),
        };
        let Ticks { end_ns, duration_s, readings, output, .. } = ticks;
        let sensor = kind.sensor();
        let per_count = match (output, increment_weight_arcsec.filter(|_| kind == Kind::Rate)) {
            (None, _) => return Err(nothing(&format!("{sensor} ticks"), instead)),
            (Some(OutputKind::Counts), None) => {
                return Err(Error::refused(format!(
                    "the {sensor} readings are counts: give {weight}a calibration document with --calibration"
                )));
            }
            // ″ per count and s are °/h: 1 ″/s is 1 °/h.
            (Some(OutputKind::Counts), weight) => weight,
            (Some(OutputKind::Mean), _) => None,
        };
        let names: Vec<String> =
            (0..readings.len()).map(|index| sensor_name(index, readings.len())).collect();
        let looked = names.iter().zip(&readings);
        let frozen = looked
            .filter_map(|(name, column)| {
                checks::frozen(&format!("{sensor} {name}"), (start_s, &end_ns), column)
            })
            .collect();
        let mut values = readings;
        for (reading, duration) in values.iter_mut().flat_map(|column| column.iter_mut().zip(&duration_s)) {
            *reading *= per_count.map_or(scale, |weight| weight / duration);
        }
        let mean_outputs = "The readings are the accelerometers' mean outputs in the log. If they are volts, read V \
                            for m/s²; --calibration converts them to specific force.";
        let notes =
            (kind == Kind::Force).then(|| mean_outputs.to_owned()).into_iter().chain(moving).collect();
        Ok(Self { unit, kind, names, corrected: false, start_s, end_ns, duration_s, values, frozen, notes })
    }

    /// From the run of a unit, corrected with a document by the same stream as the service's.
    ///
    /// The raw readings decide first: behind a correction a dead sensor still shows a little of the others.
    ///
    /// # Errors
    /// As [`Run::correct_together`] and [`checks::raw`].
    pub fn corrected_by(run: &Run, loaded: &Loaded, kind: Kind) -> Result<Self, Error> {
        let mut columns = Self::empty(loaded.unit.clone(), kind, 0.0);
        let (series, troubles) = run.correct_with_series(loaded, |tick| columns.push(tick));
        columns.start_s = series.start_s;
        columns.frozen = checks::raw(kind, &series)?;
        let converted = |name: &str, raw: f64| {
            let channel =
                loaded.calibration.channels().iter().find(|channel| channel.name().as_str() == name);
            channel.map_or(f64::NAN, |channel| channel.convert(raw))
        };
        columns.notes = troubles?;
        columns.notes.extend(moving(&series, converted));
        columns.finish()
    }

    /// From a part of each log of corrected ticks, as `isotherm-replay correct` writes it; `cut` learns where it is cut short.
    ///
    /// # Errors
    /// [`Error::Refused`] where it has none, or of several units; [`Error::Log`].
    pub fn of_corrected(paths: &[PathBuf], part: &Part, kind: Kind, cut: &Cut) -> Result<Self, Error> {
        let (unnamed, mut bar) = (unnamed()?, Bar::at_work("reading"));
        let mut columns: Option<Self> = None;
        for path in paths {
            let mut log = CorrectedLog::open(path, part, &unnamed)?;
            while let Some(ticks) = log.next_ticks()? {
                let columns =
                    columns.get_or_insert_with(|| Self::empty(ticks.unit.clone(), kind, part.start.as_s()));
                if columns.unit != ticks.unit {
                    let (first, second) = (&columns.unit, &ticks.unit);
                    return Err(Error::refused(format!(
                        "the log is of several units ({first}, {second}): choose one with --unit"
                    )));
                }
                ticks.ticks.iter().for_each(|tick| columns.push(&tick.tick));
                bar.step();
            }
            log.cut_short().iter().for_each(|words| cut.recording(words));
        }
        bar.finish();
        columns.map_or_else(
            || {
                let none =
                    nothing("corrected ticks", "make them from a raw log with isotherm-replay correct");
                Err(none.beside(cut.words().map(str::to_owned).as_slice()))
            },
            Self::finish,
        )
    }

    fn empty(unit: UnitId, kind: Kind, start_s: f64) -> Self {
        Self {
            unit,
            kind,
            names: AXES.map(str::to_owned).to_vec(),
            corrected: true,
            start_s,
            end_ns: Vec::new(),
            duration_s: Vec::new(),
            values: vec![Vec::new(); AXES.len()],
            frozen: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Takes a corrected tick.
    fn push(&mut self, tick: &CorrectedTick) {
        let (increments, flags, factor) = match self.kind {
            Kind::Rate => (&tick.delta_angle, &tick.gyro_flags, DEG_PER_H_IN_RAD_PER_S),
            Kind::Force => (&tick.delta_velocity, &tick.accel_flags, 1.0),
        };
        let good = !flags.is_empty() && flags.iter().all(|flags| flags.contains(SensorFlags::VALID));
        let duration_s = tick.duration.as_s();
        self.end_ns.push(tick.end_time.as_ns());
        self.duration_s.push(duration_s);
        for (column, increment) in self.values.iter_mut().zip(increments) {
            column.push(if good { increment * factor / duration_s } else { f64::NAN });
        }
    }

    fn finish(self) -> Result<Self, Error> {
        if self.end_ns.is_empty() {
            return Err(nothing(
                "ticks that could be corrected",
                "check that the document is for this unit, and the mapping",
            ));
        }
        Ok(self)
    }

    /// Time of a tick in the log (s), as `--start` counts it but for the tick that the part begins in.
    pub fn since_s(&self, tick: usize) -> f64 {
        let time = self.end_ns.get(tick).zip(self.end_ns.first());
        self.start_s + time.map_or(0.0, |(end, first)| seconds(end.saturating_sub(*first)))
    }
}

impl Kind {
    /// Symbol of the unit of measure.
    pub const fn measure(self) -> &'static str {
        self.over_hours(0)
    }

    /// Symbol of the unit of measure of a slope (power 1) or a bend (power 2), over hours.
    pub const fn over_hours(self, power: usize) -> &'static str {
        [["°/h", "°/h²", "°/h³"], ["m/s²", "m/s²/h", "m/s²/h²"]][self as usize][power]
    }

    /// What a sensor of the kind is called.
    pub const fn sensor(self) -> &'static str {
        ["gyro", "accelerometer"][self as usize]
    }
}

/// That the temperature of a log does not stay; readings that cannot be °C tell nothing.
fn moving(series: &Series, deg_c: impl Fn(&str, f64) -> f64) -> Option<String> {
    let known = |(name, channel): (&String, &Channel)| {
        let values = channel.raw.iter().map(|raw| deg_c(name, *raw));
        let values: Vec<f64> = values.filter(|value| (DEG_C[0]..=DEG_C[1]).contains(value)).collect();
        let [low, high] = [1, 99].map(|share| percentile(values.iter().copied(), share));
        (2 * values.len() > channel.raw.len() && high - low > SMALLEST_RANGE_DEG_C)
            .then_some((name.clone(), [low, high]))
    };
    let moving = series.temperatures.iter().filter_map(known);
    let (name, [low, high]) = moving.max_by(|(_, a), (_, b)| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
    Some(format!(
        "warning: temperature channel {name:?} moves from {low:.1} to {high:.1} °C: what follows it and is not corrected is in B, K, R, σ and trend. Log at one \
         temperature (within {SMALLEST_RANGE_DEG_C} °C), or cut to a part at one with --start and --duration"
    ))
}

fn nothing(what: &str, advice: &str) -> Error {
    Error::refused(format!("the log has no {what}: {advice}"))
}
