//! Many models of the same rows, each judged on pieces that it was not fitted to.
//!
//! Each piece's rows become a matrix of products once. A fit of some columns to all pieces but one, and what it leaves in that one, are
//! then a matter of small matrices, however long the log is. Coefficients are shrunk: that bounds the condition of the matrix, which
//! products square.

use nalgebra::{DMatrix, DVector};

/// Weight of the zero that stands against every coefficient, as a share of its column's own: it only holds what the rows leave open.
const HOLD: f64 = 1e-12;
/// Root mean square of a column that is nothing but rounding.
const NOTHING: f64 = 1e-11;

/// Products of the rows of one piece: columns first, values last.
#[derive(Debug, Clone)]
struct Products {
    matrix: DMatrix<f64>,
    weight: f64,
    rows: usize,
}

impl Products {
    fn new(width: usize) -> Self {
        Self { matrix: DMatrix::zeros(width, width), weight: 0.0, rows: 0 }
    }

    fn add(&mut self, row: &DVector<f64>, weight: f64) {
        self.matrix.ger(weight, row, row, 1.0);
        self.weight += weight;
        self.rows += 1;
    }
}

/// The rows by pieces.
#[derive(Debug, Clone)]
pub struct Folds {
    pieces: Vec<Products>,
    /// Of each piece the blocks that it is judged by.
    judged: Vec<Products>,
    all: Products,
    /// Root mean square of each column, and of it about its mean.
    scale: Vec<[f64; 2]>,
}

/// What stands against the coefficients of a model.
#[derive(Debug, Clone, Copy)]
pub struct Shrink<'a> {
    /// Weight of zero against each column, as a share of its variance.
    pub share: &'a [f64],
    /// Mean square that a unit of two coefficients adds to what is left, by column: noise of what the columns are made from.
    pub noise: &'a DMatrix<f64>,
}

impl Folds {
    /// Of columns and values with weights, each row in a piece, numbered from 0. Rows with a weight of zero, or with what is no number,
    /// take no part. `is_judged` says which rows judge; up to `block` of them in sequence judge by their mean.
    pub fn of(
        columns: &[&[f64]],
        (values, weights): (&[f64], &[f64]),
        piece: &[usize],
        is_judged: impl Fn(usize) -> bool,
        block: usize,
    ) -> Self {
        let width = columns.len() + 1;
        let good: Vec<usize> = (0..values.len())
            .filter(|&row| {
                weights[row] > 0.0
                    && values[row].is_finite()
                    && columns.iter().all(|column| column[row].is_finite())
            })
            .collect();
        let weight: f64 = good.iter().map(|&row| weights[row]).sum();
        let scale: Vec<[f64; 2]> = columns
            .iter()
            .map(|column| {
                let mean = |of: &dyn Fn(f64) -> f64| {
                    good.iter().map(|&row| weights[row] * of(column[row])).sum::<f64>() / weight
                };
                let (square, middle) = (mean(&|x| x * x), mean(&|x| x));
                [square.sqrt(), (square - middle * middle).max(0.0).sqrt()]
            })
            .collect();
        let row_of = |row: usize| {
            DVector::from_iterator(
                width,
                columns
                    .iter()
                    .zip(&scale)
                    .map(|(column, [size, _])| if *size > NOTHING { column[row] / size } else { 0.0 })
                    .chain([values[row]]),
            )
        };
        let count = piece.iter().max().map_or(0, |last| last + 1);
        let mut folds = Self {
            pieces: vec![Products::new(width); count],
            judged: vec![Products::new(width); count],
            all: Products::new(width),
            scale: scale.clone(),
        };
        let mut open: Vec<(DVector<f64>, f64, usize)> = vec![(DVector::zeros(width), 0.0, 0); count];
        for &row in &good {
            let (products, own) = (row_of(row), piece[row]);
            folds.pieces[own].add(&products, weights[row]);
            if !is_judged(row) {
                continue;
            }
            let (sum, share, rows) = &mut open[own];
            sum.axpy(weights[row], &products, 1.0);
            *share += weights[row];
            *rows += 1;
            if *rows == block {
                folds.judged[own].add(&(&*sum / *share), *share);
                (*share, *rows) = (0.0, 0);
                sum.fill(0.0);
            }
        }
        for (own, (sum, share, rows)) in open.into_iter().enumerate() {
            if rows > 0 {
                folds.judged[own].add(&(sum / share), share);
            }
        }
        for piece in &folds.pieces {
            folds.all.matrix += &piece.matrix;
            folds.all.weight += piece.weight;
            folds.all.rows += piece.rows;
        }
        folds
    }

    /// Root mean square of what a model of some columns leaves on pieces that it did not see, the noise that it adds itself included;
    /// `None` where too little can be judged.
    pub fn score(&self, columns: &[usize], shrink: Shrink<'_>) -> Option<f64> {
        let (mut square, mut weight, mut noise, mut count) = (0.0, 0.0, 0.0, 0.0);
        for (piece, judged) in self.pieces.iter().zip(&self.judged) {
            let rows = self.all.rows - piece.rows;
            if judged.rows == 0 || rows < 2 * columns.len() + 3 {
                continue;
            }
            let Some(found) = self.solved(piece, columns, shrink) else { continue };
            let value = self.scale.len();
            let full: Vec<(usize, f64)> =
                columns.iter().copied().zip(found.iter().copied()).chain([(value, -1.0)]).collect();
            for &(i, a) in &full {
                square += full.iter().map(|&(j, b)| a * b * judged.matrix[(i, j)]).sum::<f64>();
            }
            weight += judged.weight;
            noise += self.added(columns, &found, shrink.noise);
            count += 1.0;
        }
        (count >= 2.0 && weight > 0.0).then(|| (square.max(0.0) / weight + noise / count).sqrt())
    }

    /// What brings a column to length one; nothing but rounding has no length.
    fn unit(&self, column: usize) -> f64 {
        let [size, _] = self.scale[column];
        if size > NOTHING { 1.0 / size } else { 0.0 }
    }

    /// What stands against the coefficients of columns at length one.
    fn penalty(&self, columns: &[usize], shrink: Shrink<'_>) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            let (a, b) = (columns[i], columns[j]);
            let own =
                if i == j { shrink.share[a] * (self.scale[a][1] * self.unit(a)).powi(2) + HOLD } else { 0.0 };
            own + shrink.noise[(a, b)] * self.unit(a) * self.unit(b)
        })
    }

    /// Rows that hold the coefficients of some columns, as they are, to zero, for rows whose weights have the sum of one.
    pub fn holding(&self, columns: &[usize], shrink: Shrink<'_>) -> Option<DMatrix<f64>> {
        let root = self.penalty(columns, shrink).cholesky()?.l().transpose();
        Some(DMatrix::from_fn(columns.len(), columns.len(), |i, j| root[(i, j)] * self.scale[columns[j]][0]))
    }

    /// Coefficients of columns at length one, from all pieces but one.
    fn solved(&self, without: &Products, columns: &[usize], shrink: Shrink<'_>) -> Option<DVector<f64>> {
        let weight = self.all.weight - without.weight;
        let product = |i: usize, j: usize| (self.all.matrix[(i, j)] - without.matrix[(i, j)]) / weight;
        let mut matrix = self.penalty(columns, shrink);
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                matrix[(i, j)] += product(*a, *b);
            }
        }
        let right =
            DVector::from_iterator(columns.len(), columns.iter().map(|a| product(*a, self.scale.len())));
        let found = matrix.cholesky()?.solve(&right);
        found.iter().all(|c| c.is_finite()).then_some(found)
    }

    fn added(&self, columns: &[usize], found: &DVector<f64>, noise: &DMatrix<f64>) -> f64 {
        let raw: Vec<(usize, f64)> =
            columns.iter().zip(found.iter()).map(|(index, c)| (*index, c * self.unit(*index))).collect();
        raw.iter().map(|&(i, a)| raw.iter().map(|&(j, b)| a * b * noise[(i, j)]).sum::<f64>()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::noise;
    use crate::lsq::linear::{Weak, solve};

    /// Sixty rows in three pieces: two columns, values, and the columns' readings have noise of their own.
    fn rows() -> (Vec<f64>, Vec<f64>, Vec<f64>, Vec<usize>) {
        let mut noise = noise();
        let ones = vec![1.0; 60];
        let x: Vec<f64> = (0..60).map(|i| f64::from(i % 17) - 8.0).collect();
        let values = x.iter().map(|x| 3.0 - 0.5 * x + 0.1 * noise()).collect();
        (ones, x, values, (0..60).map(|row| row / 20).collect())
    }

    #[test]
    fn a_score_is_what_fits_without_each_piece_leave_in_it() {
        let (ones, x, values, piece) = rows();
        let weights = vec![1.0; 60];
        let folds = Folds::of(&[&ones, &x], (&values, &weights), &piece, |_| true, 1);
        let free = Shrink { share: &[0.0, 0.0], noise: &DMatrix::zeros(2, 2) };
        let mut square = 0.0;
        for left_out in 0..3 {
            let stay: Vec<usize> = (0..60).filter(|row| piece[*row] != left_out).collect();
            let design = DMatrix::from_fn(40, 2, |i, j| [&ones, &x][j][stay[i]]);
            let right = DVector::from_fn(40, |i, _| values[stay[i]]);
            let found = solve(&design, &right, Weak::Refuse(1e-9)).unwrap().coefficients;
            let left = |row: usize| values[row] - found[0] - found[1] * x[row];
            square += (0..60).filter(|row| piece[*row] == left_out).map(|row| left(row).powi(2)).sum::<f64>();
        }
        let score = folds.score(&[0, 1], free).unwrap();
        assert!((score / (square / 60.0).sqrt() - 1.0).abs() < 1e-9, "{score}");
        // One column leaves more, and noise in it makes it worth less.
        assert!(folds.score(&[0], free).unwrap() > 5.0 * score);
        let noisy = DMatrix::from_fn(2, 2, |i, j| f64::from(u8::from(i == 1 && j == 1)));
        let with = folds.score(&[0, 1], Shrink { share: &[0.0, 0.0], noise: &noisy }).unwrap();
        assert!(with > 0.4 && with < folds.score(&[0], free).unwrap(), "{with}");
    }

    #[test]
    fn shrunk_coefficients_are_those_of_rows_that_hold_them() {
        let (ones, x, values, _) = rows();
        let weights = vec![1.0; 60];
        let folds = Folds::of(&[&ones, &x], (&values, &weights), &vec![0; 60], |_| true, 1);
        let shrink = Shrink { share: &[0.0, 1.0], noise: &DMatrix::zeros(2, 2) };
        let held = folds.holding(&[0, 1], shrink).unwrap() * 60.0_f64.sqrt();
        let design =
            DMatrix::from_fn(62, 2, |i, j| if i < 60 { [&ones, &x][j][i] } else { held[(i - 60, j)] });
        let right = DVector::from_fn(62, |i, _| if i < 60 { values[i] } else { 0.0 });
        let found = solve(&design, &right, Weak::Refuse(1e-9)).unwrap().coefficients;
        let free = solve(&design.rows(0, 60).into(), &right.rows(0, 60).into(), Weak::Refuse(1e-9)).unwrap();
        // As much weight on zero as on the rows halves a slope.
        assert!((found[1] / free.coefficients[1] - 0.5).abs() < 0.01, "{found} {}", free.coefficients);
    }
}
