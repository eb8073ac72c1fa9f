//! Whether two passes through the same temperatures show the same.
//!
//! A log of one cooling and one heating can have any difference between the two explained by a lag: cross-validation on pieces of the
//! same two passes finds nothing wrong with it, and the next run may. What the log can say is how much of a sensor's output the passes
//! have in common.

use super::branches::History;
use super::columns::{Columns, Term};
use super::model::Spec;
use super::noise::Noise;
use super::select::{Target, Trials};

/// Power of the static bias that a pass is told from the others by.
const DEGREE: usize = 3;
/// Share of the mean's beyond which it is said.
const DISAGREE: f64 = 0.7;

/// What a static bias, fitted to the other passes, leaves of a pass, as a share of what their mean leaves; `None` where the log tells
/// lags from hysteresis anyway, or nothing can be judged.
#[must_use]
pub fn share(
    target: &Target,
    columns: &Columns<'_>,
    (history, temperature): (&History, &[f64]),
) -> Option<f64> {
    if history.tells_dynamics() || !history.both_directions() {
        return None;
    }
    let terms: Vec<Term> = (0..=DEGREE).map(Term::Static).collect();
    let trials = Trials::of(target, columns, &terms, &Noise::default(), (&history.ramp, temperature));
    let left =
        |degree: usize| trials.score(&Spec { degree, scale: target.widest_scale(), ..Spec::default() });
    Some(left(DEGREE)? / left(0)?)
}

/// What is to be known of a sensor whose passes disagree.
#[must_use]
pub fn doubt(share: Option<f64>) -> Option<String> {
    let share = share.filter(|share| *share > DISAGREE)?;
    Some(format!(
        "its passes through the same temperatures disagree: a static bias of one leaves {:.0} % of what its mean \
         leaves on the other. A lag can explain any such difference, right or wrong: judge on another run \
         (--judge), or add a third pass",
        100.0 * share
    ))
}
