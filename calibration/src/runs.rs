//! A run: what one log has of one unit, to be corrected again and again by the service's own code.
//!
//! | module | holds |
//! |---|---|
//! | [`series`] | its raw readings as columns, tick by tick |
//! | [`table`] | its corrected outputs as columns, by windows or tick by tick |
//! | [`faults`] | columns that nothing can be made of |
//! | [`swapped`] | columns that look swapped |
//! | [`cut`] | where a log was cut short |

pub mod cut;
pub mod faults;
pub mod series;
pub mod swapped;
pub mod table;
mod together;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use isotherm_cli::Bar;
use isotherm_correction::sample::GyroTick;
use isotherm_correction::unit::MAX_TICK_DURATION;
use isotherm_log::mapping::{SensorUnit, TemperatureUnit};
use isotherm_log::message::Topic;
use isotherm_log::part::{LogFiles, Messages, Part};
use isotherm_log::progress::Progress;
use isotherm_log::text::LogEvent;
use isotherm_protocol::codec;
use isotherm_protocol::key::{RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};

use crate::error::Error;
use crate::numbers::median;
use crate::report::six;
use cut::Cut;
use series::Series;

/// What one log has of one unit.
#[derive(Debug, Clone)]
pub struct Run {
    /// What the run is called in reports: the names of its files.
    pub name: String,
    /// The unit.
    pub unit: UnitId,
    /// The gyros whose readings are taken, by number; all without them.
    gyros: Option<[usize; 3]>,
    /// Readings that a correction does not see.
    left_out: BTreeSet<Reading>,
    source: Source,
    /// What was given for its files.
    given: Vec<PathBuf>,
    /// Where it was found to be cut short.
    cut: Cut,
    /// Whether a bar shows how far its files are read.
    shown: bool,
}

#[derive(Debug, Clone)]
enum Source {
    Files { files: LogFiles, part: Part },
    Events(Arc<[LogEvent]>),
}

/// A reading of a run: end of its tick (ns), whether it is a gyro's, number of the sensor.
pub type Reading = (i64, bool, usize);

/// A piece of what a run has, as a correction is fed with it: ticks one by one, for behind a whole frame the unit, and its temperatures,
/// would stand at the frame's end.
enum Fed<'a> {
    Event(&'a LogEvent),
    /// A frame without ticks, or that cannot be read.
    Frame(RawStream, &'a [u8]),
}

impl Fed<'_> {
    fn is_accel(&self) -> bool {
        matches!(self, Self::Event(LogEvent::Accel { .. }) | Self::Frame(RawStream::Accel, _))
    }
}

/// What a correction passed over, as `isotherm-replay correct` says it; empty where all is well.
pub type Troubles = Vec<String>;

impl Run {
    /// The run of a unit in the files of a log; nothing is read yet.
    pub fn new(name: String, unit: UnitId, files: LogFiles, part: &Part) -> Self {
        let part = Part { units: [unit.clone()].into(), ..part.clone() };
        Self::of(name, unit, Source::Files { files, part })
    }

    /// A run that is already in memory.
    pub fn of_events(name: String, unit: UnitId, events: Vec<LogEvent>) -> Self {
        Self::of(name, unit, Source::Events(events.into()))
    }

    fn of(name: String, unit: UnitId, source: Source) -> Self {
        Self {
            name,
            unit,
            gyros: None,
            left_out: BTreeSet::new(),
            source,
            given: Vec::new(),
            cut: Cut::default(),
            shown: false,
        }
    }

    /// Has a bar show how far its files are read, from now on.
    pub fn show(&mut self) {
        self.shown = true;
    }

    /// The same, where folders were given that have its files.
    pub fn given_as(self, given: Vec<PathBuf>) -> Self {
        Self { given, ..self }
    }

    /// The same with three of its gyros only, for corrections with a document of these three.
    pub fn of_gyros(&self, gyros: [usize; 3]) -> Self {
        Self { gyros: Some(gyros), ..self.clone() }
    }

    /// The same without some readings.
    pub fn without(&self, left_out: BTreeSet<Reading>) -> Self {
        Self { left_out, ..self.clone() }
    }

    /// An event in which the readings that are left out are no numbers; how many there are is added up.
    fn kept<'a>(&self, event: &'a LogEvent, left_out: &mut u64) -> Cow<'a, LogEvent> {
        let mut kept = Cow::Borrowed(event);
        let (end_ns, gyro) = (event.time().as_ns(), matches!(event, LogEvent::Gyro { .. }));
        for (.., sensor) in self.left_out.range((end_ns, gyro, 0)..=(end_ns, gyro, usize::MAX)) {
            let reading = match kept.to_mut() {
                LogEvent::Gyro { tick, .. } => tick.readings.get_mut(*sensor),
                LogEvent::Accel { tick, .. } => tick.readings.get_mut(*sensor),
                LogEvent::Temperature(_) => None,
            };
            if let Some(reading) = reading {
                *left_out += 1;
                *reading = f64::NAN;
            }
        }
        kept
    }

    /// An event with the readings of the gyros that are taken. A tick that lacks one of them is left as it is: a correction refuses it.
    fn taken<'a>(&self, event: &'a LogEvent) -> Cow<'a, LogEvent> {
        let (Some(gyros), LogEvent::Gyro { output, tick }) = (self.gyros, event) else {
            return Cow::Borrowed(event);
        };
        if gyros.iter().any(|gyro| *gyro >= tick.readings.len()) {
            return Cow::Borrowed(event);
        }
        let half_periods = gyros.iter().filter_map(|gyro| tick.half_periods.get(*gyro).copied());
        let tick = GyroTick {
            readings: gyros.iter().filter_map(|gyro| tick.readings.get(*gyro).copied()).collect(),
            half_periods: half_periods.collect(),
            ..tick.clone()
        };
        Cow::Owned(LogEvent::Gyro { output: *output, tick })
    }

    /// The files that it is read from; none where it is in memory.
    pub fn files(&self) -> &[PathBuf] {
        match &self.source {
            Source::Files { files: LogFiles::Recordings(paths) | LogFiles::Text { paths, .. }, .. } => paths,
            Source::Events(_) => &[],
        }
    }

    /// What the mapping of a text log says that its accelerometers read; recordings do not say.
    pub fn accelerometer_unit(&self) -> Option<&'static str> {
        let Source::Files { files: LogFiles::Text { mapping, .. }, .. } = &self.source else { return None };
        mapping.files.iter().find_map(|file| Some(file.accel.as_ref()?.sensors.first()?.unit.sent()))
    }

    /// Whether the mapping of a text log says that all its thermometers read °C; recordings do not say.
    pub fn thermometers_read_deg_c(&self) -> bool {
        let Source::Files { files: LogFiles::Text { mapping, .. }, .. } = &self.source else { return false };
        mapping.files.iter().flat_map(|file| &file.temperatures).all(|channel| {
            matches!(channel.unit, TemperatureUnit::DegC | TemperatureUnit::DegF | TemperatureUnit::Kelvin)
        })
    }

    /// The files and folders that it was given as, which documents name; its files where nothing else is known.
    pub fn logs(&self) -> &[PathBuf] {
        if self.given.is_empty() { self.files() } else { &self.given }
    }

    /// Whether it is from a file that another run is from, too.
    pub fn shares_log(&self, other: &Self) -> bool {
        self.files().iter().any(|file| other.files().contains(file))
    }

    /// Its readings as columns.
    ///
    /// # Errors
    /// [`Error::Log`]; [`Error::Refused`] where it has no ticks, ticks too long to be corrected, or ticks of two instruments.
    pub fn series(&self) -> Result<Series, Error> {
        let mut series = self.no_series();
        self.walk(|fed| series.take(&fed).map_err(|error| error.of(&self.name)))?;
        for (kind, ticks) in [("gyro", &series.gyros), ("accelerometer", &series.accels)] {
            let (usual_s, longest_s) = (median(&ticks.duration_s), MAX_TICK_DURATION.as_s());
            if usual_s > longest_s {
                return Err(Error::refused(format!(
                    "{}: its {kind} ticks last {} s, at most {longest_s} s can be corrected: log more often",
                    self.name,
                    six(usual_s)
                )));
            }
        }
        if series.gyros.is_empty() && series.accels.is_empty() {
            let mut reasons = vec![format!("{} has no raw ticks of unit {}", self.name, self.unit)];
            reasons.extend(self.cut_short().map(str::to_owned));
            return Err(Error::Refused(reasons));
        }
        Ok(series)
    }

    /// Columns that it has put nothing into yet.
    fn no_series(&self) -> Series {
        let start_s = match &self.source {
            Source::Files { part, .. } => part.start.as_s(),
            Source::Events(_) => 0.0,
        };
        Series::empty(self.unit.clone(), start_s)
    }

    /// That its recording was cut short, and where, once that was found by reading it.
    pub fn cut_short(&self) -> Option<&str> {
        self.cut.words()
    }

    /// The same, for someone who is to know it later.
    pub fn hand_on(&self, cut: &Cut) {
        self.cut.hand_on(cut);
    }

    /// Goes through everything that it has.
    fn walk(&self, mut each: impl FnMut(Fed<'_>) -> Result<(), Error>) -> Result<(), Error> {
        match &self.source {
            Source::Events(events) => events.iter().try_for_each(|event| each(Fed::Event(event))),
            Source::Files { files, part } => {
                let mut messages = files.open(part)?;
                let mut bar = if self.shown { bar_over(&messages.progress()) } else { Bar::hidden() };
                while let Some(message) = messages.next_message()? {
                    if let Topic::Raw(_, input) = message.topic {
                        let has_ticks = matches!(input, RawStream::Gyro | RawStream::Accel);
                        match has_ticks.then(|| readings(input, &message.frame)).flatten() {
                            Some(events) => events.iter().try_for_each(|event| each(Fed::Event(event)))?,
                            None => each(Fed::Frame(input, &message.frame))?,
                        }
                    }
                    bar.step();
                }
                bar.finish();
                self.cut.note(&self.name, &messages.report());
                Ok(())
            }
        }
    }

    /// What a correction passed over; a refusal where nothing came out of it.
    fn judge_troubles(&self, ticks: u64, troubles: Troubles) -> Result<Troubles, Error> {
        if ticks > 0 {
            return Ok(troubles);
        }
        let mut reasons = vec![format!(
            "{}: nothing of unit {} could be corrected: check that the document is for this unit, and the mapping",
            self.name, self.unit
        )];
        reasons.extend(troubles);
        reasons.extend(self.cut_short().map(str::to_owned));
        Err(Error::Refused(reasons))
    }
}

/// What a frame of raw readings holds, one by one; `None` where it cannot be read.
fn readings(stream: RawStream, frame: &[u8]) -> Option<Vec<LogEvent>> {
    Some(match stream {
        RawStream::Gyro => {
            let GyroBatch { output, ticks } = codec::decode(frame).ok()?;
            ticks.into_iter().map(|tick| LogEvent::Gyro { output, tick }).collect()
        }
        RawStream::Accel => {
            let AccelBatch { output, ticks } = codec::decode(frame).ok()?;
            ticks.into_iter().map(|tick| LogEvent::Accel { output, tick }).collect()
        }
        RawStream::Temperature => {
            let TemperatureBatch { readings, .. } = codec::decode(frame).ok()?;
            readings.into_iter().map(LogEvent::Temperature).collect()
        }
        RawStream::Health => Vec::new(),
    })
}

/// The units that recordings have raw readings of, and where they are cut short.
///
/// # Errors
/// [`Error::Log`].
pub fn units_of(log: &mut Messages) -> Result<(Vec<UnitId>, Cut), Error> {
    let mut units = BTreeSet::new();
    let mut bar = bar_over(&log.progress());
    while let Some(message) = log.next_message()? {
        if let Topic::Raw(unit, _) = message.topic {
            units.insert(unit);
        }
        bar.step();
    }
    bar.finish();
    let cut = Cut::default();
    cut.note("", &log.report());
    Ok((units.into_iter().collect(), cut))
}

/// A bar over the bytes of a log.
fn bar_over(progress: &Progress) -> Bar {
    let mut bar = Bar::over_logs("reading");
    bar.begin(progress.watch());
    bar
}
