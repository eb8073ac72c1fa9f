//! `import` on logs as test benches write them, with what is odd in them.

use std::path::Path;

use isotherm_log::file::Sink;

use super::common::{check, replay, root, stderr, stdout, told};
use super::imports::{Expected, ROWS, TEN_MS, import, log, noise};

/// Writes a log into a folder, and says what `import` says of it on standard error.
fn imported(folder: &Path, name: &str, text: &str, options: &[&str]) -> String {
    std::fs::write(folder.join(name), text).unwrap();
    told(folder, &[&["import", name, "--no-plot"], options].concat())
}

#[test]
fn units_that_a_header_states_are_kept() {
    let front = "time_min,gx_deg_h,gy_deg_h,gz_mrad_s,ax_gal,ay_gal,az_gal,temp_F\n";
    let row = |row: usize| {
        let minutes = f64::from(u32::try_from(row).unwrap()) * 1e-3;
        format!("{minutes:.3},{:.4},10.5,-3.25,1.5,-2.5,980.{},77.{}", noise(row, 1), row % 10, row % 10)
    };
    let parts = [
        "column = \"time_min\"\nunit = \"min\"",
        "column = \"gx_deg_h\", unit = \"deg_per_h\" }",
        "column = \"gz_mrad_s\", unit = \"rad_per_s\", scale = 0.001 }",
        "column = \"az_gal\", unit = \"m_per_s2\", scale = 0.01 }",
        "channel = \"imu\"\ncolumn = \"temp_F\"\nunit = \"deg_f\"",
    ];
    let expected = Expected { parts: &parts, period_ns: 60_000_000, gaps: 0, temperatures: 1 };
    import("bench.csv", log(front, row).as_bytes(), &[], &expected);

    // What no mapping can state is asked for, not guessed: 9.8 would be taken for gravity in m/s².
    let front =
        "time [jiffies],gx [furlong],gy [furlong],gz [furlong],ax [kPa],ay [kPa],az [kPa],temp [mV]\n";
    let text =
        log(front, |row| format!("{},1.5,2.5,{:.3},0.1,0.2,9.8,25.{}", row * 10, noise(row, 2), row % 10));
    let folder = tempfile::tempdir().unwrap();
    let asked = imported(folder.path(), "odd.csv", &text, &[]);
    let units = ["--gyro-unit", "raw", "--accel-unit", "raw", "--time-unit", "ms"];
    let output = stdout(&replay(folder.path(), &[&["import", "odd.csv", "--no-plot"][..], &units].concat()));
    insta::assert_snapshot!(asked + &output);
}

#[test]
fn of_rows_of_several_units_one_is_taken() {
    // Two units by turns, each with its own time.
    let text = log("serial,time_s,gx_dps,gy_dps,gz_dps\n", |row| {
        let (serial, time) = (["A-17", "B-4"][row % 2], f64::from(u32::try_from(row / 2).unwrap()) * 0.01);
        format!("{serial},{time:.2},{:.3},{}.5,0.1", noise(row, 3), row % 2)
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let refused =
        imported(path, "two.csv", &text, &[]) + &imported(path, "two.csv", &text, &["--serial", "C-1"]);
    let output = stdout(&replay(path, &["import", "two.csv", "--no-plot", "--serial", "B-4"]));
    let mapping = std::fs::read_to_string(path.join("two.mapping.toml")).unwrap();
    insta::assert_snapshot!(refused + &output + &mapping);
}

#[test]
fn a_row_out_of_order_is_named_with_both_times() {
    let table = |at_300: usize| {
        log("time_s,gx_dps,gy_dps,gz_dps\n", |row| {
            let time = f64::from(u32::try_from(if row == 300 { at_300 } else { row }).unwrap()) * 0.01;
            format!("{time:.2},{:.3},1.5,0.1", noise(row, 4))
        })
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let asked = imported(path, "late.csv", &table(5), &[]);
    // By a mapping that was made of a log in order.
    std::fs::write(path.join("whole.csv"), table(300)).unwrap();
    check(&replay(path, &["import", "whole.csv", "--no-plot"]), 0);
    insta::assert_snapshot!(asked + &told(path, &["info", "late.csv", "--mapping", "whole.mapping.toml"]));
}

#[test]
fn a_time_of_day_goes_on_over_midnight() {
    let text = log("clock,gx_dps,gy_dps,gz_dps\n", |row| {
        let ms = (86_398_000 + row * 10) % 86_400_000;
        let (s, ms) = (ms / 1000, ms % 1000);
        format!("{:02}:{:02}:{:02}.{ms:03},{:.3},1.5,0.1", s / 3600, s / 60 % 60, s % 60, noise(row, 5))
    });
    let parts = ["unit = \"time_of_day\""];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 0 };
    import("night.csv", text.as_bytes(), &[], &expected);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("night.csv"), &text).unwrap();
    insta::assert_snapshot!(stdout(&replay(folder.path(), &["import", "night.csv", "--no-plot"])));
}

#[test]
fn a_column_of_states_is_said_to_be_ignored_and_how_it_would_not_be() {
    let text = log("time_s,gx_dps,gy_dps,gz_dps,valid,test status\n", |row| {
        let time = f64::from(u32::try_from(row).unwrap()) * 0.01;
        let (valid, status) = if row % 100 == 50 { (0, "FAIL") } else { (1, "OK") };
        format!("{time:.2},{:.3},1.5,0.1,{valid},{status}", noise(row, 6))
    });
    let expected = Expected { parts: &[], period_ns: TEN_MS, gaps: 0, temperatures: 0 };
    let (mapping, _) = import("states.csv", text.as_bytes(), &[], &expected);
    // As the note says.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("states.csv"), &text).unwrap();
    let mapping = mapping + "\n[file.status]\ncolumn = 5\ngood = [\"1\"]\n";
    std::fs::write(folder.path().join("states.mapping.toml"), &mapping).unwrap();
    insta::assert_snapshot!(mapping + &stdout(&replay(folder.path(), &["info", "states.csv"])));
}

#[test]
fn rows_that_a_logger_wrote_twice_are_dropped_and_counted() {
    let table = |second: &str| {
        log("time_s,gx_dps,gy_dps,gz_dps\n", |row| {
            let time = f64::from(u32::try_from(row).unwrap()) * 0.01;
            let row = format!("{time:.2},{:.3},1.5,0.1", noise(row, 7));
            format!("{row}\n{row}{second}")
        })
    };
    let expected = Expected { parts: &[], period_ns: TEN_MS, gaps: 0, temperatures: 0 };
    import("twice.csv", table("").as_bytes(), &[], &expected);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("twice.csv"), table("")).unwrap();
    let output = stdout(&replay(path, &["import", "twice.csv", "--no-plot"]));
    // The same time with other values is neither.
    std::fs::write(path.join("other.csv"), table("5")).unwrap();
    insta::assert_snapshot!(output + &told(path, &["info", "other.csv", "--mapping", "twice.mapping.toml"]));
}

#[test]
fn a_log_that_is_read_in_a_wrong_unit_is_doubted() {
    let text = log("time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g\n", |row| {
        let time = f64::from(u32::try_from(row).unwrap()) * 0.01;
        format!("{time:.2},{:.3},1.5,5.1,0.001,0.002,1.000", noise(row, 8))
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let document = root().join("config/calibration/chamber-mems.toml").canonicalize().unwrap();
    imported(path, "rest.csv", &text, &[]);
    let right = std::fs::read_to_string(path.join("rest.mapping.toml")).unwrap();
    let wrong = right.replace("deg_per_s", "rad_per_s").replace("unit = \"g\"", "unit = \"m_per_s2\"");
    std::fs::write(path.join("wrong.toml"), wrong).unwrap();
    let corrected = |mapping| {
        let document = document.to_str().unwrap();
        stderr(&replay(path, &["correct", "rest.csv", "--mapping", mapping, "--calibration", document]))
    };
    insta::assert_snapshot!(format!("{}---\n{}", corrected("rest.mapping.toml"), corrected("wrong.toml")));
}

#[test]
fn a_row_that_begins_with_the_delimiter_is_no_comment() {
    let table = |lacks: usize| {
        log("t;gx;gy;gz\n;°/h;°/h;°/h\n", |row| {
            let time = format!("{},{:02}", row / 100, row % 100);
            format!("{};{row},5;1,5;0,1", if row == lacks { "" } else { &time })
        })
    };
    let parts = ["drop_rows = 1", "{ column = \"gx\", unit = \"deg_per_h\" }"];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 0 };
    let (mapping, _) = import("units.csv", table(ROWS).as_bytes(), &[], &expected);
    assert!(!mapping.contains("comment"), "{mapping}");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lacks.csv"), table(99)).unwrap();
    let output = replay(folder.path(), &["import", "lacks.csv", "--no-plot", "--json"]);
    check(&output, 3);
    let report: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(report["info"]["reading"]["skipped_rows"], 1, "{report}");
}

#[test]
fn increments_signs_and_tenths_are_taken_as_the_header_states_them() {
    let front =
        "t [s],-gyro_1 [deg/s],gyro_2 [deg/s],gyro_3 [deg/s],dv_x [mm/s],dv_y [mm/s],dv_z [mm/s],temp_dC\n";
    let text = log(front, |row| {
        let time = f64::from(u32::try_from(row).unwrap()) * 0.01;
        format!("{time:.2},{:.3},1.5,0.1,0.1,-0.2,98.{},25{}", noise(row, 9), row % 10, row % 10)
    });
    let parts = [
        "    { column = \"-gyro_1 [deg/s]\", unit = \"deg_per_s\", sign = -1 },\n    { column = \"gyro_2 [deg/s]\", unit = \"deg_per_s\" },\n    { column = \"gyro_3",
        "{ column = \"dv_z [mm/s]\", unit = \"m_per_s\", scale = 0.001 }",
        "channel = \"imu\"\ncolumn = \"temp_dC\"\nunit = \"raw\"",
    ];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 1 };
    let (mapping, _) = import("bench.csv", text.as_bytes(), &[], &expected);

    let rows = log("time,sensor,x,y,z\n", |row| {
        let sensor = ["gyro", "acc"][row % 2];
        format!("{}.5,{sensor},{:.3},1.5,0.1", row / 2, noise(row, 10))
    });
    let bare = text.replace(" [mm/s]", "");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let refused = imported(path, "rows.csv", &rows, &[]) + &imported(path, "bare.csv", &bare, &[]);
    insta::assert_snapshot!(mapping + &refused);
}

#[test]
fn temperatures_of_a_second_file_are_read_and_doubted_where_their_clock_is_another() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let seconds = |row: usize, step: f64| f64::from(u32::try_from(row).unwrap()) * step;
    let gyros = log("time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g\n", |row| {
        format!("{:.2},{:.3},1.5,0.1,0.001,0.002,1.000", seconds(row, 0.01), noise(row, 11))
    });
    std::fs::write(path.join("imu.csv"), gyros).unwrap();
    let imported = |begin: f64, header: &str| {
        let temperatures = log(&format!("time_s,{header}\n"), |row| {
            format!("{:.1},298.1{}", begin + seconds(row, 0.1), row % 10)
        });
        let until = temperatures.lines().take(51).collect::<Vec<_>>().join("\n");
        std::fs::write(path.join("temp.csv"), until).unwrap();
        let output = replay(path, &["import", "imu.csv", "temp.csv", "--no-plot", "--overwrite"]);
        check(&output, 0);
        let document = root().join("config/calibration/chamber-mems.toml").canonicalize().unwrap();
        let mapping = std::fs::read_to_string(path.join("imu.mapping.toml")).unwrap();
        std::fs::write(path.join("imu.mapping.toml"), mapping.replace("\"t_block\"", "\"imu\"")).unwrap();
        let args = ["correct", "imu.csv", "temp.csv", "--calibration", document.to_str().unwrap()];
        let said = stderr(&replay(path, &args));
        stdout(&output) + &said
    };
    let same = imported(0.0, "T_block_K");
    insta::assert_snapshot!(format!("{same}---\n{}", imported(1000.0, "Temperature [K]")));
}

#[test]
fn sensors_in_every_second_row_have_ticks_as_long_as_two_rows() {
    for counter in ["n,", ""] {
        // Two rows in the place of one, the second without gyros; two are missing.
        let text = log(&format!("{counter}time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g\n"), |row| {
            let pair = row + usize::from(row >= 100);
            let line = |number: usize, gyros: &str| {
                let own = if counter.is_empty() { String::new() } else { format!("{number},") };
                format!("{own}{:.3},{gyros},0.1,0.2,0.9", f64::from(u32::try_from(number).unwrap()) * 0.005)
            };
            line(2 * pair, &format!("{:.3},1.5,2.5", noise(row, 1))) + "\n" + &line(2 * pair + 1, ",,")
        });
        let numbered =
            if counter.is_empty() { "" } else { "[file.accel]\noutput = \"mean\"\nsequence_column = \"n\"" };
        let parts = [
            "[file.gyro]\noutput = \"mean\"\nmay_be_empty = true",
            "time: a tick in every 2 rows, 10 ms long",
            "gap_after_ticks = 1.5",
            numbered,
        ];
        let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 1, temperatures: 0 };
        import("turns.csv", text.as_bytes(), &[], &expected);
    }
}

#[test]
fn rows_of_other_figures_before_a_table_without_header_are_told() {
    let odd = "0.5,1.5,2.5,1\n".repeat(6);
    let text = log(&odd, |row| format!("{row},{},{},3.{}", row % 7, row % 5, row % 10));
    let parts = ["#   odd.csv: 6 rows of other figures before the data: passed over", "skip_lines = 6"];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 1 };
    let columns = "gx [deg/s],gy,gz,temp [degC]";
    import("odd.csv", text.as_bytes(), &["--columns", columns, "--rate-hz", "100"], &expected);
}

#[test]
fn a_channel_has_a_name_that_fits_in_whatever_letters() {
    let text =
        log("time_s,gx_dps,gy_dps,gz_dps,Температура внутри блока [°C]\n", |row| {
            let time = f64::from(u32::try_from(row).unwrap()) * 0.01;
            format!("{time:.2},{:.3},1.5,2.5,25.{}", noise(row, 1), row % 10)
        });
    let parts = ["channel = \"температур\""];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 1 };
    import("log.csv", text.as_bytes(), &[], &expected);
}

#[test]
fn a_compressed_log_that_is_cut_short_is_imported_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv.gz");
    let text = log("time_s,gx_dps,gy_dps,gz_dps\n", |row| {
        format!("{:.2},{:.3},1.5,2.5", f64::from(u32::try_from(row).unwrap()) * 0.01, noise(row, 1))
    });
    let mut sink = Sink::create(&path).unwrap();
    sink.write(|writer| writer.write_all(text.as_bytes())).unwrap();
    sink.finish().unwrap().keep().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let output = replay(folder.path(), &["import", "log.csv.gz", "--no-plot", "--json"]);
    check(&output, 3);
    let report: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let reading = &report["info"]["reading"];
    let rows = reading["rows"].as_u64().unwrap();
    assert!(reading["cut_short"] == true && (50..450).contains(&rows), "{reading}");
}
