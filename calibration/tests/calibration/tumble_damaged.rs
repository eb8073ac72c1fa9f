//! `tumble` on logs that are damaged and can be fitted all the same: what is told, and what is refused.

use isotherm_calibration::fits::positions::bare::bare;
use isotherm_calibration::fits::positions::track::Track;
use isotherm_calibration::fits::tumble::document::complete;
use isotherm_calibration::fits::tumble::fit::{Tumble, analyse};
use isotherm_calibration::fits::tumble::report::{Left, report};
use isotherm_calibration::report::Verdict;
use isotherm_protocol::document::{AccelOutput, Document};

use crate::stand;
use crate::tumble::{how, settings, tumbled, tumbled_log};

/// A log that was changed, and the document without anything known.
fn changed(seed: u64, change: &dyn Fn(&mut Track)) -> (Document, Tumble) {
    let (_, mut track, _) = tumbled(24, &how(seed));
    change(&mut track);
    let series = stand::run("t", tumbled_log(12, seed)).series().unwrap();
    (bare(&series, AccelOutput::MetresPerSecondSquared).unwrap(), analyse(&track, &settings()).unwrap())
}

/// The only thing that is said.
fn said(seed: u64, change: &dyn Fn(&mut Track)) -> String {
    let (plain, tumble) = changed(seed, change);
    let said = [tumble.warnings.clone(), complete(&plain, &tumble).unwrap().1].concat();
    assert_eq!(said.len(), 1, "{said:?}");
    said.concat()
}

fn times(columns: &mut [Vec<f64>], factor: f64) {
    columns.iter_mut().flatten().for_each(|reading| *reading *= factor);
}

#[test]
fn gyros_in_another_order_and_unit_are_found_and_named() {
    let (plain, good) = changed(21, &|_| {});
    assert_eq!((good.warnings.len(), complete(&plain, &good).unwrap().1.len()), (0, 0));
    let good = good.gyro.unwrap();
    // Order, unit of measure and sign at once.
    let (plain, tumble) = changed(21, &|track| {
        track.gyros.swap(0, 2);
        times(&mut track.gyros, 57.3);
        times(&mut track.gyros[1..2], -1.0);
    });
    let gyro = tumble.gyro.as_ref().unwrap();
    for (one, other) in [(0, 2), (1, 1), (2, 0)] {
        let ratio = gyro.weight[one].abs() * 57.3 / good.weight[other];
        assert!((ratio - 1.0).abs() < 1e-3, "{one}: {ratio}");
        assert!(gyro.sigma[one] < 1e-3 / 57.3 && gyro.sigma[3 + 2 * one] < 1e-3, "{:?}", gyro.sigma);
    }
    assert_eq!([0, 1, 2].map(|axis| gyro.across(axis)), [[0, 1], [0, 2], [1, 2]]);
    let mut told = complete(&plain, &tumble).unwrap().1;
    told.push(said(22, &|track| track.gyros.swap(0, 1)));
    told.push(said(22, &|track| track.gyros[2].iter_mut().for_each(|rate| *rate += 5.2)));
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn accelerometers_in_another_order_or_unit_are_named() {
    let (plain, swapped) = changed(23, &|track| track.outputs.swap(0, 1));
    let mut told = complete(&plain, &swapped).unwrap_err();
    let (plain, flipped) = changed(23, &|track| times(&mut track.outputs[2..], -1.0));
    told.extend(complete(&plain, &flipped).unwrap_err());
    told.push(said(23, &|track| times(&mut track.outputs, 1.0 / 9.81)));
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn what_is_left_far_beyond_the_noise_is_told_with_what_it_follows() {
    let drift = said(24, &|track| {
        let ends = track.end_ns.clone();
        let later = |end: i64| 1e-3 * end as f64 * 1e-9;
        for column in &mut track.outputs {
            column.iter_mut().zip(&ends).for_each(|(reading, end)| *reading += later(*end));
        }
    });
    let touched = said(24, &|track| {
        let quiet = track.len() / 7;
        times_of(track, 3 * quiet..4 * quiet, 1.008);
    });
    insta::assert_snapshot!(format!("{drift}\n{touched}"));
}

fn times_of(track: &mut Track, ticks: std::ops::Range<usize>, factor: f64) {
    for column in &mut track.outputs {
        column[ticks.clone()].iter_mut().for_each(|reading| *reading *= factor);
    }
}

#[test]
fn poses_that_the_fit_has_not_seen_decide() {
    let (document, tumble) = changed(25, &|_| {});
    let count = tumble.poses.len();
    // Of accelerometers size counts, not the sign.
    let wave = |size: f64| (0..count).map(|k| if k % 2 == 0 { size } else { -size }).collect::<Vec<f64>>();
    let with_angle = |before: f64, [after, outside]: [f64; 2], angle_deg: f64| -> [Verdict; 2] {
        let left = |size: f64, angle_deg: f64| Left {
            length: wave(size),
            direction: vec![[0.0, 0.0, 1.0]; count],
            angle_deg: vec![angle_deg; count - 1],
            turn_s: vec![1.0; count - 1],
        };
        let tumble = Tumble { held_out: wave(outside), ..tumble.clone() };
        let left = [&left(before, 0.5), &left(after, angle_deg)];
        report(&document, &tumble, &settings(), "t", left).verdicts.try_into().unwrap()
    };
    let of = |before, after, outside| with_angle(before, [after, outside], 0.5);
    let words = |[accel, gyro]: &[Verdict; 2]| format!("{}\n{}", accel.words(), gyro.words());
    let good = of(0.9, 1e-3, 1.4e-3);
    assert!(good.iter().all(|verdict| verdict.accepted) && good[0].reason.is_empty(), "{}", words(&good));
    let same = of(1e-3, 1e-3, 1.4e-3);
    assert!(same[0].accepted, "{}", words(&same));
    let as_good = of(1e-3, 8e-4, 1.4e-3);
    assert!(as_good[0].accepted, "{}", words(&as_good));
    let worse = of(1e-3, 3e-4, 5e-3);
    assert!(worse.iter().all(|verdict| !verdict.accepted), "{}", words(&worse));
    let far = of(0.9, 0.1, 0.3);
    assert!(!far[0].accepted, "{}", words(&far));
    // What the fit leaves is not what its document leaves.
    let other = of(0.9, 9.8e-3, 1.4e-3);
    assert!(!other[0].accepted, "{}", words(&other));
    let turned_away = with_angle(0.9, [1e-3, 1.4e-3], 0.6);
    assert!(turned_away[0].accepted && !turned_away[1].accepted, "{}", words(&turned_away));
    let all = [good, same, as_good, worse, far, other, turned_away];
    insta::assert_snapshot!(all.map(|verdicts| words(&verdicts)).join("\n\n"));
    assert!(!of(0.9, 0.1, f64::NAN)[0].accepted, "no held-out fit at all");
}
