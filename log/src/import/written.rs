//! The mapping as text.

use std::fmt::Write;

use super::layout::Found;
use crate::mapping::Encoding;

/// Sensors of one kind.
#[derive(Debug, Clone)]
pub(super) struct Sensors {
    pub(super) kind: &'static str,
    /// Of x, y and z; `None` for an axis that the log does not have.
    pub(super) columns: [Option<usize>; 3],
    /// Of each; and how much of the unit a reading of 1 is, where it is not one.
    pub(super) units: [(String, Option<f64>); 3],
    /// Whose name begins with a minus: the other way round.
    pub(super) turned: [bool; 3],
    pub(super) counter: Option<usize>,
    pub(super) may_be_empty: bool,
}

/// A temperature channel.
#[derive(Debug, Clone)]
pub(super) struct Temperature {
    pub(super) channel: String,
    pub(super) column: usize,
    pub(super) unit: &'static str,
    pub(super) may_be_empty: bool,
}

/// Where the time of a row comes from.
#[derive(Debug, Clone, Default)]
pub(super) struct Time {
    pub(super) column: Option<usize>,
    /// Column of the date, where the other has the time of day alone.
    pub(super) date: Option<usize>,
    pub(super) unit: String,
    pub(super) tick_ns: f64,
    pub(super) gap_after_ticks: Option<f64>,
}

/// Everything that one file of a mapping says.
#[derive(Debug, Clone)]
pub(super) struct FileText<'a> {
    pub(super) name: Option<String>,
    pub(super) found: &'a Found,
    pub(super) skip_bad_rows: bool,
    /// Column of serials, and the one whose rows are taken.
    pub(super) select: Option<(usize, &'a str)>,
    pub(super) time: Time,
    pub(super) sensors: Vec<Sensors>,
    pub(super) temperatures: Vec<Temperature>,
}

/// The line that names a file, without its end.
pub(super) fn name_line(name: &str) -> String {
    format!("name = {}", quoted(name))
}

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

impl FileText<'_> {
    /// The file's part of the mapping.
    pub(super) fn text(&self) -> String {
        let Self { found, time, .. } = self;
        let mut text = String::from("\n[[file]]\n");
        let mut line = |words: std::fmt::Arguments<'_>| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{words}");
        };
        if let Some(name) = &self.name {
            line(format_args!("{}", name_line(name)));
        }
        if found.encoding != Encoding::Utf8 {
            line(format_args!("encoding = \"{}\"", found.encoding.word()));
        }
        line(format_args!("delimiter = \"{}\"", found.delimiter));
        if found.decimal_mark != b'.' {
            line(format_args!("decimal_mark = \",\""));
        }
        if let Some(comment) = found.comment {
            line(format_args!("comment = {}", quoted(comment)));
        }
        if found.skip_lines > 0 {
            line(format_args!("skip_lines = {}", found.skip_lines));
        }
        if found.by_name {
            line(format_args!("header = true"));
        }
        if found.drop_rows > 0 {
            line(format_args!("drop_rows = {}", found.drop_rows));
        }
        if self.skip_bad_rows {
            line(format_args!("on_bad_row = \"skip\""));
        }
        if let Some((column, value)) = self.select {
            let column = self.column(column);
            line(format_args!("\n[file.select]\ncolumn = {column}\nvalue = {}", quoted(value)));
        }
        line(format_args!("\n[file.time]"));
        if let Some(column) = time.column {
            line(format_args!("column = {}\nunit = \"{}\"", self.column(column), time.unit));
        }
        if let Some(date) = time.date {
            line(format_args!("date_column = {}", self.column(date)));
        }
        line(format_args!("tick_ns = {:?}", time.tick_ns));
        if let Some(ticks) = time.gap_after_ticks {
            line(format_args!("gap_after_ticks = {ticks:?}"));
        }
        for sensors in &self.sensors {
            let counts = sensors.units.iter().all(|(unit, _)| unit == "counts");
            let output = if counts { "counts" } else { "mean" };
            line(format_args!("\n[file.{}]\noutput = \"{output}\"", sensors.kind));
            if let Some(counter) = sensors.counter {
                line(format_args!("sequence_column = {}", self.column(counter)));
            }
            if sensors.may_be_empty {
                line(format_args!("may_be_empty = true"));
            }
            line(format_args!("sensors = ["));
            for ((column, (unit, scale)), turned) in
                sensors.columns.iter().zip(&sensors.units).zip(sensors.turned)
            {
                let sign = if turned { ", sign = -1" } else { "" };
                let scale = scale.map_or_else(String::new, |scale| format!(", scale = {scale:?}"));
                let source = column.map_or("constant = 0.0".to_owned(), |column| {
                    format!("column = {}", self.column(column))
                });
                line(format_args!("    {{ {source}, unit = \"{unit}\"{sign}{scale} }},"));
            }
            line(format_args!("]"));
        }
        for temperature in &self.temperatures {
            let (channel, column) = (quoted(&temperature.channel), self.column(temperature.column));
            line(format_args!(
                "\n[[file.temperature]]\nchannel = {channel}\ncolumn = {column}\nunit = \"{}\"",
                temperature.unit
            ));
            if temperature.may_be_empty {
                line(format_args!("may_be_empty = true"));
            }
        }
        text
    }

    /// A column by its name where the header has one that stands alone, else by its number.
    fn column(&self, index: usize) -> String {
        let name =
            self.found.header.as_ref().filter(|_| self.found.by_name).and_then(|names| names.get(index));
        name.filter(|name| !name.is_empty()).map_or_else(|| (index + 1).to_string(), |name| quoted(name))
    }
}
