//! Checks a scenario before it runs: the limits that its keys state, and what concerns several keys.

use std::sync::LazyLock;

use isotherm_correction::sample::{MAX_SENSORS, MIN_SENSORS};
use isotherm_document::{Form, Reader};

use crate::error::ScenarioError;
use crate::failure::{FailingSensor, Failure, Fault};
use crate::instrument::{Gyros, Instrument};
use crate::motion::Path;
use crate::orientation::Orientation;
use crate::reversal::Reversal;
use crate::scenario::Scenario;
use crate::temperature::Place;
use crate::vector::norm;

/// The limits that the keys state.
static FORM: LazyLock<Form> = LazyLock::new(Form::of::<Scenario>);

impl Scenario {
    /// Everything that is wrong with the scenario, of all its parts at once.
    #[must_use]
    pub fn check(&self) -> Vec<ScenarioError> {
        let mut report = Report(self.beyond_limits());
        // Exact: both are far below 2⁵³ where they are within their limits.
        #[expect(clippy::cast_precision_loss, reason = "the limits are far below 2⁵³")]
        let (tick_ns, jitter_ns) = (self.tick_ns as f64, self.tick_jitter_ns as f64);
        report.number("tick_jitter_ns", jitter_ns, [0.0, 0.25 * tick_ns.max(0.0)]);
        match self.motion.path {
            Path::Rest | Path::Coning { .. } => {}
            Path::ConstantRate { axis, .. } => report.axis("motion.path.constant_rate.axis", axis),
            Path::Sine { axis, .. } => report.axis("motion.path.sine.axis", axis),
            Path::Sculling { axis, vibration_axis, .. } => {
                report.axis("motion.path.sculling.axis", axis);
                report.axis("motion.path.sculling.vibration_axis", vibration_axis);
            }
        }
        instrument(&mut report, &self.instrument, tick_ns * 1e-9);
        for (index, failure) in self.failures.iter().enumerate() {
            failing(&mut report, &self.instrument, &format!("failures[{index}]"), failure);
        }
        report.0
    }

    /// What is beyond the limit of its key: judged as a document of the scenario would be.
    fn beyond_limits(&self) -> Vec<ScenarioError> {
        // A document has no whole number as large as a seed may be.
        let text = match toml::to_string(&Self { seed: 0, ..self.clone() }) {
            Ok(text) => text,
            Err(error) => return vec![ScenarioError { key: String::new(), message: error.to_string() }],
        };
        let mut reader = Reader::new(&text, None);
        let _: Option<Self> = reader.read(&FORM);
        let problems = reader.into_problems().unwrap_or_default().into_iter();
        problems.map(|problem| ScenarioError { key: problem.key, message: problem.message }).collect()
    }
}

/// Everything that is wrong, as it is found.
struct Report(Vec<ScenarioError>);

impl Report {
    fn add(&mut self, key: &str, message: impl Into<String>) {
        self.0.push(ScenarioError { key: key.to_owned(), message: message.into() });
    }

    fn number(&mut self, key: &str, got: f64, [low, high]: [f64; 2]) {
        if !(low..=high).contains(&got) {
            self.add(key, format!("is {got}, must be from {low} to {high}"));
        }
    }

    fn length(&mut self, key: &str, got: usize, sensors: usize) {
        if got != sensors {
            self.add(key, format!("has {got} entries for {sensors} sensors"));
        }
    }

    fn axis(&mut self, key: &str, axis: [f64; 3]) {
        if norm(axis) < 1e-9 {
            self.add(key, "has no direction");
        }
    }

    fn orientation(&mut self, key: &str, orientation: &Orientation, sensors: usize) {
        self.length(&format!("{key}.rows"), orientation.rows.len(), sensors);
        if !orientation.rows_per_k.is_empty() {
            self.length(&format!("{key}.rows_per_k"), orientation.rows_per_k.len(), sensors);
        }
        for (index, row) in orientation.rows.iter().enumerate() {
            let length = norm(*row);
            if (length - 1.0).abs() > 1e-9 || length.is_nan() {
                self.add(&format!("{key}.rows[{index}]"), format!("has the length {length}, must have 1"));
            }
        }
        let spread = orientation.spread();
        if spread < 1e-6 || spread.is_nan() {
            self.add(key, "has input axes in one plane");
        }
    }

    fn reversal(&mut self, reversal: &Reversal, tick_s: f64) {
        let key = "instrument.gyros.zeeman.reversal";
        self.number(&format!("{key}.lost_max_s"), reversal.lost_max_s, [reversal.lost_min_s, 1.0]);
        if reversal.period_s.total_cmp(&0.0).is_ne() {
            let shortest_s = reversal.lost_max_s + 8.0 * tick_s;
            self.number(&format!("{key}.period_s"), reversal.period_s, [shortest_s, 1e6]);
        }
    }
}

fn accelerometers(instrument: &Instrument) -> usize {
    instrument.accelerometers.as_ref().map_or(0, |block| block.sensors.len())
}

fn instrument(report: &mut Report, instrument: &Instrument, tick_s: f64) {
    let count = instrument.gyros.count();
    if !(MIN_SENSORS..=MAX_SENSORS).contains(&count) {
        let message = format!("has {count} sensors, must have {MIN_SENSORS} to {MAX_SENSORS}");
        report.add("instrument.gyros", message);
    }
    report.orientation("instrument.gyro_orientation", &instrument.gyro_orientation, count);
    let (key, gyros): (_, Vec<_>) = match &instrument.gyros {
        Gyros::Zeeman(unit) => {
            ("zeeman.gyros", unit.gyros.iter().map(|gyro| (gyro.scale_per_k, gyro.noise)).collect())
        }
        Gyros::FibreOptic(gyros) => {
            ("fibre_optic", gyros.iter().map(|gyro| (gyro.scale_per_k, gyro.noise)).collect())
        }
        Gyros::Mems(gyros) => ("mems", gyros.iter().map(|gyro| (gyro.scale_per_k, gyro.noise)).collect()),
    };
    for (index, ([first, second], noise)) in gyros.into_iter().enumerate() {
        let at = |field: &str| format!("instrument.gyros.{key}[{index}].{field}");
        report.number(&at("scale_per_k[0]"), first, [-2e-3, 2e-3]);
        report.number(&at("scale_per_k[1]"), second, [-5e-6, 5e-6]);
        if noise.markov_drift_rad_per_s > 0.0 {
            report.number(&at("noise.markov_correlation_s"), noise.markov_correlation_s, [1e-12, 1e12]);
        }
    }
    if let Gyros::Zeeman(unit) = &instrument.gyros {
        report.reversal(&unit.reversal, tick_s);
    }
    if let Some(block) = &instrument.accelerometers {
        let key = "instrument.accelerometers";
        report.orientation(&format!("{key}.orientation"), &block.orientation, block.sensors.len());
        for (index, sensor) in block.sensors.iter().enumerate() {
            let [ratio, rest @ ..] = sensor.board_ratio;
            let at = |field: &str| format!("{key}.sensors[{index}].{field}");
            let scale = sensor.scale_v_per_m_per_s2[0].abs();
            report.number(&at("scale_v_per_m_per_s2"), scale, [1e-12, 1e12]);
            report.number(&at("board_ratio[0]"), ratio, [1e-3, 1e3]);
            for ratio in rest {
                report.number(&at("board_ratio"), ratio, [-1e-3, 1e-3]);
            }
        }
    }
    thermometers(report, instrument, tick_s);
    let effects = &instrument.effects;
    for (key, got, sensors) in [
        ("instrument.effects.gyros", effects.gyros.len(), count),
        ("instrument.effects.accelerometers", effects.accelerometers.len(), accelerometers(instrument)),
    ] {
        if got > 0 {
            report.length(key, got, sensors);
        }
    }
}

fn thermometers(report: &mut Report, instrument: &Instrument, tick_s: f64) {
    let thermometers = &instrument.thermometers;
    report.number("instrument.thermometers.period_s", thermometers.period_s, [tick_s, 1e6]);
    let mut names: Vec<&str> =
        instrument.effects.supply.iter().map(|supply| supply.channel.as_str()).collect();
    for (index, channel) in thermometers.channels.iter().enumerate() {
        let key = format!("instrument.thermometers.channels[{index}]");
        if names.contains(&&*channel.name) {
            report.add(&format!("{key}.name"), "is also the name of another channel");
        }
        names.push(&channel.name);
        let known = match channel.place {
            Place::Chamber | Place::Housing | Place::Board => true,
            Place::Gyro(index) => index < instrument.gyros.count(),
            Place::Accelerometer(index) => index < accelerometers(instrument),
        };
        if !known {
            report
                .add(&format!("{key}.place"), format!("is {:?}: the unit has no such place", channel.place));
        }
        let raw_per_deg_c = channel.raw_per_deg_c.abs();
        report.number(&format!("{key}.raw_per_deg_c"), raw_per_deg_c, [1e-12, 1e12]);
    }
}

fn failing(report: &mut Report, instrument: &Instrument, key: &str, failure: &Failure) {
    let known = match failure.sensor {
        FailingSensor::Gyro(index) => index < instrument.gyros.count(),
        FailingSensor::Accelerometer(index) => index < accelerometers(instrument),
    };
    if !known {
        report.add(&format!("{key}.sensor"), format!("is {:?}: the unit has no such sensor", failure.sensor));
    }
    match (failure.fault, failure.sensor) {
        (Fault::RateJump { .. }, FailingSensor::Accelerometer(_))
        | (Fault::ForceJump { .. }, FailingSensor::Gyro(_)) => {
            let message = "a rate jump is for gyros, a force jump for accelerometers";
            report.add(&format!("{key}.fault"), message);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests;
