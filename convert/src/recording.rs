//! A text log as a recording.

use isotherm_log::recording::{Metadata, RecordingOptions, RecordingWriter};

use super::{Conversion, Converted, Outcome, Written};
use isotherm_log::error::Error;

pub(super) fn convert(conversion: &Conversion) -> Result<Outcome, Error> {
    let partial = conversion.place.partial(&conversion.out)?;
    let options = RecordingOptions {
        compress: conversion.compress,
        json: conversion.json,
        // What an earlier run left behind when it was killed.
        overwrite: true,
        ..RecordingOptions::default()
    };
    let mut writer = RecordingWriter::create(partial.writing(), options)?;
    let origin = ("origin".to_owned(), "converted from a text log".to_owned());
    writer.metadata(&Metadata::of(conversion.provenance().into_iter().chain([origin])))?;
    let (mut rows, mut unit) = (0, None);
    let (log, _) = conversion.read("writing", |message| {
        rows += 1;
        unit = message.topic.unit().cloned();
        writer.write(message)
    })?;
    if rows == 0 {
        return Err(Error::Nothing("convert"));
    }
    writer.finish()?;
    let path = partial.path().to_owned();
    partial.keep()?;
    let unit = unit.map(|unit| unit.to_string());
    let files = vec![Written { path, unit, what: "recording", rows }];
    Ok(Outcome { converted: Converted { files, ..Converted::default() }, log })
}
