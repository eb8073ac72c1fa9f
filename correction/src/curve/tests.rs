use alloc::vec;
use alloc::vec::Vec;

use proptest::prelude::*;

use super::*;

fn polynomial(reference: f64, coefficients: &[f64], range: [f64; 2]) -> CurveParts {
    CurveParts::Polynomial { reference, coefficients: coefficients.to_vec(), range }
}

fn value(parts: &CurveParts, x: f64) -> f64 {
    Curve::new(parts).unwrap().at(x).value
}

#[test]
fn a_polynomial_is_taken_about_its_reference() {
    let parts = polynomial(20.0, &[1.0, 2.0, 3.0], [-40.0, 80.0]);
    assert_eq!(value(&parts, 22.0), 1.0 + 2.0 * 2.0 + 3.0 * 4.0);
}

#[test]
fn outside_the_range_the_end_value_stands_and_says_so() {
    let knots = vec![[0.0, 1.0], [1.0, 3.0], [3.0, 2.0]];
    let table = [
        polynomial(0.0, &[1.0, 2.0], [0.0, 3.0]),
        CurveParts::PiecewiseLinear { knots: knots.clone() },
        CurveParts::Spline { knots },
    ];
    for parts in table {
        let curve = Curve::new(&parts).unwrap();
        assert_eq!(curve.range(), [0.0, 3.0]);
        for (x, end) in [(-1.0, 0.0), (3.1, 3.0), (f64::INFINITY, 3.0), (f64::NEG_INFINITY, 0.0)] {
            assert_eq!(curve.at(x).value, curve.at(end).value);
            assert!(curve.at(x).clamped);
            assert!(!curve.at(end).clamped);
        }
    }
}

#[test]
fn not_a_number_falls_back_to_the_reference_or_first_knot() {
    let curve = Curve::new(&polynomial(5.0, &[7.0, 1.0], [0.0, 4.0])).unwrap();
    assert_eq!(curve.at(f64::NAN), Evaluated { value: 6.0, clamped: true });
    let knots = vec![[0.0, 1.0], [1.0, 3.0]];
    let curve = Curve::new(&CurveParts::Spline { knots }).unwrap();
    assert_eq!(curve.at(f64::NAN), Evaluated { value: 1.0, clamped: true });
}

#[test]
fn a_constant_is_never_clamped_by_a_number() {
    let curve = Curve::constant(4.5);
    for x in [0.0, -1e300, f64::INFINITY] {
        assert_eq!(curve.at(x), Evaluated { value: 4.5, clamped: false });
    }
    assert_eq!(curve.at(f64::NAN), Evaluated { value: 4.5, clamped: true });
}

#[test]
fn the_spline_agrees_with_a_hand_solved_case() {
    // Knots 0, 1, 2 with values 0, 1, 0: m = (0, −3, 0), S(x) = 1.5x − 0.5x³ on the first stretch.
    let parts = CurveParts::Spline { knots: vec![[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]] };
    for x in [0.0, 0.25, 0.5, 0.9, 1.0] {
        let expected = 1.5 * x - 0.5 * x * x * x;
        assert!((value(&parts, x) - expected).abs() < 1e-15);
        assert!((value(&parts, 2.0 - x) - expected).abs() < 1e-15);
    }
}

#[test]
fn the_spline_approaches_a_smooth_function() {
    let knots = (0..41).map(|i| f64::from(i) * 0.1).map(|x| [x, libm::sin(x)]).collect();
    let curve = Curve::new(&CurveParts::Spline { knots }).unwrap();
    // Away from the ends, where the natural condition is wrong for a sine, the error is of order h⁴.
    for i in 100..300 {
        let x = f64::from(i) * 0.01;
        assert!((curve.at(x).value - libm::sin(x)).abs() < 1e-6);
    }
}

#[test]
fn each_kind_of_wrong_curve_has_its_error() {
    let count = |count, low, high| DefectKind::Count { count, low, high };
    let number = |value| DefectKind::OutOfRange { value, low: f64::MIN, high: f64::MAX };
    let table = [
        (polynomial(0.0, &[], [0.0, 1.0]), "", count(0, 1, 10)),
        (polynomial(0.0, &[1.0; 11], [0.0, 1.0]), "", count(11, 1, 10)),
        (polynomial(0.0, &[1.0], [1.0, 1.0]), "range", DefectKind::InvertedRange { low: 1.0, high: 1.0 }),
        (polynomial(0.0, &[0.0, 0.0, 1e300], [-1.0, 1e9]), "", DefectKind::Overflow { near: 1e9 }),
        (polynomial(0.0, &[1.0, f64::INFINITY], [0.0, 1.0]), "coefficients", number(f64::INFINITY)),
        (CurveParts::Spline { knots: vec![[0.0, 0.0]] }, "", count(1, 2, 64)),
        (CurveParts::Spline { knots: vec![] }, "", count(0, 2, 64)),
        (
            CurveParts::Spline { knots: vec![[0.0, 0.0], [1.0, f64::INFINITY]] },
            "knots[1]",
            number(f64::INFINITY),
        ),
        (
            CurveParts::PiecewiseLinear { knots: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]] },
            "knots[2]",
            DefectKind::KnotsNotIncreasing { index: 2, previous: 1.0, got: 1.0 },
        ),
        (
            CurveParts::PiecewiseLinear { knots: vec![[0.0, -1e308], [1.0, 1e308]] },
            "",
            DefectKind::Overflow { near: 0.0 },
        ),
    ];
    for (parts, path, kind) in table {
        assert_eq!(Curve::new(&parts), Err(Defect { path: path.into(), kind }));
    }
}

fn any_knots() -> impl Strategy<Value = Vec<[f64; 2]>> {
    let step = (0.01..10.0_f64, -100.0..100.0_f64);
    (-50.0..50.0_f64, prop::collection::vec(step, 2..=64)).prop_map(|(start, steps)| {
        let mut x = start;
        steps
            .into_iter()
            .map(|(dx, y)| {
                x += dx;
                [x, y]
            })
            .collect()
    })
}

proptest! {
    #[test]
    fn tables_and_splines_meet_their_knots_and_stay_continuous(knots in any_knots()) {
        for parts in [
            CurveParts::PiecewiseLinear { knots: knots.clone() },
            CurveParts::Spline { knots: knots.clone() },
        ] {
            let curve = Curve::new(&parts).unwrap();
            for [x, y] in &knots {
                prop_assert_eq!(curve.at(*x), Evaluated { value: *y, clamped: false });
                let before = curve.at(x - x.abs().max(1.0) * 1e-14).value;
                prop_assert!((before - y).abs() < 1e-6, "{} jumps to {}", before, y);
            }
        }
    }

    #[test]
    fn a_spline_through_a_line_is_that_line(knots in any_knots(), a in -5.0..5.0_f64, b in -5.0..5.0_f64) {
        let line: Vec<[f64; 2]> = knots.iter().map(|[x, _]| [*x, a + b * x]).collect();
        let curve = Curve::new(&CurveParts::Spline { knots: line }).unwrap();
        let [first, last] = curve.range();
        for i in 0..=20 {
            let x: f64 = first + (last - first) * f64::from(i) / 20.0;
            prop_assert!((curve.at(x).value - (a + b * x)).abs() < 1e-9 * (1.0 + x.abs()));
        }
    }

    #[test]
    fn no_argument_makes_a_valid_curve_give_anything_but_a_finite_number(
        knots in any_knots(),
        x in prop::num::f64::ANY,
    ) {
        let curve = Curve::new(&CurveParts::Spline { knots }).unwrap();
        prop_assert!(curve.at(x).value.is_finite());
    }

    #[test]
    fn no_statement_panics(
        coefficients in prop::collection::vec(prop::num::f64::ANY, 0..12),
        knots in prop::collection::vec(prop::array::uniform2(prop::num::f64::ANY), 0..5),
        reference in prop::num::f64::ANY,
        range in prop::array::uniform2(prop::num::f64::ANY),
        x in prop::num::f64::ANY,
    ) {
        for parts in [
            CurveParts::Polynomial { reference, coefficients, range },
            CurveParts::PiecewiseLinear { knots: knots.clone() },
            CurveParts::Spline { knots },
        ] {
            if let Ok(curve) = Curve::new(&parts) {
                prop_assert!(curve.at(x).value.is_finite());
            }
        }
    }
}
