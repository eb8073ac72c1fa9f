use super::*;
use crate::runs::swapped::{Fits, Looks, Shown};

fn examples() -> Vec<Finding> {
    let plateau = |from: f64, rate: [f64; 3]| Plateau {
        bins: [0, 1],
        window_s: [from, from + 8.0],
        rate: rate.map(|rate| 3600.0 * rate).to_vec(),
    };
    let found = || vec![plateau(11.0, [36.0, 0.01, -0.02]), plateau(31.0, [-36.1, 0.0, 0.0])];
    let window_s = [11.0, 19.0];
    let shown = Shown {
        kind: "accelerometers",
        measure: "m/s²",
        mean: [0.1, 9.8, 0.02],
        stated: [9.8, 0.1, 0.0],
        opposite: None,
        deviation: 0.01,
    };
    let looks = |fits| Box::new(Looks { shown, fits });
    let stated = (36.0, [0.0, 1.0, 0.0]);
    let shown = || vec![("y".to_owned(), 0.02), ("x".to_owned(), 36.0)];
    let stray = Kind::OtherPlateaus { stated: 1, turning: 2, found: found() };
    vec![
        Kind::NoStepStated { log: "y.csv".into() }.in_log(1),
        Kind::Dead { log: "y.csv".into() }.of_gyro("z"),
        Kind::NoTicks { window_s }.in_log(0),
        Kind::StepsOverlap { windows_s: [window_s, [12.0, 20.0]] }.in_log(0),
        Kind::SomeTimes.in_log(0),
        stray.clone().in_log(0),
        Kind::OutOfProportion { window_s, shown: 35.0, stated: 72.0, allowed: 3.6, found: found() }.in_log(0),
        Kind::UnstatedTurn {
            stated: 2,
            turn: plateau(51.0, [5.0, 0.0, 0.0]),
            allowed: [7.2, 1.8],
            found: found(),
        }
        .in_log(0),
        Kind::BesideGaps { kind: Box::new(stray), share: 0.25 }.in_log(2),
        Kind::TurnedOtherwise {
            window_s,
            stated,
            shown: shown(),
            instead: Box::new(Instead::Axis([1.0, 0.0, 0.0], [90.0, 30.0])),
        }
        .in_log(0),
        Kind::TurnedOtherwise {
            window_s,
            stated,
            shown: shown(),
            instead: Box::new(Instead::Factor([10.0, 2.0])),
        }
        .in_log(0),
        Kind::Unsteady { window_s, stated: 36.0, range: [0.0, 36.2] }.in_log(0),
        Kind::Lost { window_s, share: [0.12, 0.05] }.in_log(0),
        Kind::AtLimit { window_s, stated: 400.0 }.in_log(0),
        Kind::NotLevel {
            at_beginning: true,
            force: Some([9.7, 0.1, 0.2]),
            troubles: vec!["2 ticks refused".into()],
        }
        .in_log(0),
        Kind::NotLevel { at_beginning: true, force: None, troubles: Vec::new() }.in_log(0),
        Kind::NotLevel { at_beginning: false, force: None, troubles: Vec::new() }.into(),
        Kind::OneWay { axes: vec![0, 2] }.into(),
        Kind::NoAttitude.into(),
        Kind::ShortSteps { rates: vec![1.0, -1.0, 1.0] }.into(),
        Kind::Gravity { looks: looks(Fits::Order([1, 0, 2])), rest: None, others: vec![1, 2] }.in_log(0),
        Kind::Gravity { looks: looks(Fits::Nothing), rest: Some((window_s, 3)), others: vec![1] }.in_log(0),
        Kind::NothingTurns.of_gyro("x"),
        Kind::Across.of_gyro("x"),
        Kind::FewSteps { steps: 1 }.of_gyro("x"),
        Kind::OtherScale { factor: -2e-4, most: 2.0 }.of_gyro("x"),
        Kind::NotStraight { left: 10.0, share: [0.1, 0.01], chi_square: 1e9 }.of_gyro("x"),
        Kind::Worse { axis: 2 }.of_gyro("x"),
        Kind::Passed { words: "x.csv, y.csv, each: 2 ticks refused".into() }.into(),
    ]
}

/// Every sentence, so that a change of words is seen.
#[test]
fn all_words() {
    insta::assert_snapshot!(examples().iter().map(|finding| finding.to_string() + "\n").collect::<String>());
}

#[test]
fn all_words_of_thermal_fits() {
    let far = |windows, single| ThermalKind::Far {
        count: windows,
        value: 99.0,
        measure: "°/s",
        at_s: 12.345,
        windows,
        single,
    };
    let log = || "judge.csv".to_owned();
    let axes = || vec!["gyro x".to_owned(), "gyro y".to_owned()];
    let all = [
        ThermalKind::BeforeIsBetter { left: [0.2, 9.0], measure: "°/h" },
        ThermalKind::NotJudged { run: log(), axes: axes(), range_deg_c: Some(0.4), needed: 5.0 },
        ThermalKind::NotJudged { run: log(), axes: axes(), range_deg_c: None, needed: 5.0 },
        ThermalKind::SameReadings { log: log(), other: "train.csv".to_owned(), judges: true },
        ThermalKind::SameReadings { log: log(), other: "train.csv".to_owned(), judges: false },
        far(1, true),
        far(80, false),
        ThermalKind::Frozen { channel: "coil".to_owned(), value: 1.5, window_s: [600.0, 5400.0] },
    ];
    insta::assert_snapshot!(all.iter().map(|kind| kind.to_string() + "\n").collect::<String>());
}
