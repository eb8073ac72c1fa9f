//! A unit that its operator says is at rest: its own readings tell its drift.

use serde::{Deserialize, Serialize};

use crate::calibration::Calibration;
use crate::drift::{Reference, RestFeeder};
use crate::earth::Place;
use crate::observation::Observation;
use crate::rest::{Rest, RestLimits, RestMonitor};

/// Rest at a place.
#[derive(Debug, Serialize, Deserialize)]
pub struct AtRest {
    place: Place,
    monitor: RestMonitor,
    feeder: RestFeeder,
    rest: Rest,
    /// Sum of the specific force over the ticks at rest, and their number.
    force: [f64; 3],
    forces: f64,
}

impl AtRest {
    /// Begins to watch.
    pub(super) fn new(place: &Place, calibration: &Calibration) -> Self {
        Self {
            place: *place,
            monitor: RestMonitor::new(&RestLimits::default(), calibration),
            feeder: RestFeeder::default(),
            rest: Rest::Learning,
            force: [0.0; 3],
            forces: 0.0,
        }
    }

    /// Where it is.
    #[must_use]
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// Whether it stands still.
    #[must_use]
    pub fn rest(&self) -> Rest {
        self.rest
    }

    /// Takes one tick; a reference for each minute at rest.
    pub(super) fn observe(&mut self, seen: &Observation) -> Option<Reference> {
        self.rest = self.monitor.observe(seen);
        let moved = matches!(self.rest, Rest::Moved(_));
        match seen.specific_force {
            // It may stand differently now.
            _ if moved => (self.force, self.forces) = ([0.0; 3], 0.0),
            Some(force) => {
                self.force.iter_mut().zip(force).for_each(|(sum, force)| *sum += force);
                self.forces += 1.0;
            }
            None => {}
        }
        let mean = (self.forces > 0.0).then(|| self.force.map(|sum| sum / self.forces));
        let place = &self.place;
        self.feeder.reference((seen.end_time, seen.duration), self.rest == Rest::Still, || {
            place.earth_rate_in_case(mean).map(|rate| (rate, 0.0))
        })
    }
}
