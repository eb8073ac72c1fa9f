//! Two corrected logs compared tick by tick, and the first difference found.
//!
//! | file | holds |
//! |---|---|
//! | [`CorrectedLog`] | a log of corrected ticks, of any form |
//! | [`Aligner`] | which tick of one belongs to which of the other |
//! | [`differences`] | two ticks field by field |
//! | [`Comparison`], [`Account`] | what it comes to for one unit |
//!
//! Nothing of a log is kept but the ticks that wait for their partner in the other one, so that logs in the same order
//! are compared in constant memory.

mod account;
mod align;
mod source;
#[cfg(test)]
mod tests;
mod tick;

use std::collections::BTreeMap;

use isotherm_protocol::key::UnitId;

pub use account::{Account, Comparison, DiffOptions, FirstDifference, Happened, Largest, Only, Side};
pub use align::{Aligner, LOOK_AHEAD, MOST_WAITING, Row};
pub(crate) use source::ticks_of;
pub use source::{CorrectedLog, Ticks, is_csv};
pub use tick::{AXES, Equivalent, FieldDifference, LogTick, Tolerance, differences, identical, mode};

use crate::error::Error;

/// One unit's comparison, and how many ticks each log had of it.
struct Unit {
    comparison: Comparison,
    ticks: (u64, u64),
}

/// Compares two logs; `each` is called with the number of ticks read so far, now and then.
///
/// # Errors
/// Those of reading.
pub fn compare(
    a: &mut CorrectedLog,
    b: &mut CorrectedLog,
    options: DiffOptions,
    mut each: impl FnMut(u64),
) -> Result<BTreeMap<UnitId, Account>, Error> {
    let mut units: BTreeMap<UnitId, Unit> = BTreeMap::new();
    let mut read = (0, 0);
    let mut over = (false, false);
    while !(over.0 && over.1) {
        let side = if over.1 || (!over.0 && a_is_behind(&units, read)) { Side::A } else { Side::B };
        let (log, read, over) = match side {
            Side::A => (&mut *a, &mut read.0, &mut over.0),
            Side::B => (&mut *b, &mut read.1, &mut over.1),
        };
        let Some(Ticks { unit, ticks }) = log.next_ticks()? else {
            *over = true;
            continue;
        };
        let fresh = || Unit { comparison: Comparison::new(options, true), ticks: (0, 0) };
        let unit = units.entry(unit).or_insert_with(fresh);
        let count = ticks.len() as u64;
        *(if side == Side::A { &mut unit.ticks.0 } else { &mut unit.ticks.1 }) += count;
        *read += count;
        for tick in ticks {
            unit.comparison.push(side, tick);
        }
        unit.comparison.advance();
        each(*read);
    }
    Ok(units.into_iter().map(|(id, unit)| (id, unit.comparison.finish())).collect())
}

/// Whether the first log is to be read on: fewer of its ticks wait for the other than the other way round. Units that only
/// one log has do not count; nothing will come for their ticks.
fn a_is_behind(units: &BTreeMap<UnitId, Unit>, read: (u64, u64)) -> bool {
    let both = units.values().filter(|unit| unit.ticks.0 > 0 && unit.ticks.1 > 0);
    let waiting = both.map(|unit| unit.comparison.waiting());
    let (a, b) = waiting.fold((0, 0), |(a, b), (more_a, more_b)| (a + more_a, b + more_b));
    a < b || (a == b && read.0 <= read.1)
}
