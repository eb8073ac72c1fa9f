//! Thermal clock of a unit: chamber, housing and board, stepped together.

use crate::chamber::Chamber;
use crate::instrument::Instrument;
use crate::thermal::{Interval, Node, NodeState};

/// Chamber, housing and board between two steps of the thermal clock.
#[derive(Debug, Clone)]
pub(crate) struct Surroundings {
    chamber: Chamber,
    step_s: f64,
    /// Number of the step at the end of the present interval.
    steps: f64,
    cold_start: bool,
    pub(crate) chamber_deg_c: Interval,
    pub(crate) housing: NodeState,
    pub(crate) board: NodeState,
}

impl Surroundings {
    pub(crate) fn new(chamber: Chamber, instrument: &Instrument) -> Self {
        let step_s = instrument.thermal_step_s;
        let warm = |node: Node| if instrument.cold_start { 0.0 } else { node.heating_deg_c };
        let start = chamber.deg_c(0.0);
        let housing = start + warm(instrument.housing);
        let board = housing + warm(instrument.board);
        Self {
            chamber,
            step_s,
            steps: 0.0,
            cold_start: instrument.cold_start,
            chamber_deg_c: Interval::constant(start),
            housing: NodeState::new(instrument.housing, step_s, housing),
            board: NodeState::new(instrument.board, step_s, board),
        }
    }

    /// Temperature at the start of a part behind the housing.
    pub(crate) fn initial_deg_c(&self, node: Node) -> f64 {
        self.housing.deg_c.from + if self.cold_start { 0.0 } else { node.heating_deg_c }
    }

    /// Makes one step where `time_s` lies beyond the present interval; gives the housing's temperature at its
    /// start and end.
    pub(crate) fn step_towards(&mut self, time_s: f64) -> Option<(f64, f64)> {
        if time_s <= self.steps * self.step_s {
            return None;
        }
        self.steps += 1.0;
        self.chamber_deg_c.advance(self.chamber.deg_c(self.steps * self.step_s));
        self.housing.step(self.chamber_deg_c.from, self.chamber_deg_c.to);
        let Interval { from, to } = self.housing.deg_c;
        self.board.step(from, to);
        Some((from, to))
    }

    /// Place of a time in the present interval: 0 at its start, 1 at its end.
    pub(crate) fn share(&self, time_s: f64) -> f64 {
        time_s / self.step_s - (self.steps - 1.0)
    }
}
