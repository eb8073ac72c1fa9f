//! A file's mapping with every column as an index.

use isotherm_correction::sample::{ChannelName, OutputKind, Sensors};
use isotherm_document::escape::clipped;

use super::error::Reason;
use crate::mapping::{
    Column, Conversion, FileMapping, ModeMapping, SensorUnit, StatusMapping, SwitchMapping, TemperatureUnit,
    TickMapping, TimeColumn, TimeUnit,
};

/// What of a header is shown, in characters.
const LONGEST_HEADER: usize = 300;

/// A column of times or durations.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimeCell {
    /// Which cell.
    pub(super) cell: usize,
    /// Its unit.
    pub(super) unit: TimeUnit,
    /// Cell of the date, where the other has the time of day alone.
    pub(super) date: Option<usize>,
}

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
    pub(super) duration: Option<TimeCell>,
    /// Rows without these sensors are in order.
    pub(super) may_be_empty: bool,
}

/// A cell of two states.
#[derive(Debug, Clone)]
pub(super) struct StateCell {
    /// Which cell.
    pub(super) cell: usize,
    /// What means +1, or yes.
    pub(super) plus: String,
    /// What means −1, or no.
    pub(super) minus: String,
    /// An empty cell is no state at all.
    pub(super) may_be_empty: bool,
}

/// Where switch commands come from.
#[derive(Debug, Clone)]
pub(super) enum SwitchCells {
    /// There are none.
    None,
    /// A cell.
    Cell(StateCell),
    /// Changes of mode.
    ModeChange,
}

/// The gyros.
#[derive(Debug, Clone)]
pub(super) struct GyroCells {
    /// Sensors and their ticks.
    pub(super) ticks: TickCells,
    /// Lasing mode.
    pub(super) mode: Option<StateCell>,
    /// Switch commands.
    pub(super) switch: SwitchCells,
    /// Phase of the slow meander.
    pub(super) meander: Option<StateCell>,
    /// Half-period counts.
    pub(super) half_periods: Sensors<(usize, usize)>,
}

/// One temperature channel.
#[derive(Debug, Clone)]
pub(super) struct TemperatureCell {
    /// Name.
    pub(super) channel: ChannelName,
    /// Which cell.
    pub(super) cell: usize,
    /// Its unit.
    pub(super) unit: TemperatureUnit,
    /// Every how many rows a reading is taken.
    pub(super) every_rows: u64,
    /// Rows without a reading are in order.
    pub(super) may_be_empty: bool,
    /// Rows since the last reading that was taken.
    pub(super) since: u64,
}

/// All columns of a file.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    /// Stamps.
    pub(super) stamps: Option<TimeCell>,
    /// The gyros.
    pub(super) gyro: Option<GyroCells>,
    /// The accelerometers.
    pub(super) accel: Option<TickCells>,
    /// Temperature channels.
    pub(super) temperatures: Vec<TemperatureCell>,
    /// What says whether a row holds, and where.
    pub(super) status: Option<(usize, StatusMapping)>,
    /// What the unit's rows hold, and where.
    pub(super) select: Option<(usize, String)>,
}

impl Columns {
    /// The ticks of each kind: gyros, accelerometers.
    pub(super) fn ticks(&self) -> [Option<&TickCells>; 2] {
        [self.gyro.as_ref().map(|gyro| &gyro.ticks), self.accel.as_ref()]
    }

    /// Those that number the rows: the gyros, else the accelerometers.
    pub(super) fn leading(&self) -> Option<&TickCells> {
        let [gyro, accel] = self.ticks();
        gyro.or(accel)
    }

    /// Cell of the number that every row has: that of its gyros, in a file without gyros of its accelerometers.
    pub(super) fn row_number(&self) -> Option<usize> {
        self.leading().filter(|ticks| !ticks.may_be_empty)?.sequence
    }

    /// Refuses a sensor's column that is something else, too. Two temperature channels may share a thermometer.
    fn apart(&self) -> Result<(), Reason> {
        let mut sensors: Vec<(usize, String)> = Vec::new();
        let mut others: Vec<(usize, String)> = Vec::new();
        for (kind, ticks) in ["gyro", "accelerometer"].into_iter().zip(self.ticks()) {
            let Some(ticks) = ticks else { continue };
            let numbered = ticks.sensors.iter().zip(1..);
            sensors.extend(
                numbered
                    .filter_map(|((source, _), number)| Some((source.cell()?, format!("{kind} {number}")))),
            );
            others.extend(ticks.sequence.map(|cell| (cell, format!("sequence number of the {kind}s"))));
            others.extend(ticks.duration.map(|time| (time.cell, format!("duration of the {kind}s"))));
        }
        let stamps = self.stamps.iter().flat_map(|time| std::iter::once(time.cell).chain(time.date));
        others.extend(stamps.map(|cell| (cell, "time".to_owned())));
        others.extend(self.status.as_ref().map(|(cell, _)| (*cell, "status".to_owned())));
        let channel =
            |of: &TemperatureCell| (of.cell, format!("temperature channel {:?}", of.channel.as_str()));
        others.extend(self.temperatures.iter().map(channel));
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

/// Finds every column of a mapping among the names of a header.
pub(super) fn resolve(mapping: &FileMapping, header: &[String]) -> Result<Columns, Reason> {
    let find = |column: &Column| find(column, header);
    let stamps = mapping.time.stamps.as_ref().map(|stamps| time(stamps, header)).transpose()?;
    let gyro = match &mapping.gyro {
        None => None,
        Some(gyro) => {
            let mut half_periods = Sensors::new();
            for half in &gyro.half_periods {
                half_periods.push((find(&half.positive)?, find(&half.negative)?));
            }
            Some(GyroCells {
                ticks: ticks(&gyro.ticks, header)?,
                mode: gyro.mode.as_ref().map(|mode| state(mode, header)).transpose()?,
                switch: match &gyro.switch {
                    None => SwitchCells::None,
                    Some(SwitchMapping { column: None, .. }) => SwitchCells::ModeChange,
                    Some(SwitchMapping { column: Some(column), .. }) => SwitchCells::Cell(StateCell {
                        cell: find(column)?,
                        plus: "1".into(),
                        minus: "0".into(),
                        may_be_empty: false,
                    }),
                },
                meander: gyro.meander.as_ref().map(|mode| state(mode, header)).transpose()?,
                half_periods,
            })
        }
    };
    let accel = mapping.accel.as_ref().map(|accel| ticks(accel, header)).transpose()?;
    let temperatures = mapping.temperatures.iter().map(|temperature| {
        Ok(TemperatureCell {
            channel: temperature.channel,
            cell: find(&temperature.column)?,
            unit: temperature.unit,
            every_rows: temperature.every_rows,
            may_be_empty: temperature.may_be_empty,
            since: 0,
        })
    });
    let temperatures = temperatures.collect::<Result<_, Reason>>()?;
    let status =
        mapping.status.as_ref().map(|status| Ok((find(&status.column)?, status.clone()))).transpose()?;
    let select = mapping.select.as_ref();
    let select =
        select.map(|select| Ok((find(&select.column)?, select.value.trim().to_owned()))).transpose()?;
    let columns = Columns { stamps, gyro, accel, temperatures, status, select };
    columns.apart().map(|()| columns)
}

/// Sensors of one kind.
fn ticks<U: SensorUnit>(mapping: &TickMapping<U>, header: &[String]) -> Result<TickCells, Reason> {
    let mut sensors = Sensors::new();
    for sensor in &mapping.sensors {
        let constant = Source::Constant(sensor.constant.unwrap_or_default());
        let cell = sensor.column.as_ref().map(|column| find(column, header)).transpose()?;
        sensors.push((cell.map_or(constant, Source::Cell), sensor.conversion()));
    }
    Ok(TickCells {
        output: mapping.output,
        sensors,
        sequence: mapping.sequence.as_ref().map(|column| find(column, header)).transpose()?,
        duration: mapping.duration().map(|duration| time(&duration, header)).transpose()?,
        may_be_empty: mapping.may_be_empty,
    })
}

/// A column of times.
fn time(mapping: &TimeColumn, header: &[String]) -> Result<TimeCell, Reason> {
    let date = mapping.date.as_ref().map(|date| find(date, header)).transpose()?;
    Ok(TimeCell { cell: find(&mapping.column, header)?, unit: mapping.unit, date })
}

/// A column of two states.
fn state(mapping: &ModeMapping, header: &[String]) -> Result<StateCell, Reason> {
    Ok(StateCell {
        cell: find(&mapping.column, header)?,
        plus: mapping.plus.trim().to_owned(),
        minus: mapping.minus.trim().to_owned(),
        may_be_empty: mapping.may_be_empty,
    })
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
