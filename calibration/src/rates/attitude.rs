//! Whether the accelerometers show gravity where the attitude has it: at the beginning of a run, and where the gyros' own turns carry it.
//!
//! Rates need no accelerometers, but the Earth's rate is taken off in the attitude that is stated; and columns that are swapped
//! there are swapped for whoever uses the document next. A level unit tells nothing of x and y: the rests behind its turns do.

use isotherm_correction::earth::Place;
use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;

use super::earth::carried_along;
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
pub(super) fn doubts(places: &[Place], runs: &[Turned], (axes, gains): (&[[f64; 3]], &[f64])) -> Vec<String> {
    let mut told: Vec<(String, Vec<usize>)> = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let Some(place) = places.get(number).or(places.first()) else { continue };
        let Some(words) = of_run(place, run, (axes, gains)) else { continue };
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

fn of_run(place: &Place, run: &Turned, (axes, gains): (&[[f64; 3]], &[f64])) -> Option<String> {
    let bins = &run.binned.bins;
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
        let words = shown(from..to, *gravity.get(usize::midpoint(from, to))?)?;
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
        Some(format!("{words} (in the rest of {begin_s:.1}…{end_s:.1} s, gravity carried there by the gyros' turns{gaps})"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rates::bins::{Bin, Binned};
    use crate::rates::plateaus::find;

    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    /// Level for ten seconds, then turned by 72° about x, and at rest again; `shown` is what the accelerometers make of the force.
    fn run(shown: fn([f64; 3]) -> [f64; 3]) -> Turned {
        let bin = |index: u32| {
            let begin_s = 0.5 * f64::from(index);
            let angle = ((begin_s + 0.25 - 10.0).clamp(0.0, 2.0) * 36.0).to_radians();
            let force = shown([0.0, -9.81 * libm::sin(angle), -9.81 * libm::cos(angle)]);
            let turns = (10.0..12.0).contains(&begin_s);
            // With a bias that turns the case by 18° in the meantime, were it taken for a turn.
            let rate = vec![if turns { 36.0 * 3600.0 } else { 0.0 }, 3000.0, 0.0];
            Bin { begin_s, length_s: 0.5, good_s: 0.5, rate, force: Some(force), ..Bin::default() }
        };
        let bins: Vec<Bin> = (0..44).map(bin).collect();
        let rests = find(&bins, &[0.0; 3]).into_iter().filter(|plateau| plateau.rate[0] < 1.0).collect();
        let binned = Binned { first_force: bins[0].force, bins, ..Binned::default() };
        Turned { binned, matched: Vec::new(), rests, earth_start: None }
    }

    fn words(shown: fn([f64; 3]) -> [f64; 3], tilt_deg: Option<[f64; 2]>) -> String {
        let place = Place::new(55.75, 30.0, tilt_deg).unwrap();
        doubts(&[place], &[run(shown), run(shown)], (&AXES, &[1.0; 3])).join("\n")
    }

    #[test]
    fn accelerometers_that_do_not_follow_the_turns_are_told() {
        for tilt in [Some([0.0, 0.0]), None] {
            assert_eq!(words(|force| force, tilt), "");
            let swapped = words(|[x, y, z]| [y, x, z], tilt);
            assert!(swapped.starts_with("log 1: accelerometers x and y look swapped: "), "{swapped}");
            assert!(
                swapped.contains("the gyros' turns") && swapped.ends_with("(log 2 shows the same)"),
                "{swapped}"
            );
        }
        let level = Some([0.0, 0.0]);
        assert!(words(|[x, y, z]| [z, y, x], level).contains("accelerometers x and z look swapped"));
        let flipped = words(|[x, y, z]| [x, y, -z], level);
        assert!(
            flipped.contains("do not fit the attitude: their means are 0.00, 0.00, 9.81 m/s²"),
            "{flipped}"
        );
        // Levelled by themselves, they turn the wrong way.
        assert!(words(|[x, y, z]| [x, y, -z], None).contains("do not fit the attitude"));
        assert!(words(|force| force, Some([0.0, 180.0])).contains("do not fit the attitude"));
    }
}
