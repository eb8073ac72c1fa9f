//! Logs as others write them: read right, or refused with line and column.

use std::fmt::Write as _;
use std::io::Write;

use super::*;
use crate::mapping::Column;

/// A mapping for `t;x;y;z;T` with these keys of the file and of its time.
fn mapping(file: &str, time: &str) -> Mapping {
    let text = format!(
        "version = 1\n[[file]]\n{file}\n[file.time]\n{time}\n[file.gyro]\noutput = \"mean\"\n\
         sensors = [{{ column = 2, unit = \"rad_per_s\" }}, {{ column = 3, unit = \"rad_per_s\" }}]\n\
         [[file.temperature]]\nchannel = \"case\"\ncolumn = 4\nunit = \"deg_c\"\n"
    );
    Mapping::parse(&text, "m.toml").unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// Stamps in ms, ticks of 10 ms.
const STAMPS: &str = "column = 1\nunit = \"ms\"\ntick_ms = 10";

/// A log in a file of its own.
fn stored(bytes: &[u8]) -> tempfile::NamedTempFile {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    file
}

/// All events of a log and what reading came to.
fn read(mapping: &Mapping, bytes: &[u8]) -> (Vec<LogEvent>, ReadReport) {
    let file = stored(bytes);
    let mut reader = LogReader::open(mapping, &[file.path().to_path_buf()]).unwrap();
    let events = reader.by_ref().map(|event| event.unwrap_or_else(|error| panic!("{error}"))).collect();
    (events, reader.report())
}

/// The error that a log ends with.
fn error(mapping: &Mapping, bytes: &[u8]) -> LogFault {
    let file = stored(bytes);
    let mut fault = match LogReader::open(mapping, &[file.path().to_path_buf()]) {
        Ok(mut reader) => *reader.find_map(Result::err).expect("must be refused").0,
        Err(Error::Log(error)) => *error.0,
        Err(other) => panic!("{other}"),
    };
    "log.csv".clone_into(&mut fault.file);
    fault
}

/// Sequence, end (ms), duration (ms) and first reading of the gyro ticks.
fn gyro(events: &[LogEvent]) -> Vec<(u64, i64, i64, f64)> {
    let tick = |event: &LogEvent| match event {
        LogEvent::Gyro { tick, .. } => {
            let ms = |ns: i64| ns / 1_000_000;
            Some((tick.sequence, ms(tick.end_time.as_ns()), ms(tick.duration.as_ns()), tick.readings[0]))
        }
        _ => None,
    };
    events.iter().filter_map(tick).collect()
}

#[test]
fn the_same_log_in_every_guise() {
    let expected = [(0, 10, 10, 1.5), (1, 21, 11, -2.0), (2, 30, 9, 0.25)];
    let plain = "10;1.5;7;20\n21;-2;7;20\n30;2.5e-1;7;20\n";
    let table: &[(&str, &str, Vec<u8>)] = &[
        ("plain", "delimiter = \"semicolon\"", plain.into()),
        ("decimal commas", "delimiter = \"semicolon\"\ndecimal_mark = \",\"", plain.replace('.', ",").into()),
        ("line ends of Windows", "delimiter = \"semicolon\"", plain.replace('\n', "\r\n").into()),
        ("byte-order mark", "delimiter = \"semicolon\"", format!("\u{feff}{plain}").into()),
        ("no last line end", "delimiter = \"semicolon\"", plain.trim_end().into()),
        ("spaces around cells", "delimiter = \"semicolon\"", plain.replace(';', " ; ").into()),
        ("blank lines", "delimiter = \"semicolon\"", plain.replace('\n', "\n \n").into()),
        ("tabs", "delimiter = \"tab\"", plain.replace(';', "\t").into()),
        ("runs of spaces", "delimiter = \"whitespace\"", plain.replace(';', "  \t ").into()),
        (
            "quotes",
            "delimiter = \"comma\"",
            plain
                .replace(';', "\",\"")
                .replace('\n', "\"\n")
                .replace("10\"", "\"10\"")
                .replace("\n2", "\n\"2")
                .replace("\n3", "\n\"3")
                .into(),
        ),
        (
            "comments",
            "delimiter = \"comma\"\ncomment = \"//\"",
            format!("// a\n{}//", plain.replace(';', ",")).into(),
        ),
        (
            "lines in front",
            "delimiter = \"comma\"\nskip_lines = 2",
            format!("a,\"b\nc\n{}", plain.replace(';', ",")).into(),
        ),
        (
            "a row dropped",
            "delimiter = \"comma\"\ndrop_rows = 1",
            format!("9,x,,\n{}", plain.replace(';', ",")).into(),
        ),
        (
            "header",
            "delimiter = \"comma\"\nheader = true",
            format!("\u{feff}t,x,y,T\r\n{}", plain.replace(';', ",")).into(),
        ),
    ];
    for (name, layout, bytes) in table {
        let mapping = mapping(layout, STAMPS);
        let (events, report) = read(&mapping, bytes);
        assert_eq!(gyro(&events), expected, "{name}");
        assert_eq!(events.len(), 6, "{name}");
        assert_eq!((report.rows, report.skipped_rows), (3, 0), "{name}");
        assert_eq!(report.unterminated_last_line, *name == "no last line end", "{name}");

        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(bytes).unwrap();
        assert_eq!(read(&mapping, &gzip.finish().unwrap()).0, events, "{name}, compressed");
    }
}

#[test]
fn broken_rows_are_refused_with_line_column_cell_and_value() {
    let rows = "10,1.5,7,20\n";
    let table: &[(&str, &str, u64, u32, usize)] = &[
        ("missing cell", "20,1\n", 2, 5, 3),
        ("truncated last line", "20,1,7", 2, 7, 4),
        ("empty cell", "20,,7,20\n", 2, 4, 2),
        ("not a number", "20,1.5.2,7,20\n", 2, 4, 2),
        ("a decimal comma", "20;1,5;7;20\n", 2, 4, 2),
        ("not a time", "2o,1,7,20\n", 2, 1, 1),
        ("time must increase", "10,1,7,20\n", 2, 1, 1),
        ("time goes back", "9,1,7,20\n", 2, 1, 1),
        ("bad temperature", "20,1,7,warm\n", 2, 8, 4),
        ("an open quote", "20,\"1,7,20\n", 2, 4, 2),
        ("decimal commas and comma delimiters", "20,1,5,7,20\n", 2, 10, 5),
        ("a gap that nobody announced", "2010,1,7,20\n", 2, 1, 1),
        ("a step of eleven ticks", "120,1,7,20\n", 2, 1, 1),
        ("line ends of Windows", "20,x,7,20\r\n", 2, 4, 2),
        ("no cell at all", ",,,\n", 2, 1, 1),
        ("bytes that are no text", "20,\u{b5},7,20\n", 2, 4, 2),
    ];
    let mut told = String::new();
    for (name, row, line, column, cell) in table {
        let delimiter = if row.contains(';') { "semicolon" } else { "comma" };
        let good = if row.contains(';') { rows.replace(',', ";") } else { rows.to_owned() };
        let mapping = mapping(&format!("delimiter = \"{delimiter}\""), STAMPS);
        let fault = error(&mapping, format!("{good}{row}").as_bytes());
        assert_eq!((fault.line, fault.column), (*line, *column), "{name}: {fault}");
        assert_eq!(fault.cell.as_ref().map(|(number, _)| *number), Some(*cell), "{name}: {fault}");
        writeln!(told, "{name}: {fault}").unwrap();
    }
    insta::assert_snapshot!(told);
}

#[test]
fn date_times_are_stamps_to_the_nanosecond() {
    let time = "column = 1\nunit = \"iso\"\ntick_ms = 10";
    let rows = "2026-11-23T14:05:00.010Z;1;2;20\n2026-11-23 15:05:00,021+01:00;3;4;20\n";
    let (events, _) = read(&mapping("delimiter = \"semicolon\"", time), rows.as_bytes());
    let found = gyro(&events);
    assert_eq!(found[1].1 - found[0].1, 11);
    assert_eq!(found[1].2, 11, "measured");
    let fault = error(&mapping("delimiter = \"semicolon\"", time), b"23.11.2026 14:05;1;2;20\n");
    assert!(matches!(fault.reason, Reason::NotADateTime { .. }), "{fault}");
    let text = "version = 1\n[[file]]\ndelimiter = \"comma\"\n[file.time]\ntick_ms = 1\n[file.gyro]\noutput = \"counts\"\n\
                sensors = [{ column = 2 }]\nduration_column = 1\nduration_unit = \"iso\"\n";
    let problems = Mapping::parse(text, "m.toml").unwrap_err();
    assert_eq!(problems[0].key, "file[0].gyro.duration_unit", "{problems:?}");
}

#[test]
fn rows_that_do_not_hold_by_their_status_are_passed_over() {
    let with = |status: &str| {
        let text = format!(
            "version = 1\n[[file]]\ndelimiter = \"comma\"\n[file.time]\n{STAMPS}\n[file.gyro]\noutput = \"mean\"\n\
             sensors = [{{ column = 2, unit = \"rad_per_s\" }}]\n[file.status]\ncolumn = 3\n{status}\n"
        );
        Mapping::parse(&text, "m.toml")
    };
    let rows = b"10,1,0\n20,x,4\n30,3,0\n40,4,0x1\n50,5,OK\n";
    let words = with("good = [\"0\", \"OK\"]").unwrap();
    let (events, report) = read(&words, rows);
    assert_eq!(gyro(&events), [(0, 10, 10, 1.0), (2, 30, 10, 3.0), (4, 50, 10, 5.0)]);
    assert_eq!((report.rows, report.bad_status_rows, report.skipped_rows), (3, 2, 0));
    assert!(!report.lost_data());
    let bits = with("bad_bits = 4").unwrap();
    let (events, _) = read(&bits, b"10,1,0\n20,x,6\n30,3,3\n40,4,0x1\n");
    assert_eq!(gyro(&events).iter().map(|tick| tick.0).collect::<Vec<_>>(), [0, 2, 3]);
    assert!(matches!(error(&bits, b"10,1,fine\n").reason, Reason::NotAWord));
    for wrong in ["", "good = [\"0\"]\nbad_bits = 1", "bad_bits = 0"] {
        assert!(with(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn ticks_of_a_slow_logger_come_in_equal_parts() {
    let minute = "column = 1\nunit = \"s\"\ntick_s = 60";
    let (events, _) = read(&mapping("delimiter = \"semicolon\"", minute), b"60;1;2;20\n121;3;4;21\n");
    let ticks = gyro(&events);
    assert_eq!(ticks.len(), 14);
    assert!(ticks.iter().zip(0..).all(|(tick, number)| tick.0 == number), "{ticks:?}");
    assert!(ticks[..7].iter().all(|tick| (tick.3 - 1.0).abs() < 1e-15));
    let spans: Vec<i64> = events
        .iter()
        .filter_map(|event| match event {
            LogEvent::Gyro { tick, .. } => Some(tick.duration.as_ns()),
            _ => None,
        })
        .collect();
    assert_eq!(spans[..7].iter().sum::<i64>(), 60_000_000_000);
    assert_eq!(spans[7..].iter().sum::<i64>(), 61_000_000_000);
    assert!(spans.iter().all(|span| *span <= isotherm_correction::unit::MAX_TICK_DURATION.as_ns()));
    assert_eq!((ticks[6].1, ticks[13].1), (60_000, 121_000));
    let times: Vec<i64> = events.iter().map(|event| event.time().as_ns()).collect();
    assert!(times.is_sorted());
}

#[test]
fn files_that_are_no_such_log_are_refused() {
    let named = Mapping::parse(
        "version = 1\n[[file]]\ndelimiter = \"comma\"\nheader = true\n[file.time]\ntick_ms = 1\n[file.gyro]\n\
         output = \"counts\"\nsensors = [{ column = \"x\" }]\n",
        "m.toml",
    )
    .unwrap();
    let missing = error(&named, b"a,b\n1,2\n").reason;
    assert!(matches!(&missing, Reason::NoSuchColumn { name, header } if name == "x" && header == "a, b"));
    let words = error(&named, format!("{}\n1,2\n", "a\u{1b},".repeat(2000)).as_bytes()).to_string();
    assert!(words.len() < 800 && !words.contains('\u{1b}'), "{words}");
    assert!(matches!(error(&named, b"x,x\n1,2\n").reason, Reason::AmbiguousColumn { .. }));
    assert!(matches!(error(&named, b"").reason, Reason::NoHeader));
    assert!(matches!(error(&named, b"\xff\xfex\0\n\0").reason, Reason::Utf16));
    let fault = error(&named, b"x\n1.5\n");
    assert!(matches!(fault.reason, Reason::NotACount) && fault.value == "1.5", "{fault}");
    assert_eq!(fault.cell, Some((1, Some("x".to_owned()))));
    let long = error(&named, &vec![b'1'; (1 << 20) + 5]);
    assert!(matches!(long.reason, Reason::LineTooLong { limit: 1_048_576 }), "{long}");
}

#[test]
fn surplus_cells_are_refused_unless_they_are_empty() {
    let header = mapping("delimiter = \"comma\"\nheader = true", STAMPS);
    let (events, _) = read(&header, b"t,x,y,T\n10,1,7,20,\n20,2,7,20, ,\n");
    assert_eq!(gyro(&events).len(), 2);
    let fault = error(&header, b"t,x,y,T\n10,1,7,20,\n20,2,7,20,,5\n");
    assert_eq!((fault.line, fault.column), (3, 12), "{fault}");
    assert!(matches!(fault.reason, Reason::TooManyCells { columns: 4, named: true, .. }), "{fault}");
    assert_eq!((fault.cell, &*fault.value), (Some((6, None)), "5"));
    let spaces = mapping("delimiter = \"whitespace\"", STAMPS);
    let fault = error(&spaces, b"10 1 7 20\n20 1 7 20 9\n");
    assert!(matches!(fault.reason, Reason::TooManyCells { columns: 4, named: false, .. }), "{fault}");
}

#[test]
fn a_gap_is_read_where_the_mapping_or_the_log_knows_of_it() {
    let bytes = b"10,1,7,20\n20,2,7,20\n2020,3,7,20\n2030,4,7,20\n";
    let gaps = mapping("delimiter = \"comma\"", &format!("{STAMPS}\ngap_after_ticks = 1.5"));
    assert_eq!(
        gyro(&read(&gaps, bytes).0),
        [(0, 10, 10, 1.0), (1, 20, 10, 2.0), (201, 2020, 10, 3.0), (202, 2030, 10, 4.0)]
    );
    // Passed over, the rows behind it are in order again.
    let skip = mapping("delimiter = \"comma\"\non_bad_row = \"skip\"", STAMPS);
    let (events, report) = read(&skip, bytes);
    assert_eq!(gyro(&events), [(0, 10, 10, 1.0), (1, 20, 10, 2.0), (3, 2030, 10, 4.0)]);
    assert_eq!(report.skipped_rows, 1);
    // Rows that could not be read explain a step.
    let bad = "?,1,7,20\n".repeat(12);
    let (events, report) = read(&skip, format!("10,1,7,20\n{bad}140,2,7,20\n").as_bytes());
    assert_eq!((gyro(&events).len(), report.skipped_rows), (2, 12));
    // A log that numbers its ticks tells of its gaps itself, and of another run of its producer; a row that comes late is neither.
    let mut numbered = skip;
    numbered.files[0].gyro.as_mut().unwrap().ticks.sequence = Some(Column::Index(3));
    numbered.files[0].temperatures.clear();
    let rows = b"10,1,7,5\n20,2,7,6\n2020,3,7,206\n2031,4,7,0\n2025,5,7,0\n2040,6,7,1\n9000,7,7,1\n";
    let (events, _) = read(&numbered, rows);
    let series = events.iter().filter_map(|event| match event {
        LogEvent::Gyro { tick, .. } => Some(tick.series),
        _ => None,
    });
    assert!(series.eq([0, 0, 0, 1, 1, 2]), "{events:?}");
    let ticks: Vec<_> = gyro(&events).iter().map(|tick| (tick.0, tick.2)).collect();
    assert_eq!(ticks, [(5, 10), (6, 10), (206, 10), (0, 11), (1, 10), (1, 10)]);
}

#[test]
fn accelerometers_in_numbered_rows_have_the_number_of_the_row() {
    let text = "version = 1\n[[file]]\ndelimiter = \"comma\"\n[file.time]\ncolumn = 1\nunit = \"ms\"\ntick_ms = 10\n\
                [file.gyro]\noutput = \"mean\"\nsequence_column = 2\nsensors = [{ column = 3, unit = \"rad_per_s\" }]\n\
                [file.accel]\noutput = \"mean\"\nsensors = [{ column = 4, unit = \"m_per_s2\" }]\n";
    let mut mapping = Mapping::parse(text, "m.toml").unwrap();
    let rows = b"10,5,1,9\n20,6,2,9\n2020,206,3,9\n2031,207,4,9\n9000,0,5,9\n";
    let (events, _) = read(&mapping, rows);
    let accel = events.iter().filter_map(|event| match event {
        LogEvent::Accel { tick, .. } => Some((tick.sequence, tick.duration.as_ns() / 1_000_000)),
        _ => None,
    });
    assert!(accel.eq([(5, 10), (6, 10), (206, 10), (207, 11), (0, 10)]), "{events:?}");
    // Of those that are in some rows it is not: nobody knows of their gaps.
    mapping.files[0].accel.as_mut().unwrap().may_be_empty = true;
    assert!(matches!(error(&mapping, rows).reason, Reason::Gap { ticks: 200, .. }));
}

#[test]
fn bad_rows_can_be_passed_over_and_become_gaps() {
    let layout = "delimiter = \"comma\"\non_bad_row = \"skip\"";
    let bytes = b"10,1,7,20\n20,x,7,20\n30,3,7,20\n?,4,7,20\n50,5,7,20\n45,6,7,20\n60,7,7,20\n7";
    let (events, report) = read(&mapping(layout, STAMPS), bytes);
    // After a row without a stamp, the nominal duration stands in for the measured one.
    let expected = [(0, 10, 10, 1.0), (2, 30, 10, 3.0), (4, 50, 10, 5.0), (6, 60, 10, 7.0)];
    assert_eq!(gyro(&events), expected);
    assert_eq!((report.rows, report.skipped_rows, report.lost_data()), (4, 4, true));
    assert!(report.first_skipped.is_some_and(|first| first.contains(":2:4: column 2")));
    // A header that is repeated is counted, and no gap.
    let (events, report) = read(
        &mapping(&format!("{layout}\nheader = true"), STAMPS),
        b"t,x,y,T\n10,1,7,20\nt, x,y,T\n21,2,7,20\n",
    );
    assert_eq!((gyro(&events), report.skipped_rows), (vec![(0, 10, 10, 1.0), (1, 21, 11, 2.0)], 1));
}

#[test]
fn a_row_without_one_reading_is_a_gap_for_every_sensor_it_has_readings_of() {
    let text = "version = 1\n[[file]]\ndelimiter = \"comma\"\non_bad_row = \"skip\"\n[file.time]\ncolumn = 1\nunit = \"ms\"\n\
                tick_ms = 10\n[file.gyro]\noutput = \"mean\"\nmay_be_empty = true\n\
                sensors = [{ column = 2, unit = \"rad_per_s\" }, { column = 3, unit = \"rad_per_s\" }]\n\
                [file.accel]\noutput = \"mean\"\nsensors = [{ column = 4, unit = \"m_per_s2\" }]\n";
    let mapping = Mapping::parse(text, "m.toml").unwrap();
    // A row with half of its gyros, one without any, which is in order, and one that cannot be read for its accelerometer.
    let (events, report) =
        read(&mapping, b"10,1,7,9\n20,2,,9\n30,3,7,9\n40,,,9\n50,5,7,9\n60,,,x\n70,7,7,9\n");
    assert_eq!(report.skipped_rows, 2);
    assert_eq!(gyro(&events), [(0, 10, 10, 1.0), (2, 30, 10, 3.0), (3, 50, 20, 5.0), (4, 70, 20, 7.0)]);
    let accel = events.iter().filter_map(|event| match event {
        LogEvent::Accel { tick, .. } => Some((tick.sequence, tick.duration.as_ns() / 1_000_000)),
        _ => None,
    });
    assert!(accel.eq([(0, 10), (2, 10), (3, 10), (4, 10), (6, 10)]));
}

#[test]
fn a_compressed_log_that_ends_in_the_middle() {
    let rows: String =
        (1..5000).flat_map(|row| [(row * 10).to_string(), format!(",{},7,20\n", row % 97)]).collect();
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(rows.as_bytes()).unwrap();
    let whole = gzip.finish().unwrap();
    let half = &whole[..whole.len() / 2];
    let fault = error(&mapping("delimiter = \"comma\"", STAMPS), half);
    assert!(matches!(fault.reason, Reason::CutShort), "{fault}");
    let skip = mapping("delimiter = \"comma\"\non_bad_row = \"skip\"", STAMPS);
    let (events, report) = read(&skip, half);
    assert!(report.cut_short && report.lost_data() && events.len() > 100);
}

#[test]
fn stamps_of_the_start_and_gaps_in_time() {
    let bytes = b"0,1,7,20\n11,2,7,21\n20,3,7,22\n50,4,7,23\n";
    let start = format!("{STAMPS}\nmarks = \"start\"\ngap_after_ticks = 1.5");
    let (events, _) = read(&mapping("delimiter = \"comma\"", &start), bytes);
    assert_eq!(gyro(&events), [(0, 11, 11, 1.0), (1, 20, 9, 2.0), (2, 30, 10, 3.0), (5, 60, 10, 4.0)]);
    let orders: Vec<_> = events.iter().map(LogEvent::order).collect();
    assert!(orders.is_sorted(), "{orders:?}");

    let nominal = format!("{STAMPS}\nduration = \"nominal\"\norigin_ns = 1000000");
    let (events, _) = read(&mapping("delimiter = \"comma\"", &nominal), bytes);
    assert_eq!(gyro(&events), [(0, 1, 10, 1.0), (1, 12, 10, 2.0), (2, 21, 10, 3.0), (3, 51, 10, 4.0)]);

    let (events, _) = read(&mapping("delimiter = \"comma\"", "tick_ms = 5"), bytes);
    assert_eq!(gyro(&events), [(0, 5, 5, 1.0), (1, 10, 5, 2.0), (2, 15, 5, 3.0), (3, 20, 5, 4.0)]);
}

#[test]
fn sequence_numbers_carry_the_time_where_there_are_no_stamps() {
    let numbered = "version = 1\n[[file]]\ndelimiter = \"comma\"\non_bad_row = \"skip\"\n[file.time]\ntick_ms = 10\n[file.gyro]\n\
        output = \"mean\"\nsequence_column = 1\nsensors = [{ column = 2, unit = \"rad_per_s\" }]\n";
    let mapping = Mapping::parse(numbered, "m.toml").unwrap();
    // Seven ticks are missing, one row cannot be read, and the counter begins anew.
    let (events, _) = read(&mapping, b"4,1\n5,2\n13,3\n14,x\n15,4\n0,5\n1,6\n");
    let expected = [
        (4, 10, 10, 1.0),
        (5, 20, 10, 2.0),
        (13, 100, 10, 3.0),
        (15, 120, 10, 4.0),
        (0, 130, 10, 5.0),
        (1, 140, 10, 6.0),
    ];
    assert_eq!(gyro(&events), expected);
}

#[test]
fn a_column_is_one_sensors_alone() {
    let twice = mapping("delimiter = \"comma\"", STAMPS);
    for (column, as_well) in [(1, "gyro 2"), (3, "temperature channel \"case\""), (0, "time")] {
        let mut wrong = twice.clone();
        wrong.files[0].gyro.as_mut().unwrap().ticks.sensors[0].column = Some(Column::Index(column));
        if column == 1 {
            wrong.files[0].gyro.as_mut().unwrap().ticks.sensors[1].column = Some(Column::Index(1));
        }
        let fault = error(&wrong, b"10,1,7,20\n");
        let Reason::ColumnTwice { column: found, first, second } = &fault.reason else { panic!("{fault}") };
        assert_eq!((*found, &**first, &**second), (column + 1, "gyro 1", as_well));
    }
    // By name and by number.
    let mut named = mapping("delimiter = \"comma\"\nheader = true", STAMPS);
    named.files[0].temperatures[0].column = Column::Name("x".into());
    let fault = error(&named, b"t,x,y,T\n10,1,7,20\n");
    assert!(matches!(fault.reason, Reason::ColumnTwice { column: 2, .. }), "{fault}");
    // Two channels of one thermometer.
    let mut shared = twice;
    let mut second = shared.files[0].temperatures[0].clone();
    second.channel = "coil".try_into().unwrap();
    shared.files[0].temperatures.push(second);
    assert_eq!(read(&shared, b"10,1,7,20\n").0.len(), 3);
}

#[test]
fn a_last_row_that_is_cut_off_is_said_to_be() {
    let mapping = mapping("delimiter = \"comma\"", STAMPS);
    for cut in ["10", "2", "20,1,-", "20,"] {
        assert!(error(&mapping, format!("10,1,7,20\n{cut}").as_bytes()).cut, "{cut}");
    }
    let fault = error(&mapping, b"10,1,7,20\n10,1,7,21\n");
    assert!(matches!(fault.reason, Reason::TimeNotIncreasing { .. }) && !fault.cut, "{fault}");
}

/// A mapping of one file with modes, increments and half periods.
fn zeeman() -> Mapping {
    Mapping::parse(
        "version = 1\n[[file]]\ndelimiter = \"comma\"\nheader = true\n[file.time]\ntick_ms = 5\n[file.gyro]\n\
         output = \"counts\"\nsensors = [{ column = \"y\" }, { column = \"x\", sign = -1 }]\n\
         mode = { column = \"mode\", plus = \"A\", minus = \"B\" }\nswitch = { from = \"mode_change\" }\n\
         half_periods = [{ positive = \"p\", negative = \"n\" }, { positive = \"n\", negative = \"p\" }]\n\
         [file.accel]\noutput = \"mean\"\nsensors = [{ column = \"v\", unit = \"m_per_s\" }]\nmay_be_empty = true\n",
        "m.toml",
    )
    .unwrap()
}

#[test]
fn modes_switches_order_sign_half_periods_and_increments() {
    let bytes = b"x,y,mode,p,n,v\n1,2,A,10,-9,0.05\n3,4,A,11,-8,\n5,6,B,12,-7,0.1\n";
    let (events, _) = read(&zeeman(), bytes);
    let ticks: Vec<_> = events
        .iter()
        .filter_map(|event| match event {
            LogEvent::Gyro { tick, .. } => {
                Some((tick.readings.to_vec(), tick.switch_command, tick.half_periods[1].positive))
            }
            _ => None,
        })
        .collect();
    assert_eq!(
        ticks,
        [(vec![2.0, -1.0], false, -9), (vec![4.0, -3.0], false, -8), (vec![6.0, -5.0], true, -7)]
    );
    let accel: Vec<_> = events
        .iter()
        .filter_map(|event| match event {
            LogEvent::Accel { tick, .. } => Some((tick.sequence, tick.end_time.as_ns(), tick.readings[0])),
            _ => None,
        })
        .collect();
    assert_eq!(accel, [(0, 5_000_000, 10.0), (1, 15_000_000, 20.0)]);
    insta::assert_snapshot!(error(&zeeman(), b"x,y,mode,p,n,v\n1,2,C,1,1,1\n"));
}

#[test]
fn files_are_merged_in_time() {
    let both = "version = 1\n[[file]]\ndelimiter = \"comma\"\nname = \"a\"\ntime = { column = 1, unit = \"ms\", tick_ms = 10 }\n\
        gyro = { output = \"mean\", sensors = [{ column = 2, unit = \"rad_per_s\" }, { column = 3, unit = \"rad_per_s\" }] }\n\
        temperature = [{ channel = \"case\", column = 4, unit = \"deg_c\" }]\n\
        [[file]]\ndelimiter = \"comma\"\nname = \"b\"\ntime = { column = 1, unit = \"ms\", tick_ms = 10 }\n\
        accel = { output = \"mean\", sensors = [{ column = 2, unit = \"m_per_s2\" }, { column = 3, unit = \"m_per_s2\" }] }\n";
    let both = Mapping::parse(both, "m.toml").unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a"), "10,1,7,20\n20,2,7,20\n").unwrap();
    std::fs::write(folder.path().join("b"), "5,1,7\n10,1,7\n25,1,7\n").unwrap();
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    for paths in [vec![folder.path().to_path_buf()], vec![a.clone(), b.clone()], vec![b, a]] {
        let reader = LogReader::open(&both, &paths).unwrap();
        let orders: Vec<_> = reader
            .map(|event| event.unwrap())
            .map(|event| (event.time().as_ns() / 1_000_000, event.rank()))
            .collect();
        assert_eq!(orders, [(5, 1), (10, 0), (10, 1), (10, 2), (20, 0), (20, 2), (25, 1)], "{paths:?}");
    }
    assert!(matches!(LogReader::open(&both, &[folder.path().join("a")]), Err(Error::Usage(_))));
}

#[test]
fn a_part_of_a_log() {
    let rows: String = (1..=100).flat_map(|row| [(row * 10).to_string(), format!(",{row},7,20\n")]).collect();
    let file = stored(rows.as_bytes());
    let reader =
        LogReader::open(&mapping("delimiter = \"comma\"", STAMPS), &[file.path().to_path_buf()]).unwrap();
    let span = |ms| Span::from_ms(ms);
    let part = Part { start: span(100), end: Some(span(300)), ..Part::default() };
    let part: Vec<_> = reader.within(&part).map(Result::unwrap).collect();
    let ends: Vec<_> = gyro(&part).into_iter().map(|(_, end, ..)| end).collect();
    // The log begins with its first temperature reading, at 10 ms.
    assert_eq!((ends.first(), ends.last(), ends.len()), (Some(&120), Some(&310), 20));
}
