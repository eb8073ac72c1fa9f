//! What makes a log useless for the modes: every reason, with its value, limit and what to do.

use isotherm_correction::sample::OutputKind;
use isotherm_protocol::document::{Document, GyroOutput};

use super::cells::{Gathered, Second};
use super::model::deg_per_h;
use super::seen::Stay;
use super::switches::Switches;
use super::{steps, units};
use crate::axes::AXES;
use crate::document::gyro_name;
use crate::numbers::{Size, dot, ends, median, real, scatter_of_steps, unit};
use crate::report::{counted, fixed, short, six};
use crate::runs::swapped::{Looks, Shown};

/// Fewest switches.
const SWITCHES: usize = 8;
/// Largest share by which one mode may have more ticks than the other.
const UNBALANCE: f64 = 0.2;
/// Most ticks that a switch loses, however long they are, and longest time that it takes (s) [003].
const TRANSITION_TICKS: usize = 3;
const TRANSITION_S: f64 = 0.015;
/// Largest share of missing ticks.
const MISSING: f64 = 0.05;
/// Largest share of ticks with an invalid gyro, or a stale temperature.
const UNUSABLE: f64 = 0.2;
/// Seconds on either side that a second is compared with.
const NEIGHBOURS: usize = 30;
/// Standard deviations, angle in a second (°/h), counts in a second, and force (m/s²) from which on a second is a motion.
const SIGMAS: f64 = 7.0;
const TURN_DEG_PER_H: f64 = 15.0;
const COUNTS: f64 = 4.0;
const PUSH_M_PER_S2: f64 = 5e-3;
/// Largest mean rate of a unit at rest, Earth rate apart (°/h): 0.05 °/s.
pub(super) const TURNING_DEG_PER_H: f64 = 180.0;
/// Difference of the rate about the vertical from the Earth's that is told (°/h), and cosine between gyros for which it is not.
const VERTICAL_DEG_PER_H: f64 = 3.0;
const SKEWED: f64 = 0.1;
/// Parts of the runs: what differs between their means is drift, not noise.
const PARTS: usize = 20;

/// Reasons that show before anything is corrected.
pub fn before(switches: &Switches, document: &Document, transition_ticks: Option<u8>) -> Vec<String> {
    let mut reasons = Vec::new();
    let Some(output) = switches.output else {
        return vec!["the log has no gyro ticks: is --unit right?".to_owned()];
    };
    let [plus, minus, none] = switches.of_mode;
    if plus + minus == 0 {
        reasons.push(format!(
            "none of the {none} gyro ticks states a lasing mode, which separates the magnetic from the static bias. \
             Map the log's mode column (mode in the [gyro] table of its mapping), or use isotherm-calibrate thermal"
        ));
    } else if plus == 0 || minus == 0 {
        reasons.push(format!(
            "all {} ticks are in one lasing mode ({}): record with mode reversal",
            plus + minus,
            if minus == 0 { "plus" } else { "minus" }
        ));
    } else {
        if switches.between_s.len() + 1 < SWITCHES {
            reasons.push(format!(
                "the mode switches {}, {SWITCHES} times are needed: record longer, or switch more often",
                counted(switches.between_s.len() + 1, "time", "times")
            ));
        }
        if switches.unbalance() > UNBALANCE {
            reasons.push(format!(
                "the modes are unbalanced: {plus} ticks in plus, {minus} in minus, a difference of {:.0} % of both; {:.0} % are \
                 allowed. Let both modes last equally long, or cut the log with --start and --duration",
                100.0 * switches.unbalance(),
                100.0 * UNBALANCE
            ));
        }
    }
    if none > 0 && plus + minus > 0 && none > plus + minus {
        reasons.push(format!(
            "{none} of {} ticks state no lasing mode: map the log's mode column",
            switches.ticks
        ));
    }
    let stated = document.gyro.sensor.len();
    if switches.sensors != stated {
        reasons.push(format!(
            "the log has {} gyros, the document {stated}: is it the document of this unit?",
            switches.sensors
        ));
    }
    let counts = document.gyro.output == GyroOutput::Counts;
    if counts != (output == OutputKind::Counts) {
        let [log, of] = if counts { ["mean rates", "counts"] } else { ["counts", "mean rates"] };
        reasons.push(format!(
            "the log's gyro readings are {log}, the document's gyro.output is {of}: correct the mapping or the \
             document"
        ));
    }
    let seen = || switches.seen.iter().enumerate().map(|(sensor, seen)| (gyro_name(document, sensor), seen));
    for (dead, _) in seen().filter(|(_, seen)| seen.is_dead()) {
        reasons.push(format!(
            "gyro {dead} has a constant reading, or no number, in all {} ticks: it is dead, or its column is wrong",
            switches.ticks
        ));
    }
    for (name, seen) in seen() {
        if let Some(Stay { reading, from_s, to_s, .. }) = seen.frozen(switches.period_s()) {
            reasons.push(format!(
                "gyro {name} gives the same reading, {}, from {from_s:.0} s to {to_s:.0} s, but varies elsewhere: it \
                 failed, or its output was lost; cut the log to the valid part with --start and --duration",
                six(reading + 0.0)
            ));
        }
    }
    if counts == (output == OutputKind::Counts) && switches.sensors == stated {
        reasons.extend(units::rates(switches, document));
        reasons.extend(units::half_periods(switches, document));
    }
    // What else is wrong with the readings makes them look lost too.
    let lost = switches.transition_ticks();
    if transition_ticks.is_none() && reasons.is_empty() {
        let is_longer = real(lost.saturating_sub(1)) * switches.tick_s > TRANSITION_S;
        if lost > TRANSITION_TICKS && is_longer {
            let ms = short(1e3 * TRANSITION_S);
            reasons.push(format!(
                "readings are lost up to tick {lost} after a switch, which takes at most {ms} ms: does the log mark \
                 the tick of the command? To accept this, state --transition-ticks"
            ));
        } else if lost == 0 {
            reasons.extend(units::late(switches));
        }
    }
    reasons
}

/// Reasons that show in the gathered cells.
pub fn behind(
    gathered: &Gathered,
    names: [&str; 3],
    count_arcsec: [f64; 3],
    earth: Option<[f64; 3]>,
) -> Vec<String> {
    let mut reasons = Vec::new();
    let [there, missing] = gathered.ticks.map(real);
    if missing > MISSING * (there + missing) {
        reasons.push(format!(
            "{missing} of {} ticks are missing, {:.0} % are allowed: cut the log with --start and --duration, or \
             record again",
            there + missing,
            100.0 * MISSING
        ));
    }
    for (count, what, todo) in [
        (gathered.invalid, "have an unusable gyro reading", "look at the log with isotherm-replay info"),
        (
            gathered.stale,
            "have no fresh temperature of a gyro",
            "does the document name the log's channels, and are stale_after_s, range_deg_c and the conversion right?",
        ),
        (
            gathered.warming_up,
            "lack readings of a temperature channel that the document has",
            "does the log have all channels of the document? Remove those that it lacks from the document",
        ),
    ] {
        if real(count) > UNUSABLE * there {
            reasons.push(format!(
                "{count} of {there} ticks {what}, {:.0} % are allowed: {todo}",
                100.0 * UNUSABLE
            ));
        }
    }
    if gathered.cells.is_empty() && reasons.is_empty() {
        reasons.push(
            "no settled ticks are left between the switches: --settle must be shorter than the time between \
                      them"
                .to_owned(),
        );
    }
    let steps = steps::found(&gathered.seconds, names);
    reasons.extend(if steps.is_empty() { motion(&gathered.seconds, names, count_arcsec) } else { steps });
    if let Some(earth) = earth {
        for (place, name) in names.into_iter().enumerate() {
            let rates: Vec<f64> = gathered.seconds.iter().map(|second| second.rate[place]).collect();
            let rate = median(&rates) - earth[place];
            if rate.abs() > TURNING_DEG_PER_H {
                reasons.push(format!(
                    "gyro {name} shows {rate:.1} °/h besides the Earth's rate, {TURNING_DEG_PER_H} °/h are allowed \
                     at rest: the unit turns, or its increment weight is wrong"
                ));
            }
        }
    }
    reasons
}

/// Whether too many ticks lack a temperature.
pub(super) fn lacks_temperatures(gathered: &Gathered) -> bool {
    let [there, _] = gathered.ticks.map(real);
    [gathered.stale, gathered.warming_up].into_iter().any(|count| real(count) > UNUSABLE * there)
}

/// Columns that look swapped, signs, scales and attitudes that look wrong, where what the gyros sense of the Earth (°/h; here, and at the
/// opposite latitude) or the direction of gravity is known.
pub fn attitude(
    seconds: &[Second],
    (earth, opposite): (Option<[f64; 3]>, Option<[f64; 3]>),
    force: Option<[f64; 3]>,
) -> Vec<Looks> {
    let parts = || seconds.chunks(seconds.len().div_ceil(PARTS).max(1));
    let looks = |of: [&'static str; 2], triad: fn(&Second) -> [f64; 3], stated: Option<[f64; 3]>| {
        let sizes = [0, 1, 2].map(|axis| {
            let mean = |part: &[Second]| {
                Size::of(&part.iter().map(|second| triad(second)[axis]).collect::<Vec<f64>>()).mean
            };
            Size::of(&parts().map(mean).collect::<Vec<f64>>())
        });
        let shown = Shown::of(of, sizes, stated?).or_opposite(opposite.filter(|_| of[0] == "gyros"));
        shown.swapped().or_else(|| shown.far())
    };
    let words = [
        looks(["gyros", "°/h"], |second| second.rate, earth),
        looks(["accelerometers", "m/s²"], |second| second.force, force),
    ];
    words.into_iter().flatten().collect()
}

/// That the rate about the vertical (gyros along these axes) is not the Earth's (rad/s) at the stated latitude: gravity shows the
/// vertical, and heading has no part in it.
pub fn vertical(
    seconds: &[Second],
    rows: [[f64; 3]; 3],
    (earth, force): ([f64; 3], [f64; 3]),
) -> Option<String> {
    let up = unit(force);
    // Skewed gyros by threes do not span the case evenly.
    let even = (0..3).all(|a| (0..a).all(|b| dot(rows[a], rows[b]).abs() < SKEWED));
    let mean =
        |axis: usize| Size::of(&seconds.iter().map(|second| second.rate[axis]).collect::<Vec<f64>>()).mean;
    let shown = (0..3).map(|axis| mean(axis) * dot(rows[axis], up)).sum::<f64>();
    let stated = earth_along(up, earth);
    (even && (shown - stated).abs() > VERTICAL_DEG_PER_H).then(|| {
        format!(
            "the gyros show {} °/h about the vertical, the Earth turns by {} °/h about it at the stated latitude: unless their \
             bias is that large, --latitude is wrong",
            fixed(shown, 2),
            fixed(stated, 2)
        )
    })
}

/// The first motion of each kind.
fn motion(seconds: &[Second], names: [&str; 3], count_arcsec: [f64; 3]) -> Vec<String> {
    let mut reasons = Vec::new();
    for axis in 0..3 {
        let floor = TURN_DEG_PER_H.max(COUNTS * count_arcsec[axis].abs());
        let rates: Vec<f64> = seconds.iter().map(|second| second.rate[axis]).collect();
        if let Some((second, value, limit)) = jump(seconds, &rates, floor, true) {
            reasons.push(format!(
                "the unit moved {:.0} s after the beginning: gyro {} turned by {value:.1}″ within a second, {limit:.1}″ are allowed at \
                 rest; cut the log with --start and --duration",
                second.time_s, names[axis]
            ));
        }
        let forces: Vec<f64> = seconds.iter().map(|second| second.force[axis]).collect();
        if let Some((second, value, limit)) = jump(seconds, &forces, PUSH_M_PER_S2, false) {
            reasons.push(format!(
                "the unit was pushed {:.0} s after the beginning: {} m/s² along {} in a second, {} m/s² are allowed at rest; cut the log \
                 with --start and --duration",
                second.time_s,
                short(value),
                AXES[axis],
                short(limit)
            ));
        }
    }
    reasons
}

/// The first second that differs from its neighbours by more than noise explains, by how much, and the limit.
fn jump(seconds: &[Second], values: &[f64], floor: f64, by_mode: bool) -> Option<(Second, f64, f64)> {
    let limit = floor.max(SIGMAS * scatter_of_steps(values));
    let [low, high] = ends(values.iter().copied());
    if high - low <= limit {
        return None;
    }
    (0..seconds.len()).find_map(|index| {
        let second = seconds[index];
        let near = index.saturating_sub(NEIGHBOURS)..(index + NEIGHBOURS + 1).min(seconds.len());
        let of_kind: Vec<f64> = near
            .filter(|&other| !by_mode || seconds[other].mode.total_cmp(&second.mode).is_eq())
            .map(|other| values[other])
            .collect();
        let away = (values[index] - median(&of_kind)).abs();
        (away > limit).then_some((second, away, limit))
    })
}

/// Earth rate along input axes (°/h): rows of the orientation times the rate in case axes.
pub(super) fn earth_along(row: [f64; 3], earth_rad_per_s: [f64; 3]) -> f64 {
    deg_per_h(dot(row, earth_rad_per_s))
}
