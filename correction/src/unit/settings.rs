//! What a unit is told beside its calibration.

use serde::{Deserialize, Serialize};

use crate::navigation::NavigationStep;
use crate::units::Span;

/// What a unit does without a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Uncalibrated {
    /// The first three raw gyro and accelerometer readings go out as they are, unscaled and flagged: neither radians
    /// nor metres per second.
    PassThrough,
    /// Nothing goes out; the ticks are announced as missing once a calibration is there.
    Hold,
}

/// Settings of a unit that are not part of its calibration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UnitSettings {
    /// How long, in event time, a gyro tick waits for its accelerometer tick or a missing neighbour.
    pub pairing_window: Span,
    /// A temperature reading takes effect for ticks that end after its time plus this.
    pub temperature_delay: Span,
    /// What to do without a calibration.
    pub uncalibrated: Uncalibrated,
    /// Whether the unit begins in standby; otherwise it runs at once.
    pub in_standby: bool,
    /// Whether the estimated drift is subtracted; it is published in any case.
    pub subtract_drift: bool,
    /// A reference takes effect for ticks that end after its end plus this.
    pub reference_delay: Span,
    /// Summation of ticks to navigation steps.
    pub navigation: NavigationStep,
}

impl Default for UnitSettings {
    fn default() -> Self {
        Self {
            pairing_window: Span::from_ms(50),
            temperature_delay: Span::from_ms(50),
            uncalibrated: Uncalibrated::PassThrough,
            in_standby: false,
            subtract_drift: false,
            reference_delay: Span::from_ms(1000),
            navigation: NavigationStep::default(),
        }
    }
}
