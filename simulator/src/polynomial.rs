//! Polynomials of temperature, written lowest power first, and steps of an output.

/// Value of a polynomial at `x`.
pub(crate) fn at<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

/// Scale relative to that at the reference temperature: 1 + κ1·x + κ2·x².
pub(crate) fn scale([first, second]: [f64; 2], x: f64) -> f64 {
    at(&[1.0, first, second], x)
}

/// The nearest multiple of a step; the value itself where there is none.
pub(crate) fn rounded(value: f64, step: f64) -> f64 {
    if step > 0.0 { libm::round(value / step) * step } else { value }
}

#[cfg(test)]
mod tests {
    #[test]
    fn lowest_power_comes_first() {
        assert!((super::at(&[1.0, 10.0, 100.0], 2.0) - 421.0).abs() < 1e-12);
        assert!(super::at(&[], 2.0).abs() < 1e-12);
    }
}
