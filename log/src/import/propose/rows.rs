//! Columns that say of a row whose it is, and whether it holds.

use std::path::Path;

use super::super::names::{Kind, meaning};
use super::super::words::parts;
use super::super::{Asked, Proposal, refuse};
use super::File;
use crate::error::Error;

/// Words of columns that name a unit.
const SERIALS: [&str; 9] = ["serial", "serialno", "sn", "id", "uid", "device", "unit", "sensor", "imu"];

/// Words of columns that say whether a row holds.
const STATES: [&str; 11] =
    ["status", "state", "valid", "validity", "ok", "flag", "flags", "quality", "health", "error", "fail"];

impl<'a> File<'a> {
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

    /// The column of serials and the one whose rows are taken, where rows are of several units; asks for it where none of
    /// them is given.
    pub(super) fn select(
        self,
        path: &Path,
        proposal: &mut Proposal,
    ) -> Result<Option<(usize, &'a str)>, Error> {
        let given = self.hints.serial.as_deref();
        let Some((index, values)) = self.few(&SERIALS).find(|(_, values)| values.len() > 1) else {
            return match given {
                Some(_) => Err(refuse(path, "has no column with several serials: leave --serial out")),
                None => Ok(None),
            };
        };
        let (name, column) = (self.name, self.listed(&[index]));
        let serials: Vec<_> = values.into_iter().map(|(value, _)| value).collect();
        let listed = serials.join(", ");
        // A sensor's name of one letter may be a unit's as well.
        let of_kind =
            |cell: &String| Some(meaning(&format!("{cell} x"), None).filter(|_| cell.len() > 1)?.kind);
        if [Kind::Gyro, Kind::Accel]
            .iter()
            .all(|kind| serials.iter().any(|cell| of_kind(cell) == Some(*kind)))
        {
            return Err(refuse(
                path,
                format!(
                    "has a row for each sensor ({listed} in column {column}): make one row per tick of it, with a column for each sensor's axis"
                ),
            ));
        }
        if let Some(serial) = given.filter(|given| serials.iter().any(|have| have == given)) {
            return Ok(Some((index, serial)));
        }
        let words = format!("{name} has rows of several units, {listed} in column {column}: of which unit?");
        proposal.ask(Asked::Serial(serials), words);
        Ok(None)
    }
}
