//! One file of a log: rows in, events out in time order.

use std::ops::Range;
use std::path::Path;

use isotherm_correction::sample::TemperatureReading;
use isotherm_correction::units::{Span, Timestamp};

use super::assemble::{Assembler, Parts};
use super::cells::{Cell, OpenQuote, split};
use super::dates::{DAY_NS, is_next_day};
use super::error::{LogError, LogFault, Reason};
use super::input::{LONGEST_LINE, Line, Lines, Source, decoded};
use super::resolve::{Columns, TickCells, resolve};
use super::row::{Fault, Readings, Row};
use super::{LogEvent, ReadReport};
use crate::mapping::{Delimiter, FileMapping, OnBadRow, SelectMapping, TimeUnit};

/// Most nominal ticks between two rows of a log without gaps.
const LONGEST_STEP: u64 = 10;

/// Reads one file.
#[derive(Debug)]
pub(super) struct FileReader {
    /// Its name, for messages.
    name: String,
    /// Its lines.
    lines: Lines,
    /// Cells of the current line.
    cells: Vec<Cell>,
    /// Names of the columns, where it has a header.
    header: Vec<String>,
    /// How it is read; behind the header every column is an index.
    mapping: FileMapping,
    /// What that comes to.
    columns: Columns,
    /// Makes events of rows.
    assembler: Assembler,
    /// Temperature readings of the current row.
    readings: Vec<TemperatureReading>,
    /// Midnights that times of day have passed (ns).
    days_ns: i64,
    /// Stamp of the last good row.
    last_stamp: Option<i64>,
    /// Its line: what it holds, where its stamp is in it, and its number.
    last_line: (Vec<u8>, Range<usize>, u64),
    /// Its sequence number, where rows have one.
    last_number: Option<u64>,
    /// Rows since then that could not be read.
    bad_since: u64,
    /// Columns of the header, or of the first row.
    width: Option<usize>,
    /// There are no further rows.
    ended: bool,
    /// What reading came to so far.
    report: ReadReport,
}

impl FileReader {
    /// Reads up to the first row of data.
    pub(super) fn new(path: &Path, source: Source, mapping: &FileMapping) -> Result<Self, LogError> {
        let mut reader = Self {
            name: path.display().to_string(),
            lines: Lines::new(decoded(source, mapping.layout.encoding)),
            cells: Vec::new(),
            header: Vec::new(),
            mapping: mapping.clone(),
            columns: Columns::default(),
            assembler: Assembler::new(&mapping.time),
            readings: Vec::new(),
            days_ns: 0,
            last_stamp: None,
            last_line: (Vec::new(), 0..0, 0),
            last_number: None,
            bad_since: 0,
            width: None,
            ended: false,
            report: ReadReport::default(),
        };
        let named = reader.skip_and_name();
        let resolved = named.and_then(|()| Ok(resolve(&mut reader.mapping, &reader.header)?));
        reader.columns = resolved.map_err(|fault: Fault| reader.error(fault))?;
        Ok(reader)
    }

    /// Passes over the lines in front and reads the header.
    fn skip_and_name(&mut self) -> Result<(), Fault> {
        for _ in 0..self.mapping.layout.skip_lines {
            self.line()?;
        }
        if self.mapping.layout.header {
            if !self.line()? {
                return Err(Reason::NoHeader.into());
            }
            self.split()?;
            let line = self.lines.line();
            let names = self.cells.iter().map(|cell| line.get(cell.start..cell.end).unwrap_or_default());
            self.header = names.map(|name| String::from_utf8_lossy(name).into_owned()).collect();
            self.width = Some(self.cells.len());
        }
        Ok(())
    }

    /// Goes to the next line that is neither blank nor a comment; false at the end.
    fn line(&mut self) -> Result<bool, Fault> {
        loop {
            let line = self.lines.advance().map_err(|error| match error.kind() {
                std::io::ErrorKind::UnexpectedEof => Reason::CutShort,
                _ => Reason::Io(error),
            })?;
            if self.lines.is_utf16() {
                return Err(Reason::Utf16.into());
            }
            match line {
                Line::End => return Ok(false),
                Line::TooLong => return Err(Reason::LineTooLong { limit: LONGEST_LINE }.into()),
                Line::Read => {}
            }
            let text = self.lines.line().trim_ascii_start();
            let comment = self
                .mapping
                .layout
                .comment
                .as_ref()
                .is_some_and(|prefix| text.starts_with(prefix.as_bytes()));
            if !text.is_empty() && !comment {
                return Ok(true);
            }
        }
    }

    /// Cuts the current line into cells.
    fn split(&mut self) -> Result<(), Fault> {
        split(self.lines.line_mut(), self.mapping.layout.delimiter, &mut self.cells).map_err(
            |OpenQuote(at)| {
                let column = u32::try_from(at + 1).unwrap_or(u32::MAX);
                self.cells.push(Cell { start: at, end: self.lines.line().len(), column });
                Reason::OpenQuote.at(self.cells.len() - 1)
            },
        )
    }

    /// The next event in time order.
    pub(super) fn next_event(&mut self) -> Result<Option<LogEvent>, LogError> {
        loop {
            if let Some(event) = self.assembler.next() {
                return Ok(Some(event));
            }
            if self.ended {
                return Ok(None);
            }
            self.row()?;
        }
    }

    /// Reads one row, or notes the end.
    fn row(&mut self) -> Result<(), LogError> {
        let mut stamp = None;
        self.cells.clear();
        let parts = match self.line() {
            Ok(false) => {
                self.end();
                return Ok(());
            }
            Ok(true) if self.report.dropped_rows < self.mapping.layout.drop_rows => {
                self.report.dropped_rows += 1;
                return Ok(());
            }
            Ok(true) => self.split().and_then(|()| self.check_width()).and_then(|()| self.parts(&mut stamp)),
            Err(fault) => Err(fault),
        };
        match parts {
            // Not a row of this stream.
            Ok(None) => Ok(()),
            Ok(Some(parts)) => {
                self.report.rows += 1;
                self.report.unterminated_last_line |= !self.lines.terminated();
                self.last_stamp = Some(parts.stamp);
                self.keep_line();
                self.last_number = parts.number;
                self.bad_since = 0;
                self.assembler.take(parts, &self.readings, &self.columns);
                Ok(())
            }
            Err(fault) => self.bad_row(fault, stamp),
        }
    }

    /// Keeps the line of a good row with a stamp, for what comes after it.
    fn keep_line(&mut self) {
        let stamps = self.mapping.time.stamps.as_ref();
        let stamp = stamps.and_then(|stamps| self.cells.get(stamps.column.index()));
        let Some(&Cell { start, end, .. }) = stamp else { return };
        let (text, of_stamp, number) = &mut self.last_line;
        text.clear();
        text.extend_from_slice(self.lines.line());
        (*of_stamp, *number) = (start..end, self.lines.number());
    }

    /// Passes over a bad row, where the mapping says so.
    #[cold]
    fn bad_row(&mut self, fault: Fault, stamp: Option<i64>) -> Result<(), LogError> {
        if matches!(fault.reason, Reason::BadStatus) {
            self.report.bad_status_rows += 1;
            self.bad_since += 1;
            self.skip(stamp);
            return Ok(());
        }
        let cut_short = matches!(fault.reason, Reason::CutShort);
        let a_gap = matches!(fault.reason, Reason::Gap { .. });
        let skippable = cut_short || fault.reason.concerns_one_row();
        let error = self.error(fault);
        if self.mapping.layout.on_bad_row == OnBadRow::Refuse || !skippable {
            return Err(error);
        }
        self.report.first_skipped.get_or_insert_with(|| error.to_string());
        if cut_short {
            self.report.cut_short = true;
            self.end();
            return Ok(());
        }
        self.report.skipped_rows += 1;
        if self.repeats_header() {
            return Ok(());
        }
        self.bad_since += 1;
        if a_gap {
            // The rows behind it follow it, not what is before it.
            self.last_stamp = stamp;
        }
        self.skip(stamp);
        Ok(())
    }

    /// Whether the current line is the header again, which has no tick.
    fn repeats_header(&self) -> bool {
        let line = self.lines.line();
        let names = self.cells.iter().map(|cell| line.get(cell.start..cell.end).unwrap_or_default());
        !self.header.is_empty() && names.eq(self.header.iter().map(String::as_bytes))
    }

    /// Leaves a gap where the row had ticks.
    fn skip(&mut self, stamp: Option<i64>) {
        let row = Row::new(self.lines.line(), &self.cells, &self.mapping.layout);
        // Of a row without a cell nobody knows.
        let has = |cells: &TickCells| !cells.may_be_empty || row.has_readings(cells).unwrap_or(false);
        let had = self.columns.ticks.each_ref().map(|ticks| ticks.as_ref().is_some_and(has));
        self.assembler.skip(stamp, had, &self.columns);
    }

    /// There are no further rows: everything can be given.
    fn end(&mut self) {
        self.assembler.end(&self.columns);
        self.ended = true;
    }

    /// Refuses a row that goes on behind the last column: what its cells are is anybody's guess.
    fn check_width(&mut self) -> Result<(), Fault> {
        let columns = *self.width.get_or_insert(self.cells.len());
        let line = self.lines.line();
        let filled = |cell: &Cell| line.get(cell.start..cell.end).is_some_and(|text| !text.is_empty());
        let Some(surplus) = self.cells.iter().skip(columns).position(filled) else { return Ok(()) };
        let commas = self.mapping.layout.delimiter == Delimiter::Comma;
        Err(Reason::TooManyCells { columns, named: self.mapping.layout.header, commas }.at(columns + surplus))
    }

    /// The step of time to a row, where it is longer than any tick can be and the mapping knows of no gaps.
    fn gap(&self, now: i64) -> Option<Reason> {
        let tick = self.mapping.time.tick?.as_ns();
        let numbered_by_rows = self.columns.ticks.iter().flatten().any(|ticks| ticks.sequence.is_none());
        let step = Span::from_ns(now.saturating_sub(self.last_stamp?));
        let most = i64::try_from(LONGEST_STEP + self.bad_since).unwrap_or(i64::MAX);
        let gap = self.mapping.time.gap_after_ticks.is_none()
            && numbered_by_rows
            && tick > 0
            && step.as_ns() > tick.saturating_mul(most);
        gap.then(|| Reason::Gap { step: step.as_s(), ticks: (step.as_ns() / tick).unsigned_abs() })
    }

    /// Ticks from the last good row to this one in a log without stamps: by their sequence numbers where every row has one and they
    /// go on, otherwise by rows.
    fn ticks_to(&self, row: Row<'_>) -> Result<i64, Fault> {
        let numbered = self.columns.row_number().map(|cell| row.sequence(cell)).transpose()?;
        let since = numbered.zip(self.last_number).and_then(|(number, last)| number.checked_sub(last));
        let since = since.filter(|since| *since > 0).unwrap_or(self.bad_since + 1);
        Ok(i64::try_from(since).unwrap_or(i64::MAX))
    }

    /// Reads all cells of the row that are used, where it is one of this stream; `stamp` is set as soon as it is known to be good.
    fn parts(&mut self, stamp: &mut Option<i64>) -> Result<Option<Parts>, Fault> {
        let row = Row::new(self.lines.line(), &self.cells, &self.mapping.layout);
        let FileMapping { time, gyro, temperatures, status, select, .. } = &self.mapping;
        if let Some(SelectMapping { column, value }) = select
            && row.text(column.index())? != value.as_bytes()
        {
            self.report.rows_of_others += 1;
            return Ok(None);
        }
        let now = if let Some(cell) = &time.stamps {
            let mut now = row.time_ns(cell)?.saturating_add(time.origin_ns).saturating_add(self.days_ns);
            if cell.unit == TimeUnit::TimeOfDay && self.last_stamp.is_some_and(|last| is_next_day(last, now))
            {
                now = now.saturating_add(DAY_NS);
                self.days_ns = self.days_ns.saturating_add(DAY_NS);
                self.report.midnights += 1;
            }
            if let Some(last) = self.last_stamp.filter(|last| now <= *last) {
                let (text, stamp, line) = &self.last_line;
                if now == last && text == self.lines.line() {
                    self.report.repeated_rows += 1;
                    return Ok(None);
                }
                let before =
                    String::from_utf8_lossy(text.get(stamp.clone()).unwrap_or_default()).into_owned();
                let reason = Reason::TimeNotIncreasing { before, line: *line, again: now == last };
                return Err(reason.at(cell.column.index()));
            }
            now
        } else {
            let tick = time.tick.unwrap_or(Span::ZERO).as_ns();
            let last = self.last_stamp.unwrap_or(time.origin_ns);
            last.saturating_add(tick.saturating_mul(self.ticks_to(row)?))
        };
        *stamp = Some(now);
        if let (Some(cell), Some(reason)) = (&time.stamps, self.gap(now)) {
            return Err(reason.at(cell.column.index()));
        }
        if let Some(status) = status {
            row.check_status(status)?;
        }
        let [of_gyros, of_accels] = &self.columns.ticks;
        let readings = |cells: &Option<TickCells>| match cells {
            Some(cells) => row.readings(cells),
            None => Ok(None),
        };
        let gyro = match (readings(of_gyros)?, gyro) {
            (Some(readings), Some(gyro)) => Some((readings, row.states(gyro)?)),
            _ => None,
        };
        let accel = readings(of_accels)?;
        self.readings.clear();
        for (temperature, since) in temperatures.iter().zip(&mut self.columns.since) {
            let due = *since == 0;
            let cell = temperature.column.index();
            if temperature.may_be_empty && row.is_empty(cell)? {
                continue;
            }
            let raw = temperature.unit.read(row.float(cell)?);
            *since = (*since + 1) % temperature.every_rows;
            if due {
                let reading =
                    TemperatureReading { channel: temperature.channel, time: Timestamp::from_ns(now), raw };
                self.readings.push(reading);
            }
        }
        let sequence = |readings: &Readings| readings.sequence;
        let number = gyro.as_ref().map(|(readings, _)| readings).or(accel.as_ref()).and_then(sequence);
        Ok(Some(Parts { stamp: now, number, gyro, accel }))
    }

    /// What reading came to so far.
    pub(super) fn report(&self) -> &ReadReport {
        &self.report
    }

    /// A fault with its place.
    #[cold]
    fn error(&self, fault: Fault) -> LogError {
        let cell = fault.cell.and_then(|index| self.cells.get(index));
        let value = cell.and_then(|cell| self.lines.line().get(cell.start..cell.end)).unwrap_or_default();
        let behind = u32::try_from(self.lines.line().len() + 1).unwrap_or(u32::MAX);
        LogError(Box::new(LogFault {
            file: self.name.clone(),
            line: self.lines.number().max(1),
            column: match (fault.cell, cell) {
                (Some(_), Some(cell)) => cell.column,
                (Some(_), None) => behind,
                (None, _) => 1,
            },
            cell: fault.cell.map(|index| (index + 1, self.header.get(index).cloned())),
            value: String::from_utf8_lossy(value).chars().take(40).collect(),
            cut: fault.cell.is_some() && !self.lines.terminated(),
            reason: fault.reason,
        }))
    }
}
