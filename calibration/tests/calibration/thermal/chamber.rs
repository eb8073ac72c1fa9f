//! The real MEMS chamber log: fitted to the first cooling and the heating, judged on the last cooling. Needs the data.

use std::path::PathBuf;

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::thermal::{Fitted, Method, Settings, fit};
use isotherm_calibration::numbers::Size;
use isotherm_calibration::runs::Run;
use isotherm_calibration::runs::table::Table;
use isotherm_correction::units::Span;
use isotherm_log::mapping::Mapping;
use isotherm_log::offline::unit_id;
use isotherm_log::part::{LogFiles, Part};

/// End of the heating (s since the log's first row).
const TURN_S: f64 = 3130.0;

fn log() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
    let folder = std::env::var_os("ISOTHERM_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    let other = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    [folder, other]
        .into_iter()
        .map(|folder| folder.join("chamber-mems/chamber.tsv"))
        .find(|path| path.exists())
}

fn part(path: &std::path::Path, from_s: f64, to_s: Option<f64>) -> Run {
    let mapping = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/mappings/chamber-mems.toml");
    let mapping = Box::new(Mapping::load(mapping.as_ref()).unwrap());
    let unit = unit_id("CHAMBER-MEMS").unwrap();
    let files =
        LogFiles::Text { paths: vec![path.to_path_buf()], mapping, unit: unit.clone(), batch_ticks: 512 };
    let part = Part { start: Span::from_s(from_s), end: to_s.map(Span::from_s), ..Part::default() };
    Run::new("chamber".to_owned(), unit, files, &part)
}

fn fitted(path: &std::path::Path, method: Method) -> Fitted {
    let (train, judge) = (part(path, 0.0, Some(TURN_S)), part(path, TURN_S, None));
    let settings = Settings { method, ..super::usual() };
    fit(None, (&[train], &[judge]), &settings).unwrap()
}

/// Rms out of sample about the level of the training part, as the data's README states it, by axis: gyros (°/s), then
/// accelerometers (m/s²); and the deviation about the own mean.
fn out_of_sample(path: &std::path::Path, written: &Written) -> [[f64; 2]; 6] {
    let means = |run: &Run| Table::of(run, &written.loaded, 10.0).unwrap();
    let (train, judge) = (means(&part(path, 30.0, Some(TURN_S))), means(&part(path, TURN_S, None)));
    let column = |means: &Table, axis: usize| -> Vec<f64> {
        if axis < 3 {
            means.rate(axis).iter().map(|r| r / 3600.0).collect()
        } else {
            means.force(axis - 3).to_vec()
        }
    };
    [0, 1, 2, 3, 4, 5].map(|axis| {
        let level = Size::of(&column(&train, axis)).mean;
        let off: Vec<f64> = column(&judge, axis).iter().map(|value| value - level).collect();
        let size = Size::of(&off);
        [size.rms, size.deviation]
    })
}

/// Rms out of sample of the cubic, as measured on this log with least squares and equal weights: gx, gy, gz (°/s), ax, ay, az (m/s²);
/// and the share of it that a document may leave.
const CUBIC: [f64; 6] = [9.37e-3, 1.43e-3, 2.73e-3, 1.06e-2, 3.44e-2, 6.15e-2];
const SHARE: [f64; 6] = [0.65, 0.45, 1.0, 0.48, 0.37, 0.35];
/// Deviation of the raw last cooling about its mean.
const RAW: [f64; 6] = [1.856e-3, 1.1035e-2, 2.895e-3, 2.494e-2, 3.644e-2, 8.543e-2];

#[test]
fn real_chamber_log_needs_data() {
    let Some(path) = log() else {
        println!("skipped: no data");
        return;
    };
    let made = fitted(&path, Method::Joint);
    println!("{}", made.report.to_text());
    let out = out_of_sample(&path, &made.written);
    for axis in 0..6 {
        let [rms, deviation] = out[axis];
        let (of_cubic, of_raw) = (rms / CUBIC[axis], deviation / RAW[axis]);
        println!(
            "axis {axis}: rms {rms:.3e}, {of_cubic:.3} of the cubic; deviation {deviation:.3e}, {of_raw:.3} of raw"
        );
        assert!(made.report.verdicts[axis].accepted && of_cubic <= SHARE[axis], "axis {axis}: {of_cubic}");
        // gyro x steps without a change of temperature: what follows temperature takes its level along, not its shape.
        assert!(axis == 0 || of_raw < 0.7, "axis {axis}: {of_raw}");
    }
    // The lines of the report: no axis is worse than a mean or a cubic.
    let (_, lines) = made.report.tables.iter().find(|(heading, _)| heading.starts_with("Accuracy")).unwrap();
    assert_eq!(lines.rows.len(), 6);
    for row in &lines.rows {
        let rms: Vec<f64> = row[3..].iter().map(|cell| cell.parse().unwrap()).collect();
        assert!(rms[4] <= rms[1] && rms[4] <= rms[2], "{row:?}");
    }
}

#[test]
fn without_a_judging_run_no_axis_of_the_real_log_gets_worse_needs_data() {
    let Some(path) = log() else {
        println!("skipped: no data");
        return;
    };
    for method in [Method::Sequential, Method::Joint] {
        let settings = Settings { method, ..super::usual() };
        let train = part(&path, 0.0, Some(TURN_S));
        let made = fit(None, (&[train], &[]), &settings).unwrap();
        println!("{method:?}: {}", made.report.headline());
        let out = out_of_sample(&path, &made.written);
        for axis in 1..6 {
            assert!(out[axis][1] <= 1.001 * RAW[axis], "{method:?} axis {axis}: {:e}", out[axis][1]);
        }
        if method != Method::Sequential {
            // What holds on the last cooling holds without knowing it.
            for axis in [0, 1, 3, 4, 5] {
                let of_cubic = out[axis][0] / CUBIC[axis];
                assert!(
                    made.report.verdicts[axis].accepted && of_cubic <= SHARE[axis],
                    "{method:?} {axis}: {of_cubic}"
                );
            }
        }
    }
}
