//! What the status says of a calibration beside its numbers.

use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};
use toml::value::{Datetime, Offset};

use crate::digest::Digest;
use crate::document::{Created, Document};

/// What is known of a calibration beside its numbers; changes nothing.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Label {
    /// SHA-256 of the document's text; `None` where only the head that stands in the revision is known.
    pub digest: Option<Digest>,
    /// When the document was made (s since 1970-01-01 UTC); `None` where it does not say.
    pub created_unix_s: Option<i64>,
    /// Where it came from, in words.
    pub source: String,
    /// SHA-256 of the overlay that was applied to the base document; `None` without one.
    pub overlay: Option<Digest>,
    /// Names of the gyros, in the order of the document.
    pub gyros: Vec<String>,
    /// Names of the accelerometers, likewise.
    pub accels: Vec<String>,
}

impl Label {
    /// What a document says, with its digest and where it came from.
    #[must_use]
    pub fn of(document: &Document, digest: Digest, source: impl Into<String>) -> Self {
        let accels = document.accel.iter().flat_map(|accel| &accel.sensor);
        Self {
            digest: Some(digest),
            created_unix_s: document.created.as_ref().and_then(unix_s),
            source: source.into(),
            overlay: None,
            gyros: document.gyro.sensor.iter().map(|sensor| sensor.name.clone()).collect(),
            accels: accels.map(|sensor| sensor.name.clone()).collect(),
        }
    }

    /// Name of a gyro; its number from 1 where it has none.
    #[must_use]
    pub fn gyro(&self, index: usize) -> String {
        name(&self.gyros, index)
    }

    /// Name of an accelerometer, likewise.
    #[must_use]
    pub fn accel(&self, index: usize) -> String {
        name(&self.accels, index)
    }
}

fn name(names: &[String], index: usize) -> String {
    names.get(index).cloned().unwrap_or_else(|| (index + 1).to_string())
}

/// A date as the start of its day in UTC, a date with time as it says (s since 1970-01-01 UTC); `None` before 1970.
fn unix_s(created: &Created) -> Option<i64> {
    let Datetime { date, time, offset } = *created.datetime();
    let day = humantime::parse_rfc3339(&format!("{}T00:00:00Z", date?)).ok()?;
    let day = day.duration_since(SystemTime::UNIX_EPOCH).unwrap_or(Duration::ZERO);
    let of_day = time.map_or(0, |time| {
        let minutes = i64::from(time.hour) * 60 + i64::from(time.minute);
        minutes * 60 + i64::from(time.second.unwrap_or(0))
    });
    let offset_minutes = match offset {
        Some(Offset::Custom { minutes }) => i64::from(minutes),
        Some(Offset::Z) | None => 0,
    };
    Some(i64::try_from(day.as_secs()).ok()? + of_day - offset_minutes * 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_counted_from_1970() {
        for (text, expected) in [
            ("1970-01-01", Some(0)),
            ("2001-09-09T01:46:40Z", Some(1_000_000_000)),
            ("2001-09-09T04:46:40.75+03:00", Some(1_000_000_000)),
            ("2001-09-08T20:16:40-05:30", Some(1_000_000_000)),
            ("2024-02-29", Some(1_709_164_800)),
            ("1969-12-31", None),
        ] {
            let created = Created::new(text.parse().unwrap()).unwrap();
            assert_eq!(unix_s(&created), expected, "{text}");
        }
    }

    #[test]
    fn a_sensor_without_a_name_goes_by_its_number() {
        let label = Label { gyros: vec!["x".to_owned()], ..Label::default() };
        assert_eq!([label.gyro(0), label.gyro(1), label.accel(0)], ["x", "2", "1"]);
    }
}
