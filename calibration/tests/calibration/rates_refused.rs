//! `rates` on steps that are not those of the log, and on judging steps that say nothing but noise.

use std::path::Path;

use isotherm_protocol::document::Document;
use serde_json::Value;

use crate::command::{fails, shipped, succeeds};
use crate::modes_rates::{record, table};

const RATES: [f64; 4] = [36.0, -36.0, 108.0, -108.0];
const ATTITUDE: [&str; 8] = ["--latitude", "55.75", "--heading", "30", "--pitch", "0", "--roll", "0"];

#[test]
fn steps_that_are_not_those_of_the_log_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (log, out, steps) = (place("x.mcap"), place("out.toml"), place("steps.csv"));
    record(Path::new(&log), &table(0, [1.0, 0.0, 0.0], &RATES));
    let document = shipped("MEMS-0001.toml").display().to_string();
    let refused = |stated: &[&str]| {
        let call = ["rates", &log, "--calibration", &document, "--out", &out];
        let errors = fails(&[&call[..], &ATTITUDE, stated].concat(), 1);
        assert!(!Path::new(&out).exists(), "{errors}");
        errors
    };
    let all = "36,-36,108,-108";
    // Another axis than the table's: the gyro that hardly reads, and the one that does.
    let mut told = refused(&["--axis", "y", "--rates", all]);
    told += &refused(&["--axis", "x", "--rates", "-36,36,-108,108"]);
    // Plateaus that turn are no rests.
    told += &refused(&["--axis", "x", "--rates", "36,-36"]);
    told += &refused(&["--axis", "x", "--rates", "3.6,-3.6,10.8,-10.8"]);
    // Times that take a turn for a rest.
    std::fs::write(
        &steps,
        "axis,rate_deg_per_s,begin_s,end_s\nx,0,1,9\nx,36,11,19\nx,0,21,29\nx,-36,31,39\nx,108,51,59\nx,0,71,79\n",
    )
    .unwrap();
    told += &refused(&["--steps", &steps]);
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
    // What fits is written.
    let call = ["rates", &log, "--calibration", &document, "--out", &out, "--axis", "x", "--rates", all];
    succeeds(&[&call[..], &ATTITUDE].concat());
    let text = std::fs::read_to_string(&out).unwrap();
    let weight = Document::parse(&text, None).unwrap().document.gyro.sensor[0].increment_weight_rad_per_rad;
    assert!((weight.unwrap() - 1.0015).abs() < 1e-4, "{weight:?}");
}

#[test]
fn a_judging_run_that_shows_noise_alone_refuses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let document = shipped("MEMS-0001.toml").display().to_string();
    let mut grown = 0;
    for seed in 0..4 {
        let logs = ["x", "y", "z", "judge"].map(|name| place(&format!("{name}{seed}.mcap")));
        for (index, log) in logs.iter().enumerate() {
            let mut axis = [0.0, 0.6, 0.8];
            if index < 3 {
                axis = [0.0; 3];
                axis[index] = 1.0;
            }
            let rates: &[f64] = if index < 3 { &RATES } else { &[72.0, -72.0] };
            record(Path::new(log), &table(10 * seed + index as u64, axis, rates));
        }
        let [x, y, z, judge] = &logs;
        let call = ["rates", x, y, z, "--judge", judge, "--calibration", &document, "--json"];
        let stated = ["--axis", "x", "--axis", "y", "--axis", "z", "--axis", "0,0.6,0.8"];
        let rates = ["--rates", "36,-36,108,-108", "--judge-rates", "72,-72"];
        let said = succeeds(&[&call[..], &stated, &rates, &ATTITUDE].concat());
        let report: Value = serde_json::from_str(&said).unwrap();
        assert!(!report["verdict"].as_str().unwrap().contains("?."), "{}", report["verdict"]);
        for verdict in report["verdicts"].as_array().unwrap() {
            let rms = |when: &str| verdict["out_of_sample"][when]["rms"].as_f64().unwrap();
            grown += usize::from(rms("after") > rms("before"));
        }
    }
    println!("{grown} of 12 grow");
    assert!(
        grown > 0,
        "the document was right before: some axes grow by noise, and that is not held against them"
    );
}
