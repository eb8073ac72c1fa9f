//! Settings of other crates, key for key.

use std::path::PathBuf;
use std::time::Duration;

use isotherm_bus::SessionOptions;
use isotherm_correction::earth::Place;
use isotherm_correction::navigation::{MAX_STEP_TICKS, NavigationStep};
use isotherm_correction::prelaunch::{PreLaunchLimits, PreLaunchSettings};
use isotherm_correction::rest::RestLimits;
use isotherm_correction::unit::{Uncalibrated, UnitSettings};
use isotherm_correction::units::Span;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::units::{As, DegPerH, DriftEstimate, Endpoints, Form, InitialState, Ms, PathText, Seconds, form};

/// A key that is left out means what it means in the other crate.
macro_rules! defaults {
    ($keys:ident of $settings:ident: $($field:ident),+) => {
        impl Default for $keys {
            fn default() -> Self {
                let $settings { $($field,)+ .. } = $settings::default();
                Self { $($field),+ }
            }
        }
    };
}

defaults!(UnitKeys of UnitSettings: in_standby, subtract_drift, reference_delay, uncalibrated, pairing_window, temperature_delay, navigation);
defaults!(PreLaunchKeys of PreLaunchSettings: duration, place, limits);
defaults!(LimitsKeys of PreLaunchLimits: static_bias_change_rad_per_s, magnetic_bias_change_rad_per_s, mode_imbalance, time_per_mode, good_share, rest);
defaults!(SessionKeys of SessionOptions: config, connect, listen, namespace, lease, keeps_trying);

/// Keys of every unit's state machine.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "UnitSettings", default)]
pub(super) struct UnitKeys {
    /// State that a unit starts in.
    #[serde(rename = "initial_state", with = "As::<InitialState>")]
    #[schemars(with = "InitialState")]
    in_standby: bool,
    /// What is done with the drift estimate.
    #[serde(rename = "drift_estimate", with = "As::<DriftEstimate>")]
    #[schemars(with = "DriftEstimate")]
    subtract_drift: bool,
    /// How long a rate reference is waited for.
    #[serde(rename = "reference_delay_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(max = 60_000))]
    reference_delay: Span,
    /// What happens to ticks of units without a calibration.
    #[serde(with = "UncalibratedKey")]
    #[schemars(with = "UncalibratedKey")]
    uncalibrated: Uncalibrated,
    /// How long a gyro tick waits for its accelerometer tick.
    #[serde(rename = "pairing_window_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(min = 1, max = 10_000))]
    pairing_window: Span,
    /// How much later than its time a temperature reading takes effect.
    #[serde(rename = "temperature_delay_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(max = 10_000))]
    temperature_delay: Span,
    /// Navigation steps.
    #[serde(with = "As::<NavigationKeys>")]
    #[schemars(with = "NavigationKeys")]
    navigation: NavigationStep,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Uncalibrated", rename_all = "kebab-case")]
#[schemars(inline)]
enum UncalibratedKey {
    PassThrough,
    Hold,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
struct NavigationKeys {
    /// Ticks in a navigation step.
    #[schemars(range(min = 1, max = MAX_STEP_TICKS))]
    ticks: u16,
    /// Whether coning and sculling are compensated.
    coning_sculling: bool,
}

impl Default for NavigationKeys {
    fn default() -> Self {
        Self::write(&NavigationStep::default())
    }
}

form!(NavigationKeys, NavigationStep => Self,
    |step| Self { ticks: step.ticks(), coning_sculling: step.coning_sculling() },
    |keys| NavigationStep::new(keys.ticks, keys.coning_sculling).unwrap_or_default());

/// Keys of pre-launch calibrations.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "PreLaunchSettings", default)]
#[schemars(deny_unknown_fields)]
pub(super) struct PreLaunchKeys {
    /// How long it lasts.
    #[serde(rename = "duration_s", with = "As::<Seconds>")]
    #[schemars(with = "f64", range(min = 60.0, max = 7200.0))]
    duration: Span,
    #[serde(skip)]
    place: Option<Place>,
    #[serde(flatten, with = "LimitsKeys")]
    #[schemars(with = "LimitsKeys")]
    limits: PreLaunchLimits,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "PreLaunchLimits", default)]
struct LimitsKeys {
    /// Greatest change of the static bias that is accepted.
    #[serde(rename = "max_static_change_deg_per_h", with = "As::<DegPerH>")]
    #[schemars(with = "f64", range(min = 1e-6, max = 1e6))]
    static_bias_change_rad_per_s: f64,
    /// Greatest change of the magnetic bias that is accepted.
    #[serde(rename = "max_magnetic_change_deg_per_h", with = "As::<DegPerH>")]
    #[schemars(with = "f64", range(min = 1e-6, max = 1e6))]
    magnetic_bias_change_rad_per_s: f64,
    /// Greatest difference of the times in the two modes, as a share of both.
    #[serde(rename = "max_imbalance")]
    #[schemars(range(min = 0.0, max = 1.0))]
    mode_imbalance: f64,
    /// Shortest time in each mode.
    #[serde(rename = "min_time_per_mode_s", with = "As::<Seconds>")]
    #[schemars(with = "f64", range(min = 30.0, max = 7200.0))]
    time_per_mode: Span,
    /// Smallest share of good ticks.
    #[serde(rename = "min_good_share")]
    #[schemars(range(min = 0.0, max = 1.0))]
    good_share: f64,
    #[serde(skip)]
    rest: RestLimits,
}

/// Keys of the Zenoh session.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "SessionOptions", default)]
pub(super) struct SessionKeys {
    /// A Zenoh configuration file.
    #[serde(with = "As::<PathText>")]
    #[schemars(with = "Option<String>", length(min = 1))]
    config: Option<PathBuf>,
    /// Endpoints to connect to.
    #[serde(with = "As::<Endpoints>", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<String>")]
    connect: Vec<String>,
    /// Endpoints to listen on.
    #[serde(with = "As::<Endpoints>", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<String>")]
    listen: Vec<String>,
    /// Prefix of every key.
    #[schemars(length(min = 1))]
    namespace: Option<String>,
    #[serde(skip)]
    lease: Option<Duration>,
    #[serde(skip)]
    keeps_trying: bool,
}
