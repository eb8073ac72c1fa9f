//! First-order thermal nodes: the parts of a unit follow the chamber with a lag.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One lumped part of a unit behind whatever surrounds it: Ṫ = (surroundings + heating − T)/τ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Node {
    /// Time constant τ (s, ≥ 0); zero follows at once.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub time_constant_s: f64,
    /// Steady temperature above the surroundings by the part's own power (°C).
    #[serde(default)]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub heating_deg_c: f64,
}

/// A node with its temperature, stepped at a fixed interval.
///
/// *Numerics*: exact for surroundings that change linearly over a step.
#[derive(Debug, Clone)]
pub(crate) struct NodeState {
    node: Node,
    step_s: f64,
    decay: f64,
    /// Its temperature over the present step (°C).
    pub(crate) deg_c: Interval,
}

impl NodeState {
    pub(crate) fn new(node: Node, step_s: f64, initial_deg_c: f64) -> Self {
        let decay = if node.time_constant_s > 0.0 { libm::exp(-step_s / node.time_constant_s) } else { 0.0 };
        Self { node, step_s, decay, deg_c: Interval::constant(initial_deg_c) }
    }

    /// Advances by one step over which the surroundings go from `from_deg_c` to `to_deg_c`.
    pub(crate) fn step(&mut self, from_deg_c: f64, to_deg_c: f64) {
        let lag_deg_c = (to_deg_c - from_deg_c) / self.step_s * self.node.time_constant_s;
        let heating = self.node.heating_deg_c;
        let left_deg_c = (self.deg_c.to - from_deg_c - heating + lag_deg_c) * self.decay;
        self.deg_c.advance(to_deg_c + heating - lag_deg_c + left_deg_c);
    }
}

/// A slow quantity between two steps of the thermal clock.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Interval {
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Interval {
    pub(crate) const fn constant(value: f64) -> Self {
        Self { from: value, to: value }
    }

    pub(crate) fn advance(&mut self, next: f64) {
        self.from = self.to;
        self.to = next;
    }

    /// Value at `share` of the interval, 0…1.
    pub(crate) fn at(self, share: f64) -> f64 {
        self.from + (self.to - self.from) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part without power of its own.
    const fn passive(time_constant_s: f64) -> Node {
        Node { time_constant_s, heating_deg_c: 0.0 }
    }

    #[test]
    fn a_ramp_is_followed_with_a_lag_of_one_time_constant() {
        let (rate, tau) = (1.0 / 60.0, 200.0);
        let mut node = NodeState::new(Node { time_constant_s: tau, heating_deg_c: 5.0 }, 0.5, 25.0);
        let mut around = 20.0;
        for _ in 0..8000 {
            node.step(around, around + rate * 0.5);
            around += rate * 0.5;
        }
        assert!((node.deg_c.to - (around + 5.0 - rate * tau)).abs() < 1e-7);
    }

    #[test]
    fn a_step_decays_exponentially_whatever_the_interval() {
        for step_s in [0.1, 1.0, 10.0] {
            let mut node = NodeState::new(passive(30.0), step_s, 0.0);
            let mut time_s = 0.0;
            while time_s < 59.95 {
                node.step(1.0, 1.0);
                time_s += step_s;
            }
            assert!((node.deg_c.to - (1.0 - libm::exp(-2.0))).abs() < 1e-9, "{step_s}");
        }
    }

    #[test]
    fn a_node_without_inertia_follows_at_once() {
        let mut node = NodeState::new(passive(0.0), 1.0, 0.0);
        node.step(3.0, 4.0);
        assert!((node.deg_c.to - 4.0).abs() < 1e-15);
    }
}
