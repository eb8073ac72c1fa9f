//! Mappings that hold, and every kind of mapping that does not.

use isotherm_correction::units::Span;

use super::*;

/// A small mapping that holds; the tests break it line by line.
const SOUND: &str = "\
version = 1
[[file]]
delimiter = \"comma\"
header = true
[file.time]
column = \"t\"
unit = \"ms\"
tick_ms = 10
[file.gyro]
output = \"mean\"
sensors = [
    { column = \"x\", unit = \"deg_per_s\" },
    { column = \"y\", unit = \"deg_per_s\", sign = -1 },
    { column = \"z\", unit = \"rad_per_s\", mid_scale = 32768, scale = 0.5 },
]
mode = { column = \"m\", minus = \"0\" }
switch = { from = \"mode_change\" }
[file.accel]
output = \"counts\"
sensors = [{ column = 5 }]
[[file.temperature]]
channel = \"case\"
column = \"T\"
unit = \"kelvin\"
every_rows = 3
";

/// Places and keys of the problems of a mapping.
fn problems(text: &str) -> Vec<(usize, usize, String)> {
    let problems = Mapping::parse(text, "m.toml").expect_err("must be refused");
    problems.into_iter().map(|problem| (problem.line, problem.column, problem.key)).collect()
}

#[test]
fn a_sound_mapping_says_what_it_says() {
    let mapping = Mapping::parse(SOUND, "m.toml").unwrap();
    let file = &mapping.files[0];
    assert_eq!(file.time.tick, Some(Span::from_ms(10)));
    assert!(file.time.measured);
    let gyro = file.gyro.as_ref().unwrap();
    assert_eq!(gyro.ticks.output, OutputKind::Mean);
    let conversions: Vec<_> = gyro.ticks.sensors.iter().map(SensorMapping::conversion).collect();
    let rad_per_deg = std::f64::consts::PI / 180.0;
    assert_eq!(conversions[0].factor.to_bits(), rad_per_deg.to_bits());
    assert_eq!(conversions[1].factor.to_bits(), (-rad_per_deg).to_bits());
    assert_eq!((conversions[2].mid_scale, conversions[2].factor), (32768.0, 0.5));
    assert_eq!(gyro.switch.as_ref().unwrap().from, Some(SwitchFrom::ModeChange));
    assert_eq!(file.accel.as_ref().unwrap().sensors[0].column, Some(Column::Index(4)));
    assert_eq!((file.temperatures[0].unit.read(0.0), file.temperatures[0].every_rows), (-273.15, 3));
}

#[test]
fn every_broken_line_is_named_with_its_place_and_key() {
    // What is replaced, by what, and where the problem is.
    let table: &[(&str, &str, usize, usize, &str)] = &[
        ("version = 1", "version = 2", 1, 11, "version"),
        ("version = 1", "version = \"1\"", 1, 11, "version"),
        ("version = 1\n", "", 1, 1, "version"),
        ("delimiter = \"comma\"", "delimiter = \"colon\"", 3, 13, "file[0].delimiter"),
        ("delimiter = \"comma\"", "delimitre = \"comma\"", 3, 1, "file[0].delimitre"),
        ("header = true", "header = 1", 4, 10, "file[0].header"),
        ("header = true", "header = true\ndecimal_mark = \",\"", 5, 16, "file[0].decimal_mark"),
        ("header = true", "header = true\ncomment = \"-\"", 5, 11, "file[0].comment"),
        ("header = true", "header = true\nskip_lines = -1", 5, 14, "file[0].skip_lines"),
        ("header = true", "header = true\non_bad_row = \"ignore\"", 5, 14, "file[0].on_bad_row"),
        ("unit = \"ms\"", "unit = \"day\"", 7, 8, "file[0].time.unit"),
        ("unit = \"ms\"\n", "", 5, 1, "file[0].time.unit"),
        ("column = \"t\"\n", "", 6, 8, "file[0].time.unit"),
        ("tick_ms = 10\n", "", 5, 1, "file[0].time.tick_ms"),
        ("tick_ms = 10", "tick_ms = 0", 8, 11, "file[0].time.tick_ms"),
        ("tick_ms = 10", "tick_ms = inf", 8, 11, "file[0].time.tick_ms"),
        ("tick_ms = 10", "tick_us = 10000\ntick_ms = 10", 9, 11, "file[0].time.tick_ms"),
        ("tick_ms = 10", "tick_ms = 10\ngap_after_ticks = 1.01", 9, 19, "file[0].time.gap_after_ticks"),
        ("tick_ms = 10", "tick_ms = 10\nmarks = \"middle\"", 9, 9, "file[0].time.marks"),
        ("output = \"mean\"", "output = \"sum\"", 10, 10, "file[0].gyro.output"),
        (
            "{ column = \"x\", unit = \"deg_per_s\" }",
            "{ column = \"x\" }",
            12,
            5,
            "file[0].gyro.sensors[0].unit",
        ),
        ("{ column = \"x\", unit", "{ column = 0, unit", 12, 16, "file[0].gyro.sensors[0].column"),
        ("{ column = \"x\", unit", "{ column = \" \", unit", 12, 16, "file[0].gyro.sensors[0].column"),
        ("{ column = \"x\", unit", "{ columns = \"x\", unit", 12, 7, "file[0].gyro.sensors[0].columns"),
        ("{ column = \"x\", unit", "{ constant = 1, column = \"x\", unit", 12, 5, "file[0].gyro.sensors[0]"),
        ("{ column = \"x\", unit", "{ unit", 12, 5, "file[0].gyro.sensors[0]"),
        ("{ column = 5 }", "{ constant = 5 }", 20, 11, "file[0].accel.sensors"),
        ("unit = \"ms\"", "unit = \"ms\"\ndate_column = \"d\"", 8, 15, "file[0].time.date_column"),
        ("sign = -1", "sign = 0", 13, 48, "file[0].gyro.sensors[1].sign"),
        ("scale = 0.5", "scale = -0.5", 14, 68, "file[0].gyro.sensors[2].scale"),
        ("mid_scale = 32768", "mid_scale = nan", 14, 53, "file[0].gyro.sensors[2].mid_scale"),
        ("minus = \"0\"", "minus = \"1\"", 16, 32, "file[0].gyro.mode.minus"),
        ("mode = { column = \"m\", minus = \"0\" }\n", "", 16, 19, "file[0].gyro.switch.from"),
        ("{ from = \"mode_change\" }", "{ }", 17, 10, "file[0].gyro.switch"),
        ("{ column = 5 }", "{ column = 5, unit = \"g\" }", 20, 33, "file[0].accel.sensors[0].unit"),
        ("{ column = 5 }", "{ column = 5, scale = 2.0 }", 20, 34, "file[0].accel.sensors[0].scale"),
        ("\"counts\"", "\"counts\"\nduration_unit = \"ms\"", 20, 17, "file[0].accel.duration_unit"),
        ("[{ column = 5 }]", "[]", 20, 11, "file[0].accel.sensors"),
        ("[{ column = 5 }]", "5", 20, 11, "file[0].accel.sensors"),
        (
            "channel = \"case\"",
            "channel = \"a name that is longer than it may be\"",
            22,
            11,
            "file[0].temperature[0].channel",
        ),
        ("unit = \"kelvin\"", "unit = \"rankine\"", 24, 8, "file[0].temperature[0].unit"),
        ("every_rows = 3", "every_rows = 0", 25, 14, "file[0].temperature[0].every_rows"),
        ("every_rows = 3", "every_rows = 3\nevery = 3", 26, 1, "file[0].temperature[0].every"),
    ];
    for (from, to, line, column, key) in table {
        assert!(SOUND.contains(from), "{from}");
        let found = problems(&SOUND.replacen(from, to, 1));
        let expected = (*line, *column, (*key).to_owned());
        assert!(found.contains(&expected), "{from} -> {to}: {found:?}, expected {expected:?}");
    }
}

#[test]
fn what_must_hold_between_keys() {
    let names = SOUND.replace("header = true", "header = false");
    assert_eq!(problems(&names), [(2, 1, "file[0]".to_owned())]);
    let empties =
        SOUND.replace("\"comma\"", "\"whitespace\"").replace("every_rows = 3", "may_be_empty = true");
    assert_eq!(problems(&empties), [(2, 1, "file[0]".to_owned())]);
    let two_gyros = format!("{SOUND}{}", SOUND.trim_start_matches("version = 1\n"));
    assert!(problems(&two_gyros).iter().all(|(.., key)| key == "file"), "{:?}", problems(&two_gyros));
    assert_eq!(problems("version = 1\nfile = []\n"), [(2, 8, "file".to_owned())]);
    assert_eq!(problems("version = 1\n"), [(1, 1, "file".to_owned())]);
}

#[test]
fn all_problems_are_reported_at_once_in_the_order_of_lines() {
    let text = SOUND.replace("unit = \"ms\"", "unit = 5").replace("every_rows", "every_row");
    let lines: Vec<_> = problems(&text).into_iter().map(|(line, ..)| line).collect();
    assert_eq!(lines, [7, 25]);
}

#[test]
fn a_problem_reads_like_a_sentence() {
    let problems = Mapping::parse(&SOUND.replace("\"ms\"", "\"day\""), "m.toml").unwrap_err();
    insta::assert_snapshot!(problems[0]);
    let syntax = Mapping::parse("version = 1\nfile = [", "m.toml").unwrap_err();
    assert_eq!((syntax.len(), syntax[0].line), (1, 2));
}

#[test]
fn every_shipped_mapping_holds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/mappings");
    let mut found = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        Mapping::load(&path).unwrap_or_else(|error| panic!("{error}"));
        found += 1;
    }
    assert!(found >= 3);
}
