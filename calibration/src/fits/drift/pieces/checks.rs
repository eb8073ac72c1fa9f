//! What must hold of a log at rest before anything is made of it: for `drift` and for `impact`.

use super::far::{self, Far};
use super::{Spacing, steps};
use crate::axes::sensor_name;
use crate::error::Error;
use crate::fits::drift::columns::{Columns, Kind};
use crate::numbers::{median, middle_and_scatter, real, scatter_of_steps, seconds};
use crate::report::{fixed, short, six};
use crate::runs::faults::{self, Fault};
use crate::runs::series::Series;
use crate::runs::table::is_one_g;

/// Rate beyond which a unit does not rest, or its unit of measure is wrong (°/s): Earth's rate and the bias of a poor micromechanical
/// gyro stay below.
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
/// Parts of the log whose noise is compared, and the ratio that is told.
const PARTS: usize = 8;
const UNLIKE_NOISE: f64 = 10.0;
/// Largest share of the ticks that may be missing without a word.
const LARGEST_MISSING: f64 = 0.01;

/// What the raw readings of a log say, whatever a correction makes of them: dead sensors are refused, frozen ones told.
///
/// # Errors
/// [`Error::Refused`] with every sensor whose readings never change.
pub fn raw(kind: Kind, series: &Series) -> Result<Vec<String>, Error> {
    let ticks = if kind == Kind::Rate { &series.gyros } else { &series.accels };
    let times = (series.start_s, &*ticks.end_ns);
    let called = |index| format!("{} {}", kind.sensor(), sensor_name(index, ticks.readings.len()));
    let columns = || ticks.readings.iter().enumerate();
    let words = |(index, column): (usize, &Vec<f64>)| {
        let dead = Fault::Dead(faults::dead(column)?).words(kind.sensor(), ticks.readings.len());
        Some(format!("{}: {dead}", called(index)))
    };
    let dead: Vec<String> = columns().filter_map(words).collect();
    if !dead.is_empty() {
        return Err(Error::Refused(dead));
    }
    Ok(columns().filter_map(|(index, column)| frozen(&called(index), times, column)).collect())
}

/// Where a reading stays exactly the same for long, though elsewhere it changes from tick to tick; the times are of a part that begins
/// there in its log (s).
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts of ticks are far below 2⁵³"
)]
pub fn frozen(called: &str, (start_s, end_ns): (f64, &[i64]), column: &[f64]) -> Option<String> {
    let (first, last) = (*end_ns.first()?, *end_ns.last()?);
    let length_s = seconds(last.saturating_sub(first));
    let tick_s = length_s / real(column.len().max(2) - 1);
    let limit = (FROZEN_SHARE * real(column.len())).min(FROZEN_S / tick_s).max(real(FROZEN_TICKS)) as usize;
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
    if real(repeated) > LARGEST_REPEATED * real(repeated + changed) {
        return None;
    }
    let since = |at: usize| start_s + end_ns.get(at).map_or(0.0, |end| seconds(end.saturating_sub(first)));
    let further = match long.len() {
        1 => String::new(),
        count => format!(", and {} times more, until {:.2} s at last", count - 1, since(long[count - 1].1)),
    };
    let value = column.get(from).copied().unwrap_or_default();
    Some(format!(
        "warning: {called} reads exactly {} from {:.2} s to {:.2} s{further}: it froze, or its output was lost; cut \
         the log to the valid part with --start and --duration",
        six(value),
        since(from),
        since(to)
    ))
}

/// What is to be said of columns that are to be analysed. Single readings far beyond the noise are left out of them.
///
/// # Errors
/// [`Error::Refused`] where the unit does not rest, or where ticks lie much farther apart than they last.
pub fn at_rest(columns: &mut Columns, spacing: &Spacing) -> Result<Vec<String>, Error> {
    let mut notes = columns.frozen.clone();
    notes.extend(timing(columns, spacing)?);
    let noise: Vec<Vec<f64>> = columns.values.iter().map(|column| noise(column)).collect();
    let (mut moving, mut spikes) = (Vec::new(), Vec::new());
    for ((name, column), noise) in columns.names.iter().zip(&columns.values).zip(&noise) {
        let called = format!("{} {name}", columns.kind.sensor());
        let [middle, sigma] = middle_and_scatter(column);
        if columns.kind == Kind::Rate {
            if let Some(words) = moves(&called, middle / 3600.0) {
                moving.push(words);
            } else if columns.corrected && middle.abs() > LARGEST_CORRECTED_DEG_PER_H {
                notes.push(format!(
                    "warning: {called} reads {} °/h in the median after the correction, the Earth turns by \
                     15 °/h: is the unit at rest? Check the unit of measure in the mapping",
                    fixed(middle, 0)
                ));
            }
        }
        // Where the noise is not the same all through, the larger one counts.
        let sigma = noise.iter().copied().fold(sigma, f64::max);
        let far = Far::of(column, (middle, sigma));
        notes.extend(far.words(&called, columns, column));
        spikes.push(far.single());
    }
    if !moving.is_empty() {
        return Err(Error::Refused(moving));
    }
    notes.extend(gravity(columns));
    far::leave_out(columns, &spikes);
    for ((name, column), noise) in columns.names.iter().zip(&columns.values).zip(&noise) {
        let called = format!("{} {name}", columns.kind.sensor());
        let unlike = if columns.frozen.is_empty() { unlike(&called, columns, noise) } else { None };
        // Where the noise changes, a step is one more sign of what is told already.
        let step = || {
            let (step, tick) = steps::step_in(column, steps::FEWEST_TICKS)?;
            let words = steps::words((&called, columns.kind.measure()), step, columns.since_s(tick));
            Some(format!("warning: {words}"))
        };
        notes.extend(unlike.or_else(step));
    }
    Ok(notes)
}

/// Words where corrected accelerometers do not feel gravity; raw ones may be in V.
fn gravity(columns: &Columns) -> Option<String> {
    let feels = columns.kind == Kind::Force && columns.corrected;
    let size = columns.values.iter().map(|column| median(column).powi(2)).sum::<f64>().sqrt();
    (feels && !is_one_g(size)).then(|| {
        format!(
            "warning: the accelerometers read {} m/s² together, gravity is 9.76 to 9.84: are the unit of measure in the mapping, the columns \
             and the document right?",
            short(size)
        )
    })
}

/// Words where the median rate of a gyro (°/s) is not that of a unit at rest.
pub fn moves(called: &str, deg_per_s: f64) -> Option<String> {
    (deg_per_s.abs() > FASTEST_DEG_PER_S).then(|| {
        format!(
            "{called} reads {} °/s in the median, at most {FASTEST_DEG_PER_S} °/s is rest: does the unit move, are columns \
             swapped, or is the unit of measure in the mapping wrong ({} as °/s, {} as °/h)?",
            fixed(deg_per_s, 1),
            fixed(deg_per_s.to_radians(), 3),
            fixed(deg_per_s.to_radians() / 3600.0, 3)
        )
    })
}

/// How much of a log is missing, where that is more than a little.
pub fn missing(spacing: &Spacing, count: usize) -> Option<String> {
    let missing = spacing.missing();
    let share = real(missing) / real(count + missing);
    (share > LARGEST_MISSING).then(|| {
        format!(
            "warning: {missing} of {} ticks ({:.1} %) are missing: find out what loses them",
            count + missing,
            share * 100.0
        )
    })
}

/// Whether ticks are as far apart as they last.
fn timing(columns: &Columns, spacing: &Spacing) -> Result<Option<String>, Error> {
    let lasts_s = median(&columns.duration_s);
    let ratio = spacing.tick_s / lasts_s;
    if lasts_s <= 0.0 || (ratio - 1.0).abs() <= UNLIKE {
        return Ok(None);
    }
    let words = format!(
        "ticks are {} apart and last {} by the mapping or the producer: is the unit of the time column right, or is every other tick \
         missing?",
        length(spacing.tick_s),
        length(lasts_s)
    );
    // A hundredth more, so that what was meant to be twice is twice.
    let limit = UNLIKE_FACTOR * (1.0 + UNLIKE);
    if ratio > limit || ratio < 1.0 / limit {
        return Err(Error::refused(words));
    }
    Ok(Some(format!("warning: {words}")))
}

fn length(seconds: f64) -> String {
    if seconds < 1.0 { format!("{} ms", short(seconds * 1e3)) } else { format!("{} s", short(seconds)) }
}

/// Length of the parts whose noise is compared (ticks).
fn part(count: usize) -> usize {
    count.div_ceil(PARTS).max(2)
}

/// Standard deviation of the noise in each part, by the middle step from reading to reading; 0 where nothing changes.
fn noise(column: &[f64]) -> Vec<f64> {
    column.chunks(part(column.len())).map(scatter_of_steps).collect()
}

/// Noise that is not the same all through a log.
fn unlike(called: &str, columns: &Columns, noise: &[f64]) -> Option<String> {
    // A part without noise is one of coarse counts.
    let least = noise.iter().copied().filter(|noise| *noise > 0.0).fold(f64::INFINITY, f64::min);
    let largest = noise.iter().copied().fold(0.0, f64::max);
    if largest <= UNLIKE_NOISE * least {
        return None;
    }
    let loud = noise.iter().position(|noise| *noise >= largest)?;
    let count = columns.end_ns.len();
    let ends = columns.since_s(((loud + 1) * part(count)).min(count) - 1);
    Some(format!(
        "warning: {called}: the noise is {:.0} times as large between {:.0} s and {ends:.0} s as where it is least: are there two units \
         of measure in the log, or did the unit move?",
        largest / least,
        columns.since_s(loud * part(count))
    ))
}
