//! The current row of a file: its cells as numbers, times and states.

use isotherm_correction::sample::{self, HalfPeriodCounts, LasingMode, OutputKind, Sensors};
use isotherm_correction::units::Span;

use super::cells::Cell;
use super::dates::stamp_ns;
use super::error::Reason;
use super::number;
use super::resolve::{Source, TickCells};
use crate::mapping::{GyroMapping, Layout, ModeMapping, StatusMapping, TimeColumn};

/// What is wrong with a row: the cell's index and the reason.
#[derive(Debug)]
pub(super) struct Fault {
    /// Index of the cell; `None` for the line as a whole.
    pub(super) cell: Option<usize>,
    /// What is wrong.
    pub(super) reason: Reason,
}

impl From<Reason> for Fault {
    /// Of a whole line, or of no line at all.
    fn from(reason: Reason) -> Self {
        Self { cell: None, reason }
    }
}

impl Reason {
    /// What is wrong with a cell.
    pub(super) fn at(self, cell: usize) -> Fault {
        Fault { cell: Some(cell), reason: self }
    }
}

/// A row of cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row<'a> {
    /// The line.
    line: &'a [u8],
    /// Where its cells are.
    cells: &'a [Cell],
    /// Decimal mark.
    decimal_mark: u8,
}

/// Readings of one kind in a row, before they have a time.
#[derive(Debug)]
pub(super) struct Readings {
    /// One per sensor; increments are not yet divided by the duration.
    pub(super) values: sample::Readings,
    /// Sequence number that the row states.
    pub(super) sequence: Option<u64>,
    /// Duration that the row states.
    pub(super) duration: Option<Span>,
}

/// What gyros have beside their readings.
#[derive(Debug)]
pub(super) struct GyroStates {
    /// Lasing mode.
    pub(super) mode: Option<LasingMode>,
    /// Switch command, where it has a column.
    pub(super) switch_command: bool,
    /// Phase of the slow meander.
    pub(super) meander: Option<LasingMode>,
    /// Half-period counts.
    pub(super) half_periods: Sensors<HalfPeriodCounts>,
}

impl<'a> Row<'a> {
    /// The cells of a line.
    pub(super) fn new(line: &'a [u8], cells: &'a [Cell], layout: &Layout) -> Self {
        Self { line, cells, decimal_mark: layout.decimal_mark as u8 }
    }

    /// What a cell holds; an empty cell is in order.
    pub(super) fn text(&self, cell: usize) -> Result<&'a [u8], Fault> {
        let found = self.cells.get(cell).and_then(|at| self.line.get(at.start..at.end));
        found.ok_or_else(|| self.missing(cell))
    }

    /// What a cell holds, which must be something.
    fn filled(&self, cell: usize) -> Result<&'a [u8], Fault> {
        let text = self.text(cell)?;
        if text.is_empty() { Err(Reason::Empty.at(cell)) } else { Ok(text) }
    }

    /// The row is too short for a cell.
    #[cold]
    fn missing(&self, cell: usize) -> Fault {
        Reason::MissingCell { cells: self.cells.len() }.at(cell)
    }

    /// A number.
    pub(super) fn float(&self, cell: usize) -> Result<f64, Fault> {
        let text = self.filled(cell)?;
        number::float(text, self.decimal_mark).ok_or_else(|| {
            let comma = self.decimal_mark == b'.' && text.contains(&b',');
            Reason::NotANumber { comma }.at(cell)
        })
    }

    /// A count.
    fn count(&self, cell: usize) -> Result<i32, Fault> {
        let count = number::count(self.filled(cell)?, self.decimal_mark);
        count.ok_or(Reason::NotACount.at(cell))
    }

    /// A time (ns).
    pub(super) fn time_ns(&self, time: &TimeColumn) -> Result<i64, Fault> {
        let cell = time.column.index();
        let text = self.filled(cell)?;
        let (ns, reason) = match (time.unit.scale(), &time.date) {
            (Some(scale), _) => (number::time_ns(text, scale, self.decimal_mark), Reason::NotATime),
            (None, None) => (stamp_ns(text, time.unit), Reason::NotADateTime { unit: time.unit }),
            (None, Some(date)) => {
                let whole = [self.filled(date.index())?, text].join(&b' ');
                (stamp_ns(&whole, time.unit), Reason::NotADateTime { unit: time.unit })
            }
        };
        ns.ok_or(reason.at(cell))
    }

    /// A duration.
    fn span(&self, time: &TimeColumn) -> Result<Span, Fault> {
        match self.time_ns(time)? {
            ns if ns < 0 => Err(Reason::NegativeDuration.at(time.column.index())),
            ns => Ok(Span::from_ns(ns)),
        }
    }

    /// A state.
    fn state(&self, cell: usize, plus: &str, minus: &str) -> Result<bool, Fault> {
        match self.filled(cell)? {
            text if text == plus.as_bytes() => Ok(true),
            text if text == minus.as_bytes() => Ok(false),
            _ => Err(Reason::UnknownState { plus: plus.to_owned(), minus: minus.to_owned() }.at(cell)),
        }
    }

    /// A mode, where the file has a column for it.
    fn mode(&self, mapping: Option<&ModeMapping>) -> Result<Option<LasingMode>, Fault> {
        let sign = |plus| if plus { LasingMode::Plus } else { LasingMode::Minus };
        let Some(ModeMapping { column, plus, minus, may_be_empty }) = mapping else { return Ok(None) };
        if *may_be_empty && self.is_empty(column.index())? {
            return Ok(None);
        }
        self.state(column.index(), plus, minus).map(sign).map(Some)
    }

    /// Whether a cell holds nothing.
    pub(super) fn is_empty(&self, cell: usize) -> Result<bool, Fault> {
        self.text(cell).map(<[u8]>::is_empty)
    }

    /// Readings of one kind; `None` where the row has none and may have none.
    pub(super) fn readings(&self, cells: &TickCells) -> Result<Option<Readings>, Fault> {
        if cells.may_be_empty && !self.has_readings(cells)? {
            return Ok(None);
        }
        let mut values = sample::Readings::default();
        for (source, conversion) in &cells.sensors {
            values.push(match (cells.output, *source) {
                (OutputKind::Counts, Source::Cell(cell)) => f64::from(self.count(cell)?) * conversion.factor,
                (OutputKind::Mean, Source::Cell(cell)) => conversion.of(self.float(cell)?),
                (_, Source::Constant(constant)) => conversion.of(constant),
            });
        }
        let sequence = cells.sequence.map(|cell| self.sequence(cell));
        let duration = cells.duration.as_ref().map(|duration| self.span(duration));
        Ok(Some(Readings { values, sequence: sequence.transpose()?, duration: duration.transpose()? }))
    }

    /// Refuses a row that does not hold by its status.
    pub(super) fn check_status(&self, status: &StatusMapping) -> Result<(), Fault> {
        let cell = status.column.index();
        let text = self.filled(cell)?;
        let holds = match status.bad_bits {
            None => status.good.iter().any(|good| good.as_bytes() == text),
            Some(bits) => number::word(text).ok_or(Reason::NotAWord.at(cell))? & bits == 0,
        };
        if holds { Ok(()) } else { Err(Reason::BadStatus.at(cell)) }
    }

    /// A sequence number.
    pub(super) fn sequence(&self, cell: usize) -> Result<u64, Fault> {
        let sequence = number::natural(self.filled(cell)?);
        sequence.ok_or(Reason::NotASequence.at(cell))
    }

    /// Whether any sensor's cell holds something.
    pub(super) fn has_readings(&self, cells: &TickCells) -> Result<bool, Fault> {
        for cell in cells.sensors.iter().filter_map(|(source, _)| source.cell()) {
            if !self.is_empty(cell)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// What gyros have beside their readings.
    pub(super) fn states(&self, gyro: &GyroMapping) -> Result<GyroStates, Fault> {
        let mut half_periods = Sensors::new();
        for half in &gyro.half_periods {
            half_periods.push(HalfPeriodCounts {
                positive: self.count(half.positive.index())?,
                negative: self.count(half.negative.index())?,
            });
        }
        let switch = gyro.switch.as_ref().and_then(|switch| switch.column.as_ref());
        let switch_command = switch.map(|column| self.state(column.index(), "1", "0")).transpose()?;
        Ok(GyroStates {
            mode: self.mode(gyro.mode.as_ref())?,
            switch_command: switch_command.unwrap_or(false),
            meander: self.mode(gyro.meander.as_ref())?,
            half_periods,
        })
    }
}
