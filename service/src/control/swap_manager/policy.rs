//! What may speak against a valid document: its age, its schema version, the unit's temperature, the size of the jump.

use std::time::SystemTime;

use isotherm_correction::units::{AngularRate, SpecificForce};
use isotherm_protocol::document::{CURRENT_SCHEMA, Problem};
use isotherm_protocol::history::WallTime;

use super::reading::Reading;
use super::record::Active;
use crate::config::{Severity, SwapSettings};
use crate::receive::unit::Present;

/// Names of the case axes.
const AXES: [char; 3] = ['x', 'y', 'z'];
/// Seconds of a day.
const DAY_S: i64 = 86_400;

/// One thing that speaks against a document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Doubt {
    /// Key of the document that it is about; empty for the document as a whole.
    pub(super) key: &'static str,
    /// Whether the configuration has it refused.
    pub(super) refuses: bool,
    /// Key of the configuration that says so; empty where none does.
    policy: &'static str,
    words: String,
}

impl Doubt {
    fn new(key: &'static str, severity: Severity, policy: &'static str, words: String) -> Self {
        Self { key, refuses: severity == Severity::Refuse, policy, words }
    }

    /// What is wrong, and what to do where it refuses.
    pub(super) fn message(&self, forced: bool) -> String {
        match (self.refuses, forced) {
            (true, false) if self.policy.is_empty() => {
                format!("{}: force the swap (--force) if this is intended", self.words)
            }
            (true, true) if self.policy.is_empty() => format!("{} (forced)", self.words),
            (true, false) => {
                format!(
                    "{} ([swap] {} = \"refuse\"): force the swap (--force) if this is intended",
                    self.words, self.policy
                )
            }
            (true, true) => format!("{} ([swap] {} = \"refuse\", forced)", self.words, self.policy),
            (false, _) => self.words.clone(),
        }
    }
}

/// Everything that speaks against a valid document for a unit as it is now.
pub(super) fn judge(
    settings: &SwapSettings,
    candidate: &Reading,
    active: Option<&Active>,
    present: Option<&Present>,
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
    if let Some(present) = present {
        doubts.extend(range(settings, candidate, present));
        doubts.extend(active.into_iter().flat_map(|active| jump(settings, candidate, active, present)));
    }
    doubts
}

/// Ticks of another kind or number of sensors than the calibration has are refused, every one of them.
fn stream(candidate: &Reading, active: &Active) -> Option<Doubt> {
    let (old, new) = (&active.calibration, &candidate.calibration);
    let same = (old.gyro_output(), old.gyro_count()) == (new.gyro_output(), new.gyro_count())
        && (old.accel_count() == 0 || new.accel_count() == 0 || {
            (old.accel_output(), old.accel_count()) == (new.accel_output(), new.accel_count())
        });
    let words = "has another kind of output or number of sensors than the document in force: every tick would be \
                 refused unless the producer changes too";
    (!same).then(|| Doubt::new("", Severity::Refuse, "", words.to_owned()))
}

/// A document that has lost a section against the one in force may be the beginning of one that is still being written.
pub(super) fn loss(lost: &[String]) -> Option<Doubt> {
    let words =
        || format!("lacks {}, which the document in force has; is the file complete?", lost.join(", "));
    (!lost.is_empty()).then(|| Doubt::new("", Severity::Refuse, "", words()))
}

fn age(settings: &SwapSettings, candidate: &Reading, now: SystemTime) -> Option<Doubt> {
    let limit_s = i64::try_from(settings.max_age?.as_secs()).unwrap_or(i64::MAX);
    let limit_days = limit_s / DAY_S;
    let doubt = |words| Some(Doubt::new("created", settings.age, "age", words));
    let (Some(created), Some(created_unix_s)) = (&candidate.created, candidate.label.created_unix_s) else {
        return doubt(format!("is missing: the document may be older than {limit_days} days"));
    };
    let now_s = now.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let age_s = i64::try_from(now_s).unwrap_or(i64::MAX).saturating_sub(created_unix_s);
    if age_s < -DAY_S {
        return doubt(format!("is {created}, {} days in the future", -age_s / DAY_S));
    }
    (age_s > limit_s).then_some(())?;
    doubt(format!("is {created}: {} days old, more than {limit_days}", age_s / DAY_S))
}

/// A document that was replaced, with a signature or not, must not come back unseen.
fn downgrade(settings: &SwapSettings, candidate: &Reading, active: &Active) -> Option<Doubt> {
    let in_force = active.created_unix_s?;
    let shown = WallTime::from_unix_ms(in_force.saturating_mul(1000));
    let words = match (&candidate.created, candidate.label.created_unix_s) {
        (Some(created), Some(own)) if own < in_force => {
            format!("is {created}: older than the document in force, of {shown}")
        }
        (Some(_), Some(_)) => return None,
        _ => format!("is missing: the document may be older than the one in force, of {shown}"),
    };
    Some(Doubt::new("created", settings.downgrade, "downgrade", words))
}

fn range<'a>(
    settings: &'a SwapSettings,
    candidate: &'a Reading,
    present: &'a Present,
) -> impl Iterator<Item = Doubt> + 'a {
    let channels = candidate.calibration.channels().iter().enumerate();
    channels.filter_map(|(index, channel)| {
        let [low, high] = candidate.calibration.range_of(index)?;
        let temperature_deg_c = present.thermal(channel.name())?.temperature;
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

fn jump(settings: &SwapSettings, candidate: &Reading, active: &Active, present: &Present) -> Vec<Doubt> {
    if settings.max_jump_rad_per_s.is_none() && settings.max_jump_m_per_s2.is_none() {
        return Vec::new();
    }
    let doubt = |words| Doubt::new("", settings.jump, "jump", words);
    let thermal = |name: &_| present.thermal(name);
    let before = active.calibration.steady(thermal, present.mode);
    let Some(jump) = before.jump(&candidate.calibration.steady(thermal, present.mode)) else {
        return vec![doubt(
            "has other sensors or another kind of output than the document in force: the jump of the output is \
             unknown"
                .to_owned(),
        )];
    };
    let deg_per_h = |rate: f64| AngularRate::from_rad_per_s(rate).as_deg_per_h();
    let milli_g = |force: f64| SpecificForce::from_m_per_s2(force).as_g() * 1e3;
    let mut doubts = Vec::new();
    let mut check =
        |steps: [f64; 3], limit: Option<f64>, what: &str, shown: &dyn Fn(f64) -> f64, unit: &str| {
            let Some(limit) = limit else { return };
            for (axis, step) in AXES.iter().zip(steps).filter(|(_, step)| step.abs() > limit) {
                let (step, limit) = (shown(step), shown(limit));
                doubts.push(doubt(format!(
                    "{what} {axis} would jump by {step:+.4} {unit}, more than {limit} {unit}"
                )));
            }
        };
    check(jump.angular_rate, settings.max_jump_rad_per_s, "the angular rate about", &deg_per_h, "°/h");
    check(jump.specific_force, settings.max_jump_m_per_s2, "the specific force along", &milli_g, "mg");
    doubts
}

/// A problem at a key of the top level, where the text has it; otherwise at its start.
pub(super) fn at_key(text: &str, file: &str, key: &str, message: String) -> Problem {
    let value_of = |line: &str| {
        let rest = line.trim_start().strip_prefix(key)?.trim_start().strip_prefix('=')?.trim_start();
        let before = line.strip_suffix(rest).unwrap_or_default();
        Some(before.chars().count() + 1)
    };
    let mut lines = text.lines().take_while(|line| !line.trim_start().starts_with('[')).enumerate();
    let found = lines.find_map(|(index, line)| Some((index + 1, value_of(line)?)));
    let (line, column) = found.filter(|_| !key.is_empty()).unwrap_or((1, 1));
    Problem { file: Some(file.to_owned()), line, column, key: key.to_owned(), message }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_stands_at_the_value_of_its_key() {
        let text = "# unit = \"no\"\nschema = 1\n  unit   = \"A\"\n[gyro]\ncreated = 1\n";
        let place = |key| {
            let problem = at_key(text, "f", key, String::new());
            (problem.line, problem.column)
        };
        assert_eq!(place("unit"), (3, 12));
        assert_eq!(place("created"), (1, 1), "that of a table is another key");
        assert_eq!(place(""), (1, 1));
    }
}
