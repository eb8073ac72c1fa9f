//! What the procedure needs before it fits: windows, lost ticks, the Earth, a look at what was gathered.

use isotherm_correction::units::Span;
use isotherm_protocol::document::{Curve, Document, Servo, ServoKind, Shape, Unit};

use super::cells::Gathered;
use super::fit::Wanted;
use super::servo::Transient;
use super::switches::Switches;
use super::{checks, document, temperatures};
use crate::document::gyro_name;
use crate::error::Error;
use crate::runs::swapped::{Fits, at_opposite_latitude, force_at_rest};
use crate::runs::table;

/// Length of a window of the residuals, in whole reversal periods (s).
const WINDOW_S: f64 = 600.0;

/// Whole reversal periods, ten minutes or a twelfth of the runs: what a switch costs in whole counts shall not hide the drift.
pub(super) fn window_s(switches: &Switches, length_s: f64) -> f64 {
    let pair_s = 2.0 * switches.period_s();
    let wanted_s = WINDOW_S.min(length_s / 12.0);
    pair_s * libm::ceil(wanted_s / pair_s).max(1.0)
}

pub(super) fn transition_ticks(wanted: &Wanted<'_>, switches: &Switches, warnings: &mut Vec<String>) -> u8 {
    let tick = Span::from_s(switches.tick_s);
    let stated = wanted.base.mode_reversal.as_ref().map(|reversal| reversal.ticks(tick));
    if let Some(given) = wanted.asked.transition_ticks {
        return given;
    }
    let seen = u8::try_from(switches.transition_ticks()).unwrap_or(u8::MAX);
    if seen == 0 {
        warnings.push(format!(
            "no reading after a switch looks lost: {} transition ticks are assumed; if you know them, state \
             --transition-ticks",
            stated.unwrap_or(1)
        ));
    }
    seen.max(stated.unwrap_or(1))
}

/// A servo that marks the transient's ticks while they are left out: its frequency does not matter yet.
pub(super) fn provisional(transient: &Transient) -> Servo {
    Servo {
        form: ServoKind::Modelled,
        time_constant_s: transient.time_constant_s,
        rest_frequency: Curve::new(Shape::Constant { value: transient.rest_hz }).in_unit(Unit::HZ),
        settle_time_constants: document::SETTLED,
    }
}

/// Earth rate in case axes (rad/s); `None` where the place is not known.
pub(super) fn earth_rate(wanted: &Wanted<'_>, gathered: &Gathered) -> Result<Option<[f64; 3]>, Error> {
    wanted.place.as_ref().map(|place| table::earth_rate(place, gathered.force)).transpose()
}

/// Looks at what was gathered of three gyros: warnings.
///
/// # Errors
/// Every reason why nothing can be made of it.
pub(super) fn check(
    wanted: &Wanted<'_>,
    gathered: &Gathered,
    (bare, group): (&Document, [usize; 3]),
    earth: Option<[f64; 3]>,
) -> Result<Vec<String>, Error> {
    let names = group.map(|sensor| gyro_name(bare, sensor));
    let counts = group.map(|sensor| document::count_arcsec(bare, sensor));
    let rows = group.map(|sensor| document::row(bare, sensor, f64::NAN));
    let along_rows = |earth| rows.map(|row| checks::earth_along(row, earth));
    let along = earth.map(along_rows);
    let mut reasons = checks::behind(gathered, names, counts, along);
    if !reasons.is_empty() {
        if checks::lacks_temperatures(gathered) {
            reasons.push(temperatures::read(wanted.runs, bare)?);
        }
        return Err(Error::Refused(reasons));
    }
    let force = wanted.place.as_ref().and_then(force_at_rest);
    let level = earth.zip(force.or(gathered.force));
    let opposite = level.map(|(earth, force)| along_rows(at_opposite_latitude(earth, force)));
    let looks = checks::attitude(&gathered.seconds, (along, opposite), force);
    // Swapped columns have no vertical to speak of.
    let vertical = level.filter(|_| looks.iter().all(|one| one.fits == Fits::Nothing));
    let vertical = vertical.and_then(|of| checks::vertical(&gathered.seconds, rows, of));
    Ok(looks.iter().map(ToString::to_string).chain(vertical).collect())
}

pub(super) fn gaps(gathered: &Gathered, warnings: &mut Vec<String>) {
    let [there, missing] = gathered.ticks;
    if missing > 0 {
        let are = if missing == 1 { "tick is" } else { "ticks are" };
        warnings.push(format!("{missing} {are} missing among {there}: means end there"));
    }
    warnings.extend(gathered.troubles.iter().cloned());
}
