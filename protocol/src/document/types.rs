//! The document as types: field for field what stands in the file, in the file's units.
//!
//! The doc comments below are also the descriptions in `config/calibration.schema.json` and in
//! `docs/calibration-document.md`; "Source:" names the paper or section that the term comes from.

mod accel;
mod bare;
mod drift;
mod gyro;
mod origin;
mod self_test;
mod sigma;

pub use accel::{Accel, AccelOrientation, AccelOutput, AccelParity, AccelSensor};
pub use drift::Drift;
pub use gyro::{Gyro, GyroOrientation, GyroOutput, GyroParity, GyroSensor, Servo, ServoKind, Trend};
pub use origin::{Created, Log, Measure, Origin, Residual, Sample};
pub use self_test::{SelfTest, SelfTestCounter, SelfTestVoltage};
pub use sigma::{AccelBiasSigma, AccelSigma, GyroBiasSigma, GyroSigma};

use isotherm_correction::reversal::{ReversalParts, Transition};
use isotherm_correction::units::Span;
use isotherm_document::{element, join};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::terms::KeyedTerm;

/// The calibration of one unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Isotherm calibration document")]
pub struct Document {
    /// Version of the document's schema.
    #[schemars(range(min = super::MIN_SCHEMA, max = super::CURRENT_SCHEMA))]
    pub schema: u32,
    /// Serial: 1 to 64 letters, digits, '.', '_' or '-'.
    #[schemars(
        regex(pattern = "^[A-Za-z0-9._-]{1,64}$"),
        extend("x-must-be" = "1 to 64 letters A-Z a-z, digits, '.', '_' or '-'")
    )]
    pub unit: String,
    /// Date, or date and time with offset, unquoted.
    pub created: Option<Created>,
    /// Free text for readers.
    pub note: Option<String>,
    /// Where the numbers come from; not used by the correction. Source: models §8.
    pub origin: Option<Origin>,
    /// Temperature channels and their filter.
    pub temperature: Temperature,
    /// Channels other than temperatures, for `regressor`. Source: models §2.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 16))]
    pub auxiliary: Vec<Auxiliary>,
    /// Gyros.
    pub gyro: Gyro,
    /// Accelerometers, if the unit has any.
    pub accel: Option<Accel>,
    /// Substitution over mode switches. Source: models §5, 003.
    pub mode_reversal: Option<ModeReversal>,
    /// Self-test limits of voltages and counters on `imu/{unit}/raw/health`. Source: models §7.
    pub self_test: Option<SelfTest>,
}

/// What gyros and accelerometers have in common.
#[derive(Debug)]
pub(super) struct Sensor<'d> {
    /// Path of its table.
    pub(super) path: String,
    pub(super) name: &'d str,
    pub(super) channel: Option<&'d str>,
    pub(super) board: Option<&'d str>,
    pub(super) terms: Vec<KeyedTerm<'d>>,
}

impl Document {
    /// All sensors, gyros first.
    pub(super) fn sensors(&self) -> Vec<Sensor<'_>> {
        let gyros = self.gyro.sensor.iter().enumerate().map(|(i, sensor)| {
            let path = element("gyro.sensor", i);
            let (name, channel) = (sensor.name.as_str(), sensor.channel.as_deref());
            Sensor { name, channel, board: None, terms: sensor.terms.keyed(&path), path }
        });
        let accels = self.accel.iter().flat_map(|accel| &accel.sensor).enumerate().map(|(i, sensor)| {
            let path = element("accel.sensor", i);
            let (name, channel) = (sensor.name.as_str(), sensor.channel.as_deref());
            let board = sensor.board_channel.as_deref();
            Sensor { name, channel, board, terms: sensor.terms.keyed(&path), path }
        });
        gyros.chain(accels).collect()
    }

    /// Whatever names a channel: its path, the name, and whether that may be of an auxiliary channel.
    pub(super) fn channels_named(&self) -> Vec<(String, &str, bool)> {
        let mut named = Vec::new();
        for sensor in self.sensors() {
            let mut name = |path: &str, key, name: Option<_>, any| {
                named.extend(name.map(|name| (join(path, key), name, any)));
            };
            name(&sensor.path, "channel", sensor.channel, false);
            name(&sensor.path, "board_channel", sensor.board, false);
            for term in sensor.terms {
                let Some(regressor) = &term.stated.regressor else { continue };
                name(&term.path, "channel", Some(&regressor.channel), true);
                name(&term.path, "minus", regressor.minus.as_deref(), true);
            }
        }
        let accel = self.accel.as_ref().and_then(|accel| accel.orientation.thermal.as_ref());
        for (kind, thermal) in [("gyro", self.gyro.orientation.thermal.as_ref()), ("accel", accel)] {
            let path = format!("{kind}.orientation.thermal.channels");
            let channels = thermal.into_iter().flat_map(|thermal| &thermal.channels).enumerate();
            named.extend(channels.map(|(i, name)| (element(&path, i), name.as_str(), false)));
        }
        named
    }
}

/// Temperature channels and the filter that all of them use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Temperature")]
pub struct Temperature {
    /// Assumed before a channel's first reading, and without a channel.
    #[schemars(range(min = -273.15, max = 1000.0))]
    pub assumed_deg_c: f64,
    /// Filter of all channels; required with channels. Part of the fit: coefficients need the same filter.
    pub filter: Option<Filter>,
    /// Channels, which sensors follow by name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 32))]
    pub channel: Vec<Channel>,
}

/// Filter of all temperature channels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Temperature filter")]
pub struct Filter {
    /// Grid step on which temperature is evaluated. Source: models §1.
    #[schemars(range(min = 0.001, max = 3600.0))]
    pub grid_step_s: f64,
    /// Causal moving average, up to 4096 grid steps; 0 for none. Source: models §1.
    #[schemars(range(min = 0.0, max = 14_745_600.0))]
    pub smoothing_s: f64,
    /// h of the backward differences, up to 4096 grid steps. Source: 000 eq. 2.
    #[schemars(range(min = 0.0, max = 14_745_600.0))]
    pub derivative_step_s: f64,
    /// Age at which a temperature is stale, 1 to 10⁴ grid steps.
    #[schemars(range(min = 0.001, max = 3.6e7))]
    pub stale_after_s: f64,
    /// Half width, in Ṫ·T̈, of the blend between run-up and braking; required with `thermal_rate` or
    /// `thermal_acceleration`. Source: models §2, 000.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub branch_dead_band_deg_c2_per_s3: Option<f64>,
}

/// One temperature channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Temperature channel")]
pub struct Channel {
    /// Name on the raw temperature topic, 1 to 24 bytes.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// a₀, a₁, … of T = Σ aⱼ·Uʲ, U the raw reading (V, counts or °C). Source: models §1, 003.
    #[serde(default = "Channel::identity")]
    #[schemars(length(min = 1, max = 8))]
    pub conversion_deg_c: Vec<f64>,
    /// Physical range; readings outside are rejected.
    #[schemars(inner(range(min = -273.15, max = 1000.0)), extend("x-rising" = true))]
    pub range_deg_c: [f64; 2],
    /// Largest distance from the median of five readings; others are rejected.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub spike_limit_deg_c: f64,
}

/// One auxiliary channel: supply voltage, pressure or the like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Auxiliary channel")]
pub struct Auxiliary {
    /// Name on the raw temperature topic.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Unit of measure.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a unit of 1 to 24 bytes"))]
    pub unit: String,
    /// As `conversion_deg_c`.
    #[serde(default = "Channel::identity")]
    #[schemars(length(min = 1, max = 8))]
    pub conversion: Vec<f64>,
    /// Physical range.
    #[schemars(extend("x-rising" = true))]
    pub range: [f64; 2],
    /// As `spike_limit_deg_c`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub spike_limit: f64,
}

impl Channel {
    /// The conversion of a channel whose readings are in its unit already.
    pub(super) fn identity() -> Vec<f64> {
        vec![0.0, 1.0]
    }
}

/// Input axes in case axes: `s = C(T)·v`, with `C(T) = C0 + C1·(T − T_ref)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Orientation<P> {
    /// C0: a unit vector per sensor, norm 1 within 10⁻³. Source: models §4, 004.
    #[schemars(length(min = 3, max = 8))]
    pub rows: Vec<[f64; 3]>,
    /// Weights in the pseudo-inverse, > 0, proportional to 1/σ²; default: equal. Source: models §4.
    #[schemars(length(min = 3, max = 8), extend("items" = { "type": "number", "exclusiveMinimum": 0 }))]
    pub weights: Option<Vec<f64>>,
    /// Change with temperature.
    pub thermal: Option<OrientationThermal>,
    /// Detection and exclusion of a failed sensor. Source: models §4.
    pub parity: Option<P>,
}

/// How the input axes turn with temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Thermal slopes of an orientation")]
pub struct OrientationThermal {
    /// Channels whose mean is T.
    #[schemars(length(min = 1, max = 8))]
    pub channels: Vec<String>,
    /// `T_ref`.
    #[schemars(range(min = -273.15, max = 1000.0))]
    pub reference_deg_c: f64,
    /// Fitted range; T is clamped to it.
    #[schemars(inner(range(min = -273.15, max = 1000.0)), extend("x-rising" = true))]
    pub range_deg_c: [f64; 2],
    /// C1: change of each row (direction cosines; 1 is 206265″). Source: 004.
    #[schemars(length(min = 3, max = 8))]
    pub slopes_arcsec_per_deg_c: Vec<[f64; 3]>,
    /// Plays: T becomes `T + Σ share·(p_w[T] − T)`. Source: models §4, 004.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub hysteresis: Vec<AxesHysteresis>,
}

/// One play of the axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Hysteresis of an orientation")]
pub struct AxesHysteresis {
    /// w.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub half_width_deg_c: f64,
    /// Share.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub share_ratio: f64,
}

/// The four-step substitution over a switch of the lasing mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields, title = "Mode reversal")]
pub struct ModeReversal {
    /// n: ticks lost by a switch, the commanded one included; or give `transition_s`. Source: 003.
    #[schemars(range(min = 1, max = 32))]
    pub transition_ticks: Option<u8>,
    /// Time lost by a switch from the command on, instead of `transition_ticks`: n = ⌈t/Δt − 1/16⌉, at most 32. Source: 003.
    #[schemars(range(min = 0.0001, max = 1.0))]
    pub transition_s: Option<f64>,
    /// Readings of the prediction's fit. Source: 003 step 1.
    #[schemars(range(min = 1, max = 8))]
    pub predict_readings: u8,
    /// Degree of the prediction, below its readings. Source: 003 step 2.
    #[schemars(range(min = 0, max = 2))]
    pub predict_degree: u8,
    /// Readings of the two-sided fit, before. Source: 003 step 3.
    #[schemars(range(min = 1, max = 8))]
    pub fit_readings_before: u8,
    /// Readings of the two-sided fit, after. Source: 003 step 3.
    #[schemars(range(min = 1, max = 8))]
    pub fit_readings_after: u8,
    /// Degree of the two-sided fit, below its readings. Source: 003 step 3.
    #[schemars(range(min = 0, max = 3))]
    pub fit_degree: u8,
    /// Readings of the two-sided fit: as stated, or the best number up to `fit_readings_…` (then default: 8; at least 12 together).
    #[serde(skip_serializing_if = "is_fixed")]
    pub fit_window: FitWindow,
}

/// Which readings the two-sided fit takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum FitWindow {
    /// All that are stated.
    Fixed,
    /// Those with the least error by their own noise and motion.
    Adaptive,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks like that")]
fn is_fixed(window: &FitWindow) -> bool {
    *window == FitWindow::Fixed
}

impl ModeReversal {
    /// How long a transition takes; the default where neither key says so.
    pub(super) fn transition(&self) -> Transition {
        let stated = self.transition_ticks.map(Transition::Ticks);
        stated.or(self.transition_s.map(Transition::Time)).unwrap_or(ReversalParts::default().transition)
    }

    /// n at ticks of a duration: those without a signal, the one with the switch command included.
    #[must_use]
    pub fn ticks(&self, tick: Span) -> u8 {
        self.transition().ticks(tick)
    }
}

impl Default for ModeReversal {
    fn default() -> Self {
        let ReversalParts {
            transition,
            predict_readings,
            predict_degree,
            fit_readings_before,
            fit_readings_after,
            fit_degree,
            fit_window: _,
        } = ReversalParts::default();
        let (transition_ticks, transition_s) = match transition {
            Transition::Ticks(ticks) => (Some(ticks), None),
            Transition::Time(time_s) => (None, Some(time_s)),
        };
        Self {
            transition_ticks,
            transition_s,
            predict_readings,
            predict_degree,
            fit_readings_before,
            fit_readings_after,
            fit_degree,
            fit_window: FitWindow::Fixed,
        }
    }
}
