//! The coefficient set of one unit: plain parts in, immutable and validated [`Calibration`] out.
//!
//! Everything that can be worked out once (nested polynomials, spline coefficients, normalised rows, lag decay
//! factors) is worked out here, so that the running state ([`crate::unit::Unit`]) holds memory only and a swap
//! replaces one pointer.
//!
//! Directions, stated once: a gyro's **increment weight** multiplies (rad per count), an accelerometer's
//! **scale factor** divides (output per m/s²), a **bias** is subtracted.

mod check;
mod parts;
mod range;
mod steady;
#[cfg(test)]
#[expect(clippy::float_cmp, reason = "what is not there is zero to the bit")]
mod tests;

use alloc::boxed::Box;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

pub use check::MAX_SELF_TEST_READINGS;
pub use parts::{
    AccelParts, BranchArgument, BranchedParts, CalibrationParts, CoefficientParts, EVERYWHERE_DEG_C,
    GyroParts, NO_LIMIT, RegressorParts, Source, TermParts, TrendParts,
};
pub use steady::{Jump, Steady};

pub use crate::defect::{Defect, DefectKind};

use crate::channel::{Channel, ThermalFilter};
use crate::drift::DriftModel;
use crate::lanes::Lanes;
use crate::operation::SelfTestParts;
use crate::orientation::Orientation;
use crate::reversal::Reversal;
use crate::sample::{ChannelName, OutputKind};
use crate::sigma::SigmaModel;
use crate::thermal::{AccelModel, GyroModel, Motion, MotionTerms, Trends};

/// A validated coefficient set; immutable, shared by pointer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    pub(crate) filter: ThermalFilter,
    /// Temperatures, then auxiliaries.
    pub(crate) channels: Vec<Channel>,
    /// How many of them are temperatures.
    pub(crate) temperatures: usize,
    /// Whether a sensor has regressors.
    pub(crate) regresses: bool,
    pub(crate) gyro_output: OutputKind,
    pub(crate) gyros: Vec<GyroModel>,
    /// One for each gyro. Apart from the models: what an estimator expects changes nothing of the correction, and a
    /// swap that changes it alone must not disturb what follows temperature.
    drifts: Vec<Option<DriftModel>>,
    pub(crate) gyro_orientation: Orientation,
    pub(crate) gyro_orientation_channels: Vec<usize>,
    pub(crate) accel_output: OutputKind,
    pub(crate) accels: Vec<AccelModel>,
    pub(crate) accel_orientation: Option<Orientation>,
    pub(crate) accel_orientation_channels: Vec<usize>,
    pub(crate) reversal: Option<Reversal>,
    self_test: SelfTestParts,
    /// Input limits, a lane for each sensor; infinite where there is none, so that what is not read is never beyond.
    pub(crate) gyro_limits: Lanes,
    pub(crate) accel_limits: Lanes,
    /// `None` where nothing follows the unit's motion.
    pub(crate) motion: Option<Box<Motion>>,
    /// `None` where no gyro has a trend.
    pub(crate) trends: Option<Box<Trends>>,
    /// `None` where σ of the outputs is not asked for.
    pub(crate) sigma: Option<Box<SigmaModel>>,
    /// The longest time that a gyro's perimeter servo takes to settle (s); `None` where no gyro has one.
    pub(crate) servos_settle_s: Option<f64>,
}

impl Calibration {
    /// Validates and compiles the parts.
    ///
    /// # Errors
    /// Every [`Defect`] of the set, in the order of its sections; nothing is compiled unless there is none.
    pub fn new(parts: &CalibrationParts) -> Result<Self, Vec<Defect>> {
        check::compile(parts)
    }

    /// Number of gyros, 3…8.
    #[must_use]
    pub fn gyro_count(&self) -> usize {
        self.gyros.len()
    }

    /// Number of accelerometers, 3…8, or 0 for a unit of gyros only.
    #[must_use]
    pub fn accel_count(&self) -> usize {
        self.accels.len()
    }

    /// What the gyros' raw readings stand for.
    #[must_use]
    pub fn gyro_output(&self) -> OutputKind {
        self.gyro_output
    }

    /// What the accelerometers' raw readings stand for.
    #[must_use]
    pub fn accel_output(&self) -> OutputKind {
        self.accel_output
    }

    /// What one count of each gyro is worth (rad); zero where the readings are no counts.
    pub(crate) fn count_rad(&self) -> impl Iterator<Item = f64> {
        let counts = self.gyro_output == OutputKind::Counts;
        self.gyros.iter().map(move |gyro| if counts { gyro.increment_weight.abs() } else { 0.0 })
    }

    /// What one count of each accelerometer is worth at the assumed temperature (m/s); likewise.
    pub(crate) fn count_m_per_s(&self) -> impl Iterator<Item = f64> {
        let (counts, deg_c) = (self.accel_output == OutputKind::Counts, self.filter.assumed_deg_c);
        let size = move |accel: &AccelModel| 1.0 / accel.scale_factor.at(deg_c).value.abs();
        self.accels.iter().map(move |accel| if counts { size(accel) } else { 0.0 })
    }

    /// Whether another set filters the same channels in the same way, so that thermal memory means the same in both.
    pub(crate) fn same_thermal_basis(&self, other: &Self) -> bool {
        self.filter == other.filter
            && self.channels == other.channels
            && self.temperatures == other.temperatures
    }

    /// Everything that makes the bias of a gyro: what follows its temperature, and what follows motion, if anything does.
    pub(crate) fn terms_of_gyro(&self, gyro: usize) -> (Option<&GyroModel>, Option<&MotionTerms>) {
        let in_motion = self.motion.as_deref().and_then(|motion| motion.gyros.get(gyro));
        (self.gyros.get(gyro), in_motion.filter(|terms| !terms.is_empty()))
    }

    /// What the drift estimator is to expect of a gyro; `None` where the set says nothing, or there is no such gyro.
    #[must_use]
    pub fn drift(&self, gyro: usize) -> Option<&DriftModel> {
        self.drifts.get(gyro)?.as_ref()
    }

    /// What the producer's own voltages and counters must be in a self-test.
    #[must_use]
    pub fn self_test(&self) -> &SelfTestParts {
        &self.self_test
    }

    /// The temperature channels that the set follows, in its own order.
    #[must_use]
    pub fn channels(&self) -> &[Channel] {
        self.channels.get(..self.temperatures).unwrap_or_default()
    }

    /// The channel of a name, of either kind.
    #[must_use]
    pub fn channel(&self, name: &ChannelName) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.name() == name)
    }

    /// Place, among those of the set before this one, of the channel whose memory a channel of this set goes on with: one of the
    /// same definition, filtered in the same way. `None` where there is none, and the channel starts anew.
    #[must_use]
    pub fn goes_on_from(&self, before: &Self, channel: &Channel) -> Option<usize> {
        let is_same = |other: &Channel| before.filter == self.filter && other == channel;
        before.channels.iter().position(is_same)
    }

    /// Place of a channel among all.
    pub(crate) fn place(&self, source: Source) -> usize {
        match source {
            Source::Temperature(index) => index,
            Source::Auxiliary(index) => self.temperatures + index,
        }
    }
}
