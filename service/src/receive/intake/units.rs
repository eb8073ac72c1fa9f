//! The units that have appeared, and the outlets of those that may.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use isotherm_protocol::key::UnitId;

use super::lock;
use crate::receive::unit::{Outlet, UnitActor};

/// A unit, for whoever holds it at the moment.
pub(super) type Unit = Arc<Mutex<UnitActor>>;

/// Makes the outlet of a unit.
pub type OutletMaker = Box<dyn Fn(&UnitId) -> Result<Outlet, zenoh::Error> + Send + Sync>;

/// The units that have appeared.
#[derive(Debug, Default)]
pub(super) struct Units {
    // For messages: the key finds its unit without an allocation.
    pub(super) by_serial: HashMap<UnitId, Unit>,
    /// In the order of their serials, for those who look at all of them many times a second.
    in_order: Arc<Vec<(UnitId, Unit)>>,
}

impl Units {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.by_serial.len()
    }

    /// Takes one in.
    pub(super) fn insert(&mut self, id: UnitId, unit: &Unit) {
        let in_order = Arc::make_mut(&mut self.in_order);
        let place = in_order.partition_point(|(before, _)| *before < id);
        in_order.insert(place, (id.clone(), Arc::clone(unit)));
        self.by_serial.insert(id, Arc::clone(unit));
    }

    /// Takes one out.
    pub(super) fn remove(&mut self, id: &UnitId) -> Option<Unit> {
        Arc::make_mut(&mut self.in_order).retain(|(other, _)| other != id);
        self.by_serial.remove(id)
    }

    /// All of them as they are now, in the order of their serials.
    pub(super) fn in_order(&self) -> Arc<Vec<(UnitId, Unit)>> {
        Arc::clone(&self.in_order)
    }
}

/// Outlets of units that have not appeared.
///
/// To declare one costs Zenoh a look at the keys of every other unit: some milliseconds where there are thousands. That is too
/// long for a receive thread when all of them appear at once, and a session that is not read from for seconds is closed.
pub(super) struct Outlets {
    make: OutletMaker,
    made: Mutex<HashMap<UnitId, Outlet>>,
}

impl Outlets {
    pub(super) fn new(make: OutletMaker) -> Self {
        Self { make, made: Mutex::default() }
    }

    /// Makes one before its unit appears.
    pub(super) fn prepare(&self, unit: &UnitId) -> Result<(), zenoh::Error> {
        let outlet = (self.make)(unit)?;
        lock(&self.made).insert(unit.clone(), outlet);
        Ok(())
    }

    /// Gives up the outlet of a unit that is not to appear any more.
    pub(super) fn drop_prepared(&self, unit: &UnitId) {
        // Undeclared when it is no longer locked.
        let _gone = lock(&self.made).remove(unit);
    }

    /// The outlet of a unit that appears.
    pub(super) fn take(&self, unit: &UnitId) -> Result<Outlet, zenoh::Error> {
        let made = lock(&self.made).remove(unit);
        made.map_or_else(|| (self.make)(unit), Ok)
    }
}
