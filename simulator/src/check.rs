//! Validation of a scenario: all that is wrong, at once.

use isotherm_correction::sample::{MAX_CHANNEL_NAME, MAX_SENSORS, MIN_SENSORS};

use crate::chamber::{Profile, Segment};
use crate::error::{Key, ScenarioError};
use crate::failure::{FailingSensor, Failure, Fault};
use crate::instrument::Instrument;
use crate::motion::{Motion, Path};
use crate::orientation::Orientation;
use crate::scenario::Scenario;
use crate::temperature::Place;
use crate::vector::norm;

/// Collects errors. Every check states its key first.
#[derive(Debug, Default)]
pub(crate) struct Report(pub(crate) Vec<ScenarioError>);

/// Any finite number.
pub(crate) const ANY: (f64, f64) = (-1e12, 1e12);
/// Zero or more.
pub(crate) const NOT_NEGATIVE: (f64, f64) = (0.0, 1e12);
/// More than zero.
pub(crate) const POSITIVE: (f64, f64) = (1e-12, 1e12);
/// Temperatures of chambers and their references (°C).
pub(crate) const DEG_C: (f64, f64) = (-100.0, 200.0);

pub(crate) const fn at(path: &'static str) -> Key {
    Key { path, index: None }
}

pub(crate) const fn nth(path: &'static str, index: usize) -> Key {
    Key { path, index: Some(index) }
}

impl Report {
    pub(crate) fn number(&mut self, key: Key, got: f64, (low, high): (f64, f64)) {
        if !(low..=high).contains(&got) {
            self.0.push(ScenarioError::OutOfRange { key, got, low, high });
        }
    }

    pub(crate) fn numbers(&mut self, key: Key, got: &[f64], limits: (f64, f64)) {
        for &got in got {
            self.number(key, got, limits);
        }
    }

    pub(crate) fn channel_name(&mut self, key: Key, name: &str) {
        if !(1..=MAX_CHANNEL_NAME).contains(&name.len()) {
            self.0.push(ScenarioError::ChannelName { key, got: name.len() });
        }
    }

    pub(crate) fn sensors(&mut self, key: Key, got: usize) {
        if !(MIN_SENSORS..=MAX_SENSORS).contains(&got) {
            self.0.push(ScenarioError::SensorCount { key, got });
        }
    }

    fn axis(&mut self, path: &'static str, axis: [f64; 3]) {
        self.numbers(at(path), &axis, ANY);
        if norm(axis).partial_cmp(&1e-9) == Some(core::cmp::Ordering::Less) {
            self.0.push(ScenarioError::NoDirection { key: at(path) });
        }
    }

    pub(crate) fn orientation(&mut self, path: &'static str, orientation: &Orientation, sensors: usize) {
        self.number(at(path), orientation.reference_deg_c, DEG_C);
        for (got, may_be_empty) in [(orientation.rows.len(), false), (orientation.rows_per_k.len(), true)] {
            if got != sensors && !(may_be_empty && got == 0) {
                self.0.push(ScenarioError::Length { key: at(path), got, expected: sensors });
            }
        }
        for (index, row) in orientation.rows.iter().enumerate() {
            let got = norm(*row);
            if (got - 1.0).abs() > 1e-9 || got.is_nan() {
                self.0.push(ScenarioError::RowNotUnit { key: nth(path, index), got });
            }
        }
        for (index, row) in orientation.rows_per_k.iter().enumerate() {
            self.numbers(nth(path, index), row, (-1e-3, 1e-3));
        }
        let spread = orientation.spread();
        if spread < 1e-6 || spread.is_nan() {
            self.0.push(ScenarioError::AxesInPlane { key: at(path) });
        }
    }
}

impl Scenario {
    /// All that is wrong with the scenario, in the order of its keys; empty where it can be simulated.
    #[must_use]
    pub fn check(&self) -> Vec<ScenarioError> {
        let mut report = Report::default();
        report.number(at("duration_s"), self.duration_s, (0.0, 1e9));
        #[expect(clippy::cast_precision_loss, reason = "the limits are far below 2⁵³")]
        let (tick_ns, jitter_ns) = (self.tick_ns as f64, self.tick_jitter_ns as f64);
        report.number(at("tick_ns"), tick_ns, (1e5, 1e9));
        report.number(at("tick_jitter_ns"), jitter_ns, (0.0, 0.25 * tick_ns.max(0.0)));
        chamber(&mut report, &self.chamber);
        motion(&mut report, &self.motion);
        crate::check_instrument::instrument(&mut report, &self.instrument, tick_ns * 1e-9);
        thermometers(&mut report, &self.instrument, tick_ns * 1e-9);
        for (index, failure) in self.failures.iter().enumerate() {
            failing(&mut report, &self.instrument, nth("failures", index), failure);
        }
        report.0
    }
}

fn chamber(report: &mut Report, profile: &Profile) {
    report.number(at("chamber.start_deg_c"), profile.start_deg_c, DEG_C);
    for (index, segment) in profile.segments.iter().enumerate() {
        match *segment {
            Segment::Ramp { to_deg_c, rate_deg_c_per_min } => {
                report.number(nth("chamber.segments.ramp.to_deg_c", index), to_deg_c, DEG_C);
                let key = nth("chamber.segments.ramp.rate_deg_c_per_min", index);
                report.number(key, rate_deg_c_per_min, (1e-3, 1e3));
            }
            Segment::Hold { minutes } => {
                report.number(nth("chamber.segments.hold.minutes", index), minutes, (0.0, 1e7));
            }
        }
    }
}

fn motion(report: &mut Report, motion: &Motion) {
    report.number(at("motion.latitude_deg"), motion.latitude_deg, (-90.0, 90.0));
    report.number(at("motion.earth_rate_rad_per_s"), motion.earth_rate_rad_per_s, (-1.0, 1.0));
    report.number(at("motion.gravity_m_per_s2"), motion.gravity_m_per_s2, (0.0, 20.0));
    report.number(at("motion.heading_deg"), motion.heading_deg, (-360.0, 360.0));
    report.number(at("motion.pitch_deg"), motion.pitch_deg, (-360.0, 360.0));
    report.number(at("motion.roll_deg"), motion.roll_deg, (-360.0, 360.0));
    let frequency = (0.0, 1000.0);
    let angle = (-360.0, 360.0);
    match motion.path {
        Path::Rest => {}
        Path::ConstantRate { axis, rate_deg_per_s } => {
            report.axis("motion.path.constant_rate.axis", axis);
            report.number(at("motion.path.constant_rate.rate_deg_per_s"), rate_deg_per_s, (-1e4, 1e4));
        }
        Path::Sine { axis, amplitude_deg, frequency_hz, phase_deg } => {
            report.axis("motion.path.sine.axis", axis);
            report.number(at("motion.path.sine.amplitude_deg"), amplitude_deg, angle);
            report.number(at("motion.path.sine.frequency_hz"), frequency_hz, frequency);
            report.number(at("motion.path.sine.phase_deg"), phase_deg, angle);
        }
        Path::Coning { half_angle_deg, frequency_hz } => {
            report.number(at("motion.path.coning.half_angle_deg"), half_angle_deg, (-90.0, 90.0));
            report.number(at("motion.path.coning.frequency_hz"), frequency_hz, frequency);
        }
        Path::Sculling {
            axis,
            amplitude_deg,
            frequency_hz,
            vibration_axis,
            vibration_m_per_s2,
            vibration_phase_deg,
        } => {
            report.axis("motion.path.sculling.axis", axis);
            report.axis("motion.path.sculling.vibration_axis", vibration_axis);
            report.number(at("motion.path.sculling.amplitude_deg"), amplitude_deg, angle);
            report.number(at("motion.path.sculling.frequency_hz"), frequency_hz, frequency);
            report.number(at("motion.path.sculling.vibration_m_per_s2"), vibration_m_per_s2, (-1e3, 1e3));
            report.number(at("motion.path.sculling.vibration_phase_deg"), vibration_phase_deg, angle);
        }
    }
}

fn thermometers(report: &mut Report, instrument: &Instrument, tick_s: f64) {
    let thermometers = &instrument.thermometers;
    report.number(at("instrument.thermometers.period_s"), thermometers.period_s, (tick_s.max(1e-4), 1e6));
    for (index, channel) in thermometers.channels.iter().enumerate() {
        let key = nth("instrument.thermometers.channels", index);
        report.channel_name(key, &channel.name);
        if thermometers.channels.iter().take(index).any(|earlier| earlier.name == channel.name) {
            report.0.push(ScenarioError::ChannelTwice { key });
        }
        let known = match channel.place {
            Place::Chamber | Place::Housing | Place::Board => true,
            Place::Gyro(index) => index < instrument.gyros.count(),
            Place::Accelerometer(index) => index < accelerometers(instrument),
        };
        if !known {
            report.0.push(ScenarioError::UnknownPlace { key, place: channel.place });
        }
        report.number(key, channel.raw_at_0_deg_c, ANY);
        report.number(key, channel.raw_per_deg_c.abs(), POSITIVE);
        report.number(key, channel.noise_deg_c, NOT_NEGATIVE);
        report.number(key, channel.resolution_raw, NOT_NEGATIVE);
    }
}

fn accelerometers(instrument: &Instrument) -> usize {
    instrument.accelerometers.as_ref().map_or(0, |block| block.sensors.len())
}

fn failing(report: &mut Report, instrument: &Instrument, key: Key, failure: &Failure) {
    report.number(key, failure.at_s, NOT_NEGATIVE);
    let sensor = failure.sensor;
    let known = match sensor {
        FailingSensor::Gyro(index) => index < instrument.gyros.count(),
        FailingSensor::Accelerometer(index) => index < accelerometers(instrument),
    };
    if !known {
        report.0.push(ScenarioError::UnknownSensor { key, sensor });
    }
    match (failure.fault, sensor) {
        (Fault::Stuck | Fault::NotFinite, _) => {}
        (Fault::RateJump { rad_per_s }, FailingSensor::Gyro(_)) => report.number(key, rad_per_s, ANY),
        (Fault::ForceJump { m_per_s2 }, FailingSensor::Accelerometer(_)) => report.number(key, m_per_s2, ANY),
        (Fault::RateJump { .. } | Fault::ForceJump { .. }, _) => {
            report.0.push(ScenarioError::WrongFault { key });
        }
    }
}

#[cfg(test)]
mod tests;
