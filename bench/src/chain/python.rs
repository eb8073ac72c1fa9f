//! What a user would write: `bench/python/relay.py`, in a virtual environment under the target folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use isotherm_protocol::codec;
use isotherm_protocol::raw::{AccelBatch, GyroBatch};
use serde::Serialize;

use crate::error::Error;
use crate::part::Plan;
use crate::part::frames::Message;
use crate::process::this;

/// What a bench's scripts stand in.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("python")
}

/// One constant bias, scale and orientation for each sensor: that is what users begin with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Constants {
    /// Gyro biases (rad/s).
    gyro_bias: [f64; 3],
    /// Gyro increment weights (rad per rad).
    gyro_weight: [f64; 3],
    /// From gyro axes to case axes.
    gyro_axes: [[f64; 3]; 3],
    /// Accelerometer biases (m/s²).
    accel_bias: [f64; 3],
    /// Accelerometer scale factors (m/s² per m/s²).
    accel_scale: [f64; 3],
    /// From accelerometer axes to case axes.
    accel_axes: [[f64; 3]; 3],
}

/// 1 °/h in rad/s.
const DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;

impl Constants {
    /// Those of MEMS-0001 at 25 °C; axes to first order in the angles between them.
    pub(crate) const OF_MEMS: Self = Self {
        gyro_bias: [90.0 * DEG_PER_H, -72.0 * DEG_PER_H, 45.0 * DEG_PER_H],
        gyro_weight: [1.0015, 0.9988, 1.000_75],
        gyro_axes: [[1.0, -0.00008, -0.00021], [0.00024, 1.0, 0.00009], [-0.00007, 0.0002, 1.0]],
        accel_bias: [0.078_453_2, -0.054_917_24, 0.031_381_28],
        accel_scale: [1.002, 0.9986, 1.0008],
        accel_axes: [[1.0, -0.00004, -0.000_105], [0.00012, 1.0, 0.000_045], [-0.000_035, 0.0001, 1.0]],
    };

    /// Angle and velocity increments of the ticks of a message, with their sequence numbers.
    pub(crate) fn correct(&self, message: &Message) -> Vec<(u64, [f64; 6])> {
        let (Ok(gyro), Ok(accel)) =
            (codec::decode::<GyroBatch>(&message.gyro), codec::decode::<AccelBatch>(&message.accel))
        else {
            return Vec::new();
        };
        let first = gyro.ticks.first().map_or(0, |first| first.sequence);
        let gyro = gyro.ticks.iter().map(|tick| (three(&tick.readings), tick.duration.as_s()));
        let accel = accel.ticks.iter().map(|tick| three(&tick.readings));
        let ticks = gyro.zip(accel).map(|((rate, duration), force)| {
            let angle: [f64; 3] = std::array::from_fn(|axis| {
                (rate[axis] * self.gyro_weight[axis] - self.gyro_bias[axis]) * duration
            });
            let velocity: [f64; 3] = std::array::from_fn(|axis| {
                (force[axis] - self.accel_bias[axis]) / self.accel_scale[axis] * duration
            });
            let (angle, velocity) = (turn(&self.gyro_axes, angle), turn(&self.accel_axes, velocity));
            std::array::from_fn(|place| *angle.iter().chain(&velocity).nth(place).unwrap_or(&f64::NAN))
        });
        (first..).zip(ticks).collect()
    }
}

/// The first three readings.
fn three(readings: &[f64]) -> [f64; 3] {
    let mut readings = readings.iter();
    std::array::from_fn(|_| readings.next().copied().unwrap_or(f64::NAN))
}

/// Rows times a vector.
fn turn(rows: &[[f64; 3]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    rows.map(|[a, b, c]| a * x + b * y + c * z)
}

/// The script in the middle of a chain.
pub(crate) fn relay(plan: &Plan) -> Result<Command, Error> {
    let constants = plan.folder.join("constants.json");
    let text = serde_json::to_string(&Constants::OF_MEMS).unwrap_or_default();
    fs::write(&constants, text).map_err(|source| Error::file(&constants, source))?;
    let mut command = Command::new(interpreter()?);
    command.arg("-B").arg(folder().join("relay.py")).arg("--constants").arg(constants);
    if plan.case.is_saturated() {
        command.arg("--block");
    }
    Ok(command)
}

/// An interpreter that has what the scripts need; makes its environment where there is none.
pub(crate) fn interpreter() -> Result<PathBuf, Error> {
    let skipped = Error::of("python");
    let profile = this()?;
    let target = profile.ancestors().nth(2).map(Path::to_owned).unwrap_or_default();
    let environment = target.join("bench-venv");
    let python = environment.join("bin/python");
    if works(&python) {
        return Ok(python);
    }
    let made = quietly(Command::new("python3").args(["-m", "venv"]).arg(&environment));
    made.map_err(|what| skipped(format!("python3 -m venv: {what}")))?;
    let mut pip = Command::new(environment.join("bin/pip"));
    pip.args(["install", "--quiet", "--disable-pip-version-check", "--requirement"]);
    pip.arg(folder().join("requirements.txt"));
    quietly(&mut pip).map_err(|what| skipped(format!("pip install: {what}")))?;
    if works(&python) { Ok(python) } else { Err(skipped("zenoh and numpy cannot be imported".to_owned())) }
}

fn works(python: &Path) -> bool {
    quietly(Command::new(python).args(["-c", "import numpy, zenoh"])).is_ok()
}

/// Runs a command to its end; the last line that it says, where it fails.
fn quietly(command: &mut Command) -> Result<(), String> {
    let output = command.stdin(Stdio::null()).output().map_err(|error| error.to_string())?;
    if output.status.success() {
        return Ok(());
    }
    let words = String::from_utf8_lossy(&output.stderr);
    Err(words.lines().last().unwrap_or("failed without a word").to_owned())
}
