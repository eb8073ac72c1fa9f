use alloc::vec;
use alloc::vec::Vec;

use proptest::prelude::*;

use super::linear::{condition_number, is_conditioned, orthonormal_columns, parity_rows};
use super::*;

const MASK_6: SensorMask = SensorMask::all(6);

fn parts(rows: Vec<[f64; 3]>) -> OrientationParts {
    OrientationParts {
        reference_deg_c: 20.0,
        rows,
        slopes_per_deg_c: vec![],
        plays: Vec::new(),
        weights: vec![],
        range_deg_c: [-40.0, 80.0],
        parity_limit: None,
        parity_confirm_ticks: 0,
    }
}

fn identity() -> Vec<[f64; 3]> {
    vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
}

/// The first `n` axes of a cone of eight about z with half-angle 54.7°: any three resolve all axes.
fn cone(n: u8) -> Vec<[f64; 3]> {
    let (across, along) = (libm::sqrt(2.0 / 3.0), libm::sqrt(1.0 / 3.0));
    let axis = |i| core::f64::consts::TAU * f64::from(i) / f64::from(n);
    (0..n).map(|i| [across * libm::cos(axis(i)), across * libm::sin(axis(i)), along]).collect()
}

fn guarded(n: u8, confirm: u32) -> Orientation {
    let parts =
        OrientationParts { parity_limit: Some(0.01), parity_confirm_ticks: confirm, ..parts(cone(n)) };
    Orientation::new(&parts).unwrap()
}

fn paths(defects: &[Defect]) -> Vec<&str> {
    defects.iter().map(|defect| defect.path.as_str()).collect()
}

fn kinds(defects: &[Defect]) -> Vec<DefectKind> {
    defects.iter().map(|defect| defect.kind.clone()).collect()
}

#[test]
fn the_identity_is_inverted_to_the_bit() {
    let orientation = Orientation::new(&parts(identity())).unwrap();
    let inverse = orientation.inverse(20.0, SensorMask::all(3)).unwrap();
    let v = [0.1, -7.3e-9, 1e11];
    assert_eq!(inverse.apply(&v), v);
    assert_eq!(orientation.forward(20.0, v).as_slice(), v);
}

#[test]
fn a_small_misalignment_is_undone_over_temperature() {
    let mut stated = parts(vec![[1.0, 1e-3, -2e-3], [5e-4, 1.0, 1e-3], [0.0, 3e-3, 1.0]]);
    stated.slopes_per_deg_c = vec![[0.0, 1e-5, 0.0], [2e-5, 0.0, 0.0], [0.0, 0.0, 0.0]];
    let orientation = Orientation::new(&stated).unwrap();
    let v = [0.3, -0.2, 9.8];
    for t in [-40.0, 20.0, 80.0] {
        let back = orientation.inverse(t, SensorMask::all(3)).unwrap();
        let back = back.apply(&orientation.forward(t, v));
        assert!(back.iter().zip(v).all(|(a, b)| (a - b).abs() < 1e-14));
    }
    // Outside the range the end stands.
    assert_eq!(orientation.forward(500.0, v), orientation.forward(80.0, v));
    assert_eq!(orientation.forward(f64::NAN, v), orientation.forward(20.0, v));
}

#[test]
fn a_sensor_outside_the_mask_may_read_anything() {
    let orientation = Orientation::new(&parts(cone(6))).unwrap();
    let v = [0.1, 0.2, 0.3];
    let mut readings = orientation.forward(20.0, v);
    readings[4] = f64::NAN;
    let inverse = orientation.inverse(20.0, MASK_6.without(4)).unwrap();
    let back = inverse.apply(&readings);
    assert!(back.iter().zip(v).all(|(a, b)| (a - b).abs() < 1e-14));
}

#[test]
fn fewer_than_three_or_coplanar_axes_have_no_inverse() {
    let orientation = Orientation::new(&parts(cone(6))).unwrap();
    let two = SensorMask::NONE.with(0).with(1);
    assert_eq!(orientation.inverse(20.0, two), None);
    assert!(orientation.inverse(20.0, two.with(2)).is_some());
    let mut rows = identity();
    rows.push([libm::sqrt(0.5), libm::sqrt(0.5), 0.0]);
    let orientation = Orientation::new(&parts(rows)).unwrap();
    assert_eq!(orientation.inverse(20.0, SensorMask::all(4).without(2)), None);
}

#[test]
fn heavier_sensors_count_for_more() {
    let mut rows = identity();
    rows.push([1.0, 0.0, 0.0]);
    let stated = OrientationParts { weights: vec![1.0, 1.0, 1.0, 3.0], ..parts(rows) };
    let orientation = Orientation::new(&stated).unwrap();
    let inverse = orientation.inverse(20.0, SensorMask::all(4)).unwrap();
    let [x, ..] = inverse.apply(&[0.0, 0.0, 0.0, 1.0]);
    assert!((x - 0.75).abs() < 1e-15);
}

#[test]
fn a_blend_is_linear_and_never_uses_a_sensor_that_was_taken_out() {
    let orientation = Orientation::new(&parts(cone(6))).unwrap();
    let all = orientation.inverse(20.0, MASK_6).unwrap();
    let fewer = orientation.inverse(20.0, MASK_6.without(0)).unwrap();
    assert_eq!(all.lerp(&fewer, 0.0), fewer);
    let mut stated = parts(identity());
    stated.slopes_per_deg_c = vec![[0.0, 1e-4, 0.0], [0.0; 3], [0.0; 3]];
    let orientation = Orientation::new(&stated).unwrap();
    let at = |t| orientation.inverse(t, SensorMask::all(3)).unwrap();
    let half = at(20.0).lerp(&at(40.0), 0.5);
    assert!((half.apply(&[0.0, 1.0, 0.0])[0] + 1e-3).abs() < 1e-15);
    assert_eq!(at(20.0).lerp(&at(40.0), -3.0), at(20.0));
    assert_eq!(at(20.0).lerp(&at(40.0), f64::NAN), at(40.0));
}

#[test]
fn every_error_is_reported_at_once() {
    let stated =
        OrientationParts { rows: vec![[1.1, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.9]], ..parts(vec![]) };
    let errors = Orientation::new(&stated).unwrap_err();
    assert!(errors.iter().all(|defect| matches!(defect.kind, DefectKind::RowNorm { .. })));
    assert_eq!(paths(&errors), ["rows[0]", "rows[2]"]);

    let stated = OrientationParts {
        slopes_per_deg_c: vec![[0.0, f64::NAN, 0.0]],
        weights: vec![1.0, 0.0, 3e6],
        range_deg_c: [80.0, -40.0],
        parity_limit: Some(-1.0),
        ..parts(identity())
    };
    let errors = Orientation::new(&stated).unwrap_err();
    assert_eq!(errors[0].kind, DefectKind::ListCount { got: 1, sensors: 3 });
    assert_eq!(
        paths(&errors),
        [
            "thermal.slopes",
            "thermal.slopes[0]",
            "thermal.range",
            "parity.limit",
            "parity.confirm_ticks",
            "weights[1]",
        ]
    );

    let stated = OrientationParts { weights: vec![1.0, 1.0, 3e6], ..parts(identity()) };
    let errors = Orientation::new(&stated).unwrap_err();
    assert!(matches!(kinds(&errors)[..], [DefectKind::WeightRatio { .. }]));
    let errors = Orientation::new(&parts(vec![])).unwrap_err();
    assert!(matches!(kinds(&errors)[..], [DefectKind::Count { count: 0, .. }]));
}

#[test]
fn a_weight_or_parity_limit_may_be_as_small_or_large_as_a_number_can_be() {
    for size in [1e-320, 1e300] {
        let stated =
            OrientationParts { weights: vec![size; 3], parity_limit: Some(size), ..parts(identity()) };
        let stated = OrientationParts { parity_confirm_ticks: 1, ..stated };
        assert!(Orientation::new(&stated).is_ok(), "{size}");
    }
}

#[test]
fn axes_that_come_too_close_to_a_plane_are_refused() {
    let tilt = 0.005;
    let flat = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [libm::cos(tilt), 0.0, libm::sin(tilt)]];
    let errors = Orientation::new(&parts(flat)).unwrap_err();
    assert!(matches!(
        kinds(&errors)[..],
        [DefectKind::Condition { got, .. }] if (got - 2.0 / tilt).abs() < 2.0
    ));

    let mut stated = parts(identity());
    // Good at 20 °C, coplanar at 80 °C.
    stated.slopes_per_deg_c = vec![[0.0; 3], [0.0; 3], [0.0, 0.0, -1.0 / 60.0]];
    let errors = Orientation::new(&stated).unwrap_err();
    assert!(matches!(kinds(&errors)[..], [DefectKind::Condition { temperature_deg_c: 80.0, .. }]));
}

#[test]
fn a_consistent_reading_leaves_no_parity() {
    for n in 4..=8 {
        let orientation = guarded(n, 1);
        let readings = orientation.forward(33.0, [1.0, -2.0, 3.0]);
        let verdict = ParityCheck::default().check(&orientation, 33.0, SensorMask::all(n.into()), &readings);
        assert_eq!(verdict.residuals.len(), usize::from(n) - 3);
        assert!(verdict.residuals.iter().all(|p| p.abs() < 1e-14));
        assert!(!verdict.exceeded);
    }
}

#[test]
fn three_sensors_have_no_parity_and_are_never_excluded() {
    let orientation = guarded(6, 1);
    let mask = SensorMask::all(3);
    let verdict = ParityCheck::default().check(&orientation, 20.0, mask, &[9.0; 6]);
    assert_eq!(verdict, ParityVerdict::default());
}

#[test]
fn four_sensors_detect_but_do_not_isolate() {
    let orientation = guarded(4, 1);
    let mut readings = orientation.forward(20.0, [0.1, 0.2, 0.3]);
    readings[2] += 1.0;
    let verdict = ParityCheck::default().check(&orientation, 20.0, SensorMask::all(4), &readings);
    assert!(verdict.exceeded);
    assert_eq!(verdict.exclude, None);
}

#[test]
fn five_or_more_isolate_the_sensor_at_fault() {
    for n in 5..=8_u8 {
        for failed in 0..usize::from(n) {
            let orientation = guarded(n, 3);
            let mut check = ParityCheck::default();
            let mask = SensorMask::all(n.into());
            let mut readings = orientation.forward(20.0, [0.1, 0.2, 0.3]);
            readings[failed] -= 0.5;
            for expected in [None, None, Some(failed), Some(failed)] {
                let verdict = check.check(&orientation, 20.0, mask, &readings);
                assert!(verdict.exceeded);
                assert_eq!(verdict.exclude, expected);
            }
            let verdict = check.check(&orientation, 20.0, mask.without(failed), &readings);
            assert!(!verdict.exceeded);
            assert_eq!(verdict.residuals.len(), usize::from(n) - 4);
        }
    }
}

#[test]
fn the_confirming_ticks_must_be_in_a_row_and_agree() {
    let orientation = guarded(6, 3);
    let mut check = ParityCheck::default();
    let good = orientation.forward(20.0, [0.1, 0.2, 0.3]);
    let bad = |failed: usize| {
        let mut readings = good.clone();
        readings[failed] += 0.5;
        readings
    };
    let sequence = [bad(1), bad(1), good.clone(), bad(1), bad(1), bad(2), bad(1), bad(1)];
    for readings in &sequence {
        assert_eq!(check.check(&orientation, 20.0, MASK_6, readings).exclude, None);
    }
    assert_eq!(check.check(&orientation, 20.0, MASK_6, &bad(1)).exclude, Some(1));
}

#[test]
fn two_faults_at_once_are_detected_but_not_blamed_on_one() {
    let orientation = guarded(6, 1);
    let mut readings = orientation.forward(20.0, [0.0; 3]);
    readings[0] += 0.5;
    readings[1] += 0.4;
    let verdict = ParityCheck::default().check(&orientation, 20.0, MASK_6, &readings);
    assert!(verdict.exceeded);
    assert_eq!(verdict.exclude, None);
}

#[test]
fn a_reading_that_is_no_number_exceeds_and_blames_nobody() {
    let orientation = guarded(6, 1);
    let mut readings = [0.0; 6];
    readings[3] = f64::NAN;
    let verdict = ParityCheck::default().check(&orientation, 20.0, MASK_6, &readings);
    assert!(verdict.exceeded);
    assert_eq!(verdict.exclude, None);
}

fn unit_vector() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-1.0..1.0_f64)
        .prop_filter("too short to normalise", |v| dot(*v, *v) > 0.01)
        .prop_map(|v| v.map(|c| c / libm::sqrt(dot(v, v))))
}

proptest! {
    #[test]
    fn the_inverse_undoes_the_orientation(
        rows in prop::collection::vec(unit_vector(), 3..=8),
        weight in prop::collection::vec(1e-3..1e3_f64, 8),
        v in prop::array::uniform3(-10.0..10.0_f64),
        t in -100.0..100.0_f64,
    ) {
        let weights = weight[..rows.len()].to_vec();
        let stated = OrientationParts { weights, ..parts(rows) };
        if let Ok(orientation) = Orientation::new(&stated) {
            let mask = SensorMask::all(orientation.sensors());
            let back = orientation.inverse(t, mask).unwrap().apply(&orientation.forward(t, v));
            for (a, b) in back.iter().zip(v) {
                prop_assert!((a - b).abs() < 1e-9, "{} for {}", a, b);
            }
        }
    }

    #[test]
    fn a_matrix_is_conditioned_where_its_condition_number_says_so(
        rows in prop::collection::vec(unit_vector(), 3..=8),
        limit in prop::sample::select(vec![1.5, 3.0, CONDITION_LIMIT]),
        scale in prop::sample::select(vec![0.0, 1e-160, 1e-3, 1.0, 1e200, f64::NAN]),
    ) {
        let mut a = Rows::default();
        for (to, from) in a.iter_mut().zip(&rows) {
            *to = from.map(|c| c * scale);
        }
        prop_assert_eq!(is_conditioned(&a, limit), condition_number(&a) <= limit);
    }

    #[test]
    fn parity_rows_are_orthonormal_and_blind_to_motion(
        rows in prop::collection::vec(unit_vector(), 4..=8),
        dropped in 0..8_usize,
    ) {
        let mut a = Rows::default();
        for (to, from) in a.iter_mut().zip(&rows) {
            *to = *from;
        }
        let mask = SensorMask::all(rows.len()).without(dropped);
        let a = masked(a, mask);
        if condition_number(&a) < CONDITION_LIMIT {
            let (q, r) = orthonormal_columns(&a).unwrap();
            prop_assert!(r[1][0] == 0.0 && r[2][0] == 0.0 && r[2][1] == 0.0);
            let parity = parity_rows(&q, |index| mask.contains(index));
            prop_assert_eq!(parity.len(), mask.count() - 3);
            for (i, row) in parity.iter().enumerate() {
                prop_assert!(row[dropped] == 0.0);
                for c in 0..3 {
                    let seen: f64 = row.iter().zip(&a).map(|(v, a)| v * a[c]).sum();
                    prop_assert!(seen.abs() < 1e-12);
                }
                for (j, other) in parity.iter().enumerate() {
                    let product: f64 = row.iter().zip(other).map(|(a, b)| a * b).sum();
                    let expected = if i == j { 1.0 } else { 0.0 };
                    prop_assert!((product - expected).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn no_statement_and_no_reading_panics(
        rows in prop::collection::vec(prop::array::uniform3(prop::num::f64::ANY), 0..10),
        slopes_per_deg_c in prop::collection::vec(prop::array::uniform3(prop::num::f64::ANY), 0..10),
        weights in prop::collection::vec(prop::num::f64::ANY, 0..10),
        numbers in prop::array::uniform4(prop::num::f64::ANY),
        readings in prop::collection::vec(prop::num::f64::ANY, 0..9),
    ) {
        let [reference_deg_c, first, last, t] = numbers;
        let stated = OrientationParts {
            reference_deg_c,
            rows,
            slopes_per_deg_c,
            plays: vec![],
            weights,
            range_deg_c: [first, last],
            parity_limit: Some(t),
            parity_confirm_ticks: 1,
        };
        let _ = Orientation::new(&stated);
        let orientation = guarded(8, 1);
        let mut check = ParityCheck::default();
        for mask in [SensorMask::all(8), SensorMask::all(5).without(1), SensorMask::NONE] {
            let _ = check.check(&orientation, t, mask, &readings);
            if let Some(inverse) = orientation.inverse(t, mask) {
                let _ = inverse.lerp(&inverse, t).apply(&readings);
            }
        }
    }
}

/// Axes of which two come to point the same way where `slope`·(T − 20 °C) is one.
fn closing(slope: f64, range_deg_c: [f64; 2]) -> OrientationParts {
    let mut stated = parts(identity());
    stated.slopes_per_deg_c = vec![[0.0, slope, 0.0], [slope, 0.0, 0.0], [0.0; 3]];
    stated.range_deg_c = range_deg_c;
    stated
}

#[test]
fn axes_that_are_in_one_plane_within_their_range_are_refused() {
    // At 20 °C the condition number is 1, at either end 3, and at 50 °C there is no inverse.
    let stated = closing(1.0 / 30.0, [20.0, 80.0]);
    for at in [20.0, 80.0] {
        assert!(
            Orientation::new(&OrientationParts { range_deg_c: [at; 2], ..stated.clone() }).is_ok(),
            "{at}"
        );
    }
    let errors = Orientation::new(&stated).unwrap_err();
    let [DefectKind::ConditionInside { temperature_deg_c, got }] = kinds(&errors)[..] else {
        panic!("{errors:?}")
    };
    assert!((temperature_deg_c - 50.0).abs() < 1.0 && got > CONDITION_LIMIT, "{temperature_deg_c}, {got}");
    insta::assert_snapshot!(errors[0].kind);
    // A spike between the looks of any sampling: a singular temperature that is no round number, in a wide range.
    for singular in [50.000_000_123, 33.333_333_333, 79.99] {
        let errors = Orientation::new(&closing(1.0 / (singular - 20.0), [10.0, 500.0])).unwrap_err();
        let [DefectKind::ConditionInside { temperature_deg_c, .. }] = kinds(&errors)[..] else {
            panic!("{singular}: {errors:?}")
        };
        assert!((temperature_deg_c - singular).abs() < 0.03 * (singular - 20.0), "{temperature_deg_c}");
    }
    // The matrix shrinks to nothing at one temperature, with condition 1 everywhere else.
    let mut vanishing = parts(identity());
    vanishing.slopes_per_deg_c = identity().into_iter().map(|row| row.map(|c| -0.1 * c)).collect();
    let errors = Orientation::new(&vanishing).unwrap_err();
    assert!(
        matches!(kinds(&errors)[..], [DefectKind::ConditionInside { temperature_deg_c, .. }] if (temperature_deg_c - 30.0).abs() < 1e-6),
        "{errors:?}"
    );
}

#[test]
fn axes_that_come_close_to_one_plane_and_keep_off_it_are_taken() {
    // (1 + s)/(1 − s) = 99 at s = 0.98.
    assert!(Orientation::new(&closing(0.98 / 60.0, [-40.0, 80.0])).is_ok());
    assert!(Orientation::new(&closing(0.981 / 60.0, [-40.0, 80.0])).is_err());
}
