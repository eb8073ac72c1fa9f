//! Whether the accelerometers show gravity where the attitude has it: at the beginning of a run, and where the gyros' own turns carry it.
//!
//! Rates need no accelerometers, but the Earth's rate is taken off in the attitude that is stated; and columns that are swapped
//! there are swapped for whoever uses the document next. A level unit tells nothing of x and y: the rests behind its turns do.

use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;

use super::earth::carried_along;
use super::make::Wanted;
use super::measure::in_case;
use super::plateaus::Plateau;
use super::read::Turned;
use crate::drift::figures::counted;
use crate::means::Size;
use crate::robust::median;
use crate::swapped::{Shown, up};

/// Time at the beginning of a run that tells its attitude (s).
const BEGINNING_S: f64 = 1.0;

/// What the accelerometers of all runs doubt, in words; runs that say the same are named together. `axes` are the gyros' input axes, `gains` what
/// they show of a rate.
pub(super) fn doubts(
    wanted: &Wanted<'_>,
    runs: &[Turned],
    (axes, gains): (&[[f64; 3]], &[f64]),
) -> Vec<String> {
    let mut told: Vec<(String, Vec<usize>)> = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let Some(words) = of_run(wanted, number, run, (axes, gains)) else { continue };
        // Behind the colon stand the figures of the run.
        let kind = |words: &str| words.split(':').next().unwrap_or_default().to_owned();
        match told.iter_mut().find(|(first, _)| kind(first) == kind(&words)) {
            Some((_, numbers)) => numbers.push(number + 1),
            None => told.push((words, vec![number + 1])),
        }
    }
    let words = |(words, numbers): (String, Vec<usize>)| {
        let others: Vec<String> = numbers.iter().skip(1).map(ToString::to_string).collect();
        let others = match others.len() {
            0 => String::new(),
            1 => format!(" (log {} shows the same)", others.join(", ")),
            _ => format!(" (logs {} show the same)", others.join(", ")),
        };
        format!("log {}: {words}{others}", numbers.first().copied().unwrap_or_default())
    };
    told.into_iter().map(words).collect()
}

fn of_run(
    wanted: &Wanted<'_>,
    number: usize,
    run: &Turned,
    (axes, gains): (&[[f64; 3]], &[f64]),
) -> Option<String> {
    let bins = &run.binned.bins;
    let place = wanted.place.get(number).or(wanted.place.first())?;
    let stated = up(place).map(|up| up.map(|part| part * STANDARD_GRAVITY_M_PER_S2));
    let start = stated.or(run.binned.first_force)?;
    let beginning = bins.iter().take_while(|bin| bin.begin_s < BEGINNING_S).count();
    let shown = |window: std::ops::Range<usize>, stated: [f64; 3]| {
        let forces: Vec<[f64; 3]> = bins.get(window)?.iter().filter_map(|bin| bin.force).collect();
        let size = |axis: usize| Size::of(&forces.iter().map(|force| force[axis]).collect::<Vec<f64>>());
        let shown = Shown::of(["accelerometers", "m/s²"], [0, 1, 2].map(size), stated);
        shown.swapped().or_else(|| shown.far()).filter(|_| !forces.is_empty())
    };
    if let Some(words) = shown(0..beginning, start) {
        return Some(words);
    }
    // What the gyros show at rest is bias and Earth: gravity does not turn with it.
    let at_rest: Vec<f64> = (0..gains.len())
        .map(|sensor| median(&run.rests.iter().map(|rest| rest.rate[sensor]).collect::<Vec<f64>>()))
        .collect();
    let in_case = in_case(axes);
    let gravity = carried_along(bins, start, |bin| {
        in_case(&|sensor| (bin.rate[sensor] - at_rest[sensor]) / gains[sensor])
    });
    run.rests.iter().find_map(|rest: &Plateau| {
        let [from, to] = rest.bins;
        let words = shown(from..to, *gravity.get((from + to) / 2)?)?;
        let broken = bins.get(..to)?.iter().filter(|bin| bin.broken).count();
        let gaps = if broken == 0 {
            String::new()
        } else {
            format!(
                "; ticks are missing at {} before it, over which the table is taken to turn on",
                counted(broken, "place", "places")
            )
        };
        let [begin_s, end_s] = rest.window_s;
        Some(format!("{words} (that is where the gyros' turns carry it, {begin_s:.1}…{end_s:.1} s{gaps})"))
    })
}
