//! A swap: what may be asked for beside the document, and the answer.

use std::fmt;

pub use isotherm_correction::unit::At as Schedule;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::is_by;
use crate::digest;
use crate::document::Problem;
use crate::escape::clipped;

/// What of a name or a value is repeated in an error, in characters.
const LONGEST_SHOWN: usize = 80;
/// Longest slew of a swap (s).
const MAX_SLEW_S: f64 = 3600.0;

/// What is asked for beside the document: the parameters of the query's selector.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SwapOptions {
    /// Who asks: 1…64 characters, for the audit file; empty where nobody said.
    pub by: String,
    /// Only say what would happen.
    pub dry_run: bool,
    /// When it takes effect.
    pub schedule: Schedule,
    /// Time over which the change is made (s, 0…3600); the configured one where left out.
    pub slew_s: Option<f64>,
    /// Take a document that names another serial.
    pub any_serial: bool,
    /// Take it although age, temperature range or size of the jump speak against it.
    pub force: bool,
}

/// A parameter that is not understood.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("parameter {} is \"{}\", must be {must_be}", clipped(.name, LONGEST_SHOWN), clipped(.value, LONGEST_SHOWN))]
pub struct OptionsError {
    /// Its name.
    pub name: String,
    /// What it says.
    pub value: String,
    /// What it may say.
    pub must_be: &'static str,
}

/// The parameters that there are.
const KNOWN: &str = "one of by, dry_run, at_sequence, at_time_ns, slew_s, any_serial, force";

impl SwapOptions {
    /// Reads the parameters of a selector: `name=value`, separated by `;`, values percent-encoded where they hold `;`, `=` or `%`.
    ///
    /// # Errors
    /// The first parameter that is unknown, double, or has a value that does not fit.
    pub fn parse(parameters: &str) -> Result<Self, OptionsError> {
        let mut options = Self::default();
        let mut seen: Vec<&str> = Vec::new();
        for parameter in parameters.split(';').filter(|parameter| !parameter.is_empty()) {
            let (name, value) = parameter.split_once('=').unwrap_or((parameter, "true"));
            let value = decode(value);
            let error = |must_be| OptionsError { name: name.to_owned(), value: value.clone(), must_be };
            if seen.contains(&name) {
                return Err(error("given once"));
            }
            seen.push(name);
            let flag = || match value.as_str() {
                "true" => Ok(true),
                "false" => Ok(false),
                _ => Err(error("true or false")),
            };
            match name {
                "by" if is_by(&value) => options.by.clone_from(&value),
                "by" => return Err(error("at most 64 characters, none of them a control character")),
                "dry_run" => options.dry_run = flag()?,
                "any_serial" => options.any_serial = flag()?,
                "force" => options.force = flag()?,
                "at_sequence" | "at_time_ns" if options.schedule != Schedule::NextTick => {
                    return Err(error("the only one of at_sequence and at_time_ns"));
                }
                "at_sequence" => {
                    let sequence = value.parse().map_err(|_| error("a whole number from 0 to 2^64 - 1"))?;
                    options.schedule = Schedule::Sequence(sequence);
                }
                "at_time_ns" => {
                    let time_ns = value.parse().map_err(|_| error("a whole number of nanoseconds"))?;
                    options.schedule = Schedule::TimeNs(time_ns);
                }
                "slew_s" => {
                    let slew_s = value.parse().ok().filter(|s| (0.0..=MAX_SLEW_S).contains(s));
                    options.slew_s = Some(slew_s.ok_or_else(|| error("a number of seconds from 0 to 3600"))?);
                }
                _ => return Err(error(KNOWN)),
            }
        }
        Ok(options)
    }

    /// The parameters of a selector that say the same.
    #[must_use]
    pub fn to_parameters(&self) -> String {
        let mut parameters = Vec::new();
        if !self.by.is_empty() {
            parameters.push(format!("by={}", encode(&self.by)));
        }
        for (name, on) in [("dry_run", self.dry_run), ("any_serial", self.any_serial), ("force", self.force)]
        {
            if on {
                parameters.push(format!("{name}=true"));
            }
        }
        match self.schedule {
            Schedule::NextTick => {}
            Schedule::Sequence(sequence) => parameters.push(format!("at_sequence={sequence}")),
            Schedule::TimeNs(time_ns) => parameters.push(format!("at_time_ns={time_ns}")),
        }
        if let Some(slew_s) = self.slew_s {
            parameters.push(format!("slew_s={slew_s}"));
        }
        parameters.join(";")
    }
}

/// Puts `%XX` in the place of what separates parameters, and of `?` and `#`, which separate selectors.
fn encode(value: &str) -> String {
    let coded = |c: char| match c {
        ';' | '=' | '%' | '?' | '#' | '&' | '|' => format!("%{:02X}", u32::from(c)),
        _ => c.to_string(),
    };
    value.chars().map(coded).collect()
}

/// Takes `%XX` back; what is no such escape stays as it is.
fn decode(value: &str) -> String {
    let mut parts = value.split('%');
    let mut decoded = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let escaped = part.get(..2).and_then(digest::bytes::<1>).filter(|[byte]| byte.is_ascii());
        if let (Some([byte]), Some(rest)) = (escaped, part.get(2..)) {
            decoded.push(char::from(byte));
            decoded.push_str(rest);
        } else {
            decoded.push('%');
            decoded.push_str(part);
        }
    }
    decoded
}

/// What became of a swap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SwapOutcome {
    /// It is in force, or will be at its tick.
    Accepted,
    /// Nothing has changed.
    Refused,
    /// It was only asked for, and would be accepted.
    WouldBeAccepted,
    /// It is the document in force already: nothing has changed.
    Unchanged,
}

impl fmt::Display for SwapOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Accepted => "accepted",
            Self::Refused => "refused",
            Self::WouldBeAccepted => "would be accepted",
            Self::Unchanged => "unchanged",
        })
    }
}

/// The answer to a swap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SwapReply {
    /// What became of it.
    pub outcome: SwapOutcome,
    /// Serial of the unit.
    pub unit: String,
    /// Revision counter: the new one where accepted, else the one in force (0: none).
    pub revision: u64,
    /// SHA-256 of the document's text in hexadecimal digits: the new one's where accepted, else that of the one in force.
    pub digest: String,
    /// SHA-256 of the text that would be accepted, where it was only asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub proposed: Option<String>,
    /// When it takes effect.
    pub schedule: Schedule,
    /// Time over which the change is made (s).
    pub slew_s: f64,
    /// Everything that speaks against it.
    pub problems: Vec<Problem>,
    /// What is doubtful, though accepted.
    pub warnings: Vec<Problem>,
    /// What differs from the document in force; `None` where there is none, or the new one cannot be read.
    pub difference: Option<Difference>,
}

/// What a swap changes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Difference {
    /// Entries of the document, in its order.
    pub document: Vec<DocumentChange>,
    /// The correction at the unit's present temperatures and mode, before and after.
    pub correction: Vec<CorrectionChange>,
    /// Temperatures that the correction was evaluated at, as "name 23.45 °C".
    pub temperatures: Vec<String>,
}

/// One entry of a document that differs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DocumentChange {
    /// Dotted path with indices from 0.
    pub key: String,
    /// As it was, in TOML; `None` where it is new.
    pub before: Option<String>,
    /// As it is, in TOML; `None` where it is gone.
    pub after: Option<String>,
}

/// One quantity of the correction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorrectionChange {
    /// What it is, such as "gyro x bias" or "angular rate bias about z".
    pub quantity: String,
    /// Unit of measure.
    pub unit: String,
    /// Value under the document in force.
    pub before: f64,
    /// Value under the new document.
    pub after: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_back_from_their_parameters() {
        let options = SwapOptions {
            by: "ann; 50 % = all".to_owned(),
            dry_run: true,
            schedule: Schedule::TimeNs(-5),
            slew_s: Some(2.5),
            any_serial: true,
            force: false,
        };
        assert_eq!(SwapOptions::parse(&options.to_parameters()), Ok(options));
        assert_eq!(SwapOptions::parse(""), Ok(SwapOptions::default()));
        assert_eq!(SwapOptions::parse("dry_run").map(|options| options.dry_run), Ok(true));
        for (value, by) in [("50%+2", "50%+2"), ("%3b%", ";%"), ("%D0%90", "%D0%90"), ("%é", "%é")] {
            assert_eq!(
                SwapOptions::parse(&format!("by={value}")).map(|options| options.by),
                Ok(by.to_owned())
            );
        }
    }

    #[test]
    fn a_parameter_that_does_not_fit_is_named() {
        for (parameters, name) in [
            ("slew_s=NaN", "slew_s"),
            ("slew_s=-1", "slew_s"),
            ("at_sequence=1.5", "at_sequence"),
            ("at_sequence=1;at_time_ns=2", "at_time_ns"),
            ("force=yes", "force"),
            ("dry_run;dry_run", "dry_run"),
            ("colour=red", "colour"),
        ] {
            assert_eq!(SwapOptions::parse(parameters).unwrap_err().name, name, "{parameters}");
        }
        let error = SwapOptions::parse(&format!("by={}\n", "x".repeat(2000))).unwrap_err().to_string();
        assert!(error.len() < 200 && !error.contains('\n'), "{error}");
        let name = SwapOptions::parse(&"a\nb".repeat(2000)).unwrap_err().to_string();
        assert!(
            name.starts_with("parameter a\\nba\\n") && name.len() < 300 && !name.contains('\n'),
            "{name}"
        );
    }
}
