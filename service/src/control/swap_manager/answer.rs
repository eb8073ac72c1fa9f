//! Queries and puts from the bus, and their replies.

use isotherm_protocol::control::{CommandOrder, SwapOptions, SwapReply};
use isotherm_protocol::history::Source;
use isotherm_protocol::key::{self, UnitId};
use serde::Serialize;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::key_expr::keyexpr;
use zenoh::query::Query;
use zenoh::sample::{Sample, SampleKind};

use super::inbox::Origin;
use super::order::Order;
use super::worker::Worker;

/// What stands before the name of a certificate in the audit file.
const CERTIFIED: &str = "CN=";
/// Entries of a history where nothing else is asked for.
const HISTORY_ENTRIES: usize = 20;

impl Worker {
    /// A query on `imu/*/calibration`: with a document it is a swap, without one it asks for the active document.
    pub(super) fn answer_calibration(&mut self, query: &Query, origin: Origin) {
        let Some(payload) = query.payload() else {
            self.tell_documents(query);
            return;
        };
        let asked = one_unit(query, key::parse_calibration).and_then(|unit| {
            let options = SwapOptions::parse(query.parameters().as_str()).map_err(|e| e.to_string())?;
            Ok((unit, self.with_asker(query.key_expr().as_str(), origin, options)?))
        });
        match asked {
            // The instance that speaks answers.
            Ok((unit, _)) if !self.intake.answers_for(&unit) => {}
            Ok((unit, options)) => {
                let reply = self.bus_swap(&unit, &payload.to_bytes(), options);
                answer_json(query, query.key_expr().as_str(), &reply);
            }
            Err(words) => refuse(query, &words),
        }
    }

    /// A put on `imu/*/calibration`: a swap whose options stand in the attachment.
    pub(super) fn take_put(&mut self, sample: &Sample) {
        let key = sample.key_expr().as_str();
        if sample.kind() != SampleKind::Put {
            tracing::warn!("{key}: a deletion has no effect");
            return;
        }
        let serial = key::parse_calibration(key::asker(key).0);
        let Some(unit) = serial.and_then(|serial| UnitId::new(serial).ok()) else {
            tracing::warn!("{key} names no unit: the document is ignored");
            return;
        };
        if !self.intake.answers_for(&unit) {
            return;
        }
        let attachment = sample.attachment().map(|bytes| bytes.to_bytes().into_owned()).unwrap_or_default();
        let options = String::from_utf8(attachment).map_err(|error| error.to_string());
        let options = options.and_then(|text| SwapOptions::parse(&text).map_err(|error| error.to_string()));
        let options = options.map_err(|words| format!("attachment: {words}"));
        match options.and_then(|options| self.with_asker(key, Origin::Bus, options)) {
            Ok(options) => drop(self.bus_swap(&unit, &sample.payload().to_bytes(), options)),
            Err(words) => tracing::warn!(%unit, "a document is ignored: {words}"),
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
        let asked = query.key_expr().as_str();
        for (unit, record) in &self.records {
            let key = key::calibration(unit);
            let is_named = key::asker(asked).0 == key;
            if !(is_named || is_asked(query, &key)) || !self.intake.speaks_for(unit) {
                continue;
            }
            if let Some(written) = record.written() {
                let key = if is_named { asked } else { &*key };
                answer(query, key, written.text.read().into_bytes(), Encoding::TEXT_PLAIN);
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

    /// The options of a swap with the name that is written down.
    fn with_asker(&self, key: &str, origin: Origin, options: SwapOptions) -> Result<SwapOptions, String> {
        Ok(SwapOptions { by: self.by(key, origin, options.by)?, ..options })
    }

    /// Who asks, for the audit file: `CN=` and the common name of the certificate where access control gives each one keys of its own,
    /// else as stated.
    fn by(&self, key: &str, origin: Origin, stated: String) -> Result<String, String> {
        match key::asker(key).1 {
            Some(name) if self.certified_names => Ok(format!("{CERTIFIED}{name}")),
            _ if stated.starts_with(CERTIFIED) => {
                Err(format!("by is {stated:?}: {CERTIFIED} is reserved for names of certificates"))
            }
            None if self.certified_names && origin == Origin::Bus => Err(format!(
                "the key must end with the name of your certificate, {key}/NAME (certified_names is set)"
            )),
            Some(name) => Ok(name.to_owned()),
            None => Ok(stated),
        }
    }

    /// A query on `imu/*/command`.
    pub(super) fn answer_command(&mut self, query: &Query, origin: Origin) {
        let payload = query.payload().map(|bytes| bytes.to_bytes().into_owned()).unwrap_or_default();
        let asked = one_unit(query, key::parse_command).and_then(|unit| {
            let order = CommandOrder::read(&payload)?;
            let by = self.by(query.key_expr().as_str(), origin, order.by)?;
            Ok((unit, CommandOrder { by, ..order }))
        });
        match asked {
            Ok((unit, _)) if !self.intake.answers_for(&unit) => {}
            Ok((unit, order)) => match self.command(&unit, &order) {
                Some(reply) => answer_json(query, query.key_expr().as_str(), &reply),
                None => refuse(query, &format!("unit {unit} has not appeared: nothing was received from it")),
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
    let (key, _) = key::asker(query.key_expr().as_str());
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
