//! The bare relay: the same Zenoh configuration as the service, and a callback that only puts what came in on the output key.

use isotherm_protocol::key::{self, RawStream, UnitId};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use super::{Plan, Ready, declare_keys, head, hear, open, say, unit_name};
use crate::chain::Subject;
use crate::error::Error;

/// Relays until stdin ends.
pub(crate) fn run(plan: &Plan) -> Result<(), Error> {
    let session = open(plan)?;
    let outputs = outputs(&session, plan)?;
    let of_unit = |unit: &UnitId| RawStream::ALL.map(|stream| key::raw(unit, stream));
    let _declared =
        (plan.subject == Subject::Keyed).then(|| declare_keys(&session, plan, of_unit)).transpose()?;
    let subscriber = session
        .declare_subscriber(key::ALL_RAW)
        .allowed_origin(Locality::Remote)
        .callback(move |sample| {
            let key = sample.key_expr().as_str();
            // The other topics come in and end here.
            if key.ends_with("/gyro")
                && let Some(output) = head::unit_of(key).and_then(|unit| outputs.get(unit))
            {
                // What cannot be put is missing at the sink.
                let _ = output.put(sample.payload().clone()).wait();
            }
        })
        .wait();
    let _subscriber = subscriber.map_err(Error::zenoh("relay"))?;
    // Last of all: where it answers, the subscription is known. The query ends where it is dropped.
    let answers = session.declare_queryable(key::ALL_STATUS).callback(drop).wait();
    let _answers = answers.map_err(Error::zenoh("relay"))?;
    say(&Ready { locators: isotherm_bus::locators(&session), metrics: None })?;
    while hear().is_some() {}
    Ok(())
}

/// One declared publisher for each unit, with the service's quality of service.
fn outputs(session: &Session, plan: &Plan) -> Result<Vec<zenoh::pubsub::Publisher<'static>>, Error> {
    let congestion =
        if plan.case.is_saturated() { CongestionControl::Block } else { CongestionControl::Drop };
    let declare = |unit| {
        session
            .declare_publisher(key::corrected(&unit_name(unit)?))
            .congestion_control(congestion)
            .priority(Priority::RealTime)
            .express(false)
            .wait()
            .map_err(Error::zenoh("relay"))
    };
    (0..plan.case.units).map(declare).collect()
}
