//! What a document leaves of the positions: means of the service's own output against the specific force that must be there.

use std::sync::Arc;

use isotherm_protocol::document::Sample;

use super::plan::{Plan, StandErrors};
use super::pose::Pose;
use super::track::Track;
use crate::axes::AXES;
use crate::numbers::norm;
use crate::report::Curve;

/// One position, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Number of the run.
    pub run: usize,
    /// Number of the position.
    pub position: usize,
    /// Middle of the pose since the run's beginning (s).
    pub time_s: f64,
    /// Temperature (°C); no number where none is measured.
    pub deg_c: f64,
    /// Mean specific force less what must be there, before and after (m/s²).
    pub error: [[f64; 3]; 2],
    /// Its length less gravity, before and after (m/s²).
    pub length: [f64; 2],
}

/// Judges poses: the same runs, corrected before and after.
pub fn judge(
    plan: &Plan,
    errors: StandErrors,
    gravity: f64,
    poses: &[(Pose, usize)],
    [before, after]: [&[Track]; 2],
    channels: &[String],
) -> Vec<Judgement> {
    let one = |(pose, position): &(Pose, usize)| {
        let up = plan.up(*position, errors);
        let force = |tracks: &[Track]| {
            tracks.get(pose.run).map(|track| Pose::over(track, pose.run, pose.ticks.clone()).force_m_per_s2)
        };
        let forces = [force(before)?, force(after)?];
        let error = forces.map(|force| [0, 1, 2].map(|axis| force[axis] - gravity * up[axis]));
        let length = forces.map(|force| norm(force) - gravity);
        Some(Judgement {
            run: pose.run,
            position: *position,
            time_s: pose.middle_s(),
            deg_c: pose.mean_temperature(channels).unwrap_or(f64::NAN),
            error,
            length,
        })
    };
    poses.iter().filter_map(one).collect()
}

/// The judgements as curves, one per axis and run.
pub fn curves(judged: &[Judgement], names: &[String], sample: Sample) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (run, name) in names.iter().enumerate() {
        let own: Vec<&Judgement> = judged.iter().filter(|judgement| judgement.run == run).collect();
        let time_s: Arc<[f64]> = own.iter().map(|judgement| judgement.time_s).collect();
        for (axis, letter) in AXES.iter().enumerate() {
            curves.push(Curve {
                of: format!("accelerometer {letter}"),
                measure: "m/s²".to_owned(),
                run: name.clone(),
                sample,
                window_s: 0.0,
                time_s: Arc::clone(&time_s),
                temperature_deg_c: own.iter().map(|judgement| judgement.deg_c).collect(),
                before: own.iter().map(|judgement| judgement.error[0][axis]).collect(),
                after: own.iter().map(|judgement| judgement.error[1][axis]).collect(),
            });
        }
    }
    curves
}

/// |f| − g before and after (m/s²).
pub fn lengths(judged: &[Judgement]) -> [Vec<f64>; 2] {
    [0, 1].map(|which| judged.iter().map(|judgement| judgement.length[which]).collect())
}
