//! `import` on logs with dates, with words of other languages, and with fewer gyros than axes.
//!
//! | log | header from |
//! |---|---|
//! | phyphox | its exports in English, German and French (RWTH Aachen; decimal mark as chosen there) |
//! | `WitMotion` | records of `MiniIMU` and the app in Chinese |
//! | chamber, one-axis turntable | tables as German data loggers and Excel write them |

use isotherm_log::mapping::{Column, Mapping, TimeUnit};

use super::common::{check, replay, root, told};
use super::imports::{Expected, ROWS, TEN_MS, import, log, noise};

/// `HH:MM:SS` and the ms of a row that begins so many seconds after midnight, at 100 Hz.
fn clock(begin_s: usize, row: usize) -> (String, usize) {
    let ms = row * 10;
    let s = begin_s + ms / 1000;
    (format!("{:02}:{:02}:{:02}", s / 3600 % 24, s / 60 % 60, s % 60), ms % 1000)
}

/// A log without gaps and temperatures.
fn plain<'a>(parts: &'a [&'a str]) -> Expected<'a> {
    Expected { parts, period_ns: TEN_MS, gaps: 0, temperatures: 0 }
}

/// A mapping's only stamps.
fn stamps(mapping: &Mapping) -> (TimeUnit, Option<Column>) {
    let stamps = mapping.files[0].time.stamps.clone().unwrap();
    (stamps.unit, stamps.date)
}

#[test]
fn a_german_chamber_log_with_dates_and_words_of_its_language() {
    let front = "Datum/Uhrzeit;Drehrate X [°/s];Drehrate Y [°/s];Drehrate Z [°/s];Beschleunigung X [m/s²];Beschleunigung Y [m/s²];\
        Beschleunigung Z [m/s²];Temperatur Kammer [°C]\n";
    let text = log(front, |row| {
        let (time, ms) = clock(36_000, row);
        format!("31.12.2026 {time},{ms:03};{:.4};0,01;0,02;0,1;-0,2;9,81;25,{}", noise(row, 1), row % 10)
            .replace('.', ",")
            .replacen("31,12,", "31.12.", 1)
    });
    let parts = [
        "decimal_mark = \",\"",
        "column = \"Datum/Uhrzeit\"\nunit = \"dmy\"",
        "column = \"Drehrate X [°/s]\", unit = \"deg_per_s\"",
        "column = \"Beschleunigung Z [m/s²]\", unit = \"m_per_s2\"",
        "channel = \"kammer\"",
    ];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 1 };
    let (_, mapping) = import("Kammer.csv", text.as_bytes(), &[], &expected);
    assert_eq!(stamps(&mapping), (TimeUnit::DayFirst, None));
}

#[test]
fn a_date_beside_the_time_of_day_goes_on_over_midnight() {
    let front = "Datum\tZeit\tDrehrate_X [°/h]\tDrehrate_Y [°/h]\tDrehrate_Z [°/h]\n";
    // A row is missing; the second half is on another day.
    let text = log(front, |row| {
        let number = row + usize::from(row >= 100);
        let (time, ms) = clock(86_398, number);
        let day = if time.starts_with("23") { "28.02.2027" } else { "01.03.2027" };
        format!("{day}\t{time}.{ms:03}\t{:.3}\t1.5\t2.5", noise(row, 2))
    });
    let parts = ["column = \"Zeit\"\nunit = \"dmy\"\ndate_column = \"Datum\"", "gap_after_ticks"];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 1, temperatures: 0 };
    import("nacht.txt", text.as_bytes(), &[], &expected);
    // Cells without quotes, delimited by spaces: a date and time are two of them.
    let text = text.replace(['\t'], " ").replace("[°/h]", "").replace('_', "");
    let text = text.replacen("DrehrateX  DrehrateY  DrehrateZ ", "gx gy gz", 1);
    let parts = ["delimiter = \"whitespace\"", "column = \"Zeit\"\nunit = \"dmy\"\ndate_column = \"Datum\""];
    let unit = ["--gyro-unit", "deg_per_h"];
    import("nacht2.txt", text.as_bytes(), &unit, &Expected { parts: &parts, ..expected });
}

#[test]
fn a_date_that_could_be_read_in_two_ways_is_asked_for() {
    let table = |date: &str, half: &str| {
        log("time,gx [deg/s],gy [deg/s],gz [deg/s]\n", |row| {
            let (time, ms) = clock(3600, row);
            format!("{date} {time}.{ms:03}{half},{:.3},1.5,2.5", noise(row, 3))
        })
    };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("us.csv"), table("02/03/2026", "")).unwrap();
    insta::assert_snapshot!(told(folder.path(), &["import", "us.csv"]));
    for (date, options, unit) in [
        ("02/03/2026", &["--time-unit", "mdy"][..], "unit = \"mdy\""),
        ("02/03/2026", &["--time-unit", "dmy"], "unit = \"dmy\""),
        ("02/13/2026", &[], "unit = \"mdy\""),
        ("13-02-2026", &[], "unit = \"dmy\""),
        ("2026/02/03", &[], "unit = \"iso\""),
    ] {
        import("dates.csv", table(date, "").as_bytes(), options, &plain(&[unit]));
    }
    // In the evening, as Americans write; and without any date.
    import("evening.csv", table("02/13/2026", " PM").as_bytes(), &[], &plain(&["unit = \"mdy\""]));
    let text = table("@", "").replace("@ ", "");
    import("clock.csv", text.as_bytes(), &[], &plain(&["unit = \"time_of_day\""]));
}

#[test]
fn phyphox_and_witmotion_in_their_languages() {
    let seconds = |row: usize| f64::from(u32::try_from(row).unwrap()) * 0.01;
    for (front, word) in [
        (
            "\"Zeit (s)\",\"Gyroskop x (rad/s)\",\"Gyroskop y (rad/s)\",\"Gyroskop z (rad/s)\"\n",
            "Gyroskop x (rad/s)",
        ),
        (
            "\"Temps (s)\",\"Gyroscope x (rad/s)\",\"Gyroscope y (rad/s)\",\"Gyroscope z (rad/s)\"\n",
            "Gyroscope x (rad/s)",
        ),
        (
            "\"Temps (s)\",\"Vitesse angulaire x (rad/s)\",\"Vitesse angulaire y (rad/s)\",\"Vitesse angulaire z (rad/s)\"\n",
            "Vitesse angulaire x (rad/s)",
        ),
    ] {
        let text = log(front, |row| format!("{:.6E},{:.6E},1.0E-3,2.0E-3", seconds(row), noise(row, 4)));
        let column = format!("column = \"{word}\", unit = \"rad_per_s\"");
        import("Gyroscope.csv", text.as_bytes(), &[], &plain(&[&column]));
    }
    let front = "时间(s)\t加速度X(g)\t加速度Y(g)\t加速度Z(g)\t角速度X(°/s)\t角速度Y(°/s)\t角速度Z(°/s)\t角度X(°)\t角度Y(°)\t角度Z(°)\t温度(°C)\n";
    let text = log(front, |row| {
        format!(
            "{:.3}\t0.01\t0.02\t0.9985\t{:.4}\t0.1\t0.2\t1.5\t2.5\t3.5\t31.{}",
            seconds(row),
            noise(row, 5),
            row % 10
        )
    });
    let parts = [
        "column = \"角速度X(°/s)\", unit = \"deg_per_s\"",
        "column = \"加速度Z(g)\", unit = \"g\"",
        "column = \"温度(°C)\"\nunit = \"deg_c\"",
    ];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 1 };
    import("witmotion.txt", text.as_bytes(), &[], &expected);
}

#[test]
fn one_gyro_is_corrected_and_the_axes_that_the_log_does_not_have_read_zero() {
    let text = log("Zeit [s];Drehrate [°/s];Temperatur [°C]\n", |row| {
        let time = f64::from(u32::try_from(row).unwrap()) * 0.01;
        format!("{time:.2};{:.5};25,{}", 1.0 + noise(row, 6) * 1e-3, row % 10).replace('.', ",")
    });
    let expected = Expected { parts: &[], period_ns: TEN_MS, gaps: 0, temperatures: 1 };
    insta::assert_snapshot!(import("drehtisch.csv", text.as_bytes(), &[], &expected).0);

    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("drehtisch.csv"), &text).unwrap();
    check(&replay(folder.path(), &["import", "drehtisch.csv", "--no-plot"]), 0);
    let document = root().join("config/calibration/chamber-mems.toml").canonicalize().unwrap();
    let document = document.to_str().unwrap();
    let output =
        replay(folder.path(), &["correct", "drehtisch.csv", "--calibration", document, "--out", "c.csv"]);
    check(&output, 0);
    let corrected = std::fs::read_to_string(folder.path().join("c.csv")).unwrap();
    let mut lines = corrected.lines();
    let names: Vec<_> = lines.next().unwrap().split(',').collect();
    let at = names.iter().position(|name| *name == "delta_angle_x_rad").unwrap();
    let angles: Vec<f64> = lines.map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect();
    assert_eq!(angles.len(), ROWS);
    let rate_deg_per_s = angles.iter().sum::<f64>().to_degrees() / 5.0;
    assert!((rate_deg_per_s - 1.0).abs() < 0.05, "{rate_deg_per_s}");

    // Of two axes the names say which.
    let text = log("t [s],gz [deg/s],gx [deg/s]\n", |row| {
        format!("{:.2},{:.3},1.5", f64::from(u32::try_from(row).unwrap()) * 0.01, noise(row, 7))
    });
    let expected = Expected {
        parts: &["gx [deg/s], gz [deg/s] in deg_per_s as x and z; 0 for y, which"],
        period_ns: TEN_MS,
        gaps: 0,
        temperatures: 0,
    };
    let (_, mapping) = import("two.csv", text.as_bytes(), &[], &expected);
    let columns =
        mapping.files[0].gyro.as_ref().unwrap().ticks.sensors.iter().map(|sensor| sensor.column.clone());
    let name = |name: &str| Some(Column::Name(name.to_owned()));
    assert_eq!(columns.collect::<Vec<_>>(), [name("gx [deg/s]"), None, name("gz [deg/s]")]);
}
