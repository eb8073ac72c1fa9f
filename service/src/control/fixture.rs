//! A swap manager for tests.

use std::sync::Arc;

use super::manager::Worker;
use super::revision::Calibrations;
use super::store::Store;
use crate::config::Settings;
use crate::receive::intake::Intake;

/// One that knows nothing, of units that have not appeared.
pub(super) fn worker() -> Worker {
    let settings = Settings::default();
    let outlets = Box::new(|_: &_| Err("there is none".into()));
    let intake = Arc::new(Intake::new(settings.clone(), Calibrations::default(), outlets));
    Worker::new(&settings, intake, Store::in_memory(), Vec::new())
}
