//! What must hold of a log at rest before anything is made of it: for `drift` and for `impact`.

use super::Spacing;
use crate::drift::columns::{Columns, Kind, name};
use crate::drift::figures::short;
use crate::error::Error;
use crate::series::Ticks;

/// Rate beyond which a unit does not rest, or its unit of measure is wrong (°/s); `thermal` has the same.
const FASTEST_DEG_PER_S: f64 = 20.0;
/// Corrected rate at rest beyond which it is told (°/h): the bias is out, and the Earth turns by 15 °/h.
const LARGEST_CORRECTED_DEG_PER_H: f64 = 100.0;
/// How far the distance of ticks may be from how long they last before it is told, and before it is refused (factor).
const UNLIKE: f64 = 0.01;
const UNLIKE_FACTOR: f64 = 2.0;
/// A reading that stays the same is told from this share of the log, or this long (s), but never below so many ticks.
const FROZEN_SHARE: f64 = 0.01;
const FROZEN_S: f64 = 60.0;
const FROZEN_TICKS: usize = 32;
/// Share of the other readings that may repeat the one before: coarse counts and slow sensors repeat more.
const LARGEST_REPEATED: f64 = 0.55;
/// Readings farther than this from the middle one are told (robust standard deviations).
const FAR: f64 = 50.0;
/// Far readings in a row that are no longer single ones.
const SINGLE: usize = 3;
/// Parts of the log whose noise is compared, and the ratio that is told.
const PARTS: usize = 8;
const UNLIKE_NOISE: f64 = 10.0;
/// Standard deviation of normal noise over the median of its size.
const OF_MEDIAN: f64 = 1.4826;
/// Largest share of the ticks that may be missing without a word.
const LARGEST_MISSING: f64 = 0.01;

/// What the raw readings of a log say, whatever a correction makes of them: dead sensors are refused, frozen ones told.
///
/// # Errors
/// [`Error::Refused`] with every sensor whose readings never change.
pub fn raw(kind: Kind, ticks: &Ticks) -> Result<Vec<String>, Error> {
    let called = |index| format!("{} {}", kind.sensor(), name(index, ticks.readings.len()));
    let columns = || ticks.readings.iter().enumerate();
    let dead: Vec<String> = columns().filter_map(|(index, column)| dead(&called(index), column)).collect();
    if !dead.is_empty() {
        return Err(Error::Refused(dead));
    }
    Ok(columns().filter_map(|(index, column)| frozen(&called(index), &ticks.end_ns, column)).collect())
}

/// Why a sensor whose readings never change is no use; `None` where they do, or where there is none.
#[must_use]
pub fn dead(called: &str, column: &[f64]) -> Option<String> {
    let mut good = column.iter().filter(|reading| reading.is_finite());
    let first = good.next()?;
    good.all(|reading| (reading - first).abs() <= 0.0).then(|| {
        format!(
            "{called}: every reading is {first}: the sensor is dead, or the mapping names the wrong column"
        )
    })
}

/// Where a reading stays exactly the same for long, though elsewhere it changes from tick to tick.
#[must_use]
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts of ticks are far below 2⁵³"
)]
pub fn frozen(called: &str, end_ns: &[i64], column: &[f64]) -> Option<String> {
    let (first, last) = (*end_ns.first()?, *end_ns.last()?);
    let length_s = last.saturating_sub(first) as f64 * 1e-9;
    let tick_s = length_s / (column.len().max(2) - 1) as f64;
    let limit = (FROZEN_SHARE * column.len() as f64).min(FROZEN_S / tick_s).max(FROZEN_TICKS as f64) as usize;
    let (mut long, mut repeated, mut changed) = (Vec::new(), 0_usize, 0_usize);
    let mut start = 0;
    for run in column.chunk_by(|a, b| (a - b).abs() <= 0.0) {
        if run.len() > limit {
            long.push((start, start + run.len() - 1));
        } else {
            repeated += run.len() - 1;
            changed += 1;
        }
        start += run.len();
    }
    // What never changes at all is refused as dead.
    let &(from, to) = long.first().filter(|_| long.len() + changed > 1)?;
    if repeated as f64 > LARGEST_REPEATED * (repeated + changed) as f64 {
        return None;
    }
    let since = |at: usize| end_ns.get(at).map_or(0.0, |end| end.saturating_sub(first) as f64 * 1e-9);
    let further = match long.len() {
        1 => String::new(),
        count => format!(", and {} times more, until {:.2} s at last", count - 1, since(long[count - 1].1)),
    };
    let value = column.get(from).copied().unwrap_or_default();
    Some(format!(
        "warning: {called} reads exactly {value} from {:.2} s to {:.2} s{further}: it froze, or its output was lost; cut the log to \
         where it lives with --start and --duration",
        since(from),
        since(to)
    ))
}

/// What is to be said of columns that are to be analysed.
///
/// # Errors
/// [`Error::Refused`] where the unit does not rest, or where ticks lie much farther apart than they last.
pub fn at_rest(columns: &Columns, spacing: &Spacing) -> Result<Vec<String>, Error> {
    let mut notes: Vec<String> = timing(columns, spacing)?.into_iter().collect();
    let mut moving = Vec::new();
    for (name, column) in columns.names.iter().zip(&columns.values) {
        let called = format!("{} {name}", columns.kind.sensor());
        let Some((middle, sigma)) = robust(column) else { continue };
        if columns.kind == Kind::Rate {
            let deg_per_s = middle / 3600.0;
            if deg_per_s.abs() > FASTEST_DEG_PER_S {
                moving.push(format!(
                    "{called} reads {deg_per_s:.1} °/s in the median, at most {FASTEST_DEG_PER_S} °/s is rest: does the unit move, are \
                     columns swapped, or is the unit of measure in the mapping wrong ({:.3} as °/s, {:.3} as °/h)?",
                    deg_per_s.to_radians(),
                    deg_per_s.to_radians() / 3600.0
                ));
            } else if columns.corrected && middle.abs() > LARGEST_CORRECTED_DEG_PER_H {
                notes.push(format!(
                    "warning: {called} reads {middle:.0} °/h in the median after the correction, the Earth turns by 15 °/h: does the \
                     unit rest, is the unit of measure in the mapping right?"
                ));
            }
        }
        notes.extend(far(&called, columns, column, (middle, sigma)));
        notes.extend(unlike(&called, columns, column));
    }
    if moving.is_empty() { Ok(notes) } else { Err(Error::Refused(moving)) }
}

/// How much of a log is missing, where that is more than a little.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts of ticks are far below 2⁵³")]
pub fn missing(spacing: &Spacing, count: usize) -> Option<String> {
    let missing = spacing.missing();
    let share = missing as f64 / (count + missing) as f64;
    (share > LARGEST_MISSING).then(|| {
        format!(
            "warning: {missing} of {} ticks ({:.1} %) are missing: look for what loses them",
            count + missing,
            share * 100.0
        )
    })
}

/// Whether ticks are as far apart as they last.
fn timing(columns: &Columns, spacing: &Spacing) -> Result<Option<String>, Error> {
    let mut lasts = columns.duration_s.clone();
    let Some(lasts_s) = middle(&mut lasts).filter(|lasts_s| *lasts_s > 0.0) else { return Ok(None) };
    let ratio = spacing.tick_s / lasts_s;
    if (ratio - 1.0).abs() <= UNLIKE {
        return Ok(None);
    }
    let words = format!(
        "ticks are {} apart and last {} by the mapping or the producer: is the unit of the time column right, or is every other tick \
         missing?",
        seconds(spacing.tick_s),
        seconds(lasts_s)
    );
    // A hundredth more, so that what was meant to be twice is twice.
    let limit = UNLIKE_FACTOR * (1.0 + UNLIKE);
    if ratio > limit || ratio < 1.0 / limit {
        return Err(Error::Refused(vec![words]));
    }
    Ok(Some(format!("warning: {words}")))
}

fn seconds(seconds: f64) -> String {
    if seconds < 1.0 { format!("{} ms", short(seconds * 1e3)) } else { format!("{} s", short(seconds)) }
}

/// Readings far beyond the noise: single ones, or a time in which the unit was moved.
fn far(called: &str, columns: &Columns, column: &[f64], (middle, sigma): (f64, f64)) -> Option<String> {
    let is_far = |reading: &f64| (reading - middle).abs() > FAR * sigma;
    if sigma <= 0.0 {
        return None;
    }
    let first = column.iter().position(is_far)?;
    let last = column.iter().rposition(is_far)?;
    let count = column.iter().filter(|reading| is_far(reading)).count();
    let in_a_row =
        column.chunk_by(|a, b| is_far(a) == is_far(b)).filter(|run| run.first().is_some_and(is_far));
    let single = in_a_row.map(<[f64]>::len).max().unwrap_or(0) <= SINGLE;
    let measure = columns.measure();
    let value = short(column.get(first).copied().unwrap_or_default());
    let (at, until) = (columns.since_s(first), columns.since_s(last));
    Some(if single {
        format!(
            "warning: {called}: {count} single readings are far beyond the noise (more than {FAR} standard deviations), the first at \
             {at:.2} s: {value} {measure}; noise and drift are spoilt by them, look for what makes them"
        )
    } else {
        format!(
            "warning: {called}: {count} readings between {at:.2} s and {until:.2} s are far beyond the noise (more than {FAR} standard \
             deviations), the first is {value} {measure}: did the unit turn, or was it knocked? Cut the log to where it rests with \
             --start and --duration"
        )
    })
}

/// Noise that is not the same all through a log.
fn unlike(called: &str, columns: &Columns, column: &[f64]) -> Option<String> {
    let length = column.len().div_ceil(PARTS).max(2);
    let noise = |part: &[f64]| {
        let mut steps: Vec<f64> = part.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        steps.retain(|step| step.is_finite());
        middle(&mut steps)
    };
    let of: Vec<f64> = column.chunks(length).map(|part| noise(part).unwrap_or(0.0)).collect();
    // A part without noise is frozen, or of coarse counts.
    let least = of.iter().copied().filter(|noise| *noise > 0.0).fold(f64::INFINITY, f64::min);
    let largest = of.iter().copied().fold(0.0, f64::max);
    if largest <= UNLIKE_NOISE * least {
        return None;
    }
    let loud = of.iter().position(|noise| *noise >= largest)?;
    let ends = columns.since_s((loud * length + length).min(column.len()) - 1);
    Some(format!(
        "warning: {called}: the noise is {:.0} times as large between {:.0} s and {ends:.0} s as where it is least: are there two units \
         of measure in the log, or did the unit move?",
        largest / least,
        columns.since_s(loud * length)
    ))
}

/// Middle of the good readings, and their standard deviation by the middle distance from it.
fn robust(column: &[f64]) -> Option<(f64, f64)> {
    let mut good: Vec<f64> = column.iter().copied().filter(|reading| reading.is_finite()).collect();
    let about = middle(&mut good)?;
    good.iter_mut().for_each(|reading| *reading = (*reading - about).abs());
    Some((about, OF_MEDIAN * middle(&mut good)?))
}

/// The middle one; the order is lost.
fn middle(values: &mut [f64]) -> Option<f64> {
    let half = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(half, f64::total_cmp).1)
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, clippy::cast_possible_wrap, reason = "numbers of ticks of tests")]
mod tests {
    use super::*;

    const TICK_NS: i64 = 20_000_000;

    fn wave(count: usize) -> Vec<f64> {
        (0..count).map(|k| (k as f64 * 1.7).sin() + 0.3 * (k as f64 * 0.91).sin()).collect()
    }

    fn times(count: usize) -> Vec<i64> {
        (0..count as i64).map(|k| k * TICK_NS).collect()
    }

    fn frozen_in(column: &[f64]) -> Option<String> {
        frozen("gyro y", &times(column.len()), column)
    }

    #[test]
    fn frozen_readings_are_told_and_coarse_or_slow_ones_are_not() {
        let good = wave(20_000);
        assert_eq!(frozen_in(&good), None);
        let mut half = good.clone();
        half[10_000..15_000].fill(0.5);
        let words = frozen_in(&half).unwrap();
        assert!(words.contains("gyro y reads exactly 0.5 from 200.00 s to 299.98 s"), "{words}");
        let mut short = good.clone();
        short[10_000..10_100].fill(0.5);
        assert_eq!(frozen_in(&short), None, "half a hundredth of the log");
        // Counts that are nearly always the same, and a sensor that is read more often than it measures.
        let coarse: Vec<f64> = (0..20_000).map(|k| if k % 900 < 2 { 1.0 } else { 0.0 }).collect();
        assert_eq!(frozen_in(&coarse), None);
        let mut slow: Vec<f64> = good.iter().step_by(10).flat_map(|reading| [*reading; 10]).collect();
        slow[3000..3300].fill(0.5);
        assert_eq!(frozen_in(&slow), None);
    }

    #[test]
    fn noise_of_two_measures_and_far_readings_are_told() {
        let mut columns = Columns {
            unit: isotherm_log::offline::unit_id("U").unwrap(),
            kind: Kind::Rate,
            names: vec!["x".to_owned()],
            corrected: true,
            end_ns: times(8000),
            duration_s: vec![0.02; 8000],
            values: vec![wave(8000)],
            notes: Vec::new(),
        };
        let told = |columns: &Columns| {
            let spacing = Spacing::of(&columns.end_ns)?;
            at_rest(columns, &spacing)
        };
        assert!(told(&columns).unwrap().is_empty());
        columns.values[0][4000..].iter_mut().for_each(|reading| *reading *= 57.3);
        let words = told(&columns).unwrap().join("\n");
        assert!(words.contains("the noise is 57 times as large between 80 s"), "{words}");
        columns.values = vec![wave(8000)];
        columns.values[0][1000] = 1e9;
        let words = told(&columns).unwrap().join("\n");
        assert!(words.contains("1 single readings") && words.contains("the first at 20.00 s"), "{words}");
        columns.values = vec![wave(8000)];
        columns.values[0][1000..1100].fill(1e5);
        let words = told(&columns).unwrap().join("\n");
        assert!(
            words.contains("100 readings between 20.00 s and 21.98 s") && words.contains("did the unit turn")
        );
        columns.values = vec![wave(8000).iter().map(|reading| reading + 419.0).collect()];
        assert!(told(&columns).unwrap()[0].contains("reads 419 °/h"));
        columns.values = vec![wave(8000).iter().map(|reading| reading + 57.3 * 3600.0).collect()];
        let words = told(&columns).unwrap_err().to_string();
        assert!(words.contains("gyro x reads 57.3 °/s in the median, at most 20 °/s"), "{words}");
        columns.values = vec![wave(8000)];
        columns.duration_s = vec![0.01; 8000];
        let words = told(&columns).unwrap().join("\n");
        assert!(words.contains("ticks are 20.0 ms apart and last 10.0 ms"), "{words}");
        columns.duration_s = vec![2e-5; 8000];
        assert!(told(&columns).unwrap_err().to_string().contains("is the unit of the time column right"));
    }
}
