//! What is to be explained of a sensor: its output less what a unit without error would put out.

use std::collections::BTreeMap;

use isotherm_correction::units::AngularRate;
use isotherm_protocol::document::{Document, Orientation};

use super::fit::Sensor;
use super::known::Known;
use super::samples::Samples;
use super::scale::{Kept, smoothed, told};
use super::select::{Target, equal_temperature};
use super::stand::{Site, Stand};
use crate::document::{Written, turned};
use crate::error::Error;
use crate::fits::modes::cells::temperature;
use crate::numbers::{Size, dot};
use crate::report::Rest;
use crate::runs::Run;
use crate::runs::table::{Table, earth_rate};

/// Shortest windows of a levelling (s).
const LEVELLING_S: f64 = 60.0;

/// What a run's beginning is left out for (s): derivatives and fast lags rest on the guess that nothing had moved before.
const SETTLED_S: f64 = 60.0;

/// What a unit without error would put out during a run, over whole turns where it is turned: then the accelerometers, which feel
/// the table too, have none.
pub(super) fn rest(run: &Run, document: &Document, stand: &Stand) -> Result<Rest, Error> {
    let Site::Known { place, force_m_per_s2 } = &stand.site else { return Ok(Rest::default()) };
    let mean_force = match force_m_per_s2 {
        Some(force) => Some(*force),
        None if document.accel.is_some() => {
            Table::of(run, &Written::compiled(document)?, stand.window_s(LEVELLING_S))?.mean_force()
        }
        None => None,
    };
    let rate = earth_rate(place, mean_force).map_err(|error| error.of(&run.name))?;
    let deg_per_h = rate.map(|rate| AngularRate::from_rad_per_s(rate).as_deg_per_h());
    Ok(match &stand.turning {
        None => Rest { rate_deg_per_h: Some(deg_per_h), force_m_per_s2: *force_m_per_s2, ..Rest::default() },
        Some(turning) => {
            let along = dot(turning.axis, deg_per_h);
            let table = turning.rate_deg_per_h();
            let rate = [0, 1, 2].map(|axis| table[axis] + along * turning.axis[axis]);
            Rest { rate_deg_per_h: Some(rate), ..Rest::default() }
        }
    })
}

/// What is known of the input of one kind of sensor in a run, in case axes (°/h or m/s²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Input {
    /// Nothing.
    Unknown,
    /// All but a constant.
    BesideLevel([f64; 3]),
    /// All.
    Known([f64; 3]),
    /// The sensor takes no part in the run.
    NoPart,
}

impl Input {
    /// Of the gyros, or of the accelerometers.
    pub(super) fn of(gyro: bool, rest: &Rest, stand: &Stand) -> Self {
        match (gyro, rest.rate_deg_per_h, rest.force_m_per_s2, &stand.turning) {
            (true, Some(rate), ..) => Self::Known(rate),
            (true, None, _, Some(turning)) => Self::BesideLevel(turning.rate_deg_per_h()),
            (false, _, _, Some(_)) => Self::NoPart,
            (false, _, Some(force), None) => Self::Known(force),
            (true, None, _, None) | (false, _, None, None) => Self::Unknown,
        }
    }
}

/// What is to be explained of a sensor.
pub(super) fn target(
    sensor: &Sensor,
    bare: &Document,
    samples: &[Samples],
    (rests, stands): (&[Rest], &[Stand]),
    histories: &BTreeMap<String, Known>,
) -> Target {
    let mut target = Target { level: true, ..Target::default() };
    let (mut inputs, mut shown, mut per_input) = (Vec::new(), Vec::new(), Vec::new());
    for (index, ((run, rest), stand)) in samples.iter().zip(rests).zip(stands).enumerate() {
        let input = Input::of(sensor.gyro, rest, stand);
        target.level &= matches!(input, Input::Known(_) | Input::NoPart);
        let rows = match (sensor.gyro, &bare.accel) {
            (true, _) => axes(&bare.gyro.orientation, sensor.index, run),
            (false, Some(accel)) => axes(&accel.orientation, sensor.index, run),
            (false, None) => Vec::new(),
        };
        let empty = Vec::new();
        let outputs = if sensor.gyro { &run.gyros } else { &run.forces }.get(sensor.index).unwrap_or(&empty);
        let responses = run.responses.get(sensor.index);
        // Whatever it feels goes through a scale factor that may follow temperature: what it felt on the whole is no part of its bias.
        let usual = Size::of(outputs).mean;
        for (row, output) in outputs.iter().enumerate() {
            let response =
                if sensor.gyro { 1.0 } else { responses.and_then(|r| r.get(row)).copied().unwrap_or(1.0) };
            let axis = rows.get(row).copied().unwrap_or_default();
            let along = |vector: [f64; 3]| dot(vector, axis);
            let (input, expected) = match input {
                Input::Unknown => (f64::NAN, usual),
                Input::NoPart => (f64::NAN, f64::NAN),
                Input::BesideLevel(vector) | Input::Known(vector) => (along(vector), along(vector)),
            };
            target.values.push((output - expected) / response);
            target.run.push(index);
            inputs.push(input);
            shown.push(*output);
            per_input.push(1e-6 / response);
        }
    }
    let Some(known) = histories.get(&sensor.channel) else { return target };
    target.weights = equal_temperature(&known.temperature, &known.history.at_rest, known.history.range_deg_c);
    let usual_s = samples.iter().map(|run| run.window_s).fold(f64::INFINITY, f64::min);
    for (weight, run) in target.weights.iter_mut().zip(&target.run) {
        // A longer window has less noise.
        *weight *= samples.get(*run).map_or(1.0, |run| run.window_s / usual_s);
    }
    let since = samples.iter().flat_map(|run| &run.time_s);
    target
        .weights
        .iter_mut()
        .zip(since)
        .filter(|(_, since)| **since < SETTLED_S)
        .for_each(|(weight, _)| *weight = 0.0);
    let (temperature, range) = (&known.temperature, known.history.range_deg_c);
    match told(sensor.gyro, &inputs, temperature, range) {
        Err(why) => target.kept = Some(why),
        // A run of unknown input has no place in the equation.
        Ok(()) if !target.level && !sensor.gyro => target.kept = Some(Kept::NotMeant),
        Ok(()) if sensor.gyro => {
            let shown = smoothed(&shown, &target.run, temperature, range);
            target.scale = Some(shown.iter().map(|shown| -1e-6 * shown).collect());
        }
        Ok(()) => {
            target.scale = Some(inputs.iter().zip(&per_input).map(|(input, per)| input * per).collect());
        }
    }
    target
}

/// Input axis of a sensor in each window of a run, turned with temperature as the document says.
pub(crate) fn axes<P>(orientation: &Orientation<P>, sensor: usize, run: &Samples) -> Vec<[f64; 3]> {
    let row = orientation.rows.get(sensor).copied().unwrap_or_default();
    let at = |window: usize| {
        let Some(thermal) = &orientation.thermal else { return row };
        let deg_c = temperature(thermal, |name| run.deg_c.get(name)?.get(window).copied());
        let turned = turned(Some(thermal), sensor, deg_c);
        [0, 1, 2].map(|axis| row[axis] + turned[axis])
    };
    (0..run.time_s.len()).map(at).collect()
}
