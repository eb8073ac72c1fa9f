//! Several services of one stream: who they are, which of them speaks for which unit.
//!
//! An instance shows itself by a liveliness token whose key says all that the others must know at once ([`Member`]); the rest is
//! asked for ([`PairReport`], JSON).

use std::cmp::Reverse;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::key::UnitId;

/// Longest name of an instance, in characters.
pub const MAX_NAME: usize = 32;

/// What an instance does while another one speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Mode {
    /// Computes, and publishes nothing until the other is silent.
    Standby,
    /// Publishes too: subscribers take the first of each tick.
    Active,
}

impl Mode {
    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Standby => "standby",
            Self::Active => "active",
        }
    }
}

/// A service instance as the others see it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    /// Its Zenoh id as text.
    pub instance: String,
    /// Its name for people.
    pub name: String,
    /// What it does while another one speaks.
    pub mode: Mode,
    /// Of two that speak the one with the lower priority yields.
    pub priority: u8,
    /// When it started, by its own clock (ms since 1970-01-01 UTC): the earlier goes before where priorities are equal.
    pub started_unix_ms: i64,
    /// Of the units that it takes: instances of one group take the same.
    pub group: String,
}

impl Member {
    /// Key of its liveliness token.
    #[must_use]
    pub fn token(&self) -> String {
        let Self { instance, name, mode, priority, started_unix_ms, group } = self;
        format!("isotherm/{instance}/member/{}/{priority}/{started_unix_ms}/{name}/{group}", mode.name())
    }

    /// Reads the key of a token back; `None` where it is none.
    #[must_use]
    pub fn parse(key: &str) -> Option<Self> {
        let mut parts = key.strip_prefix("isotherm/")?.split('/');
        let instance = parts.next()?.to_owned();
        (parts.next()? == "member").then_some(())?;
        let mode = parts.next()?;
        let mode = [Mode::Standby, Mode::Active].into_iter().find(|known| known.name() == mode)?;
        let (priority, started_unix_ms) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
        let (name, group) = (parts.next()?.to_owned(), parts.next()?.to_owned());
        parts.next().is_none().then_some(Self { instance, name, mode, priority, started_unix_ms, group })
    }

    /// Whether it goes before another: by priority, then by age.
    #[must_use]
    pub fn goes_before(&self, other: &Self) -> bool {
        let rank =
            |member: &Self| (Reverse(member.priority), member.started_unix_ms, member.instance.clone());
        rank(self) < rank(other)
    }
}

/// Whether a text can be the name of an instance: 1…32 of the characters of a serial.
#[must_use]
pub fn is_name(text: &str) -> bool {
    text.len() <= MAX_NAME && UnitId::new(text).is_ok()
}

/// What an instance does for a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Publishes what it computes; swaps and commands are its own.
    Speaking,
    /// Computes what the speaking instance computes.
    Standby,
    /// Has not taken the speaking instance's memory yet.
    Joining,
}

impl Role {
    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Speaking => "speaking",
            Self::Standby => "standby",
            Self::Joining => "joining",
        }
    }
}

/// What an instance says of one unit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitRole {
    /// Serial of the unit.
    pub unit: String,
    /// What the instance does for it.
    pub role: Role,
    /// Corrected ticks of the speaking instance whose bits were compared with its own.
    pub ticks_compared: u64,
    /// Those that were others.
    pub ticks_differing: u64,
    /// Times that it began to speak in the place of another instance.
    pub takeovers: u64,
    /// The last tick that was another one, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_difference: Option<String>,
}

/// What an instance says of itself and its units: the answer to a query on `isotherm/{instance}/pair`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PairReport {
    /// Who it is.
    #[serde(flatten)]
    pub member: Member,
    /// Key expressions of the units that it takes.
    pub takes: Vec<String>,
    /// The units that it has heard, in the order of their serials.
    pub units: Vec<UnitRole>,
    /// Units whose messages it has heard in the last ten seconds and does not take.
    #[serde(default)]
    pub passed_over: Vec<String>,
    /// Names of the other instances of its pair that are there.
    #[serde(default)]
    pub others: Vec<String>,
    /// Where they are, as far as it is configured.
    #[serde(default)]
    pub addresses: Vec<String>,
}

impl PairReport {
    /// What it does for a unit; `None` where it has not heard it.
    #[must_use]
    pub fn role(&self, unit: &str) -> Option<Role> {
        self.units.iter().find(|other| other.unit == unit).map(|other| other.role)
    }

    /// The other instances of its pair, and where they are: "north at tcp/10.0.0.1:7447"; `None` where none is there.
    #[must_use]
    pub fn elsewhere(&self) -> Option<String> {
        let (others, addresses) = (self.others.join(" or "), self.addresses.join(" or "));
        let at = if addresses.is_empty() { addresses } else { format!(" at {addresses}") };
        (!others.is_empty()).then(|| others + &at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn member(instance: &str, priority: u8, started_unix_ms: i64) -> Member {
        let (instance, name) = (instance.to_owned(), "north".to_owned());
        let (mode, group) = (Mode::Standby, "cbf43926".to_owned());
        Member { instance, name, mode, priority, started_unix_ms, group }
    }

    #[test]
    fn a_token_is_read_back() {
        let north = member("d36a8f01", 7, 1_700_000_000_000);
        assert_eq!(north.token(), "isotherm/d36a8f01/member/standby/7/1700000000000/north/cbf43926");
        assert_eq!(Member::parse(&north.token()), Some(north));
        for other in [
            "isotherm/a/alive",
            "isotherm/a/member/x/1/2/n/g",
            "isotherm/a/member/active/300/2/n/g",
            "isotherm/a/member/active/3/2/n/g/x",
            "imu/a/member",
        ] {
            assert_eq!(Member::parse(other), None, "{other}");
        }
    }

    #[test]
    fn priority_comes_before_age_and_age_before_the_name() {
        let (old, new, high) = (member("b", 0, 1), member("a", 0, 2), member("c", 1, 3));
        assert!(high.goes_before(&old) && old.goes_before(&new) && high.goes_before(&new));
        let twin = member("c", 0, 1);
        assert!(old.goes_before(&twin) && !twin.goes_before(&old));
    }

    #[test]
    fn a_name_is_one_chunk_of_a_key() {
        assert!(
            is_name("north-1.a_B")
                && !is_name("")
                && !is_name("a/b")
                && !is_name("*")
                && !is_name(&"x".repeat(33))
        );
    }
}
