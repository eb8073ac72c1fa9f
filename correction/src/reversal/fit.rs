//! Least-squares polynomial through a few points, in orthogonal form.

use arrayvec::ArrayVec;

/// Most points of one fit: eight readings on either side of a switch.
pub(super) const MAX_POINTS: usize = 2 * super::MAX_FIT_READINGS as usize;
/// Highest degree of a fit.
const MAX_DEGREE: usize = super::MAX_FIT_DEGREE as usize;
/// Mean square of an orthogonal polynomial over the points, in units of half their spread, below which the
/// points are too few or too close together to carry that degree.
const SMALLEST_MEAN_SQUARE: f64 = 1e-6;

/// The points of one fit: abscissa (s) and ordinate.
pub(super) type Points = ArrayVec<[f64; 2], MAX_POINTS>;

/// `Σ c_k·p_k(u)` with `p_0 = 1`, `p_{k+1} = (u − a_k)·p_k − b_k·p_{k−1}`, orthogonal over the points
/// [Forsythe 1957].
///
/// u runs from −1 to 1 over the points, so nothing depends on the origin or the unit of the abscissas and
/// no normal equations are solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    centre: f64,
    half_spread: f64,
    /// Per degree: `a_k`, `b_k`, `c_k`.
    terms: [[f64; 3]; MAX_DEGREE + 1],
}

impl Fit {
    /// Fits a polynomial of at most the given degree; the degree falls to what the points can carry.
    ///
    /// `None` without points.
    pub(super) fn new(points: &[[f64; 2]], degree: usize) -> Option<Self> {
        let count = points.iter().fold(0.0, |n, _| n + 1.0);
        if points.is_empty() || points.len() > MAX_POINTS {
            return None;
        }
        let first = points.iter().map(|[x, _]| *x).fold(f64::INFINITY, f64::min);
        let last = points.iter().map(|[x, _]| *x).fold(f64::NEG_INFINITY, f64::max);
        let half = (last - first) / 2.0;
        let mut fit = Self {
            centre: first + half,
            half_spread: if half > 0.0 { half } else { 1.0 },
            terms: [[0.0; 3]; MAX_DEGREE + 1],
        };

        // Per point: abscissa, what is left of the ordinate, `p_{k−1}`, `p_k`.
        let mut work: ArrayVec<[f64; 4], MAX_POINTS> =
            points.iter().map(|[x, y]| [fit.scaled(*x), *y, 0.0, 1.0]).collect();
        let mut last_square = 1.0;
        let usable = degree.min(points.len() - 1);
        for (k, term) in fit.terms.iter_mut().enumerate().take(usable + 1) {
            let square: f64 = work.iter().map(|[_, _, _, p]| p * p).sum();
            if square.is_nan() || square <= SMALLEST_MEAN_SQUARE * count {
                break;
            }
            let c = work.iter().map(|[_, y, _, p]| y * p).sum::<f64>() / square;
            let a = work.iter().map(|[u, _, _, p]| u * p * p).sum::<f64>() / square;
            let b = if k == 0 { 0.0 } else { square / last_square };
            *term = [a, b, c];
            last_square = square;
            for [u, y, older, p] in &mut work {
                *y -= c * *p;
                (*older, *p) = (*p, (*u - a) * *p - b * *older);
            }
        }
        Some(fit)
    }

    /// The polynomial's value at abscissa `x`.
    pub(super) fn at(&self, x: f64) -> f64 {
        let u = self.scaled(x);
        let (mut older, mut p, mut sum) = (0.0, 1.0, 0.0);
        for [a, b, c] in &self.terms {
            sum += c * p;
            (older, p) = (p, (u - a) * p - b * older);
        }
        sum
    }

    fn scaled(&self, x: f64) -> f64 {
        (x - self.centre) / self.half_spread
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "a constant is met to the bit")]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn no_points_give_no_fit_and_one_gives_a_constant() {
        assert_eq!(Fit::new(&[], 2), None);
        let fit = Fit::new(&[[3.0, 7.0]], 2).unwrap();
        assert_eq!(fit.at(-100.0), 7.0);
    }

    #[test]
    fn coincident_points_lower_the_degree() {
        let fit = Fit::new(&[[1.0, 2.0], [1.0, 4.0], [1.0, 3.0]], 2).unwrap();
        assert_eq!(fit.at(50.0), 3.0);
        let fit = Fit::new(&[[0.0, 0.0], [0.0, 2.0], [1.0, 3.0]], 2).unwrap();
        assert!((fit.at(0.5) - 2.0).abs() < 1e-15);
    }

    #[test]
    fn overdetermined_points_give_the_textbook_line() {
        // Normal equations by hand: slope 1.4, intercept 0.9.
        let fit = Fit::new(&[[0.0, 1.0], [1.0, 2.0], [2.0, 4.0], [3.0, 5.0]], 1).unwrap();
        assert!((fit.at(0.0) - 0.9).abs() < 1e-15);
        assert!((fit.at(10.0) - 14.9).abs() < 1e-13);
    }

    proptest! {
        #[test]
        fn a_polynomial_of_the_degree_is_met_exactly(
            c in prop::array::uniform4(-10.0..10.0_f64),
            degree in 0..=3_usize,
            extra in 0..=12_usize,
            x in -2.0..3.0_f64,
        ) {
            let value = |x: f64| c[..=degree].iter().rev().fold(0.0, |sum, c| sum * x + c);
            let last = degree + extra;
            let points: Points = (0..=u8::try_from(last).unwrap())
                .map(|i| f64::from(i) / f64::from(u8::try_from(last.max(1)).unwrap()))
                .map(|x| [x, value(x)])
                .collect();
            let fit = Fit::new(&points, degree).unwrap();
            prop_assert!((fit.at(x) - value(x)).abs() < 1e-10);
        }

        #[test]
        fn nothing_panics(
            points in prop::collection::vec(prop::array::uniform2(prop::num::f64::ANY), 0..20),
            degree in 0..9_usize,
            x in prop::num::f64::ANY,
        ) {
            if let Some(fit) = Fit::new(&points, degree) {
                let _ = fit.at(x);
            }
        }
    }
}
