//! What a log holds, as tables.

use std::fmt::Write;

use indicatif::DecimalBytes;
use isotherm_correction::units::{Angle, Span, Timestamp};
use isotherm_log::date::date;
use isotherm_log::info::{FileInfo, JournalInfo, LogInfo, SigmaInfo, Spread, StateInfo, TopicInfo, UnitInfo};
use isotherm_log::source::LogReport;

use super::readings::readings;
use crate::cli::show;

/// Most swaps, commands, states or revisions that are listed; JSON has more.
const LISTED: usize = 20;
/// Intervals of a stream by which it may begin or end elsewhere than the gyros.
const INTERVALS: u64 = 5;

/// Everything.
pub(in crate::cli) fn of(info: &LogInfo) -> String {
    let mut text = String::new();
    files(&mut text, info);
    for (unit, of) in &info.units {
        let _ = writeln!(text, "\nUnit {unit}");
        text += &topics(&of.topics);
        let begin_ns = of.topics.iter().filter_map(|topic| topic.first_ns).min().unwrap_or(0);
        let _ = writeln!(text, "first tick {}", date(begin_ns));
        unit_details(&mut text, of, begin_ns);
    }
    if !info.other_topics.is_empty() {
        let _ = writeln!(text, "\nOf no unit");
        text += &topics(&info.other_topics);
        if info.other_messages > 0 {
            let _ = writeln!(text, "and {} messages of further topics", info.other_messages);
        }
    }
    text
}

fn files(text: &mut String, info: &LogInfo) {
    for FileInfo { path, bytes, recording } in &info.files {
        let _ = writeln!(text, "{path}: {}", DecimalBytes(*bytes));
        let Some(layout) = recording else { continue };
        let end =
            if layout.complete { "whole" } else { "cut short: repair it with `isotherm-replay recover`" };
        let _ = writeln!(
            text,
            "  {} chunks, {} of messages in {} ({}), {} attachments, {end}",
            layout.chunks,
            DecimalBytes(layout.uncompressed_bytes),
            DecimalBytes(layout.stored_bytes),
            layout.compression.join(", "),
            layout.attachments
        );
    }
    if let LogReport::Text(report) = &info.reading {
        let _ = writeln!(text, "{} rows read, {} dropped before them", report.rows, report.dropped_rows);
    }
    text.push_str(&show::reading(&info.reading));
    if let (Some(first), Some(last)) = (info.first_received_ns, info.last_received_ns) {
        let _ = writeln!(
            text,
            "received over {}, from {}",
            seconds(last.saturating_sub(first)),
            date(i64::try_from(first).unwrap_or(i64::MAX))
        );
    }
    if !info.service_versions.is_empty() {
        let _ = writeln!(text, "service version {}", info.service_versions.join(", "));
    }
    for metadata in &info.metadata {
        let _ = writeln!(text, "metadata {:?}:", metadata.name);
        for (name, value) in metadata.values.iter().take(LISTED * 2) {
            let _ = writeln!(text, "  {name} = {value}");
        }
    }
    list(text, &info.attachments, |attachment| {
        let (name, kind) = (&attachment.name, &attachment.media_type);
        format!("attachment {name:?} ({kind}, {})", DecimalBytes(attachment.bytes))
    });
}

fn topics(topics: &[TopicInfo]) -> String {
    const HEAD: [&str; 11] = [
        "topic",
        "messages",
        "ticks",
        "Hz",
        "mean Hz",
        "s",
        "gaps",
        "missing",
        "doubled",
        "late",
        "jitter p50/p99/max (ms)",
    ];
    let row = |topic: &TopicInfo| {
        let order = |of: fn(&isotherm_log::info::Order) -> u64| {
            topic.order.as_ref().map_or_else(dash, |order| of(order).to_string())
        };
        let rate = |of: fn(&isotherm_log::info::Rate) -> f64| {
            topic.rate.as_ref().map_or_else(dash, |rate| format!("{:.4}", of(rate)))
        };
        let ticks = if topic.ticks > 0 { topic.ticks.to_string() } else { dash() };
        [
            topic.key.clone(),
            topic.messages.to_string(),
            ticks,
            rate(|rate| rate.nominal_hz),
            rate(|rate| rate.mean_hz),
            if topic.rate.is_some() { format!("{:.3}", topic.duration_s) } else { dash() },
            order(|order| order.gaps.count),
            order(|order| order.gaps.missing_ticks),
            order(|order| order.duplicates),
            order(|order| order.late),
            topic.jitter.as_ref().map_or_else(dash, |jitter| spread(&jitter.delay)),
        ]
    };
    let mut text = show::grid(HEAD, topics.iter().map(row), 1..);
    let gyro = topics.iter().find(|topic| topic.key.ends_with("/raw/gyro"));
    for topic in topics {
        topic_details(&mut text, topic);
        if let Some(gyro) = gyro.filter(|_| topic.key.contains("/raw/")) {
            apart(&mut text, topic, gyro);
        }
    }
    text
}

/// Where a raw stream begins or ends some of its intervals before or after the gyros: another clock, or another part of the time.
fn apart(text: &mut String, topic: &TopicInfo, gyro: &TopicInfo) {
    let Some(intervals) = topic.intervals else { return };
    for (does, own, of_gyro) in
        [("begins", topic.first_ns, gyro.first_ns), ("ends", topic.last_ns, gyro.last_ns)]
    {
        let (Some(own), Some(of_gyro)) = (own, of_gyro) else { continue };
        let apart = own.abs_diff(of_gyro);
        if apart > intervals.p50_ns.saturating_mul(INTERVALS) {
            let side = if own < of_gyro { "before" } else { "after" };
            let _ = writeln!(text, "{}: {does} {} {side} the gyros", topic.key, seconds(apart));
        }
    }
}

/// What of a topic is worth a sentence.
fn topic_details(text: &mut String, topic: &TopicInfo) {
    let (key, begin_ns) = (&topic.key, topic.first_ns.unwrap_or(0));
    if let Some(order) = &topic.order {
        if let Some(gap) = order.gaps.longest {
            let _ = writeln!(
                text,
                "{key}: longest gap {} ticks from {} on, after {}",
                gap.ticks,
                gap.first_sequence,
                after(gap.after_ns, begin_ns)
            );
        }
        if order.restarts > 0 {
            let (restarts, series) = (order.restarts, order.series_changes);
            let _ = writeln!(text, "{key}: {restarts} restarts, {series} of them with a new series");
        }
    }
    if topic.time_went_back > 0 {
        let _ = writeln!(text, "{key}: time did not advance {} times", topic.time_went_back);
    }
    if let (Some(longest), Some(intervals)) = (topic.longest_interval, topic.intervals)
        && longest.ns > intervals.p50_ns.saturating_mul(3) / 2
    {
        let _ = writeln!(
            text,
            "{key}: longest time between consecutive ticks {}, after {}",
            seconds(longest.ns),
            after(longest.after_ns, begin_ns)
        );
    }
    if let Some(durations) = topic.tick_durations.filter(|durations| durations.min_ns != durations.max_ns) {
        let _ = writeln!(text, "{key}: tick durations p50/p99/max {} ms", spread(&durations));
    }
    if let Some(drift) =
        topic.jitter.and_then(|jitter| jitter.clock_drift_ppm).filter(|drift| drift.abs() >= 1.0)
    {
        if drift.abs() < 10_000.0 {
            let _ = writeln!(text, "{key}: the recorder's clock gains {drift:.1} ppm on the producer's");
        } else {
            let _ =
                writeln!(text, "{key}: played at {:.3} times its recorded speed", 1.0 / (1.0 + drift * 1e-6));
        }
    }
    if topic.unreadable > 0 {
        let first = topic.first_unreadable.as_deref().unwrap_or_default();
        let _ = writeln!(text, "{key}: {} messages cannot be read; the first: {first}", topic.unreadable);
    }
}

fn unit_details(text: &mut String, unit: &UnitInfo, begin_ns: i64) {
    *text += &readings(unit);
    if let Some(modes) = &unit.modes {
        let between = modes.between_changes.map_or_else(String::new, |between| {
            format!(", {} from one to the next (median)", seconds(between.p50_ns))
        });
        let _ = writeln!(
            text,
            "modes: {} ticks +1, {} ticks −1, {} switches, {} commanded{between}",
            modes.plus_ticks, modes.minus_ticks, modes.changes, modes.switch_commands
        );
    }
    if let Some(corrected) = &unit.corrected {
        let _ = writeln!(
            text,
            "corrected: {} outputs of {} ticks, {} gaps announced with {} ticks, the longest {}",
            corrected.outputs,
            corrected.ticks,
            corrected.gaps,
            corrected.missed_ticks,
            corrected.longest_gap_ticks
        );
        let flags = corrected.flags.iter().chain(&corrected.sensor_flags);
        let flags: Vec<_> = flags.map(|(name, count)| format!("{name} {count}")).collect();
        if !flags.is_empty() {
            let _ = writeln!(text, "flags: {}", flags.join(", "));
        }
        let angle = corrected.angle_sigma_rad.map(|sigma| {
            let rms = sigma.rms.map(|rms| Angle::from_rad(rms).as_arcsec());
            ("angle", SigmaInfo { rms, ..sigma }, "″")
        });
        let velocity = corrected.velocity_sigma_m_per_s.map(|sigma| ("velocity", sigma, "m/s"));
        for (of, sigma, unit) in angle.into_iter().chain(velocity) {
            let SigmaInfo { outputs, unknown, rms: [x, y, z] } = sigma;
            if outputs == 0 {
                let _ = writeln!(text, "σ of {of} increments: unknown in {unknown} outputs");
            } else {
                let _ = writeln!(
                    text,
                    "σ of {of} increments, rms: {x:.3e} {y:.3e} {z:.3e} {unit}, unknown in {unknown} outputs"
                );
            }
        }
        for (channel, range) in &corrected.temperatures {
            let _ = writeln!(
                text,
                "temperature applied {channel}: {:.3} to {:.3} °C, up to {:.4} °C/s",
                range.min_deg_c, range.max_deg_c, range.max_rate_deg_c_per_s
            );
        }
        list(text, &corrected.revisions, |first| {
            let (counter, digest) = (first.revision.counter, show::hexadecimal(first.revision.digest));
            let when = after(first.first_end_ns, begin_ns);
            format!("calibration {counter} ({digest}): first tick {}, {when}", first.first_sequence)
        });
    }
    if let Some(journal) = &unit.journal {
        journal_details(text, journal);
    }
    if let Some(status) = &unit.status {
        list(text, &status.states, |StateInfo { last_tick_ns, state, .. }| {
            let first = || "before the first tick".to_owned();
            format!("state {state}: {}", last_tick_ns.map_or_else(first, |ns| after(ns, begin_ns)))
        });
    }
}

fn journal_details(text: &mut String, journal: &JournalInfo) {
    let entries: Vec<_> = journal.entries.iter().map(|(name, count)| format!("{name} {count}")).collect();
    let _ = writeln!(text, "journal: {}", entries.join(", "));
    if journal.missing_entries > 0 || journal.broken_parts > 0 {
        let (missing, broken) = (journal.missing_entries, journal.broken_parts);
        let _ = writeln!(text, "journal: {missing} entries are missing, {broken} parts are incomplete");
    }
    list(text, &journal.swaps, |swap| {
        let (counter, digest) = (swap.revision.counter, show::hexadecimal(swap.revision.digest));
        format!("given: calibration {counter} ({digest}), {}", swap.source)
    });
    list(text, &journal.commands, |command| {
        let verdict = if command.accepted { "" } else { "refused: " };
        format!("command {}: {verdict}{}", command.command, command.words)
    });
}

/// A line for each of the first, and how many more there are.
fn list<T>(text: &mut String, items: &[T], line: impl Fn(&T) -> String) {
    text.extend(items.iter().take(LISTED).map(|item| line(item) + "\n"));
    if items.len() > LISTED {
        let _ = writeln!(text, "  and {} more: --json lists them", items.len() - LISTED);
    }
}

fn dash() -> String {
    "–".to_owned()
}

/// Milliseconds, to the microsecond.
fn spread(spread: &Spread) -> String {
    [spread.p50_ns, spread.p99_ns, spread.max_ns].map(|ns| format!("{:.3}", as_s(ns) * 1e3)).join(" / ")
}

fn as_s(ns: u64) -> f64 {
    Span::from_ns(i64::try_from(ns).unwrap_or(i64::MAX)).as_s()
}

fn seconds(ns: u64) -> String {
    format!("{:.6} s", as_s(ns))
}

/// A time as seconds behind the beginning.
fn after(ns: i64, begin_ns: i64) -> String {
    format!("{:.6} s from the beginning", Timestamp::from_ns(ns).seconds_from(Timestamp::from_ns(begin_ns)))
}
