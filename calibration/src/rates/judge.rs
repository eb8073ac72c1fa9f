//! What the document makes of the steps, by the service's own code.

use super::bins::means_within;
use super::make::Measured;
use crate::error::Error;
use crate::report::{Figure, Verdict};
use crate::runs::{Run, Watch};
use crate::size::Size;
use crate::written::Written;

/// Errors of the corrected rate in the windows of a run's steps, by the service's own code with a document.
pub(super) fn errors<W: Watch>(
    (number, run): (usize, &Run),
    written: &Written,
    steps: &mut [Measured],
    sample: usize,
    watch: &mut impl FnMut() -> W,
) -> Result<(), Error> {
    let windows: Vec<[f64; 2]> = steps
        .iter()
        .filter(|step| step.matched.step.run == number)
        .map(|step| step.matched.plateau.window_s)
        .collect();
    let means = means_within(run, &written.loaded, &windows, watch())?;
    let own = steps.iter_mut().filter(|step| step.matched.step.run == number);
    for (step, mean) in own.zip(means) {
        step.error[sample] = [0, 1, 2].map(|axis| mean[axis] - step.rate[axis]);
    }
    Ok(())
}

/// Before and after by case axis, of the steps that were fitted and of those that were not, which decide where there are any; the
/// bias is not what rates are about, so means are taken off.
pub(super) fn verdicts(steps: &[Measured], judged: &[Measured]) -> Vec<Verdict> {
    let of = |steps: &[Measured], axis: usize, sample: usize| -> Vec<f64> {
        let errors: Vec<f64> = steps.iter().map(|step| step.error[sample][axis]).collect();
        let mean = Size::of(&errors).mean;
        errors.iter().map(|error| error - mean).collect()
    };
    ["x", "y", "z"]
        .iter()
        .enumerate()
        .map(|(axis, name)| {
            let both = |steps: &[Measured]| [of(steps, axis, 0), of(steps, axis, 1)];
            let outside = (!judged.is_empty()).then(|| both(judged));
            let verdict = Verdict::of_values(format!("gyro {name}"), "°/h", both(steps), outside);
            let verdict = verdict.stated_as(Figure::Rms);
            if verdict.accepted {
                return verdict;
            }
            let grown = format!(
                "the errors of its steps grow, {}: check the table's axis and rates, and the temperature of all logs",
                verdict.reason
            );
            verdict.refused(grown)
        })
        .collect()
}
