//! What each stream's rows hold, column by column.

use isotherm_correction::sample::{AccelTick, GyroTick, LasingMode, OutputKind, SensorFlags};
use isotherm_correction::sigma::Causes;
use isotherm_correction::units::Span;
use isotherm_log::streams::contents::{CorrectedShape, Shape, Shapes};
use isotherm_protocol::corrected::{AppliedTemperature, CorrectedTick, Revision};
use isotherm_protocol::reference::Reference;

use super::table::{I32, I64, Kind, Row, U64, full, sparse};

/// The case axes.
const AXES: [&str; 3] = ["x", "y", "z"];
/// What standard errors come from, in the order of `Causes::all`.
const CAUSES: [&str; 4] = ["noise", "restoration", "calibration", "clamping"];
/// Small numbers: modes, flags.
const I8: Kind = Kind::Integer(8, true);
const U8: Kind = Kind::Integer(8, false);
const U16: Kind = Kind::Integer(16, false);

/// Columns for the readings of a stream.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sensors {
    counts: usize,
    means: usize,
    half_periods: usize,
}

impl Sensors {
    /// As many as any tick has.
    pub(super) fn of(shapes: &Shapes) -> Self {
        let most = |kind: fn(&Shape) -> bool| {
            shapes.keys().filter(|shape| kind(shape)).map(|shape| shape.sensors).max().unwrap_or(0)
        };
        Self {
            counts: most(|shape| shape.counts),
            means: most(|shape| !shape.counts),
            half_periods: most(|shape| shape.half_periods),
        }
    }

    fn readings(self, row: &mut Row<'_>, mean_unit: &str, output: OutputKind, readings: &[f64]) {
        let (counts, means): (&[f64], &[f64]) = match output {
            OutputKind::Counts => (readings, &[]),
            OutputKind::Mean => (&[], readings),
        };
        #[expect(clippy::cast_possible_truncation, reason = "counts are whole numbers of 32 bits")]
        let counts = counts.iter().map(|count| *count as i64);
        row.each(self.counts, |n| sparse(format!("sensor_{n}_counts"), I32), counts);
        let means = means.iter().copied();
        row.each(self.means, |n| sparse(format!("sensor_{n}_{mean_unit}"), Kind::Double), means);
    }
}

/// A gyro tick.
pub(super) fn gyro(row: &mut Row<'_>, sensors: Sensors, output: OutputKind, tick: &GyroTick) {
    row.full("sequence", U64, tick.sequence);
    row.full("series", U64, tick.series);
    row.full("end_time_ns", I64, tick.end_time.as_ns());
    row.full("duration_ns", U64, length_ns(tick.duration));
    row.sparse("mode", I8, mode(tick.mode));
    row.full("switch_command", Kind::Boolean, tick.switch_command);
    row.sparse("meander", I8, mode(tick.meander));
    sensors.readings(row, "rad_per_s", output, &tick.readings);
    let half = |n: usize| {
        let sign = if n.is_multiple_of(2) { "positive" } else { "negative" };
        sparse(format!("sensor_{}_half_{sign}_counts", n / 2), I32)
    };
    let halves = tick.half_periods.iter().flat_map(|half| [half.positive, half.negative]);
    row.each(2 * sensors.half_periods, half, halves.map(i64::from));
}

/// An accelerometer tick.
pub(super) fn accel(row: &mut Row<'_>, sensors: Sensors, output: OutputKind, tick: &AccelTick) {
    row.full("sequence", U64, tick.sequence);
    row.full("end_time_ns", I64, tick.end_time.as_ns());
    row.full("duration_ns", U64, length_ns(tick.duration));
    sensors.readings(row, "v_or_m_per_s2", output, &tick.readings);
}

/// A reading of a temperature, or of the instrument's health: what its name and its value are called, and are.
pub(super) fn reading(
    row: &mut Row<'_>,
    time_ns: i64,
    (name, of): (&str, &str),
    (value, reading): (&str, f64),
) {
    row.full("time_ns", I64, time_ns);
    row.full(name, Kind::Text, of);
    row.full(value, Kind::Double, reading);
}

/// A reference.
pub(super) fn reference(row: &mut Row<'_>, reference: &Reference) {
    row.full("start_ns", I64, reference.start_ns);
    row.full("end_ns", I64, reference.end_ns);
    axes(row, "angular_rate", "rad_per_s", reference.angular_rate_rad_per_s);
    row.full("sigma_rad_per_s", Kind::Double, reference.sigma_rad_per_s);
}

/// A corrected tick.
pub(super) fn corrected(row: &mut Row<'_>, shape: CorrectedShape, revision: Revision, tick: &CorrectedTick) {
    row.full("sequence", U64, tick.sequence);
    row.full("end_time_ns", I64, tick.end_time.as_ns());
    row.full("duration_ns", U64, length_ns(tick.duration));
    row.full("ticks", U16, i64::from(tick.ticks));
    row.full("missed", U64, tick.missed);
    axes(row, "delta_angle", "rad", tick.delta_angle);
    axes(row, "delta_velocity", "m_per_s", tick.delta_velocity);
    row.sparse("mode", I8, mode(tick.mode));
    row.full("flags", U16, i64::from(tick.flags.bits()));
    let bits = |flags: &SensorFlags| i64::from(flags.bits());
    row.each(shape.gyros, |n| sparse(format!("gyro_{n}_flags"), U8), tick.gyro_flags.iter().map(bits));
    row.each(shape.accels, |n| sparse(format!("accel_{n}_flags"), U8), tick.accel_flags.iter().map(bits));
    let parity = |n| sparse(format!("gyro_parity_{n}_rad_per_s"), Kind::Double);
    row.each(shape.gyro_parity, parity, tick.gyro_parity.iter().copied());
    let parity = |n| sparse(format!("accel_parity_{n}_m_per_s2"), Kind::Double);
    row.each(shape.accel_parity, parity, tick.accel_parity.iter().copied());
    row.full("revision", U64, revision.counter);
    row.full("calibration_digest", Kind::Text, &*format!("{:016x}", u64::from_be_bytes(revision.digest)));
    if !shape.sigma {
        return;
    }
    let sigma = tick.sigma.as_deref();
    let (angle, velocity) = (sigma.map(|sigma| sigma.angle), sigma.map(|sigma| sigma.velocity));
    for (increment, unit, causes) in [("angle", "rad", angle), ("velocity", "m_per_s", velocity)] {
        let column = |n: usize| {
            let (cause, axis) = (CAUSES[n / AXES.len()], AXES[n % AXES.len()]);
            sparse(format!("{increment}_{cause}_sigma_{axis}_{unit}"), Kind::Double)
        };
        let cells = causes.iter().flat_map(Causes::all).flatten();
        row.each(CAUSES.len() * AXES.len(), column, cells);
    }
}

/// A channel's temperature as it was applied up to a tick.
pub(super) fn applied(row: &mut Row<'_>, end_time_ns: i64, applied: &AppliedTemperature) {
    row.full("end_time_ns", I64, end_time_ns);
    row.full("channel", Kind::Text, applied.channel.as_str());
    row.full("temperature_deg_c", Kind::Double, applied.temperature_deg_c);
    row.full("rate_deg_c_per_s", Kind::Double, applied.rate_deg_c_per_s);
}

/// A status: the state's name, and all of it as JSON.
pub(super) fn status(row: &mut Row<'_>, status: &serde_json::Value) {
    let state = status.get("state").map_or(String::new(), |state| match state.as_str() {
        Some(word) => word.to_owned(),
        None => state.to_string(),
    });
    row.full("state", Kind::Text, &*state);
    row.full("status", Kind::Json, &*status.to_string());
}

fn axes(row: &mut Row<'_>, what: &str, unit: &str, values: [f64; 3]) {
    row.each(3, |axis| full(format!("{what}_{}_{unit}", AXES[axis]), Kind::Double), values);
}

/// Length of a span (ns).
fn length_ns(span: Span) -> u64 {
    span.as_ns().unsigned_abs()
}

fn mode(mode: Option<LasingMode>) -> Option<i64> {
    mode.map(|mode| match mode {
        LasingMode::Plus => 1,
        LasingMode::Minus => -1,
    })
}
