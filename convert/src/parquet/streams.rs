//! The streams of a unit as tables.

use std::path::PathBuf;

use isotherm_protocol::key::UnitId;

use super::columns::{
    Sensors, accel_columns, applied_columns, corrected_columns, gyro_columns, reading_columns,
    reference_columns, status_columns,
};
use super::rows;
use super::table::{Column, Table};
use crate::Written;
use isotherm_log::error::Error;
use isotherm_log::streams::contents::{CorrectedShape, Shapes, UnitContents};
use isotherm_log::streams::decoded::Decoded;

/// The files of a unit: one for each stream that the log has.
#[derive(Debug)]
pub(crate) struct UnitTables {
    unit: UnitId,
    gyro: Option<Table>,
    gyros: Sensors,
    accel: Option<Table>,
    accels: Sensors,
    temperature: Option<Table>,
    health: Option<Table>,
    reference: Option<Table>,
    corrected: Option<Table>,
    shape: CorrectedShape,
    applied: Option<Table>,
    status: Option<Table>,
}

impl UnitTables {
    /// Creates the files for what a log holds of a unit; `path` gives the place of a stream's file.
    ///
    /// `provenance`: names and values for the metadata of every file; unit and stream are added.
    ///
    /// # Errors
    /// [`Error::File`], and those of `path`.
    pub(crate) fn create<E: From<Error>>(
        unit: &UnitId,
        contents: &UnitContents,
        provenance: &[(String, String)],
        mut path: impl FnMut(&'static str) -> Result<PathBuf, E>,
    ) -> Result<Self, E> {
        let mut create = |stream: &'static str, rows: u64, columns: &[Column]| {
            if rows == 0 {
                return Ok(None);
            }
            let mut words = provenance.to_vec();
            words.push(("unit".to_owned(), unit.to_string()));
            words.push(("stream".to_owned(), stream.to_owned()));
            let path: PathBuf = path(stream)?;
            Ok::<_, E>(Some(Table::create(&path, columns, rows, &words)?))
        };
        let ticks = |shapes: &Shapes| shapes.values().sum::<u64>();
        let (gyros, accels) = (Sensors::of(&contents.gyro), Sensors::of(&contents.accel));
        // At most: where every message has one tick.
        let applied = contents.corrected_ticks.saturating_mul(contents.applied_channels.len() as u64);
        Ok(Self {
            unit: unit.clone(),
            gyro: create("raw_gyro", ticks(&contents.gyro), &gyro_columns(gyros))?,
            gyros,
            accel: create("raw_accel", ticks(&contents.accel), &accel_columns(accels))?,
            accels,
            temperature: create(
                "raw_temperature",
                contents.temperature_readings,
                &reading_columns("channel", "raw"),
            )?,
            health: create("raw_health", contents.health_readings, &reading_columns("name", "value"))?,
            reference: create("reference", contents.references, &reference_columns())?,
            corrected: create("corrected", contents.corrected_ticks, &corrected_columns(contents.corrected))?,
            shape: contents.corrected,
            applied: create("applied_temperature", applied, &applied_columns())?,
            status: create("status", contents.status, &status_columns())?,
        })
    }

    /// Writes a message of the unit, received at a time; false where it has no place.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn take(&mut self, received_ns: u64, decoded: &Decoded) -> Result<bool, Error> {
        match decoded {
            Decoded::Gyro(batch) => rows::write_gyro(self.gyro.as_mut(), self.gyros, received_ns, batch)?,
            Decoded::Accel(batch) => rows::write_accel(self.accel.as_mut(), self.accels, received_ns, batch)?,
            Decoded::Temperature(batch) => {
                rows::write_temperature(self.temperature.as_mut(), received_ns, batch)?;
            }
            Decoded::Health(batch) => rows::write_health(self.health.as_mut(), received_ns, batch)?,
            Decoded::Reference(reference) => {
                rows::write_reference(self.reference.as_mut(), received_ns, reference)?;
            }
            Decoded::Corrected(batch) => {
                rows::write_corrected(self.corrected.as_mut(), self.shape, received_ns, batch)?;
                rows::write_applied(self.applied.as_mut(), received_ns, batch)?;
            }
            Decoded::Status(status) => rows::write_status(self.status.as_mut(), received_ns, status)?,
            Decoded::Journal => return Ok(false),
        }
        Ok(true)
    }

    /// Ends the files; gives each stream with its rows.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn finish(self) -> Result<Vec<Written>, Error> {
        let tables = [
            ("raw_gyro", self.gyro),
            ("raw_accel", self.accel),
            ("raw_temperature", self.temperature),
            ("raw_health", self.health),
            ("reference", self.reference),
            ("corrected", self.corrected),
            ("applied_temperature", self.applied),
            ("status", self.status),
        ];
        let mut written = Vec::new();
        for (what, table) in tables {
            let Some(table) = table else { continue };
            let path = table.path().to_owned();
            let rows = table.finish()?;
            written.push(Written { path, unit: Some(self.unit.to_string()), what, rows });
        }
        Ok(written)
    }
}
