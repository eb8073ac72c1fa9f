//! Every key of the key space, built and parsed in one place.
//!
//! A site's namespace, where there is one, is set in the Zenoh configuration and never appears here.

use std::fmt;
use std::sync::Arc;

use thiserror::Error;

/// Longest serial, in bytes.
pub const MAX_UNIT_ID: usize = 64;

/// Raw topics of all units.
pub const ALL_RAW: &str = "imu/*/raw/*";
/// Corrected topics of all units.
pub const ALL_CORRECTED: &str = "imu/*/corrected";
/// Status topics of all units.
pub const ALL_STATUS: &str = "imu/*/status";

/// First chunk of every key.
const ROOT: &str = "imu";

/// Serial of an instrument: the `{unit}` chunk of a key.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
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

impl fmt::Display for UnitId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The three raw streams of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RawStream {
    /// Gyro ticks.
    Gyro,
    /// Accelerometer ticks.
    Accel,
    /// Temperature readings.
    Temperature,
}

impl RawStream {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Gyro, Self::Accel, Self::Temperature];

    /// Last chunk of the key.
    #[must_use]
    pub const fn chunk(self) -> &'static str {
        match self {
            Self::Gyro => "gyro",
            Self::Accel => "accel",
            Self::Temperature => "temp",
        }
    }
}

/// Key of a raw stream: `imu/{unit}/raw/{gyro|accel|temp}`.
#[must_use]
pub fn raw(unit: &UnitId, stream: RawStream) -> String {
    format!("{ROOT}/{unit}/raw/{}", stream.chunk())
}

/// Key of the corrected increments: `imu/{unit}/corrected`.
#[must_use]
pub fn corrected(unit: &UnitId) -> String {
    format!("{ROOT}/{unit}/corrected")
}

/// Key of the status: `imu/{unit}/status`.
#[must_use]
pub fn status(unit: &UnitId) -> String {
    format!("{ROOT}/{unit}/status")
}

/// Reads a raw key back; `None` where it is none.
#[must_use]
pub fn parse_raw(key: &str) -> Option<(&str, RawStream)> {
    let (unit, rest) = parse(key)?;
    let stream = rest.strip_prefix("raw/")?;
    RawStream::ALL.into_iter().find(|s| s.chunk() == stream).map(|stream| (unit, stream))
}

/// Reads the unit of a corrected key back; `None` where it is none.
#[must_use]
pub fn parse_corrected(key: &str) -> Option<&str> {
    parse(key).filter(|(_, rest)| *rest == "corrected").map(|(unit, _)| unit)
}

/// Reads the unit of a status key back; `None` where it is none.
#[must_use]
pub fn parse_status(key: &str) -> Option<&str> {
    parse(key).filter(|(_, rest)| *rest == "status").map(|(unit, _)| unit)
}

/// Splits `imu/{unit}/{rest}`.
fn parse(key: &str) -> Option<(&str, &str)> {
    key.strip_prefix(ROOT)?.strip_prefix('/')?.split_once('/')
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
        assert_eq!(parse_corrected(&corrected(&unit)), Some("ZLG-0042"));
        assert_eq!(parse_status(&status(&unit)), Some("ZLG-0042"));
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
}
