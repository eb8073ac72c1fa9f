//! Where the search for the gyros' axes begins: in which order, with which signs, in which unit of measure the columns stand.

use std::f64::consts::PI;

use nalgebra::Matrix3;

use super::{Track, Transition, turned};
use crate::axes::others;
use crate::numbers::unit;
use crate::runs::swapped::{AS_LOGGED, ORDERS};

/// Factors between the log's unit of measure and rad/s that are tried: rad/s, °/s and rad/s for each other, hours for seconds,
/// and what lies between.
const SCALES: [f64; 11] =
    [1.0, 0.5, 2.0, 0.2, 5.0, 0.1, 10.0, PI / 180.0, 180.0 / PI, 1.0 / 3600.0, PI / 648_000.0];
/// Turns that starts are compared by.
const TURNS: usize = 16;
/// Starts that are searched from.
const TRIED: usize = 6;

/// Where a search begins: parameters are relative to it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Start {
    /// Case axis that each gyro lies along.
    pub(super) along: [usize; 3],
    /// K of each gyro.
    pub(super) weight: [f64; 3],
}

impl Default for Start {
    fn default() -> Self {
        Self { along: [0, 1, 2], weight: [1.0; 3] }
    }
}

impl Start {
    /// K of each gyro: the first three parameters are its relative change.
    pub(super) fn weights(&self, p: &[f64]) -> [f64; 3] {
        [0, 1, 2].map(|i| self.weight[i] * (1.0 + p.get(i).copied().unwrap_or(0.0)))
    }

    /// Input axes: each turned by two small angles from the case axis that it lies along.
    pub(super) fn rows(&self, p: &[f64]) -> [[f64; 3]; 3] {
        let angle = |i: usize| p.get(3 + i).copied().unwrap_or(0.0);
        [0, 1, 2].map(|gyro| {
            let mut row = [1.0; 3];
            for (which, axis) in others(self.along[gyro]).into_iter().enumerate() {
                row[axis] = angle(2 * gyro + which);
            }
            unit(row)
        })
    }

    /// Rate about the case axes per output of each gyro.
    pub(super) fn inverse_of(&self, p: &[f64]) -> Matrix3<f64> {
        let rows = self.rows(p);
        let axes = Matrix3::from_fn(|i, j| rows[i][j]);
        let scale = Matrix3::from_diagonal(&self.weights(p).into());
        axes.try_inverse().unwrap_or_else(Matrix3::identity) * scale
    }
}

/// The starts that follow the turns best as they are, the best first.
pub(super) fn likely(track: &Track, rest: [f64; 3], transitions: &[Transition]) -> Vec<Start> {
    let turns = transitions.get(..TURNS).unwrap_or(transitions);
    let missed = |start: &Start| -> f64 {
        let inverse = start.inverse_of(&[]);
        let of = |turn: &Transition| {
            let (found, [_, wanted]) = (turned(track, rest, &inverse, turn), turn.directions);
            (0..3).map(|axis| (found[axis] - wanted[axis]).powi(2)).sum::<f64>()
        };
        turns.iter().map(of).sum()
    };
    let mut all = Vec::new();
    for along in std::iter::once(AS_LOGGED).chain(ORDERS) {
        for scale in SCALES {
            for signs in 0..8_u8 {
                let weight = [0, 1, 2].map(|gyro| if signs >> gyro & 1 == 1 { -scale } else { scale });
                let start = Start { along, weight };
                all.push((missed(&start), start));
            }
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.into_iter().take(TRIED).map(|(_, start)| start).collect()
}
