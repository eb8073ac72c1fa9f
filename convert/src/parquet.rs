//! Streams as Parquet files: one file per unit and stream, plain columns named with their units of measure.
//!
//! | stream | one row per |
//! |---|---|
//! | `raw_gyro`, `raw_accel` | tick |
//! | `raw_temperature`, `raw_health` | reading |
//! | `reference` | rate reference |
//! | `corrected` | corrected tick or navigation step |
//! | `applied_temperature` | channel and corrected batch |
//! | `status` | status message |
//!
//! Messages are written as they came: in their order, doubled where they were. Where ticks of one stream have different
//! numbers or kinds of readings, the columns are there for all of them and empty where a tick has none.

mod rows;
mod streams;
mod table;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use isotherm_log::error::Error;
use isotherm_protocol::key::UnitId;

use isotherm_log::file::Partial;

use super::output::folder;
use super::{Conversion, Converted, Found, Outcome};
use streams::UnitTables;

pub(super) fn convert(conversion: &Conversion, found: &Found) -> Result<Outcome, Error> {
    let provenance = conversion.provenance();
    let mut tables = BTreeMap::<UnitId, UnitTables>::new();
    for (unit, contents) in &found.contents.units {
        let created = UnitTables::create(unit, contents, &provenance, |stream| {
            let path = conversion.out.join(folder(unit)).join(format!("{stream}.parquet"));
            conversion.place.partial(&path)
        })?;
        tables.insert(unit.clone(), created);
    }
    let mut converted = Converted::default();
    let log =
        conversion.read_units(&mut tables, &mut converted, |tables, received_ns, decoded, converted| {
            let written = tables.take(received_ns, decoded)?;
            converted.leave_out("journal messages", u64::from(!written));
            Ok(())
        })?;
    let mut partials = Vec::new();
    for tables in tables.into_values() {
        for (partial, written) in tables.finish()? {
            partials.push(partial);
            converted.files.push(written);
        }
    }
    partials.into_iter().try_for_each(Partial::keep)?;
    Ok(Outcome { converted, log })
}
