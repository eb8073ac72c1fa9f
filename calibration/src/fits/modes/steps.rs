//! Steps in a run at rest: two scales in one log, a gyro that dies, a unit that was turned or tilted.
//!
//! Compared are means in which the modes cancel, by the rule of `drift`.

use super::cells::Second;
use crate::axes::AXES;
use crate::fits::drift::pieces::steps::step;
use crate::numbers::real;
use crate::report::fixed;

/// Most parts of a run that are compared.
const PARTS: usize = 128;
/// Seconds of a part: whole counts are coarse.
const SHORTEST_SECONDS: usize = 10;
/// Steps that are told: mean rate (°/h), specific force (m/s²).
const RATE_DEG_PER_H: f64 = 1.0;
const FORCE_M_PER_S2: f64 = 0.01;

/// The steps of the rates, and of the specific force, in words.
pub(super) fn found(seconds: &[Second], names: [&str; 3]) -> Vec<String> {
    let mut words = Vec::new();
    let runs: Vec<&[Second]> = seconds.chunk_by(|a, b| a.time_s < b.time_s).collect();
    for (number, run) in runs.iter().enumerate() {
        let log = if runs.len() > 1 { format!("in log {}, ", number + 1) } else { String::new() };
        let names = names.map(|name| format!("gyro {name}"));
        let rates = candidates(run)
            .iter()
            .find_map(|parts| stepping(parts, (&names, "°/h", 2), RATE_DEG_PER_H, |part| part.rate));
        words.extend(rates.map(|(at_s, steps)| {
            format!(
                "{log}about {at_s:.0} s after the beginning the mean rate steps and stays there: {steps}. Are two units of measure in one log, did a \
                 gyro fail, or was the unit turned? Cut the log there with --start and --duration"
            )
        }));
        let axes = AXES.map(|axis| format!("along {axis}"));
        let forces = stepping(&parts(run), (&axes, "m/s²", 3), FORCE_M_PER_S2, |part| part.force);
        words.extend(forces.map(|(at_s, steps)| {
            format!(
                "{log}about {at_s:.0} s after the beginning the specific force steps and stays there: {steps}. Was the unit tilted, or is an \
                 accelerometer out of order? Cut the log there with --start and --duration"
            )
        }));
    }
    words
}

/// When the largest step is, and all steps in words; `None` without one.
fn stepping(
    parts: &[Second],
    (names, measure, places): (&[String; 3], &str, usize),
    least: f64,
    of: fn(&Second) -> [f64; 3],
) -> Option<(f64, String)> {
    let axes = names.iter().enumerate().filter_map(|(axis, name)| {
        let means: Vec<f64> = parts.iter().map(|part| of(part)[axis]).collect();
        let step = step(&means)?;
        let size = (step.behind - step.before).abs();
        let words =
            format!("{name} from {} to {} {measure}", fixed(step.before, places), fixed(step.behind, places));
        (size > least).then_some((size, parts.get(step.part)?.time_s, words))
    });
    let steps: Vec<(f64, f64, String)> = axes.collect();
    let (_, at_s, _) = steps.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((*at_s, steps.iter().map(|(_, _, words)| words.as_str()).collect::<Vec<_>>().join(", ")))
}

/// Parts of a run in which the modes cancel or stay: means over neighbouring stretches of both modes, and parts of each long stretch.
fn candidates(run: &[Second]) -> Vec<Vec<Second>> {
    let in_modes = || run.chunk_by(|a, b| a.mode.total_cmp(&b.mode).is_eq());
    let stretches: Vec<Second> = in_modes().map(mean).collect();
    let together = stretches.len().div_ceil(2 * PARTS);
    let pairs = if together > 1 {
        stretches.chunks_exact(2 * together).map(mean).collect()
    } else {
        stretches.windows(2).map(mean).collect()
    };
    std::iter::once(pairs).chain(in_modes().map(parts)).collect()
}

/// Parts of some seconds.
fn parts(seconds: &[Second]) -> Vec<Second> {
    seconds.chunks_exact(seconds.len().div_ceil(PARTS).max(SHORTEST_SECONDS)).map(mean).collect()
}

/// What some seconds, or means over them, have in the mean; in both modes it is in none.
fn mean(of: &[Second]) -> Second {
    let count = real(of.len().max(1));
    let mean = |part: &dyn Fn(&Second) -> f64| of.iter().map(part).sum::<f64>() / count;
    Second {
        time_s: mean(&|second| second.time_s),
        mode: 0.0,
        rate: [0, 1, 2].map(|axis| mean(&|second| second.rate[axis])),
        force: [0, 1, 2].map(|axis| mean(&|second| second.force[axis])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 25 reversal periods of a minute, magnetic bias 2 °/h, a slow drift, and the Earth's rate times a scale.
    fn run(scale: impl Fn(f64) -> f64) -> Vec<Second> {
        let second = |number: u32| {
            let time_s = f64::from(number);
            let mode = if (number / 30).is_multiple_of(2) { 1.0 } else { -1.0 };
            let noise = f64::from(number * 7 % 11) * 0.1;
            let rate =
                [7.3, -4.2, -12.4].map(|earth| scale(time_s) * (earth + 2.0 * mode) + 1e-3 * time_s + noise);
            Second { time_s, mode, rate, force: [0.0, 0.0, -9.8] }
        };
        (0..1500).map(second).collect()
    }

    #[test]
    fn two_scales_in_one_run_are_told() {
        assert_eq!(found(&run(|_| 1.0), ["x", "y", "z"]), Vec::<String>::new());
        let mut told = found(&run(|time_s| if time_s < 750.0 { 1.0 } else { 2.0 }), ["x", "y", "z"]);
        // Few reversals, of five minutes; the gyro dies.
        let slow = |scale: fn(f64) -> f64| {
            let mut run = run(scale);
            for second in &mut run {
                let mode = if second.time_s % 600.0 < 300.0 { 1.0 } else { -1.0 };
                let change = 2.0 * (mode - second.mode) * scale(second.time_s);
                second.rate = second.rate.map(|rate| rate + change);
                second.mode = mode;
            }
            found(&run, ["x", "y", "z"])
        };
        assert_eq!(slow(|_| 1.0), Vec::<String>::new());
        told.extend(slow(|time_s| if time_s < 700.0 { 1.0 } else { 0.0 }));
        // The unit is tilted in the second of two logs.
        let mut tilted = run(|_| 1.0);
        tilted.extend(run(|_| 1.0));
        tilted.iter_mut().skip(2300).for_each(|second| second.force[0] = 0.05);
        told.extend(found(&tilted, ["x", "y", "z"]));
        insta::assert_snapshot!(told.join("\n"));
    }
}
