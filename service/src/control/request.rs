//! A request: a swap as somebody asks for it; and queries and puts from the bus, with their replies.

use std::collections::BTreeSet;

use isotherm_protocol::control::{CommandOrder, SwapOptions, SwapReply};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::Source;
use isotherm_protocol::key::{self, UnitId};
use serde::Serialize;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::key_expr::keyexpr;
use zenoh::query::Query;
use zenoh::sample::{Sample, SampleKind};

use super::manager::Worker;
use super::queue::{Asked, Origin};
use crate::receive::intake::Answers;

/// What stands before the name of a certificate in the audit file.
const CERTIFIED: &str = "CN=";
/// Entries of a history where nothing else is asked for.
const HISTORY_ENTRIES: usize = 20;

/// What is asked for beside a document: whoever asks, by whatever way.
#[derive(Debug, Clone)]
pub(super) struct Request {
    /// Whom the document is for; `None` for whom it names.
    pub(super) unit: Option<UnitId>,
    /// What its problems are to call it.
    pub(super) name: String,
    /// Where it came from.
    pub(super) source: Source,
    /// Overlay that it was once made with; for a rollback to it.
    pub(super) overlay: Option<Digest>,
    /// What else was asked for.
    pub(super) options: SwapOptions,
}

impl Request {
    /// Whether a signature can be asked for: what the service has made itself has none.
    pub(super) fn needs_signature(&self) -> bool {
        !matches!(self.source, Source::PreLaunch)
    }

    /// Whether the text was judged when it was first accepted, or made by the service itself.
    pub(super) fn is_own(&self) -> bool {
        matches!(self.source, Source::Rollback { .. } | Source::PreLaunch)
    }
}

impl Worker {
    /// A query.
    pub(super) fn answer(&mut self, asked: Asked, query: &Query, origin: Origin) {
        let unit = one_unit(query.key_expr().as_str(), asked).ok();
        if let Some((words, is_left)) = unit.and_then(|unit| self.intake.is_not_taken(&unit)) {
            if !is_left {
                refuse(query, &words);
            }
            return;
        }
        let answered = match asked {
            Asked::Calibration if query.payload().is_none() => self.tell_documents(query),
            Asked::Calibration => self.answer_swap(query, origin),
            Asked::Command => self.answer_command(query, origin),
            Asked::History => self.answer_history(query),
            Asked::Kept => {
                self.answer_kept(query);
                Ok(())
            }
        };
        if let Err(words) = answered {
            refuse(query, &words);
        }
    }

    /// A query with a document on `imu/*/calibration`: a swap.
    fn answer_swap(&mut self, query: &Query, origin: Origin) -> Result<(), String> {
        let key = query.key_expr().as_str();
        let bytes = query.payload().map(|payload| payload.to_bytes()).unwrap_or_default();
        match self.bus_swap(key, origin, query.parameters().as_str(), &bytes)? {
            Some(reply) => reply_json(query, key, &reply),
            None => Ok(()),
        }
    }

    /// A put on `imu/*/calibration`: a swap whose options stand in the attachment.
    pub(super) fn take_put(&mut self, sample: &Sample) {
        let key = sample.key_expr().as_str();
        if sample.kind() != SampleKind::Put {
            tracing::warn!("{key}: a deletion has no effect");
            return;
        }
        let unit = one_unit(key, Asked::Calibration).ok();
        let swapped = match unit.and_then(|unit| self.intake.is_not_taken(&unit)) {
            Some((_, true)) => return,
            Some((words, false)) => Err(words),
            None => {
                let attachment = sample.attachment().map(|bytes| bytes.to_bytes()).unwrap_or_default();
                let options =
                    std::str::from_utf8(&attachment).map_err(|error| format!("attachment: {error}"));
                options.and_then(|options| {
                    self.bus_swap(key, Origin::Bus, options, &sample.payload().to_bytes())
                })
            }
        };
        if let Err(words) = swapped {
            tracing::warn!("{key}: a document is ignored: {words}");
        }
    }

    /// A swap with these options as text; `None` where another instance speaks for the unit: that one answers.
    fn bus_swap(
        &mut self,
        key: &str,
        origin: Origin,
        options: &str,
        bytes: &[u8],
    ) -> Result<Option<SwapReply>, String> {
        let unit = one_unit(key, Asked::Calibration)?;
        let options = SwapOptions::parse(options).map_err(|error| error.to_string())?;
        let options = SwapOptions { by: self.by(key, origin, options.by.clone())?, ..options };
        let name = key::calibration(&unit);
        Ok(self.is_ours(&unit)?.then(|| {
            let request = Request { unit: Some(unit), name, source: Source::Bus, overlay: None, options };
            self.swap(&request, bytes, None)
        }))
    }

    /// Replies with the text of what was accepted last for every unit that the query takes in.
    fn tell_documents(&self, query: &Query) -> Result<(), String> {
        let mut told = false;
        let asked = query.key_expr().as_str();
        for (unit, record) in &self.records {
            let key = key::calibration(unit);
            let is_named = key::asker(asked).0 == key;
            if !(is_named || is_asked(query, &key)) || !self.intake.speaks_for(unit) {
                continue;
            }
            if let Some(text) = record.document().and_then(|document| document.text.as_ref()) {
                let key = if is_named { asked } else { &*key };
                reply(query, key, text.read(), Encoding::TEXT_PLAIN);
                told = true;
            }
        }
        match one_unit(asked, Asked::Calibration) {
            Ok(unit) if !told && self.intake.speaks_for(&unit) => {
                Err(format!("unit {unit} has no calibration document"))
            }
            _ => Ok(()),
        }
    }

    /// Who asks, for the audit file: `CN=` and the common name of the certificate where access control gives each one keys of its own,
    /// else as stated.
    fn by(&self, key: &str, origin: Origin, stated: String) -> Result<String, String> {
        let by = match key::asker(key).1 {
            Some(name) if self.certified_names => return Ok(format!("{CERTIFIED}{name}")),
            Some(name) => name.to_owned(),
            None => stated,
        };
        if by.starts_with(CERTIFIED) {
            return Err(format!("by is {by:?}: {CERTIFIED} is reserved for names of certificates"));
        }
        if self.certified_names && origin == Origin::Bus {
            return Err(format!(
                "the key must end with the name of your certificate, {key}/NAME (certified_names is set)"
            ));
        }
        Ok(by)
    }

    /// A query on `imu/*/command`.
    fn answer_command(&mut self, query: &Query, origin: Origin) -> Result<(), String> {
        let key = query.key_expr().as_str();
        let unit = one_unit(key, Asked::Command)?;
        let payload = query.payload().map(|bytes| bytes.to_bytes().into_owned()).unwrap_or_default();
        let order = CommandOrder::read(&payload)?;
        let order = CommandOrder { by: self.by(key, origin, order.by)?, ..order };
        if self.is_ours(&unit)? {
            let reply = self.command(&unit, &order);
            let reply =
                reply.ok_or_else(|| format!("unit {unit} has not appeared: nothing was received from it"))?;
            reply_json(query, key, &reply)?;
        }
        Ok(())
    }

    /// Whether a swap or a command of a unit is for this instance to do.
    fn is_ours(&self, unit: &UnitId) -> Result<bool, String> {
        match self.intake.answers_for(unit) {
            Answers::Here => Ok(true),
            Answers::Elsewhere => Ok(false),
            Answers::Unknown => Err(format!(
                "unit {unit}: it is being found out which instance publishes it: nothing was done, try again"
            )),
        }
    }

    /// A query on `imu/*/history`. Of what is forgotten every instance knows: who speaks for it, nobody can say.
    fn answer_history(&self, query: &Query) -> Result<(), String> {
        let PartOfHistory { limit, after, instance } = PartOfHistory::parse(query.parameters().as_str())?;
        let is_this = instance.as_ref().map(|instance| instance == self.intake.instance());
        if is_this == Some(false) {
            return Ok(());
        }
        let forgotten: BTreeSet<_> =
            self.store.forgotten().filter(|unit| !self.records.contains_key(*unit)).collect();
        let one = one_unit(query.key_expr().as_str(), Asked::History).ok();
        let all = || self.records.keys().chain(forgotten.iter().copied()).cloned().collect();
        let units = one.map_or_else(all, |unit| vec![unit]);
        for unit in units {
            let key = key::history(&unit);
            let answers = is_this.is_some() || forgotten.contains(&unit) || self.intake.speaks_for(&unit);
            if is_asked(query, &key) && answers {
                let read = self.store.history_after(after, Some(&unit), limit);
                let told = read.map_err(|error| format!("the history cannot be read: {error}"));
                if let Err(words) = told.and_then(|entries| reply_json(query, &key, &entries)) {
                    refuse(query, &words);
                }
            }
        }
        Ok(())
    }
}

/// The unit that a key is for.
pub(super) fn one_unit(key: &str, asked: Asked) -> Result<UnitId, String> {
    let (key, _) = key::asker(key);
    let serial = asked.serial(key).ok_or_else(|| format!("{key} is not the key of a unit"))?;
    UnitId::new(serial).map_err(|error| format!("serial {serial:?} {error}: name one unit"))
}

/// Whether a query takes a key in.
pub(crate) fn is_asked(query: &Query, key: &str) -> bool {
    keyexpr::new(key).is_ok_and(|key| query.key_expr().intersects(key))
}

fn reply_json(query: &Query, key: &str, words: &impl Serialize) -> Result<(), String> {
    let json = serde_json::to_vec(words).map_err(|error| format!("the reply cannot be written: {error}"))?;
    reply(query, key, json, Encoding::APPLICATION_JSON);
    Ok(())
}

pub(super) fn reply(query: &Query, key: &str, bytes: Vec<u8>, encoding: Encoding) {
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

/// What of a history is asked for.
struct PartOfHistory {
    limit: usize,
    /// Entries above this number.
    after: u64,
    /// Of this instance, though another one speaks.
    instance: Option<String>,
}

impl PartOfHistory {
    /// Reads `limit=20;after=1000;instance=0badcafe`.
    fn parse(parameters: &str) -> Result<Self, String> {
        let mut part = Self { limit: HISTORY_ENTRIES, after: 0, instance: None };
        for parameter in parameters.split(';').filter(|parameter| !parameter.is_empty()) {
            let (name, value) = parameter.split_once('=').unwrap_or((parameter, ""));
            match (name, value.parse()) {
                ("after", Ok(number)) => part.after = number,
                ("limit", Ok(number @ 1..)) => part.limit = usize::try_from(number).unwrap_or(usize::MAX),
                ("instance", _) => part.instance = Some(value.to_owned()),
                _ => {
                    return Err(format!(
                        "parameter {parameter:?} must be limit=N, N a whole number from 1, or after=N, the number of an \
                         entry"
                    ));
                }
            }
        }
        Ok(part)
    }
}
