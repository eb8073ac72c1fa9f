//! A drift out of a log: what a correction left, as the gyros of the platform would have it.

use super::estimate::TICK_S;
use super::scenario::{Drift, Voyage};
use crate::error::Error;
use crate::fits::drift::columns::Columns;
use crate::fits::drift::pieces::{Spacing, checks};
use crate::fits::drift::{DEG_PER_H_IN_RAD_PER_S, HOUR_S};
use crate::numbers::{real, seconds};
use crate::runs::faults::Fault;

/// Hours of calibration whose mean is held.
const HELD_H: f64 = 1.0;
/// Longest gap that is bridged by a straight line (ticks): ten minutes.
const LONGEST_GAP: usize = 60;
/// Shortest voyage (h).
const SHORTEST_H: f64 = 1.0;

/// The drift of a log, with what is to be said of it; `hours` of the voyage become what the log has where they are more, and
/// `otherwise` is what can be done where it is too short.
///
/// The mean over the calibration is taken out: on a bench it holds the Earth's rate, and the calibration finds it.
///
/// # Errors
/// [`Error::Refused`] where the log is too short or has gaps, and as [`sound`].
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "ticks of 10 s of a log are far below 2⁵³"
)]
pub fn drift(
    columns: &mut Columns,
    voyage: &mut Voyage,
    otherwise: &str,
) -> Result<(Drift, Vec<String>), Error> {
    let (Some(first), Some(last)) = (columns.end_ns.first().copied(), columns.end_ns.last().copied()) else {
        return Err(Error::refused("the log has no ticks".to_owned()));
    };
    let length_h = seconds(last.saturating_sub(first)) / HOUR_S;
    if length_h < voyage.calibration_h + SHORTEST_H {
        return Err(Error::refused(format!(
            "the log has {length_h:.2} h, but {:.1} h of calibration and at least {SHORTEST_H} h of voyage are \
             needed: shorten the calibration with --calibration-hours, or {otherwise}",
            voyage.calibration_h
        )));
    }
    let mut notes = sound(columns)?;
    if length_h < voyage.calibration_h + voyage.hours {
        let left = ((length_h - voyage.calibration_h) * 60.0).floor() / 60.0;
        notes.push(format!("The log ends after {left:.1} h of the voyage of {} h.", voyage.hours));
        voyage.hours = left;
    }
    let count = voyage.ticks();
    let mut truth = vec![[0.0; 3]; count];
    for (axis, (values, name)) in columns.values.iter().zip(&columns.names).enumerate() {
        let mut sums = vec![(0.0, 0_u32); count];
        for (end, value) in columns.end_ns.iter().zip(values).filter(|(_, value)| value.is_finite()) {
            let place = seconds(end.saturating_sub(first)) / TICK_S;
            if let Some(sum) = sums.get_mut(place as usize) {
                sum.0 += value;
                sum.1 += 1;
            }
        }
        let means: Vec<Option<f64>> =
            sums.iter().map(|(sum, count)| (*count > 0).then(|| sum / f64::from(*count))).collect();
        let filled = bridge(&means).map_err(|gap| {
            let hours = real(gap.0) * TICK_S / HOUR_S;
            let minutes = real(gap.1) * TICK_S / 60.0;
            Error::refused(format!(
                "gyro {name} has no good readings for {minutes:.0} min at {hours:.2} h, at most 10 min can be bridged: cut the log \
                 there"
            ))
        })?;
        let calibration = voyage.calibration_ticks().max(1);
        let mean = filled.iter().take(calibration).sum::<f64>() / real(calibration);
        let of_axis = truth.iter_mut().zip(filled);
        of_axis.for_each(|(tick, value)| tick[axis] = (value - mean) / DEG_PER_H_IN_RAD_PER_S);
    }
    let departure = voyage.calibration_ticks();
    let hour = (HELD_H * HOUR_S / TICK_S) as usize;
    let hour = truth.get(departure.saturating_sub(hour)..departure).unwrap_or(&[]);
    let mut held = [0.0; 3];
    for tick in hour {
        held.iter_mut().zip(tick).for_each(|(sum, value)| *sum += value / real(hour.len()));
    }
    Ok((Drift { measured: truth.clone(), truth, held }, notes))
}

/// What is to be said of a log at rest whose gyros are the platform's; readings far beyond the noise are left out of it.
///
/// # Errors
/// [`Error::Refused`] where it has not three gyros, or one of them does not measure, and as [`Spacing::of`] and [`checks::at_rest`].
pub fn sound(columns: &mut Columns) -> Result<Vec<String>, Error> {
    if columns.values.len() != 3 {
        return Err(Error::refused(format!(
            "the log has {} gyros, the platform three: give corrected ticks, which are along three axes",
            columns.values.len()
        )));
    }
    let spacing = Spacing::of(&columns.end_ns)?;
    let mut notes = std::mem::take(&mut columns.notes);
    notes.extend(checks::at_rest(columns, &spacing)?);
    notes.extend(checks::missing(&spacing, columns.end_ns.len()));
    let looked = columns.names.iter().zip(&columns.values);
    let fault = |(name, column): (&String, &Vec<f64>)| {
        Some(format!("gyro {name}: {}", Fault::of(column)?.words("sensor", 1)))
    };
    let bad: Vec<String> = looked.filter_map(fault).collect();
    if bad.is_empty() { Ok(notes) } else { Err(Error::Refused(bad)) }
}

/// Straight lines over what is missing, or where and how long a gap is that is too long.
fn bridge(means: &[Option<f64>]) -> Result<Vec<f64>, (usize, usize)> {
    let mut filled: Vec<f64> = Vec::with_capacity(means.len());
    for (index, mean) in means.iter().enumerate() {
        let Some(mean) = mean else { continue };
        let missing = index - filled.len();
        if missing > LONGEST_GAP {
            return Err((filled.len(), missing));
        }
        let before = filled.last().copied().unwrap_or(*mean);
        let step = (mean - before) / real(missing + 1);
        filled.extend((1..=missing).map(|k| before + step * real(k)));
        filled.push(*mean);
    }
    let missing = means.len() - filled.len();
    match filled.last().copied() {
        Some(last) if missing <= LONGEST_GAP => {
            filled.extend(std::iter::repeat_n(last, missing));
            Ok(filled)
        }
        _ => Err((filled.len(), missing)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_gaps_are_bridged_and_long_ones_refused() {
        assert_eq!(bridge(&[None, Some(1.0), None, Some(3.0), None]).unwrap(), [1.0, 1.0, 2.0, 3.0, 3.0]);
        let mut long = vec![Some(1.0); 3];
        long.extend(vec![None; 61]);
        long.push(Some(2.0));
        assert_eq!(bridge(&long), Err((3, 61)));
        assert_eq!(bridge(&vec![None; 100]), Err((0, 100)));
    }
}
