//! A file's mapping with every column as an index.

use isotherm_correction::sample::{OutputKind, Sensors};
use isotherm_document::escape::clipped;

use super::error::Reason;
use crate::mapping::{
    Column, Conversion, FileMapping, SensorMapping, SensorUnit, TemperatureMapping, TickMapping, TimeColumn,
};

/// What of a header is shown, in characters.
const LONGEST_HEADER: usize = 300;

/// Where a sensor's reading comes from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Source {
    /// A cell.
    Cell(usize),
    /// None: the log does not have this sensor.
    Constant(f64),
}

impl Source {
    /// The cell.
    pub(super) fn cell(self) -> Option<usize> {
        match self {
            Self::Cell(cell) => Some(cell),
            Self::Constant(_) => None,
        }
    }
}

/// Sensors of one kind.
#[derive(Debug, Clone)]
pub(super) struct TickCells {
    /// What the readings stand for.
    pub(super) output: OutputKind,
    /// Source and conversion of each sensor.
    pub(super) sensors: Sensors<(Source, Conversion)>,
    /// Sequence numbers.
    pub(super) sequence: Option<usize>,
    /// Durations.
    pub(super) duration: Option<TimeColumn>,
    /// Rows without these sensors are in order.
    pub(super) may_be_empty: bool,
}

/// What a file's mapping comes to.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    /// Ticks of each kind: gyros, accelerometers.
    pub(super) ticks: [Option<TickCells>; 2],
    /// A change of mode is a switch.
    pub(super) by_mode: bool,
    /// Rows of each temperature channel since the last reading that was taken.
    pub(super) since: Vec<u64>,
}

impl Columns {
    /// Those that number the rows: the gyros, else the accelerometers.
    pub(super) fn leading(&self) -> Option<&TickCells> {
        self.ticks.iter().flatten().next()
    }

    /// Cell of the number that every row has: that of its gyros, in a file without gyros of its accelerometers.
    pub(super) fn row_number(&self) -> Option<usize> {
        self.leading().filter(|ticks| !ticks.may_be_empty)?.sequence
    }

    /// Refuses a sensor's column that is something else, too. Two temperature channels may share a thermometer.
    fn apart(&self, mapping: &FileMapping) -> Result<(), Reason> {
        let mut sensors: Vec<(usize, String)> = Vec::new();
        let mut others: Vec<(usize, String)> = Vec::new();
        for (kind, ticks) in ["gyro", "accelerometer"].into_iter().zip(&self.ticks) {
            let Some(ticks) = ticks else { continue };
            let numbered = ticks.sensors.iter().zip(1..);
            sensors.extend(
                numbered
                    .filter_map(|((source, _), number)| Some((source.cell()?, format!("{kind} {number}")))),
            );
            others.extend(ticks.sequence.map(|cell| (cell, format!("sequence number of the {kind}s"))));
            others.extend(
                ticks.duration.iter().map(|time| (time.column.index(), format!("duration of the {kind}s"))),
            );
        }
        let FileMapping { time, temperatures, status, .. } = mapping;
        let stamps = time.stamps.iter().flat_map(|time| std::iter::once(&time.column).chain(&time.date));
        others.extend(stamps.map(|column| (column.index(), "time".to_owned())));
        others.extend(status.iter().map(|status| (status.column.index(), "status".to_owned())));
        let channel = |of: &TemperatureMapping| {
            (of.column.index(), format!("temperature channel {:?}", of.channel.as_str()))
        };
        others.extend(temperatures.iter().map(channel));
        for (at, (column, first)) in sensors.iter().enumerate() {
            let mut others = sensors.iter().skip(at + 1).chain(&others);
            if let Some((_, second)) = others.find(|(other, _)| other == column) {
                let (first, second) = (first.clone(), second.clone());
                return Err(Reason::ColumnTwice { column: column + 1, first, second });
            }
        }
        Ok(())
    }
}

/// Finds every column of a mapping among the names of a header: each is an index from then on.
pub(super) fn resolve(mapping: &mut FileMapping, header: &[String]) -> Result<Columns, Reason> {
    for column in mapping.columns_mut() {
        *column = Column::Index(find(column, header)?);
    }
    // As cells are.
    let trim = |text: &mut String| *text = text.trim().to_owned();
    if let Some(gyro) = &mut mapping.gyro {
        let states = gyro.mode.iter_mut().chain(&mut gyro.meander);
        states.for_each(|state| [&mut state.plus, &mut state.minus].into_iter().for_each(trim));
    }
    mapping.select.iter_mut().for_each(|select| trim(&mut select.value));
    mapping.status.iter_mut().flat_map(|status| &mut status.good).for_each(trim);
    let gyro = mapping.gyro.as_ref();
    let mut ticks = [gyro.map(|gyro| TickCells::of(&gyro.ticks)), mapping.accel.as_ref().map(TickCells::of)];
    // The number of gyros that are in every row is the row's, and that of accelerometers that are in every row.
    let [of_gyros, of_accels] = ticks.each_mut().map(|ticks| ticks.as_mut().filter(|it| !it.may_be_empty));
    if let (Some(gyros), Some(accels)) = (of_gyros, of_accels) {
        accels.sequence = accels.sequence.or(gyros.sequence);
    }
    let switch = gyro.and_then(|gyro| gyro.switch.as_ref());
    let by_mode = switch.is_some_and(|switch| switch.column.is_none());
    let columns = Columns { ticks, by_mode, since: vec![0; mapping.temperatures.len()] };
    columns.apart(mapping).map(|()| columns)
}

impl TickCells {
    /// Of sensors whose columns are found.
    fn of<U: SensorUnit>(mapping: &TickMapping<U>) -> Self {
        let sensor = |sensor: &SensorMapping<U>| {
            let constant = Source::Constant(sensor.constant.unwrap_or_default());
            let cell = sensor.column.as_ref().map(Column::index);
            (cell.map_or(constant, Source::Cell), sensor.conversion())
        };
        Self {
            output: mapping.output,
            sensors: mapping.sensors.iter().map(sensor).collect(),
            sequence: mapping.sequence.as_ref().map(Column::index),
            duration: mapping.duration(),
            may_be_empty: mapping.may_be_empty,
        }
    }
}

impl Column {
    /// Its place; none that a row has, of a column that has not been found.
    pub(super) fn index(&self) -> usize {
        match self {
            Self::Index(index) => *index,
            Self::Name(_) => usize::MAX,
        }
    }
}

/// Index of a column.
fn find(column: &Column, header: &[String]) -> Result<usize, Reason> {
    let name = match column {
        Column::Index(index) => return Ok(*index),
        Column::Name(name) => name,
    };
    let mut found = header.iter().enumerate().filter(|(_, head)| *head == name).map(|(index, _)| index);
    match (found.next(), found.next()) {
        (Some(index), None) => Ok(index),
        (Some(_), Some(_)) => Err(Reason::AmbiguousColumn { name: name.clone() }),
        (None, _) => {
            let header = clipped(&header.join(", "), LONGEST_HEADER);
            Err(Reason::NoSuchColumn { name: name.clone(), header })
        }
    }
}
