//! Columns cut at their gaps, and what cannot be analysed at all.

pub mod checks;
pub mod far;
pub(crate) mod steps;

use super::columns::Columns;
use crate::error::Error;
use crate::numbers::{real, seconds};
use crate::report::{counted, short};
use crate::runs::faults::{self, Fault};

/// Fewest ticks of a log.
pub const FEWEST_TICKS: usize = 64;
/// Missing ticks in a row that are bridged with the mean of their neighbours.
const LONGEST_BRIDGE: usize = 10;
/// Most of a log that may be bridged; beyond it every missing tick is a gap. Longer gaps do not count.
const LARGEST_BRIDGED_SHARE: f64 = 1e-3;
/// Ticks whose lengths differ by more than this from the middle one are told.
const UNEVEN: f64 = 0.05;

/// One sensor's readings without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Place of the first reading on the log's grid of ticks.
    pub start: usize,
    /// The readings.
    pub readings: Vec<f64>,
}

/// One sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Its name.
    pub name: String,
    /// Its pieces.
    pub pieces: Vec<Piece>,
}

/// A log that can be analysed.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Length of a tick (s).
    pub tick_s: f64,
    /// Ticks from beginning to end, gaps included.
    pub ticks: usize,
    /// Those of them that are missing.
    pub missing: usize,
    /// Sensors that can be analysed.
    pub sensors: Vec<Sensor>,
    /// Why others cannot, with what to do.
    pub refused: Vec<(String, String)>,
    /// What is to be said of gaps and times.
    pub notes: Vec<String>,
}

/// How the ticks of a log follow each other.
#[derive(Debug, Clone)]
pub struct Spacing {
    /// The middle distance of two (ns).
    middle_ns: i64,
    /// Mean distance of two without a gap between them (s).
    pub tick_s: f64,
    /// Distances that are not like the middle one.
    uneven: usize,
    gaps: Vec<Gap>,
}

/// Ticks that are missing before one.
#[derive(Debug, Clone, Copy)]
struct Gap {
    before: usize,
    missing: usize,
}

impl Grid {
    /// Cuts columns at their gaps.
    ///
    /// # Errors
    /// [`Error::Refused`]: too short, time that goes back, no sensor that can be analysed.
    pub fn of(mut columns: Columns) -> Result<Self, Error> {
        let spacing = Spacing::of(&columns.end_ns)?;
        let told = checks::at_rest(&mut columns, &spacing)?;
        let Columns { kind, names, end_ns, values, mut notes, .. } = columns;
        notes.extend(told);
        let count = end_ns.len();
        let missing = spacing.missing();
        let Spacing { middle_ns, tick_s, uneven, gaps } = spacing;
        let places = count + missing;
        if uneven * 100 > count {
            notes.push(format!(
                "{:.1} % of the ticks are more than 5 % longer or shorter than the median of {:.6} s; they are \
                 treated as equal.",
                real(uneven) * 100.0 / real(count),
                seconds(middle_ns)
            ));
        }
        let short = gaps.iter().map(|gap| gap.missing).filter(|missing| *missing <= LONGEST_BRIDGE);
        let bridge = real(short.sum::<usize>()) <= LARGEST_BRIDGED_SHARE * real(count);
        notes.extend(words(&gaps, bridge, tick_s));
        let mut grid =
            Self { tick_s, ticks: places, missing, sensors: Vec::new(), refused: Vec::new(), notes };
        for (name, column) in names.into_iter().zip(values) {
            let called = format!("{} {name}", kind.sensor());
            if let Some(fault) = Fault::of(&column) {
                grid.refused.push((name, fault.words("sensor", 1)));
                continue;
            }
            let bad = faults::missing(&column);
            if bad > 0 {
                let count =
                    counted(bad, "reading is not a number and counts", "readings are not numbers and count");
                grid.notes.push(format!("{called}: {count} as missing."));
            }
            grid.sensors.push(Sensor { name, pieces: cut(column, &gaps, bridge) });
        }
        if grid.sensors.is_empty() {
            let told = grid.notes.into_iter().filter(|note| note.starts_with("warning"));
            let refused = grid.refused.iter().map(|(name, why)| format!("{} {name}: {why}", kind.sensor()));
            return Err(Error::Refused(refused.chain(told).collect()));
        }
        Ok(grid)
    }

    /// Length of the log (h).
    pub fn length_h(&self) -> f64 {
        real(self.ticks) * self.tick_s / super::HOUR_S
    }
}

impl Spacing {
    /// Of the ends of ticks (ns).
    ///
    /// # Errors
    /// [`Error::Refused`]: too few, or time that goes back.
    pub fn of(end_ns: &[i64]) -> Result<Self, Error> {
        let count = end_ns.len();
        if count < FEWEST_TICKS {
            return Err(Error::refused(format!(
                "the log has {count} ticks, at least {FEWEST_TICKS} are needed, and for drift hours of them: log for longer"
            )));
        }
        let intervals: Vec<i64> = end_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
        if let Some(at) = intervals.iter().position(|interval| *interval <= 0) {
            return Err(Error::refused(format!(
                "time does not increase at tick {} of {count} ({} ns, then {} ns): are these logs of two runs, or in \
                 the wrong order? Give one run",
                at + 2,
                end_ns.get(at).copied().unwrap_or_default(),
                end_ns.get(at + 1).copied().unwrap_or_default(),
            )));
        }
        let mut sorted = intervals.clone();
        let (_, middle, _) = sorted.select_nth_unstable(intervals.len() / 2);
        let middle_ns = *middle;
        let gaps = gaps(&intervals, middle_ns);
        let uneven = intervals.iter().filter(|interval| {
            let off = real((**interval - middle_ns).abs());
            off > UNEVEN * real(middle_ns) && **interval < middle_ns + middle_ns / 2
        });
        let uneven = uneven.count();
        // The mean over everything that is no gap: the middle one may be off by the clock's resolution.
        let within: i64 = intervals.iter().filter(|interval| **interval < middle_ns + middle_ns / 2).sum();
        let whole = intervals.len() - gaps.len();
        let tick_s = seconds(within) / real(whole.max(1));
        Ok(Self { middle_ns, tick_s, uneven, gaps })
    }

    /// Ticks that are missing.
    pub fn missing(&self) -> usize {
        self.gaps.iter().map(|gap| gap.missing).sum()
    }
}

/// Where ticks are missing.
fn gaps(intervals: &[i64], middle_ns: i64) -> Vec<Gap> {
    let limit = middle_ns + middle_ns / 2;
    let long = intervals.iter().enumerate().filter(|(_, interval)| **interval >= limit);
    let gap = |(at, interval): (usize, &i64)| {
        let missing = (interval + middle_ns / 2) / middle_ns - 1;
        Gap { before: at + 1, missing: usize::try_from(missing).unwrap_or(0) }
    };
    long.map(gap).collect()
}

/// What is to be said of gaps.
fn words(gaps: &[Gap], bridge: bool, tick_s: f64) -> Vec<String> {
    let bridged = |gap: &&Gap| bridge && gap.missing <= LONGEST_BRIDGE;
    let single = gaps.iter().filter(bridged).map(|gap| gap.missing).sum::<usize>();
    let long: Vec<&Gap> = gaps.iter().filter(|gap| !bridged(gap)).collect();
    let mut notes = Vec::new();
    if single > 0 {
        let bridged = counted(single, "single missing tick is", "single missing ticks are");
        notes.push(format!("{bridged} bridged with the mean of their neighbours."));
    }
    if let Some(longest) = long.iter().map(|gap| gap.missing).max() {
        let missing: usize = long.iter().map(|gap| gap.missing).sum();
        notes.push(format!(
            "{} ({}, the longest of {} s) {} the log into {} pieces: Allan differences and spectra do not extend \
             over a gap, and R is not stated.",
            counted(long.len(), "gap", "gaps"),
            counted(missing, "tick", "ticks"),
            short(real(longest) * tick_s),
            if long.len() == 1 { "cuts" } else { "cut" },
            long.len() + 1
        ));
    }
    notes
}

/// Cuts a column; readings that are not numbers count as missing.
fn cut(column: Vec<f64>, gaps: &[Gap], bridge: bool) -> Vec<Piece> {
    if gaps.is_empty() && column.iter().all(|reading| reading.is_finite()) {
        return vec![Piece { start: 0, readings: column }];
    }
    let mut pieces: Vec<Piece> = Vec::new();
    let (mut gaps, mut place) = (gaps.iter().peekable(), 0);
    for (index, reading) in column.into_iter().enumerate() {
        if let Some(gap) = gaps.next_if(|gap| gap.before == index) {
            place += gap.missing;
        }
        if reading.is_finite() {
            let fits = pieces.last().map(|piece| place - piece.start - piece.readings.len());
            match (fits, pieces.last_mut()) {
                (Some(missing), Some(piece)) if missing == 0 || bridge && missing <= LONGEST_BRIDGE => {
                    let before = piece.readings.last().copied().unwrap_or(reading);
                    piece.readings.extend(std::iter::repeat_n(0.5 * (before + reading), missing));
                    piece.readings.push(reading);
                }
                _ => pieces.push(Piece { start: place, readings: vec![reading] }),
            }
        }
        place += 1;
    }
    pieces
}

#[expect(clippy::cast_precision_loss, reason = "numbers of ticks of tests")]
#[cfg(test)]
mod tests {
    use super::super::columns::Kind;
    use super::*;

    fn columns(end_ns: Vec<i64>, values: Vec<Vec<f64>>) -> Columns {
        let names = (0..values.len()).map(|index| index.to_string()).collect();
        let unit = isotherm_log::offline::unit_id("U").unwrap();
        Columns {
            unit,
            kind: Kind::Rate,
            names,
            corrected: false,
            start_s: 0.0,
            duration_s: Vec::new(),
            frozen: Vec::new(),
            end_ns,
            values,
            notes: Vec::new(),
        }
    }

    fn wave(count: i64) -> Vec<f64> {
        (0..count).map(|k| (k as f64).sin()).collect()
    }

    #[test]
    fn a_log_without_gaps_is_one_piece() {
        let grid = Grid::of(columns((0..100).map(|k| k * 10_000_000).collect(), vec![wave(100)])).unwrap();
        assert_eq!((grid.ticks, grid.sensors[0].pieces.len()), (100, 1));
        assert!((grid.tick_s - 0.01).abs() < 1e-12 && grid.notes.is_empty());
    }

    #[test]
    fn long_gaps_cut_and_single_missing_ticks_are_bridged() {
        let place = |k: i64| if k < 3000 { k } else { k + 1 };
        let end_ns: Vec<i64> = (0..6000).map(|k| place(k) * 1_000_000).collect();
        let grid = Grid::of(columns(end_ns.clone(), vec![wave(6000)])).unwrap();
        let pieces = &grid.sensors[0].pieces;
        assert_eq!((pieces.len(), pieces[0].readings.len()), (1, 6001));
        let wave = wave(6000);
        assert!((pieces[0].readings[3000] - 0.5 * (wave[2999] + wave[3000])).abs() < 1e-15);

        let far: Vec<i64> =
            (0..6000).map(|k| if k < 3000 { k } else { k + 500 }).map(|k| k * 1_000_000).collect();
        let grid = Grid::of(columns(far.clone(), vec![wave.clone()])).unwrap();
        let pieces = &grid.sensors[0].pieces;
        assert_eq!((pieces.len(), pieces[1].start, grid.ticks), (2, 3500, 6500));
        // A long gap is no reason to leave a single missing tick open.
        let both =
            far.into_iter().map(|end_ns| if end_ns < 1_000_000_000 { end_ns } else { end_ns + 1_000_000 });
        let with_single = Grid::of(columns(both.collect(), vec![wave])).unwrap();
        let pieces = &with_single.sensors[0].pieces;
        assert_eq!((pieces.len(), pieces[1].start, with_single.missing), (2, 3501, 501));
        insta::assert_snapshot!(grid.notes.join("\n"));
    }

    #[test]
    fn what_cannot_be_analysed_is_refused_in_words() {
        let times: Vec<i64> = (0..1000).map(|k| k * 1_000_000).collect();
        let mut some_bad = wave(1000);
        some_bad[500] = f64::NAN;
        let grid = Grid::of(columns(times.clone(), vec![wave(1000), vec![7.0; 1000], some_bad])).unwrap();
        assert_eq!((grid.sensors.len(), grid.sensors[1].pieces.len()), (2, 1), "one bad reading is bridged");
        let mut told = format!("{:?}\n{}\n", grid.refused, grid.notes.join("\n"));
        let mut back = times.clone();
        back[10] = 0;
        for (times, values) in [
            (times[..63].to_vec(), vec![wave(63)]),
            (back, vec![wave(1000)]),
            (times.clone(), vec![vec![f64::NAN; 1000]]),
            (times, vec![vec![0.0; 1000]; 3]),
        ] {
            told += &(Grid::of(columns(times, values)).unwrap_err().to_string() + "\n");
        }
        insta::assert_snapshot!(told);
    }
}
