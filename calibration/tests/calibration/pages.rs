//! One page of every kind, to be looked at in a browser: nothing else tells whether it can be read.

use std::path::{Path, PathBuf};

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_protocol::document::Document;
use isotherm_simulator::chamber::Profile;

use crate::command::{calibrate, shipped};
use crate::drift_generator::{Markov, Normal, recording};
use crate::positions_command::driven;
use crate::simulated_logs::{fibre_optic, record, record_events};
use crate::{modes_rates, stand};

#[test]
#[ignore = "writes pages to look at into the folder that ISOTHERM_PAGES names"]
fn pages_to_be_looked_at() {
    let folder = PathBuf::from(std::env::var_os("ISOTHERM_PAGES").unwrap());
    let at = |name: &str| folder.join(name).display().to_string();
    let page = |name: &str, arguments: &[&str]| {
        let html = at(&format!("{name}.html"));
        let _ = std::fs::remove_file(&html);
        let done = calibrate(&[arguments, &["--html", &html]].concat());
        println!("{name}: {:?} {}", done.status.code(), String::from_utf8_lossy(&done.stderr));
        std::fs::write(at(&format!("{name}.txt")), done.stdout).unwrap();
        assert!(Path::new(&html).exists());
    };
    std::fs::create_dir_all(at("documents")).unwrap();
    let order: Vec<usize> = (0..12).collect();
    for (unit, seed) in [("MEMS-0001", 21), ("MEMS-0002", 22)] {
        for (name, deg_c) in [("cold", -20.0), ("room", 20.0), ("hot", 55.0)] {
            let (events, _) = stand::log(&stand::instrument(), deg_c, &Plan::twelve(), &order, &driven(seed));
            record_events(Path::new(&at(&format!("{name}-{unit}.mcap"))), unit, &events);
        }
        let document = Document { unit: unit.into(), ..stand::document() };
        Written::of(&document)
            .unwrap()
            .save(Path::new(&at(&format!("documents/{unit}.toml"))), true)
            .unwrap();
    }
    let logs =
        |names: &[&str], unit: &str| names.iter().map(|name| at(&format!("{name}-{unit}.mcap"))).collect();
    let (own, others): (Vec<String>, Vec<String>) =
        (logs(&["cold", "hot"], "MEMS-0001"), logs(&["cold", "room", "hot"], "MEMS-0002"));
    let (base, gravity) = (at("documents/MEMS-0001.toml"), ["--gravity", "9.8154", "--overwrite"]);
    let (out, judge) = (at("positions.toml"), at("room-MEMS-0001.mcap"));
    let single = ["positions", &own[0], &own[1], "--calibration", &base, "--out", &out, "--judge", &judge];
    page("positions", &[&single[..], &gravity].concat());
    let mut batch = vec!["positions", &own[0], &own[1], &judge];
    batch.extend(others.iter().map(String::as_str));
    let (documents, several) = (at("documents"), at("several.toml"));
    batch.extend(["--calibration", &documents, "--out", &several]);
    page("batch", &[&batch[..], &gravity].concat());
    shock(&folder, &page);

    let mut normal = Normal::new(5);
    let columns = [(); 3].map(|()| {
        let mut markov = Markov::new(&mut normal, 0.004, 10.0 / (6.0 * 3600.0));
        (0..26_000)
            .map(|tick| markov.next(&mut normal) + 0.1 * normal.next() + 1e-6 * f64::from(tick))
            .collect::<Vec<f64>>()
    });
    recording(Path::new(&at("static.mcap")), "FOG-0001", &columns, 10_000_000_000, |_| true);
    page("drift", &["drift", &at("static.mcap")]);
    page("impact", &["impact", "--trend", "0.00008"]);

    let base = modes_rates::base(&folder).display().to_string();
    let (run, other) = (at("modes.mcap"), at("modes-judge.mcap"));
    modes_rates::record(
        Path::new(&run),
        &[modes_rates::zeeman(1, Profile::constant(50.0).ramp(-30.0, 4.0).ramp(50.0, 4.0))],
    );
    modes_rates::record(
        Path::new(&other),
        &[modes_rates::zeeman(2, Profile::constant(20.0).hold(4.0).ramp(45.0, 3.0).hold(4.0))],
    );
    let place = ["--latitude", "55.75", "--heading", "30"];
    page("modes", &[&["modes", &run, "--judge", &other, "--calibration", &base][..], &place].concat());
    let turned = at("table.mcap");
    modes_rates::record(
        Path::new(&turned),
        &modes_rates::table(1, [0.0, 0.0, 1.0], &[36.0, -36.0, 108.0, -108.0]),
    );
    let (unit, scale) = (at("documents/MEMS-0001.toml"), at("rates.toml"));
    let steps =
        ["--axis", "z", "--rates", "36,-36,108,-108", "--remove-mean", "--overwrite", "--out", &scale];
    page("rates", &[&["rates", &turned, "--calibration", &unit][..], &steps].concat());
    let whole = at("unit.toml");
    let _ = std::fs::remove_file(&whole);
    let parts = ["merge", &unit, &at("before.toml"), &scale, "--out", &whole];
    for (name, arguments) in [
        ("merge", &parts[..]),
        ("conflict", &["merge", &unit, &at("before.toml"), &at("after.toml"), "--out", "x.toml"]),
    ] {
        let done = calibrate(arguments);
        std::fs::write(at(&format!("{name}.txt")), [done.stdout, done.stderr].concat()).unwrap();
    }
    page("show", &["show", &whole]);
    record(Path::new(&at("judge.mcap")), &fibre_optic(5, "FOG-0001", 3600.0));
    page("validate", &["validate", &shipped("FOG-0001.toml").display().to_string(), &at("judge.mcap")]);
}

/// Positions before and after a shock that has turned the third accelerometer by 50″.
fn shock(folder: &Path, page: &dyn Fn(&str, &[&str])) {
    let at = |name: &str| folder.join(name).display().to_string();
    let instrument = stand::instrument();
    let mut rows = stand::true_rows(&instrument, 22.0);
    let order: Vec<usize> = (0..12).collect();
    for (name, turned, seed) in [("before", 0.0, 41), ("after", 50.0 * stand::ARCSEC, 42)] {
        rows[2][0] += turned;
        let (events, _) = stand::log(&stand::with_axes(&rows), 20.0, &Plan::twelve(), &order, &driven(seed));
        record_events(Path::new(&at(&format!("{name}.mcap"))), "MEMS-0001", &events);
        let (log, document, out) =
            (at(&format!("{name}.mcap")), at("documents/MEMS-0001.toml"), at(&format!("{name}.toml")));
        page(
            name,
            &[
                "positions",
                &log,
                "--calibration",
                &document,
                "--gravity",
                "9.8154",
                "--overwrite",
                "--out",
                &out,
            ],
        );
    }
    page("diff", &["diff", &at("before.toml"), &at("after.toml")]);
}
