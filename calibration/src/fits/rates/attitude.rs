//! Whether the accelerometers show gravity where the attitude has it: at the beginning of a run, and where the gyros' own turns carry it.
//!
//! Rates need no accelerometers, but the Earth's rate is taken off in the attitude that is stated; and columns that are swapped
//! there are swapped for whoever uses the document next. A level unit tells nothing of x and y: the rests behind its turns do.

use isotherm_correction::earth::Place;

use super::earth::carried;
use super::measure::in_case;
use super::plateaus::Plateau;
use super::read::Turned;
use crate::finding::{Finding, Kind};
use crate::numbers::{Size, median};
use crate::runs::swapped::{Looks, Shown, force_at_rest};

/// Time at the beginning of a run that tells its attitude (s).
const BEGINNING_S: f64 = 1.0;

/// What the accelerometers of all runs doubt; runs that say the same are named together. `axes` are the gyros' input axes, `gains` what
/// they show of a rate.
pub(super) fn doubts(
    places: &[Place],
    runs: &[Turned],
    (axes, gains): (&[[f64; 3]], &[f64]),
) -> Vec<Finding> {
    let mut told: Vec<(usize, Looks, Rest, Vec<usize>)> = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let Some(place) = places.get(number).or(places.first()) else { continue };
        let Some((looks, rest)) = of_run(place, run, (axes, gains)) else { continue };
        match told
            .iter_mut()
            .find(|(_, first, ..)| (first.shown.kind, first.fits) == (looks.shown.kind, looks.fits))
        {
            Some((.., others)) => others.push(number),
            None => told.push((number, looks, rest, Vec::new())),
        }
    }
    let finding =
        |(log, looks, rest, others)| Kind::Gravity { looks: Box::new(looks), rest, others }.in_log(log);
    told.into_iter().map(finding).collect()
}

/// The window of a rest (s), and the places where ticks are missing before it.
type Rest = Option<([f64; 2], usize)>;

fn of_run(place: &Place, run: &Turned, (axes, gains): (&[[f64; 3]], &[f64])) -> Option<(Looks, Rest)> {
    let bins = &run.binned.bins;
    let start = force_at_rest(place).or(run.binned.first_force)?;
    let beginning = bins.iter().take_while(|bin| bin.begin_s < BEGINNING_S).count();
    let shown = |window: std::ops::Range<usize>, stated: [f64; 3]| {
        let forces: Vec<[f64; 3]> = bins.get(window)?.iter().filter_map(|bin| bin.force).collect();
        let size = |axis: usize| Size::of(&forces.iter().map(|force| force[axis]).collect::<Vec<f64>>());
        let shown = Shown::of(["accelerometers", "m/s²"], [0, 1, 2].map(size), stated);
        shown.swapped().or_else(|| shown.far()).filter(|_| !forces.is_empty())
    };
    if let Some(looks) = shown(0..beginning, start) {
        return Some((looks, None));
    }
    // What the gyros show at rest is bias and Earth: gravity does not turn with it.
    let at_rest: Vec<f64> = (0..gains.len())
        .map(|sensor| median(&run.rests.iter().map(|rest| rest.rate[sensor]).collect::<Vec<f64>>()))
        .collect();
    let in_case = in_case(axes);
    let gravity = carried(bins, start, |bin, _| {
        in_case(&|sensor| (bin.rate[sensor] - at_rest[sensor]) / gains[sensor])
    });
    run.rests.iter().find_map(|rest: &Plateau| {
        let [from, to] = rest.bins;
        let looks = shown(from..to, *gravity.get(usize::midpoint(from, to))?)?;
        let broken = bins.get(..to)?.iter().filter(|bin| bin.broken).count();
        Some((looks, Some((rest.window_s, broken))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::rates::bins::{Bin, Binned};
    use crate::fits::rates::plateaus::find;
    use crate::runs::swapped::Fits;

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

    fn found(shown: fn([f64; 3]) -> [f64; 3], tilt_deg: Option<[f64; 2]>) -> Vec<Finding> {
        let place = Place::new(55.75, 30.0, tilt_deg).unwrap();
        doubts(&[place], &[run(shown), run(shown)], (&AXES, &[1.0; 3]))
    }

    /// With what the accelerometers fit, of the only finding; it is of the first log, and the second shows the same.
    fn fits(found: &[Finding]) -> Fits {
        let [Finding { place, kind: Kind::Gravity { looks, others, .. } }] = found else {
            panic!("{found:?}");
        };
        assert_eq!((place.log, others.as_slice(), looks.shown.kind), (Some(0), &[1][..], "accelerometers"));
        looks.fits
    }

    #[test]
    fn accelerometers_that_do_not_follow_the_turns_are_told() {
        let level = Some([0.0, 0.0]);
        for tilt in [level, None] {
            assert_eq!(found(|force| force, tilt), []);
            let swapped = found(|[x, y, z]| [y, x, z], tilt);
            assert_eq!(fits(&swapped), Fits::Order([1, 0, 2]));
            // A level unit tells nothing of x and y: the rest behind the turn does.
            assert!(matches!(swapped[0].kind, Kind::Gravity { rest: Some((_, 0)), .. }), "{swapped:?}");
        }
        let at_once = found(|[x, y, z]| [z, y, x], level);
        assert_eq!(fits(&at_once), Fits::Order([2, 1, 0]));
        assert!(matches!(at_once[0].kind, Kind::Gravity { rest: None, .. }), "{at_once:?}");
        assert_eq!(fits(&found(|[x, y, z]| [x, y, -z], level)), Fits::Nothing);
        // Levelled by themselves, they turn the wrong way.
        assert_eq!(fits(&found(|[x, y, z]| [x, y, -z], None)), Fits::Nothing);
        assert_eq!(fits(&found(|force| force, Some([0.0, 180.0]))), Fits::Nothing);
    }
}
