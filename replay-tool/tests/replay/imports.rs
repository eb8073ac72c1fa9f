//! `import` on logs as the programs of ten makers write them, and on the real logs where they are there.
//!
//! The headers are those that the makers' programs write, or print in their examples; the figures are made up.
//!
//! | log | header from |
//! |---|---|
//! | Xsens MT Manager | test of `OpenSim` (opensim-core, `testIMUHelper`), raw data of an MTw |
//! | VectorNav, KVH | `ImuDataLogger.cpp`, `KvhDataLogger.cpp` of INSTINCT (Universität Stuttgart) |
//! | SBG Systems | sbgECom, `tools/sbgBasicLogger/src/loggerEntry/loggerEntryImu.cpp` |
//! | Analog Devices | output registers of the ADIS16xxx, as their evaluation software names columns |
//! | Bosch Sensortec | BMI270 Sensor API, example `accel_gyro` |
//! | x-io Technologies | x-IMU3 and x-IMU APIs, `CSVheadings` |
//! | PX4 | `sensor_combined` by `ulog2csv` |
//! | `EuRoC` | `imu0/data.csv` (ADIS16448) |
//! | ROS | `rostopic echo -p` of `sensor_msgs/Imu` |
//! | STMicroelectronics, Shimmer | MEMS Studio; `ConsensysPRO` |
//! | `LabVIEW` | measurement file (LVM) |
//! | a German Excel | decimal comma, semicolons, Latin-1 and UTF-16 |

use std::fmt::Write;
use std::path::Path;

use isotherm_log::mapping::{Column, Encoding, Mapping};
use serde_json::{Value, json};

use super::common::{self, check, replay, stdout, told};
use super::real_logs::data;

/// Rows of a log at 100 Hz at rest.
pub(crate) const ROWS: usize = 500;

/// A number that differs from row to row, reproducibly.
pub(crate) fn noise(row: usize, column: usize) -> f64 {
    let mixed = (row * 7919 + column * 104_729) % 1000;
    f64::from(u32::try_from(mixed).unwrap()) * 1e-3 - 0.5
}

/// A log: lines in front, then one line per row.
pub(crate) fn log(front: &str, row: impl Fn(usize) -> String) -> String {
    let mut text = front.to_owned();
    for index in 0..ROWS {
        let _ = writeln!(text, "{}", row(index));
    }
    text
}

/// What `import` must find.
pub(crate) struct Expected<'a> {
    /// Parts that the mapping must have.
    pub(crate) parts: &'a [&'a str],
    pub(crate) period_ns: i64,
    pub(crate) gaps: u64,
    pub(crate) temperatures: usize,
}

/// Imports a log without a word, and checks what came of it.
pub(crate) fn import(
    name: &str,
    bytes: &[u8],
    options: &[&str],
    expected: &Expected<'_>,
) -> (String, Mapping) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(name), bytes).unwrap();
    let output = replay(folder.path(), &[&["import", name, "--json"], options].concat());
    check(&output, 0);
    let report: Value = serde_json::from_str(&stdout(&output)).unwrap();
    let text = std::fs::read_to_string(folder.path().join(report["mapping"].as_str().unwrap())).unwrap();
    for part in expected.parts {
        assert!(text.contains(part), "{name}: {part}\n{text}");
    }
    let mapping = Mapping::parse(&text, name).unwrap();
    let file = &mapping.files[0];
    assert_eq!(file.time.tick.unwrap().as_ns(), expected.period_ns, "{name}\n{text}");
    assert_eq!(file.temperatures.len(), expected.temperatures, "{name}\n{text}");
    let topics = report["info"]["units"]["log"]["topics"].as_array().unwrap();
    let gyro = topics.iter().find(|topic| topic["key"] == "imu/log/raw/gyro").unwrap();
    let found = (gyro["ticks"].as_u64(), gyro["order"]["gaps"]["count"].as_u64());
    assert_eq!(found, (Some(ROWS as u64), Some(expected.gaps)), "{name}: {gyro}");
    let page = report["plot"].as_str().unwrap();
    assert!(std::fs::metadata(folder.path().join(page)).unwrap().len() > 10_000, "{name}");
    (text, mapping)
}

pub(crate) const TEN_MS: i64 = 10_000_000;

#[test]
fn xsens_a_rate_in_the_comments_and_a_counter_that_begins_anew() {
    let front = "// Start Time: Unknown\n// Update Rate: 100.0Hz\n// Filter Profile: human (46.1)\n// Firmware Version: 4.0.2\n\
        PacketCounter\tSampleTimeFine\tYear\tMonth\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tMag_X\tMag_Y\tMag_Z\n";
    let text = log(front, |row| {
        let counter = (65_400 + row) % 65_536;
        format!(
            "{counter:05}\t\t\t\t{:.6}\t0.05\t9.80{}\t{:.6}\t0.002\t-0.003\t-0.04\t-0.26\t0.89",
            noise(row, 1),
            row % 10,
            noise(row, 2) * 1e-3
        )
    });
    let parts = [
        "delimiter = \"tab\"",
        "comment = \"//\"",
        "column = \"Gyr_X\", unit = \"rad_per_s\"",
        "column = \"Acc_Z\", unit = \"m_per_s2\"",
    ];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 0 };
    let (text, mapping) = import("MT_00B421AF.txt", text.as_bytes(), &[], &expected);
    assert!(mapping.files[0].time.stamps.is_none() && !text.contains("sequence_column"), "{text}");
    insta::assert_snapshot!(text);
}

#[test]
fn vectornav_the_uncompensated_sensors_and_the_clock_of_the_instrument() {
    let front = "Time [s],GpsCycle,GpsWeek,GpsToW [s],TimeStartup [ns],UnCompMagX [Gauss],UnCompMagY [Gauss],UnCompMagZ [Gauss],\
        UnCompAccX [m/s^2],UnCompAccY [m/s^2],UnCompAccZ [m/s^2],UnCompGyroX [rad/s],UnCompGyroY [rad/s],UnCompGyroZ [rad/s],Temperature [Celsius]\n";
    // Two rows are missing.
    let text = log(front, |row| {
        let ns = 16_792_498_000_i64 + i64::try_from(row + if row < 300 { 0 } else { 2 }).unwrap() * TEN_MS;
        format!(
            "{:.4},2,185,281202.8,{ns},0.26,-0.01,0.51,0.12,-0.03,-9.8{},{:.6},1e-4,2e-4,31.{}",
            row / 100,
            row % 10,
            noise(row, 3) * 1e-3,
            row % 10
        )
    });
    let parts = [
        "column = \"TimeStartup [ns]\"",
        "column = \"UnCompGyroX [rad/s]\", unit = \"rad_per_s\"",
        "unit = \"m_per_s2\"",
        "channel = \"imu\"",
    ];
    import(
        "vn100.csv",
        text.as_bytes(),
        &[],
        &Expected { parts: &parts, period_ns: TEN_MS, gaps: 1, temperatures: 1 },
    );
}

#[test]
fn kvh_a_counter_that_numbers_the_gaps() {
    let front = "Time [s],GpsCycle,GpsWeek,GpsToW [s],TimeStartup [ns],UnCompMagX [Gauss],UnCompMagY [Gauss],UnCompMagZ [Gauss],\
        UnCompAccX [m/s^2],UnCompAccY [m/s^2],UnCompAccZ [m/s^2],UnCompGyroX [rad/s],UnCompGyroY [rad/s],UnCompGyroZ [rad/s],Temperature [Celsius],Status,SequenceNumber\n";
    let text = log(front, |row| {
        let number = row + if row < 300 { 0 } else { 3 };
        let ns = i64::try_from(number).unwrap() * TEN_MS;
        let temperature = if row % 4 == 0 { "31.5" } else { "" };
        format!(
            "{:.2},,,,{ns},,,,0.12,-0.03,-9.81,{:.6},1e-4,2e-4,{temperature},119,{number}",
            number / 100,
            noise(row, 4) * 1e-3
        )
    });
    let parts = ["sequence_column = \"SequenceNumber\"", "may_be_empty = true"];
    let (text, _) = import(
        "kvh1750.csv",
        text.as_bytes(),
        &[],
        &Expected { parts: &parts, period_ns: TEN_MS, gaps: 1, temperatures: 1 },
    );
    assert!(!text.contains("gap_after_ticks"), "{text}");
}

#[test]
fn sbg_a_row_of_units_below_the_header() {
    let front = "timestamp\tstatus\taccelX\taccelY\taccelZ\tgyroX\tgyroY\tgyroZ\ttemperature\n\
        (us)\t(na)\t(m.s^-2)\t(m.s^-2)\t(m.s^-2)\t(deg.s^-1)\t(deg.s^-1)\t(deg.s^-1)\t(degC)\n";
    let text = log(front, |row| {
        format!(
            "{}\t0x000003ff\t0.01\t-0.02\t-9.80{}\t{:.5}\t0.01\t0.02\t40.{}",
            5_000_000 + row * 5000,
            row % 10,
            noise(row, 5),
            row % 10
        )
    });
    let parts = [
        "drop_rows = 1",
        "column = \"timestamp\"\nunit = \"us\"",
        "column = \"gyroX\", unit = \"deg_per_s\"",
        "unit = \"m_per_s2\"",
        "unit = \"deg_c\"",
    ];
    import(
        "imuShort.txt",
        text.as_bytes(),
        &[],
        &Expected { parts: &parts, period_ns: 5_000_000, gaps: 0, temperatures: 1 },
    );
}

#[test]
fn analog_devices_registers_are_raw_readings_and_the_rate_is_asked() {
    let front = "DATA_CNTR,X_GYRO_OUT,Y_GYRO_OUT,Z_GYRO_OUT,X_ACCL_OUT,Y_ACCL_OUT,Z_ACCL_OUT,TEMP_OUT\n";
    let text = log(front, |row| {
        format!("{},{},-12,7,45,-20,{},{}", row + 100, row % 37, 1240 + row % 5, 250 + row % 3)
    });
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("adis16495.csv"), &text).unwrap();
    insta::assert_snapshot!(told(folder.path(), &["import", "adis16495.csv"]));
    assert!(!folder.path().join("adis16495.mapping.toml").exists());
    let parts = [
        "sequence_column = \"DATA_CNTR\"",
        "column = \"X_GYRO_OUT\", unit = \"raw\"",
        "column = \"X_ACCL_OUT\", unit = \"raw\"",
        "unit = \"raw\"",
    ];
    let expected = Expected { parts: &parts, period_ns: 500_000, gaps: 0, temperatures: 1 };
    import("adis16495.csv", text.as_bytes(), &["--rate-hz", "2000"], &expected);
}

#[test]
fn bosch_physical_readings_beside_raw_ones() {
    let front = "\nData set, Accel Range, Acc_Raw_X, Acc_Raw_Y, Acc_Raw_Z, Acc_ms2_X, Acc_ms2_Y, Acc_ms2_Z, Gyr_Raw_X, Gyr_Raw_Y, Gyr_Raw_Z, Gyro_DPS_X, Gyro_DPS_Y, Gyro_DPS_Z\n\n";
    let text = log(front, |row| {
        format!(
            "{row}, 0, 12, -3, 16380, 0.01, -0.02, 9.81, {}, 2, 3, {:.2}, 0.12, 0.18",
            row % 9,
            noise(row, 6)
        )
    });
    let parts = [
        "sequence_column = \"Data set\"",
        "column = \"Gyro_DPS_X\", unit = \"deg_per_s\"",
        "column = \"Acc_ms2_X\", unit = \"m_per_s2\"",
    ];
    import(
        "bmi270.csv",
        text.as_bytes(),
        &["--rate-hz", "100"],
        &Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 0 },
    );
}

#[test]
fn x_io_units_in_parentheses() {
    let front = "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n";
    let text = log(front, |row| {
        format!(
            "{:.2},{:.3},0.1,0.2,0.01,0.02,1.001",
            f64::from(u32::try_from(row).unwrap()) * 0.01,
            noise(row, 7)
        )
    });
    let parts = [
        "column = \"Time (s)\"\nunit = \"s\"",
        "column = \"Gyroscope X (deg/s)\", unit = \"deg_per_s\"",
        "column = \"Accelerometer X (g)\", unit = \"g\"",
    ];
    import(
        "Inertial.csv",
        text.as_bytes(),
        &[],
        &Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 0 },
    );
}

#[test]
fn px4_indices_in_brackets_and_microseconds_by_their_step() {
    let front = "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_timestamp_relative,accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2],accelerometer_integral_dt\n";
    let text = log(front, |row| {
        format!(
            "{},{:.7},0.0001,-0.0002,4000,0,0.05,-0.1,-9.79,4000",
            187_231_000 + row * 4000,
            noise(row, 8) * 1e-2
        )
    });
    let parts = [
        "column = \"timestamp\"\nunit = \"us\"",
        "column = \"gyro_rad[0]\", unit = \"rad_per_s\"",
        "column = \"accelerometer_m_s2[2]\", unit = \"m_per_s2\"",
    ];
    import(
        "sensor_combined_0.csv",
        text.as_bytes(),
        &[],
        &Expected { parts: &parts, period_ns: 4_000_000, gaps: 0, temperatures: 0 },
    );
}

#[test]
fn euroc_a_header_that_looks_like_a_comment() {
    let front = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
    let text = log(front, |row| {
        format!(
            "{},{:.9},0.02,0.07,8.14,-0.37,-2.4",
            1_403_636_579_758_555_392_i64 + i64::try_from(row).unwrap() * 5_000_000,
            noise(row, 9) * 0.1
        )
    });
    let parts = [
        "column = \"#timestamp [ns]\"",
        "column = \"w_RS_S_x [rad s^-1]\", unit = \"rad_per_s\"",
        "unit = \"m_per_s2\"",
    ];
    import(
        "data.csv",
        text.as_bytes(),
        &[],
        &Expected { parts: &parts, period_ns: 5_000_000, gaps: 0, temperatures: 0 },
    );
}

#[test]
fn ros_stamps_of_this_century_are_nanoseconds() {
    let front = "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.orientation.x,field.orientation.y,field.orientation.z,field.orientation.w,\
        field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z,field.angular_velocity_covariance0,\
        field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z,field.linear_acceleration_covariance0\n";
    let text = log(front, |row| {
        let ns = 1_600_000_000_000_000_000_i64 + i64::try_from(row).unwrap() * TEN_MS;
        format!(
            "{},{row},{ns},imu_link,0,0,0,1,{:.6},0.001,0.002,0,0.1,-0.2,9.8,0",
            ns + 1_000_000,
            noise(row, 10) * 1e-2
        )
    });
    let parts = [
        "unit = \"ns\"",
        "sequence_column = \"field.header.seq\"",
        "column = \"field.angular_velocity.x\", unit = \"rad_per_s\"",
        "column = \"field.linear_acceleration.z\", unit = \"m_per_s2\"",
    ];
    import(
        "imu.csv",
        text.as_bytes(),
        &[],
        &Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 0 },
    );
}

#[test]
fn st_thousandths_of_a_unit_are_a_scale() {
    let front = "Time [s],A_x [mg],A_y [mg],A_z [mg],G_x [mdps],G_y [mdps],G_z [mdps],Temp [F]\n";
    let text = log(front, |row| {
        let time = f64::from(u32::try_from(row).unwrap()) / 104.0;
        format!("{time:.6},1.5,-2.5,1000.{},{:.1},70.0,-35.0,77.{}", row % 10, noise(row, 16) * 1e3, row % 10)
    });
    let parts = [
        "column = \"G_x [mdps]\", unit = \"deg_per_s\", scale = 0.001 }",
        "column = \"A_z [mg]\", unit = \"mg\" }",
        "column = \"Temp [F]\"\nunit = \"deg_f\"",
    ];
    let expected = Expected { parts: &parts, period_ns: 9_615_000, gaps: 0, temperatures: 1 };
    import("mems_studio.csv", text.as_bytes(), &[], &expected);
}

#[test]
fn shimmer_a_row_of_units_without_brackets() {
    let front = "\"sep=\t\"\n\
        Shimmer_67A1_Timestamp_Unix_CAL\tShimmer_67A1_Accel_LN_X_CAL\tShimmer_67A1_Accel_LN_Y_CAL\tShimmer_67A1_Accel_LN_Z_CAL\t\
        Shimmer_67A1_Gyro_X_CAL\tShimmer_67A1_Gyro_Y_CAL\tShimmer_67A1_Gyro_Z_CAL\t\n\
        ms\tm/(s^2)\tm/(s^2)\tm/(s^2)\tdeg/s\tdeg/s\tdeg/s\t\n";
    let text = log(front, |row| {
        format!(
            "{}\t0.01\t-0.02\t9.80{}\t{:.5}\t0.01\t0.02\t",
            1_600_000_000_000_i64 + i64::try_from(row).unwrap() * 10,
            row % 10,
            noise(row, 17)
        )
    });
    let parts = [
        "drop_rows = 1",
        "column = \"Shimmer_67A1_Timestamp_Unix_CAL\"\nunit = \"ms\"",
        "column = \"Shimmer_67A1_Gyro_X_CAL\", unit = \"deg_per_s\"",
        "column = \"Shimmer_67A1_Accel_LN_Z_CAL\", unit = \"m_per_s2\"",
    ];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 0 };
    import("shimmer.csv", text.as_bytes(), &[], &expected);
}

#[test]
fn labview_a_header_of_many_lines_and_decimal_commas() {
    let front = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\n***End_of_Header***\t\n\t\nChannels\t7\t\n\
        X0\t0,0E+0\t0,0E+0\t\n***End_of_Header***\t\nX_Value\tGyroX [deg/h]\tGyroY [deg/h]\tGyroZ [deg/h]\tTemp [°C]\n";
    let text = log(front, |row| {
        let time = f64::from(u32::try_from(row).unwrap()) * 0.01;
        format!("{time:.6}\t{:.4}\t10.5\t-3.25\t25.{}", noise(row, 18), row % 10).replace('.', ",")
    });
    let parts = ["column = \"X_Value\"\nunit = \"s\"", "column = \"GyroX [deg/h]\", unit = \"deg_per_h\""];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 1 };
    import("run.lvm", text.as_bytes(), &[], &expected);
}

#[test]
fn dates_and_times_are_stamps() {
    // A row is missing.
    let text = log("-,time,gx [deg/s],gy [deg/s],gz [deg/s]\n", |row| {
        let ms = (row + usize::from(row >= 300)) * 10;
        format!("x,2024-05-01T10:00:{:02}.{:03}+02:00,{:.4},1.5,2.5", ms / 1000, ms % 1000, noise(row, 19))
    });
    let parts = ["unit = \"iso\"", "gap_after_ticks"];
    let expected = Expected { parts: &parts, period_ns: TEN_MS, gaps: 1, temperatures: 0 };
    import("dated.csv", text.as_bytes(), &[], &expected);
    // Names that are given may begin with one that is passed over.
    let columns = ["--columns", "-,time,gx [rad/s],gy,gz"];
    let parts = ["unit = \"iso\"", "unit = \"rad_per_s\""];
    import("dated.csv", text.as_bytes(), &columns, &Expected { parts: &parts, ..expected });
}

#[test]
fn a_german_table_in_latin_1_and_in_utf_16() {
    let front = "Prüfstand 7;Kammer\nZeit_ms;Gyro X [°/s];Gyro Y [°/s];Gyro Z [°/s];Acc X [g];Acc Y [g];Acc Z [g];Temp [°C]\n".replace("Zeit", "Time");
    let text = log(&front, |row| {
        format!("{};{:.4};0,0100;0,0200;0,0010;-0,0020;0,9998;25,{}", row * 10, noise(row, 11), row % 10)
            .replace('.', ",")
    });
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    let wide: Vec<u8> =
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let own = [
        "delimiter = \"semicolon\"",
        "decimal_mark = \",\"",
        "skip_lines = 1",
        "column = \"Gyro X [°/s]\", unit = \"deg_per_s\"",
        "column = \"Acc X [g]\", unit = \"g\"",
        "unit = \"deg_c\"",
    ];
    for (bytes, encoding, word) in [
        (text.clone().into_bytes(), Encoding::Utf8, "version = 1"),
        (latin, Encoding::Latin1, "encoding = \"latin-1\""),
        (wide, Encoding::Utf16Le, "encoding = \"utf-16le\""),
    ] {
        let parts = [&own[..], &[word]].concat();
        let (_, mapping) = import(
            "kammer.csv",
            &bytes,
            &[],
            &Expected { parts: &parts, period_ns: TEN_MS, gaps: 0, temperatures: 1 },
        );
        assert_eq!(mapping.files[0].layout.encoding, encoding);
    }
}

#[test]
fn what_no_log_says_is_asked_for_with_its_option() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("bare.txt", &log("", |row| format!("{} 1.5 2.5 {:.3} 0.1 0.2 9.8", row * 10, noise(row, 12))));
    // A column in a sensor's unit is not passed over while such sensors lack.
    let row = |row| format!("{},1.5,2.5,{:.3},0.1,1.0", row * 10, noise(row, 14));
    write("left.csv", &log("time_ms,gx [deg/s],gy [deg/s],gz [deg/s],lateral [g],vertical [g]\n", row));
    write(
        "units.csv",
        &log("time_ms,gx,gy,gz\n", |row| format!("{},1.5,2.5,{:.3}", row * 10, noise(row, 13))),
    );
    write(
        "steps.csv",
        &log("time,gx [deg/s],gy [deg/s],gz [deg/s]\n", |row| {
            format!("{},1.5,2.5,{:.3}", row * 1000, noise(row, 14))
        }),
    );
    write(
        "twice.csv",
        &log("time [s],gx [deg/s],gy [deg/s],gz [deg/s]\n", |row| {
            format!(
                "{:.2},1.5,2.5,{:.3}",
                f64::from(u32::try_from(row - usize::from(row == 300)).unwrap()) / 100.0,
                noise(row, 20)
            )
        }),
    );
    let stamped = |row: usize| format!("{},1.5,2.5,{:.3}", row * 10, noise(row, 21));
    let unstamped = |row| if row % 2 == 0 { stamped(row) } else { format!("none,1.5,2.5,{row:.3}") };
    write("none.csv", &log("time [ms],gx [deg/s],gy [deg/s],gz [deg/s]\n", unstamped));
    write("one.csv", "time [ms],gx [deg/s],gy [deg/s],gz [deg/s]\n0,1.5,2.5,3.5\n");
    let header_late = |row| if row == 200 { "time,gx,gy,gz".to_owned() } else { stamped(row) };
    write("late.csv", &log("", header_late));
    write("prose.txt", "no figures\nin here at all\n");
    write(
        "novatel.txt",
        "%RAWIMUSA,1105,425384.180;1105,425384.156166800,111607,43088060,430312,-3033352,-132863,186983,823*5aa97065\n",
    );
    let mut told =
        "bare.txt left.csv units.csv steps.csv twice.csv none.csv one.csv late.csv prose.txt novatel.txt"
            .split(' ')
            .map(|log| told(folder.path(), &["import", log]))
            .collect::<String>();
    // With the answer it goes on; what is there is not written over.
    let columns = ["import", "bare.txt", "--columns", "time [ms],gx [deg/s],gy [deg/s],gz [deg/s],ax,ay,az"];
    check(&replay(folder.path(), &columns), 0);
    told += &common::told(folder.path(), &columns);
    insta::assert_snapshot!(told);
    let mapping = Mapping::load(&folder.path().join("bare.mapping.toml")).unwrap();
    let sensors = &mapping.files[0].accel.as_ref().unwrap().sensors;
    assert_eq!(sensors[2].column, Some(Column::Index(6)));
}

#[test]
fn rows_that_do_not_fit_are_passed_over_and_counted() {
    let header = "time_ms,gx [dps],gy [dps],gz [dps]";
    // Two rows become these; the place of the first that is passed over, and how many are.
    for (first, second, place, skipped) in [
        // A reading that is missing now and then is no rate of its own.
        ("2500,1.0,ERR,0.1", "3000,1.0,,0.1", "holes.csv:252:10", 2),
        ("2500,1.0", header, "holes.csv:252:9", 2),
        (header, "Total,3000", "holes.csv:252:1", 2),
        ("N/A,1.0,2.0,0.1", "3000,1.0,2.0,0.5", "holes.csv:252:1", 1),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let text = log(&format!("{header}\n"), |row| match row {
            250 => first.to_owned(),
            300 => second.to_owned(),
            _ => format!("{},1.0,2.0,{:.3}", row * 10, noise(row, 15)),
        });
        std::fs::write(folder.path().join("holes.csv"), text).unwrap();
        let output = replay(folder.path(), &["import", "holes.csv", "--no-plot", "--json"]);
        check(&output, 3);
        let report: Value = serde_json::from_str(&stdout(&output)).unwrap();
        let reading = &report["info"]["reading"];
        assert_eq!((&reading["rows"], &reading["skipped_rows"]), (&json!(ROWS - skipped), &json!(skipped)));
        assert!(reading["first_skipped"].as_str().unwrap().starts_with(place), "{reading}");
        let mapping = std::fs::read_to_string(folder.path().join("holes.mapping.toml")).unwrap();
        assert!(!mapping.contains("may_be_empty") && mapping.contains("column = \"time_ms\""), "{mapping}");
    }
}

/// Imports a real log into a folder of its own.
fn real(logs: &[&str], options: &[&str]) -> Option<(Mapping, Value)> {
    let paths: Option<Vec<_>> = logs.iter().map(|log| data(log)).collect();
    let paths: Vec<_> = paths?.iter().map(|path| path.canonicalize().unwrap()).collect();
    let folder = tempfile::tempdir().unwrap();
    let paths = paths.iter().map(|path| path.to_str().unwrap());
    let arguments: Vec<_> = ["import"]
        .into_iter()
        .chain(paths)
        .chain(["--out", "m.toml", "--plot", "p.html", "--json"])
        .chain(options.iter().copied())
        .collect();
    let output = replay(folder.path(), &arguments);
    check(&output, 0);
    let mapping = Mapping::load(&folder.path().join("m.toml")).unwrap();
    Some((mapping, serde_json::from_str(&stdout(&output)).unwrap()))
}

/// The ready mapping that a proposal must say the same as.
fn ready(name: &str) -> Mapping {
    Mapping::load(Path::new(&common::mapping(name))).unwrap()
}

#[test]
fn with_data_the_proposals_are_the_ready_mappings() {
    let chamber = ["--gyro-unit", "deg_per_s"];
    if let Some((proposed, _)) = real(&["chamber-mems/chamber.tsv"], &chamber) {
        let (proposed, ready) = (&proposed.files[0], &ready("chamber-mems.toml").files[0]);
        assert_eq!(
            (&proposed.gyro, &proposed.accel, &proposed.layout),
            (&ready.gyro, &ready.accel, &ready.layout)
        );
        assert_eq!(proposed.time.stamps, ready.time.stamps);
        assert_eq!(proposed.temperatures[0].column, ready.temperatures[0].column);
    }
    let columns = "gx [counts],gy [counts],gz [counts],ax [counts],ay [counts],az [counts]";
    if let Some((proposed, report)) =
        real(&["rlg-static/rlg-static.imu.gz"], &["--columns", columns, "--rate-hz", "100"])
    {
        let (proposed, ready) = (&proposed.files[0], &ready("rlg-static.toml").files[0]);
        assert_eq!(
            (&proposed.gyro, &proposed.accel, &proposed.time.tick),
            (&ready.gyro, &ready.accel, &ready.time.tick)
        );
        assert_eq!(proposed.layout, ready.layout);
        assert!(report["notes"][0].as_str().unwrap().contains("184718 rows"), "{}", report["notes"]);
    }
    let tumble = ["tumble-mems/gyro.txt.gz", "tumble-mems/acc.txt.gz"];
    if let Some((proposed, _)) = real(&tumble, &["--gyro-unit", "raw", "--accel-unit", "raw"]) {
        let ready = ready("tumble-mems.toml");
        for (proposed, ready) in proposed.files.iter().zip(&ready.files) {
            assert_eq!(
                (&proposed.name, &proposed.layout, &proposed.time.stamps),
                (&ready.name, &ready.layout, &ready.time.stamps)
            );
        }
        assert_eq!(proposed.files[1].accel, ready.files[1].accel);
    }
}

#[test]
fn a_log_of_ones_own_is_recognised_as_its_own_mapping_says_it() {
    for (preset, words) in [
        ("zeeman-sine", "3 gyros (counts), 3 accelerometers (counts), 8 temperature channels"),
        ("fibre-optic-judging", "3 gyros (means), 3 accelerometers (counts), 8 temperature channels"),
        ("mems-chamber", "3 gyros (means), 3 accelerometers (means), 8 temperature channels"),
        ("skewed-six", "6 gyros (means), 6 accelerometers (means), 14 temperature channels"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let simulated =
            replay(folder.path(), &["simulate", "--preset", preset, "--duration", "12", "--out", "own.csv"]);
        check(&simulated, 0);
        let path = folder.path().join("own.mapping.toml");
        let read = || Mapping::parse(&std::fs::read_to_string(&path).unwrap(), "own.mapping.toml").unwrap();
        let own = read();
        let imported = replay(folder.path(), &["import", "own.csv", "--no-plot", "--overwrite", "--json"]);
        check(&imported, 0);
        let report: Value = serde_json::from_str(&stdout(&imported)).unwrap();
        assert_eq!(report["notes"][0], format!("own.csv: written by isotherm-replay: {words}"), "{preset}");
        assert_eq!(read(), own, "{preset}");
    }
}
