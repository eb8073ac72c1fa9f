//! Text in, verdict out: everything that is wrong with a document, and everything that is doubtful, at once.

use isotherm_correction::operation::State;
use isotherm_document::parse_toml;
use isotherm_protocol::control::Difference;
use isotherm_protocol::document::Problem;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::overlay::{Candidate, Overlay, is_overlay};
use isotherm_protocol::signature::{self, TrustedKeys};

use super::compare::compare;
use super::order::Order;
use super::policy;
use super::reading::Reading;
use super::record::Record;
use super::worker::Worker;
use crate::config::SwapSettings;
use crate::signing::read_trusted_keys;
use isotherm_document::{file, unplaced};

/// What was found out about an order. Nothing has changed yet.
#[derive(Debug)]
pub(super) struct Verdict {
    /// Whom it is for: as asked, else as the document says; `None` where it says nothing that can be used.
    pub(super) unit: Option<UnitId>,
    /// What would be put in force; `None` where the text is no valid document.
    pub(super) candidate: Option<Reading>,
    /// Everything that speaks against it.
    pub(super) problems: Vec<Problem>,
    /// What is doubtful.
    pub(super) warnings: Vec<Problem>,
    /// What it changes; `None` where one of the two documents is missing.
    pub(super) difference: Option<Difference>,
}

impl Worker {
    /// Judges an order.
    pub(super) fn admit(&self, order: &Order<'_>) -> Verdict {
        let text = match file::text(order.bytes, order.name) {
            Ok(text) => text,
            Err(problems) => return refused(order.unit.clone(), problems),
        };
        let (mut problems, mut warnings) = (Vec::new(), Vec::new());
        if order.needs_signature() {
            check_signature(&self.swap, text, order.name, &mut problems, &mut warnings);
        }
        let named = order.unit.clone().or_else(|| unit_of(text));
        let record = named.as_ref().and_then(|unit| self.records.get(unit));
        let found = order.read.cloned().unwrap_or_else(|| {
            Candidate::parse(text, Some(order.name), base_for(text, record).as_deref()).map(Reading::from)
        });
        let candidate = match found {
            Ok(candidate) => candidate,
            Err(found) => {
                problems.extend(self.other_serial(order, unit_of(text), text));
                problems.extend(found);
                return Verdict { warnings, ..refused(named, problems) };
            }
        };
        warnings.extend(candidate.warnings.iter().cloned());
        let unit = match (order.unit.clone(), UnitId::new(&candidate.unit)) {
            (Some(unit), _) | (None, Ok(unit)) => unit,
            // Not to be reached: a document's unit has been checked.
            (None, Err(error)) => {
                problems.push(unplaced(Some(order.name), format!("unit: {error}")));
                return Verdict { warnings, ..refused(None, problems) };
            }
        };
        if candidate.unit != unit.as_str() && self.takes_any_serial(order) {
            let other = &candidate.unit;
            let message = format!("is \"{other}\": accepted for unit {unit}, as requested (any_serial)");
            warnings.push(policy::at_key(text, order.name, "unit", message));
        }
        // That of an overlay's text may be another than that of the document below it.
        let named =
            if candidate.overlay.is_some() { unit_of(text) } else { UnitId::new(&candidate.unit).ok() };
        problems.extend(self.other_serial(order, named, text));
        let present = self.intake.present(&unit);
        warnings.extend(present.as_ref().and_then(|present| interrupts(order, present.state)));
        let waiting = self.intake.waiting(&unit).map(|(revision, _)| revision);
        let active = record.and_then(|record| record.in_force(waiting));
        let compared = active.and_then(|active| compare(active, &candidate, present.as_ref()));
        let (difference, lost) = compared.map_or((None, Vec::new()), |(found, lost)| (Some(found), lost));
        let judged =
            policy::judge(&self.swap, &candidate, active, present.as_ref(), std::time::SystemTime::now());
        for doubt in judged.into_iter().chain(policy::loss(&lost)) {
            let lenient = order.is_own() || order.options.force;
            let problem = policy::at_key(text, order.name, doubt.key, doubt.message(lenient));
            if doubt.refuses && !lenient { problems.push(problem) } else { warnings.push(problem) }
        }
        Verdict { unit: Some(unit), candidate: Some(candidate), problems, warnings, difference }
    }

    /// Whether a document for another unit is taken. What was signed was signed for one.
    fn takes_any_serial(&self, order: &Order<'_>) -> bool {
        order.options.any_serial && (order.is_own() || !self.swap.require_signature)
    }

    /// That a document names another unit than it is meant for, whatever else is wrong with it.
    fn other_serial(&self, order: &Order<'_>, named: Option<UnitId>, text: &str) -> Option<Problem> {
        let (unit, other) = (order.unit.as_ref()?, named?);
        let next = if self.swap.require_signature {
            format!("or sign one for {unit} (require_signature is set, so any_serial does not count)")
        } else {
            "correct the serial, or add any_serial".to_owned()
        };
        let message =
            format!("is \"{other}\", but the document was sent to unit {unit}: send it to {other}, {next}");
        let wrong = other != *unit && !self.takes_any_serial(order);
        wrong.then(|| policy::at_key(text, order.name, "unit", message))
    }
}

/// What a change of the calibration does to what the unit is at.
fn interrupts(order: &Order<'_>, state: State) -> Option<Problem> {
    let words = match state {
        State::PreLaunchCalibration => "the unit is in pre-launch calibration, which this ends",
        State::SelfTest => "the unit is in self-test, which starts again",
        State::Standby | State::RunningWithReversal | State::RunningWithoutReversal => return None,
    };
    Some(unplaced(Some(order.name), words.to_owned()))
}

/// A verdict on what could not be read.
pub(super) fn refused(unit: Option<UnitId>, problems: Vec<Problem>) -> Verdict {
    Verdict { unit, candidate: None, problems, warnings: Vec::new(), difference: None }
}

/// The unit that a text names, whatever else is wrong with it.
pub(super) fn unit_of(text: &str) -> Option<UnitId> {
    let (root, _) = parse_toml(text);
    UnitId::new(root.get_ref().get("unit")?.get_ref().as_str()?).ok()
}

/// The document that an overlay may lie on.
fn base_for(text: &str, record: Option<&Record>) -> Option<String> {
    if !is_overlay(text) {
        return None;
    }
    let written = record?.written()?;
    let named = Overlay::parse(text, None).map(|parsed| parsed.overlay.overlay_of).unwrap_or_default();
    Some(written.base(&named).read())
}

/// Verifies the signature as far as the configuration asks for one.
pub(super) fn check_signature(
    settings: &SwapSettings,
    text: &str,
    name: &str,
    problems: &mut Vec<Problem>,
    warnings: &mut Vec<Problem>,
) {
    let Some(folder) = &settings.trusted_keys else { return };
    let verdict = if settings.require_signature { problems } else { &mut *warnings };
    // Read at each swap: a key that was added or taken away counts at once.
    let (keys, doubts) = match read_trusted_keys(folder) {
        Ok(read) => read,
        Err(found) => {
            verdict.extend(found);
            (TrustedKeys::default(), Vec::new())
        }
    };
    match signature::verify(text, &keys) {
        Ok(signature::Verdict::Signed { .. }) => {}
        Ok(signature::Verdict::Unsigned) if !settings.require_signature => {}
        Ok(signature::Verdict::Unsigned) => verdict.push(unplaced(Some(
            name),
            "is not signed, but require_signature is set: sign it (`isotherm sign`) with a key that has its .pub \
             file in the folder of trusted keys"
                .to_owned(),
        )),
        Err(error) => verdict.push(error.problem(Some(name))),
    }
    warnings.extend(doubts);
}
