//! The walk through `[origin]`.

use toml::de::{DeTable, DeValue};

use super::super::common::sha256;
use super::super::reader::{Reader, Table, Value, element, join};
use super::super::types::{Log, Measure, Origin, Residual, Sample};
use super::super::values::{Limits, number};

/// A residual is never negative.
const NOT_NEGATIVE: Limits = Limits::Within(0.0, 1e100);

pub(super) fn origin(r: &mut Reader<'_>, mut table: Table<'_>) -> Origin {
    let origin = Origin {
        tool: table.text_opt(r, "tool", "a string", |_| true),
        command: table.text_opt(r, "command", "a string", |_| true),
        method: table.text_opt(r, "method", "a string", |_| true),
        range_deg_c: table.pair_opt(r, "range_deg_c", Limits::Any),
        rate_range_deg_c_per_s: table.pair_opt(r, "rate_range_deg_c_per_s", Limits::Any),
        log: {
            let logs = table.tables(r, "log", (0, 64));
            logs.into_iter().map(|table| log(r, table)).collect()
        },
        residual: {
            let residuals = table.tables(r, "residual", (0, 256));
            residuals.into_iter().map(|table| residual(r, table)).collect()
        },
        details: details(r, &mut table),
    };
    table.finish(r);
    origin
}

fn log(r: &mut Reader<'_>, mut table: Table<'_>) -> Log {
    let log =
        Log { name: table.text(r, "name", "a string", |_| true), sha256: sha256(r, &mut table, "sha256") };
    table.finish(r);
    log
}

fn residual(r: &mut Reader<'_>, mut table: Table<'_>) -> Residual {
    let samples = [("in", Sample::In), ("out", Sample::Out)];
    let measures = [("deg/h", Measure::DegPerH), ("m/s2", Measure::MetresPerSecondSquared)];
    let residual = Residual {
        of: table.text(r, "of", "a string", |_| true),
        sample: table.choice(r, "sample", &samples).unwrap_or(Sample::In),
        measure: table.choice(r, "measure", &measures).unwrap_or(Measure::DegPerH),
        rms_before: table.number(r, "rms_before", NOT_NEGATIVE),
        rms_after: table.number(r, "rms_after", NOT_NEGATIVE),
        peak_to_peak_before: table.number_opt(r, "peak_to_peak_before", NOT_NEGATIVE),
        peak_to_peak_after: table.number_opt(r, "peak_to_peak_after", NOT_NEGATIVE),
    };
    table.finish(r);
    residual
}

/// Anything goes, as long as its numbers are finite.
fn details(r: &mut Reader<'_>, table: &mut Table<'_>) -> Option<toml::Table> {
    let value = table.take(r, "details")?;
    let path = table.path_of("details");
    let Some(entries) = value.get_ref().as_table() else {
        r.refuse(&path, value, "a table");
        return None;
    };
    Some(free_table(r, &path, entries))
}

fn free_table(r: &mut Reader<'_>, path: &str, entries: &DeTable<'_>) -> toml::Table {
    let entry = |(key, value): (&toml::Spanned<toml::de::DeString<'_>>, &Value<'_>)| {
        (key.get_ref().to_string(), free_value(r, &join(path, key.get_ref()), value))
    };
    entries.iter().map(entry).collect()
}

/// Depth is bounded by the parser, which refuses nesting beyond 80 levels.
fn free_value(r: &mut Reader<'_>, path: &str, value: &Value<'_>) -> toml::Value {
    match value.get_ref() {
        DeValue::String(text) => toml::Value::String(text.to_string()),
        DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(whole) => toml::Value::Integer(whole),
            Err(_) => toml::Value::Float(number(r, path, value, Limits::Any)),
        },
        DeValue::Float(_) => toml::Value::Float(number(r, path, value, Limits::Any)),
        DeValue::Boolean(boolean) => toml::Value::Boolean(*boolean),
        DeValue::Datetime(datetime) => toml::Value::Datetime(*datetime),
        DeValue::Array(array) => {
            let items = array.iter().enumerate();
            toml::Value::Array(items.map(|(i, value)| free_value(r, &element(path, i), value)).collect())
        }
        DeValue::Table(entries) => toml::Value::Table(free_table(r, path, entries)),
    }
}
