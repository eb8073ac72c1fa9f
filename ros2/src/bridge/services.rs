//! Services of the node: standby, run and rollback of each unit.

use std::time::Duration;

use isotherm_bus::BusError;
use isotherm_bus::inquiry::{Unanswered, ask};
use isotherm_log::ros2::{from_cdr, to_cdr};
use isotherm_protocol::control::{CommandOrder, CommandReply, Order};
use isotherm_protocol::digest::Digits;
use isotherm_protocol::key::{self, UnitId};
use tokio::runtime::Handle;
use zenoh::Session;
use zenoh::bytes::ZBytes;
use zenoh::query::{Query, Queryable};

use super::{Declarer, publishing};
use crate::attachment::Attachment;
use crate::interface::{TRIGGER, TriggerRequest, TriggerResponse};
use crate::mapping::UnitMapping;
use crate::name::Kind;
use crate::qos::Qos;

/// How long a service of the project may take to answer: a rollback waits for a disk.
const ANSWER: Duration = Duration::from_secs(5);

/// The services of a unit by their names, and what each orders.
const SERVICES: [(&str, Order); 3] = [
    ("standby", Order::Standby),
    ("run", Order::Run { reversal: None }),
    ("rollback", Order::Rollback { revision: None, dry_run: false }),
];

/// Declares the services of a unit: `/isotherm/<unit>/standby` and so on.
pub(super) async fn declare(
    declarer: &mut Declarer,
    bus: &Session,
    mapping: &UnitMapping,
    name: &str,
) -> Result<Vec<Queryable<()>>, BusError> {
    let mut services = Vec::new();
    for (service, order) in SERVICES {
        let topic = declarer.node.private(&format!("{name}/{service}"));
        declarer.endpoint(Kind::Service, &topic, TRIGGER, Qos::SERVICES).await?;
        let key = declarer.key(&topic, TRIGGER);
        let (bus, unit, runtime) = (bus.clone(), mapping.unit.clone(), Handle::current());
        let answer = move |query: Query| {
            // The service may take its time, the receive thread may not.
            runtime.spawn(answer(query, service, order.clone(), bus.clone(), unit.clone()));
        };
        // Clients ask all that are complete.
        let queryable = declarer.session.declare_queryable(&key).complete(true).callback(answer);
        services.push(queryable.await.map_err(|source| BusError::Declare { key, source })?);
    }
    Ok(services)
}

async fn answer(query: Query, service: &str, order: Order, bus: Session, unit: UnitId) {
    let request = Attachment::parse(query.attachment().map(ZBytes::to_bytes).as_deref());
    let payload = query.payload().map(ZBytes::to_bytes).unwrap_or_default();
    let asked = request.map_err(|error| error.to_string()).and_then(|request| {
        // Some leave out the byte of a message without fields, as hiroz 0.2 does.
        let decoded = from_cdr::<TriggerRequest>(&payload).map(drop).or_else(|_| from_cdr::<()>(&payload));
        decoded.map(|()| request).map_err(|error| error.to_string())
    });
    let request = match asked {
        Ok(request) => request,
        Err(reason) => {
            tracing::warn!(unit = unit.as_str(), service, "a request {reason}");
            let _ = query.reply_err(format!("the request {reason}")).await;
            return;
        }
    };
    let response = command(&bus, &unit, order, &request).await;
    let Ok(payload) = to_cdr(&response) else { return };
    // By number and client a client knows what is answered.
    let attachment = Attachment { time_ns: publishing::now_ns(), ..request };
    let key = query.key_expr().clone();
    if let Err(error) = query.reply(key, payload).attachment(attachment.to_bytes()).await {
        tracing::warn!(unit = unit.as_str(), service, "no answer: {}", isotherm_bus::words(&error));
    }
}

/// Gives the command; what came of it.
async fn command(bus: &Session, unit: &UnitId, order: Order, request: &Attachment) -> TriggerResponse {
    let order = CommandOrder { by: format!("ros2 {}", Digits(&request.gid)), order };
    let order = serde_json::to_vec(&order).unwrap_or_default();
    let failed = |message: String| TriggerResponse { success: false, message };
    let key = key::command(unit);
    let answers = match ask(bus, key.as_ref(), "", Some(&order), ANSWER).await {
        Ok(answers) => answers,
        Err(Unanswered::Bus(error)) => return failed(error.to_string()),
        Err(Unanswered::Silence) => return failed(format!("no service answered within {ANSWER:?}")),
        Err(Unanswered::Refused(words)) => return failed(words),
    };
    match answers.first().map(|answer| serde_json::from_slice::<CommandReply>(answer)) {
        Some(Ok(reply)) => TriggerResponse { success: reply.accepted, message: in_words(&reply) },
        Some(Err(error)) => failed(format!("the service's answer is invalid: {error}")),
        None => failed("the service went away before it answered".to_owned()),
    }
}

fn in_words(reply: &CommandReply) -> String {
    let CommandReply { unit, state, reason, swap, .. } = reply;
    let problems = swap.iter().flat_map(|swap| &swap.problems).map(ToString::to_string);
    let said: Vec<_> = reason.iter().cloned().chain(problems).collect();
    let state = state.name();
    if said.is_empty() { format!("{unit}: {state}") } else { format!("{unit}: {state}; {}", said.join("; ")) }
}
