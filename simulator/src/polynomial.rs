//! Polynomials of temperature, written lowest power first.

/// Value of a polynomial at `x`.
pub(crate) fn at<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

#[cfg(test)]
mod tests {
    #[test]
    fn lowest_power_comes_first() {
        assert!((super::at(&[1.0, 10.0, 100.0], 2.0) - 421.0).abs() < 1e-12);
        assert!(super::at(&[], 2.0).abs() < 1e-12);
    }
}
