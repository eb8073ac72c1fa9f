//! A table of times: which position was held from when to when.

use std::path::Path;

use isotherm_log::file::read_small_text;

use super::plan::Plan;
use super::pose::Pose;
use super::still::{StillLimits, moves};
use super::track::{Track, quantile};
use crate::csv;
use crate::error::Error;
use crate::report::{counted, six};

/// Rows of the table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Times {
    /// Start and end since the run's beginning (s), position, and the run's name where there are several.
    pub rows: Vec<([f64; 2], String, Option<String>)>,
}

impl Times {
    /// Reads `start_s,end_s,position` or `start_s,end_s,position,log` behind a line that says which.
    ///
    /// # Errors
    /// [`Error::Log`] where it cannot be read, [`Error::Usage`] with what is wrong in it.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = read_small_text(path, "read the table of times")?;
        let row = |row: csv::Row<'_>| {
            let span: [f64; 2] = [row.need("start_s")?, row.need("end_s")?];
            if !(span[1] > span[0] && span.iter().all(|time| time.is_finite())) {
                let [start, end] = span;
                return Err(
                    row.wrong(&format!("it starts at {start} s and ends at {end} s, which must be later"))
                );
            }
            Ok((span, row.need("position")?, row.get("log")?))
        };
        let rows = csv::rows(&text, &["start_s", "end_s", "position", "log"], row);
        let wrong = |words| {
            Error::Usage(format!("{}: {words}; a row is start_s,end_s,position[,log]", path.display()))
        };
        Ok(Self { rows: rows.map_err(wrong)? })
    }

    /// The poses of a run, with their positions' numbers.
    ///
    /// # Errors
    /// Rows that do not fit the run or the plan, or in which the unit moves.
    pub fn poses(
        &self,
        (track, run): (&Track, usize),
        plan: &Plan,
        limits: &StillLimits,
    ) -> Result<Vec<(Pose, usize)>, Vec<String>> {
        let mut reasons = Vec::new();
        let mut found = Vec::new();
        let own = |log: &Option<String>| log.as_ref().is_none_or(|log| *log == track.run);
        let rows = || self.rows.iter().filter(|(.., log)| own(log)).enumerate();
        if rows().next().is_none() {
            reasons
                .push(format!("no row of --times is of {}: the column log has the file's name", track.run));
        }
        for (at, (span, name, _)) in rows() {
            let [start, end] = *span;
            let overlaps = |[from, to]: [f64; 2]| from < end - 1e-9 && start < to - 1e-9;
            if let Some((_, ([from, to], before, _))) =
                rows().take(at).find(|(_, (other, ..))| overlaps(*other))
            {
                reasons.push(format!(
                    "--times: {name} from {start} to {end} s overlaps {before} from {from} to {to} s: each tick counts once"
                ));
                continue;
            }
            let Some(position) = plan.index_of(name) else {
                let names: Vec<&str> = plan.positions.iter().map(|position| position.name.as_str()).collect();
                reasons.push(format!(
                    "--times: {name:?} is not a position of the plan, which has {}",
                    names.join(", ")
                ));
                continue;
            };
            let within = |tick: &usize| {
                let start = track.start_s(*tick);
                start >= span[0] - 1e-9 && start + track.duration_s[*tick] <= span[1] + 1e-9
            };
            let ticks: Vec<usize> = (0..track.len()).filter(within).collect();
            let (Some(first), Some(last)) = (ticks.first(), ticks.last()) else {
                reasons.push(format!(
                    "--times: {name} from {} to {} s has no tick of {}: times count from the first tick read (--start)",
                    span[0], span[1], track.run
                ));
                continue;
            };
            found.push((Pose::over(track, run, *first..last + 1), position));
        }
        reasons.extend(moving(track, plan, &found, limits));
        if reasons.is_empty() { Ok(found) } else { Err(reasons) }
    }
}

/// The first of a run's poses in which the unit moves, and how many others: times that are late are so throughout.
fn moving(track: &Track, plan: &Plan, poses: &[(Pose, usize)], limits: &StillLimits) -> Option<String> {
    let ticks = || poses.iter().flat_map(|(pose, _)| pose.ticks.clone());
    let rest = track.rate_deg_per_s.each_ref();
    let rest = rest.map(|column| quantile(&ticks().map(|tick| column[tick]).collect::<Vec<f64>>(), 0.5));
    let of = |(pose, position): &(Pose, usize)| {
        let [start, end] = pose.span_s;
        let name = &plan.positions[*position].name;
        let how = moves(track, &pose.ticks, limits, rest)?;
        Some(format!("{name} from {} to {} s: {how}", six(start), six(end)))
    };
    let found: Vec<String> = poses.iter().filter_map(of).collect();
    let (first, others) = found.split_first()?;
    let likewise = if others.is_empty() {
        String::new()
    } else {
        format!(". Likewise {}", counted(others.len(), "other row", "other rows"))
    };
    Some(format!(
        "--times: {}: {first}; times count from the first tick read (--start): correct them, or shorten the rows{likewise}",
        track.run
    ))
}
