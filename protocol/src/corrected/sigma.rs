//! Standard errors of corrected ticks, said once for each run of ticks that have the same.

use isotherm_correction::sample::CorrectedTick;
use isotherm_correction::sigma::{Causes, Sigma};
use serde::{Deserialize, Serialize};

use crate::codec::{MAX_NUMBER, append as part};

/// Standard errors of the increments from one tick of a batch up to the next run's, by cause; NaN where unknown.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct SigmaRun {
    /// Index in the batch of the first tick.
    pub from_tick: u16,
    /// Of the angle increments, by noise of the sensors (rad).
    pub angle_noise_rad: [f64; 3],
    /// By interpolation and restoration over mode switches.
    pub angle_restoration_rad: [f64; 3],
    /// By the calibration.
    pub angle_calibration_rad: [f64; 3],
    /// By temperatures outside the fitted range.
    pub angle_clamping_rad: [f64; 3],
    /// Of the velocity increments, likewise (m/s).
    pub velocity_noise_m_per_s: [f64; 3],
    /// By restoration: zero.
    pub velocity_restoration_m_per_s: [f64; 3],
    /// By the calibration.
    pub velocity_calibration_m_per_s: [f64; 3],
    /// By temperatures outside the fitted range.
    pub velocity_clamping_m_per_s: [f64; 3],
}

/// Equal to the bit: what is unknown is the same as what is unknown.
impl PartialEq for SigmaRun {
    fn eq(&self, other: &Self) -> bool {
        self.from_tick == other.from_tick && bits(&self.sigma()) == bits(&other.sigma())
    }
}

fn bits(sigma: &Sigma) -> [[[u64; 3]; 4]; 2] {
    [sigma.angle, sigma.velocity].map(|causes| causes.all().map(|cause| cause.map(f64::to_bits)))
}

impl SigmaRun {
    /// Those of a tick, from it on.
    #[must_use]
    pub fn new(from_tick: u16, Sigma { angle, velocity }: &Sigma) -> Self {
        Self {
            from_tick,
            angle_noise_rad: angle.noise,
            angle_restoration_rad: angle.restoration,
            angle_calibration_rad: angle.calibration,
            angle_clamping_rad: angle.clamping,
            velocity_noise_m_per_s: velocity.noise,
            velocity_restoration_m_per_s: velocity.restoration,
            velocity_calibration_m_per_s: velocity.calibration,
            velocity_clamping_m_per_s: velocity.clamping,
        }
    }

    /// As the core has them.
    #[must_use]
    pub const fn sigma(&self) -> Sigma {
        Sigma {
            angle: Causes {
                noise: self.angle_noise_rad,
                restoration: self.angle_restoration_rad,
                calibration: self.angle_calibration_rad,
                clamping: self.angle_clamping_rad,
            },
            velocity: Causes {
                noise: self.velocity_noise_m_per_s,
                restoration: self.velocity_restoration_m_per_s,
                calibration: self.velocity_calibration_m_per_s,
                clamping: self.velocity_clamping_m_per_s,
            },
        }
    }

    /// Runs of ticks.
    #[must_use]
    pub fn of<'t>(ticks: impl IntoIterator<Item = &'t CorrectedTick>) -> Vec<Self> {
        let mut runs = Vec::new();
        for (index, tick) in ticks.into_iter().enumerate() {
            if let Some(sigma) = tick.sigma.as_deref() {
                Self::push(&mut runs, index, sigma);
            }
        }
        runs
    }

    /// Those of one tick more, the one of this index.
    pub(crate) fn push(runs: &mut Vec<Self>, index: usize, sigma: &Sigma) {
        if runs.last().is_none_or(|last| bits(&last.sigma()) != bits(sigma)) {
            runs.push(Self::new(u16::try_from(index).unwrap_or(u16::MAX), sigma));
        }
    }
}

/// Longest form of a run, in bytes.
pub(crate) const MAX_RUN: usize = MAX_NUMBER + 24 * size_of::<f64>();
// It is written in one part.
const _: () = assert!(MAX_RUN <= 255);

/// Gives each tick its own: those of the last run that begins at it or before, in the order of the frame, whatever that is.
pub(crate) fn spread(runs: &[SigmaRun], ticks: &mut [CorrectedTick]) {
    let mut begins = vec![None; ticks.len()];
    for (place, run) in runs.iter().enumerate() {
        if let Some(begin) = begins.get_mut(usize::from(run.from_tick)) {
            *begin = Some((place, run));
        }
    }
    let mut current: Option<(usize, &SigmaRun)> = None;
    for (tick, begin) in ticks.iter_mut().zip(begins) {
        current = begin.filter(|(place, _)| current.is_none_or(|(before, _)| before < *place)).or(current);
        tick.sigma = current.map(|(_, run)| Box::new(run.sigma()));
    }
}

/// Appends the section of a frame that has them; nothing without, where no series says that the section is there.
pub(crate) fn append(frame: &mut Vec<u8>, series: u64, runs: &[SigmaRun]) {
    if series == 0 && runs.is_empty() {
        return;
    }
    part(frame, |to| to.length(runs.len()));
    for run in runs {
        part(frame, |to| {
            to.u64(run.from_tick.into());
            let Sigma { angle, velocity } = run.sigma();
            angle.all().iter().chain(&velocity.all()).for_each(|cause| to.f64s(cause));
        });
    }
}
