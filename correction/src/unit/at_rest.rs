//! A unit that its operator says is at rest: its own readings tell its drift.

use serde::{Deserialize, Serialize};

use crate::calibration::Calibration;
use crate::drift::{Reference, RestFeeder};
use crate::earth::Place;
use crate::observation::Observation;
use crate::rest::{Rest, RestLimits, RestMonitor};
use crate::sample::TickFlags;

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
        let moved = matches!(self.rest, Rest::Moved(_)) || seen.flags.contains(TickFlags::RESTART);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rest::fixture::{FORCE_M_PER_S2, Still, calibration};
    use crate::sample::OutputKind;

    #[test]
    fn a_unit_that_was_turned_while_its_producer_was_off_is_levelled_anew() {
        let place = Place::new(55.0, 30.0, None).unwrap();
        let mut at_rest = AtRest::new(&place, &calibration(OutputKind::Mean, 1.0, true));
        let mut still = Still::new(1);
        let (mut restarted, mut references) = (false, 0);
        while still.now_s() < 400.0 {
            let mut seen = still.tick();
            if still.now_s() < 100.0 {
                seen.specific_force = Some([2.0, 1.0, -9.55]);
            } else if !core::mem::replace(&mut restarted, true) {
                seen.flags |= TickFlags::RESTART;
            }
            let Some(reference) = at_rest.observe(&seen) else { continue };
            let expected = place.earth_rate_in_case(Some(FORCE_M_PER_S2)).unwrap();
            let off = reference.angular_rate.iter().zip(expected).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-9, "{reference:?}");
            references += 1;
        }
        assert!(references > 1, "{references}");
    }
}
