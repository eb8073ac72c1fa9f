//! What the ticks to come need beyond scale, bias and axes, as long as nothing changes.

use bitflags::bitflags;

use super::Corrector;
use super::motion::ASYMMETRY;
use crate::calibration::Calibration;
use crate::thermal::{Motion, MotionBanks};

bitflags! {
    /// What a tick needs, found once for all ticks that nothing changes between; asked several at a time.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    pub(super) struct Needs: u16 {
        /// More than four lanes.
        const WIDE = 1;
        /// Terms of the gyros that change their sign with the mode.
        const MODAL = 1 << 1;
        /// Terms of the gyros that the bank does not give, or a switch of the mode that is given up.
        const SPECIAL = 1 << 2;
        /// The estimator of the gyros' drift.
        const DRIFTS = 1 << 3;
        /// Drift of gyros with the specific force.
        const FORCE = 1 << 4;
        /// Weights of gyros over their rate.
        const CURVES = 1 << 5;
        /// Any weights of gyros that are not the same at every rate.
        const RATES = 1 << 6;
        /// Second-order terms of accelerometers.
        const SQUARES = 1 << 7;
        /// Accelerometers away from the reference point.
        const POSITIONS = 1 << 8;
        /// Sensors that lag less than another, or of which something is still held back.
        const DELAYS = 1 << 9;
        /// Switches of the mode, or special terms.
        const SWITCHES = 1 << 10;
    }
}

impl Corrector {
    /// What the next ticks need, under a calibration or on the way from the one before it.
    pub(super) fn needs(&self, calibration: &Calibration) -> Needs {
        let slews = self.slew.is_some();
        let given_up = calibration.reversal.is_none() && !self.substitution.is_settled();
        let old = self.slew_from_motion().map(|old| &old.motion);
        let any = |has: fn(&Motion) -> bool| calibration.motion.as_deref().into_iter().chain(old).any(has);
        let is_asymmetric = |banks: &MotionBanks| banks.gyros.has_any([ASYMMETRY; 2]);
        let curves = any(Motion::has_curves);
        let special = slews || given_up || calibration.trends.is_some() || self.drift.subtracts();
        [
            (Needs::WIDE, calibration.gyros.len().max(calibration.accels.len()) > 4),
            (Needs::MODAL, slews || self.thermal.gyros.has_any([2, 3])),
            (Needs::SPECIAL, special),
            (Needs::DRIFTS, !self.drift.is_idle()),
            (Needs::FORCE, any(|motion| motion.feels_force)),
            (Needs::CURVES, curves),
            (
                Needs::RATES,
                curves || old.is_some() || self.thermal.motion.as_deref().is_some_and(is_asymmetric),
            ),
            (Needs::SQUARES, any(|motion| !motion.accels.is_empty())),
            (Needs::POSITIONS, any(|motion| motion.has_positions)),
            (Needs::DELAYS, any(|motion| motion.holds_back) || self.motion.held.is_some()),
            (Needs::SWITCHES, special || calibration.reversal.is_some()),
        ]
        .into_iter()
        .filter_map(|(need, there)| there.then_some(need))
        .collect()
    }
}
