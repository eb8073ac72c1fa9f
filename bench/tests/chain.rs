//! The chain as a whole, briefly: that what it tells comes from ticks that went through.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// The program under test.
const BENCH: &str = env!("CARGO_BIN_EXE_isotherm-bench");

#[expect(clippy::expect_used, reason = "cargo has built it")]
fn chain(arguments: &[&str]) -> (bool, Value, String) {
    let output =
        Command::new(BENCH).args(["chain", "--json"]).args(arguments).output().expect("the bench starts");
    let report = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output.status.success(), report, String::from_utf8_lossy(&output.stderr).into_owned())
}

/// What can stand in the middle here: `cargo test --workspace` builds the service beside the bench, `cargo test -p` of this package
/// alone does not.
fn subjects() -> Vec<&'static str> {
    let built = Path::new(BENCH).with_file_name("isotherm").is_file();
    if built { vec!["relay", "keyed", "service"] } else { vec!["relay", "keyed"] }
}

#[test]
fn every_tick_that_is_sent_is_counted() {
    let subjects = subjects();
    let brief = ["--units", "3", "--rate", "200", "--batch", "2", "--rounds", "2", "--seconds", "0.3"];
    let named = ["--subject", &subjects.join(",")];
    let (well, report, words) = chain(&[&["--measure", "latency"], &brief[..], &named[..]].concat());
    assert!(well, "{words}");
    let rows = report["rows"].as_array().expect("rows");
    let found: Vec<&str> = rows.iter().filter_map(|row| row["subject"].as_str()).collect();
    assert_eq!(found, subjects);
    for row in rows {
        // 0.8 s at 200 Hz of three units, twice.
        assert_eq!((&row["median"]["sent"], &row["median"]["lost"]), (&960.into(), &0.into()), "{row}");
        let latency: Vec<f64> = row["median"]["latency_us"]
            .as_array()
            .expect("quantiles")
            .iter()
            .filter_map(Value::as_f64)
            .collect();
        assert!(latency.is_sorted() && latency[0] > 5.0 && latency[3] < 60e6, "{latency:?}");
        assert!(row["median"]["cpu_us_per_tick"].as_f64().is_some_and(|time| time > 0.1), "{row}");
    }
    let own_ratio = rows[0]["latency_ratio"][0].as_f64().expect("a ratio");
    assert!((own_ratio - 1.0).abs() < 1e-12, "{own_ratio}");
}

#[test]
fn figures_that_no_round_can_have_are_refused() {
    for wrong in ["--seconds=nan", "--seconds=-100", "--rounds=0"] {
        let (well, _, words) = chain(&["--measure", "latency", "--subject", "relay", wrong]);
        assert!(!well && words.contains("error: invalid value"), "{words}");
    }
}

#[test]
fn a_profile_reaches_the_one_in_the_middle() {
    let brief =
        ["--measure", "latency", "--units", "1", "--rate", "200", "--rounds", "1", "--seconds", "0.1"];
    let (well, _, words) = chain(&[&brief[..], &["--subject", "relay", "--profile", "(no RON"]].concat());
    assert!(!well && words.contains("relay: has ended"), "{words}");
    let (well, report, words) = chain(&[&brief[..], &["--subject", "relay", "--profile", "rx-1"]].concat());
    assert!(well && report["rows"][0]["profile"] == "rx-1", "{words}");
}
