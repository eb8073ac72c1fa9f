//! A log as Parquet files.

use std::collections::BTreeMap;

use isotherm_log::convert::Converted;
use isotherm_log::convert::decoded::decode;
use isotherm_log::parquet::UnitTables;
use isotherm_protocol::key::UnitId;

use super::output::{Partial, folder};
use super::{Conversion, Found, Outcome};
use crate::error::Error;

pub(super) fn convert(conversion: &Conversion, found: &Found) -> Result<Outcome, Error> {
    let provenance = conversion.provenance();
    let mut partials: Vec<Partial> = Vec::new();
    let mut tables = BTreeMap::<UnitId, UnitTables>::new();
    for (unit, contents) in &found.contents.units {
        let created = UnitTables::create(unit, contents, &provenance, |stream| {
            let path = conversion.out.join(folder(unit)).join(format!("{stream}.parquet"));
            let partial = conversion.place.partial(&path)?;
            let writing = partial.writing().to_owned();
            partials.push(partial);
            Ok::<_, Error>(writing)
        })?;
        tables.insert(unit.clone(), created);
    }
    let mut converted = Converted::default();
    let log = conversion.read("writing", |message, _| {
        match decode(message) {
            Ok(Some((unit, decoded))) => {
                let written = match tables.get_mut(unit) {
                    Some(tables) => tables.take(message.received_ns, &decoded)?,
                    None => false,
                };
                converted.leave_out("journal messages", u64::from(!written));
            }
            Ok(None) => converted.leave_out("messages of no unit", 1),
            Err(_) => converted.lose("frames that cannot be read", 1),
        }
        Ok(())
    })?;
    for tables in tables.into_values() {
        converted.files.extend(tables.finish()?);
    }
    for partial in partials {
        if let Some(file) = converted.files.iter_mut().find(|file| file.path == partial.writing()) {
            partial.path().clone_into(&mut file.path);
        }
        partial.keep()?;
    }
    Ok(Outcome::of(converted, log))
}
