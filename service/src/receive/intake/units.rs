//! The units that have appeared, and the outlets of those that may.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex};

use isotherm_protocol::key::UnitId;

use super::lock;
use crate::receive::unit::{Outlet, UnitActor};

/// A unit, for whoever holds it at the moment.
pub(super) type Unit = Arc<Mutex<UnitActor>>;

/// Makes the outlet of a unit.
pub type OutletMaker = Box<dyn Fn(&UnitId) -> Result<Outlet, zenoh::Error> + Send + Sync>;

/// The units that have appeared.
pub(super) type Units = BTreeMap<UnitId, Unit>;

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
