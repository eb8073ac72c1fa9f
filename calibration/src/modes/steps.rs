//! Steps in a run at rest: two scales in one log, a gyro that dies, a unit that was turned or tilted.
//!
//! Compared are means over whole reversal periods, in which the modes cancel, by the rule of `drift`.

use super::cells::Second;
use super::words::fixed;
use crate::drift::pieces::steps::step;

/// Most parts of a run that are compared.
const PARTS: usize = 128;
/// Steps that are told: mean rate (°/h), specific force (m/s²).
const RATE_DEG_PER_H: f64 = 1.0;
const FORCE_M_PER_S2: f64 = 0.01;

/// Means over reversal periods.
#[derive(Debug, Clone, Copy, Default)]
struct Pair {
    time_s: f64,
    rate: [f64; 3],
    force: [f64; 3],
}

/// The steps of the rates, and of the specific force, in words.
pub(super) fn found(seconds: &[Second], names: [&str; 3]) -> Vec<String> {
    let mut words = Vec::new();
    for run in seconds.chunk_by(|a, b| a.time_s < b.time_s) {
        let parts = parts(run);
        let rates =
            stepping(&parts, (names.map(|name| format!("gyro {name}")), "°/h", 2), RATE_DEG_PER_H, |pair| {
                pair.rate
            });
        words.extend(rates.map(|(at_s, steps)| {
            format!(
                "about {at_s:.0} s after the beginning the mean rate steps and stays there: {steps}. Are two units of measure in one log, did a \
                 gyro fail, or was the unit turned? Cut the log there with --start and --duration"
            )
        }));
        let axes = ["x", "y", "z"].map(|axis| format!("along {axis}"));
        let forces = stepping(&parts, (axes, "m/s²", 3), FORCE_M_PER_S2, |pair| pair.force);
        words.extend(forces.map(|(at_s, steps)| {
            format!(
                "about {at_s:.0} s after the beginning the specific force steps and stays there: {steps}. Was the unit tilted, or is an \
                 accelerometer out of order? Cut the log there with --start and --duration"
            )
        }));
    }
    words
}

/// When the largest step is, and all steps in words; `None` without one.
fn stepping(
    parts: &[Pair],
    (names, measure, places): ([String; 3], &str, usize),
    least: f64,
    of: fn(&Pair) -> [f64; 3],
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

/// Means over whole reversal periods, some of them together where there are many.
fn parts(run: &[Second]) -> Vec<Pair> {
    let stretches: Vec<Pair> =
        run.chunk_by(|a, b| a.mode.total_cmp(&b.mode).is_eq()).map(of_stretch).collect();
    let pairs = stretches.len() / 2;
    let together = pairs.div_ceil(PARTS).max(1);
    stretches.chunks_exact(2 * together).map(mean).collect()
}

fn of_stretch(seconds: &[Second]) -> Pair {
    let pair = |second: &Second| Pair { time_s: second.time_s, rate: second.rate, force: second.force };
    mean(&seconds.iter().map(pair).collect::<Vec<Pair>>())
}

#[expect(clippy::cast_precision_loss, reason = "seconds of a run")]
fn mean(of: &[Pair]) -> Pair {
    let count = of.len().max(1) as f64;
    let mean = |axis: usize, part: fn(&Pair) -> [f64; 3]| {
        of.iter().map(|pair| part(pair)[axis]).sum::<f64>() / count
    };
    Pair {
        time_s: of.iter().map(|pair| pair.time_s).sum::<f64>() / count,
        rate: [0, 1, 2].map(|axis| mean(axis, |pair| pair.rate)),
        force: [0, 1, 2].map(|axis| mean(axis, |pair| pair.force)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 25 reversal periods of a minute, magnetic bias 2 °/h, a slow drift, and the Earth's rate times a scale.
    fn run(scale: impl Fn(f64) -> f64) -> Vec<Second> {
        let second = |number: u32| {
            let time_s = f64::from(number);
            let mode = if number / 30 % 2 == 0 { 1.0 } else { -1.0 };
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
        let words = found(&run(|time_s| if time_s < 750.0 { 1.0 } else { 2.0 }), ["x", "y", "z"]);
        assert!(
            words.len() == 1
                && words[0].contains("the mean rate steps")
                && words[0].contains("gyro z from -11"),
            "{words:?}"
        );
    }
}
