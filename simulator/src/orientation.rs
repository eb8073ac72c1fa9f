//! Directions of the sensors' input axes in the case, and how temperature turns them.

use isotherm_correction::sample::Sensors;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::vector::{Vector, cross, dot, norm, plus, scale};

/// Input axes of the sensors of one kind: s = C(T)·v, C(T) = C0 + C1·(T − T₀), T that of the housing.
///
/// An axis is a direction, so every row is given unit length again at each temperature. A corrector that takes
/// the linear matrix as it stands differs from that by at most ½·|C1·(T − T₀)|² per row, relative. The presets keep it below
/// 1e-9.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Orientation {
    /// Reference temperature T₀ (°C).
    #[schemars(range(min = -100.0, max = 200.0))]
    pub reference_deg_c: f64,
    /// C0: one unit row per sensor, 3…8 of them.
    pub rows: Vec<[f64; 3]>,
    /// C1: one row per sensor (1/K), at right angles to that of C0; empty for axes that do not turn.
    #[serde(default)]
    #[schemars(inner(inner(range(min = -1e-3, max = 1e-3))))]
    pub rows_per_k: Vec<[f64; 3]>,
}

impl Orientation {
    /// Three sensors along the case axes.
    #[must_use]
    pub fn orthogonal() -> Self {
        Self::fixed(vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    }

    /// Axes that temperature does not turn; each is given unit length.
    #[must_use]
    pub fn fixed(rows: Vec<[f64; 3]>) -> Self {
        let rows = rows.into_iter().map(crate::vector::unit).collect();
        Self { reference_deg_c: 20.0, rows, rows_per_k: Vec::new() }
    }

    /// Six sensors along the axes of a regular dodecahedron: each pair encloses the same angle (63.4°), and
    /// any three of them resolve all directions.
    #[must_use]
    pub fn dodecahedron() -> Self {
        let (s, c) = (0.525_731_112_119_133_6, 0.850_650_808_352_039_9);
        Self::fixed(vec![[s, 0.0, c], [-s, 0.0, c], [c, s, 0.0], [c, -s, 0.0], [0.0, c, s], [0.0, c, -s]])
    }

    /// The same axes, turned by misalignments (rad) and by temperature (rad/K): one small rotation vector each
    /// per sensor, in case axes.
    #[must_use]
    pub fn tilted(mut self, by_rad: &[[f64; 3]], by_rad_per_k: &[[f64; 3]]) -> Self {
        let turned =
            self.rows.iter().zip(by_rad).map(|(&row, &by)| crate::vector::unit(plus(row, cross(by, row))));
        self.rows = turned.collect();
        self.rows_per_k = self.rows.iter().zip(by_rad_per_k).map(|(&row, &by)| cross(by, row)).collect();
        self
    }

    /// Projections of a vector in case axes on the input axes at a housing temperature.
    #[must_use]
    pub fn project(&self, v: [f64; 3], housing_deg_c: f64) -> Sensors<f64> {
        self.axes(housing_deg_c).iter().map(|&axis| dot(axis, v)).collect()
    }

    /// Input axes at a housing temperature, as unit vectors; rows beyond the eighth are left out.
    pub(crate) fn axes(&self, housing_deg_c: f64) -> Sensors<Vector> {
        let away_k = housing_deg_c - self.reference_deg_c;
        let at_reference = self.rows.iter().copied().take(isotherm_correction::sample::MAX_SENSORS);
        if self.rows_per_k.is_empty() {
            return at_reference.collect();
        }
        let turned = at_reference.zip(&self.rows_per_k).map(|(row, &per_k)| {
            let row = plus(row, scale(per_k, away_k));
            scale(row, 1.0 / norm(row))
        });
        turned.collect()
    }

    /// Determinant of Cᵀ·C at the reference temperature: zero where the axes lie in one plane.
    pub(crate) fn spread(&self) -> f64 {
        let column = |a: usize, b: usize| self.rows.iter().map(|row| row[a] * row[b]).sum::<f64>();
        let rows = [0, 1, 2].map(|a| [0, 1, 2].map(|b| column(a, b)));
        dot(rows[0], cross(rows[1], rows[2]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stay_unit_vectors_while_temperature_turns_them() {
        let tilts = [[1e-3, 2e-3, 0.0], [0.0, -1e-3, 1e-3], [5e-4, 0.0, 0.0]];
        let per_k = [[3e-6, 0.0, 1e-6], [0.0, 0.0, 4e-6], [0.0, 2e-6, 0.0]];
        let orientation = Orientation::orthogonal().tilted(&tilts, &per_k);
        for deg_c in [-40.0, 20.0, 85.0] {
            for axis in orientation.axes(deg_c) {
                assert!((norm(axis) - 1.0).abs() < 1e-15);
            }
        }
        let turn = dot(orientation.axes(70.0)[1], orientation.axes(20.0)[0])
            - dot(orientation.axes(20.0)[1], orientation.axes(20.0)[0]);
        assert!((turn + 50.0 * 4e-6).abs() < 1e-6, "{turn}");
    }

    #[test]
    fn the_dodecahedron_spreads_its_axes_evenly() {
        let orientation = Orientation::dodecahedron();
        assert!((orientation.spread() - 8.0).abs() < 1e-12, "Cᵀ·C is twice the unit matrix");
        for (index, &a) in orientation.rows.iter().enumerate() {
            for &b in orientation.rows.iter().skip(index + 1) {
                assert!((dot(a, b).abs() - 1.0 / libm::sqrt(5.0)).abs() < 1e-12);
            }
        }
    }
}
