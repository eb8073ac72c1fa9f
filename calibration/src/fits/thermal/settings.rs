//! What may be asked of a thermal fit.

use clap::{Args, ValueEnum};

use super::stand::{Site, Stand};
use crate::limits::within;

/// Method of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Plateaus, then rate, then acceleration of temperature (paper 000)
    Sequential,
    /// Plateaus, then the rate alone
    Rate,
    /// All terms at once, shrunk by cross-validation
    #[value(alias = "lag")]
    Joint,
}

impl Method {
    /// Its name, in documents and reports.
    pub const fn name(self) -> &'static str {
        ["sequential", "rate", "joint"][self as usize]
    }

    /// Whether static bias and what follows the change are found one after the other.
    pub const fn is_stepwise(self) -> bool {
        matches!(self, Self::Sequential | Self::Rate)
    }
}

/// Who chooses the terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Terms {
    /// Cross-validation across thermal branches
    Auto,
    /// The largest model
    All,
}

/// All of it.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct Settings {
    /// Method of the fit
    #[arg(long, value_enum, default_value_t = Method::Joint)]
    pub method: Method,
    /// Choice of terms: cross-validation, or the largest model
    #[arg(long, value_enum, default_value_t = Terms::Auto)]
    pub terms: Terms,
    /// How the unit stands: none where nothing is known, one for all runs, or one for each run of the fit and then for each that judges.
    #[arg(skip)]
    pub stands: Vec<Stand>,
    /// Length of the windows of the fit (s)
    #[arg(long = "fit-window", hide_short_help = true, value_name = "SECONDS", default_value_t = 10.0, value_parser = within(1.0, 600.0))]
    pub fit_window_s: f64,
    /// Windows of the stated residuals (s) (default: those of the fit, up to ten of them in runs of hours)
    #[arg(long = "window", hide_short_help = true, value_name = "SECONDS", value_parser = within(1.0, 3600.0))]
    pub window_s: Option<f64>,
    /// Smoothing of the temperature (s) (default: by cross-validation)
    #[arg(long = "smoothing", hide_short_help = true, value_name = "SECONDS", value_parser = within(0.0, 3600.0))]
    pub smoothing_s: Option<f64>,
}

impl Settings {
    /// How the unit stands in a run: those of the fit are counted first, then those that judge.
    pub fn stand(&self, run: usize) -> Stand {
        let stand = if self.stands.len() == 1 { self.stands.first() } else { self.stands.get(run) };
        stand.copied().unwrap_or_default()
    }

    /// Whether the mean of some run is taken off because its attitude is not known.
    pub fn removes_mean(&self) -> bool {
        self.stands.is_empty() || self.stands.iter().any(|stand| stand.site == Site::Unknown)
    }
}
