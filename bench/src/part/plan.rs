//! What the parts of a chain are to do.

use std::fs;
use std::path::PathBuf;

use isotherm_protocol::key::UnitId;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::chain::{Case, Subject};
use crate::error::Error;

/// A plan of one round, the same for all its parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    /// The load.
    pub(crate) case: Case,
    /// What stands in the middle.
    pub(crate) subject: Subject,
    /// Messages of each unit, of its gyros and of its accelerometers.
    pub(crate) messages: usize,
    /// The first of these, which go out before the clock runs: units appear with them, and a first tick waits for an earlier one.
    pub(crate) prelude: usize,
    /// Where the middle listens, once it does: two addresses where a standby is beside it.
    pub(crate) connect: Vec<String>,
    /// Where results are left.
    pub(crate) folder: PathBuf,
    /// Ticks of each unit of which the sink keeps everything.
    pub(crate) keep: usize,
}

impl Plan {
    /// Ticks of each unit.
    pub(crate) fn ticks(&self) -> usize {
        self.messages * self.case.batch
    }

    /// Leaves a result in the folder.
    pub(crate) fn save(&self, name: &str, result: &impl Serialize) -> Result<(), Error> {
        let bytes = postcard::to_allocvec(result).map_err(Error::of("plan"))?;
        let path = self.folder.join(name);
        fs::write(&path, bytes).map_err(|source| Error::file(&path, source))
    }

    /// Reads one back.
    pub(crate) fn load<T: DeserializeOwned>(&self, name: &str) -> Result<T, Error> {
        let path = self.folder.join(name);
        let bytes = fs::read(&path).map_err(|source| Error::file(&path, source))?;
        postcard::from_bytes(&bytes).map_err(|error| Error::invalid(&path, error))
    }
}

/// Serial of a unit of the bench, whose number can be read back from a key.
pub(crate) fn unit_name(unit: usize) -> Result<UnitId, Error> {
    UnitId::new(&format!("BENCH-{unit:05}")).map_err(Error::of("plan"))
}
