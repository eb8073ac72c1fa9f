//! The streams of a unit as tables.

use isotherm_protocol::key::UnitId;

use super::rows::{self, Sensors};
use super::table::{Row, Table, U64};
use crate::Written;
use isotherm_log::error::Error;
use isotherm_log::file::Partial;
use isotherm_log::streams::contents::{CorrectedShape, Shapes, UnitContents};
use isotherm_log::streams::decoded::Decoded;

/// The files of a unit: one for each stream that the log has.
#[derive(Debug)]
pub(crate) struct UnitTables {
    unit: UnitId,
    /// By stream.
    tables: Vec<(&'static str, Table)>,
    gyros: Sensors,
    accels: Sensors,
    shape: CorrectedShape,
}

impl UnitTables {
    /// Creates the files for what a log holds of a unit; `place` gives that of a stream's file.
    ///
    /// `provenance`: names and values for the metadata of every file; unit and stream are added.
    ///
    /// # Errors
    /// [`Error::File`], and those of `place`.
    pub(crate) fn create(
        unit: &UnitId,
        contents: &UnitContents,
        provenance: &[(String, String)],
        place: impl Fn(&'static str) -> Result<Partial, Error>,
    ) -> Result<Self, Error> {
        let ticks = |shapes: &Shapes| shapes.values().sum::<u64>();
        let (gyros, accels) = (Sensors::of(&contents.gyro), Sensors::of(&contents.accel));
        let shape = contents.corrected;
        // At most: where every message has one tick.
        let applied = contents.corrected_ticks.saturating_mul(contents.applied_channels.len() as u64);
        let streams = [
            ("raw_gyro", ticks(&contents.gyro)),
            ("raw_accel", ticks(&contents.accel)),
            ("raw_temperature", contents.temperature_readings),
            ("raw_health", contents.health_readings),
            ("reference", contents.references),
            ("corrected", contents.corrected_ticks),
            ("applied_temperature", applied),
            ("status", contents.status),
        ];
        let mut tables = Vec::new();
        for (stream, expected) in streams.into_iter().filter(|(_, expected)| *expected > 0) {
            let mut words = provenance.to_vec();
            words.push(("unit".to_owned(), unit.to_string()));
            words.push(("stream".to_owned(), stream.to_owned()));
            tables.push((stream, Table::create(place(stream)?, expected, words)?));
        }
        Ok(Self { unit: unit.clone(), tables, gyros, accels, shape })
    }

    /// Writes a message of the unit, received at a time; false where it has no place.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn take(&mut self, received_ns: u64, decoded: &Decoded) -> Result<bool, Error> {
        let Self { gyros, accels, shape, .. } = *self;
        match decoded {
            Decoded::Gyro(batch) => self.write(received_ns, "raw_gyro", &batch.ticks, |row, tick| {
                rows::gyro(row, gyros, batch.output, tick);
            })?,
            Decoded::Accel(batch) => self.write(received_ns, "raw_accel", &batch.ticks, |row, tick| {
                rows::accel(row, accels, batch.output, tick);
            })?,
            Decoded::Temperature(batch) => {
                self.write(received_ns, "raw_temperature", &batch.readings, |row, reading| {
                    let (name, value) = (("channel", reading.channel.as_str()), ("raw", reading.raw));
                    rows::reading(row, reading.time.as_ns(), name, value);
                })?;
            }
            Decoded::Health(batch) => {
                let readings =
                    batch.ticks.iter().flat_map(|tick| tick.readings.iter().map(|of| (tick.time_ns, of)));
                self.write(received_ns, "raw_health", readings, |row, (time_ns, reading)| {
                    let (name, value) = (("name", reading.name.as_str()), ("value", reading.value));
                    rows::reading(row, time_ns, name, value);
                })?;
            }
            Decoded::Reference(reference) => {
                self.write(received_ns, "reference", [reference], rows::reference)?;
            }
            Decoded::Corrected(batch) => {
                self.write(received_ns, "corrected", &batch.ticks, |row, tick| {
                    rows::corrected(row, shape, batch.revision, tick);
                })?;
                let last = batch.ticks.last().map(|last| last.end_time.as_ns());
                let applied =
                    last.into_iter().flat_map(|end| batch.temperatures.iter().map(move |t| (end, t)));
                self.write(received_ns, "applied_temperature", applied, |row, (end_ns, applied)| {
                    rows::applied(row, end_ns, applied);
                })?;
            }
            Decoded::Status(status) => {
                // Plain structures of numbers and texts always serialise.
                let status = serde_json::to_value(status).unwrap_or_default();
                self.write(received_ns, "status", [status], |row, status| rows::status(row, &status))?;
            }
            Decoded::Journal => return Ok(false),
        }
        Ok(true)
    }

    /// A row for each item, where the log has the stream; each begins with the time of reception.
    fn write<T>(
        &mut self,
        received_ns: u64,
        stream: &str,
        items: impl IntoIterator<Item = T>,
        row: impl Fn(&mut Row<'_>, T),
    ) -> Result<(), Error> {
        let Some((_, table)) = self.tables.iter_mut().find(|(name, _)| *name == stream) else {
            return Ok(());
        };
        items.into_iter().try_for_each(|item| {
            table.push(|cells| {
                cells.full("received_ns", U64, received_ns);
                row(cells, item);
            })
        })
    }

    /// Ends the files, which are to be given their names; gives each stream with its rows.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn finish(self) -> Result<Vec<(Partial, Written)>, Error> {
        let unit = self.unit.to_string();
        let written = self.tables.into_iter().map(|(what, table)| {
            let (partial, rows) = table.finish()?;
            let written = Written { path: partial.path().to_owned(), unit: Some(unit.clone()), what, rows };
            Ok((partial, written))
        });
        written.collect()
    }
}
