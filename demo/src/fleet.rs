//! The three units of the demo.

use isotherm_correction::calibration::CalibrationParts;
use isotherm_correction::orientation::{Inverse, Orientation, SensorMask};
use isotherm_correction::sample::{OutputKind, Sensors};
use isotherm_protocol::document::Document;
use isotherm_protocol::key::UnitId;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::Path;
use isotherm_simulator::presets::{fibre_optic_chamber, judging_profile, mems_chamber, zeeman_sine};
use isotherm_simulator::{Scenario, Simulation};

use super::DemoError;

/// Tick of the units in the chamber (ns): hours of event time pass in half a minute, and 20 Hz shows them as well as
/// more would.
const CHAMBER_TICK_NS: i64 = 50_000_000;

/// A calibration document that the program carries, so that the demo runs from any folder.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shipped {
    pub(crate) file: &'static str,
    pub(crate) text: &'static str,
}

const ZEEMAN: Shipped =
    Shipped { file: "ZLG-0001.toml", text: include_str!("../../config/calibration/ZLG-0001.toml") };
const FIBRE_OPTIC: Shipped =
    Shipped { file: "FOG-0001.toml", text: include_str!("../../config/calibration/FOG-0001.toml") };
const MEMS: Shipped =
    Shipped { file: "MEMS-0001.toml", text: include_str!("../../config/calibration/MEMS-0001.toml") };

/// What a unit is, and what is done to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    ZeemanLaser,
    FibreOptic,
    Mems,
}

impl Kind {
    pub(crate) const ALL: [Self; 3] = [Self::ZeemanLaser, Self::FibreOptic, Self::Mems];

    /// As it stands in the table and in the JSON.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::ZeemanLaser => "Zeeman laser",
            Self::FibreOptic => "fibre-optic",
            Self::Mems => "MEMS",
        }
    }

    /// Over what the rate errors are averaged (s of event time): long enough that quantisation and white noise do
    /// not hide what temperature and mode do, short against both.
    pub(crate) const fn averaging_s(self) -> f64 {
        match self {
            Self::ZeemanLaser => 1.0,
            Self::FibreOptic => 100.0,
            Self::Mems => 60.0,
        }
    }

    pub(crate) const fn document(self) -> Shipped {
        match self {
            Self::ZeemanLaser => ZEEMAN,
            Self::FibreOptic => FIBRE_OPTIC,
            Self::Mems => MEMS,
        }
    }

    fn scenario(self, seed: u64) -> Scenario {
        match self {
            Self::ZeemanLaser => zeeman_sine(seed),
            Self::FibreOptic => Scenario {
                tick_ns: CHAMBER_TICK_NS,
                ..fibre_optic_chamber(seed.wrapping_add(1), judging_profile())
            },
            Self::Mems => Scenario { tick_ns: CHAMBER_TICK_NS, ..mems_chamber(seed.wrapping_add(2)) },
        }
    }
}

/// One unit of the demo.
#[derive(Debug, Clone)]
pub(crate) struct Member {
    pub(crate) id: UnitId,
    pub(crate) kind: Kind,
    pub(crate) scenario: Scenario,
    /// Raw gyro ticks of the whole scenario.
    pub(crate) ticks: u64,
    pub(crate) nominal: Nominal,
}

impl Member {
    /// What happens to it in the demo, in words.
    pub(crate) fn story(&self) -> String {
        match (&self.scenario.instrument.gyros, &self.scenario.motion.path) {
            (Gyros::Zeeman(zeeman), Path::Sine { amplitude_deg, frequency_hz, .. }) => format!(
                "On a stand that swings by {amplitude_deg}° at {frequency_hz}\u{a0}Hz, in a chamber that warms, with \
                 mode reversal every {}\u{a0}s. At each switch the counts of some ticks are meaningless.",
                zeeman.reversal.period_s
            ),
            (Gyros::FibreOptic(_), _) => {
                "At rest through a chamber cycle. The drift follows the heat flow through the coil, so it depends on \
                 the rate of temperature, not only on temperature."
                    .to_owned()
            }
            _ => "At rest through a chamber cycle. Bias and scale factor follow the temperature.".to_owned(),
        }
    }
}

/// All units.
///
/// # Errors
/// None, unless a shipped document or a scenario is broken, which a test excludes.
pub(crate) fn fleet(seed: u64) -> Result<Vec<Member>, DemoError> {
    let member = |kind: Kind| {
        let Shipped { file, text } = kind.document();
        let parsed = Document::parse(text, Some(file)).map_err(DemoError::Document)?;
        let unusable = || DemoError::Unusable { file };
        let id = UnitId::new(&parsed.document.unit).map_err(|_| unusable())?;
        let nominal = Nominal::new(&parsed.document.to_parts()).ok_or_else(unusable)?;
        let scenario = Scenario { unit: id.to_string(), ..kind.scenario(seed) };
        let ticks = Simulation::new(&scenario)?.remaining();
        Ok(Member { id, kind, scenario, ticks, nominal })
    };
    Kind::ALL.into_iter().map(member).collect()
}

/// What one would have of the gyros without this project: nominal scale and input axes, nothing else.
///
/// No thermal term, no bias, no mode: the counts of a mode switch are taken as they are.
#[derive(Debug, Clone)]
pub(crate) struct Nominal {
    weights: Vec<f64>,
    output: OutputKind,
    inverse: Inverse,
}

impl Nominal {
    fn new(parts: &CalibrationParts) -> Option<Self> {
        let orientation = Orientation::new(&parts.gyro_orientation).ok()?;
        let all = SensorMask::all(parts.gyros.len());
        Some(Self {
            weights: parts.gyros.iter().map(|gyro| gyro.increment_weight).collect(),
            output: parts.gyro_output,
            inverse: orientation.inverse(parts.gyro_orientation.reference_deg_c, all)?,
        })
    }

    /// What the readings stand for.
    pub(crate) fn output(&self) -> OutputKind {
        self.output
    }

    /// Angle increments about the case axes (rad) of a tick of `duration_s`.
    pub(crate) fn angle(&self, readings: &[f64], duration_s: f64) -> [f64; 3] {
        let per_reading = match self.output {
            OutputKind::Counts => 1.0,
            OutputKind::Mean => duration_s,
        };
        let angles =
            readings.iter().zip(&self.weights).map(|(reading, weight)| reading * weight * per_reading);
        self.inverse.apply(&angles.collect::<Sensors<f64>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_has_a_document_that_fits_its_scenario() {
        for member in fleet(1).unwrap() {
            let parsed = Document::parse(member.kind.document().text, None).unwrap();
            assert_eq!(member.scenario.check(), Vec::new(), "{}", member.id);
            assert_eq!(parsed.calibration.gyro_count(), member.scenario.instrument.gyros.count());
            assert_eq!(parsed.calibration.gyro_output(), member.scenario.instrument.gyros.output_kind());
            assert_eq!(member.kind.document().file, format!("{}.toml", member.id));
        }
    }
}
