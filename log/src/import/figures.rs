//! What the rows of a log say of its columns, in one pass and in constant memory.

use std::path::Path;

use super::layout::{Found, cells};
use crate::error::Error;
use crate::mapping::TimeUnit;
use crate::text::{DAY_NS, is_next_day, open_decoded, parse_float, says_order, stamp_ns};

/// Rows by which the usual step, and gravity, are told.
const SAMPLE: usize = 4096;
/// Different cells of a column that are kept.
const MOST_VALUES: usize = 8;
/// A step longer than so many usual ones is a gap.
pub(super) const GAP: f64 = 1.5;

/// What the cells of one column are.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    /// Cells with a number.
    pub(super) numbers: u64,
    /// Cells with nothing in them.
    pub(super) empty: u64,
    /// Cells with anything else.
    pub(super) other: u64,
    /// The first of them, and its line.
    pub(super) first_other: Option<(u64, String)>,
    /// Cells with a date and time or a time of day, all in this unit; they count as numbers of ns too.
    stamps: u64,
    stamp_unit: Option<TimeUnit>,
    /// Which of day and month stands first, where a cell says so.
    pub(super) order: Option<TimeUnit>,
    /// Cells whose number has a fraction.
    pub(super) fractions: u64,
    /// Largest size of a number.
    pub(super) largest: f64,
    pub(super) minimum: f64,
    pub(super) maximum: f64,
    pub(super) steps: Steps,
    /// Rows from each cell that is filled to the next.
    pub(super) spacing: Steps,
    /// Empty cells since the last that is filled.
    blanks: u32,
    /// Times of day that are of the day after that before them.
    pub(super) midnights: u64,
    /// The first cell that is not greater than the one before it: its line, and both.
    pub(super) back: Option<(u64, String, String)>,
    /// The cell before, up to there.
    before: String,
    /// Its different cells with how many there are of each; `None` where they are many.
    pub(super) values: Option<Vec<(String, u64)>>,
    last: Option<(i64, f64)>,
}

/// Differences of successive numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Steps {
    first: Vec<f64>,
    /// The usual step.
    pub(super) usual: f64,
    /// Steps of zero or less.
    pub(super) back: u64,
    /// Steps longer than [`GAP`] usual ones, and the longest step.
    pub(super) gaps: u64,
    pub(super) longest: f64,
    /// Of the first steps, the one that 99 of 100 do not exceed.
    pub(super) p99: f64,
    settled: bool,
}

impl Steps {
    fn take(&mut self, step: f64) {
        if step <= 0.0 {
            self.back += 1;
            return;
        }
        self.longest = self.longest.max(step);
        if self.settled {
            self.gaps += u64::from(step > GAP * self.usual);
            return;
        }
        self.first.push(step);
        if self.first.len() == SAMPLE {
            self.settle();
        }
    }

    fn settle(&mut self) {
        if self.settled || self.first.is_empty() {
            return;
        }
        self.settled = true;
        self.first.sort_by(f64::total_cmp);
        let at =
            |share: usize| self.first.get((self.first.len() - 1) * share / 100).copied().unwrap_or_default();
        (self.usual, self.p99) = (at(50), at(99));
        self.gaps = self.first.iter().filter(|step| **step > GAP * self.usual).map(|_| 1).sum();
    }
}

impl Column {
    /// No cells yet.
    fn new() -> Self {
        Self { values: Some(Vec::new()), ..Self::default() }
    }

    /// Counts a cell among those that are equal.
    fn count(&mut self, cell: &str) {
        let Some(values) = &mut self.values else { return };
        let many = values.len() == MOST_VALUES;
        match values.iter_mut().find(|(value, _)| value == cell) {
            Some((_, count)) => *count += 1,
            None if many => self.values = None,
            None => values.push((cell.to_owned(), 1)),
        }
    }

    /// Takes a cell; where dates do not say it, day and month stand in the order given.
    fn take(&mut self, cell: &str, mark: u8, order: TimeUnit, line: u64) {
        if cell.is_empty() {
            self.empty += 1;
            self.blanks = self.blanks.saturating_add(1);
            return;
        }
        self.spacing.take(f64::from(std::mem::take(&mut self.blanks)) + 1.0);
        self.count(cell);
        let number = parse_float(cell, mark).filter(|number| number.is_finite());
        let (number, parts) = if let Some(number) = number {
            (number, parts(cell, mark).unwrap_or((0, number)))
        } else if let Some((unit, ns)) = self.stamp(cell, order) {
            self.stamps += 1;
            self.stamp_unit = Some(unit);
            #[expect(
                clippy::cast_precision_loss,
                reason = "for ranges; steps are taken from the whole number"
            )]
            (ns as f64, (ns, 0.0))
        } else {
            self.other += 1;
            self.first_other.get_or_insert_with(|| (line, cell.to_owned()));
            return;
        };
        if self.numbers == 0 {
            (self.minimum, self.maximum) = (number, number);
        }
        self.numbers += 1;
        self.fractions += u64::from(number.fract() != 0.0);
        self.largest = self.largest.max(number.abs());
        self.minimum = self.minimum.min(number);
        self.maximum = self.maximum.max(number);
        if let Some((whole, fraction)) = self.last.replace(parts) {
            let next_day = self.stamp_unit == Some(TimeUnit::TimeOfDay) && is_next_day(whole, parts.0);
            self.midnights += u64::from(next_day);
            let whole = if next_day { whole - DAY_NS } else { whole };
            #[expect(clippy::cast_precision_loss, reason = "steps are small")]
            let step = parts.0.saturating_sub(whole) as f64 + (parts.1 - fraction);
            self.steps.take(step);
            if step <= 0.0 && self.back.is_none() {
                self.back = Some((line, std::mem::take(&mut self.before), cell.to_owned()));
            }
        }
        if self.back.is_none() {
            self.before.clear();
            self.before.push_str(cell);
        }
    }

    /// A date and time or a time of day, in the unit of those before it.
    fn stamp(&mut self, cell: &str, order: TimeUnit) -> Option<(TimeUnit, i64)> {
        if !cell.contains(':') {
            return None;
        }
        self.order = self.order.or_else(|| says_order(cell));
        let mut units = [TimeUnit::DateTime, order, TimeUnit::TimeOfDay].into_iter();
        units
            .find_map(|unit| Some((unit, stamp_ns(cell.as_bytes(), unit)?)))
            .filter(|(unit, _)| self.stamp_unit.is_none_or(|before| before == *unit))
    }

    /// Whether it could be the clock of the rows. A row now and then whose cell is no number, like a footer, is passed over.
    pub(super) fn increases(&self) -> bool {
        self.numbers > 1 && self.steps.back == 0 && self.other * 10 <= self.numbers && !self.is_in_some_rows()
    }

    /// Whether it has a rhythm of its own. An empty cell now and then is a reading that is missing: its row is passed over, and leaves a
    /// gap in every sensor's ticks.
    pub(super) fn is_in_some_rows(&self) -> bool {
        self.empty * 10 > self.numbers + self.other
    }

    /// The unit of dates and times or times of day, where every cell is one.
    pub(super) fn stamp_unit(&self) -> Option<TimeUnit> {
        self.stamp_unit.filter(|_| self.stamps == self.numbers)
    }

    /// Whether it counts the rows.
    pub(super) fn counts(&self) -> bool {
        let one = (self.steps.usual - 1.0).abs() < 1e-9;
        self.increases() && self.fractions == 0 && one && self.minimum >= 0.0
    }
}

/// A plain decimal number as its whole part and its fraction: the difference of two times of this century in ns is exact.
fn parts(cell: &str, mark: u8) -> Option<(i64, f64)> {
    let (whole, fraction) = cell.split_once(char::from(mark)).unwrap_or((cell, ""));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !digits(fraction) || !digits(whole.trim_start_matches(['-', '+'])) {
        return None;
    }
    let size: f64 = format!("0.{fraction}0").parse().ok()?;
    Some((whole.parse().ok()?, if whole.starts_with('-') { -size } else { size }))
}

/// What was found of all rows.
#[derive(Debug, Clone)]
pub(super) struct Figures {
    pub(super) columns: Vec<Column>,
    pub(super) rows: u64,
    /// Rows that are the one before them again.
    pub(super) repeated: u64,
}

impl Figures {
    /// Reads the file to its end, of rows of several units those in which a column has a value; where a date says that the month
    /// stands first, once more.
    pub(super) fn of(
        path: &Path,
        found: &Found,
        order: Option<TimeUnit>,
        select: Option<(usize, &str)>,
    ) -> Result<Self, Error> {
        let figures = Self::read(path, found, order.unwrap_or(TimeUnit::DayFirst), select)?;
        let month_first = figures.columns.iter().any(|column| column.order == Some(TimeUnit::MonthFirst));
        if order.is_none() && month_first {
            return Self::read(path, found, TimeUnit::MonthFirst, select);
        }
        Ok(figures)
    }

    fn read(
        path: &Path,
        found: &Found,
        order: TimeUnit,
        select: Option<(usize, &str)>,
    ) -> Result<Self, Error> {
        let mut lines = open_decoded(path, found.encoding)?;
        let mut figures = Self { columns: vec![Column::new(); found.width], rows: 0, repeated: 0 };
        let first = found.rows.first().map(String::as_str).unwrap_or_default();
        let (mut begun, mut before) = (false, String::new());
        while let Some(line) = lines.next_line().map_err(|error| Error::file(path, "read the log", error))? {
            begun |= line == first;
            let comment = found.comment.is_some_and(|prefix| line.trim_start().starts_with(prefix));
            if !begun || comment || line.trim().is_empty() {
                continue;
            }
            let mut cells = cells(&line, found.delimiter);
            if select.is_some_and(|(column, value)| cells.get(column).is_none_or(|cell| cell != value)) {
                continue;
            }
            figures.rows += 1;
            // Where rows have a time; readings at rest alone may be equal and are counted.
            if line == before {
                figures.repeated += 1;
                continue;
            }
            if let Some((date, time)) = found.date_and_time
                && let Some(date) = cells.get(date).cloned()
                && let Some(time) = cells.get_mut(time)
            {
                *time = format!("{date} {time}");
            }
            for (column, cell) in figures.columns.iter_mut().zip(cells) {
                column.take(&cell, found.decimal_mark, order, lines.number());
            }
            before = line;
        }
        for column in &mut figures.columns {
            column.steps.settle();
            column.spacing.settle();
        }
        Ok(figures)
    }
}

/// Median of the size of the vectors that three columns hold in the first rows.
pub(super) fn usual_size(found: &Found, columns: [usize; 3]) -> Option<f64> {
    let size = |line: &String| {
        let cells = cells(line, found.delimiter);
        let numbers = columns.map(|column| parse_float(cells.get(column)?, found.decimal_mark));
        let sum: Option<f64> = numbers.into_iter().map(|number| number.map(|number| number * number)).sum();
        sum.map(f64::sqrt)
    };
    let mut sizes: Vec<f64> = found.rows.iter().filter_map(size).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(numbers: impl IntoIterator<Item = f64>) -> Column {
        column_of(numbers.into_iter().map(|number| number.to_string()))
    }

    fn column_of(cells: impl IntoIterator<Item = String>) -> Column {
        let mut column = Column::default();
        cells.into_iter().for_each(|cell| column.take(&cell, b'.', TimeUnit::DayFirst, 0));
        column.steps.settle();
        column
    }

    #[test]
    fn steps_of_long_times_are_exact() {
        let stamps =
            column_of((0..100).map(|row| format!("{}", 1_403_636_579_758_555_392_i64 + row * 5_000_000)));
        assert!((stamps.steps.usual - 5_000_000.0).abs() < 1e-9, "{}", stamps.steps.usual);
        let seconds =
            column_of((0..100).map(|row| format!("-{}.{:02}", 1_600_000_000 - row / 4, 75 - row % 4 * 25)));
        assert_eq!((seconds.steps.usual, seconds.steps.back), (0.25, 0));
        let dates = column_of(
            (0..100).map(|row| format!("2024-05-01T10:00:{:02}.{:03}Z", row / 100, row % 100 * 10)),
        );
        assert_eq!((dates.stamp_unit(), seconds.stamp_unit()), (Some(TimeUnit::DateTime), None));
        assert!(dates.increases());
        assert!((dates.steps.usual - 1e7).abs() < 1e-9, "{}", dates.steps.usual);
    }

    #[test]
    fn steps_gaps_counters_and_counters_that_begin_anew() {
        let stamps =
            column((0..10_000).map(|row| f64::from(row) * 5.0 + if row < 6000 { 0.0 } else { 40.0 }));
        assert_eq!((stamps.steps.usual, stamps.steps.gaps, stamps.steps.longest), (5.0, 1, 45.0));
        assert!(stamps.increases() && !stamps.counts());
        assert!(column((0..300).map(|row| f64::from(row + 7))).counts());
        let wraps = column((0..300).map(|row| f64::from(row % 256)));
        assert!(!wraps.increases() && wraps.steps.back == 1);
    }
}
