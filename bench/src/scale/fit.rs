//! Exponents of growth.

/// Slope of the logarithm of the second number of each point over that of the first, by least squares; no number where there are
/// not two points. Points that have no logarithm are left out.
pub(super) fn exponent(points: &[[f64; 2]]) -> f64 {
    let logs: Vec<[f64; 2]> =
        points.iter().filter(|[x, y]| *x > 0.0 && *y > 0.0).map(|point| point.map(f64::ln)).collect();
    let count = logs.iter().fold(0.0, |count, _| count + 1.0);
    let mean = |index: usize| logs.iter().map(|point| point[index]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let along: f64 = logs.iter().map(|point| (point[0] - x) * (point[1] - y)).sum();
    along / logs.iter().map(|point| (point[0] - x) * (point[0] - x)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_has_its_exponent() {
        let points: Vec<[f64; 2]> = [1.0, 10.0, 100.0, 5000.0_f64].map(|x| [x, 3.0 * x.powf(1.04)]).to_vec();
        assert!((exponent(&points) - 1.04).abs() < 1e-12);
        let with_nothing = [&points[..], &[[7.0, 0.0]]].concat();
        assert!((exponent(&with_nothing) - 1.04).abs() < 1e-12);
        assert!(exponent(&points[..1]).is_nan());
    }
}
