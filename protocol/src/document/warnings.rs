//! What is doubtful about a document that is valid.

use super::curve::CurveForm;
use super::measure::Argument;
use super::terms::StatedTerm;
use super::types::{Document, Filter, GyroSensor, Orientation, Temperature};
use isotherm_document::Problem;
use isotherm_document::{Reader, element, join};

/// Everything doubtful, in the order of its keys.
pub(super) fn warnings(r: &Reader<'_>, document: &Document) -> Vec<Problem> {
    let mut found = Vec::new();
    if let Some(filter) = &document.temperature.filter {
        grid(r, filter, &mut found);
    }
    unused_channels(r, document, &mut found);
    let ranges = Ranges { r, temperature: &document.temperature };
    for (i, sensor) in document.gyro.sensor.iter().enumerate() {
        let path = element("gyro.sensor", i);
        let channel = sensor.channel.as_deref();
        ranges.compare_terms(&path, channel, &sensor.terms(), &mut found);
        without_channel(r, &path, sensor, &mut found);
        if sensor.magnetic_bias.is_some() && document.mode_reversal.is_none() {
            let why = "changes its sign with the lasing mode, but there is no [mode_reversal]: switches are not bridged";
            found.push(r.warning(&join(&path, "magnetic_bias"), why));
        }
    }
    parity(r, "gyro", &document.gyro.orientation, &mut found);
    if let Some(accel) = &document.accel {
        for (i, sensor) in accel.sensor.iter().enumerate() {
            let path = element("accel.sensor", i);
            let channel = sensor.channel.as_deref();
            ranges.compare(&path, "scale_factor", channel, Some(&*sensor.scale_factor), &mut found);
            ranges.compare_terms(&path, channel, &sensor.terms(), &mut found);
            let board = sensor.board_channel.as_deref();
            let ratio = sensor.board_ratio_error.as_deref();
            ranges.compare(&path, "board_ratio_error", board, ratio, &mut found);
        }
        parity(r, "accel", &accel.orientation, &mut found);
    }
    found
}

/// Lengths that are no whole number of grid steps are rounded.
fn grid(r: &Reader<'_>, filter: &Filter, found: &mut Vec<Problem>) {
    for (key, length) in
        [("smoothing_s", filter.smoothing_s), ("derivative_step_s", filter.derivative_step_s)]
    {
        let steps = (length / filter.grid_step_s).round().max(1.0);
        let rounded = steps * filter.grid_step_s;
        if length > 0.0 && (rounded - length).abs() > 1e-6 * filter.grid_step_s {
            let message = format!("is {length} s, not a whole number of grid steps: {rounded} s is used");
            found.push(r.warning(&join("temperature.filter", key), message));
        }
    }
}

/// A channel that nothing follows.
fn unused_channels(r: &Reader<'_>, document: &Document, found: &mut Vec<Problem>) {
    let accel = document.accel.as_ref();
    let gyro_thermal = document.gyro.orientation.thermal.as_ref();
    let accel_thermal = accel.and_then(|accel| accel.orientation.thermal.as_ref());
    let accel_sensors = accel.into_iter().flat_map(|accel| &accel.sensor);
    let used: Vec<&String> = (document.gyro.sensor.iter().filter_map(|sensor| sensor.channel.as_ref()))
        .chain(accel_sensors.flat_map(|sensor| sensor.channel.iter().chain(&sensor.board_channel)))
        .chain(regressors(document))
        .chain(gyro_thermal.into_iter().chain(accel_thermal).flat_map(|thermal| &thermal.channels))
        .collect();
    let temperatures = document.temperature.channel.iter().map(|channel| &channel.name).enumerate();
    let temperatures = temperatures.map(|(i, name)| (element("temperature.channel", i), name));
    let auxiliaries = document.auxiliary.iter().map(|channel| &channel.name).enumerate();
    let auxiliaries = auxiliaries.map(|(i, name)| (element("auxiliary", i), name));
    for (path, name) in temperatures.chain(auxiliaries).filter(|(_, name)| !used.contains(name)) {
        let message = format!("is {name:?}, followed by no sensor and no orientation");
        found.push(r.warning(&join(&path, "name"), message));
    }
}

/// Channels of regressors.
fn regressors(document: &Document) -> impl Iterator<Item = &String> {
    let gyros = document.gyro.sensor.iter().flat_map(|sensor| &sensor.regressor);
    let accels = document.accel.iter().flat_map(|accel| &accel.sensor).flat_map(|sensor| &sensor.regressor);
    let gyros = gyros.flat_map(|stated| stated.minus.iter().chain([&stated.channel]));
    gyros.chain(accels.flat_map(|stated| stated.minus.iter().chain([&stated.channel])))
}

/// Terms that need a temperature that moves.
fn without_channel(r: &Reader<'_>, path: &str, sensor: &GyroSensor, found: &mut Vec<Problem>) {
    for (key, there) in [
        ("thermal_rate", sensor.thermal_rate.is_some()),
        ("thermal_acceleration", sensor.thermal_acceleration.is_some()),
        ("lag", !sensor.lag.is_empty()),
        ("hysteresis", !sensor.hysteresis.is_empty()),
    ] {
        if there && sensor.channel.is_none() {
            found.push(r.warning(&join(path, key), "has no effect: the gyro follows no temperature channel"));
        }
    }
}

/// A parity check that cannot check anything.
fn parity<P>(r: &Reader<'_>, section: &str, orientation: &Orientation<P>, found: &mut Vec<Problem>) {
    if orientation.parity.is_some() && orientation.rows.len() <= 3 {
        let path = join(&join(section, "orientation"), "parity");
        found.push(r.warning(&path, "has no effect: three sensors leave no parity residual"));
    }
}

/// Compares fitted ranges with the physical range of the channel.
struct Ranges<'a, 't> {
    r: &'a Reader<'t>,
    temperature: &'a Temperature,
}

impl Ranges<'_, '_> {
    fn compare_terms(
        &self,
        sensor: &str,
        channel: Option<&str>,
        terms: &[StatedTerm<'_>],
        found: &mut Vec<Problem>,
    ) {
        for (key, curve) in terms.iter().flat_map(StatedTerm::curves) {
            self.compare(sensor, &key, channel, Some(curve), found);
        }
    }

    fn compare(
        &self,
        sensor: &str,
        key: &str,
        channel: Option<&str>,
        curve: Option<&CurveForm>,
        found: &mut Vec<Problem>,
    ) {
        let Some(curve) = curve.filter(|curve| curve.argument() == Some(Argument::DegC)) else { return };
        let Some([low, high]) = curve.range() else { return };
        let Some(channel) = self.temperature.channel.iter().find(|c| Some(c.name.as_str()) == channel) else {
            return;
        };
        let [coldest, hottest] = channel.range_deg_c;
        if low < coldest || high > hottest {
            let message = format!(
                "is fitted from {low} to {high} °C, but channel {:?} rejects readings outside {coldest} to {hottest} °C",
                channel.name
            );
            found.push(self.r.warning(&format!("{sensor}.{key}"), message));
        }
    }
}
