//! The columns of each stream.

use std::iter::repeat;

use isotherm_correction::sample::{self, OutputKind};

use super::table::{Cell, Column, I32, I64, Kind, U64, full, sparse};
use isotherm_log::streams::contents::{CorrectedShape, Shape, Shapes};

/// The case axes.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Small numbers: modes, flags.
const I8: Kind = Kind::Integer(8, true);
const U8: Kind = Kind::Integer(8, false);
const U16: Kind = Kind::Integer(16, false);

/// Columns for the readings of a stream.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sensors {
    counts: usize,
    means: usize,
    pub(super) half_periods: usize,
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

    pub(super) fn cells(
        self,
        output: OutputKind,
        readings: &sample::Sensors<f64>,
    ) -> impl Iterator<Item = Cell<'static>> {
        let (counts, means): (&[f64], &[f64]) = match output {
            OutputKind::Counts => (readings, &[]),
            OutputKind::Mean => (&[], readings),
        };
        #[expect(clippy::cast_possible_truncation, reason = "counts are whole numbers of 32 bits")]
        let counts = padded(counts.iter().map(|count| (*count as i64).into()), self.counts);
        counts
            .chain(padded(means.iter().map(|mean| (*mean).into()), self.means))
            .collect::<Vec<_>>()
            .into_iter()
    }
}

/// So many cells, empty ones at the end.
pub(super) fn padded<'a>(
    cells: impl Iterator<Item = Cell<'a>>,
    length: usize,
) -> impl Iterator<Item = Cell<'a>> {
    cells.chain(repeat(Cell::Empty)).take(length)
}

pub(super) fn gyro_columns(sensors: Sensors) -> Vec<Column> {
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

pub(super) fn accel_columns(sensors: Sensors) -> Vec<Column> {
    let mut columns = vec![
        full("received_ns", U64),
        full("sequence", U64),
        full("end_time_ns", I64),
        full("duration_ns", U64),
    ];
    columns.extend(sensors.columns("v_or_m_per_s2"));
    columns
}

pub(super) fn reading_columns(name: &str, value: &str) -> Vec<Column> {
    vec![full("received_ns", U64), full("time_ns", I64), full(name, Kind::Text), full(value, Kind::Double)]
}

pub(super) fn reference_columns() -> Vec<Column> {
    let mut columns = vec![full("received_ns", U64), full("start_ns", I64), full("end_ns", I64)];
    columns.extend(AXES.map(|axis| full(format!("angular_rate_{axis}_rad_per_s"), Kind::Double)));
    columns.push(full("sigma_rad_per_s", Kind::Double));
    columns
}

pub(super) fn corrected_columns(shape: CorrectedShape) -> Vec<Column> {
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
    for (increment, unit) in [("angle", "rad"), ("velocity", "m_per_s")].into_iter().filter(|_| shape.sigma) {
        for cause in ["noise", "restoration", "calibration", "clamping"] {
            let column = |axis| sparse(format!("{increment}_{cause}_sigma_{axis}_{unit}"), Kind::Double);
            columns.extend(AXES.map(column));
        }
    }
    columns
}

pub(super) fn applied_columns() -> Vec<Column> {
    vec![
        full("received_ns", U64),
        full("end_time_ns", I64),
        full("channel", Kind::Text),
        full("temperature_deg_c", Kind::Double),
        full("rate_deg_c_per_s", Kind::Double),
    ]
}

pub(super) fn status_columns() -> Vec<Column> {
    vec![full("received_ns", U64), full("state", Kind::Text), full("status", Kind::Json)]
}
