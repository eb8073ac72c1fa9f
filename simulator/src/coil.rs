//! Heat conduction through the layers of a fibre coil.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A wound coil as a heat conductor: a slab of equal layers, heated through its outer and inner face by the
/// housing. Layer 0 is the innermost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Slab {
    /// Layers of fibre (4…400).
    #[schemars(range(min = 4, max = 400))]
    pub layers: u32,
    /// Finite volumes per layer (1…16).
    #[schemars(range(min = 1, max = 16))]
    pub cells_per_layer: u32,
    /// Thickness of one layer (m, > 0).
    #[schemars(range(min = 1e-6, max = 10.0))]
    pub layer_thickness_m: f64,
    /// Thermal conductivity across the layers (W/(m·K), > 0).
    #[schemars(range(min = 1e-12, max = 1e12))]
    pub conductivity_w_per_m_k: f64,
    /// Heat capacity by volume (J/(m³·K), > 0).
    #[schemars(range(min = 1e-12, max = 1e12))]
    pub heat_capacity_j_per_m3_k: f64,
    /// Conductance from the housing to the outer face (W/(m²·K), ≥ 0; 0 insulates).
    #[schemars(range(min = 0.0, max = 1e12))]
    pub outer_contact_w_per_m2_k: f64,
    /// Conductance from the housing to the inner face (W/(m²·K), ≥ 0; 0 insulates).
    #[schemars(range(min = 0.0, max = 1e12))]
    pub inner_contact_w_per_m2_k: f64,
}

/// Temperatures in a slab, stepped by the Crank–Nicolson scheme (second order in space and time, stable at
/// any step).
#[derive(Debug, Clone)]
pub(crate) struct Conduction {
    cells_per_layer: usize,
    deg_c: Vec<f64>,
    /// Exchange between neighbouring cells, per cell heat capacity (1/s).
    exchange_per_s: f64,
    inner_per_s: f64,
    outer_per_s: f64,
    step_s: f64,
    /// Forward elimination of the constant matrix: multiplier and pivot of each row.
    eliminated: Vec<(f64, f64)>,
    right: Vec<f64>,
}

impl Conduction {
    pub(crate) fn new(slab: &Slab, step_s: f64, initial_deg_c: f64) -> Self {
        let cells_per_layer = slab.cells_per_layer.max(1);
        let width_m = slab.layer_thickness_m / f64::from(cells_per_layer);
        let capacity = slab.heat_capacity_j_per_m3_k * width_m;
        let to_face = |contact: f64| {
            let half_cell = 0.5 * width_m / slab.conductivity_w_per_m_k;
            if contact > 0.0 { 1.0 / (1.0 / contact + half_cell) / capacity } else { 0.0 }
        };
        let cells = slab.layers.max(1) as usize * cells_per_layer as usize;
        let mut conduction = Self {
            cells_per_layer: cells_per_layer as usize,
            deg_c: vec![initial_deg_c; cells],
            exchange_per_s: slab.conductivity_w_per_m_k / width_m / capacity,
            inner_per_s: to_face(slab.inner_contact_w_per_m2_k),
            outer_per_s: to_face(slab.outer_contact_w_per_m2_k),
            step_s,
            eliminated: Vec::with_capacity(cells),
            right: vec![0.0; cells],
        };
        conduction.eliminate();
        conduction
    }

    /// Factors I − (h/2)·A, which never changes.
    fn eliminate(&mut self) {
        let half = 0.5 * self.step_s;
        let side = -half * self.exchange_per_s;
        let mut pivot = f64::INFINITY;
        for cell in 0..self.deg_c.len() {
            let multiplier = if cell == 0 { 0.0 } else { side / pivot };
            pivot = 1.0 + half * self.losses_per_s(cell) - multiplier * side;
            self.eliminated.push((multiplier, pivot));
        }
    }

    /// −A on its diagonal.
    fn losses_per_s(&self, cell: usize) -> f64 {
        let inward = if cell == 0 { self.inner_per_s } else { self.exchange_per_s };
        let outward = if cell + 1 == self.deg_c.len() { self.outer_per_s } else { self.exchange_per_s };
        inward + outward
    }

    /// Ṫ of a cell (K/s) with the housing at a temperature.
    fn rate_k_per_s(&self, cell: usize, housing_deg_c: f64) -> f64 {
        let here = self.deg_c[cell];
        let inward = match cell.checked_sub(1) {
            None => self.inner_per_s * (housing_deg_c - here),
            Some(inner) => self.exchange_per_s * (self.deg_c[inner] - here),
        };
        let outward = match self.deg_c.get(cell + 1) {
            None => self.outer_per_s * (housing_deg_c - here),
            Some(outer) => self.exchange_per_s * (outer - here),
        };
        inward + outward
    }

    /// Advances one step over which the housing goes from one temperature to another.
    pub(crate) fn step(&mut self, from_deg_c: f64, to_deg_c: f64) {
        let half = 0.5 * self.step_s;
        let last = self.deg_c.len() - 1;
        for cell in 0..=last {
            self.right[cell] = self.deg_c[cell] + half * self.rate_k_per_s(cell, from_deg_c);
        }
        self.right[0] += half * self.inner_per_s * to_deg_c;
        self.right[last] += half * self.outer_per_s * to_deg_c;
        for cell in 1..=last {
            self.right[cell] -= self.eliminated[cell].0 * self.right[cell - 1];
        }
        let side = -half * self.exchange_per_s;
        self.deg_c[last] = self.right[last] / self.eliminated[last].1;
        for cell in (0..last).rev() {
            self.deg_c[cell] = (self.right[cell] - side * self.deg_c[cell + 1]) / self.eliminated[cell].1;
        }
    }

    /// Mean temperature (°C) and mean Ṫ (K/s) of each layer, innermost first.
    pub(crate) fn layers(&self, housing_deg_c: f64) -> impl Iterator<Item = (f64, f64)> {
        #[expect(clippy::cast_precision_loss, reason = "at most 16 cells per layer")]
        let share = 1.0 / self.cells_per_layer as f64;
        self.deg_c.chunks_exact(self.cells_per_layer).enumerate().map(move |(layer, cells)| {
            let first = layer * self.cells_per_layer;
            let rates = (first..first + cells.len()).map(|cell| self.rate_k_per_s(cell, housing_deg_c));
            (cells.iter().sum::<f64>() * share, rates.sum::<f64>() * share)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    const SLAB: Slab = Slab {
        layers: 32,
        cells_per_layer: 2,
        layer_thickness_m: 2.5e-4,
        conductivity_w_per_m_k: 0.4,
        heat_capacity_j_per_m3_k: 2.0e6,
        outer_contact_w_per_m2_k: 1e12,
        inner_contact_w_per_m2_k: 0.0,
    };

    /// Fourier series of a slab that is insulated inside and takes a unit step outside.
    fn fourier(depth: f64, fourier_number: f64) -> f64 {
        let terms = (0..200).map(|n| {
            let odd = 2.0 * f64::from(n) + 1.0;
            let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
            let root = 0.5 * odd * PI;
            sign * 2.0 / root * libm::cos(root * depth) * libm::exp(-root * root * fourier_number)
        });
        1.0 - terms.sum::<f64>()
    }

    #[test]
    fn a_step_enters_the_slab_as_the_fourier_series_says() {
        let mut conduction = Conduction::new(&SLAB, 0.25, 0.0);
        let thickness_m = 32.0 * SLAB.layer_thickness_m;
        let diffusivity = SLAB.conductivity_w_per_m_k / SLAB.heat_capacity_j_per_m3_k;
        let mut steps = 0.0;
        for checkpoint_s in [20.0, 80.0, 320.0] {
            while steps * 0.25 < checkpoint_s {
                conduction.step(1.0, 1.0);
                steps += 1.0;
            }
            let number = diffusivity * checkpoint_s / (thickness_m * thickness_m);
            for (layer, (deg_c, _)) in conduction.layers(1.0).enumerate() {
                #[expect(clippy::cast_precision_loss, reason = "32 layers")]
                let depth = (layer as f64 + 0.5) / 32.0;
                let expected = fourier(depth, number);
                assert!(
                    (deg_c - expected).abs() < 1e-3,
                    "{checkpoint_s} s, layer {layer}: {deg_c} {expected}"
                );
            }
        }
    }

    #[test]
    fn on_a_ramp_every_layer_ends_up_with_the_rate_of_the_housing() {
        let slab = Slab { outer_contact_w_per_m2_k: 60.0, inner_contact_w_per_m2_k: 15.0, ..SLAB };
        let mut conduction = Conduction::new(&slab, 0.5, 20.0);
        let (mut housing, slope) = (20.0, 1.0 / 60.0);
        for _ in 0..20_000 {
            conduction.step(housing, housing + 0.5 * slope);
            housing += 0.5 * slope;
        }
        for (deg_c, rate) in conduction.layers(housing) {
            assert!((rate - slope).abs() < 1e-9 && deg_c < housing);
        }
    }
}
