//! What the thermometers of a log read, by the document's conversion.

use std::collections::BTreeMap;

use isotherm_protocol::document::Document;

use crate::error::Error;
use crate::fits::drift::pieces::checks::frozen;
use crate::numbers::{ends, grouped, median, once_each};
use crate::report::short;
use crate::runs::Run;
use crate::runs::series::Channel;

/// What every channel of the document reads in some runs, beside its limits, in one sentence.
///
/// # Errors
/// As [`Run::series`].
pub(super) fn read(runs: &[Run], document: &Document) -> Result<String, Error> {
    let mut raw: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for run in runs {
        for (name, channel) in run.series()?.temperatures {
            raw.entry(name).or_default().extend(channel.raw);
        }
    }
    let channels = document.temperature.channel.iter();
    let all: Vec<(bool, String)> =
        channels.clone().map(|channel| words(channel, raw.get(&channel.name))).collect();
    let is_wrong = all.iter().any(|(wrong, _)| *wrong);
    let told: Vec<&str> =
        all.iter().filter(|(wrong, _)| *wrong == is_wrong).map(|(_, words)| words.as_str()).collect();
    let limits = once_each(channels.map(|channel| {
        let [low, high] = channel.range_deg_c;
        format!("{low}…{high} °C")
    }));
    Ok(format!(
        "temperatures by the document's conversion_deg_c: {}. Its range_deg_c is {}",
        told.join("; "),
        limits.join(" and ")
    ))
}

/// What a channel reads, and whether that cannot be right.
fn words(channel: &isotherm_protocol::document::Channel, raw: Option<&Vec<f64>>) -> (bool, String) {
    let (name, limit) = (&channel.name, channel.spike_limit_deg_c);
    let [low, high] = channel.range_deg_c;
    let Some(raw) = raw.filter(|raw| !raw.is_empty()) else {
        return (true, format!("{name} has no readings in the log"));
    };
    let of = |raw: &f64| channel.conversion_deg_c.iter().rev().fold(0.0, |sum, of| sum * raw + of);
    let good: Vec<f64> = raw.iter().map(of).filter(|deg_c| deg_c.is_finite()).collect();
    let numbers = match raw.len() - good.len() {
        0 => String::new(),
        bad => format!(", {bad} of {} readings are not numbers", raw.len()),
    };
    let [from, to] = ends(good.iter().copied());
    if good.is_empty() {
        return (true, format!("{name} has no numbers"));
    }
    let reads = format!("{name} reads {}…{} °C", short(from), short(to));
    if from < low || to > high {
        return (true, format!("{reads}{numbers}"));
    }
    let usual = median(&good.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect::<Vec<f64>>());
    if usual > limit {
        let jumps = short(usual);
        return (
            true,
            format!(
                "{reads} and jumps by {jumps} °C from reading to reading, its spike_limit_deg_c is {limit}{numbers}"
            ),
        );
    }
    (!numbers.is_empty(), format!("{reads}{numbers}"))
}

/// Channels that freeze, by the rule of `drift`; those that freeze alike are named together.
///
/// # Errors
/// As [`Run::series`].
pub(super) fn freezing(runs: &[Run], document: &Document) -> Result<Vec<String>, Error> {
    let mut told: Vec<(&str, String)> = Vec::new();
    for run in runs {
        let series = run.series()?;
        for channel in &document.temperature.channel {
            let Some(Channel { time_ns, raw }) = series.temperatures.get(&channel.name) else { continue };
            let Some(words) = frozen("", (series.start_s, time_ns), raw) else { continue };
            let log = if runs.len() > 1 { format!("{}: ", run.name) } else { String::new() };
            let words = format!("{log}{}", words.trim_start_matches("warning:").trim_start());
            told.push((&channel.name, words));
        }
    }
    let sentence = |(words, names): (String, Vec<&str>)| {
        let [channel, each] = if names.len() == 1 { ["channel", ""] } else { ["channels", "each "] };
        format!("temperature {channel} {}: {each}{words}", names.join(", "))
    };
    Ok(grouped(told).into_iter().map(sentence).collect())
}
