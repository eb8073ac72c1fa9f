//! What is to be explained of a sensor: its output less what a unit without error would put out.

use std::collections::BTreeMap;

use isotherm_correction::units::AngularRate;
use isotherm_protocol::document::Document;

use super::fit::Sensor;
use super::known::Known;
use super::samples::Samples;
use super::select::{Target, equal_temperature};
use super::settings::Site;
use crate::error::Error;
use crate::means::{Means, Size};
use crate::report::Rest;
use crate::run::{Run, Watch};
use crate::written::Written;

/// What a unit at rest would put out during a run.
pub(super) fn rest(run: &Run, document: &Document, site: &Site, watch: impl Watch) -> Result<Rest, Error> {
    let Site::Known { place, force_m_per_s2 } = site else { return Ok(Rest::default()) };
    let mean_force = match force_m_per_s2 {
        Some(force) => Some(*force),
        None if document.accel.is_some() => {
            let means = Means::of(run, &Written::of(document)?.loaded, 60.0, watch)?;
            let mean = |axis: usize| Size::of(means.force(axis)).mean;
            Some([mean(0), mean(1), mean(2)])
        }
        None => None,
    };
    let rate = place.earth_rate_in_case(mean_force).ok_or_else(|| {
        Error::Refused(vec![format!(
            "{}: the unit cannot be levelled from its accelerometers: state --roll and --pitch, or leave the mean out with \
             --remove-mean",
            run.name
        )])
    })?;
    let deg_per_h = rate.map(|rate| AngularRate::from_rad_per_s(rate).as_deg_per_h());
    Ok(Rest { rate_deg_per_h: Some(deg_per_h), force_m_per_s2: *force_m_per_s2 })
}

/// What is to be explained of a sensor.
pub(super) fn target(
    sensor: &Sensor,
    bare: &Document,
    samples: &[Samples],
    rests: &[Rest],
    histories: &BTreeMap<String, Known>,
) -> Target {
    let mut target =
        Target { values: Vec::new(), weights: Vec::new(), run: Vec::new(), share: Vec::new(), level: true };
    let rows = if sensor.gyro {
        bare.gyro.orientation.rows.get(sensor.index)
    } else {
        bare.accel.as_ref().and_then(|accel| accel.orientation.rows.get(sensor.index))
    };
    for (index, (run, rest)) in samples.iter().zip(rests).enumerate() {
        let truth = if sensor.gyro { rest.rate_deg_per_h } else { rest.force_m_per_s2 };
        let along =
            truth.zip(rows).map(|(truth, row)| truth.iter().zip(row).map(|(t, r)| t * r).sum::<f64>());
        target.level &= along.is_some();
        let along = along.unwrap_or(0.0);
        let empty = Vec::new();
        let outputs = if sensor.gyro { &run.gyros } else { &run.forces }.get(sensor.index).unwrap_or(&empty);
        let responses = run.responses.get(sensor.index);
        #[expect(clippy::cast_precision_loss, reason = "windows of a log")]
        let count = run.time_s.len() as f64;
        for (row, output) in outputs.iter().enumerate() {
            let response =
                if sensor.gyro { 1.0 } else { responses.and_then(|r| r.get(row)).copied().unwrap_or(1.0) };
            target.values.push((output - along) / response);
            target.run.push(index);
            #[expect(clippy::cast_precision_loss, reason = "windows of a log")]
            target.share.push(row as f64 / count - 0.5);
        }
    }
    if let Some(known) = histories.get(&sensor.channel) {
        target.weights = equal_temperature(&known.temperature, known.history.range_deg_c);
    }
    target
}
