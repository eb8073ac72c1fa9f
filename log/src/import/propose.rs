//! From what was found of a log to a mapping, and to what must be asked.

mod rows;
mod time;
mod written;

use std::collections::BTreeMap;
use std::path::Path;

use super::figures::{Column, Figures, usual_size};
use super::layout::{self, Found};
use super::names::{Kind, Meaning, kind_by_unit, meaning};
use super::{Asked, Hints, Proposal, refuse, states};
use crate::error::Error;
use crate::streams::raw_text::RawColumns;
use written::name_line;

/// Standard gravity in the units that an accelerometer may have.
const GRAVITY: [(&str, f64); 3] = [("m_per_s2", 9.80665), ("g", 1.0), ("mg", 1000.0)];

/// Longest beginning of a channel's name (bytes): an axis and a number may follow.
const LONGEST_STEM: usize = 20;

/// Proposes a mapping for the files of one log.
///
/// # Errors
/// [`Error::File`]; [`Error::Usage`] for a file that no mapping can describe, or without gyros.
pub fn propose(paths: &[impl AsRef<Path>], hints: &Hints) -> Result<Proposal, Error> {
    let mut proposal = Proposal { mapping: String::new(), notes: Vec::new(), open: Vec::new() };
    let names: Vec<_> = paths
        .iter()
        .map(|path| {
            path.as_ref().file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
        })
        .collect();
    for (path, name) in paths.iter().zip(&names) {
        let found = layout::find(path.as_ref(), hints)?;
        let figures_of = |select| Figures::of(path.as_ref(), &found, hints.date_order(), select);
        let of_all = figures_of(None)?;
        let of_one;
        let mut file = File { name, found: &found, figures: &of_all, hints, select: None };
        let asked = proposal.open.len();
        let select = file.select(path.as_ref(), &mut proposal)?;
        if proposal.open.len() > asked {
            continue;
        }
        if select.is_some() {
            of_one = figures_of(select)?;
            file = File { figures: &of_one, select, ..file };
        }
        let several = paths.len() > 1;
        let text = match file.own() {
            Some(columns) => {
                proposal.notes.push(format!("{name}: written by isotherm-replay: {}", columns.words()));
                let line = if several { name_line(name) + "\n" } else { String::new() };
                columns.file_text(&line, hints.skip_bad_rows)
            }
            None => file.text(several, &mut proposal),
        };
        proposal.mapping.push_str(&text);
    }
    let has_gyros = proposal.mapping.contains("[file.gyro]");
    if !has_gyros
        && !proposal.open.iter().any(|open| matches!(open.asked, Asked::Columns(_) | Asked::Serial(_)))
    {
        let first = paths.first().map_or(Path::new("the log"), AsRef::as_ref);
        return Err(refuse(first, "has no gyro columns with known names: name the columns with --columns"));
    }
    let notes: Vec<_> = proposal.notes.iter().map(|note| format!("#   {note}\n")).collect();
    proposal.mapping = format!(
        "# Proposed by `isotherm-replay import` for {}; please check.\n{}version = 1\n{}",
        names.join(", "),
        notes.concat(),
        proposal.mapping
    );
    Ok(proposal)
}

/// A file with all that is known of it.
#[derive(Debug, Clone, Copy)]
struct File<'a> {
    name: &'a str,
    found: &'a Found,
    figures: &'a Figures,
    hints: &'a Hints,
    /// Column of serials, and the one whose rows are taken.
    select: Option<(usize, &'a str)>,
}

/// The columns of x, y and z.
type Axes<'m> = [Option<(usize, &'m Meaning)>; 3];

/// Sensors of one kind.
struct Sensors {
    kind: &'static str,
    /// Of x, y and z; `None` for an axis that the log does not have.
    columns: [Option<usize>; 3],
    /// Of each; and how much of the unit a reading of 1 is, where it is not one.
    units: [(String, Option<f64>); 3],
    /// Whose name begins with a minus: the other way round.
    turned: [bool; 3],
    counter: Option<usize>,
    may_be_empty: bool,
}

/// A temperature channel.
struct Temperature {
    channel: String,
    column: usize,
    unit: &'static str,
    may_be_empty: bool,
}

/// Columns that mean something.
type Meanings = Vec<(usize, Meaning)>;

impl<'a> File<'a> {
    /// The columns of a log that `simulate` or `convert` wrote, where nothing else is said of it. Means have a fraction, if of zero.
    fn own(self) -> Option<RawColumns> {
        let header = self.found.header.as_ref().filter(|_| self.found.by_name)?;
        let said = Hints { skip_bad_rows: self.hints.skip_bad_rows, ..Hints::default() };
        let fraction = |index| {
            let cells = self.found.rows.iter().filter_map(|row| row.split(',').nth(index));
            cells.into_iter().any(|cell| cell.contains('.'))
        };
        let whole = |index: usize| {
            let column = self.figures.columns.get(index);
            column.is_some_and(|column| column.numbers > 0 && column.fractions == 0) && !fraction(index)
        };
        (*self.hints == said).then(|| RawColumns::of_header(header, whole)).flatten()
    }

    /// The file's part of the mapping.
    fn text(self, named: bool, proposal: &mut Proposal) -> String {
        let Found { encoding, delimiter, decimal_mark, .. } = self.found;
        let header = if self.found.header.is_some() { "a header" } else { "no header" };
        proposal.notes.push(format!(
            "{}: {}, {}, decimal mark {:?}, {header}, {} columns, {} rows",
            self.name,
            encoding.word(),
            delimiter.word(),
            char::from(*decimal_mark),
            self.found.width,
            self.figures.rows
        ));
        if self.found.odd > 0 {
            let (name, odd) = (self.name, self.found.odd);
            proposal.notes.push(format!("{name}: {odd} rows of other figures before the data: passed over"));
        }
        let meanings = self.meanings();
        let groups = [Kind::Gyro, Kind::Accel].map(|kind| Self::group(&meanings, kind));
        let of_temperatures = named && meanings.iter().any(|(_, meaning)| meaning.kind == Kind::Temperature);
        if groups.iter().all(Option::is_none) && !of_temperatures {
            self.ask_columns(proposal);
        }
        let counter = self.counter(&meanings, proposal);
        let in_some_rows = groups.map(|group| group.filter(|axes| self.are_in_some_rows(axes)));
        let each_numbered = counter.is_some() && in_some_rows.iter().all(Option::is_none);
        // The gyros set the pace, in a file without gyros the accelerometers.
        let pace = groups.iter().zip(in_some_rows).find(|(group, _)| group.is_some());
        let pace = pace.and_then(|(_, axes)| axes?.into_iter().flatten().next());
        let spacing = pace.map_or(1.0, |(index, _)| self.figures.columns[index].spacing.usual);
        let time = self.time(&meanings, each_numbered, spacing, proposal);
        let mut sensors = Vec::new();
        for (group, kind) in groups.into_iter().zip(["gyro", "accel"]) {
            let Some(axes) = group else { continue };
            let columns = axes.map(|axis| axis.map(|(index, _)| index));
            let units = self.sensor_units(axes, kind, proposal);
            let there: Vec<usize> = columns.into_iter().flatten().collect();
            let may_be_empty = self.are_in_some_rows(&axes);
            let mut said: Vec<_> = units
                .iter()
                .map(|(unit, scale)| scale.map_or_else(String::new, |scale| format!("{scale:?} ")) + unit)
                .collect();
            said.dedup();
            let axes = |there: bool| {
                let named =
                    columns.iter().zip(["x", "y", "z"]).filter(|(column, _)| column.is_some() == there);
                named.map(|(_, axis)| axis).collect::<Vec<_>>().join(" and ")
            };
            let as_axes = match axes(false) {
                none if none.is_empty() => none,
                lacks => format!(" as {}; 0 for {lacks}, which the log does not have", axes(true)),
            };
            proposal.notes.push(format!("{kind}: {} in {}{as_axes}", self.listed(&there), said.join(", ")));
            let is_minus = |index: &usize| {
                self.names().get(*index).is_some_and(|name| name.trim_start().starts_with(['-', '−']))
            };
            let turned = columns.map(|column| column.is_some_and(|index| is_minus(&index)));
            let minus: Vec<usize> = there.into_iter().filter(is_minus).collect();
            if !minus.is_empty() {
                proposal.notes.push(format!("{kind}: sign = -1 for {}, as named", self.listed(&minus)));
            }
            if let Some(counter) = counter.filter(|_| may_be_empty) {
                let counter = self.listed(&[counter]);
                proposal.notes.push(format!("{kind}: in some rows only: not numbered by {counter}"));
            }
            let counter = counter.filter(|_| !may_be_empty);
            sensors.push(Sensors { kind, columns, units, turned, counter, may_be_empty });
        }
        let temperatures = self.temperatures(&meanings, proposal);
        let of_sensors = sensors.iter().flat_map(|it| it.columns).flatten();
        let counters = sensors.iter().filter_map(|it| it.counter);
        let used = of_sensors.chain(temperatures.iter().map(|it| it.column)).chain(counters).chain(time.date);
        self.note_states(proposal);
        self.unused(&used.chain(time.column).collect::<Vec<_>>(), &sensors, proposal);
        self.written(named, &time, &sensors, &temperatures)
    }

    /// Notes which columns with numbers are not used, and asks where one states a sensor's unit and such sensors lack.
    fn unused(self, used: &[usize], sensors: &[Sensors], proposal: &mut Proposal) {
        let names = self.names();
        let left: Vec<_> = (0..names.len())
            .filter(|index| !used.contains(index) && self.has_numbers(*index) && names[*index] != "-")
            .collect();
        if left.is_empty() {
            return;
        }
        proposal.notes.push(format!("not used: {}", self.listed(&left)));
        let lacks = |kind: &str| {
            let found = sensors.iter().find(|sensors| sensors.kind == kind);
            found.is_none_or(|sensors| sensors.columns.iter().any(Option::is_none))
        };
        let asked = proposal.open.iter().any(|open| matches!(open.asked, Asked::Columns(_)));
        let is_sensor = |index: &usize| match kind_by_unit(&names[*index], self.row_unit(*index)) {
            Some(Kind::Gyro) => lacks("gyro"),
            Some(Kind::Accel) => lacks("accel"),
            _ => false,
        };
        if self.hints.columns.is_empty() && !asked && left.iter().any(is_sensor) {
            self.ask_columns(proposal);
        }
    }

    /// The columns' names: those that were given, else the header's.
    fn names(self) -> &'a [String] {
        let given = self.hints.columns.as_slice();
        let names = if given.is_empty() { self.found.header.as_deref().unwrap_or_default() } else { given };
        names.get(..self.found.width).unwrap_or(names)
    }

    /// A column's unit by the row of units, which belongs to the header.
    fn row_unit(self, index: usize) -> Option<&'a str> {
        let row = self.found.units.get(index).map(String::as_str);
        row.filter(|_| self.hints.columns.is_empty())
    }

    /// Whether a number stands in a column; one without says nothing, whatever its name.
    fn has_numbers(self, index: usize) -> bool {
        self.figures.columns.get(index).is_some_and(|column| column.numbers > 0)
    }

    /// Whether sensors have a rhythm of their own.
    fn are_in_some_rows(self, axes: &Axes<'_>) -> bool {
        let column = |index: &usize| self.figures.columns.get(*index).is_some_and(Column::is_in_some_rows);
        axes.iter().flatten().all(|(index, _)| column(index))
    }

    /// What the columns hold: by their names, else by the name of the file.
    fn meanings(self) -> Meanings {
        let names = self.names();
        let columns = names.iter().enumerate().filter(|(index, _)| self.has_numbers(*index));
        let mut meanings: Meanings = columns
            .filter_map(|(index, column)| Some((index, meaning(column, self.row_unit(index))?)))
            .collect();
        let of_file = meaning(&format!("{} x", self.name.split('.').next().unwrap_or_default()), None);
        match of_file {
            Some(file) if names.is_empty() && matches!(file.kind, Kind::Gyro | Kind::Accel) => {
                let time = usize::from(self.found.width == 4 && self.figures.columns[0].increases());
                if self.found.width == time + 3 {
                    let axis = |axis: usize| (time + axis, Meaning { axis: Some(axis), ..file.clone() });
                    meanings.extend((0..3).map(axis));
                    meanings
                        .extend((time == 1).then(|| meaning("time", None)).flatten().map(|time| (0, time)));
                }
            }
            _ => {}
        }
        meanings
    }

    /// The columns of a kind, x, y and z, of the best of those that the log has; of gyros one or two are better than none.
    fn group(meanings: &Meanings, kind: Kind) -> Option<Axes<'_>> {
        let mut groups: BTreeMap<&str, [Option<(usize, &Meaning)>; 4]> = BTreeMap::new();
        for (index, meaning) in meanings.iter().filter(|(_, meaning)| meaning.kind == kind) {
            let axis = meaning.axis.unwrap_or(0);
            groups.entry(&meaning.stem).or_default()[axis].get_or_insert((*index, meaning));
        }
        // Some count from 1.
        let groups = groups.into_values().map(|[x, y, z, fourth]| match (x, fourth) {
            (None, Some(_)) => [y, z, fourth],
            _ => [x, y, z],
        });
        let lacking = |axes: &Axes<'_>| axes.iter().filter(|axis| axis.is_none()).count();
        let rank = |axes: &Axes<'_>| axes.iter().flatten().map(|(_, meaning)| meaning.rank).min();
        let taken = groups.filter(|axes| kind == Kind::Gyro || lacking(axes) == 0);
        taken.min_by_key(|axes| {
            (lacking(axes), rank(axes), axes.iter().flatten().next().map(|(index, _)| *index))
        })
    }

    /// The unit of each as the mapping spells it, and how much of it a reading of 1 is, where it is not one.
    fn sensor_units(self, axes: Axes<'_>, kind: &str, proposal: &mut Proposal) -> [(String, Option<f64>); 3] {
        let hint = if kind == "gyro" { &self.hints.gyro_unit } else { &self.hints.accel_unit };
        let there = || axes.iter().flatten();
        let unknown = there().find_map(|(_, meaning)| meaning.unknown.as_ref());
        // Where only the first of three names its unit, the others have it too.
        let first = there().find(|(_, meaning)| meaning.unit.is_some()).map(|(_, meaning)| *meaning);
        match (hint, first) {
            (None, Some(first)) if unknown.is_none() => axes.map(|axis| {
                let own = axis.map(|(_, meaning)| meaning).filter(|own| own.unit.is_some()).unwrap_or(first);
                (own.unit.unwrap_or_default().to_owned(), own.scale)
            }),
            (Some(unit), _) => [(); 3].map(|()| (unit.clone(), None)),
            _ => {
                let unit = self.guessed_unit(axes, unknown, kind, proposal);
                [(); 3].map(|()| (unit.to_owned(), None))
            }
        }
    }

    /// The unit of sensors whose names state none that is known: a guess, or a question.
    fn guessed_unit(
        self,
        axes: Axes<'_>,
        unknown: Option<&String>,
        kind: &str,
        proposal: &mut Proposal,
    ) -> &'static str {
        let columns = axes.map(|axis| axis.map(|(index, _)| index));
        let increment = axes.iter().flatten().any(|(_, meaning)| meaning.increment);
        let headed = |name: &str| self.found.header.iter().flatten().any(|have| have == name);
        if headed("PacketCounter") && headed("Gyr_X") && !increment {
            proposal.notes.push(format!("{kind}: header of Xsens' MT Manager, which writes rad/s and m/s²"));
            return if kind == "gyro" { "rad_per_s" } else { "m_per_s2" };
        }
        if kind == "accel"
            && unknown.is_none()
            && !increment
            && let [Some(x), Some(y), Some(z)] = columns
            && let Some(size) = usual_size(self.found, [x, y, z])
            && let Some((unit, _)) = GRAVITY.iter().find(|(_, g)| (size / g - 1.0).abs() < 0.1)
        {
            proposal.notes.push(format!("accel: unit from the size at the beginning, {size:.4}"));
            return unit;
        }
        let columns: Vec<usize> = columns.into_iter().flatten().collect();
        let largest = columns.iter().filter_map(|column| self.figures.columns.get(*column));
        let largest = largest.fold(0.0_f64, |largest, column| largest.max(column.largest)).to_string();
        let columns = self.listed(&columns);
        let (asked, sensors) = match kind {
            "gyro" => (Asked::GyroUnit, "gyros"),
            _ => (Asked::AccelUnit, "accelerometers"),
        };
        let help = ": for other units, give the nearest and set `scale` in the mapping";
        let stated = states(unknown, help);
        proposal.ask(
            asked,
            format!("what is the unit of the {sensors} {columns}?{stated} The largest reading is {largest}"),
        );
        "raw"
    }

    fn counter(self, meanings: &Meanings, proposal: &mut Proposal) -> Option<usize> {
        let named = meanings.iter().filter(|(_, meaning)| meaning.kind == Kind::Counter);
        for (index, _) in named {
            let Some(column) = self.figures.columns.get(*index) else { continue };
            let name = self.listed(&[*index]);
            if column.counts() {
                proposal.notes.push(format!("counter: {name}, {} gaps in it", column.steps.gaps));
                return Some(*index);
            }
            proposal.notes.push(match column.steps.back {
                0 => format!("counter: {name} grows by {}, not by one: not used", column.steps.usual),
                back => {
                    format!("counter: {name} restarts {back} times (up to {}): not used", column.maximum)
                }
            });
        }
        None
    }

    fn temperatures(self, meanings: &Meanings, proposal: &mut Proposal) -> Vec<Temperature> {
        let mut found: Vec<Temperature> = Vec::new();
        for (index, meaning) in meanings.iter().filter(|(_, meaning)| meaning.kind == Kind::Temperature) {
            let Some(column) = self.figures.columns.get(*index) else { continue };
            let unknown = meaning.unknown.as_ref().filter(|text| !text.starts_with("deg") && *text != "°");
            let unit = meaning.unit.or(unknown.map(|_| "raw")).unwrap_or_else(|| {
                let likely = column.minimum > -90.0 && column.maximum < 200.0 && column.fractions > 0;
                if likely { "deg_c" } else { "raw" }
            });
            let words: Vec<_> =
                meaning.stem.split(' ').filter(|word| !word.starts_with("temp") && *word != "out").collect();
            let mut channel = match words.join("_") {
                none if none.is_empty() => "imu".to_owned(),
                words => {
                    let fits = |(at, c): &(usize, char)| at + c.len_utf8() <= LONGEST_STEM;
                    words.char_indices().take_while(fits).map(|(_, c)| c).collect()
                }
            };
            if let Some(axis) = meaning.axis {
                channel = format!("{channel}_{}", ["x", "y", "z"][axis]);
            }
            if found.iter().any(|other| other.channel == channel) {
                channel = format!("{channel}_{}", found.len() + 1);
            }
            proposal.notes.push(format!(
                "temperature: {} in {unit} as channel {channel:?}, {} to {}{}",
                self.listed(&[*index]),
                column.minimum,
                column.maximum,
                unknown.map_or_else(String::new, |text| format!(
                    "; the header states {text:?}, which import does not know: the calibration must take it as it is"
                ))
            ));
            let may_be_empty = column.empty > 0;
            found.push(Temperature { channel, column: *index, unit, may_be_empty });
        }
        found
    }

    fn ask_columns(self, proposal: &mut Proposal) {
        let (name, width) = (self.name, self.found.width);
        let header = self.found.header.as_ref().map(|names| names.join(" | "));
        let rows: Vec<_> = header.into_iter().chain(self.found.rows.first().cloned()).collect();
        let words = format!(
            "{name}: which of the {width} columns are gyros, accelerometers, temperatures and the time? \
             The first rows: {}",
            rows.join(" ⏎ ")
        );
        proposal.ask(Asked::Columns(width), words);
    }

    /// Columns for people.
    fn listed(self, columns: &[usize]) -> String {
        let name = |column: &usize| {
            let name = self.found.header.iter().flatten().nth(*column).filter(|name| !name.is_empty());
            name.map_or_else(|| format!("column {}", column + 1), Clone::clone)
        };
        columns.iter().map(name).collect::<Vec<_>>().join(", ")
    }
}
