//! Cross-validation by blocks: what was fitted to all blocks but one is judged on that one.
//!
//! Each block's rows are turned into a triangle once. A fit without a block is a fit to the triangles of the others, whatever columns it
//! takes, and the squares that a block's triangle leaves are those that its rows leave.

use nalgebra::{DMatrix, DVector};

use super::linear::{self, Linear, Weak};

/// The rows of a design by block, columns first and values last, each as a triangle where it has more rows than that.
#[derive(Debug, Clone)]
pub struct Blocks {
    triangles: Vec<DMatrix<f64>>,
    rows: Vec<usize>,
}

impl Blocks {
    /// Of rows of which each belongs to a block, numbered from 0.
    pub fn of(design: &DMatrix<f64>, values: &DVector<f64>, block: &[usize]) -> Self {
        let count = block.iter().max().map_or(0, |last| last + 1);
        let mut members = vec![Vec::new(); count];
        block.iter().enumerate().for_each(|(row, block)| members[*block].push(row));
        let width = design.ncols() + 1;
        let triangle = |mine: &Vec<usize>| {
            let rows = DMatrix::from_fn(mine.len(), width, |i, j| {
                if j + 1 < width { design[(mine[i], j)] } else { values[mine[i]] }
            });
            if mine.len() > width { rows.qr().r() } else { rows }
        };
        Self {
            triangles: members.iter().map(triangle).collect(),
            rows: members.iter().map(Vec::len).collect(),
        }
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Rows of a block.
    pub fn rows(&self, block: usize) -> usize {
        self.rows.get(block).copied().unwrap_or(0)
    }

    /// The fit of some columns to all blocks but one; `None` where those do not determine it.
    pub fn without(&self, left_out: usize, columns: &[usize], weak: Weak) -> Option<Linear> {
        let others = || self.triangles.iter().enumerate().filter(|(block, _)| *block != left_out);
        let rows: usize = others().map(|(_, triangle)| triangle.nrows()).sum();
        let mut design = DMatrix::zeros(rows, columns.len());
        let mut values = DVector::zeros(rows);
        let mut from = 0;
        for (_, triangle) in others() {
            for row in 0..triangle.nrows() {
                columns
                    .iter()
                    .enumerate()
                    .for_each(|(to, column)| design[(from + row, to)] = triangle[(row, *column)]);
                values[from + row] = triangle[(row, triangle.ncols() - 1)];
            }
            from += triangle.nrows();
        }
        linear::solve(&design, &values, weak).ok()
    }

    /// Sum of the squares that coefficients of some columns leave in a block.
    pub fn left_in(&self, block: usize, columns: &[usize], coefficients: &DVector<f64>) -> f64 {
        let Some(triangle) = self.triangles.get(block) else { return 0.0 };
        let left = |row: usize| {
            let terms = columns.iter().zip(coefficients.iter());
            terms.fold(triangle[(row, triangle.ncols() - 1)], |left, (column, c)| {
                left - c * triangle[(row, *column)]
            })
        };
        (0..triangle.nrows()).map(|row| left(row) * left(row)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::noise;
    use crate::lsq::linear::SINGULAR;

    #[test]
    fn a_block_left_out_is_as_if_it_had_not_been() {
        let (rows, all) = (120_usize, [0, 1, 2]);
        let mut noise = noise();
        let design = DMatrix::from_fn(rows, 3, |_, j| if j == 0 { 1.0 } else { noise() });
        let values = DVector::from_fn(rows, |i, _| 2.0 - design[(i, 1)] + 0.3 * noise());
        // One block has fewer rows than columns.
        let block: Vec<usize> = (0..rows).map(|row| if row < 2 { 3 } else { row / 50 }).collect();
        let blocks = Blocks::of(&design, &values, &block);
        assert_eq!((blocks.len(), blocks.rows(3), blocks.rows(2)), (4, 2, 20));
        for left_out in 0..4 {
            for columns in [&all[..], &all[..2]] {
                let stay: Vec<usize> = (0..rows).filter(|row| block[*row] != left_out).collect();
                let others = design.select_rows(&stay).select_columns(columns);
                let plain =
                    linear::solve(&others, &values.select_rows(&stay), Weak::Refuse(SINGULAR)).unwrap();
                let found = blocks.without(left_out, columns, Weak::Refuse(SINGULAR)).unwrap();
                assert!((&found.coefficients - &plain.coefficients).norm() < 1e-12);
                assert!((&found.inverse - &plain.inverse).norm() < 1e-12);
                let mine: Vec<usize> = (0..rows).filter(|row| block[*row] == left_out).collect();
                let left = values.select_rows(&mine)
                    - design.select_rows(&mine).select_columns(columns) * &plain.coefficients;
                let squares = blocks.left_in(left_out, columns, &found.coefficients);
                assert!((squares / left.norm_squared() - 1.0).abs() < 1e-10);
            }
        }
    }
}
