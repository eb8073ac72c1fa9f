//! Linear least squares, X·β ≈ y, for rows that are independent and of variance one.
//!
//! Columns are brought to length one first, because coefficients of one fit span many powers of ten. The rows are then turned into the
//! triangle R of X = Q·R, whose singular values say which direction of the coefficients nothing determines.

use nalgebra::{DMatrix, DVector};

/// A direction of the coefficients is not determined where its singular value is below this share of the largest.
pub const SINGULAR: f64 = 1e-9;

/// What is done where the rows hardly determine a direction of the coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weak {
    /// It is refused where its singular value is below this share of the largest.
    Refuse(f64),
    /// Zero stands against it.
    Ridge {
        /// Weight of the zero, as a share of each column's own.
        share: f64,
        /// Length up to which a column is nothing but rounding: its coefficient is zero.
        nothing: f64,
    },
}

/// The column that has the largest part in a direction that the rows do not determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Undetermined(pub usize);

/// Coefficients and what is known of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Linear {
    /// β, in the order of the columns.
    pub coefficients: DVector<f64>,
    /// (XᵀX)⁻¹: the covariance of β for rows of variance one.
    pub inverse: DMatrix<f64>,
    /// y − X·β.
    pub residual: DVector<f64>,
    /// ln det `XᵀX`.
    pub log_determinant: f64,
}

impl Linear {
    /// Standard error of a coefficient, for rows of variance one.
    pub fn sigma(&self, index: usize) -> f64 {
        self.inverse.get((index, index)).map_or(f64::NAN, |variance| variance.max(0.0).sqrt())
    }

    /// Sum of the squared residuals.
    pub fn chi_square(&self) -> f64 {
        self.residual.norm_squared()
    }
}

/// Solves for β.
///
/// # Errors
/// Where the rows do not determine it.
pub fn solve(design: &DMatrix<f64>, values: &DVector<f64>, weak: Weak) -> Result<Linear, Undetermined> {
    let (rows, count) = design.shape();
    let lengths: Vec<f64> = design.column_iter().map(|column| column.norm()).collect();
    let (least, ridge, nothing) = match weak {
        Weak::Refuse(least) => (least, 0.0, 0.0),
        Weak::Ridge { share, nothing } => (0.0, share.sqrt(), nothing),
    };
    let refuses = matches!(weak, Weak::Refuse(_));
    if let Some(index) = lengths.iter().position(|length| length.is_nan() || refuses && *length <= 0.0) {
        return Err(Undetermined(index));
    }
    let below = if refuses { 0 } else { count };
    if count == 0 || rows + below < count {
        return Err(Undetermined(count.saturating_sub(1)));
    }
    let scale = DVector::from_iterator(
        count,
        lengths.iter().map(|length| if *length > nothing { 1.0 / length } else { 0.0 }),
    );
    let scaled = DMatrix::from_fn(rows + below, count, |i, j| {
        if i < rows { design[(i, j)] * scale[j] } else { f64::from(u8::from(i - rows == j)) * ridge }
    });
    let mut right = DVector::from_fn(rows + below, |i, _| if i < rows { values[i] } else { 0.0 });
    let qr = scaled.qr();
    qr.q_tr_mul(&mut right);
    let svd = qr.r().svd(true, true);
    let (Some(u), Some(directions)) = (svd.u, svd.v_t) else { return Err(Undetermined(count - 1)) };
    let singular = svd.singular_values;
    let limit = least * singular.max();
    let mut inverse = DMatrix::zeros(count, count);
    for (value, direction) in singular.iter().zip(directions.row_iter()) {
        if value.is_nan() || *value <= limit {
            return Err(Undetermined(direction.transpose().icamax()));
        }
        inverse += direction.tr_mul(&direction) / (value * value);
    }
    let projected = u.tr_mul(&right.rows(0, count));
    let coefficients = directions.tr_mul(&projected.component_div(&singular)).component_mul(&scale);
    let logarithms = singular.iter().zip(scale.iter());
    Ok(Linear {
        inverse: DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]),
        residual: values - design * &coefficients,
        log_determinant: logarithms.map(|(value, scale)| 2.0 * (libm::log(*value) - libm::log(*scale))).sum(),
        coefficients,
    })
}

/// (XᵀX)⁻¹.
///
/// # Errors
/// Where the rows do not determine the coefficients.
pub fn inverse(design: &DMatrix<f64>) -> Result<DMatrix<f64>, Undetermined> {
    let values = DVector::zeros(design.nrows());
    solve(design, &values, Weak::Refuse(SINGULAR)).map(|found| found.inverse)
}

/// Smallest over largest singular value of a design as it stands: how well its rows spread.
pub fn spread(design: &DMatrix<f64>) -> f64 {
    let singular = design.singular_values();
    if design.nrows() < design.ncols() { 0.0 } else { singular.min() / singular.max() }
}

/// L⁻¹ of a covariance V = L·Lᵀ: what makes rows of that covariance independent and of variance one; `None` where it is none.
pub fn whitening(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let count = covariance.nrows();
    // To unit diagonal first: variances may span many powers of ten.
    let scale: Vec<f64> = covariance.diagonal().iter().map(|variance| 1.0 / variance.sqrt()).collect();
    let unit = DMatrix::from_fn(count, count, |i, j| covariance[(i, j)] * scale[i] * scale[j]);
    let inverse = unit.cholesky()?.l().solve_lower_triangular(&DMatrix::identity(count, count))?;
    Some(DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[j]))
}

/// χ² of numbers against zero under their covariance: xᵀ·V⁻¹·x; `None` where V is no covariance.
pub fn chi_square(numbers: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<f64> {
    Some((whitening(covariance)? * numbers).norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Longley (1967), the certified values of NIST's reference data set of that name: condition 5·10⁹.
    #[test]
    fn longley_comes_to_its_certified_digits() {
        const ROWS: [[f64; 7]; 16] = [
            [60323.0, 83.0, 234_289.0, 2356.0, 1590.0, 107_608.0, 1947.0],
            [61122.0, 88.5, 259_426.0, 2325.0, 1456.0, 108_632.0, 1948.0],
            [60171.0, 88.2, 258_054.0, 3682.0, 1616.0, 109_773.0, 1949.0],
            [61187.0, 89.5, 284_599.0, 3351.0, 1650.0, 110_929.0, 1950.0],
            [63221.0, 96.2, 328_975.0, 2099.0, 3099.0, 112_075.0, 1951.0],
            [63639.0, 98.1, 346_999.0, 1932.0, 3594.0, 113_270.0, 1952.0],
            [64989.0, 99.0, 365_385.0, 1870.0, 3547.0, 115_094.0, 1953.0],
            [63761.0, 100.0, 363_112.0, 3578.0, 3350.0, 116_219.0, 1954.0],
            [66019.0, 101.2, 397_469.0, 2904.0, 3048.0, 117_388.0, 1955.0],
            [67857.0, 104.6, 419_180.0, 2822.0, 2857.0, 118_734.0, 1956.0],
            [68169.0, 108.4, 442_769.0, 2936.0, 2798.0, 120_445.0, 1957.0],
            [66513.0, 110.8, 444_546.0, 4681.0, 2637.0, 121_950.0, 1958.0],
            [68655.0, 112.6, 482_704.0, 3813.0, 2552.0, 123_366.0, 1959.0],
            [69564.0, 114.2, 502_601.0, 3931.0, 2514.0, 125_368.0, 1960.0],
            [69331.0, 115.7, 518_173.0, 4806.0, 2572.0, 127_852.0, 1961.0],
            [70551.0, 116.9, 554_894.0, 4007.0, 2827.0, 130_081.0, 1962.0],
        ];
        const CERTIFIED: [[f64; 2]; 7] = [
            [-3_482_258.634_595_82, 890_420.383_607_373],
            [15.061_872_271_373_3, 84.914_925_774_766_9],
            [-0.358_191_792_925_910e-1, 0.334_910_077_722_432e-1],
            [-2.020_229_803_816_83, 0.488_399_681_651_699],
            [-1.033_226_867_173_59, 0.214_274_163_161_675],
            [-0.511_041_056_535_807e-1, 0.226_073_200_069_370],
            [1_829.151_464_613_55, 455.478_499_142_212],
        ];
        let design = DMatrix::from_fn(16, 7, |i, j| if j == 0 { 1.0 } else { ROWS[i][j] });
        let values = DVector::from_fn(16, |i, _| ROWS[i][0]);
        let found = solve(&design, &values, Weak::Refuse(SINGULAR)).unwrap();
        let deviation = (found.chi_square() / 9.0).sqrt();
        assert!((deviation / 304.854_073_561_965 - 1.0).abs() < 1e-9);
        for (index, [value, sigma]) in CERTIFIED.into_iter().enumerate() {
            assert!((found.coefficients[index] / value - 1.0).abs() < 1e-6, "{index}");
            assert!((deviation * found.sigma(index) / sigma - 1.0).abs() < 1e-6, "{index}");
        }
    }

    #[test]
    fn determinant_and_inverse_are_those_of_the_normal_matrix() {
        let design = DMatrix::from_fn(4, 2, |i, j| [[1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [1.0, 5.0]][i][j]);
        // [[4, 8], [8, 30]]
        let found = solve(&design, &DVector::zeros(4), Weak::Refuse(SINGULAR)).unwrap();
        assert!((found.log_determinant - libm::log(56.0)).abs() < 1e-12);
        let expected = [[30.0, -8.0], [-8.0, 4.0]];
        for (i, row) in expected.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                assert!((found.inverse[(i, j)] - value / 56.0).abs() < 1e-14);
            }
        }
        assert_eq!(inverse(&design).unwrap(), found.inverse);
    }

    #[test]
    fn what_nothing_determines_is_named_or_held_at_zero() {
        let twins = DMatrix::from_fn(5, 3, |i, j| [1.0, 1.0, f64::from(u8::try_from(i).unwrap())][j]);
        let values = DVector::repeat(5, 2.0);
        let Undetermined(index) = solve(&twins, &values, Weak::Refuse(SINGULAR)).unwrap_err();
        assert!(index < 2);
        let held = solve(&twins, &values, Weak::Ridge { share: 1e-9, nothing: 0.0 }).unwrap();
        assert!((held.coefficients[0] + held.coefficients[1] - 2.0).abs() < 1e-6);
        assert!((held.coefficients[0] - held.coefficients[1]).abs() < 1e-6);
        let rounding = DMatrix::from_fn(5, 2, |_, j| [1.0, 1e-14][j]);
        let held = solve(&rounding, &values, Weak::Ridge { share: 1e-9, nothing: 1e-11 }).unwrap();
        assert!(held.coefficients[1].abs() < 1e-300);
        assert_eq!(
            solve(&rounding.rows(0, 1).into_owned(), &values.rows(0, 1).into_owned(), Weak::Refuse(SINGULAR)),
            Err(Undetermined(1))
        );
    }

    /// One of two correlated numbers: V = [[4, 2], [2, 3]], det 8.
    #[test]
    fn correlated_numbers_are_weighed_with_their_covariance() {
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 2.0, 2.0, 3.0]);
        let white = whitening(&covariance).unwrap();
        let unit = &white * &covariance * white.transpose();
        assert!((unit - DMatrix::identity(2, 2)).norm() < 1e-14);
        let far = chi_square(&DVector::from_vec(vec![1.0, 2.0]), &covariance).unwrap();
        // (3·1 − 2·2·1·2 + 4·4)/8
        assert!((far - 11.0 / 8.0).abs() < 1e-14);
        assert_eq!(whitening(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0])), None);
    }
}
