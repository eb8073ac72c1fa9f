//! The three units of the demo.

use std::sync::Arc;

use isotherm_correction::calibration::{Calibration, CalibrationParts};
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

/// What a unit is, and what is done to it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kind {
    /// As it stands in the table and in the JSON.
    pub(crate) name: &'static str,
    /// Over what the rate errors are averaged (s of event time): long enough that quantisation and white noise do not hide what
    /// temperature and mode do, short against both.
    pub(crate) averaging_s: f64,
    /// What its gyros' temperature is called.
    pub(crate) gyros: &'static str,
    /// Its calibration document, which the program carries, so that the demo runs from any folder.
    pub(crate) file: &'static str,
    pub(crate) text: &'static str,
    scenario: fn(u64) -> Scenario,
}

const KINDS: [Kind; 3] = [
    Kind {
        name: "Zeeman laser",
        averaging_s: 1.0,
        gyros: "gyros",
        file: "ZLG-0001.toml",
        text: include_str!("../../config/calibration/ZLG-0001.toml"),
        scenario: zeeman_sine,
    },
    Kind {
        name: "fibre-optic",
        averaging_s: 100.0,
        gyros: "gyro coils, outermost layer",
        file: "FOG-0001.toml",
        text: include_str!("../../config/calibration/FOG-0001.toml"),
        scenario: |seed| Scenario {
            tick_ns: CHAMBER_TICK_NS,
            ..fibre_optic_chamber(seed.wrapping_add(1), judging_profile())
        },
    },
    Kind {
        name: "MEMS",
        averaging_s: 60.0,
        gyros: "gyros",
        file: "MEMS-0001.toml",
        text: include_str!("../../config/calibration/MEMS-0001.toml"),
        scenario: |seed| Scenario { tick_ns: CHAMBER_TICK_NS, ..mems_chamber(seed.wrapping_add(2)) },
    },
];

/// One unit of the demo.
#[derive(Debug, Clone)]
pub(crate) struct Member {
    pub(crate) id: UnitId,
    pub(crate) kind: Kind,
    pub(crate) scenario: Scenario,
    /// Raw gyro ticks of the whole scenario.
    pub(crate) ticks: u64,
    pub(crate) nominal: Nominal,
    pub(crate) calibration: Arc<Calibration>,
    pub(crate) digest: [u8; 8],
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
        let Kind { file, text, .. } = kind;
        let parsed = Document::parse(text, Some(file)).map_err(DemoError::Document)?;
        let unusable = || DemoError::Unusable { file };
        let id = UnitId::new(&parsed.document.unit).map_err(|_| unusable())?;
        let nominal = Nominal::new(&parsed.document.to_parts()).ok_or_else(unusable)?;
        let scenario = Scenario { unit: id.to_string(), ..(kind.scenario)(seed) };
        let ticks = Simulation::new(&scenario)?.remaining();
        let digest = parsed.digest.head();
        Ok(Member { id, kind, scenario, ticks, nominal, calibration: Arc::new(parsed.calibration), digest })
    };
    KINDS.into_iter().map(member).collect()
}

/// What one would have of the gyros without this project: nominal scale and input axes, nothing else.
///
/// No thermal term, no bias, no mode: the counts of a mode switch are taken as they are.
#[derive(Debug, Clone)]
pub(crate) struct Nominal {
    weights: Vec<f64>,
    pub(crate) output: OutputKind,
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
            assert_eq!(member.scenario.check(), Vec::new(), "{}", member.id);
            assert_eq!(member.calibration.gyro_count(), member.scenario.instrument.gyros.count());
            assert_eq!(member.calibration.gyro_output(), member.scenario.instrument.gyros.output_kind());
            assert_eq!(member.kind.file, format!("{}.toml", member.id));
        }
    }
}
