//! A run on the table: its bins and its steps.

use super::bins::{BIN_S, Bin, Binned, binned};
use super::checks::{dead, steady, turned_as_stated};
use super::fit::Wanted;
use super::matching::{Matched, matched, slow};
use super::plateaus::{self, Plateau};
use super::steps::Step;
use crate::document::gyro_name;
use crate::error::Error;
use crate::finding::{Finding, Kind};
use crate::fits::modes::document::count_arcsec;
use crate::fits::modes::model::deg_per_h;
use crate::numbers::real;
use crate::runs::Run;

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
pub(super) fn read(wanted: &Wanted<'_>, number: usize, run: &Run) -> Result<Result<Turned, Finding>, Error> {
    let binned = binned(run, wanted.base)?;
    let own: Vec<Step> = wanted.steps.iter().filter(|step| step.run == number).copied().collect();
    if own.is_empty() {
        return Ok(Err(Kind::NoStepStated { log: run.name.clone() }.in_log(number)));
    }
    if let Some(sensor) = dead(&binned.bins) {
        let mut finding = Kind::Dead { log: run.name.clone() }.of_gyro(gyro_name(wanted.base, sensor));
        finding.place.log = Some(number);
        return Ok(Err(finding));
    }
    Ok(turned(wanted, number, &own, binned).map_err(|kind| kind.in_log(number)))
}

/// The steps of a run, which are its `own` of all, by its bins.
fn turned(wanted: &Wanted<'_>, number: usize, own: &[Step], binned: Binned) -> Result<Turned, Kind> {
    let counts: Vec<f64> =
        (0..wanted.base.gyro.sensor.len()).map(|sensor| count_arcsec(wanted.base, sensor) / BIN_S).collect();
    let found = plateaus::find(&binned.bins, &counts);
    let matched = matched(own, &binned.bins, &found).map_err(|kind| match gaps(&binned.bins) {
        None => kind,
        Some(share) => Kind::BesideGaps { kind: Box::new(kind), share },
    })?;
    turned_as_stated(&matched, wanted.base, wanted.scale_known)?;
    steady(&matched, &binned.bins)?;
    for one in &matched {
        let bins = one.plateau.own(&binned.bins);
        let [good, all] =
            bins.iter().fold([0.0, 0.0], |[good, all], bin| [good + bin.good_s, all + bin.length_s]);
        let window_s = one.plateau.window_s;
        if good < (1.0 - LOST) * all {
            return Err(Kind::Lost { window_s, share: [1.0 - good / all, LOST] });
        }
        if bins.iter().any(|bin| bin.overrange) {
            return Err(Kind::AtLimit { window_s, stated: one.step.rate_deg_per_s });
        }
    }
    let place = wanted.place.get(number).or(wanted.place.first());
    let earth_start = match place.map(|place| place.earth_rate_in_case(binned.first_force)) {
        None => None,
        Some(Some(rate)) => Some(rate.map(deg_per_h)),
        Some(None) => {
            let Binned { first_force: force, troubles, .. } = binned;
            return Err(Kind::NotLevel { at_beginning: true, force, troubles });
        }
    };
    Ok(Turned { binned, matched, rests: slow(own, found), earth_start })
}

/// Share of the bins in which ticks are missing, where it is more than a twentieth: no steady stretch is long enough then.
fn gaps(bins: &[Bin]) -> Option<f64> {
    let broken = bins.iter().filter(|bin| bin.broken || bin.good_s < (1.0 - LOST) * bin.length_s).count();
    let share = real(broken) / real(bins.len().max(1));
    (share > LOST).then_some(share)
}

/// Cuts steps to whole turns, so that the Earth's horizontal part averages out. Gives the rates (°/s) of those that are shorter.
pub(super) fn whole_turns(run: &mut Turned) -> Vec<f64> {
    let mut short = Vec::new();
    for one in &mut run.matched {
        let bins = one.plateau.own(&run.binned.bins);
        let length_s: f64 = bins.iter().map(|bin| bin.length_s).sum();
        let rate = one.step.rate_deg_per_s;
        let turns = libm::floor(rate.abs() * length_s / TURN_DEG);
        if rate == 0.0 || turns < 1.0 {
            short.extend((rate != 0.0).then_some(rate));
            continue;
        }
        let wanted_s = turns * TURN_DEG / rate.abs();
        let mut taken = 0.0;
        let is_within = |bin: &&Bin| {
            taken += bin.length_s;
            taken <= wanted_s + 0.5 * bin.length_s
        };
        let count = bins.iter().take_while(is_within).count().max(1);
        one.plateau.bins[1] = one.plateau.bins[0] + count;
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
        assert_eq!(gaps(&bins(4)), Some(0.25));
    }
}
