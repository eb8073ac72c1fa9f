//! Every key of the key space, built and parsed in one place.
//!
//! A site's namespace, where there is one, is set in the Zenoh configuration and never appears here.

use std::borrow::Borrow;
use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::control::is_by;
use crate::digest::Digest;

/// Longest serial, in bytes.
pub const MAX_UNIT_ID: usize = 64;

/// Raw topics of all units.
pub const ALL_RAW: &str = "imu/*/raw/*";
/// Temperature topics of all units.
pub const ALL_TEMPERATURES: &str = "imu/*/raw/temp";
/// Corrected topics of all units.
pub const ALL_CORRECTED: &str = "imu/*/corrected";
/// Status topics of all units.
pub const ALL_STATUS: &str = "imu/*/status";
/// Calibration documents of all units: queries and puts.
pub const ALL_CALIBRATION: &str = "imu/*/calibration";
/// The same on keys that end in the name of who asks.
pub const ALL_CALIBRATION_BY: &str = "imu/*/calibration/*";
/// Commands to all units.
pub const ALL_COMMAND: &str = "imu/*/command";
/// The same on keys that end in the name of who asks.
pub const ALL_COMMAND_BY: &str = "imu/*/command/*";
/// Histories of all units.
pub const ALL_HISTORY: &str = "imu/*/history";
/// Journals of all units.
pub const ALL_JOURNALS: &str = "imu/*/journal";
/// Rate references of all units.
pub const ALL_REFERENCE: &str = "imu/*/reference";
/// Liveliness tokens of all units.
pub const ALL_UNITS_ALIVE: &str = "imu/*/alive";
/// Status topics of all service instances.
pub const ALL_SERVICE_STATUS: &str = "isotherm/*/status";
/// Effective configurations of all service instances.
pub const ALL_CONFIGURATIONS: &str = "isotherm/*/configuration";
/// Liveliness tokens of all service instances.
pub const ALL_SERVICES_ALIVE: &str = "isotherm/*/alive";
/// What all service instances say of themselves and their units, as those of a pair.
pub const ALL_PAIRS: &str = "isotherm/*/pair";
/// Liveliness tokens by which service instances see each other.
pub const ALL_MEMBERS: &str = "isotherm/*/member/**";
/// Documents and overlays in the state folders of all service instances, by digest.
pub const ALL_KEPT: &str = "isotherm/*/kept/*";
/// Receipts of all subscribers that give one: a service that stops asks them.
pub const ALL_RECEIPTS: &str = "isotherm/*/receipt";

/// First chunk of every key of a unit.
const ROOT: &str = "imu";
/// First chunk of every key of a service instance.
const SERVICE_ROOT: &str = "isotherm";

/// Serial of an instrument: the `{unit}` chunk of a key.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct UnitId(Arc<str>);

/// Why a text cannot be a serial.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UnitIdError {
    /// Empty, or too long.
    #[error("has {length} characters, must have 1 to {MAX_UNIT_ID}")]
    Length {
        /// Its length in bytes.
        length: usize,
    },
    /// A character that a key cannot carry.
    #[error("contains {character:?}, may contain only letters A-Z a-z, digits, '.', '_' and '-'")]
    Character {
        /// The first such character.
        character: char,
    },
}

impl UnitId {
    /// Checks a serial: 1…64 of `A-Z a-z 0-9 . _ -`.
    ///
    /// # Errors
    /// [`UnitIdError`] for anything else.
    pub fn new(serial: &str) -> Result<Self, UnitIdError> {
        if serial.is_empty() || serial.len() > MAX_UNIT_ID {
            return Err(UnitIdError::Length { length: serial.len() });
        }
        match serial.chars().find(|c| !(c.is_ascii_alphanumeric() || "._-".contains(*c))) {
            Some(character) => Err(UnitIdError::Character { character }),
            None => Ok(Self(serial.into())),
        }
    }

    /// The serial.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// So that a map by serial is asked with the text of a key.
impl Borrow<str> for UnitId {
    fn borrow(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for UnitId {
    type Error = UnitIdError;

    fn try_from(serial: String) -> Result<Self, UnitIdError> {
        Self::new(&serial)
    }
}

impl From<UnitId> for String {
    fn from(unit: UnitId) -> Self {
        unit.to_string()
    }
}

impl fmt::Display for UnitId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The raw streams of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RawStream {
    /// Gyro ticks.
    Gyro,
    /// Accelerometer ticks.
    Accel,
    /// Temperature readings.
    Temperature,
    /// What the producer reports of itself.
    Health,
}

impl RawStream {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Gyro, Self::Accel, Self::Temperature, Self::Health];
}

/// What comes in for a unit: its raw streams, and its rate references.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Input {
    /// A raw stream.
    Raw(RawStream),
    /// Rate references.
    Reference,
}

impl Input {
    /// All of them, in the order of [`Input::index`].
    pub const ALL: [Self; 5] = [
        Self::Raw(RawStream::Gyro),
        Self::Raw(RawStream::Accel),
        Self::Raw(RawStream::Temperature),
        Self::Raw(RawStream::Health),
        Self::Reference,
    ];

    /// Its place in a list of five: gyro, accelerometer, temperature, health, reference.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::Raw(stream) => stream as usize,
            Self::Reference => RawStream::ALL.len(),
        }
    }

    /// The chunks of its key behind the unit.
    #[must_use]
    pub const fn topic(self) -> &'static str {
        match self {
            Self::Raw(RawStream::Gyro) => "raw/gyro",
            Self::Raw(RawStream::Accel) => "raw/accel",
            Self::Raw(RawStream::Temperature) => "raw/temp",
            Self::Raw(RawStream::Health) => "raw/health",
            Self::Reference => "reference",
        }
    }

    /// Its name, for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Raw(RawStream::Gyro) => "gyro",
            Self::Raw(RawStream::Accel) => "accelerometer",
            Self::Raw(RawStream::Temperature) => "temperature",
            Self::Raw(RawStream::Health) => "health",
            Self::Reference => "reference",
        }
    }
}

impl From<RawStream> for Input {
    fn from(stream: RawStream) -> Self {
        Self::Raw(stream)
    }
}

/// Key of an input: of a raw stream, or of the rate references.
#[must_use]
pub fn input(unit: &UnitId, input: Input) -> String {
    format!("{ROOT}/{unit}/{}", input.topic())
}

/// Reads the key of an input back; `None` where it is none.
#[must_use]
pub fn parse_input(key: &str) -> Option<(&str, Input)> {
    let (unit, topic) = parse(ROOT, key)?;
    Input::ALL.into_iter().find(|input| input.topic() == topic).map(|input| (unit, input))
}

/// Key of a raw stream: `imu/{unit}/raw/{gyro|accel|temp|health}`.
#[must_use]
pub fn raw(unit: &UnitId, stream: RawStream) -> String {
    input(unit, stream.into())
}

/// Declares keys of a unit or of a service instance once, so that building and parsing cannot drift apart.
macro_rules! keys {
    ($($what:literal, $root:ident $of:ident: $type:ty, $topic:literal, $build:ident $($parse:ident)?;)+) => {
        $(
            #[doc = concat!("Key of ", $what, ": `", $topic, "` of a ", stringify!($of), ".")]
            #[must_use]
            pub fn $build($of: &$type) -> String {
                format!(concat!("{}/{}/", $topic), $root, $of)
            }

            $(
                #[doc = concat!("Reads the ", stringify!($of), " of a key of ", $what, " back; `None` where it is none.")]
                #[must_use]
                pub fn $parse(key: &str) -> Option<&str> {
                    parse($root, key).filter(|(_, rest)| *rest == $topic).map(|($of, _)| $of)
                }
            )?
        )+
    };
}

// An instance is named by its Zenoh id as text.
keys! {
    "the corrected increments", ROOT unit: UnitId, "corrected", corrected parse_corrected;
    "a unit's status", ROOT unit: UnitId, "status", status parse_status;
    "the calibration document", ROOT unit: UnitId, "calibration", calibration parse_calibration;
    "commands", ROOT unit: UnitId, "command", command parse_command;
    "a unit's history", ROOT unit: UnitId, "history", history parse_history;
    "a unit's journal", ROOT unit: UnitId, "journal", journal parse_journal;
    "rate references", ROOT unit: UnitId, "reference", reference parse_reference;
    "a unit's liveliness token", ROOT unit: UnitId, "alive", unit_alive parse_unit_alive;
    "a service's status", SERVICE_ROOT instance: str, "status", service_status parse_service_status;
    "a service's effective configuration", SERVICE_ROOT instance: str, "configuration", configuration parse_configuration;
    "a service's liveliness token", SERVICE_ROOT instance: str, "alive", service_alive parse_service_alive;
    "what a service says of itself and its units", SERVICE_ROOT instance: str, "pair", pair;
    "the receipt of a session that subscribes", SERVICE_ROOT session: str, "receipt", receipt;
}

/// Key of an order that ends in the name of who asks: access control can say who may use which; `None` for a name that no key can
/// carry.
#[must_use]
pub fn by(order: &str, name: &str) -> Option<String> {
    is_name(name).then(|| format!("{order}/{name}"))
}

/// Key of an order without the name of who asks, and that name, where it has one.
#[must_use]
pub fn asker(key: &str) -> (&str, Option<&str>) {
    let named = |(order, name)| {
        let is_order = parse_calibration(order).or_else(|| parse_command(order)).is_some();
        (is_order && is_name(name)).then_some((order, Some(name)))
    };
    key.rsplit_once('/').and_then(named).unwrap_or((key, None))
}

/// Whether a name fits in a key, and in the audit file.
fn is_name(name: &str) -> bool {
    // No `*` stands for a chunk that begins with `@`: nobody would hear it.
    is_by(name) && !name.is_empty() && !name.starts_with('@') && !name.contains(['/', '*', '$', '#', '?'])
}

/// Key of a document or an overlay in a service instance's state folder: `isotherm/{instance}/kept/{digest}`.
#[must_use]
pub fn kept(instance: &str, digest: &Digest) -> String {
    format!("{SERVICE_ROOT}/{instance}/kept/{digest}")
}

/// Reads the digest of a key of a kept document back; `None` where it is none.
#[must_use]
pub fn parse_kept(key: &str) -> Option<Digest> {
    parse(SERVICE_ROOT, key)?.1.strip_prefix("kept/")?.parse().ok()
}

/// Reads the unit of any key of a unit back; `None` where it is none.
#[must_use]
pub fn unit_of(key: &str) -> Option<&str> {
    parse(ROOT, key).map(|(unit, _)| unit)
}

/// Reads a raw key back; `None` where it is none.
#[must_use]
pub fn parse_raw(key: &str) -> Option<(&str, RawStream)> {
    match parse_input(key)? {
        (unit, Input::Raw(stream)) => Some((unit, stream)),
        (_, Input::Reference) => None,
    }
}

/// Splits `{root}/{name}/{rest}`.
fn parse<'a>(root: &str, key: &'a str) -> Option<(&'a str, &'a str)> {
    key.strip_prefix(root)?.strip_prefix('/')?.split_once('/')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_built_is_parsed_back() {
        let unit = UnitId::new("ZLG-0042").unwrap();
        for stream in RawStream::ALL {
            assert_eq!(parse_raw(&raw(&unit, stream)), Some(("ZLG-0042", stream)));
        }
        for (index, each) in Input::ALL.into_iter().enumerate() {
            assert_eq!(parse_input(&input(&unit, each)), Some(("ZLG-0042", each)));
            assert_eq!(each.index(), index);
        }
        assert_eq!(parse_corrected(&corrected(&unit)), Some("ZLG-0042"));
        let topics = [
            (status(&unit), "imu/ZLG-0042/status", parse_status as fn(&str) -> Option<&str>),
            (calibration(&unit), "imu/ZLG-0042/calibration", parse_calibration),
            (command(&unit), "imu/ZLG-0042/command", parse_command),
            (history(&unit), "imu/ZLG-0042/history", parse_history),
            (reference(&unit), "imu/ZLG-0042/reference", parse_reference),
            (journal(&unit), "imu/ZLG-0042/journal", parse_journal),
            (unit_alive(&unit), "imu/ZLG-0042/alive", parse_unit_alive),
            (service_status("ZLG-0042"), "isotherm/ZLG-0042/status", parse_service_status),
            (configuration("ZLG-0042"), "isotherm/ZLG-0042/configuration", parse_configuration),
            (service_alive("ZLG-0042"), "isotherm/ZLG-0042/alive", parse_service_alive),
        ];
        for (key, text, parse) in &topics {
            assert_eq!((key.as_str(), parse(key)), (*text, Some("ZLG-0042")));
            // No other key is taken for it.
            let others = topics.iter().filter(|(other, ..)| other != key);
            assert!(others.into_iter().all(|(other, ..)| parse(other).is_none()), "{key}");
        }
        for other in ["", "imu", "imu/x", "imu/x/raw", "imu/x/raw/mag", "imu/x/raw/gyro/y", "gps/x/raw/gyro"]
        {
            assert_eq!(parse_raw(other), None, "{other}");
        }
    }

    #[test]
    fn serials_that_would_break_a_key_are_refused() {
        for serial in ["a/b", "*", "a b", "é", "$x", "#", "a?"] {
            assert!(matches!(UnitId::new(serial), Err(UnitIdError::Character { .. })), "{serial}");
        }
        assert!(UnitId::new("").is_err());
        assert!(UnitId::new(&"x".repeat(MAX_UNIT_ID + 1)).is_err());
    }

    #[test]
    fn an_order_carries_the_name_of_who_asks() {
        let unit = UnitId::new("ZLG-0042").unwrap();
        for order in [calibration(&unit), command(&unit)] {
            assert_eq!(asker(&order), (&*order, None));
            assert_eq!(asker(&by(&order, "ann of the bench").unwrap()), (&*order, Some("ann of the bench")));
            for name in ["", "*", "$*", "a/b", "a\n", "@ann", &"x".repeat(65)] {
                assert_eq!(by(&order, name), None, "{name:?}");
            }
            let anybody = format!("{order}/*");
            assert_eq!(asker(&anybody), (&*anybody, None), "whoever it is for, it is nobody's");
        }
        assert_eq!(asker("imu/ZLG-0042/raw/gyro"), ("imu/ZLG-0042/raw/gyro", None));
    }
}
