//! What few units have: terms whose features follow the unit's motion (models §2, §3; IEEE 528), and sensors that lag behind others.

use alloc::boxed::Box;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::bank::Follows;
use super::declared::Term;
use super::terms::{SensorState, Terms};
use crate::calibration::TermParts;
use crate::channel::ThermalFilter;
use crate::curve::{Curve, CurveParts};
use crate::defect::Checker;
use crate::lanes::Lanes;
use crate::sample::{MAX_SENSORS, Sensors};

/// A sensor's terms that follow motion, compiled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct MotionTerms {
    pub(crate) channel: Option<usize>,
    pub(crate) terms: Terms,
    /// K(ω)/K(T) − 1 of a gyro over the rate that it reads.
    pub(crate) over_rate: Option<Curve>,
}

impl MotionTerms {
    /// Compiles those among the terms of a sensor, and the curve over its rate.
    pub(crate) fn new(
        channel: Option<usize>,
        (declared, parts): (&[Term], &[TermParts]),
        over_rate: Option<&CurveParts>,
        filter: &ThermalFilter,
        checker: &mut Checker,
    ) -> Option<Self> {
        let terms = Terms::new(declared, parts, true, filter, checker);
        let over_rate = over_rate.and_then(|curve| checker.curve("increment_weight_over_rate", curve));
        Some(Self { channel, terms: terms?, over_rate })
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.terms.is_empty() && self.over_rate.is_none()
    }
}

impl<const T: usize> Follows<T> for MotionTerms {
    fn channel(&self) -> Option<usize> {
        self.channel
    }

    fn terms(&self, state: &SensorState<'_>, filter: &ThermalFilter) -> ([f64; T], bool) {
        self.terms.lines(state, filter)
    }
}

/// Everything of a unit that follows motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Motion {
    /// Of each sensor; none where no sensor of the kind has any.
    pub(crate) gyros: Vec<MotionTerms>,
    pub(crate) accels: Vec<MotionTerms>,
    /// Whether a gyro drifts with the specific force.
    pub(crate) feels_force: bool,
    /// Where the accelerometers sit, axis by axis (m).
    pub(crate) positions_m: [Lanes; 3],
    /// By how much of a tick gyros and accelerometers are held back, to go with the sensor that lags most.
    pub(crate) held_back_ticks: [Lanes; 2],
    /// Whether an accelerometer sits elsewhere than at the reference point.
    pub(crate) has_positions: bool,
    /// Whether a sensor lags less than another.
    pub(crate) holds_back: bool,
}

impl Motion {
    /// `None` for a unit that has nothing of the kind.
    pub(crate) fn of(
        gyros: Vec<MotionTerms>,
        accels: Vec<MotionTerms>,
        positions_m: impl Iterator<Item = [f64; 3]>,
        delays_ticks: [Sensors<f64>; 2],
    ) -> Option<Box<Self>> {
        let mut lanes = [[0.0; MAX_SENSORS]; 3];
        for (lane, position) in positions_m.take(MAX_SENSORS).enumerate() {
            lanes.iter_mut().zip(position).for_each(|(axis, metres)| axis[lane] = metres);
        }
        let longest = delays_ticks.iter().flatten().copied().fold(0.0, f64::max);
        let held_back_ticks = delays_ticks.map(|delays| {
            let mut lanes = [0.0; MAX_SENSORS];
            lanes.iter_mut().zip(delays).for_each(|(lane, delay)| *lane = longest - delay);
            lanes
        });
        let [gyros, accels] = [gyros, accels]
            .map(|terms| if terms.iter().all(MotionTerms::is_empty) { Vec::new() } else { terms });
        let feels_force = gyros.iter().any(|gyro| gyro.terms.feel_force());
        let differs = |lane: &f64| *lane != 0.0;
        let motion = Self {
            gyros,
            accels,
            feels_force,
            has_positions: lanes.iter().flatten().any(differs),
            positions_m: lanes,
            holds_back: held_back_ticks.iter().flatten().any(differs),
            held_back_ticks,
        };
        let has_terms = !(motion.gyros.is_empty() && motion.accels.is_empty());
        (has_terms || motion.has_positions || motion.holds_back).then(|| Box::new(motion))
    }

    /// Whether a gyro's weight follows its rate.
    pub(crate) fn has_curves(&self) -> bool {
        self.gyros.iter().any(|gyro| gyro.over_rate.is_some())
    }
}
