//! Streams out of order, doubled and begun anew.

use isotherm_correction::sample::ChannelName;
use isotherm_correction::units::{Span, Timestamp};

use super::*;
use crate::streams::contents::{Shape, Shapes, UnitContents};

/// A tick of 10 ms that ends at the given time (ms).
fn gyro(series: u64, sequence: u64, end_ms: i64) -> GyroTick {
    GyroTick {
        sequence,
        series,
        end_time: Timestamp::from_ns(end_ms * 1_000_000),
        duration: Span::from_ms(10),
        ..GyroTick::default()
    }
}

fn accel(sequence: u64, end_ms: i64) -> LogEvent {
    let tick = AccelTick {
        sequence,
        end_time: Timestamp::from_ns(end_ms * 1_000_000),
        duration: Span::from_ms(10),
        ..AccelTick::default()
    };
    LogEvent::Accel { output: OutputKind::Mean, tick }
}

fn reading(end_ms: i64, raw: f64) -> LogEvent {
    let channel = ChannelName::from("board").unwrap();
    LogEvent::Temperature(TemperatureReading { channel, time: Timestamp::from_ns(end_ms * 1_000_000), raw })
}

/// Every step as words: `40ag` is a row at 40 ms with an accelerometer and a gyro tick.
fn steps(mut rows: Rows) -> (String, Tally) {
    rows.finish();
    let mut words = Vec::new();
    while let Some(step) = rows.next_step() {
        words.push(match step {
            Step::NewRun => "|".to_owned(),
            Step::Row(row) => [
                (row.time_ns / 1_000_000).to_string().as_str(),
                if row.temperatures.is_empty() { "" } else { "t" },
                if row.accel.is_some() { "a" } else { "" },
                if row.gyro.is_some() { "g" } else { "" },
            ]
            .concat(),
        });
    }
    (words.join(" "), rows.tally())
}

#[test]
fn what_comes_out_of_order_is_put_in_order_and_what_comes_twice_once() {
    let mut rows = Rows::default();
    for (sequence, end_ms) in [(1, 20), (0, 10), (3, 40), (0, 10), (2, 30)] {
        rows.gyro(OutputKind::Mean, gyro(7, sequence, end_ms));
    }
    rows.other(accel(0, 30));
    rows.other(reading(15, 1.0));
    rows.other(reading(15, 1.0));
    rows.other(reading(15, 2.0));
    rows.gyro(OutputKind::Mean, gyro(7, 9, 40));
    let (words, tally) = steps(rows);
    assert_eq!(words, "10g 15t 20g 30ag 40g");
    assert_eq!(tally, Tally { duplicates: 2, conflicts: 2, late: 0 });
}

#[test]
fn a_row_waits_until_every_stream_is_five_seconds_further() {
    let mut rows = Rows::default();
    rows.gyro(OutputKind::Mean, gyro(7, 0, 10));
    rows.gyro(OutputKind::Mean, gyro(7, 500, 5010));
    assert_eq!(rows.next_step(), None);
    rows.gyro(OutputKind::Mean, gyro(7, 501, 5020));
    assert!(matches!(rows.next_step(), Some(Step::Row(_))));
    rows.gyro(OutputKind::Mean, gyro(7, 0, 10));
    rows.other(accel(0, 5));
    let (words, tally) = steps(rows);
    assert_eq!(words, "5010g 5020g");
    assert_eq!(tally, Tally { late: 2, ..Tally::default() });

    let shape = Shape { counts: false, sensors: 3, half_periods: false };
    let shapes = || Shapes::from([(shape, 1)]);
    let contents = UnitContents { gyro: shapes(), accel: shapes(), ..UnitContents::default() };
    let mut rows = Rows::of(&contents);
    // A batch of a minute before the other stream's.
    for n in 0..60_u64 {
        rows.gyro(OutputKind::Mean, gyro(7, n, 1000 * n.cast_signed()));
    }
    assert_eq!(rows.next_step(), None);
    for n in 0..60_u64 {
        rows.other(accel(n, 1000 * n.cast_signed()));
    }
    assert!(matches!(rows.next_step(), Some(Step::Row(row)) if row.gyro.is_some() && row.accel.is_some()));
    assert_eq!(steps(rows).1, Tally::default());
}

#[test]
fn a_stream_that_ended_does_not_hold_the_others_for_ever() {
    let mut rows = Rows::default();
    rows.other(reading(5, 1.0));
    for n in 0..100_000_u32 {
        rows.gyro(OutputKind::Mean, gyro(7, n.into(), 10 + 10 * i64::from(n)));
        assert!(rows.waiting.len() <= MOST_ROWS);
        while rows.next_step().is_some() {}
    }
    assert_eq!(rows.tally(), Tally::default());
}

#[test]
fn another_series_is_a_new_run_with_what_came_shortly_before_it() {
    let mut rows = Rows::default();
    rows.gyro(OutputKind::Mean, gyro(7, 0, 10_000));
    rows.other(accel(0, 10_000));
    // Time goes on: the accelerometer tick of the new run comes first.
    rows.other(accel(0, 12_000));
    rows.gyro(OutputKind::Mean, gyro(8, 1, 12_000));
    // Time goes back, and the temperature comes first.
    rows.gyro(OutputKind::Mean, gyro(8, 2, 20_000));
    rows.other(reading(5, 1.0));
    rows.gyro(OutputKind::Mean, gyro(9, 0, 10));
    // A straggler of a run that is over.
    rows.gyro(OutputKind::Mean, gyro(8, 3, 20_010));
    let (words, tally) = steps(rows);
    assert_eq!(words, "10000ag | 12000ag 20000g | 5t 10g");
    assert_eq!(tally, Tally { late: 1, ..Tally::default() });
}

#[test]
fn however_many_series_are_one_run_where_their_numbers_tell_them_apart() {
    let mut rows = Rows::default();
    let mut given = 0;
    for n in 0..20_000_u64 {
        rows.gyro(OutputKind::Mean, gyro(n / 2, n % 2, 10 * n.cast_signed()));
        given += std::iter::from_fn(|| rows.next_step()).filter(|step| *step != Step::NewRun).count();
    }
    let (words, tally) = steps(rows);
    assert_eq!((given + words.split(' ').count(), words.contains('|')), (20_000, false));
    assert_eq!(tally, Tally::default());
}

#[test]
fn a_producer_without_series_that_goes_back_in_time_begins_anew() {
    let mut rows = Rows::default();
    for end_ms in [10_000, 20_000, 30_000, 10, 20] {
        rows.gyro(OutputKind::Mean, gyro(0, 0, end_ms));
    }
    let (words, tally) = steps(rows);
    assert_eq!(words, "10000g 20000g 30000g | 10g 20g");
    assert_eq!(tally, Tally::default());
}

#[test]
fn a_wild_time_neither_stops_the_stream_nor_fills_the_memory() {
    let mut rows = Rows::default();
    rows.gyro(OutputKind::Mean, gyro(7, 0, 10));
    rows.gyro(OutputKind::Mean, gyro(7, 1, 9_000_000_000));
    for number in 0..200_000_u32 {
        rows.gyro(OutputKind::Mean, gyro(7, 2 + u64::from(number), 20 + 10 * i64::from(number)));
        assert!(rows.waiting.len() <= MOST_ROWS);
        while rows.next_step().is_some() {}
    }
    assert_eq!(rows.tally(), Tally::default());
    assert_eq!(steps(rows).0, "9000000000g");
}
