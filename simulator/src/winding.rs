//! How a fibre lies in its coil, and what the Shupe effect makes of its layers' temperatures.

use core::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Order in which the two halves of the fibre are wound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Winding {
    /// Layers belong to the halves in the order A B B A, from the middle of the fibre inside to its ends outside.
    Quadrupole,
    /// Both halves share every layer: the ideal that real windings approach. It has no Shupe effect.
    Symmetric,
    /// One end inside, the other outside, as on a spool: the worst case.
    Spool,
}

/// Geometry and optics of the fibre in a coil.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fibre {
    /// Order of winding.
    pub winding: Winding,
    /// Turns in one layer (≥ 1).
    #[schemars(range(min = 1, max = 100_000))]
    pub turns_per_layer: u32,
    /// Radius of the innermost layer's inner side (m, > 0).
    #[schemars(range(min = 1e-6, max = 10.0))]
    pub inner_radius_m: f64,
    /// Distance from the middle of the wound fibre to the middle of the optical path (m): the trimming error
    /// of the fibre's ends.
    #[schemars(range(min = -1e3, max = 1e3))]
    pub midpoint_offset_m: f64,
    /// Refractive index n of the core (> 0).
    #[schemars(range(min = 1.0, max = 4.0))]
    pub refractive_index: f64,
    /// dn/dT + n·α (1/K) and its change with temperature (1/K²) from the gyro's reference temperature.
    #[schemars(inner(range(min = -1.0, max = 1.0)))]
    pub thermo_optic_per_k: [f64; 2],
}

/// Shupe integral Ω = n/(D·L)·∫(dn/dT + n·α)·Ṫ(z)·(L − 2z) dz, the integral taken layer by layer.
#[derive(Debug, Clone)]
pub(crate) struct Shupe {
    /// n/(D·L)·∫(L − 2z) dz over each layer (m⁰), innermost first.
    weights: Vec<f64>,
    thermo_optic_per_k: [f64; 2],
}

/// A share of a layer on one half of the fibre.
struct Piece {
    layer: usize,
    length_m: f64,
}

impl Shupe {
    pub(crate) fn new(fibre: &Fibre, layers: u32, layer_thickness_m: f64) -> Self {
        let radius_m = |layer: u32| fibre.inner_radius_m + (f64::from(layer) + 0.5) * layer_thickness_m;
        let turn_m = |layer: u32| 2.0 * PI * radius_m(layer) * f64::from(fibre.turns_per_layer);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for layer in 0..layers {
            let whole = Piece { layer: layer as usize, length_m: turn_m(layer) };
            match fibre.winding {
                Winding::Quadrupole if matches!(layer % 4, 0 | 3) => a.push(whole),
                Winding::Quadrupole | Winding::Spool => b.push(whole),
                Winding::Symmetric => {
                    let half_m = 0.5 * whole.length_m;
                    a.push(Piece { length_m: half_m, ..whole });
                    b.push(Piece { length_m: half_m, ..whole });
                }
            }
        }
        let half_m = |pieces: &[Piece]| pieces.iter().map(|piece| piece.length_m).sum::<f64>();
        let (length_m, start_m) = (half_m(&a) + half_m(&b), half_m(&a));
        let mean_diameter_m = radius_m(0) + radius_m(layers.saturating_sub(1));
        let factor = fibre.refractive_index / (mean_diameter_m * length_m);
        // ∫(L − 2(z − δ)) dz from z0 to z1 = (z1 − z0)·(L + 2δ − z0 − z1)
        let moment = |z0: f64, z1: f64| (z1 - z0) * (length_m + 2.0 * fibre.midpoint_offset_m - z0 - z1);
        let mut weights = vec![0.0; layers as usize];
        let (mut down_m, mut up_m) = (start_m, start_m);
        for piece in a {
            weights[piece.layer] += factor * moment(down_m - piece.length_m, down_m);
            down_m -= piece.length_m;
        }
        for piece in b {
            weights[piece.layer] += factor * moment(up_m, up_m + piece.length_m);
            up_m += piece.length_m;
        }
        Self { weights, thermo_optic_per_k: fibre.thermo_optic_per_k }
    }

    /// Apparent rate (rad/s) from each layer's distance from the reference temperature (K) and Ṫ (K/s).
    pub(crate) fn rad_per_s(&self, layers: impl Iterator<Item = (f64, f64)>) -> f64 {
        let [constant, slope] = self.thermo_optic_per_k;
        let terms = self.weights.iter().zip(layers);
        terms
            .map(|(weight, (away_k, rate_k_per_s))| weight * (constant + slope * away_k) * rate_k_per_s)
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIBRE: Fibre = Fibre {
        winding: Winding::Quadrupole,
        turns_per_layer: 100,
        inner_radius_m: 0.035,
        midpoint_offset_m: 0.0,
        refractive_index: 1.46,
        thermo_optic_per_k: [1.07e-5, 0.0],
    };

    fn deg_per_h(fibre: Fibre, rate: impl Fn(f64) -> f64) -> f64 {
        let layers = (0..32).map(|layer| (0.0, rate((f64::from(layer) + 0.5) / 32.0)));
        Shupe::new(&fibre, 32, 2.5e-4).rad_per_s(layers).to_degrees() * 3600.0
    }

    #[test]
    fn symmetric_winding_cancels_whatever_the_layers_do() {
        let symmetric = Fibre { winding: Winding::Symmetric, ..FIBRE };
        assert!(deg_per_h(symmetric, |depth| 0.02 * depth * depth).abs() < 1e-10);
        let spool = Fibre { winding: Winding::Spool, ..FIBRE };
        let quadrupole = deg_per_h(FIBRE, |depth| 0.02 * depth).abs();
        assert!(quadrupole > 1e-3 && quadrupole * 50.0 < deg_per_h(spool, |depth| 0.02 * depth).abs());
    }

    #[test]
    fn a_uniform_rate_acts_only_through_the_midpoint_offset() {
        assert!(deg_per_h(FIBRE, |_| 0.02).abs() < 1e-9);
        let trimmed = Fibre { midpoint_offset_m: 0.5, ..FIBRE };
        // Ω = n·(dn/dT + n·α)·2δ·Ṫ/D for the mean diameter D = 2·(35 + 4) mm
        let expected = (1.46 * 1.07e-5 * 2.0 * 0.5 * 0.02 / 0.078_f64).to_degrees() * 3600.0;
        assert!((deg_per_h(trimmed, |_| 0.02) - expected).abs() < 1e-9);
    }
}
