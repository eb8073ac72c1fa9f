//! The mapping as a whole: its files, and what must hold between them.

use toml::de::DeTable;

use super::section::{Item, Notes, Section};
use super::{Column, Delimiter, FileMapping, Mapping, Problem, VERSION, columns, layout};

/// Most files of one log.
const MAX_FILES: usize = 16;

/// Reads a mapping, or everything that is wrong with it.
pub(super) fn parse(text: &str, file: &str) -> Result<Mapping, Vec<Problem>> {
    let notes = Notes::new(file, text);
    let table = match DeTable::parse(text) {
        Ok(table) => table,
        Err(error) => {
            let at = error.span().map_or(0, |span| span.start);
            notes.add(at, String::new(), String::new(), format!("is not TOML: {}", error.message()));
            return Err(notes.into_problems());
        }
    };
    let root = Section::new(&notes, String::new(), 0, table.get_ref());
    let mapping = mapping(root);
    let problems = notes.into_problems();
    match mapping {
        Some(mapping) if problems.is_empty() => Ok(mapping),
        _ => Err(problems),
    }
}

/// Reads the top table.
fn mapping(root: Section<'_, '_>) -> Option<Mapping> {
    let version = root.need("version", "write version = 1 as the first line");
    if let Some(item) = version
        && item.integer(0..=i64::MAX).is_some_and(|version| version != VERSION)
    {
        item.refuse(format!("this program reads version {VERSION}"));
    }
    // A note for readers; nothing depends on it.
    let _ = root.get("description").and_then(|item| item.string());
    let files = root.need("file", "at least one [[file]]").and_then(|item| files(&item));
    root.finish();
    Some(Mapping { files: files? })
}

/// Reads all files and checks them against each other.
fn files(item: &Item<'_, '_>) -> Option<Vec<FileMapping>> {
    let list = item.list()?;
    if list.is_empty() || list.len() > MAX_FILES {
        item.refuse(format!("has {} files, must have 1 to {MAX_FILES}", list.len()));
        return None;
    }
    let read: Vec<_> = list.iter().map(file).collect();
    let files: Vec<FileMapping> = read.into_iter().collect::<Option<_>>()?;
    let gyros = files.iter().filter(|file| file.gyro.is_some()).count();
    if gyros != 1 {
        item.refuse(format!(
            "{gyros} of the files have a [file.gyro], must be exactly one: gyro ticks lead the log"
        ));
    }
    if files.iter().filter(|file| file.accel.is_some()).count() > 1 {
        item.refuse("more than one file has a [file.accel], must be at most one");
    }
    let channels: Vec<_> = files.iter().flat_map(|file| &file.temperatures).map(|t| t.channel).collect();
    for (index, channel) in channels.iter().enumerate() {
        if channels.iter().take(index).any(|earlier| earlier == channel) {
            item.refuse(format!("temperature channel {channel:?} is there twice"));
        }
    }
    Some(files)
}

/// Reads one file.
fn file(item: &Item<'_, '_>) -> Option<FileMapping> {
    let section = item.section()?;
    let name = section.get("name").and_then(|item| item.string()).map(str::to_owned);
    let layout = layout::layout(&section);
    let gyro = section.get("gyro").map(|item| item.section().and_then(columns::gyro));
    let accel = section.get("accel").map(|item| item.section().and_then(columns::accel));
    let temperatures: Option<Vec<_>> = match section.get("temperature") {
        Some(item) => item.list().and_then(|list| {
            let read: Vec<_> =
                list.iter().map(|item| item.section().and_then(columns::temperature)).collect();
            read.into_iter().collect()
        }),
        None => Some(Vec::new()),
    };
    if gyro.is_none() && accel.is_none() && temperatures.as_ref().is_some_and(Vec::is_empty) {
        section.missing("gyro", "the file must have a [file.gyro], a [file.accel] or a [[file.temperature]]");
    }
    let own = |ticks: &super::TickMapping| ticks.duration.is_some();
    let own_durations = gyro.as_ref().is_none_or(|gyro| gyro.as_ref().is_some_and(|gyro| own(&gyro.ticks)))
        && accel.as_ref().is_none_or(|accel| accel.as_ref().is_some_and(own));
    let time = section.need("time", "a [file.time] with a `column` and its `unit`, or with `tick_ms`");
    let time = time.and_then(|item| item.section()).and_then(|time| {
        let read = layout::time(&time, own_durations);
        time.finish();
        read
    });
    section.finish();
    let file = FileMapping {
        name,
        layout: layout?,
        time: time?,
        gyro: gyro.map_or(Some(None), |gyro| gyro.map(Some))?,
        accel: accel.map_or(Some(None), |accel| accel.map(Some))?,
        temperatures: temperatures?,
    };
    if let Some(name) = file.columns().find_map(Column::name).filter(|_| !file.layout.header) {
        item.refuse(format!("column {name:?} is given by name, but the file has no header: set header = true, or use numbers from 1"));
    }
    let ticks = file.gyro.as_ref().map(|gyro| &gyro.ticks).into_iter().chain(&file.accel);
    let empties =
        ticks.map(|ticks| ticks.may_be_empty).chain(file.temperatures.iter().map(|t| t.may_be_empty));
    if file.layout.delimiter == Delimiter::Whitespace && empties.into_iter().any(|may| may) {
        item.refuse("may_be_empty needs cells that can be empty: with whitespace between them, they cannot");
    }
    Some(file)
}

impl Column {
    /// Its name, where it is given by name.
    fn name(&self) -> Option<&str> {
        match self {
            Self::Name(name) => Some(name),
            Self::Index(_) => None,
        }
    }
}

impl FileMapping {
    /// All columns that the file must have.
    pub(crate) fn columns(&self) -> impl Iterator<Item = &Column> {
        let gyro = self.gyro.as_ref();
        let ticks = gyro.map(|gyro| &gyro.ticks).into_iter().chain(&self.accel);
        let sensors = ticks.clone().flat_map(|ticks| ticks.sensors.iter().map(|sensor| &sensor.column));
        let numbering =
            ticks.flat_map(|ticks| ticks.sequence.iter().chain(ticks.duration.as_ref().map(|d| &d.column)));
        let modes =
            gyro.into_iter().flat_map(|gyro| gyro.mode.iter().chain(&gyro.meander).map(|mode| &mode.column));
        let switch = gyro.and_then(|gyro| match &gyro.switch {
            Some(super::SwitchMapping::Column(column)) => Some(column),
            _ => None,
        });
        let halves = gyro.into_iter().flat_map(|gyro| gyro.half_periods.iter().flat_map(|(a, b)| [a, b]));
        let stamps = self.time.stamps.as_ref().map(|stamps| &stamps.column);
        let temperatures = self.temperatures.iter().map(|temperature| &temperature.column);
        stamps
            .into_iter()
            .chain(sensors)
            .chain(numbering)
            .chain(modes)
            .chain(switch)
            .chain(halves)
            .chain(temperatures)
    }
}
