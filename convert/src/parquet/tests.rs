//! Tables written and read back.

use std::fs::File;
use std::path::Path;

use isotherm_correction::sample::{
    GyroTick, HalfPeriodCounts, LasingMode, OutputKind, SensorFlags, TickFlags,
};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick, Revision};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::GyroBatch;
use isotherm_protocol::status::Status;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

use super::UnitTables;
use super::table::{Cell, I64, Kind, Row, Table};
use isotherm_log::file::Partial;
use isotherm_log::message::{Message, Topic};
use isotherm_log::streams::contents::Contents;
use isotherm_log::streams::decoded::Decoded;

/// Columns and rows of a file.
fn read(path: &Path) -> (Vec<String>, Vec<Vec<Field>>) {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    let columns = reader.metadata().file_metadata().schema().get_fields().iter();
    let columns = columns.map(|field| field.name().to_owned()).collect();
    let rows = reader.get_row_iter(None).unwrap().map(Result::unwrap);
    (columns, rows.map(|row| row.get_column_iter().map(|(_, field)| field.clone()).collect()).collect())
}

#[test]
fn rows_of_many_groups_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.parquet");
    let give = |row: &mut Row<'_>, n: i32| {
        row.full("time_ns", I64, i64::from(n));
        row.sparse("value", Kind::Double, (n % 3 != 0).then_some(f64::from(n) * 0.1));
        row.full("name", Kind::Text, ["a", "b"][usize::from(n % 2 == 0)]);
    };
    let words = [("unit".to_owned(), "A-1".to_owned())];
    let mut table = Table::create(Partial::of(&path), 40_000, words.to_vec()).unwrap();
    for n in 0..40_000 {
        table.push(|row| give(row, n)).unwrap();
    }
    let (partial, rows) = table.finish().unwrap();
    assert_eq!(rows, 40_000);
    partial.keep().unwrap();
    let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
    assert_eq!(reader.num_row_groups(), 3);
    let metadata = reader.metadata().file_metadata().key_value_metadata().unwrap();
    assert_eq!((metadata[0].key.as_str(), metadata[0].value.as_deref()), ("unit", Some("A-1")));
    let (_, rows) = read(&path);
    assert_eq!(rows.len(), 40_000);
    assert_eq!(rows[39_999], [Field::Long(39_999), Field::Null, Field::Str("a".to_owned())]);
    assert_eq!(
        rows[20_000],
        [Field::Long(20_000), Field::Double(20_000.0 * 0.1), Field::Str("b".to_owned())]
    );
}

#[test]
fn a_file_that_is_being_written_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.parquet");
    let mut other = Partial::of(&path);
    let file = other.create().unwrap();
    assert!(Table::create(Partial::of(&path), 1, Vec::new()).is_err());
    assert!(other.writing().exists());
    drop(file);
    Table::create(Partial::of(&path), 1, Vec::new()).unwrap();
}

#[test]
fn a_cell_that_does_not_fit_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let refused = [Cell::Empty, Cell::Integer(1)].map(|cell| {
        let partial = Partial::of(&folder.path().join("x.parquet"));
        let mut table = Table::create(partial, 1, Vec::new()).unwrap();
        table.push(|row| row.full("value", Kind::Double, cell)).unwrap_err().to_string()
    });
    insta::assert_snapshot!(refused.join("\n").replace(folder.path().to_str().unwrap(), "FOLDER"));
}

/// A gyro batch of two ticks.
fn gyro(output: OutputKind, readings: &[f64], half_periods: bool) -> GyroBatch {
    let halves = readings.iter().map(|_| HalfPeriodCounts { positive: 5, negative: -6 });
    let tick = GyroTick {
        sequence: u64::MAX - 1,
        end_time: Timestamp::from_ns(-5),
        duration: Span::from_ns(10),
        readings: readings.iter().copied().collect(),
        mode: Some(LasingMode::Minus),
        switch_command: true,
        meander: None,
        half_periods: halves.filter(|_| half_periods).collect(),
        series: 7,
    };
    GyroBatch { output, ticks: vec![tick.clone(), GyroTick { sequence: u64::MAX, ..tick }] }
}

#[test]
fn streams_have_columns_for_every_shape_of_tick() {
    let folder = tempfile::tempdir().unwrap();
    let unit = UnitId::new("A-1").unwrap();
    let counts = gyro(OutputKind::Counts, &[1.0, -2.0], true);
    let means = gyro(OutputKind::Mean, &[0.5, f64::NAN, -0.0], false);
    let tick = CorrectedTick {
        sequence: 3,
        end_time: Timestamp::from_ns(30),
        duration: Span::from_ns(10),
        ticks: 2,
        missed: 1,
        delta_angle: [0.1, 0.2, 0.3],
        delta_velocity: [1.0, 2.0, 3.0],
        mode: None,
        flags: TickFlags::all(),
        gyro_flags: [1, 255].map(SensorFlags::from_bits_retain).into_iter().collect(),
        accel_flags: [].into_iter().collect(),
        gyro_parity: [0.25].into_iter().collect(),
        accel_parity: [].into_iter().collect(),
        revision: 4,
        series: 0,
        sigma: None,
    };
    let revision = Revision { counter: 4, digest: [0xab; 8] };
    let corrected = CorrectedBatch {
        unit: "A-1".to_owned(),
        series: 0,
        revision,
        temperatures: [].into_iter().collect(),
        sigmas: Vec::new(),
        ticks: vec![tick],
    };
    let frame = |topic: &str, frame| Message { topic: Topic::of(topic), received_ns: 1, frame };
    let mut contents = Contents::default();
    for batch in [&counts, &means] {
        contents.add(&frame("imu/A-1/raw/gyro", isotherm_protocol::codec::encode(batch).unwrap()));
    }
    let status = Status { unit: "A-1".to_owned(), ..Status::default() };
    contents.add(&frame("imu/A-1/status", isotherm_protocol::codec::encode(&status).unwrap()));
    contents.add(&frame("imu/A-1/corrected", isotherm_protocol::codec::encode(&corrected).unwrap()));
    let place = |stream| Ok(Partial::of(&folder.path().join(stream)));
    let mut tables = UnitTables::create(&unit, &contents.units[&unit], &[], place).unwrap();
    let status = Decoded::Status(Box::new(status));
    for decoded in
        [Decoded::Gyro(counts), Decoded::Gyro(means), Decoded::Corrected(Box::new(corrected)), status]
    {
        assert!(tables.take(99, &decoded).unwrap());
    }
    assert!(!tables.take(99, &Decoded::Journal).unwrap());
    let mut written = Vec::new();
    for (partial, file) in tables.finish().unwrap() {
        partial.keep().unwrap();
        written.push((file.what, file.rows));
    }
    assert_eq!(written, [("raw_gyro", 4), ("corrected", 1), ("status", 1)]);

    let (columns, rows) = read(&folder.path().join("raw_gyro"));
    assert_eq!(
        columns.join(" "),
        "received_ns sequence series end_time_ns duration_ns mode switch_command meander sensor_0_counts \
         sensor_1_counts sensor_0_rad_per_s sensor_1_rad_per_s sensor_2_rad_per_s sensor_0_half_positive_counts \
         sensor_0_half_negative_counts sensor_1_half_positive_counts sensor_1_half_negative_counts"
    );
    assert_eq!(rows[1][..3], [Field::ULong(99), Field::ULong(u64::MAX), Field::ULong(7)]);
    assert_eq!(rows[1][5..8], [Field::Byte(-1), Field::Bool(true), Field::Null]);
    assert_eq!(rows[1][8..11], [Field::Int(1), Field::Int(-2), Field::Null]);
    assert_eq!(rows[1][13..15], [Field::Int(5), Field::Int(-6)]);
    assert_eq!(rows[2][8..11], [Field::Null, Field::Null, Field::Double(0.5)]);
    assert!(
        matches!(&rows[2][11..13], [Field::Double(nan), Field::Double(zero)] if nan.is_nan() && zero.is_sign_negative())
    );

    let (columns, rows) = read(&folder.path().join("corrected"));
    assert_eq!(columns[13..17], ["flags", "gyro_0_flags", "gyro_1_flags", "gyro_parity_0_rad_per_s"]);
    assert_eq!(rows[0][12..16], [Field::Null, Field::UShort(0x7fff), Field::UByte(1), Field::UByte(255)]);
    assert_eq!(rows[0][18], Field::Str("abababababababab".to_owned()));
}
