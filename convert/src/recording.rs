//! A text log as a recording.

use std::collections::BTreeSet;

use isotherm_log::message::Topic;
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
    let mut topics = BTreeSet::<Topic>::new();
    let log = conversion.read("writing", |message, _| {
        if !topics.contains(&message.topic) {
            topics.insert(message.topic.clone());
        }
        writer.write(message)
    })?;
    if topics.is_empty() {
        return Err(Error::Nothing("convert"));
    }
    let rows = topics.iter().map(|topic| writer.messages(topic)).sum();
    writer.finish()?;
    let path = partial.path().to_owned();
    partial.keep()?;
    let unit = topics.first().and_then(Topic::unit).map(ToString::to_string);
    let files = vec![Written { path, unit, what: "recording", rows }];
    Ok(Outcome { converted: Converted { files, ..Converted::default() }, log })
}
