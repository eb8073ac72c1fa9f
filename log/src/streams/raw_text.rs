//! Raw streams as a text log, with the mapping that reads it back to the same ticks.
//!
//! One row per time. Counts are whole numbers, means and readings have as many digits as it takes to read the same bits
//! back. What a text log has no place for: the producer's series (a run that numbers do not tell is a file of its own), health readings, the
//! payload of a NaN, and how ticks were put into messages.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::{self, Write};

use isotherm_correction::sample::{AccelTick, ChannelName, GyroTick, OutputKind};

use super::contents::{Shape, UnitContents, usual};
use super::rows::Row;
use crate::offline::rows::mode_cell;

/// Sensors of a gyro section that no row fills: a mapping must have one.
const UNFILLED: Shape = Shape { counts: false, sensors: 3, half_periods: false };

/// The columns of a unit's text log.
#[derive(Debug, Clone, PartialEq)]
pub struct RawColumns {
    /// What the log is of, for the mapping's description.
    unit: String,
    gyro: Shape,
    accel: Option<Shape>,
    mode: bool,
    meander: bool,
    /// Temperature channels with the names of their columns.
    channels: Vec<(ChannelName, String)>,
}

/// What a row could not hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct NotHeld {
    /// Ticks with another number or kind of readings than the columns are for.
    pub other_shape: u64,
    /// Temperature readings of channels that have no column.
    pub no_column: u64,
}

impl RawColumns {
    /// The columns for what a log holds of a unit: for the shape that most of its ticks have.
    #[must_use]
    pub fn of(unit: &str, contents: &UnitContents) -> Self {
        // A mapping has no channel without a name.
        let named = contents.channels.iter().filter(|channel| !channel.trim().is_empty());
        let mut taken = BTreeSet::new();
        Self {
            unit: unit.to_owned(),
            gyro: usual(&contents.gyro).unwrap_or(UNFILLED),
            accel: usual(&contents.accel),
            mode: contents.mode,
            meander: contents.meander,
            channels: named.map(|channel| (*channel, column_name(channel, &mut taken))).collect(),
        }
    }

    /// The columns of a log that was written here, by its header; `whole` says of a column whether all its numbers are whole, as counts
    /// are. A channel has the name that its column has.
    pub(crate) fn of_header(header: &[String], whole: impl Fn(usize) -> bool) -> Option<Self> {
        let channel = |name: &String| {
            let channel = name.strip_prefix("temperature_")?;
            Some((ChannelName::from(channel).ok()?, name.clone()))
        };
        let has = |column: &str| header.iter().any(|name| name == column);
        let shape = |kind: &str, half_periods| {
            let is_sensor =
                |name: &String| name.strip_prefix(kind).is_some_and(|number| number.parse::<usize>().is_ok());
            let mut sensors = header.iter().enumerate().filter(|(_, name)| is_sensor(name));
            let (count, counts) = (sensors.clone().count(), sensors.all(|(index, _)| whole(index)));
            (count > 0).then_some(Shape { counts, sensors: count, half_periods })
        };
        let columns = Self {
            unit: String::new(),
            gyro: shape("gyro_", has("half_positive_1"))?,
            accel: shape("accel_", false),
            mode: has("mode"),
            meander: has("meander"),
            channels: header.iter().filter_map(channel).collect(),
        };
        (columns.names() == header).then_some(columns)
    }

    /// What the log holds, in a line.
    pub(crate) fn words(&self) -> String {
        let sensors = |shape: Shape, kind: &str| {
            format!("{} {kind} ({})", shape.sensors, if shape.counts { "counts" } else { "means" })
        };
        let mut words = vec![sensors(self.gyro, "gyros")];
        words.extend(self.accel.map(|shape| sensors(shape, "accelerometers")));
        words.push(format!("{} temperature channels", self.channels.len()));
        words.join(", ")
    }

    /// Names of the columns.
    fn names(&self) -> Vec<String> {
        let mut names = vec!["end_time_ns".to_owned()];
        names.extend(self.channels.iter().map(|(_, column)| column.clone()));
        if let Some(accel) = self.accel {
            names.extend(["accel_sequence".to_owned(), "accel_duration_ns".to_owned()]);
            names.extend((1..=accel.sensors).map(|number| format!("accel_{number}")));
        }
        names.extend(["gyro_sequence".to_owned(), "gyro_duration_ns".to_owned()]);
        if self.mode {
            names.extend(["mode".to_owned(), "switch".to_owned()]);
        }
        if self.meander {
            names.push("meander".to_owned());
        }
        names.extend((1..=self.gyro.sensors).map(|number| format!("gyro_{number}")));
        if self.gyro.half_periods {
            let halves = |n| [format!("half_positive_{n}"), format!("half_negative_{n}")];
            names.extend((1..=self.gyro.sensors).flat_map(halves));
        }
        names
    }

    /// The mapping that reads the log back.
    #[must_use]
    pub fn mapping(&self) -> String {
        let unit = &self.unit;
        format!(
            "# Reads a log of unit {unit} that isotherm-replay wrote.\nversion = 1\n{}",
            self.file_text("", false)
        )
    }

    /// A file's part of a mapping; `name`, the line that names it, may be empty.
    pub(crate) fn file_text(&self, name: &str, skip_bad_rows: bool) -> String {
        let bad = if skip_bad_rows { "on_bad_row = \"skip\"\n" } else { "" };
        let mut text = format!(
            "\n[[file]]\n{name}delimiter = \"comma\"\nheader = true\n{bad}\n[file.time]\ncolumn = \"end_time_ns\"\nunit = \"ns\"\n"
        );
        text.push_str(&section("gyro", "rad_per_s", self.gyro));
        if self.mode {
            text.push_str(
                "mode = { column = \"mode\", may_be_empty = true }\nswitch = { column = \"switch\" }\n",
            );
        }
        if self.meander {
            text.push_str("meander = { column = \"meander\", may_be_empty = true }\n");
        }
        if self.gyro.half_periods {
            text.push_str("half_periods = [\n");
            for n in 1..=self.gyro.sensors {
                let _ = writeln!(
                    text,
                    "    {{ positive = \"half_positive_{n}\", negative = \"half_negative_{n}\" }},"
                );
            }
            text.push_str("]\n");
        }
        if let Some(accel) = self.accel {
            text.push_str(&section("accel", "raw", accel));
        }
        for (channel, column) in &self.channels {
            let channel = toml::Value::String(channel.to_string());
            let _ = write!(
                text,
                "\n[[file.temperature]]\nchannel = {channel}\ncolumn = \"{column}\"\nunit = \"raw\"\nmay_be_empty = true\n"
            );
        }
        text
    }

    /// Writes the header line.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_header(&self, writer: &mut dyn Write) -> io::Result<()> {
        writeln!(writer, "{}", self.names().join(","))
    }

    /// Writes a row; gives what of it has no place, and whether anything was written.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_row(&self, row: &Row, writer: &mut dyn Write) -> io::Result<(NotHeld, bool)> {
        let gyro = row.gyro.as_ref().filter(|(output, tick)| {
            Shape::of(*output, &tick.readings, !tick.half_periods.is_empty()) == self.gyro
        });
        let accel = row.accel.as_ref();
        let accel =
            accel.filter(|(output, tick)| self.accel == Some(Shape::of(*output, &tick.readings, false)));
        let has_column = |channel| self.channels.iter().any(|(known, _)| *known == channel);
        let held = row.temperatures.iter().filter(|reading| has_column(reading.channel)).count();
        let not_held = NotHeld {
            other_shape: u64::from(row.gyro.is_some() && gyro.is_none())
                + u64::from(row.accel.is_some() && accel.is_none()),
            no_column: (row.temperatures.len() - held) as u64,
        };
        if gyro.is_none() && accel.is_none() && held == 0 {
            return Ok((not_held, false));
        }
        write!(writer, "{}", row.time_ns)?;
        for (channel, _) in &self.channels {
            writer.write_all(b",")?;
            if let Some(reading) = row.temperatures.iter().find(|reading| reading.channel == *channel) {
                write!(writer, "{:?}", reading.raw)?;
            }
        }
        self.write_accel(accel.map(|(_, tick)| tick), writer)?;
        self.write_gyro(gyro.map(|(_, tick)| tick), writer)?;
        writeln!(writer)?;
        Ok((not_held, true))
    }

    fn write_accel(&self, tick: Option<&AccelTick>, writer: &mut dyn Write) -> io::Result<()> {
        match (self.accel, tick) {
            (None, _) => Ok(()),
            (Some(shape), None) => write_empty(shape.sensors + 2, writer),
            (Some(shape), Some(tick)) => {
                write!(writer, ",{},{}", tick.sequence, tick.duration.as_ns())?;
                write_readings(shape.output(), &tick.readings, writer)
            }
        }
    }

    fn write_gyro(&self, tick: Option<&GyroTick>, writer: &mut dyn Write) -> io::Result<()> {
        let Shape { sensors, half_periods, .. } = self.gyro;
        let Some(tick) = tick else {
            let states = 2 * usize::from(self.mode) + usize::from(self.meander);
            return write_empty(2 + states + sensors * if half_periods { 3 } else { 1 }, writer);
        };
        write!(writer, ",{},{}", tick.sequence, tick.duration.as_ns())?;
        if self.mode {
            write!(writer, ",{},{}", mode_cell(tick.mode), u8::from(tick.switch_command))?;
        }
        if self.meander {
            write!(writer, ",{}", mode_cell(tick.meander))?;
        }
        write_readings(self.gyro.output(), &tick.readings, writer)?;
        tick.half_periods.iter().try_for_each(|half| write!(writer, ",{},{}", half.positive, half.negative))
    }
}

/// The part of a mapping for sensors of one kind.
fn section(kind: &str, unit: &str, shape: Shape) -> String {
    let (output, unit) = if shape.counts { ("counts", "counts") } else { ("mean", unit) };
    let mut text = format!(
        "\n[file.{kind}]\noutput = \"{output}\"\nsequence_column = \"{kind}_sequence\"\n\
         duration_column = \"{kind}_duration_ns\"\nduration_unit = \"ns\"\nmay_be_empty = true\nsensors = [\n"
    );
    for number in 1..=shape.sensors {
        let _ = writeln!(text, "    {{ column = \"{kind}_{number}\", unit = \"{unit}\" }},");
    }
    text.push_str("]\n");
    text
}

/// Name of a channel's column: its letters and digits, and a number where that is taken.
fn column_name(channel: &str, taken: &mut BTreeSet<String>) -> String {
    let plain: String = channel.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    free_name(format!("temperature_{plain}"), taken)
}

/// A name, with a number from 2 where it is taken already; it is taken from then on.
pub(crate) fn free_name(name: String, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    let free = std::iter::once(name.clone()).chain(numbered).find(|name| !taken.contains(name));
    let free = free.unwrap_or(name);
    taken.insert(free.clone());
    free
}

/// Writes readings: counts as whole numbers, means in the shortest way that reads back to the bit.
fn write_readings(output: OutputKind, values: &[f64], writer: &mut dyn Write) -> io::Result<()> {
    values.iter().try_for_each(|value| match output {
        OutputKind::Counts => write!(writer, ",{value:.0}"),
        OutputKind::Mean => write!(writer, ",{value:?}"),
    })
}

/// Writes empty cells.
fn write_empty(cells: usize, writer: &mut dyn Write) -> io::Result<()> {
    (0..cells).try_for_each(|_| writer.write_all(b","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_odd_channels_have_plain_and_different_names() {
        let mut taken = BTreeSet::new();
        let names: Vec<_> =
            ["board", "a b", "a,b", "a\"b", "µ"].map(|name| column_name(name, &mut taken)).into();
        assert_eq!(
            names,
            [
                "temperature_board",
                "temperature_a_b",
                "temperature_a_b_2",
                "temperature_a_b_3",
                "temperature__"
            ]
        );
    }
}
