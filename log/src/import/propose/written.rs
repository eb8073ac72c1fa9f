//! The mapping as text.

use super::time::Time;
use super::{File, Sensors, Temperature};
use crate::mapping::Encoding;

/// The line that names a file, without its end.
pub(super) fn name_line(name: &str) -> String {
    format!("name = {}", quoted(name))
}

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A key that is there where it is true.
fn flag(is_set: bool) -> Option<String> {
    is_set.then(|| "true".to_owned())
}

impl File<'_> {
    /// The file's part of the mapping.
    pub(super) fn written(
        self,
        named: bool,
        time: &Time,
        sensors: &[Sensors],
        temperatures: &[Temperature],
    ) -> String {
        let (found, column) = (self.found, |index| self.column(index));
        let mut text = String::new();
        let mut section = |head: &str, keys: &[(&str, Option<String>)]| {
            text.extend(["\n", head, "\n"]);
            for (key, value) in keys {
                text.extend(value.iter().flat_map(|value| [key, " = ", value, "\n"]));
            }
        };
        let counted = |count: usize| (count > 0).then(|| count.to_string());
        section(
            "[[file]]",
            &[
                ("name", named.then(|| quoted(self.name))),
                ("encoding", (found.encoding != Encoding::Utf8).then(|| quoted(found.encoding.word()))),
                ("delimiter", Some(quoted(found.delimiter.word()))),
                ("decimal_mark", (found.decimal_mark != b'.').then(|| quoted(","))),
                ("comment", found.comment.map(quoted)),
                ("skip_lines", counted(found.skip_lines)),
                ("header", flag(found.by_name)),
                ("drop_rows", counted(found.drop_rows)),
                ("on_bad_row", self.hints.skip_bad_rows.then(|| quoted("skip"))),
            ],
        );
        if let Some((serials, serial)) = self.select {
            section("[file.select]", &[("column", Some(column(serials))), ("value", Some(quoted(serial)))]);
        }
        section(
            "[file.time]",
            &[
                ("column", time.column.map(column)),
                ("unit", time.column.map(|_| quoted(&time.unit))),
                ("date_column", time.date.map(column)),
                ("tick_ns", Some(format!("{:?}", time.tick_ns))),
                ("gap_after_ticks", time.gap_after_ticks.map(|ticks| format!("{ticks:?}"))),
            ],
        );
        for Sensors { kind, columns, units, turned, counter, may_be_empty } in sensors {
            let counts = units.iter().all(|(unit, _)| unit == "counts");
            let each = columns.iter().zip(units).zip(turned).map(|((place, (unit, scale)), turned)| {
                let sign = if *turned { ", sign = -1" } else { "" };
                let scale = scale.map_or_else(String::new, |scale| format!(", scale = {scale:?}"));
                let source =
                    place.map_or("constant = 0.0".to_owned(), |index| format!("column = {}", column(index)));
                format!("    {{ {source}, unit = \"{unit}\"{sign}{scale} }},\n")
            });
            section(
                &format!("[file.{kind}]"),
                &[
                    ("output", Some(quoted(if counts { "counts" } else { "mean" }))),
                    ("sequence_column", counter.map(column)),
                    ("may_be_empty", flag(*may_be_empty)),
                    ("sensors", Some(format!("[\n{}]", each.collect::<String>()))),
                ],
            );
        }
        for temperature in temperatures {
            section(
                "[[file.temperature]]",
                &[
                    ("channel", Some(quoted(&temperature.channel))),
                    ("column", Some(column(temperature.column))),
                    ("unit", Some(quoted(temperature.unit))),
                    ("may_be_empty", flag(temperature.may_be_empty)),
                ],
            );
        }
        text
    }

    /// A column by its name where the header has one that stands alone, else by its number.
    fn column(self, index: usize) -> String {
        let name = self.found.header.iter().flatten().nth(index);
        let name = name.filter(|name| self.found.by_name && !name.is_empty());
        name.map_or_else(|| (index + 1).to_string(), |name| quoted(name))
    }
}
