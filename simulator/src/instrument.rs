//! One inertial unit: its gyros, accelerometers, thermometers and thermal nodes.

use isotherm_correction::sample::OutputKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::accelerometer::Accelerometers;
use crate::effects::Effects;
use crate::fibre_optic::FibreOpticGyro;
use crate::mems::MemsGyro;
use crate::orientation::Orientation;
use crate::temperature::Thermometers;
use crate::thermal::Node;
use crate::zeeman::Zeeman;

/// One inertial unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Instrument {
    /// Step of the thermal clock (s, 0.001…10). Between its steps all temperatures and slow drifts are linear in
    /// time, and that is the truth, not an approximation of it.
    #[schemars(range(min = 1e-3, max = 10.0))]
    pub thermal_step_s: f64,
    /// Start with all parts at the chamber's temperature instead of at their own steady ones.
    #[serde(default)]
    pub cold_start: bool,
    /// Housing, behind the chamber.
    pub housing: Node,
    /// Electronics board, behind the housing.
    pub board: Node,
    /// The gyros.
    pub gyros: Gyros,
    /// Input axes of the gyros.
    pub gyro_orientation: Orientation,
    /// The accelerometers; a unit may have none.
    #[serde(default)]
    pub accelerometers: Option<Accelerometers>,
    /// The temperature channels.
    pub thermometers: Thermometers,
    /// What the sensors do beyond the models of their kinds.
    #[serde(default, skip_serializing_if = "Effects::is_none")]
    pub effects: Effects,
}

/// The gyros of a unit, all of one kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Gyros {
    /// Zeeman laser gyros.
    Zeeman(Zeeman),
    /// Fibre-optic gyros.
    FibreOptic(Vec<FibreOpticGyro>),
    /// Micromechanical gyros.
    Mems(Vec<MemsGyro>),
}

impl Gyros {
    /// How many.
    #[must_use]
    pub fn count(&self) -> usize {
        match self {
            Self::Zeeman(zeeman) => zeeman.gyros.len(),
            Self::FibreOptic(gyros) => gyros.len(),
            Self::Mems(gyros) => gyros.len(),
        }
    }

    /// What the readings stand for.
    #[must_use]
    pub fn output_kind(&self) -> OutputKind {
        match self {
            Self::Zeeman(_) => OutputKind::Counts,
            Self::FibreOptic(_) | Self::Mems(_) => OutputKind::Mean,
        }
    }
}

impl Instrument {
    /// What the accelerometers' readings stand for, where there are any.
    #[must_use]
    pub fn accel_output_kind(&self) -> Option<OutputKind> {
        self.accelerometers.as_ref().map(Accelerometers::output_kind)
    }
}
