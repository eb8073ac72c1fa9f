//! The parts of a mapping that say how bytes become rows, and when a row is.

use isotherm_correction::units::Span;

use super::section::{Item, Section};
use super::{Delimiter, Layout, Marks, OnBadRow, TimeColumn, TimeMapping, TimeUnit};

/// Words for units of time.
pub(super) const TIME_UNITS: &[(&str, TimeUnit)] = &[
    ("ns", TimeUnit::Nanoseconds),
    ("us", TimeUnit::Microseconds),
    ("ms", TimeUnit::Milliseconds),
    ("s", TimeUnit::Seconds),
];
/// Keys for the nominal tick, with ns in their unit.
const TICKS: &[(&str, f64)] = &[("tick_ns", 1.0), ("tick_us", 1e3), ("tick_ms", 1e6), ("tick_s", 1e9)];
/// Longest nominal tick (ns): one hour.
const LONGEST_TICK_NS: f64 = 3.6e12;
/// Words for delimiters.
const DELIMITERS: &[(&str, Delimiter)] = &[
    ("comma", Delimiter::Character(b',')),
    ("semicolon", Delimiter::Character(b';')),
    ("tab", Delimiter::Character(b'\t')),
    ("pipe", Delimiter::Character(b'|')),
    ("whitespace", Delimiter::Whitespace),
];

/// Reads the keys of a file that say how bytes become rows.
pub(super) fn layout(file: &Section<'_, '_>) -> Option<Layout> {
    let delimiter_item = file.need("delimiter", "what stands between two cells, e.g. \"comma\"");
    let delimiter = delimiter_item.and_then(|item| item.choice(DELIMITERS));
    let comment = file.get("comment").and_then(|item| comment(&item));
    let count = |key| file.get(key).and_then(|item| item.integer(0..=1_000_000)).map_or(0, i64::unsigned_abs);
    let (skip_lines, drop_rows) = (count("skip_lines"), count("drop_rows"));
    let header = file.get("header").and_then(|item| item.boolean()).unwrap_or(false);
    let mark_item = file.get("decimal_mark");
    let decimal_mark =
        mark_item.as_ref().and_then(|item| item.choice(&[(".", b'.'), (",", b',')])).unwrap_or(b'.');
    if let Some(item) = mark_item.filter(|_| delimiter == Some(Delimiter::Character(decimal_mark))) {
        item.refuse("is also the delimiter: cells could not be told apart");
    }
    let words = [("refuse", OnBadRow::Refuse), ("skip", OnBadRow::Skip)];
    let on_bad_row = file.get("on_bad_row").and_then(|item| item.choice(&words)).unwrap_or(OnBadRow::Refuse);
    Some(Layout { delimiter: delimiter?, comment, skip_lines, header, drop_rows, decimal_mark, on_bad_row })
}

/// Reads a comment prefix.
fn comment(item: &Item<'_, '_>) -> Option<String> {
    let text = item.string()?;
    if text.is_empty()
        || text.starts_with(|c: char| c.is_ascii_digit() || c.is_whitespace() || "+-.".contains(c))
    {
        item.refuse(
            "would make every row a comment, or a row of numbers: take another prefix, or leave the key out",
        );
        return None;
    }
    Some(text.to_owned())
}

/// Reads the `time` table. `own_durations`: every stream of the file has a duration column of its own.
pub(super) fn time(section: &Section<'_, '_>, own_durations: bool) -> Option<TimeMapping> {
    let tick = nominal(section);
    let column = section.get("column").map(|item| item.column());
    let stamped = column.is_some();
    let unit = if stamped {
        section.need("unit", "unit of the stamps: \"ns\", \"us\", \"ms\" or \"s\"")
    } else {
        only_with(section, "unit", stamped)
    };
    let unit = unit.and_then(|item| item.choice(TIME_UNITS));
    let marks = only_with(section, "marks", stamped);
    let marks = marks.and_then(|item| item.choice(&[("start", Marks::Start), ("end", Marks::End)]));
    let duration = only_with(section, "duration", stamped);
    let measured =
        duration.and_then(|item| item.choice(&[("measured", true), ("nominal", false)])).unwrap_or(stamped);
    let gap_item = only_with(section, "gap_after_ticks", stamped);
    let gap_after_ticks = gap_item.as_ref().and_then(Item::positive);
    if let Some(item) = gap_item.filter(|_| gap_after_ticks.is_some_and(|ticks| ticks < 1.25)) {
        item.refuse("must be 1.25 or more, or jitter would count as a gap");
    }
    let origin_ns =
        section.get("origin_ns").and_then(|item| item.integer(i64::MIN / 4..=i64::MAX / 4)).unwrap_or(0);
    if tick == Some(None) && !(stamped && own_durations && gap_after_ticks.is_none()) {
        let what = if stamped {
            "the first tick has no stamp before it, so the nominal duration is needed, e.g. tick_ms = 10.0"
        } else {
            "without a time column, rows need a nominal duration, e.g. tick_ms = 10.0"
        };
        section.missing("tick_ms", what);
    }
    let stamps = match column {
        Some(column) => Some(TimeColumn { column: column?, unit: unit? }),
        None => None,
    };
    Some(TimeMapping {
        stamps,
        marks: marks.unwrap_or(Marks::End),
        tick: tick?,
        measured,
        gap_after_ticks,
        origin_ns,
    })
}

/// A key that has a meaning only beside a time column.
fn only_with<'a, 't>(section: &Section<'a, 't>, key: &'static str, stamped: bool) -> Option<Item<'a, 't>> {
    let item = section.get(key)?;
    if !stamped {
        item.refuse("has a meaning only with a time column: add `column`, or remove this key");
        return None;
    }
    Some(item)
}

/// The nominal tick from whichever of its keys is there; outer `None` where it is wrong.
#[expect(clippy::option_option, reason = "outer: sound or not; inner: there or not")]
fn nominal(section: &Section<'_, '_>) -> Option<Option<Span>> {
    let mut tick = None;
    let mut sound = true;
    for &(key, ns) in TICKS {
        let Some(item) = section.get(key) else { continue };
        if tick.is_some() {
            item.refuse("states the tick a second time: keep one of tick_ns, tick_us, tick_ms, tick_s");
            sound = false;
        }
        match item.positive().map(|number| number * ns) {
            Some(nanoseconds) if (1.0..=LONGEST_TICK_NS).contains(&nanoseconds) => {
                tick = Some(Span::from_s(nanoseconds * 1e-9));
            }
            Some(_) => {
                item.refuse("must be 1 ns to 1 h");
                sound = false;
            }
            None => sound = false,
        }
    }
    sound.then_some(tick)
}
