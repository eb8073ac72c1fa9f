//! The streams of a unit as tables.

use std::iter::once;
use std::path::{Path, PathBuf};

use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::{
    AccelBatch, GyroBatch, GyroTick, HealthBatch, Mode, Readings, TemperatureBatch,
};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::status::Status;

use super::table::{Cell, Column, I32, I64, Kind, Table, U64, full, sparse};
use crate::convert::Written;
use crate::convert::contents::{CorrectedShape, Shapes, UnitContents};
use crate::convert::decoded::Decoded;
use crate::error::Error;

/// Names of the streams.
pub const STREAMS: [&str; 8] = [
    "raw_gyro",
    "raw_accel",
    "raw_temperature",
    "raw_health",
    "reference",
    "corrected",
    "applied_temperature",
    "status",
];

/// The case axes.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Small numbers: modes, flags.
const I8: Kind = Kind::Integer(8, true);
const U8: Kind = Kind::Integer(8, false);
const U16: Kind = Kind::Integer(16, false);

/// The files of a unit: one for each stream that the log has.
#[derive(Debug)]
pub struct UnitTables {
    unit: UnitId,
    gyro: Option<(Table, Sensors)>,
    accel: Option<(Table, Sensors)>,
    temperature: Option<Table>,
    health: Option<Table>,
    reference: Option<Table>,
    corrected: Option<(Table, CorrectedShape)>,
    applied: Option<Table>,
    status: Option<Table>,
}

/// Columns for the readings of a stream.
#[derive(Debug, Clone, Copy)]
struct Sensors {
    counts: usize,
    means: usize,
    half_periods: usize,
}

impl Sensors {
    /// As many as any tick has.
    fn of(shapes: &Shapes) -> Self {
        let most = |kind: fn(&crate::convert::contents::Shape) -> bool| {
            shapes.keys().filter(|shape| kind(shape)).map(|shape| shape.sensors).max().unwrap_or(0)
        };
        Self {
            counts: most(|shape| shape.counts),
            means: most(|shape| !shape.counts),
            half_periods: most(|shape| shape.half_periods),
        }
    }

    fn columns(self, mean_unit: &str) -> Vec<Column> {
        let mut columns: Vec<_> =
            (0..self.counts).map(|n| sparse(format!("sensor_{n}_counts"), I32)).collect();
        columns.extend((0..self.means).map(|n| sparse(format!("sensor_{n}_{mean_unit}"), Kind::Double)));
        for n in 0..self.half_periods {
            columns.push(sparse(format!("sensor_{n}_half_positive_counts"), I32));
            columns.push(sparse(format!("sensor_{n}_half_negative_counts"), I32));
        }
        columns
    }

    fn cells(self, readings: &Readings) -> impl Iterator<Item = Cell<'static>> {
        let (counts, means): (&[i32], &[f64]) = match readings {
            Readings::Counts(counts) => (counts, &[]),
            Readings::Means(means) => (&[], means),
        };
        let counts = padded(counts.iter().map(|count| i64::from(*count).into()), self.counts);
        counts
            .chain(padded(means.iter().map(|mean| (*mean).into()), self.means))
            .collect::<Vec<_>>()
            .into_iter()
    }
}

/// So many cells, empty ones at the end.
fn padded<'a>(cells: impl Iterator<Item = Cell<'a>>, length: usize) -> impl Iterator<Item = Cell<'a>> {
    cells.chain(std::iter::repeat(Cell::Empty)).take(length)
}

impl UnitTables {
    /// Creates the files for what a log holds of a unit; `path` gives the place of a stream's file.
    ///
    /// `provenance`: names and values for the metadata of every file; unit and stream are added.
    ///
    /// # Errors
    /// [`Error::File`], and those of `path`.
    pub fn create<E: From<Error>>(
        unit: &UnitId,
        contents: &UnitContents,
        provenance: &[(String, String)],
        mut path: impl FnMut(&'static str) -> Result<PathBuf, E>,
    ) -> Result<Self, E> {
        let mut create = |stream: &'static str, rows: u64, columns: Vec<Column>| {
            if rows == 0 {
                return Ok(None);
            }
            let mut words = provenance.to_vec();
            words.push(("unit".to_owned(), unit.to_string()));
            words.push(("stream".to_owned(), stream.to_owned()));
            let path: PathBuf = path(stream)?;
            Ok::<_, E>(Some(Table::create(Path::new(&path), columns, rows, &words)?))
        };
        let ticks = |shapes: &Shapes| shapes.values().sum::<u64>();
        let (gyro, accel) = (Sensors::of(&contents.gyro), Sensors::of(&contents.accel));
        let channels = contents.applied_channels.len() as u64;
        let applied_rows = if channels == 0 { 0 } else { contents.corrected_ticks.max(channels) };
        Ok(Self {
            unit: unit.clone(),
            gyro: create("raw_gyro", ticks(&contents.gyro), gyro_columns(gyro))?.map(|table| (table, gyro)),
            accel: create("raw_accel", ticks(&contents.accel), accel_columns(accel))?
                .map(|table| (table, accel)),
            temperature: create(
                "raw_temperature",
                contents.temperature_readings,
                reading_columns("channel", "raw"),
            )?,
            health: create("raw_health", contents.health_readings, reading_columns("name", "value"))?,
            reference: create("reference", contents.references, reference_columns())?,
            corrected: create("corrected", contents.corrected_ticks, corrected_columns(contents.corrected))?
                .map(|table| (table, contents.corrected)),
            applied: create("applied_temperature", applied_rows, applied_columns())?,
            status: create("status", contents.status, status_columns())?,
        })
    }

    /// Writes a message of the unit, received at a time; false where it has no place.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn take(&mut self, received_ns: u64, decoded: &Decoded) -> Result<bool, Error> {
        match decoded {
            Decoded::Gyro(batch) => write_gyro(self.gyro.as_mut(), received_ns, batch)?,
            Decoded::Accel(batch) => write_accel(self.accel.as_mut(), received_ns, batch)?,
            Decoded::Temperature(batch) => write_temperature(self.temperature.as_mut(), received_ns, batch)?,
            Decoded::Health(batch) => write_health(self.health.as_mut(), received_ns, batch)?,
            Decoded::Reference(reference) => {
                write_reference(self.reference.as_mut(), received_ns, reference)?;
            }
            Decoded::Corrected(batch) => {
                write_corrected(self.corrected.as_mut(), received_ns, batch)?;
                write_applied(self.applied.as_mut(), received_ns, batch)?;
            }
            Decoded::Status(status) => write_status(self.status.as_mut(), received_ns, status)?,
            Decoded::Journal => return Ok(false),
        }
        Ok(true)
    }

    /// Ends the files; gives each stream with its rows.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn finish(self) -> Result<Vec<Written>, Error> {
        let tables = [
            ("raw_gyro", self.gyro.map(|(table, _)| table)),
            ("raw_accel", self.accel.map(|(table, _)| table)),
            ("raw_temperature", self.temperature),
            ("raw_health", self.health),
            ("reference", self.reference),
            ("corrected", self.corrected.map(|(table, _)| table)),
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

fn gyro_columns(sensors: Sensors) -> Vec<Column> {
    let mut columns = vec![
        full("received_ns", U64),
        full("sequence", U64),
        full("series", U64),
        full("end_time_ns", I64),
        full("duration_ns", U64),
        sparse("mode", I8),
        full("switch_command", Kind::Boolean),
        sparse("meander", I8),
    ];
    columns.extend(sensors.columns("rad_per_s"));
    columns
}

fn accel_columns(sensors: Sensors) -> Vec<Column> {
    let mut columns = vec![
        full("received_ns", U64),
        full("sequence", U64),
        full("end_time_ns", I64),
        full("duration_ns", U64),
    ];
    columns.extend(sensors.columns("v_or_m_per_s2"));
    columns
}

fn reading_columns(name: &str, value: &str) -> Vec<Column> {
    vec![full("received_ns", U64), full("time_ns", I64), full(name, Kind::Text), full(value, Kind::Double)]
}

fn reference_columns() -> Vec<Column> {
    let mut columns = vec![full("received_ns", U64), full("start_ns", I64), full("end_ns", I64)];
    columns.extend(AXES.map(|axis| full(format!("angular_rate_{axis}_rad_per_s"), Kind::Double)));
    columns.push(full("sigma_rad_per_s", Kind::Double));
    columns
}

fn corrected_columns(shape: CorrectedShape) -> Vec<Column> {
    let mut columns = vec![
        full("received_ns", U64),
        full("sequence", U64),
        full("end_time_ns", I64),
        full("duration_ns", U64),
        full("ticks", U16),
        full("missed", U64),
    ];
    columns.extend(AXES.map(|axis| full(format!("delta_angle_{axis}_rad"), Kind::Double)));
    columns.extend(AXES.map(|axis| full(format!("delta_velocity_{axis}_m_per_s"), Kind::Double)));
    columns.extend([sparse("mode", I8), full("flags", U16)]);
    columns.extend((0..shape.gyros).map(|n| sparse(format!("gyro_{n}_flags"), U8)));
    columns.extend((0..shape.accels).map(|n| sparse(format!("accel_{n}_flags"), U8)));
    let parity = |n| sparse(format!("gyro_parity_{n}_rad_per_s"), Kind::Double);
    columns.extend((0..shape.gyro_parity).map(parity));
    let parity = |n| sparse(format!("accel_parity_{n}_m_per_s2"), Kind::Double);
    columns.extend((0..shape.accel_parity).map(parity));
    columns.extend([full("revision", U64), full("calibration_digest", Kind::Text)]);
    columns
}

fn applied_columns() -> Vec<Column> {
    vec![
        full("received_ns", U64),
        full("end_time_ns", I64),
        full("channel", Kind::Text),
        full("temperature_deg_c", Kind::Double),
        full("rate_deg_c_per_s", Kind::Double),
    ]
}

fn status_columns() -> Vec<Column> {
    vec![full("received_ns", U64), full("state", Kind::Text), full("status", Kind::Json)]
}

fn write_gyro(
    stream: Option<&mut (Table, Sensors)>,
    received_ns: u64,
    batch: &GyroBatch,
) -> Result<(), Error> {
    let Some((table, sensors)) = stream else { return Ok(()) };
    for (tick, index) in batch.ticks.iter().zip(0..) {
        let sequence = batch.first_sequence.saturating_add(index);
        let head = [
            received_ns.into(),
            sequence.into(),
            batch.series.into(),
            tick.end_time_ns.into(),
            tick.duration_ns.into(),
            mode(tick.mode),
            Cell::Boolean(tick.switch_command),
            mode(tick.meander),
        ];
        let cells = head.into_iter().chain(sensors.cells(&tick.readings));
        table.push(cells.chain(half_periods(tick, sensors.half_periods)))?;
    }
    Ok(())
}

fn half_periods(tick: &GyroTick, sensors: usize) -> impl Iterator<Item = Cell<'static>> {
    let halves = tick.half_periods.iter().flat_map(|half| [half.positive, half.negative]);
    let cells: Vec<_> = padded(halves.map(|count| i64::from(count).into()), 2 * sensors).collect();
    cells.into_iter()
}

fn write_accel(
    stream: Option<&mut (Table, Sensors)>,
    received_ns: u64,
    batch: &AccelBatch,
) -> Result<(), Error> {
    let Some((table, sensors)) = stream else { return Ok(()) };
    for (tick, index) in batch.ticks.iter().zip(0..) {
        let sequence = batch.first_sequence.saturating_add(index);
        let head = [received_ns.into(), sequence.into(), tick.end_time_ns.into(), tick.duration_ns.into()];
        table.push(head.into_iter().chain(sensors.cells(&tick.readings)))?;
    }
    Ok(())
}

fn write_temperature(
    table: Option<&mut Table>,
    received_ns: u64,
    batch: &TemperatureBatch,
) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    for tick in &batch.ticks {
        for (channel, raw) in batch.channels.iter().zip(&tick.raw) {
            table.push([received_ns.into(), tick.time_ns.into(), Cell::Text(channel), (*raw).into()])?;
        }
    }
    Ok(())
}

fn write_health(table: Option<&mut Table>, received_ns: u64, batch: &HealthBatch) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    for tick in &batch.ticks {
        for reading in &tick.readings {
            table.push([
                received_ns.into(),
                tick.time_ns.into(),
                Cell::Text(&reading.name),
                reading.value.into(),
            ])?;
        }
    }
    Ok(())
}

fn write_reference(table: Option<&mut Table>, received_ns: u64, reference: &Reference) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    let head = [received_ns.into(), reference.start_ns.into(), reference.end_ns.into()];
    let rates = reference.angular_rate_rad_per_s.into_iter().map(Cell::from);
    table.push(head.into_iter().chain(rates).chain(once(reference.sigma_rad_per_s.into())))
}

fn write_corrected(
    stream: Option<&mut (Table, CorrectedShape)>,
    received_ns: u64,
    batch: &CorrectedBatch,
) -> Result<(), Error> {
    let Some((table, shape)) = stream else { return Ok(()) };
    let digest: String = batch.revision.digest.iter().map(|byte| format!("{byte:02x}")).collect();
    for tick in &batch.ticks {
        let cells = corrected_cells(received_ns, tick, shape);
        table.push(cells.chain([batch.revision.counter.into(), Cell::Text(&digest)]))?;
    }
    Ok(())
}

fn corrected_cells<'a>(
    received_ns: u64,
    tick: &'a CorrectedTick,
    shape: &CorrectedShape,
) -> impl Iterator<Item = Cell<'a>> {
    let head = [
        received_ns.into(),
        tick.sequence.into(),
        tick.end_time_ns.into(),
        tick.duration_ns.into(),
        i64::from(tick.ticks).into(),
        tick.missed.into(),
    ];
    let deltas = tick.delta_angle_rad.iter().chain(&tick.delta_velocity_m_per_s);
    let flags = |flags: &'a [u8], length| padded(flags.iter().map(|bits| i64::from(*bits).into()), length);
    let parity = |parity: &'a [f64], length| padded(parity.iter().map(|value| (*value).into()), length);
    head.into_iter()
        .chain(deltas.map(|delta| (*delta).into()))
        .chain([mode(tick.mode), i64::from(tick.flags).into()])
        .chain(flags(&tick.gyro_flags, shape.gyros))
        .chain(flags(&tick.accel_flags, shape.accels))
        .chain(parity(&tick.gyro_parity_rad_per_s, shape.gyro_parity))
        .chain(parity(&tick.accel_parity_m_per_s2, shape.accel_parity))
}

fn write_applied(table: Option<&mut Table>, received_ns: u64, batch: &CorrectedBatch) -> Result<(), Error> {
    let (Some(table), Some(last)) = (table, batch.ticks.last()) else { return Ok(()) };
    for applied in &batch.temperatures {
        table.push([
            received_ns.into(),
            last.end_time_ns.into(),
            Cell::Text(&applied.channel),
            applied.temperature_deg_c.into(),
            applied.rate_deg_c_per_s.into(),
        ])?;
    }
    Ok(())
}

fn write_status(table: Option<&mut Table>, received_ns: u64, status: &Status) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    // Plain structures of numbers and texts always serialise.
    let value = serde_json::to_value(status).unwrap_or_default();
    let state = value.get("state").map_or(String::new(), |state| match state.as_str() {
        Some(word) => word.to_owned(),
        None => state.to_string(),
    });
    let text = value.to_string();
    table.push([received_ns.into(), Cell::Text(&state), Cell::Text(&text)])
}

fn mode(mode: Option<Mode>) -> Cell<'static> {
    Cell::from(mode.map(|mode| match mode {
        Mode::Plus => 1_i64,
        Mode::Minus => -1,
    }))
}
