//! Steps on the way from runs to a judged document.

use isotherm_cli::Bar;
use isotherm_correction::sample::OutputKind;
use isotherm_protocol::document::{AccelOutput, Document};

use crate::error::Error;
use crate::positions::analysis::{Analysis, Settings};
use crate::positions::bare::bare;
use crate::positions::judged::{Judgement, judge};
use crate::positions::pose::Pose;
use crate::positions::track::Track;
use crate::runs::Run;
use crate::written::Written;

/// A document where there is none.
pub(super) fn first_document(runs: &[Run], output: AccelOutput, bar: Bar) -> Result<Document, Error> {
    let Some(run) = runs.first() else { return Err(Error::Refused(vec!["there is no log".to_owned()])) };
    let series = run.series(bar)?;
    let counts = series.accels.output == Some(OutputKind::Counts);
    bare(&series, if counts { AccelOutput::Counts } else { output })
}

/// Runs tick by tick, corrected with a document.
pub(super) fn tracks(runs: &[Run], written: &Written, bar: fn() -> Bar) -> Result<Vec<Track>, Error> {
    runs.iter().map(|run| Track::of(run, &written.loaded, bar())).collect()
}

/// Poses of runs, before and after.
pub(super) fn judged(
    settings: &Settings,
    analysis: &Analysis,
    poses: &[(Pose, usize)],
    runs: &[Run],
    [before, after]: [&Written; 2],
    bar: fn() -> Bar,
) -> Result<Vec<Judgement>, Error> {
    let (before, after) = (tracks(runs, before, bar)?, tracks(runs, after, bar)?);
    let errors = analysis.fit.stand.map(|(error, _)| error);
    Ok(judge(&settings.plan, errors, settings.gravity, poses, [&before, &after], &analysis.channels))
}
