//! Words and figures of a page.

use crate::date::seconds;
use crate::plot::PlotSummary;

/// What each unit has in each log: a sentence, and what else is to be known.
pub(super) fn results(summary: &PlotSummary) -> Vec<(String, String)> {
    let mut results = Vec::new();
    for (unit, logs) in &summary.units {
        for (index, (name, log)) in summary.logs.iter().zip(logs).enumerate() {
            let Some(log) = log else { continue };
            let unit = summary.serial_in(index, unit);
            let of = if logs.iter().flatten().count() > 1 { format!(" in {name}") } else { String::new() };
            let (raw, corrected) = (log.raw_ticks, log.corrected_ticks);
            let mut more = vec![format!("{raw} raw gyro ticks")];
            if corrected > 0 || log.missed_ticks > 0 {
                more.push(format!("{} announced as missing", log.missed_ticks));
            }
            if log.marks > 0 {
                more.push(format!("changes and commands: {}", log.marks));
            }
            let sentence = format!("Unit {unit}{of}: {corrected} corrected ticks{}.", log.undrawn());
            results.push((sentence, more.join(", ")));
        }
    }
    results
}

/// What is to be known of the page as a whole.
pub(super) fn remarks(summary: &PlotSummary) -> Vec<String> {
    let mut words = Vec::new();
    if let [first, second] = summary.logs.as_slice() {
        words.push(format!(
            "A is {first}, B is {second}; differences are B minus A, of ticks that end at the same time."
        ));
    }
    for (unit, difference) in &summary.differences {
        words.push(format!(
            "Unit {}: {} corrected ticks are in both logs, {} of them differ; {} are in A only, {} in B only.",
            summary.serials(unit),
            difference.common_ticks, difference.differing_ticks, difference.only_first, difference.only_second
        ));
    }
    if let Some(moved_ns) = summary.second_moved_ns {
        words.push(format!(
            "The logs are of different times: B is moved by {:.3} s so that both begin together.",
            seconds(moved_ns)
        ));
    }
    words.extend(summary.troubles.iter().map(|trouble| format!("{trouble}.")));
    if summary.units_left_out > 0 {
        words.push(format!("{} further units are left out: choose with --unit.", summary.units_left_out));
    }
    for (unit, logs) in &summary.units {
        let unit = summary.serials(unit);
        let left_out: u64 = logs.iter().flatten().map(|log| log.marks_left_out).sum();
        if left_out > 0 {
            words.push(format!(
                "Unit {unit}: {left_out} further marks are left out; plot a shorter part to see them."
            ));
        }
        let unreadable: u64 = logs.iter().flatten().map(|log| log.unreadable_messages).sum();
        if unreadable > 0 {
            words.push(format!("Unit {unit}: {unreadable} messages cannot be read and are not shown."));
        }
    }
    if summary.reading.iter().any(crate::source::LogReport::lost_data) {
        words.push("Reading was not complete: see the messages on standard error.".to_owned());
    }
    words
}

/// A number of the table, to seven digits.
pub(super) fn figure(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e9).contains(&size) {
        return format!("{value:.4e}").replace('-', "−");
    }
    let whole_digits = [1.0, 10.0, 100.0, 1e3, 1e4, 1e5].iter().filter(|limit| size >= **limit).count();
    format!("{value:.*}", 7 - whole_digits.min(6)).replace('-', "−")
}

/// A duration in words.
pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        short if short < 120.0 => format!("{short:.3} s"),
        minutes if minutes < 7200.0 => format!("{:.1} min", minutes / 60.0),
        hours => format!("{:.2} h", hours / 3600.0),
    }
}
