//! A log as text: raw streams as a CSV with its mapping, corrected ticks and health readings as CSV.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::mem;
use std::path::{Path, PathBuf};

use isotherm_log::streams::contents::UnitContents;
use isotherm_log::streams::decoded::Decoded;
use isotherm_log::streams::raw_text::RawColumns;
use isotherm_log::streams::rows::{Row, Rows, Step};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::HealthBatch;

use super::output::{Place, folder};
use super::{Conversion, Converted, Found, Outcome, Target, Written};
use isotherm_log::error::Error;
use isotherm_log::file::{Partial, Sink};
use isotherm_log::offline::rows::{write_header, write_tick};

pub(super) fn convert(conversion: &Conversion, found: &Found) -> Result<Outcome, Error> {
    let units = &found.contents.units;
    let single = Target::by_name(&conversion.out) == Some(Target::Text);
    if single && units.len() > 1 {
        let names: Vec<_> = units.keys().map(UnitId::as_str).collect();
        return Err(Error::Usage(format!(
            "{} is for one unit, the log has {} ({}): give --unit, or a folder with --to text",
            conversion.out.display(),
            units.len(),
            names.join(", ")
        )));
    }
    let mut texts = BTreeMap::new();
    for (unit, contents) in units {
        let names = if single {
            Names::beside(&conversion.out)
        } else {
            Names { stem: conversion.out.join(folder(unit)).join("raw"), end: ".csv".into(), single }
        };
        texts.insert(unit.clone(), UnitText::create(unit, contents, names, &conversion.place)?);
    }
    let mut converted = Converted::default();
    let log = conversion.read_units(&mut texts, &mut converted, |text, _, decoded, converted| {
        text.take(decoded, converted)
    })?;
    let mut partials = Vec::new();
    for text in texts.into_values() {
        partials.extend(text.finish(&mut converted)?);
    }
    partials.into_iter().try_for_each(Partial::keep)?;
    Ok(Outcome { converted, log })
}

/// Names of a unit's files.
#[derive(Debug, Clone)]
struct Names {
    /// Path of the raw streams, without its ending.
    stem: PathBuf,
    /// `.csv` or `.csv.gz`.
    end: String,
    /// The files of a unit stand beside each other under one stem, not in a folder.
    single: bool,
}

impl Names {
    /// Beside the CSV that was named.
    fn beside(out: &Path) -> Self {
        let name = out.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let compressed = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
        let length = if compressed { ".csv.gz".len() } else { ".csv".len() };
        let (stem, end) = name.split_at(name.len() - length);
        Self { stem: out.with_file_name(stem), end: end.to_owned(), single: true }
    }

    fn with(&self, what: &str, end: &str) -> PathBuf {
        let mut name = self.stem.as_os_str().to_owned();
        name.push(what);
        name.push(end);
        name.into()
    }

    /// The raw streams of a run, from 1, or their mapping.
    fn of_run(&self, run: u64, end: &str) -> PathBuf {
        if run == 1 { self.with("", end) } else { self.with(&format!(".{run}"), end) }
    }

    /// Something beside the raw streams.
    fn other(&self, what: &str) -> PathBuf {
        if self.single {
            self.with(&format!(".{what}"), &self.end)
        } else {
            self.stem.with_file_name(format!("{what}{}", self.end))
        }
    }
}

/// The files of a unit.
#[derive(Debug)]
struct UnitText {
    unit: String,
    names: Names,
    place: Place,
    columns: RawColumns,
    rows: Rows,
    /// Number of the producer's run, from 1.
    run: u64,
    raw: Option<(Sink, u64)>,
    corrected: Option<(Sink, u64)>,
    health: Option<(Sink, u64)>,
    whole: Vec<(Partial, &'static str, u64)>,
}

impl UnitText {
    fn create(unit: &UnitId, contents: &UnitContents, names: Names, place: &Place) -> Result<Self, Error> {
        let columns = RawColumns::of(unit.as_str(), contents);
        let mut text = Self {
            unit: unit.to_string(),
            names,
            place: place.clone(),
            columns,
            rows: Rows::of(contents),
            run: 1,
            raw: None,
            corrected: None,
            health: None,
            whole: Vec::new(),
        };
        if contents.has_raw() {
            text.open_raw()?;
        }
        if contents.corrected_ticks > 0 {
            let mut sink = place.sink(&text.names.other("corrected"))?;
            sink.write(|writer| write_header(writer))?;
            text.corrected = Some((sink, 0));
        }
        if contents.health_readings > 0 {
            let mut sink = place.sink(&text.names.other("health"))?;
            sink.write(|writer| writeln!(writer, "time_ns,name,value"))?;
            text.health = Some((sink, 0));
        }
        Ok(text)
    }

    /// Begins the file of a run, with the mapping that reads it.
    fn open_raw(&mut self) -> Result<(), Error> {
        let mapping = self.names.of_run(self.run, ".mapping.toml");
        self.whole.push((self.place.write(&mapping, &self.columns.mapping())?, "mapping", 1));
        let mut sink = self.place.sink(&self.names.of_run(self.run, &self.names.end))?;
        sink.write(|writer| self.columns.write_header(writer))?;
        self.raw = Some((sink, 0));
        Ok(())
    }

    /// Ends the file of a run.
    fn close_raw(&mut self) -> Result<(), Error> {
        if let Some((sink, rows)) = self.raw.take() {
            self.whole.push((sink.finish()?, "raw streams", rows));
        }
        Ok(())
    }

    fn take(&mut self, decoded: &Decoded, converted: &mut Converted) -> Result<(), Error> {
        match decoded {
            Decoded::Gyro(_) | Decoded::Accel(_) | Decoded::Temperature(_) => {
                self.rows.take(decoded);
                return self.drain(converted);
            }
            Decoded::Corrected(batch) => write(&mut self.corrected, |writer| write_corrected(batch, writer))?,
            Decoded::Health(batch) => write(&mut self.health, |writer| write_health(batch, writer))?,
            Decoded::Reference(_) => converted.leave_out("rate references", 1),
            Decoded::Status(_) => converted.leave_out("status messages", 1),
            Decoded::Journal => converted.leave_out("journal messages", 1),
        }
        Ok(())
    }

    /// Writes the rows that are ready.
    fn drain(&mut self, converted: &mut Converted) -> Result<(), Error> {
        while let Some(step) = self.rows.next_step() {
            match step {
                Step::Row(row) => self.write_row(&row, converted)?,
                Step::NewRun => {
                    self.close_raw()?;
                    self.run += 1;
                    self.open_raw()?;
                }
            }
        }
        Ok(())
    }

    fn write_row(&mut self, row: &Row, converted: &mut Converted) -> Result<(), Error> {
        let Some((sink, rows)) = &mut self.raw else { return Ok(()) };
        let columns = &self.columns;
        let (not_held, written) = sink.write(|writer| columns.write_row(row, writer))?;
        *rows += u64::from(written);
        converted.lose("ticks with other sensors than most", not_held.other_shape);
        converted.lose("readings of channels without a name", not_held.no_column);
        Ok(())
    }

    /// Everything is there: ends the files, and enters them.
    fn finish(mut self, converted: &mut Converted) -> Result<Vec<Partial>, Error> {
        self.rows.finish();
        self.drain(converted)?;
        converted.add(&self.rows.tally());
        self.close_raw()?;
        for (sink, what) in
            [(self.corrected.take(), "corrected ticks"), (self.health.take(), "health readings")]
        {
            if let Some((sink, rows)) = sink {
                self.whole.push((sink.finish()?, what, rows));
            }
        }
        let mut partials = Vec::new();
        for (partial, what, rows) in mem::take(&mut self.whole) {
            let (path, unit) = (partial.path().to_owned(), Some(self.unit.clone()));
            converted.files.push(Written { path, unit, what, rows });
            partials.push(partial);
        }
        Ok(partials)
    }
}

/// Writes rows to a file, where it is there, and counts them.
fn write(
    file: &mut Option<(Sink, u64)>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<u64>,
) -> Result<(), Error> {
    if let Some((sink, rows)) = file {
        *rows += sink.write(write)?;
    }
    Ok(())
}

fn write_corrected(batch: &CorrectedBatch, writer: &mut dyn Write) -> io::Result<u64> {
    batch.ticks.iter().try_for_each(|tick| write_tick(writer, tick))?;
    Ok(batch.ticks.len() as u64)
}

fn write_health(batch: &HealthBatch, writer: &mut dyn Write) -> io::Result<u64> {
    let mut rows = 0;
    for tick in &batch.ticks {
        for reading in &tick.readings {
            let name = reading.name.replace('"', "\"\"");
            let quote = if name.contains([',', '"', '\n', '\r']) { "\"" } else { "" };
            writeln!(writer, "{},{quote}{name}{quote},{:?}", tick.time_ns, reading.value)?;
            rows += 1;
        }
    }
    Ok(rows)
}
