//! What must hold of a run before anything is fitted to it; every refusal says what to do.

use std::collections::BTreeSet;

use isotherm_correction::sample::OutputKind;
use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;
use isotherm_protocol::document::Document;

use super::samples::Samples;
use super::stand::Stand;
use crate::axes::sensor_name;
use crate::document::accelerometers;
use crate::finding::ThermalKind;
use crate::fits::drift::pieces::checks::moves;
use crate::fits::drift::pieces::far::SINGLE;
use crate::numbers::{Size, dot, ends, median, median_if_any, norm, real, seconds};
use crate::report::{Rest, counted, output_unit, short};
use crate::runs::Reading;
use crate::runs::faults::{self, Fault};
use crate::runs::series::{Series, Ticks};
use crate::runs::swapped::{Looks, Shown, at_opposite_latitude};

/// How far a gyro on a rate table may be from what is stated: share of the rate, and beside it (°/s).
const TABLE_SHARE: f64 = 0.05;
const TABLE_DEG_PER_S: f64 = 0.5;
/// How far the mean specific force may be from one g.
const GRAVITY: [f64; 2] = [0.9, 1.1];
/// What three gyros at rest hardly stay below together (°/h): one of three axes has more than half of the Earth's rate.
const QUIETEST_DEG_PER_H: f64 = 1.0;
/// Largest turn of the specific force of a unit that stays where it is (°), from one side of a window to the other.
const LARGEST_TURN_DEG: f64 = 2.0;
/// Windows on either side.
const BESIDE: usize = 3;
/// Fewest readings of a tick series for which anything can be said.
const FEWEST: usize = 100;
/// Smallest range of temperature that is worth a fit (°C).
pub const SMALLEST_RANGE_DEG_C: f64 = 5.0;
/// Share of the windows that may have readings far from all others.
const MOST_FAR: f64 = 0.1;
/// Share of a run over which a thermometer may read the same, and readings that say nothing of it.
const LARGEST_FROZEN: f64 = 0.5;
const FEWEST_FROZEN: usize = 10;
/// Distance of ticks, over the usual one, from which on one is missing.
const MISSING_TICK: f64 = 1.75;
/// Share of readings that may be no number, or of time that may be missing, before a warning.
const SMALL_SHARE: f64 = 0.001;

/// Whether temperatures (°C) move enough to fit or to judge.
pub fn moves_enough(deg_c: &[f64]) -> bool {
    Size::of(deg_c).peak_to_peak >= SMALLEST_RANGE_DEG_C
}

/// What was found: nothing can be done without the first, the second is to be looked at.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// Refusals of the whole run.
    pub refusals: Vec<String>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Sensors that cannot be fitted, gyros first, each with why.
    pub dead: Vec<(bool, usize, String)>,
}

/// Median distance of times (s).
pub fn median_step_s(times_ns: &[i64]) -> f64 {
    let steps: Vec<f64> = times_ns.windows(2).map(|pair| seconds(pair[1].saturating_sub(pair[0]))).collect();
    median(&steps)
}

/// Looks at the raw readings of a run.
pub fn raw(name: &str, series: &Series, stand: &Stand) -> Findings {
    let mut found = Findings::default();
    for (gyro, kind, ticks) in [(true, "gyro", &series.gyros), (false, "accelerometer", &series.accels)] {
        if ticks.is_empty() {
            continue;
        }
        for (index, readings) in ticks.readings.iter().enumerate() {
            let of = format!("{kind} {}", sensor_name(index, ticks.readings.len()));
            sensor(&mut found, name, (gyro, &of, index), readings);
        }
        gaps(&mut found, name, kind, ticks);
    }
    if series.gyros.len() < FEWEST {
        found.refusals.push(format!(
            "{name}: {} gyro ticks are too few, at least {FEWEST} are needed: is the whole log given?",
            series.gyros.len()
        ));
    }
    if series.gyros.output == Some(OutputKind::Mean) && stand.turning.is_none() {
        rates(&mut found, name, &series.gyros);
    }
    if series.bad_frames > 0 {
        found.warnings.push(format!(
            "{name}: {} frames could not be read and are left out; isotherm-replay recover may save them",
            series.bad_frames
        ));
    }
    for (channel, readings) in &series.temperatures {
        thermometer(&mut found, name, channel, readings);
    }
    found
}

/// What is wrong with the readings of a run that judges: it is said, and what can be judged is.
pub fn judging(name: &str, series: &Series, stand: &Stand) -> Vec<String> {
    let Findings { mut refusals, warnings, dead } = raw(name, series, stand);
    refusals.extend(warnings);
    refusals.extend(dead.into_iter().map(|(gyro, index, why)| {
        let (kind, ticks) = if gyro { ("gyro", &series.gyros) } else { ("accelerometer", &series.accels) };
        format!("{name}: {kind} {}: {why}", sensor_name(index, ticks.readings.len()))
    }));
    refusals
}

fn sensor(found: &mut Findings, name: &str, (gyro, of, index): (bool, &str, usize), readings: &[f64]) {
    let bad = faults::missing(readings);
    let share = real(bad) / real(readings.len().max(1));
    if share > 0.5 {
        let why = format!(
            "{:.0} % of its readings are not numbers: check the sensor, and the column in the mapping",
            100.0 * share
        );
        found.dead.push((gyro, index, why));
        return;
    }
    if bad > 0 {
        found.warnings.push(format!(
            "{name}: {of}: {bad} readings are not numbers ({:.3} %); windows with many of them are left out",
            100.0 * share
        ));
    }
    if let Some(value) = faults::dead(readings) {
        found.dead.push((gyro, index, Fault::Dead(value).words("sensor", 1)));
    }
}

fn gaps(found: &mut Findings, name: &str, kind: &str, ticks: &Ticks) {
    let step = median_step_s(&ticks.end_ns);
    let since = |end: i64| seconds(end.saturating_sub(ticks.end_ns[0]));
    // Lengths, and since when.
    let long = ticks.end_ns.windows(2).map(|pair| [seconds(pair[1].saturating_sub(pair[0])), since(pair[0])]);
    let gaps: Vec<[f64; 2]> = long.filter(|[gap, _]| *gap > MISSING_TICK * step).collect();
    let missing = gaps.iter().map(|[gap, _]| gap - step).sum::<f64>();
    let Some([longest, at]) = gaps.iter().copied().reduce(|a, b| if b[0] > a[0] { b } else { a }) else {
        return;
    };
    if missing > SMALL_SHARE * ticks.length_s() || longest > 60.0 {
        found.warnings.push(format!(
            "{name}: {} in the {kind} ticks, {missing:.1} s in all, the longest {longest:.1} s at {at:.0} s: lags \
             and derivatives are poor after a gap; if it matters, leave it out with --start and --duration",
            counted(gaps.len(), "gap", "gaps")
        ));
    }
}

/// Gyros with a rate output must be near rest.
fn rates(found: &mut Findings, name: &str, ticks: &Ticks) {
    for (index, readings) in ticks.readings.iter().enumerate() {
        let sizes: Vec<f64> =
            readings.iter().filter(|r| r.is_finite()).map(|r| r.abs().to_degrees()).collect();
        let Some(usual) = median_if_any(&sizes) else { continue };
        let called = format!("{name}: gyro {}", sensor_name(index, ticks.readings.len()));
        found.refusals.extend(moves(&called, usual));
    }
}

/// That gyros at rest do not feel the Earth, by what a document makes of them before any bias is taken off (°/h, by sensor and window).
pub fn quiet<'a>(name: &str, rates: impl Iterator<Item = &'a [f64]>) -> Option<String> {
    let sizes = |column: &[f64]| column.iter().map(|rate| rate.abs()).collect::<Vec<f64>>();
    let usual: Vec<f64> = rates.filter_map(|column| median_if_any(&sizes(column))).collect();
    let largest = usual.iter().copied().fold(0.0, f64::max);
    (usual.len() >= 3 && largest > 0.0 && largest < QUIETEST_DEG_PER_H).then(|| {
        format!(
            "{name}: no gyro reads more than {} °/h in the median, and the Earth turns by 15 °/h: are the unit of measure in the mapping \
             ({} where °/s are taken as °/h) and the weights in the document right?",
            short(largest),
            short(largest * 3600.0)
        )
    })
}

fn thermometer(found: &mut Findings, name: &str, channel: &str, readings: &crate::runs::series::Channel) {
    let good: Vec<f64> = readings.raw.iter().copied().filter(|raw| raw.is_finite()).collect();
    let bad = readings.raw.len() - good.len();
    if 2 * good.len() < readings.raw.len() || good.len() < 10 {
        found.refusals.push(format!(
            "{name}: temperature channel {channel:?} has {} readings of which {bad} are not numbers: check the \
             thermometer and its column",
            readings.raw.len()
        ));
        return;
    }
    if bad > 0 {
        found.warnings.push(format!(
            "{name}: temperature channel {channel:?}: {bad} readings are not numbers and are skipped"
        ));
    }
    // A temperature moves slowly: from reading to reading it changes by a small share of what it does over the run.
    let [low, high] = ends(good.iter().copied());
    let steps: Vec<f64> = good.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let usual = median(&steps);
    if usual > 0.5 && usual > 0.05 * (high - low) {
        found.refusals.push(format!(
            "{name}: temperature channel {channel:?} jumps by {usual:.3} from reading to reading, over a range of \
             {:.3}: this is not a temperature; are columns swapped in the mapping?",
            high - low
        ));
    }
}

/// Readings of a unit at rest that are far from all others, to be left out with their windows; refused where they are many, or follow
/// each other. Counts of mode switches are for the correction to pass over.
pub fn far(
    name: &str,
    series: &Series,
    (document, stand): (&Document, &Stand),
    window_s: f64,
) -> (Findings, BTreeSet<Reading>) {
    let (mut found, mut all) = (Findings::default(), BTreeSet::new());
    let kinds = [(true, "gyro", &series.gyros), (false, "accelerometer", &series.accels)];
    for (gyro, kind, ticks) in kinds.into_iter().filter(|_| stand.turning.is_none()) {
        let first = ticks.end_ns.first().copied().unwrap_or_default();
        let since_s = |tick: usize| seconds(ticks.end_ns[tick].saturating_sub(first));
        let (measure, scale) = match (ticks.output, gyro) {
            (Some(OutputKind::Mean), true) => ("°/s", 1_f64.to_degrees()),
            (Some(OutputKind::Mean), false) => (output_unit(document), 1.0),
            _ => ("counts", 1.0),
        };
        for (index, readings) in ticks.readings.iter().enumerate() {
            let far = faults::far(readings);
            let Some(at) = far.first().copied().filter(|_| !gyro || document.mode_reversal.is_none()) else {
                continue;
            };
            let mut hit: Vec<f64> = far.iter().map(|tick| libm::floor(since_s(*tick) / window_s)).collect();
            hit.dedup();
            let few = real(hit.len()) * window_s <= (MOST_FAR * ticks.length_s()).max(window_s);
            let single = few && far.chunk_by(|a, b| a + 1 == *b).all(|row| row.len() <= SINGLE);
            let (count, value, at_s) = (far.len(), scale * readings[at], since_s(at));
            let words = ThermalKind::Far { count, value, measure, at_s, windows: hit.len(), single };
            let to = if single { &mut found.warnings } else { &mut found.refusals };
            to.push(format!("{name}: {kind} {}: {words}", sensor_name(index, ticks.readings.len())));
            all.extend(far.into_iter().filter(|_| single).map(|tick| (ticks.end_ns[tick], gyro, index)));
        }
    }
    (found, all)
}

/// Thermometers that sensors of a document follow and that read the same for the larger part of a run.
pub fn frozen(name: &str, series: &Series, document: &Document) -> Vec<String> {
    let gyros = document.gyro.sensor.iter().map(|sensor| sensor.channel.as_deref());
    let accels = accelerometers(document)
        .iter()
        .flat_map(|own| [own.channel.as_deref(), own.board_channel.as_deref()]);
    let followed: BTreeSet<&str> = gyros.chain(accels).flatten().collect();
    let words = |channel: &str| {
        let readings = series.temperatures.get(channel)?;
        let mut from = 0;
        let runs = readings.raw.chunk_by(|a, b| (a - b).abs() <= 0.0).map(|run| {
            from += run.len();
            [from - run.len(), from - 1]
        });
        let since_s = readings.since_s();
        let [from, to] = runs.max_by_key(|[from, to]| to - from)?;
        let [begin_s, end_s] = [since_s[from], since_s[to]];
        let still = to - from >= FEWEST_FROZEN && end_s - begin_s > LARGEST_FROZEN * since_s.last()?;
        still.then(|| {
            let (channel, value) = (channel.to_owned(), readings.raw[from]);
            format!("{name}: {}", ThermalKind::Frozen { channel, value, window_s: [begin_s, end_s] })
        })
    };
    followed.into_iter().filter_map(words).collect()
}

/// Whether a run on a rate table turns as it was stated, all the time; why not, and what to do.
pub fn turning(samples: &Samples, document: &Document, stand: &Stand) -> Option<String> {
    let turning = stand.turning.as_ref()?;
    let stated = turning.rate_deg_per_h();
    let allowed = (TABLE_SHARE * turning.rate_deg_per_s.abs() + TABLE_DEG_PER_S) * 3600.0;
    let mut off: Vec<usize> = Vec::new();
    for (index, (shown, row)) in samples.gyros.iter().zip(&document.gyro.orientation.rows).enumerate() {
        let along = dot(*row, stated);
        let away: Vec<usize> =
            (0..shown.len()).filter(|&window| (shown[window] - along).abs() > allowed).collect();
        if 2 * away.len() > shown.len() {
            return Some(format!(
                "{}: gyro {} shows {:.3} °/s in the median, {:.3} °/s are stated along it: check --rate and --axis \
                 of this log, and the sign",
                samples.name,
                sensor_name(index, samples.gyros.len()),
                median_if_any(shown).unwrap_or(f64::NAN) / 3600.0,
                along / 3600.0
            ));
        }
        off.extend(away);
    }
    let (first, last) = (off.iter().min()?, off.iter().max()?);
    let time = |window: &usize| samples.time_s.get(*window).copied().unwrap_or_default();
    Some(format!(
        "{}: the table is not at its stated {} °/s between {:.0} and {:.0} s: cut the log to the steady part with \
         --start and --duration",
        samples.name,
        turning.rate_deg_per_s,
        time(first) - 0.5 * samples.window_s,
        time(last) + 0.5 * samples.window_s
    ))
}

/// Whether a run at rest stands as was stated: columns that look swapped, and gravity that is somewhere else.
pub fn attitude(samples: &Samples, document: &Document, (rest, stand): (&Rest, &Stand)) -> Findings {
    let mut found = Findings::default();
    if stand.turning.is_some() {
        return found;
    }
    let shown = |of, columns: &[Vec<f64>], rows: &[[f64; 3]], truth: Option<[f64; 3]>| {
        let truth = truth?;
        let stated: Vec<f64> = rows.iter().map(|row| dot(*row, truth)).collect();
        let sizes: Vec<Size> = columns.iter().map(|values| Size::of(values)).collect();
        Some(Shown::of(of, sizes.try_into().ok()?, stated.try_into().ok()?))
    };
    let rows = document.accel.as_ref().map_or(&[][..], |accel| &accel.orientation.rows);
    let forces = shown(["accelerometers", "m/s²"], &samples.forces, rows, rest.force_m_per_s2);
    let rows = &document.gyro.orientation.rows;
    let gyros = shown(["gyros", "°/h"], &samples.gyros, rows, rest.rate_deg_per_h);
    let opposite = rest.rate_deg_per_h.zip(rest.force_m_per_s2).and_then(|(earth, force)| {
        let earth = at_opposite_latitude(earth, force);
        <[f64; 3]>::try_from(rows.iter().map(|row| dot(*row, earth)).collect::<Vec<f64>>()).ok()
    });
    let gyros = gyros.map(|shown| shown.or_opposite(opposite));
    let named = |looks: Option<Looks>| looks.map(|looks| format!("{}: {looks}", samples.name));
    found.warnings.extend([gyros, forces].into_iter().flatten().filter_map(|shown| named(shown.swapped())));
    // The bias of a gyro may be many times the Earth's rate; that of an accelerometer is no third of gravity.
    found.refusals.extend(named(forces.and_then(|shown| shown.far())));
    found
}

/// That a unit was turned in the middle of a run: the specific force points somewhere else from one minute to the next. With
/// temperature it turns slowly, by its biases.
fn turned(samples: &Samples) -> Option<String> {
    let [x, y, z] = samples.forces.as_slice() else { return None };
    let middle = |windows: std::ops::Range<usize>| -> Option<[f64; 3]> {
        let mut force = [0.0; 3];
        for (force, values) in force.iter_mut().zip([x, y, z]) {
            *force = median_if_any(values.get(windows.clone())?)?;
        }
        Some(force)
    };

    let turn = |at: usize| {
        let (before, after) = (middle(at.checked_sub(BESIDE)?..at)?, middle(at + 1..at + 1 + BESIDE)?);
        let cosine = dot(before, after) / (dot(before, before) * dot(after, after)).sqrt();
        Some((at, libm::acos(cosine.clamp(-1.0, 1.0)).to_degrees()))
    };
    let turns = (0..samples.time_s.len()).filter_map(turn);
    let (at, angle) =
        turns.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, angle)| *angle > LARGEST_TURN_DEG)?;
    Some(format!(
        "{}: the unit was turned {:.0} s after the beginning: the specific force turns by {angle:.1} ° there, at \
         most {LARGEST_TURN_DEG} ° are drift. Give the parts before and after as two runs, with --start and \
         --duration",
        samples.name,
        samples.time_s.get(at).copied().unwrap_or_default()
    ))
}

/// Looks at a run that went through the corrector: the gyros must feel the Earth, the accelerometers about one g.
pub fn corrected(samples: &Samples, stand: &Stand, dead: &[(bool, usize, String)]) -> Findings {
    let warnings = samples.troubles.iter().map(|words| format!("{}: {words}", samples.name)).collect();
    let mut found = Findings { warnings, ..Findings::default() };
    let at_rest = samples.gyros.iter().map(Vec::as_slice).filter(|_| stand.turning.is_none());
    found.warnings.extend(quiet(&samples.name, at_rest));
    // A dead accelerometer is refused for itself.
    let alive = dead.iter().all(|(gyro, ..)| *gyro);
    if samples.forces.len() == 3 && alive && stand.turning.is_none() {
        found.refusals.extend(turned(samples));
        let forces: Option<Vec<f64>> = samples.forces.iter().map(|values| median_if_any(values)).collect();
        if let Some(forces) = forces {
            let size = norm(forces);
            let share = size / STANDARD_GRAVITY_M_PER_S2;
            if !(GRAVITY[0]..=GRAVITY[1]).contains(&share) {
                let guess = if (0.9..1.1).contains(&size) {
                    ": the readings seem to be in g, but are taken as m/s²"
                } else if (900.0..1100.0).contains(&size) {
                    ": the readings seem to be in mg, but are taken as m/s²"
                } else {
                    ": is the unit at rest, are columns swapped, is the unit of measure in the mapping right?"
                };
                found.refusals.push(format!(
                    "{}: the specific force is {size:.3} m/s², at rest it must be near {STANDARD_GRAVITY_M_PER_S2:.3}{guess}",
                    samples.name
                ));
            }
        }
    }
    found
}
