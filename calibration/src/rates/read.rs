//! A run on the table: its bins and its steps.

use super::bins::{BIN_S, Bin, Binned, binned};
use super::checks::{dead, steady, turned_as_stated};
use super::make::Wanted;
use super::matching::{Matched, matched, slow};
use super::plateaus::{self, Plateau};
use super::steps::Step;
use crate::drift::figures::fixed;
use crate::error::Error;
use crate::modes::document::count_arcsec;
use crate::modes::fit::deg_per_h;
use crate::run::{Run, Watch};

/// Share of a step's ticks that may be lost.
const LOST: f64 = 0.05;
/// A whole turn (°).
const TURN_DEG: f64 = 360.0;

/// One run with its steps.
pub(super) struct Turned {
    pub(super) binned: Binned,
    pub(super) matched: Vec<Matched>,
    /// Where the table stood, whether that was stated or not.
    pub(super) rests: Vec<Plateau>,
    pub(super) earth_start: Option<[f64; 3]>,
}

/// Reads one run and finds its steps; the inner error is a reason to refuse.
pub(super) fn read<W: Watch>(
    wanted: &Wanted<'_>,
    number: usize,
    run: &Run,
    watch: &mut impl FnMut() -> W,
) -> Result<Result<Turned, String>, Error> {
    let binned = binned(run, wanted.base, &mut *watch)?;
    let counts: Vec<f64> =
        (0..wanted.base.gyro.sensor.len()).map(|sensor| count_arcsec(wanted.base, sensor) / BIN_S).collect();
    let found = plateaus::find(&binned.bins, &counts);
    let own: Vec<Step> = wanted.steps.iter().filter(|step| step.run == number).copied().collect();
    if own.is_empty() {
        return Ok(Err(format!(
            "no step is stated of log {} ({}): name it in --steps, or leave it out",
            number + 1,
            run.name
        )));
    }
    if let Some(sensor) = dead(&binned.bins) {
        return Ok(Err(format!(
            "log {} ({}): gyro {} reads the same all the time: it is dead, or its column is the wrong one; look at the mapping, or \
             leave the log out",
            number + 1,
            run.name,
            wanted.base.gyro.sensor.get(sensor).map_or("", |sensor| sensor.name.as_str())
        )));
    }
    let matched = match matched(&own, &binned.bins, &found) {
        Ok(matched) => matched,
        Err(reason) => {
            let gaps = gaps(&binned.bins).map_or_else(String::new, |words| format!("; {words}"));
            return Ok(Err(reason + &gaps));
        }
    };
    let stated = turned_as_stated(&matched, wanted.base, wanted.scale_known)
        .and_then(|()| steady(&matched, &binned.bins));
    if let Err(reason) = stated {
        return Ok(Err(reason));
    }
    for one in &matched {
        let bins = binned.bins.get(one.plateau.bins[0]..one.plateau.bins[1]).unwrap_or_default();
        let [good, all] =
            bins.iter().fold([0.0, 0.0], |[good, all], bin| [good + bin.good_s, all + bin.length_s]);
        let [from, to] = one.plateau.window_s;
        if good < (1.0 - LOST) * all {
            return Ok(Err(format!(
                "log {}: {:.1} % of the step of {from:.1}…{to:.1} s cannot be used, {:.0} % may be lost: cut it with --steps",
                number + 1,
                100.0 * (1.0 - good / all),
                100.0 * LOST
            )));
        }
        if bins.iter().any(|bin| bin.overrange) {
            return Ok(Err(format!(
                "log {}: a gyro is at its input limit in the step of {from:.1}…{to:.1} s ({} °/s): leave the step out, or turn slower",
                number + 1,
                one.step.rate_deg_per_s
            )));
        }
    }
    let place = wanted.place.get(number).or(wanted.place.first());
    let earth_start = match place.map(|place| place.earth_rate_in_case(binned.first_force)) {
        None => None,
        Some(Some(rate)) => Some(rate.map(deg_per_h)),
        Some(None) => {
            let force = binned.first_force.map_or_else(
                || "the document or the log has no accelerometers".to_owned(),
                |[x, y, z]| {
                    format!(
                        "the mean force of its first second is ({}, {}, {}) m/s²; it must be within 2 % of one g, x not vertical",
                        fixed(x, 3),
                        fixed(y, 3),
                        fixed(z, 3)
                    )
                },
            );
            let troubles =
                binned.troubles.iter().fold(String::new(), |words, trouble| words + "; " + trouble);
            return Ok(Err(format!(
                "log {}: the unit cannot be levelled at its beginning: {force}. Give --pitch and --roll of that moment, or mend the columns \
                 of the accelerometers in the mapping{troubles}",
                number + 1
            )));
        }
    };
    Ok(Ok(Turned { binned, matched, rests: slow(&own, found), earth_start }))
}

/// Words where ticks are missing in more than a twentieth of the bins: no steady stretch is long enough then.
#[expect(clippy::cast_precision_loss, reason = "bins of a run")]
fn gaps(bins: &[Bin]) -> Option<String> {
    let broken = bins.iter().filter(|bin| bin.broken || bin.good_s < (1.0 - LOST) * bin.length_s).count();
    let share = broken as f64 / bins.len().max(1) as f64;
    (share > LOST).then(|| {
        format!(
            "in {:.0} % of the half seconds ticks are missing or cannot be used: the log has gaps, or the tick length or the unit of the time \
             column in the mapping is not that of the log",
            100.0 * share
        )
    })
}

/// Cuts steps to whole turns, so that the Earth's horizontal part averages out. Gives the rates (°/s) of those that are shorter.
pub(super) fn whole_turns(run: &mut Turned) -> Vec<f64> {
    let mut short = Vec::new();
    for one in &mut run.matched {
        let [begin, end] = one.plateau.bins;
        let bins = run.binned.bins.get(begin..end).unwrap_or_default();
        let length_s: f64 = bins.iter().map(|bin| bin.length_s).sum();
        let turns = libm::floor(one.step.rate_deg_per_s.abs() * length_s / TURN_DEG);
        if one.step.rate_deg_per_s == 0.0 {
            continue;
        }
        if turns < 1.0 {
            short.push(one.step.rate_deg_per_s);
            continue;
        }
        let wanted_s = turns * TURN_DEG / one.step.rate_deg_per_s.abs();
        let mut taken = 0.0;
        let count = bins.iter().take_while(|bin| {
            taken += bin.length_s;
            taken <= wanted_s + 0.5 * bin.length_s
        });
        let count = count.count().max(1);
        one.plateau.bins = [begin, begin + count];
        if let Some(last) = bins.get(count - 1) {
            one.plateau.window_s[1] = last.begin_s + last.length_s;
        }
        one.plateau.rate = plateaus::mean(&bins[..count]);
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_told_where_they_are_many() {
        let bins = |every: u32| -> Vec<Bin> {
            let bin = |index: u32| Bin {
                length_s: 0.5,
                good_s: 0.5,
                broken: index.is_multiple_of(every),
                ..Bin::default()
            };
            (0..200).map(bin).collect()
        };
        assert_eq!(gaps(&bins(100)), None);
        assert!(gaps(&bins(4)).unwrap().starts_with("in 25 % of the half seconds ticks are missing"));
    }
}
