//! What the thermometers of a log read, by the document's conversion.

use std::collections::BTreeMap;

use isotherm_protocol::document::Document;

use crate::drift::figures::short;
use crate::drift::pieces::checks::frozen;
use crate::error::Error;
use crate::robust::median;
use crate::run::{Run, Watch};
use crate::series::Channel;

/// What every channel of the document reads in some runs, beside its limits, in one sentence.
///
/// # Errors
/// As [`Run::series`].
pub(super) fn read<W: Watch>(
    runs: &[Run],
    document: &Document,
    watch: &mut impl FnMut() -> W,
) -> Result<String, Error> {
    let mut raw: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for run in runs {
        for (name, channel) in run.series(watch())?.temperatures {
            raw.entry(name).or_default().extend(channel.raw);
        }
    }
    let of = |channel: &isotherm_protocol::document::Channel| {
        let name = &channel.name;
        let [low, high] = channel.range_deg_c;
        let Some(raw) = raw.get(name).filter(|raw| !raw.is_empty()) else {
            return format!("{name} has no readings in the log");
        };
        let read =
            raw.iter().map(|raw| channel.conversion_deg_c.iter().rev().fold(0.0, |sum, of| sum * raw + of));
        let good: Vec<f64> = read.filter(|deg_c| deg_c.is_finite()).collect();
        let ends = good
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| [low.min(*t), high.max(*t)]);
        let bad = raw.len() - good.len();
        let numbers =
            if bad > 0 { format!(", {bad} of {} readings are no numbers", raw.len()) } else { String::new() };
        if good.is_empty() {
            return format!("{name} reads no numbers");
        }
        let usual = median(&good.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect::<Vec<f64>>());
        let limit = channel.spike_limit_deg_c;
        let jumps = if usual > limit {
            format!(", it jumps by {} °C from reading to reading, spike_limit_deg_c is {limit}", short(usual))
        } else {
            String::new()
        };
        format!(
            "{name} reads {} to {} °C, {low} to {high} °C are allowed{jumps}{numbers}",
            short(ends[0]),
            short(ends[1])
        )
    };
    let channels: Vec<String> = document.temperature.channel.iter().map(of).collect();
    Ok(format!("temperatures by the document's conversion_deg_c and range_deg_c: {}", channels.join("; ")))
}

/// Channels that freeze, by the rule of `drift`; those that freeze alike are named together.
///
/// # Errors
/// As [`Run::series`].
pub(super) fn freezing<W: Watch>(
    runs: &[Run],
    document: &Document,
    watch: &mut impl FnMut() -> W,
) -> Result<Vec<String>, Error> {
    let mut told: Vec<(String, Vec<String>)> = Vec::new();
    for run in runs {
        let series = run.series(watch())?;
        for channel in &document.temperature.channel {
            let Some(Channel { time_ns, raw }) = series.temperatures.get(&channel.name) else { continue };
            let Some(words) = frozen("", time_ns, raw) else { continue };
            let words = words.trim_start_matches("warning:").trim_start().to_owned();
            match told.iter_mut().find(|(of, _)| *of == words) {
                Some((_, names)) => names.push(channel.name.clone()),
                None => told.push((words, vec![channel.name.clone()])),
            }
        }
    }
    let sentence = |(words, names): (String, Vec<String>)| {
        format!(
            "temperature {} {}: {words}",
            if names.len() == 1 { "channel" } else { "channels" },
            names.join(", ")
        )
    };
    Ok(told.into_iter().map(sentence).collect())
}
