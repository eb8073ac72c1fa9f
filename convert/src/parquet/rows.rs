//! The rows of each stream's messages.

use std::fmt::Write as _;
use std::iter::once;

use isotherm_correction::sample::{GyroTick, LasingMode, SensorFlags};
use isotherm_correction::units::Span;
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, HealthBatch, TemperatureBatch};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::status::Status;

use super::columns::{Sensors, padded};
use super::table::{Cell, Table};
use isotherm_log::error::Error;
use isotherm_log::streams::contents::CorrectedShape;

/// A row per gyro tick.
pub(super) fn write_gyro(
    table: Option<&mut Table>,
    sensors: Sensors,
    received_ns: u64,
    batch: &GyroBatch,
) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    for tick in &batch.ticks {
        let head = [
            received_ns.into(),
            tick.sequence.into(),
            tick.series.into(),
            tick.end_time.as_ns().into(),
            length_ns(tick.duration),
            mode(tick.mode),
            Cell::Boolean(tick.switch_command),
            mode(tick.meander),
        ];
        let cells = head.into_iter().chain(sensors.cells(batch.output, &tick.readings));
        table.push(cells.chain(half_periods(tick, sensors.half_periods)))?;
    }
    Ok(())
}

fn half_periods(tick: &GyroTick, sensors: usize) -> impl Iterator<Item = Cell<'static>> {
    let halves = tick.half_periods.iter().flat_map(|half| [half.positive, half.negative]);
    let cells: Vec<_> = padded(halves.map(|count| i64::from(count).into()), 2 * sensors).collect();
    cells.into_iter()
}

/// A row per accelerometer tick.
pub(super) fn write_accel(
    table: Option<&mut Table>,
    sensors: Sensors,
    received_ns: u64,
    batch: &AccelBatch,
) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    for tick in &batch.ticks {
        let head = [
            received_ns.into(),
            tick.sequence.into(),
            tick.end_time.as_ns().into(),
            length_ns(tick.duration),
        ];
        table.push(head.into_iter().chain(sensors.cells(batch.output, &tick.readings)))?;
    }
    Ok(())
}

/// A row per reading.
pub(super) fn write_temperature(
    table: Option<&mut Table>,
    received_ns: u64,
    batch: &TemperatureBatch,
) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    for reading in &batch.readings {
        let time_ns = reading.time.as_ns();
        table.push([received_ns.into(), time_ns.into(), Cell::Text(&reading.channel), reading.raw.into()])?;
    }
    Ok(())
}

/// A row per reading.
pub(super) fn write_health(
    table: Option<&mut Table>,
    received_ns: u64,
    batch: &HealthBatch,
) -> Result<(), Error> {
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

/// A row per reference.
pub(super) fn write_reference(
    table: Option<&mut Table>,
    received_ns: u64,
    reference: &Reference,
) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    let head = [received_ns.into(), reference.start_ns.into(), reference.end_ns.into()];
    let rates = reference.angular_rate_rad_per_s.into_iter().map(Cell::from);
    table.push(head.into_iter().chain(rates).chain(once(reference.sigma_rad_per_s.into())))
}

/// A row per corrected tick.
pub(super) fn write_corrected(
    table: Option<&mut Table>,
    shape: CorrectedShape,
    received_ns: u64,
    batch: &CorrectedBatch,
) -> Result<(), Error> {
    let Some(table) = table else { return Ok(()) };
    let digest = hex(&batch.revision.digest);
    for tick in &batch.ticks {
        let cells = corrected_cells(received_ns, tick, shape);
        let cells = cells.chain([batch.revision.counter.into(), Cell::Text(&digest)]);
        table.push(cells.chain(sigma(tick, shape)))?;
    }
    Ok(())
}

fn corrected_cells<'a>(
    received_ns: u64,
    tick: &'a CorrectedTick,
    shape: CorrectedShape,
) -> impl Iterator<Item = Cell<'a>> {
    let head = [
        received_ns.into(),
        tick.sequence.into(),
        tick.end_time.as_ns().into(),
        length_ns(tick.duration),
        i64::from(tick.ticks).into(),
        tick.missed.into(),
    ];
    let deltas = tick.delta_angle.iter().chain(&tick.delta_velocity);
    let flags = |flags: &'a [SensorFlags], length| {
        padded(flags.iter().map(|flags| i64::from(flags.bits()).into()), length)
    };
    let parity = |parity: &'a [f64], length| padded(parity.iter().map(|value| (*value).into()), length);
    head.into_iter()
        .chain(deltas.map(|delta| (*delta).into()))
        .chain([mode(tick.mode), i64::from(tick.flags.bits()).into()])
        .chain(flags(&tick.gyro_flags, shape.gyros))
        .chain(flags(&tick.accel_flags, shape.accels))
        .chain(parity(&tick.gyro_parity, shape.gyro_parity))
        .chain(parity(&tick.accel_parity, shape.accel_parity))
}

/// Standard errors: all of the angle, then of the velocity.
fn sigma<'a>(tick: &CorrectedTick, shape: CorrectedShape) -> impl Iterator<Item = Cell<'a>> + use<'a> {
    let causes = tick.sigma.iter().flat_map(|sigma| [sigma.angle, sigma.velocity]);
    let cells: Vec<_> = causes.flat_map(|causes| causes.all()).flatten().map(Cell::from).collect();
    padded(cells.into_iter(), if shape.sigma { 24 } else { 0 })
}

/// A row per channel.
pub(super) fn write_applied(
    table: Option<&mut Table>,
    received_ns: u64,
    batch: &CorrectedBatch,
) -> Result<(), Error> {
    let (Some(table), Some(last)) = (table, batch.ticks.last()) else { return Ok(()) };
    for applied in &batch.temperatures {
        table.push([
            received_ns.into(),
            last.end_time.as_ns().into(),
            Cell::Text(&applied.channel),
            applied.temperature_deg_c.into(),
            applied.rate_deg_c_per_s.into(),
        ])?;
    }
    Ok(())
}

/// A row per message.
pub(super) fn write_status(
    table: Option<&mut Table>,
    received_ns: u64,
    status: &Status,
) -> Result<(), Error> {
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

/// Length of a span (ns).
fn length_ns(span: Span) -> Cell<'static> {
    span.as_ns().unsigned_abs().into()
}

fn mode(mode: Option<LasingMode>) -> Cell<'static> {
    Cell::from(mode.map(|mode| match mode {
        LasingMode::Plus => 1_i64,
        LasingMode::Minus => -1,
    }))
}

/// Bytes as hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
