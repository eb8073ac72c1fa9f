//! The summary as tables, and what must be said beside it.

use std::collections::BTreeSet;

use super::{Report, show};
use crate::play::{Acknowledge, PlayOptions, PlayReport, UnitReport};
use isotherm_document::few;

/// What whoever reads only the table must know.
pub(super) fn warnings(play: &PlayReport) -> Vec<String> {
    let of = |chosen: fn(&UnitReport) -> bool| {
        let mut units = play.units.iter().filter(|unit| chosen(unit)).map(|unit| &*unit.unit).peekable();
        units.peek().is_some().then(|| few(units))
    };
    let uncalibrated =
        of(|unit| unit.returned.ticks_uncalibrated.is_some_and(|ticks| ticks > 0)).map(|units| {
            let returned = |unit: &UnitReport| unit.returned.ticks_uncalibrated;
            let ticks: u64 = play.units.iter().filter_map(returned).sum();
            format!(
                "{units}: the service had no calibration for {ticks} ticks and returned them uncorrected; give it a \
                 document that names the unit"
            )
        });
    let mixed = of(UnitReport::is_mixed).map(|units| {
        format!(
            "{units}: another player, or services that are no pair: what came back may not be what was sent"
        )
    });
    let unreadable = of(|unit| unit.counts.messages_unreadable > 0).map(|units| {
        format!("{units}: some of the log's messages cannot be read; they were played unchanged")
    });
    let unknown = of(|unit| !unit.unknown_channels.is_empty()).map(|units| {
        let channels: BTreeSet<_> = play.units.iter().flat_map(|unit| &unit.unknown_channels).collect();
        let channels = few(channels);
        format!(
            "{units}: the calibration has no temperature channels {channels}: their readings were not used"
        )
    });
    uncalibrated.into_iter().chain(mixed).chain(unreadable).chain(unknown).collect()
}

/// The summary as tables.
pub(super) fn human(report: &Report<'_>, options: &PlayOptions) -> String {
    let play = report.play;
    let late = &play.lateness;
    let mut rows = vec![
        ("messages sent", play.messages_sent.to_string()),
        ("time in the log (s)", format!("{:.3}", play.log_s)),
        ("time taken (s)", format!("{:.3}", play.elapsed_s)),
    ];
    if play.paused_s > 0.0 {
        rows.push(("of that, paused (s)", format!("{:.3}", play.paused_s)));
    }
    rows.push(("actual speed", format!("{:.2}×", play.actual_speed)));
    if play.passes > 1 {
        rows.push(("passes", play.passes.to_string()));
    }
    if play.seeks > 0 {
        rows.push(("seeks", play.seeks.to_string()));
    }
    if late.messages > 0 {
        rows.extend([
            ("deadlines missed", format!("{} of {}", late.misses, late.messages)),
            (
                "lateness (ms): p50, p99, max",
                format!("{:.3}, {:.3}, {:.3}", late.p50_ms, late.p99_ms, late.max_ms),
            ),
        ]);
    }
    show::table(&rows) + &units(play, options) + &show::reading(report.log)
}

/// One row per unit.
fn units(play: &PlayReport, options: &PlayOptions) -> String {
    if play.units.is_empty() {
        return String::new();
    }
    let figure = |count: Option<u64>| count.map_or_else(String::new, |count| count.to_string());
    let (acknowledged, faults) = (options.acknowledge != Acknowledge::No, !options.faults.is_none());
    let mut header = vec!["unit", "gyro", "accel", "temp"];
    if faults {
        header.extend(["withheld", "again", "held back"]);
    }
    if acknowledged {
        header.extend(["came back", "uncalibrated", "not sent", "announced", "late", "lost", "duplicated"]);
    }
    let under_way = play.returned.ticks_under_way.is_some_and(|ticks| ticks > 0);
    if under_way {
        header.push("under way");
    }
    let row = |unit: &UnitReport| {
        let counts = &unit.counts;
        let mut row = vec![
            unit.unit.clone(),
            unit.ticks_sent.to_string(),
            counts.accel_ticks_sent.to_string(),
            counts.temperature_readings_sent.to_string(),
        ];
        if faults {
            let counts = [counts.messages_withheld, counts.messages_sent_again, counts.messages_held_back];
            row.extend(counts.map(|count| count.to_string()));
        }
        if acknowledged {
            let counts = [
                unit.returned.ticks_acknowledged,
                unit.returned.ticks_uncalibrated,
                unit.returned.ticks_not_sent,
                unit.returned.ticks_announced_missing,
                unit.returned.ticks_late,
                unit.returned.ticks_lost,
                unit.returned.ticks_duplicated,
            ];
            row.extend(counts.map(figure));
        }
        if under_way {
            row.push(figure(unit.returned.ticks_under_way));
        }
        row
    };
    show::grid(header, play.units.iter().map(row), 1..)
}
