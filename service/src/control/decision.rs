//! A decision: everything that is wrong with a document, everything that is doubtful, and what it changes, at once.

use std::sync::Arc;
use std::time::SystemTime;

use isotherm_correction::calibration::{Calibration, Steady};
use isotherm_correction::operation::State;
use isotherm_document::{few, file, parse_toml, unplaced};
use isotherm_protocol::control::{Difference, DocumentChange};
use isotherm_protocol::document::{self, CURRENT_SCHEMA, Problem, Side};
use isotherm_protocol::history::WallTime;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::overlay::{Candidate, Overlay, is_overlay};

use super::document::{Document, Layers};
use super::jump::jump;
use super::manager::Worker;
use super::request::Request;
use super::revision::{Record, Revision};
use super::unlikely::unlikely;
use crate::config::{Severity, SwapSettings};
use crate::receive::unit::{Present, StartsAnew};
use crate::signing::check_signature;

/// Seconds of a day.
const DAY_S: i64 = 86_400;

/// What was found out about a request. Nothing has changed yet.
#[derive(Debug, Clone, Default)]
pub(super) struct Decision {
    /// Whom it is for: as asked, else as the document says; `None` where it says nothing that can be used.
    pub(super) unit: Option<UnitId>,
    /// What would be put in force; `None` where the text is no valid document.
    pub(super) document: Option<Arc<Document>>,
    /// Everything that speaks against it.
    pub(super) problems: Vec<Problem>,
    /// What is doubtful.
    pub(super) warnings: Vec<Problem>,
    /// What it changes; `None` where one of the two documents is missing.
    pub(super) difference: Option<Difference>,
}

impl Worker {
    /// Decides on a request with this document; `read` is what was found in it, where it was read before.
    pub(super) fn decide(
        &self,
        request: &Request,
        bytes: &[u8],
        read: Option<&Result<Document, Vec<Problem>>>,
    ) -> Decision {
        let asked = Decision { unit: request.unit.clone(), ..Decision::default() };
        let text = match file::text(bytes, Some(&request.name)) {
            Ok(text) => text,
            Err(problems) => return Decision { problems, ..asked },
        };
        let (mut problems, mut warnings) = (Vec::new(), Vec::new());
        if request.needs_signature() && request.overlay.is_none() {
            check_signature(&self.swap, text, &request.name, &mut problems, &mut warnings);
        }
        let unit = request.unit.clone().or_else(|| unit_of(text));
        let record = unit.as_ref().and_then(|unit| self.records.get(unit));
        let found = read.cloned().unwrap_or_else(|| read_document(bytes, text, &request.name, record));
        let document = match found {
            Ok(document) => document,
            Err(found) => {
                problems.extend(self.other_serial(request, unit_of(text), text));
                problems.extend(found);
                return Decision { unit, problems, warnings, ..asked };
            }
        };
        warnings.extend(document.warnings.iter().cloned());
        let unit = match (request.unit.clone(), UnitId::new(&document.unit)) {
            (Some(unit), _) | (None, Ok(unit)) => unit,
            // Not to be reached: a document's unit has been checked.
            (None, Err(error)) => {
                problems.push(unplaced(Some(&request.name), format!("unit: {error}")));
                return Decision { problems, warnings, ..asked };
            }
        };
        if document.unit != unit.as_str() && self.takes_any_serial(request) {
            let other = &document.unit;
            let message = format!("is \"{other}\": accepted for unit {unit}, as requested (any_serial)");
            warnings.push(document::problem_at(text, &request.name, "unit", message));
        }
        // That of an overlay's text may be another than that of the document below it.
        let named = if document.layers.is_some() { unit_of(text) } else { UnitId::new(&document.unit).ok() };
        problems.extend(self.other_serial(request, named, text));
        let document = match request.overlay {
            Some(overlay) => {
                let document = document.over(Layers::stored(&self.store, overlay));
                if let Some(signed) = document.signed() {
                    check_signature(&self.swap, &signed.text(), &request.name, &mut problems, &mut warnings);
                }
                document
            }
            None => document,
        };
        let present = self.intake.present(&unit);
        warnings.extend(present.as_ref().and_then(|present| interrupts(request, present.state)));
        let active: Option<&Revision> = self.in_force(&unit).map(|active| &**active);
        let outlook = Outlook::new(active, &document, present.as_ref());
        let compared = active.and_then(|active| compare(active, &document, &outlook));
        let (difference, lost) = compared.map_or((None, Vec::new()), |(found, lost)| (Some(found), lost));
        let changes = difference.as_ref().map_or(&[][..], |difference| &difference.document);
        let found = doubts(&self.swap, &document, active, (&outlook, changes), SystemTime::now());
        for doubt in found.into_iter().chain(loss(&lost)) {
            let lenient = request.is_own() || request.options.force;
            let problem = document::problem_at(text, &request.name, &doubt.key, doubt.message(lenient));
            if doubt.refuses && !lenient { problems.push(problem) } else { warnings.push(problem) }
        }
        Decision { unit: Some(unit), document: Some(Arc::new(document)), problems, warnings, difference }
    }

    /// Whether a document for another unit is taken. What was signed was signed for one.
    fn takes_any_serial(&self, request: &Request) -> bool {
        request.options.any_serial && (request.is_own() || !self.swap.require_signature)
    }

    /// That a document names another unit than it is meant for, whatever else is wrong with it.
    fn other_serial(&self, request: &Request, named: Option<UnitId>, text: &str) -> Option<Problem> {
        let (unit, other) = (request.unit.as_ref()?, named?);
        let next = if self.swap.require_signature {
            format!("or sign one for {unit} (require_signature is set, so any_serial does not count)")
        } else {
            "correct the serial, or add any_serial (--any-serial)".to_owned()
        };
        let message =
            format!("is \"{other}\", but the document was sent to unit {unit}: send it to {other}, {next}");
        let wrong = other != *unit && !self.takes_any_serial(request);
        wrong.then(|| document::problem_at(text, &request.name, "unit", message))
    }
}

/// Reads a document, or an overlay on what a unit has.
fn read_document(
    bytes: &[u8],
    text: &str,
    name: &str,
    record: Option<&Record>,
) -> Result<Document, Vec<Problem>> {
    let base = is_overlay(text).then(|| {
        let named = Overlay::parse(text, None).map(|parsed| parsed.overlay.overlay_of).unwrap_or_default();
        Some(record?.document()?.base(&named)?.text())
    });
    let base = base.flatten();
    let candidate = Candidate::parse(text, Some(name), base.as_deref())?;
    Ok(Document::of(candidate, base.as_deref(), bytes))
}

/// A unit under what is in force, and under a document.
struct Outlook<'a> {
    /// The unit as it is; `None` where it has not appeared.
    present: Option<&'a Present>,
    /// The unit under the document, once every channel was read again.
    next: Option<Present>,
    /// Channels that start anew with it.
    anew: Vec<StartsAnew>,
    /// The corrections now and then; `None` where nothing is in force.
    steady: Option<[Steady; 2]>,
}

impl<'a> Outlook<'a> {
    fn new(active: Option<&Revision>, found: &Document, present: Option<&'a Present>) -> Self {
        let before = active.map(|active| &*active.document.calibration);
        let under = present.map(|present| match before {
            Some(before) => present.under(before, &found.calibration),
            None => (present.clone(), Vec::new()),
        });
        let (next, anew) = under.unzip();
        let steady =
            before.map(|before| [steady(present, before), steady(next.as_ref(), &found.calibration)]);
        Self { present, next, anew: anew.unwrap_or_default(), steady }
    }

    /// Whether no temperature of the unit is known, so that it corrects at the assumed one.
    fn is_assumed(&self) -> bool {
        self.present.is_none_or(|present| present.words().is_empty())
    }

    /// The names of the channels that start anew.
    fn names(&self) -> String {
        few(self.anew.iter().map(|anew| anew.name.to_string()))
    }
}

/// The correction of a unit, at the assumed temperature where it has not appeared.
fn steady(present: Option<&Present>, calibration: &Calibration) -> Steady {
    present.map_or_else(|| calibration.steady(|_| None, None), |present| present.steady(calibration))
}

/// The difference between what is in force and a document, in the document and in the correction, and the sections that the
/// document does not have any more; `None` where the former never was a document.
///
/// Temperatures and mode are those of the unit; of one that has not appeared the correction is not compared.
fn compare(active: &Revision, found: &Document, outlook: &Outlook<'_>) -> Option<(Difference, Vec<String>)> {
    let (old, new) = (active.document.content()?, found.content()?);
    let document = document::difference(&old, &new);
    let both = outlook.present.zip(outlook.steady.as_ref());
    let (correction, temperatures) = both.map_or_else(Default::default, |(present, [now, then])| {
        let before = Side { document: &old, steady: now };
        let after = Side { document: &new, steady: then };
        (document::correction_change(before, after), present.words())
    });
    Some((Difference { document, correction, temperatures }, document::lost_sections(&old, &new)))
}

/// What a change of the calibration does to what the unit is at.
fn interrupts(request: &Request, state: State) -> Option<Problem> {
    let words = match state {
        State::PreLaunchCalibration => "the unit is in pre-launch calibration, which this ends",
        State::SelfTest => "the unit is in self-test, which starts again",
        State::Standby | State::RunningWithReversal | State::RunningWithoutReversal => return None,
    };
    Some(unplaced(Some(&request.name), words.to_owned()))
}

/// The unit that a text names, whatever else is wrong with it.
pub(super) fn unit_of(text: &str) -> Option<UnitId> {
    let (root, _) = parse_toml(text);
    UnitId::new(root.get_ref().get("unit")?.get_ref().as_str()?).ok()
}

/// One thing that speaks against a document.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Doubt {
    /// Key of the document that it is about; empty for the document as a whole.
    key: String,
    /// Whether the configuration has it refused.
    refuses: bool,
    /// Key of the configuration that says so; empty where none does.
    policy: &'static str,
    words: String,
}

impl Doubt {
    fn new(key: &str, severity: Severity, policy: &'static str, words: String) -> Self {
        Self { key: key.to_owned(), refuses: severity == Severity::Refuse, policy, words }
    }

    /// What is wrong, and what to do where it refuses.
    fn message(&self, forced: bool) -> String {
        let Self { policy, words, .. } = self;
        let what_to_do = if forced { "" } else { ": force the swap (--force) if this is intended" };
        match (self.refuses, policy.is_empty()) {
            (false, _) => words.clone(),
            (true, true) if forced => format!("{words} (forced)"),
            (true, true) => format!("{words}{what_to_do}"),
            (true, false) => {
                let forced = if forced { ", forced" } else { "" };
                format!("{words} ([swap] {policy} = \"refuse\"{forced}){what_to_do}")
            }
        }
    }
}

/// Everything that speaks against a valid document for a unit as it is now.
fn doubts(
    settings: &SwapSettings,
    candidate: &Document,
    active: Option<&Revision>,
    (outlook, changes): (&Outlook<'_>, &[DocumentChange]),
    now: SystemTime,
) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    doubts.extend(age(settings, candidate, now));
    if candidate.schema < CURRENT_SCHEMA {
        let words = format!(
            "is version {}, this release writes {CURRENT_SCHEMA}: have the document made again",
            candidate.schema
        );
        doubts.push(Doubt::new("schema", settings.old_schema, "old_schema", words));
    }
    doubts.extend(active.and_then(|active| stream(candidate, active)));
    doubts.extend(active.and_then(|active| downgrade(settings, candidate, active)));
    let both = &outlook.steady;
    doubts.extend(both.iter().flat_map(unlikely).map(|words| Doubt::new("", Severity::Warn, "", words)));
    doubts.extend(anew(outlook));
    if let Some(next) = &outlook.next {
        doubts.extend(range(settings, candidate, next));
    }
    let jumps = both.iter().flat_map(|both| jumps(settings, candidate, both, (outlook, changes)));
    doubts.extend(jumps.map(|(key, words)| Doubt::new(&key, settings.jump, "jump", words)));
    doubts
}

/// Channels that start anew, and those of them that would reject what the unit reads now.
fn anew(outlook: &Outlook<'_>) -> Vec<Doubt> {
    let rejects = outlook.anew.iter().filter_map(|anew| {
        // Nothing is lost where nothing was taken before either.
        let severity = if anew.was.is_some() { Severity::Refuse } else { Severity::Warn };
        Some(Doubt::new("", severity, "", anew.rejects()?))
    });
    let words = few(outlook.anew.iter().map(StartsAnew::words));
    let told = (!outlook.anew.is_empty()).then(|| {
        let words = format!(
            "starts channels anew, as their definition or the filter changes: {words}; each is at the \
             assumed temperature until its next reading and warms up again"
        );
        Doubt::new("", Severity::Warn, "", words)
    });
    told.into_iter().chain(rejects).collect()
}

/// Each jump of the output beyond what is allowed: once every channel was read again, and until then.
fn jumps(
    settings: &SwapSettings,
    candidate: &Document,
    both: &[Steady; 2],
    (outlook, changes): (&Outlook<'_>, &[DocumentChange]),
) -> Vec<(String, String)> {
    if settings.max_jump_rad_per_s.or(settings.max_jump_m_per_s2).is_none() {
        return Vec::new();
    }
    let assumed = candidate.content().filter(|_| outlook.is_assumed());
    let at = assumed.map_or_else(String::new, |document| {
        let assumed_deg_c = document.temperature.assumed_deg_c;
        format!(" at the assumed {assumed_deg_c} °C (no temperature of the unit is known)")
    });
    let mut found = jump(settings, both, changes, &at);
    // Where it is too far for good, that is enough to tell.
    if let Some(next) = outlook.next.as_ref().filter(|_| found.is_empty() && !outlook.anew.is_empty()) {
        let [now, _] = both.clone();
        let until_read = next.without(&outlook.anew).steady(&candidate.calibration);
        let until = format!(" until {} is read again", outlook.names());
        found.extend(jump(settings, &[now, until_read], changes, &until));
    }
    let unread = outlook.anew.iter().filter(|anew| anew.read.is_none());
    found.extend(unread.map(|StartsAnew { name, .. }| {
        let words =
            format!("the jump of the output is unknown until channel {name} is read: swap after that");
        (String::new(), words)
    }));
    found
}

/// Ticks of another kind or number of sensors than the calibration has are refused, every one of them.
fn stream(candidate: &Document, active: &Revision) -> Option<Doubt> {
    let (old, new) = (&active.document.calibration, &candidate.calibration);
    let same = (old.gyro_output(), old.gyro_count()) == (new.gyro_output(), new.gyro_count())
        && (old.accel_count() == 0 || new.accel_count() == 0 || {
            (old.accel_output(), old.accel_count()) == (new.accel_output(), new.accel_count())
        });
    let words = "has another kind of output or number of sensors than the document in force: every tick would be \
                 refused unless the producer changes too";
    (!same).then(|| Doubt::new("", Severity::Refuse, "", words.to_owned()))
}

/// A document that has lost a section against the one in force may be the beginning of one that is still being written.
fn loss(lost: &[String]) -> Option<Doubt> {
    let words =
        || format!("lacks {}, which the document in force has; is the file complete?", lost.join(", "));
    (!lost.is_empty()).then(|| Doubt::new("", Severity::Refuse, "", words()))
}

fn age(settings: &SwapSettings, candidate: &Document, now: SystemTime) -> Option<Doubt> {
    let limit_s = settings.max_age.map(|limit| i64::try_from(limit.as_secs()).unwrap_or(i64::MAX));
    let severity = if limit_s.is_some() { settings.age } else { Severity::Warn };
    let doubt = |words| Some(Doubt::new("created", severity, "age", words));
    let days = |seconds: i64| seconds / DAY_S;
    let (Some(created), Some(created_unix_s)) = (&candidate.created, candidate.label.created_unix_s) else {
        let (why, limit_days) = (undated(candidate), days(limit_s?));
        return doubt(format!("{why}: the document may be older than {limit_days} days"));
    };
    let now_s = now.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let age_s = i64::try_from(now_s).unwrap_or(i64::MAX).saturating_sub(created_unix_s);
    if age_s < -DAY_S {
        return doubt(format!("is {created}, {} days in the future", days(-age_s)));
    }
    let limit_days = days(limit_s.filter(|limit| age_s > *limit)?);
    doubt(format!("is {created}: {} days old, more than {limit_days}", days(age_s)))
}

/// Why nothing is known of a document's age.
fn undated(candidate: &Document) -> String {
    let created = candidate.created.as_ref();
    created
        .map_or_else(|| "is missing".to_owned(), |created| format!("is {created}, which is no usable date"))
}

/// A document that was replaced, with a signature or not, must not come back unseen.
fn downgrade(settings: &SwapSettings, candidate: &Document, active: &Revision) -> Option<Doubt> {
    let in_force = active.document.label.created_unix_s?;
    let shown = WallTime::from_unix_ms(in_force.saturating_mul(1000));
    let words = match (&candidate.created, candidate.label.created_unix_s) {
        (Some(created), Some(own)) if own < in_force => {
            format!("is {created}: older than the document in force, of {shown}")
        }
        (Some(_), Some(_)) => return None,
        _ => format!("{}: the document may be older than the one in force, of {shown}", undated(candidate)),
    };
    Some(Doubt::new("created", settings.downgrade, "downgrade", words))
}

fn range<'a>(
    settings: &'a SwapSettings,
    candidate: &'a Document,
    next: &'a Present,
) -> impl Iterator<Item = Doubt> + 'a {
    let channels = candidate.calibration.channels().iter().enumerate();
    channels.filter_map(|(index, channel)| {
        let [low, high] = candidate.calibration.range_of(index)?;
        let temperature_deg_c = next.thermal(channel.name())?.temperature;
        (!(low..=high).contains(&temperature_deg_c)).then(|| {
            let words = format!(
                "channel {} is at {temperature_deg_c:.2} °C now, outside the fitted range {low} to {high} °C: the terms \
                 would be clamped",
                channel.name()
            );
            Doubt::new("", settings.outside_range, "outside_range", words)
        })
    })
}
