//! Queries and puts from the bus, and their replies.

use isotherm_protocol::control::{SwapOptions, SwapReply};
use isotherm_protocol::history::Source;
use isotherm_protocol::key::{self, UnitId};
use serde::Serialize;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::key_expr::keyexpr;
use zenoh::query::Query;
use zenoh::sample::{Sample, SampleKind};

use super::command::read_order;
use super::order::Order;
use super::work::Work;

/// Entries of a history where nothing else is asked for.
const HISTORY_ENTRIES: usize = 20;

impl Work {
    /// A query on `imu/*/calibration`: with a document it is a swap, without one it asks for the active document.
    pub(super) fn answer_calibration(&mut self, query: &Query) {
        let Some(payload) = query.payload() else {
            self.tell_documents(query);
            return;
        };
        let asked = one_unit(query, key::parse_calibration).and_then(|unit| {
            Ok((unit, SwapOptions::parse(query.parameters().as_str()).map_err(|e| e.to_string())?))
        });
        match asked {
            // The instance that speaks answers.
            Ok((unit, _)) if !self.intake.answers_for(&unit) => {}
            Ok((unit, options)) => {
                let reply = self.bus_swap(&unit, &payload.to_bytes(), options);
                answer_json(query, &key::calibration(&unit), &reply);
            }
            Err(words) => refuse(query, &words),
        }
    }

    /// A put on `imu/*/calibration`: a swap whose options stand in the attachment.
    pub(super) fn take_put(&mut self, sample: &Sample) {
        let key = sample.key_expr().as_str();
        if sample.kind() != SampleKind::Put {
            tracing::warn!("{key}: a deletion means nothing here");
            return;
        }
        let Some(unit) = key::parse_calibration(key).and_then(|serial| UnitId::new(serial).ok()) else {
            tracing::warn!("{key} names no unit: the document is passed over");
            return;
        };
        if !self.intake.answers_for(&unit) {
            return;
        }
        let attachment = sample.attachment().map(|bytes| bytes.to_bytes().into_owned()).unwrap_or_default();
        let options = String::from_utf8(attachment).map_err(|error| error.to_string());
        let options = options.and_then(|text| SwapOptions::parse(&text).map_err(|error| error.to_string()));
        match options {
            Ok(options) => drop(self.bus_swap(&unit, &sample.payload().to_bytes(), options)),
            Err(words) => tracing::warn!(%unit, "a document is passed over: attachment: {words}"),
        }
    }

    fn bus_swap(&mut self, unit: &UnitId, bytes: &[u8], options: SwapOptions) -> SwapReply {
        let name = key::calibration(unit);
        self.swap(&Order {
            unit: Some(unit.clone()),
            bytes,
            name: &name,
            source: Source::Bus,
            overlay: None,
            read: None,
            options,
        })
    }

    /// Replies with the text of what was accepted last for every unit that the query takes in.
    fn tell_documents(&self, query: &Query) {
        let mut told = false;
        for (unit, record) in &self.records {
            let key = key::calibration(unit);
            if !is_asked(query, &key) || !self.intake.speaks_for(unit) {
                continue;
            }
            if let Some(written) = record.written() {
                answer(query, &key, written.text.read().into_bytes(), Encoding::TEXT_PLAIN);
                told = true;
            }
        }
        if !told
            && let Ok(unit) = one_unit(query, key::parse_calibration)
            && self.intake.speaks_for(&unit)
        {
            refuse(query, &format!("unit {unit} has no calibration document"));
        }
    }

    /// A query on `imu/*/command`.
    pub(super) fn answer_command(&mut self, query: &Query) {
        let payload = query.payload().map(|bytes| bytes.to_bytes().into_owned()).unwrap_or_default();
        let asked = one_unit(query, key::parse_command).and_then(|unit| Ok((unit, read_order(&payload)?)));
        match asked {
            Ok((unit, _)) if !self.intake.answers_for(&unit) => {}
            Ok((unit, order)) => match self.command(&unit, &order) {
                Some(reply) => answer_json(query, &key::command(&unit), &reply),
                None => refuse(query, &format!("unit {unit} has not appeared: nothing was received of it")),
            },
            Err(words) => refuse(query, &words),
        }
    }

    /// A query on `imu/*/history`.
    pub(super) fn answer_history(&self, query: &Query) {
        let limit = match limit(query.parameters().as_str()) {
            Ok(limit) => limit,
            Err(words) => return refuse(query, &words),
        };
        let one = one_unit(query, key::parse_history).ok();
        let units = one.map_or_else(|| self.records.keys().cloned().collect(), |unit| vec![unit]);
        for unit in units {
            let key = key::history(&unit);
            if !is_asked(query, &key) || !self.intake.speaks_for(&unit) {
                continue;
            }
            match self.store.history(Some(&unit), limit) {
                Ok(entries) => answer_json(query, &key, &entries),
                Err(error) => refuse(query, &format!("the history cannot be read: {error}")),
            }
        }
    }
}

/// The unit that a query is for.
fn one_unit(query: &Query, parse: fn(&str) -> Option<&str>) -> Result<UnitId, String> {
    let key = query.key_expr().as_str();
    let serial = parse(key).ok_or_else(|| format!("{key} is not the key of a unit"))?;
    UnitId::new(serial).map_err(|error| format!("serial {serial:?} {error}: name one unit"))
}

/// Whether a query takes a key in.
fn is_asked(query: &Query, key: &str) -> bool {
    keyexpr::new(key).is_ok_and(|key| query.key_expr().intersects(key))
}

fn answer_json(query: &Query, key: &str, reply: &impl Serialize) {
    match serde_json::to_vec(reply) {
        Ok(json) => answer(query, key, json, Encoding::APPLICATION_JSON),
        Err(error) => refuse(query, &format!("the reply cannot be written: {error}")),
    }
}

pub(super) fn answer(query: &Query, key: &str, bytes: Vec<u8>, encoding: Encoding) {
    if let Err(error) = query.reply(key, bytes).encoding(encoding).wait() {
        tracing::warn!("cannot answer on {key}: {}", isotherm_bus::words(&error));
    }
}

fn refuse(query: &Query, words: &str) {
    tracing::warn!("{}: {words}", query.key_expr());
    if let Err(error) = query.reply_err(words).encoding(Encoding::TEXT_PLAIN).wait() {
        tracing::warn!("cannot answer on {}: {}", query.key_expr(), isotherm_bus::words(&error));
    }
}

/// Reads `limit=20`.
fn limit(parameters: &str) -> Result<usize, String> {
    let mut limit = HISTORY_ENTRIES;
    for parameter in parameters.split(';').filter(|parameter| !parameter.is_empty()) {
        let value = parameter.strip_prefix("limit=").and_then(|value| value.parse().ok()).filter(|n| *n > 0);
        limit = value
            .ok_or_else(|| format!("parameter {parameter:?} must be limit=N, N a whole number from 1"))?;
    }
    Ok(limit)
}
