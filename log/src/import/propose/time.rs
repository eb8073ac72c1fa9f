//! Where the time of a log's rows comes from.

use super::super::clock::{UNITS_NS, rate_in, unit_of};
use super::super::figures::GAP;
use super::super::layout;
use super::super::names::Kind;
use super::super::{Asked, Proposal, STAMP_UNITS, states};
use super::{File, Meanings};
use crate::mapping::TimeUnit;

/// Where the time of a row comes from.
#[derive(Default)]
pub(super) struct Time {
    pub(super) column: Option<usize>,
    /// Column of the date, where the other has the time of day alone.
    pub(super) date: Option<usize>,
    pub(super) unit: String,
    pub(super) tick_ns: f64,
    pub(super) gap_after_ticks: Option<f64>,
}

impl File<'_> {
    /// `counted`: every tick has its number. A tick is as long as so many rows are apart.
    pub(super) fn time(
        self,
        meanings: &Meanings,
        counted: bool,
        rows_of_tick: f64,
        proposal: &mut Proposal,
    ) -> Time {
        let named = meanings.iter().filter(|(_, meaning)| meaning.kind == Kind::Time);
        let mut clocks: Vec<_> = named
            .map(|(index, meaning)| (meaning.rank, *index, meaning.unit, meaning.unknown.as_ref()))
            .collect();
        // Dates and times of day say themselves what they are.
        let dated =
            self.figures.columns.iter().enumerate().filter(|(_, column)| column.stamp_unit().is_some());
        let unnamed = dated.filter(|(index, _)| !clocks.iter().any(|(_, named, ..)| named == index));
        let unnamed: Vec<_> = unnamed.map(|(index, _)| (u8::MAX, index, None, None)).collect();
        clocks.extend(unnamed);
        clocks.sort_unstable();
        let (mut found, mut why) = (None, None);
        for (_, index, unit, unknown) in clocks {
            if let Some(column) = self.figures.columns.get(index).filter(|column| column.increases()) {
                found = Some((index, unit, unknown, column));
                break;
            }
            let words = self.why_unusable(index);
            proposal.notes.push(format!("time: {words}: not used"));
            why.get_or_insert(words);
        }
        let stated = self.hints.rate_hz.or_else(|| rate_in(&self.found.preamble));
        let Some((index, named_unit, unknown, column)) = found else {
            let Some(rate) = stated else {
                let why = why.map_or_else(String::new, |why| format!(" ({why})"));
                let words = format!("{} has no usable time{why}: how many rows per second?", self.name);
                proposal.ask(Asked::Rate, words);
                return Time { tick_ns: 1e7, ..Time::default() };
            };
            let by = if self.hints.rate_hz.is_some() { "given" } else { "the log's first lines say" };
            proposal.notes.push(format!("time: {rate} rows per second, as {by}"));
            return Time { tick_ns: 1e9 / rate, ..Time::default() };
        };
        if let Some((line, cell)) = &column.first_other {
            let (name, of) = (self.name, self.listed(&[index]));
            let note = format!("time: {of} in {name}:{line} is {cell:?}, no time: such rows are passed over");
            proposal.notes.push(note);
        }
        let step = column.steps.usual;
        let dated = column.stamp_unit().and_then(|unit| {
            let (_, word) = STAMP_UNITS.iter().find(|(stamps, _)| *stamps == unit)?;
            if matches!(unit, TimeUnit::DayFirst | TimeUnit::MonthFirst)
                && column.order.is_none()
                && self.hints.time_unit.is_none()
            {
                let (column, first) = (self.listed(&[index]), self.stamp(index));
                let words = "begin with the day (dmy) or with the month (mdy)?";
                proposal.ask(Asked::DateOrder, format!("does {first:?} in {column} {words}"));
            }
            Some(*word)
        });
        let unit = self.hints.time_unit.as_deref().or(dated).or(named_unit).map(ToOwned::to_owned);
        let told = unit.or_else(|| unit_of(step, column.maximum, stated).filter(|_| unknown.is_none()));
        let unit = told.unwrap_or_else(|| {
            let (column, stated) = (self.listed(&[index]), states(unknown, ""));
            let words = format!("what is the unit of the time {column}?{stated} It usually grows by {step}");
            proposal.ask(Asked::TimeUnit, words);
            "s".to_owned()
        });
        let ns = UNITS_NS.iter().find(|(word, _)| *word == unit).map_or(1.0, |(_, ns)| *ns);
        let row_ns = (step * ns).max(1.0);
        // Rounded to what stamps can say, so that 0.01 s is 10 000 000 ns.
        let row_ns = if row_ns > 1e4 { (row_ns / 10.0).round() * 10.0 } else { row_ns };
        let tick_ns = row_ns * rows_of_tick;
        let jitter = column.steps.p99 / step;
        let gap_after_ticks = (!counted && column.steps.gaps > 0).then(|| (jitter * GAP).max(1.5));
        proposal.notes.push(format!(
            "time: {} in {unit}, every {} ms ({:.6} Hz), {} gaps, longest step {} ms",
            self.listed(&[index]),
            row_ns / 1e6,
            1e9 / row_ns,
            column.steps.gaps,
            (column.steps.longest * ns).round() / 1e6
        ));
        if rows_of_tick > 1.0 {
            let note = format!("time: a tick in every {rows_of_tick} rows, {} ms long", tick_ns / 1e6);
            proposal.notes.push(note);
        }
        if self.figures.repeated > 0 {
            let note = format!("time: {} rows repeat the row before them: dropped", self.figures.repeated);
            proposal.notes.push(note);
        }
        if column.midnights > 0 {
            let note =
                format!("time: no date: passes midnight {} times, after each the next day", column.midnights);
            proposal.notes.push(note);
        }
        let date = self.found.date_and_time.filter(|(_, time)| *time == index).map(|(date, _)| date);
        Time {
            column: Some(index),
            date,
            unit,
            tick_ns,
            gap_after_ticks: gap_after_ticks.map(|ticks| (ticks * 100.0).round() / 100.0),
        }
    }

    /// Why a column cannot be the time of the rows.
    fn why_unusable(self, index: usize) -> String {
        let (file, name) = (self.name, self.listed(&[index]));
        let Some(column) = self.figures.columns.get(index) else { return name };
        match (&column.back, &column.first_other) {
            (Some((line, before, this)), _) => format!(
                "{name} does not always grow: {file}:{line} has {this:?} after {before:?}; correct the row to use it"
            ),
            (None, Some((line, cell))) => format!(
                "{name} is no time in {} rows: {file}:{line} has {cell:?}; correct them to use it",
                column.other
            ),
            _ if column.numbers == 1 => format!("{name} has one row only, which shows no period"),
            _ => format!("{name} is empty in {} rows", column.empty),
        }
    }

    /// The first stamp of a column, as it is written.
    fn stamp(self, column: usize) -> String {
        let cells = self.found.rows.first().map(|row| layout::cells(row, self.found.delimiter));
        let cell = |index: usize| cells.as_ref()?.get(index).cloned();
        let date =
            self.found.date_and_time.filter(|(_, time)| *time == column).and_then(|(date, _)| cell(date));
        date.into_iter().chain(cell(column)).collect::<Vec<_>>().join(" ")
    }
}
