//! What tells another unit of measure, or a column of something else: the rate that is felt at rest, and the dither's frequency.

use isotherm_correction::units::AngularRate;
use isotherm_protocol::document::{Document, GyroOutput};

use super::checks::TURNING_DEG_PER_H;
use super::document::count_arcsec;
use super::switches::Switches;
use crate::document::gyro_name;
use crate::numbers::{median, real};
use crate::report::{gyros, short};

/// The Earth's rate (°/h).
const EARTH_DEG_PER_H: f64 = 15.04;
/// Largest frequency of a dither, as the half periods count it (Hz).
pub(super) const LARGEST_HZ: f64 = 1e6;
/// Share by which the dither's frequency may differ from that of the document's servo.
const OTHER_DITHER: f64 = 0.02;
/// Ticks by which the mode may come before or behind the switch command: what a correction bridges.
const LATE_TICKS: f64 = 3.0;

/// That the gyros, by the document's weights, show far more than a unit at rest can, in words.
pub(super) fn rates(switches: &Switches, document: &Document) -> Option<String> {
    let counts = document.gyro.output == GyroOutput::Counts;
    let rate = |(sensor, seen): (usize, &super::seen::Seen)| {
        let weight = document.gyro.sensor.get(sensor)?.increment_weight_rad_per_rad;
        let per_second = seen.per_second()?;
        // 1″/s is 1 °/h.
        Some(if counts {
            per_second * count_arcsec(document, sensor)
        } else {
            AngularRate::from_rad_per_s(per_second * weight.unwrap_or(1.0)).as_deg_per_h()
        })
    };
    let rates: Vec<f64> = switches.seen.iter().enumerate().filter_map(rate).collect();
    let largest = rates.iter().map(|rate| rate.abs()).fold(0.0, f64::max);
    (largest > TURNING_DEG_PER_H + EARTH_DEG_PER_H).then(|| {
        format!(
            "by the document's weights the gyros show {} °/h in the mean, at rest they show the Earth's \
             {EARTH_DEG_PER_H} °/h in all and at most {TURNING_DEG_PER_H} °/h of bias: the unit turns, or the \
             mapping or the document has another unit of measure (1 rad is 57.3°, 1° is 3600″), or the document is \
             of another unit",
            rates.iter().map(|rate| short(*rate)).collect::<Vec<_>>().join(", ")
        )
    })
}

/// What is wrong with the half-period counts, in words.
pub(super) fn half_periods(switches: &Switches, document: &Document) -> Vec<String> {
    const MEND: &str = "The correction removes the dither by them: correct their columns in the mapping, or leave \
                        them out";
    let mut reasons = Vec::new();
    let seen = || switches.seen.iter().enumerate();
    let dead: Vec<&str> = seen()
        .filter(|(_, seen)| seen.has_dead_halves())
        .map(|(sensor, _)| gyro_name(document, sensor))
        .collect();
    if !dead.is_empty() {
        reasons.push(format!("{}: all half-period counts are zero. {MEND}", gyros(&dead)));
    }
    let impossible: Vec<(&str, f64)> = seen()
        .filter(|(_, seen)| !seen.has_dead_halves())
        .filter_map(|(sensor, _)| Some((gyro_name(document, sensor), dither_hz(switches, sensor)?)))
        .filter(|(_, hz)| !(0.0..LARGEST_HZ).contains(hz))
        .collect();
    if !impossible.is_empty() {
        let (names, hz): (Vec<&str>, Vec<String>) =
            impossible.into_iter().map(|(name, hz)| (name, short(hz))).unzip();
        reasons.push(format!(
            "{}: the dither's frequency comes out as {} Hz by the half periods, 0 to {LARGEST_HZ} Hz are possible: are the counts in another \
             unit of measure, or the positive and the negative ones swapped? {MEND}",
            gyros(&names),
            hz.join(", ")
        ));
    }
    reasons
}

/// Gyros whose dither is not that of the document's servo at a temperature (°C), in words.
pub(super) fn other_dither(switches: &Switches, document: &Document, deg_c: f64) -> Option<String> {
    let stated =
        |sensor: usize| document.gyro.sensor.get(sensor)?.servo.as_ref()?.rest_frequency.shape().at(deg_c);
    let other: Vec<(&str, String)> = document
        .gyro
        .sensor
        .iter()
        .enumerate()
        .filter_map(|(sensor, of)| Some((of.name.as_str(), dither_hz(switches, sensor)?, stated(sensor)?)))
        .filter(|(_, hz, stated)| (hz / stated - 1.0).abs() > OTHER_DITHER)
        .map(|(name, hz, stated)| (name, format!("{hz:.0} Hz instead of {stated:.0} Hz")))
        .collect();
    let (names, hz): (Vec<&str>, Vec<String>) = other.into_iter().unzip();
    (!names.is_empty()).then(|| {
        format!(
            "{}: the dither is not that of the document's servo: {}. Are columns of the half periods swapped in the mapping, or is the document \
             that of another unit?",
            gyros(&names),
            hz.join(", ")
        )
    })
}

/// That the mode changes long before or behind the switch command, in words.
pub(super) fn late(switches: &Switches) -> Option<String> {
    let late_s = median(&switches.late_s);
    let ticks = late_s / switches.tick_s;
    (ticks.abs() > LATE_TICKS + 0.5).then(|| {
        format!(
            "the mode changes {} s ({:.0} ticks) {} the switch command in the median, but no reading is lost there: \
             the log's mode is not that of its readings. Correct the mode or the switch column, or, if the unit \
             works like that, state --transition-ticks",
            short(late_s.abs()),
            ticks.abs(),
            if late_s > 0.0 { "behind" } else { "before" }
        )
    })
}

/// Frequency of a gyro's dither (Hz), the median over the switches of the last ticks that are kept behind them.
fn dither_hz(switches: &Switches, sensor: usize) -> Option<f64> {
    let settled = |row: &Vec<f64>| {
        let half = row.get(row.len() / 2..).filter(|half| !half.is_empty())?;
        Some(half.iter().sum::<f64>() / real(half.len()))
    };
    let hz: Vec<f64> =
        switches.behind.iter().filter_map(|behind| settled(behind.dither_hz.get(sensor)?)).collect();
    // The half that comes first may change with the mode, but is not the negative one in both.
    let mut firsts = switches.behind.iter().filter_map(|behind| behind.is_negative_first.get(sensor));
    let sign = if firsts.all(|negative| *negative) { -1.0 } else { 1.0 };
    (!hz.is_empty()).then(|| sign * median(&hz))
}
