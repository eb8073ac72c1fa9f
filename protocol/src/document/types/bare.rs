//! Parts of a document with nothing in them: what documents that are made begin with.

use super::{AccelSensor, GyroSensor, Orientation};
use crate::document::{Curve, ScaleFactor};

impl GyroSensor {
    /// A gyro without any term, channel or increment weight.
    #[must_use]
    pub fn bare(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            channel: None,
            increment_weight_arcsec_per_count: None,
            increment_weight_rad_per_rad: None,
            input_limit_counts_per_tick: None,
            input_limit_deg_per_s: None,
            increment_weight_error: None,
            static_bias: None,
            magnetic_bias: None,
            slow_meander: None,
            thermal_rate: None,
            thermal_acceleration: None,
            lag: Vec::new(),
            hysteresis: Vec::new(),
            regressor: Vec::new(),
            acceleration_sensitive_drift: None,
            increment_weight_asymmetry: None,
            increment_weight_over_rate: None,
            trend: None,
            delay_ticks: None,
            servo: None,
            drift: None,
            sigma: None,
        }
    }
}

impl AccelSensor {
    /// An accelerometer with a scale factor and nothing else.
    #[must_use]
    pub fn bare(name: &str, scale_factor: Curve<ScaleFactor>) -> Self {
        Self {
            name: name.to_owned(),
            channel: None,
            board_channel: None,
            input_limit_counts_per_tick: None,
            input_limit_v: None,
            input_limit_m_per_s2: None,
            scale_factor,
            bias: None,
            lag: Vec::new(),
            hysteresis: Vec::new(),
            regressor: Vec::new(),
            second_order: None,
            position_m: None,
            delay_ticks: None,
            board_ratio_error: None,
            sigma: None,
        }
    }
}

impl<P> Orientation<P> {
    /// Three sensors along the case axes.
    #[must_use]
    pub fn along_case_axes() -> Self {
        Self {
            rows: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            weights: None,
            thermal: None,
            parity: None,
        }
    }
}
