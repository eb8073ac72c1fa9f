//! `impact`: the figures of 002, and the command as its user calls it.

use isotherm_calibration::fits::impact::monte_carlo::{drift, sail_all};
use isotherm_calibration::fits::impact::scenario::{CARES, Care, Drift, Figures, Voyage};
use isotherm_correction::drift::DriftParts;
use isotherm_correction::units::AngularRate;

use crate::command::{calibrate, json, shipped};

pub(crate) const VOYAGE: Voyage = Voyage {
    latitude_deg: 60.0,
    turn_ratio: 4.0,
    calibration_h: 21.0,
    hours: 48.0,
    log_aids_level: true,
    // 0.001 °/h.
    reference_sigma_rad_per_s: 4.848_136_811_095_36e-9,
};

fn rad_per_s(deg_per_h: f64) -> f64 {
    AngularRate::from_deg_per_h(deg_per_h).as_rad_per_s()
}

/// σ (°/h), σ1 (°/h²) and N (°/√h) of a gyro whose drift has a correlation time of 9.5 h and whose trend holds for 140 h.
pub(crate) fn parts(sigma: f64, trend_sigma: f64, walk: f64) -> [DriftParts; 3] {
    let parts = DriftParts {
        sigma_rad_per_s: rad_per_s(sigma),
        correlation_time_s: 9.5 * 3600.0,
        trend_sigma_rad_per_s2: rad_per_s(trend_sigma) / 3600.0,
        trend_correlation_time_s: 140.0 * 3600.0,
        initial_sigma_rad_per_s: rad_per_s(0.05),
        angle_random_walk_rad_per_sqrt_s: rad_per_s(walk) * 60.0,
    };
    [parts; 3]
}

/// A trend (°/h²) of one gyro from the calibration's beginning, without noise.
fn trend(axis: usize, deg_per_h2: f64) -> Drift {
    let truth: Vec<[f64; 3]> = (0..VOYAGE.ticks())
        .map(|tick| {
            let mut rates = [0.0; 3];
            rates[axis] = rad_per_s(deg_per_h2 * (tick as f64 + 0.5) * 10.0 / 3600.0);
            rates
        })
        .collect();
    Drift { measured: truth.clone(), held: truth[VOYAGE.calibration_ticks() - 1], truth }
}

fn sail(care: Care, drift: &Drift) -> Figures {
    VOYAGE.sail(care, drift, &parts(0.0034, 8e-5, 0.0002)).unwrap().figures()
}

#[test]
fn an_azimuth_trend_costs_kilometres_and_twice_as_much_when_doubled() {
    let once = sail(Care::Held, &trend(2, 0.00008));
    let twice = sail(Care::Held, &trend(2, 0.00016));
    println!("{once:?}\n{twice:?}");
    assert!((1000.0..10_000.0).contains(&once.radial_at_end_m), "{once:?}");
    assert!((twice.radial_at_end_m / once.radial_at_end_m - 2.0).abs() < 0.05, "{twice:?}");
    // 0.14′ and 0.28′: the azimuth swings once a day between nothing and 2·ε̇/Ω², at any latitude.
    assert!((once.heading_largest_arcmin / 0.14 - 1.0).abs() < 0.05, "{once:?}");
    assert!((twice.heading_largest_arcmin / 0.28 - 1.0).abs() < 0.05, "{twice:?}");
}

#[test]
fn a_trend_of_a_level_gyro_costs_less_than_twenty_metres() {
    for axis in [0, 1] {
        let drift = trend(axis, 0.00008);
        // 002's filter follows the level gyros through the velocity log; it has no state for their trends.
        let figures = sail(Care::WithoutTrend, &drift);
        println!("{figures:?}");
        assert!(figures.radial_largest_m < 20.0, "{figures:?}");
        assert!(figures.heading_largest_arcmin < 0.04, "{figures:?}");
        // Even without any filter the platform's turning keeps it far below the azimuth gyro's.
        let held = sail(Care::Held, &drift);
        assert!(
            held.radial_largest_m * 5.0 < sail(Care::Held, &trend(2, 0.00008)).radial_largest_m,
            "{held:?}"
        );
    }
}

#[test]
fn the_trend_state_halves_the_error_where_there_is_a_trend() {
    // Gyros with a trend that exceeds the random part, which 002 finds often: trends of random size and sign.
    let parts = parts(0.0005, 0.0004, 0.0002);
    let seeds: Vec<u64> = (1..=40).collect();
    let spread = sail_all(&VOYAGE, &parts, [0.0; 3], &seeds).unwrap();
    let [_, without, with] = [0, 1, 2].map(|care| spread[care].1.median.radial_largest_m);
    println!("without {without:.0} m, with {with:.0} m");
    assert!(with * 2.0 < without, "{with} {without}");
}

#[test]
fn the_trend_state_costs_nothing_where_there_is_none() {
    // Drifts without trend, seen by an estimator that expects trends as small as its document says.
    let expected = parts(0.0034, 8e-5, 0.0002);
    let real = parts(0.0034, 0.0, 0.0002);
    let mut sums = [0.0; 4];
    for seed in 1..=40 {
        let drift = drift(&VOYAGE, &real, [0.0; 3], seed);
        for (care, sum) in CARES.into_iter().zip(&mut sums) {
            let figures = VOYAGE.sail(care, &drift, &expected).unwrap().figures();
            *sum += figures.radial_largest_m * figures.radial_largest_m;
        }
    }
    let [held, without, with, alone] = sums.map(|sum| (sum / 40.0_f64).sqrt());
    println!("rms: held {held:.0} m, without {without:.0} m, with {with:.0} m, the trend alone {alone:.0} m");
    assert!(with < 1.1 * without, "{with} {without}");
    // The model without a Markov part takes the Markov part for a trend.
    assert!(alone > 1.5 * without, "{alone} {without}");
}

#[test]
fn without_a_markov_part_the_estimator_follows_a_trend_as_in_table_3() {
    for slope in [0.00008, 0.00016] {
        let drift = trend(2, slope);
        let [without, with, alone] = [Care::WithoutTrend, Care::WithTrend, Care::TrendAlone]
            .map(|care| sail(care, &drift).radial_largest_m);
        println!("{slope}: without {without:.0} m, with {with:.0} m, the trend alone {alone:.0} m");
        // The middle of table 3 is 12.6×, its least 2×; a Markov part hides the trend.
        assert!(alone * 5.0 < without, "{alone} {without}");
        assert!(with * 2.0 > without, "{with} {without}");
    }
}

#[test]
fn the_command_sails_stated_drifts_and_documents() {
    let folder = tempfile::tempdir().unwrap();
    let html = folder.path().join("impact.html").display().to_string();
    let report = json(&["impact", "--trend", "0.00008", "--json", "--html", &html]);
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 12);
    assert_eq!(rows[8]["case"], "azimuth gyro z");
    let radial = rows[8]["figures"]["radial_at_end_m"].as_f64().unwrap();
    assert!((radial - sail(Care::Held, &trend(2, 0.00008)).radial_at_end_m).abs() < 1e-6 * radial);
    assert_eq!(rows[8]["points"].as_array().unwrap().len(), 288);
    let page = std::fs::read_to_string(&html).unwrap();
    assert!(page.contains(report["verdict"].as_str().unwrap()));
    assert_eq!(report["table_3"].as_array().unwrap().len(), 18);
    assert_eq!(report["models"].as_array().unwrap().len(), 0, "nothing but a log bears a model out");

    // The end is the end, not the last whole point.
    let short = json(&["impact", "--constant", "0.1", "--gyro", "z", "--hours", "0.65", "--json"]);
    let hours = |point: &serde_json::Value| point[0].as_f64().unwrap();
    let points: Vec<f64> = short["rows"][0]["points"].as_array().unwrap().iter().map(hours).collect();
    assert!(points.len() == 4 && (points[3] - 0.65).abs() < 1e-9, "{points:?}");

    let document = shipped("ZLG-0001.toml").display().to_string();
    let arguments = ["impact", "--calibration", &document, "--seeds", "4", "--hours", "12", "--json"];
    let many = json(&arguments);
    assert_eq!(many["rows"].as_array().unwrap().len(), 4);
    assert_eq!(calibrate(&arguments).stdout, calibrate(&arguments).stdout, "the same bytes");

    // A constant drift: known exactly it would leave nothing, and that is said to be a bound, not what comes of it.
    let text = std::fs::read_to_string(&document).unwrap();
    let still = |line: &str| match line.split_once(" = ") {
        Some((key @ ("sigma_deg_per_h" | "trend_sigma_deg_per_h2"), _)) => format!("{key} = 0.0\n"),
        _ => format!("{line}\n"),
    };
    let constant = folder.path().join("constant.toml").display().to_string();
    std::fs::write(&constant, text.lines().map(still).collect::<String>()).unwrap();
    let bound = json(&["impact", "--calibration", &constant, "--seeds", "4", "--hours", "12", "--json"]);
    let said = format!("{} {}", bound["verdict"], bound["notes"]);
    assert_eq!(bound["rows"][0]["median"]["radial_largest_m"], 0.0, "{said}");
    for words in [
        "of position with the estimator",
        "known exactly at departure",
        "the row is a bound",
        "a constant part only",
    ] {
        assert!(said.contains(words), "{said}");
    }
    for (arguments, code, words) in [
        (vec!["impact"], 2, "give a drift"),
        (vec!["impact", "--trend", "nan"], 2, "must be a number from -100 to 100"),
        (vec!["impact", "--trend", "1", "--latitude", "90"], 2, "must be a number from -85 to 85"),
    ] {
        let output = calibrate(&arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(words), "{arguments:?}");
    }
}

#[test]
fn a_constant_after_departure_is_followed_where_it_is_seen() {
    let report = json(&["impact", "--constant", "0.01", "--json"]);
    let largest = |row: usize| report["rows"][row]["figures"]["radial_largest_m"].as_f64().unwrap();
    // Level, held and estimated: what the velocity log sees is soon estimated. Azimuth: nobody sees it.
    assert!(largest(1) * 2.0 < largest(0), "{} {}", largest(1), largest(0));
    assert!((largest(9) / largest(8) - 1.0).abs() < 0.01, "{} {}", largest(9), largest(8));
}
