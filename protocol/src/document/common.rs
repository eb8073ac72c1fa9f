//! Keys that documents and overlays have in common.

use isotherm_correction::sample::MAX_CHANNEL_NAME;
use toml::de::DeValue;

use super::reader::{Reader, Table};
use super::types::Created;

/// Serial of the unit.
pub(crate) fn unit(r: &mut Reader<'_>, root: &mut Table<'_>) -> String {
    let allowed = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    root.text(r, "unit", "1 to 64 letters A-Z a-z, digits, '.', '_' or '-'", |text| {
        (1..=64).contains(&text.len()) && text.chars().all(allowed)
    })
}

/// Date of making.
pub(crate) fn created(r: &mut Reader<'_>, root: &mut Table<'_>) -> Option<Created> {
    let value = root.take(r, "created")?;
    let created = match value.get_ref() {
        DeValue::Datetime(datetime) => Created::new(*datetime),
        _ => None,
    };
    if created.is_none() {
        r.refuse(
            "created",
            value,
            "a date (2026-11-21), or a date and time with offset (2026-11-21T08:00:00Z), without quotes",
        );
    }
    created
}

/// A name of a sensor or channel.
pub(crate) fn name(r: &mut Reader<'_>, table: &mut Table<'_>, key: &'static str) -> String {
    let value = name_opt(r, table, key);
    table.need(r, key, value, String::new())
}

/// The same where it may be left out.
pub(crate) fn name_opt(r: &mut Reader<'_>, table: &mut Table<'_>, key: &'static str) -> Option<String> {
    let allowed = |text: &str| (1..=MAX_CHANNEL_NAME).contains(&text.len());
    table.text_opt(r, key, "a name of 1 to 24 bytes", allowed)
}

/// A SHA-256 digest.
pub(crate) fn sha256(r: &mut Reader<'_>, table: &mut Table<'_>, key: &'static str) -> String {
    let hex = |text: &str| text.len() == 64 && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    table.text(r, key, "64 lower-case hexadecimal digits", hex)
}
