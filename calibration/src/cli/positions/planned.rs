//! What is planned: the options of `isotherm-calibrate positions --budget`.

use clap::Args;

use crate::positions::budget::Budget;

/// A calibration that is planned; the defaults are the example of 004.
#[derive(Debug, Args)]
pub(super) struct PlannedArgs {
    /// Planned: white noise of an accelerometer (V²·s)
    #[arg(long, value_name = "Q", default_value_t = 3e-9, requires = "budget")]
    pub(super) noise: f64,
    /// Planned: time in each position (s)
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, requires = "budget")]
    pub(super) seconds: f64,
    /// Planned: output of an accelerometer at 1 g (V)
    #[arg(long, value_name = "V", default_value_t = 1.0, requires = "budget")]
    pub(super) scale: f64,
    /// Planned: thermal expansion of housing and sensor (1e-6/°C)
    #[arg(long, value_name = "PPM", num_args = 2, default_values_t = [22.9, 15.0], requires = "budget")]
    pub(super) expansion: Vec<f64>,
    /// Planned: calibration temperature and highest temperature inside (°C)
    #[arg(long, value_name = "DEG_C", num_args = 2, default_values_t = [20.0, 85.0], requires = "budget", allow_hyphen_values = true)]
    pub(super) temperatures: Vec<f64>,
    /// Planned: error of the measured temperature (°C)
    #[arg(long, value_name = "DEG_C", default_value_t = 0.2, requires = "budget")]
    pub(super) temperature_error: f64,
    /// Planned: turn of an axis with temperature (″/°C); quartz 1.5, silicon up to 6
    #[arg(long, value_name = "ARCSEC", default_value_t = 1.5, requires = "budget")]
    pub(super) axis_rate: f64,
    /// Planned: hysteresis of an axis over thermal cycles (″); quartz 5 to 15, silicon 15 to 60, or as measured
    #[arg(long, value_name = "ARCSEC", default_value_t = 5.0, requires = "budget")]
    pub(super) hysteresis: f64,
}

impl PlannedArgs {
    /// The budget, with positioning and run-out of the stand (″).
    pub(super) fn budget(&self, positioning_arcsec: f64, run_out_arcsec: f64) -> Budget {
        let pair =
            |values: &[f64]| [values.first().copied().unwrap_or(0.0), values.get(1).copied().unwrap_or(0.0)];
        Budget {
            positioning_arcsec,
            run_out_arcsec,
            noise: self.noise,
            seconds: self.seconds,
            scale_per_g: self.scale,
            expansion_ppm_per_deg_c: pair(&self.expansion),
            temperature_deg_c: pair(&self.temperatures),
            temperature_error_deg_c: self.temperature_error,
            axis_arcsec_per_deg_c: self.axis_rate,
            hysteresis_arcsec: self.hysteresis,
        }
    }
}
