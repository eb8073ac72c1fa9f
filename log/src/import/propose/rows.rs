//! Columns that say of a row whose it is, and whether it holds.

use std::path::Path;

use super::super::names::{Kind, meaning};
use super::super::words::parts;
use super::super::{Hints, Proposal, Question, refuse};
use super::File;
use crate::error::Error;

/// Words of columns that name a unit.
const SERIALS: [&str; 9] = ["serial", "serialno", "sn", "id", "uid", "device", "unit", "sensor", "imu"];

/// Words of columns that say whether a row holds.
const STATES: [&str; 11] =
    ["status", "state", "valid", "validity", "ok", "flag", "flags", "quality", "health", "error", "fail"];

/// A column of serials: which, its file and name, and its cells.
#[derive(Clone)]
pub(super) struct Serials {
    index: usize,
    file: String,
    name: String,
    cells: Vec<String>,
}

impl File<'_> {
    /// Columns whose name has one of these words and means no quantity, with their cells, where these are few.
    fn few(self, words: &'static [&str]) -> impl Iterator<Item = (usize, Vec<(String, u64)>)> {
        let named = self.names().iter().enumerate().filter(move |(_, name)| {
            meaning(name, None).is_none() && parts(name).iter().any(|part| words.contains(&part.as_str()))
        });
        named.filter_map(move |(index, _)| Some((index, self.figures.columns.get(index)?.values.clone()?)))
    }

    /// Notes what a column of states holds that the mapping does not regard, and how it would.
    pub(super) fn note_states(self, proposal: &mut Proposal) {
        for (index, mut values) in self.few(&STATES) {
            values.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
            let Some((most, _)) = values.first() else { continue };
            let held: Vec<_> =
                values.iter().map(|(value, count)| format!("{value:?} in {count} rows")).collect();
            proposal.notes.push(format!(
                "status: {} is ignored: {}; to pass over other rows, add [file.status] with column = {} and good = [{most:?}]",
                self.listed(&[index]),
                held.join(", "),
                index + 1
            ));
        }
    }

    /// The column of serials, where rows are of several units.
    pub(super) fn serials(self) -> Option<Serials> {
        let (index, values) = self.few(&SERIALS).find(|(_, values)| values.len() > 1)?;
        let cells = values.into_iter().map(|(value, _)| value).collect();
        Some(Serials { index, file: self.name.to_owned(), name: self.listed(&[index]), cells })
    }
}

/// The rows that are taken, where they are of several units; asks for the serial where none of them is given.
pub(super) fn select<'h>(
    path: &Path,
    serials: Option<&Serials>,
    hints: &'h Hints,
    proposal: &mut Proposal,
) -> Result<Option<(usize, &'h str)>, Error> {
    // A sensor's name of one letter may be a unit's as well.
    let of_kind = |cell: &String| Some(meaning(&format!("{cell} x"), None).filter(|_| cell.len() > 1)?.kind);
    let has = |column: &Serials, kind| column.cells.iter().any(|cell| of_kind(cell) == Some(kind));
    if let Some(column) = serials.filter(|column| has(column, Kind::Gyro) && has(column, Kind::Accel)) {
        let Serials { name, cells, .. } = column;
        let cells = cells.join(", ");
        return Err(refuse(
            path,
            format!(
                "has a row for each sensor ({cells} in column {name}): make one row per tick of it, with a column for each sensor's axis"
            ),
        ));
    }
    match (serials, hints.serial.as_deref()) {
        (Some(column), Some(serial)) if column.cells.iter().any(|have| have == serial) => {
            Ok(Some((column.index, serial)))
        }
        (Some(column), _) => {
            let Serials { file, name, cells, .. } = column.clone();
            proposal.open.push(Question::Serial { file, column: name, serials: cells });
            Ok(None)
        }
        (None, Some(_)) => Err(refuse(path, "has no column with several serials: leave --serial out")),
        (None, None) => Ok(None),
    }
}
