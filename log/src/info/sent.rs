//! In which unit of measure raw readings were sent: frames do not say it, mappings and calibration documents do.

use std::collections::BTreeMap;

use isotherm_protocol::document::{AccelOutput, Document};

use super::UnitInfo;
use crate::mapping::{Mapping, SensorUnit, TickMapping};

/// What is known of one unit of a log.
#[derive(Debug, Clone, Default)]
pub(super) struct Sent {
    /// Of each gyro, in order.
    gyros: Vec<String>,
    /// Of each accelerometer, in order.
    accelerometers: Vec<String>,
    /// By channel.
    temperatures: BTreeMap<String, String>,
}

impl Sent {
    /// What the mapping of a text log says.
    pub(super) fn by_mapping(mapping: &Mapping) -> Self {
        fn of<U: SensorUnit>(ticks: &TickMapping<U>) -> Vec<String> {
            ticks.sensors.iter().map(|sensor| sensor.unit.sent().to_owned()).collect()
        }
        let files = || mapping.files.iter();
        let channels = files().flat_map(|file| &file.temperatures);
        Self {
            gyros: files().find_map(|file| Some(of(&file.gyro.as_ref()?.ticks))).unwrap_or_default(),
            accelerometers: files().find_map(|file| Some(of(file.accel.as_ref()?))).unwrap_or_default(),
            temperatures: channels
                .map(|channel| (channel.channel.as_str().to_owned(), channel.unit.sent().to_owned()))
                .collect(),
        }
    }

    /// What a calibration document says.
    pub(super) fn by_document(document: &Document) -> Self {
        let accel = document.accel.as_ref().map(|accel| match accel.output {
            AccelOutput::Counts => "counts",
            AccelOutput::Volts => "V",
            AccelOutput::MetresPerSecondSquared => "m/s²",
        });
        let sensors = document.accel.as_ref().map_or(0, |accel| accel.sensor.len());
        // A channel that is converted was sent in something else.
        let plain = |conversion: &[f64]| conversion == [0.0, 1.0];
        let temperatures = document.temperature.channel.iter();
        let temperatures = temperatures
            .filter(|channel| plain(&channel.conversion_deg_c))
            .map(|channel| (channel.name.clone(), "°C".to_owned()));
        let auxiliary = document.auxiliary.iter().filter(|channel| plain(&channel.conversion));
        let auxiliary = auxiliary.map(|channel| (channel.name.clone(), channel.unit.clone()));
        Self {
            gyros: Vec::new(),
            accelerometers: vec![accel.unwrap_or_default().to_owned(); sensors],
            temperatures: temperatures.chain(auxiliary).collect(),
        }
    }

    /// Writes it beside the readings; `counts`: gyros, accelerometers gave counts. Where nothing is known, what it may be.
    pub(super) fn note(&self, info: &mut UnitInfo, counts: [bool; 2]) {
        let kinds = [
            (&mut info.gyros, &self.gyros, "rad/s"),
            (&mut info.accelerometers, &self.accelerometers, "m/s² or V"),
        ];
        for ((readings, known, mean), counts) in kinds.into_iter().zip(counts) {
            for (index, reading) in readings.iter_mut().enumerate() {
                let known = known.get(index).cloned().filter(|_| !counts);
                reading.unit = known.unwrap_or_else(|| if counts { "counts" } else { mean }.to_owned());
            }
        }
        for (channel, reading) in &mut info.temperatures.by_name {
            let known = self.temperatures.get(channel).cloned();
            reading.unit = known.unwrap_or_else(|| "V, counts or °C".to_owned());
        }
    }
}
