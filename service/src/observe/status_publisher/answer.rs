//! Answers to queries.

use std::time::Instant;

use isotherm_protocol::journal::split;
use isotherm_protocol::{codec, key};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::query::Query;

use super::{Asked, Work};
use crate::control::is_asked;
use crate::pair::ASKS;

impl Work {
    /// Replies with everything that the query's key takes in, of what is asked for.
    pub(super) fn answer(&self, asked: Asked, query: &Query) {
        match asked {
            Asked::Status => self.answer_status(query),
            Asked::Memory => self.answer_memory(query),
            Asked::Pair => {
                let key = key::pair(self.instance.id());
                if is_asked(query, &key) {
                    let report = serde_json::to_vec(&self.instance.pair.report(&self.instance.intake));
                    reply(query, &key, report.map_err(Into::into));
                }
            }
            Asked::Configuration => {
                let key = key::configuration(self.instance.id());
                if is_asked(query, &key) {
                    reply(query, &key, Ok(self.configuration.clone()));
                }
            }
        }
    }

    /// Replies with the status of units, and of the service itself.
    fn answer_status(&self, query: &Query) {
        let instance = self.instance.id();
        let statuses = self.instance.intake.each_unit(|actor| {
            let key = key::status(actor.id());
            (actor.speaks() && is_asked(query, &key)).then(|| (key, codec::encode(&actor.status(instance))))
        });
        let mut replies: Vec<_> = statuses.into_iter().flatten().collect();
        let key = key::service_status(instance);
        if is_asked(query, &key) {
            replies.push((key, codec::encode(&self.instance.status())));
        }
        for (key, frame) in replies {
            reply(query, &key, frame.map_err(Into::into));
        }
    }

    /// Replies with the memory of units, in parts; one unit behind the other, so that only one memory is there at a time.
    fn answer_memory(&self, query: &Query) {
        let instance = self.instance.id();
        let asks = query.parameters().get(ASKS);
        let standing = self.instance.pair.standing();
        let units = self.instance.intake.each_unit(|actor| {
            if !is_asked(query, &key::journal(actor.id())) {
                return None;
            }
            if let Some(asks) = asks {
                actor.is_asked_by(asks, Instant::now(), &standing);
            }
            actor.speaks().then(|| actor.id().clone())
        });
        for unit in units.into_iter().flatten() {
            // A unit that has just started anew is asked once more by whoever misses its answer.
            let Some(memory) = self.instance.intake.with(&unit, |actor| actor.memory(instance)) else {
                continue;
            };
            let key = key::journal(&unit);
            for part in split(&memory) {
                reply(query, &key, codec::encode(&part).map_err(Into::into));
            }
        }
    }
}

fn reply(query: &Query, key: &str, payload: Result<impl Into<ZBytes>, zenoh::Error>) {
    let sent = payload.and_then(|payload| query.reply(key, payload).wait());
    if let Err(error) = sent {
        tracing::warn!(key, "cannot answer a query: {}", isotherm_bus::words(&error));
    }
}
