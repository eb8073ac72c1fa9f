//! Publishers of the statuses, and the liveliness tokens of units.

use std::collections::HashMap;

use isotherm_protocol::codec;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

/// Where statuses go.
pub(super) struct Outlets {
    session: Session,
    /// A unit that has a status is alive for as long as its token.
    units: HashMap<UnitId, (Publisher<'static>, LivelinessToken)>,
    service: Option<Publisher<'static>>,
}

impl Outlets {
    pub(super) fn new(session: Session) -> Self {
        Self { session, units: HashMap::new(), service: None }
    }

    /// Publishes a unit's status; with its first one the unit is alive.
    pub(super) fn unit(&mut self, unit: &UnitId, status: &Status) -> Result<(), zenoh::Error> {
        if !self.units.contains_key(unit) {
            let publisher = publisher(&self.session, key::status(unit))?;
            let alive = self.session.liveliness().declare_token(key::unit_alive(unit)).wait()?;
            self.units.insert(unit.clone(), (publisher, alive));
        }
        let Some((publisher, _)) = self.units.get(unit) else { return Ok(()) };
        publisher.put(codec::encode(status)?).wait()
    }

    /// Gives up the topics of the units that are not there any more, and the tokens of their life with them.
    pub(super) fn keep(&mut self, is_there: impl Fn(&UnitId) -> bool) {
        self.units.retain(|unit, _| is_there(unit));
    }

    /// Publishes the service's own status.
    pub(super) fn service(&mut self, status: &ServiceStatus) -> Result<(), zenoh::Error> {
        if self.service.is_none() {
            self.service = Some(publisher(&self.session, key::service_status(&status.instance))?);
        }
        let Some(publisher) = &self.service else { return Ok(()) };
        publisher.put(codec::encode(status)?).wait()
    }
}

fn publisher(session: &Session, key: String) -> Result<Publisher<'static>, zenoh::Error> {
    session
        .declare_publisher(key)
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::DataLow)
        .wait()
}
