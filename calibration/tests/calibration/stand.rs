//! A simulated two-axis stand: a unit is turned from position to position, each turn and each rest by the simulator.
//!
//! The stand's kinematics are written out here a second time, with rotation matrices from north, east, down to the case, so that
//! the plan's own formula is not what it is tested with.

pub(crate) mod judging;

use std::collections::BTreeMap;

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::plan::{Attitude, Plan};
use isotherm_calibration::runs::Run;
use isotherm_correction::thermal::Feature;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{AccelOutput, Curve, Document, Shape};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::instrument::Instrument;
use isotherm_simulator::motion::{Motion, Path};
use isotherm_simulator::orientation::Orientation;
use isotherm_simulator::presets::{mems_chamber, zeeman_rest};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::simulated_logs::{self, events_after};

/// Gravity of the stand (m/s²).
pub(crate) const GRAVITY: f64 = 9.8154;
pub(crate) const ARCSEC: f64 = core::f64::consts::PI / 648_000.0;
/// Pulse rate of the accelerometers' converters (Hz/V).
pub(crate) const HZ_PER_V: f64 = 5.0e5;

/// Random numbers that follow from a seed.
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def0)
    }

    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        radius * libm::cos(core::f64::consts::TAU * self.uniform())
    }

    pub(crate) fn vector(&mut self, sigma: f64) -> [f64; 3] {
        [0, 1, 2].map(|_| self.normal() * sigma)
    }
}

/// How a stand is driven.
#[derive(Clone)]
pub(crate) struct Stand {
    pub(crate) errors: [f64; 3],
    /// Standard deviation of each position about each axis (rad).
    pub(crate) positioning: f64,
    pub(crate) tick_ns: i64,
    pub(crate) hold_s: f64,
    /// How much longer the first position is held (s).
    pub(crate) start_s: f64,
    /// Speed of the turns between positions (°/s); `None` where the log has no way from one to the next.
    pub(crate) turn_deg_per_s: Option<f64>,
    pub(crate) seed: u64,
}

/// The unit on the stand: quartz accelerometers with a pulse output, micromechanical gyros.
pub(crate) fn instrument() -> Instrument {
    let quartz = zeeman_rest(0).instrument.accelerometers;
    Instrument { accelerometers: quartz, ..mems_chamber(0).instrument }
}

/// The same with axes as they are at some temperature.
pub(crate) fn with_axes(rows: &[[f64; 3]; 3]) -> Instrument {
    let mut instrument = instrument();
    instrument.accelerometers.as_mut().unwrap().orientation = Orientation::fixed(rows.to_vec());
    instrument
}

/// True axes of three accelerometers at a housing temperature.
pub(crate) fn true_rows(instrument: &Instrument, housing_deg_c: f64) -> [[f64; 3]; 3] {
    all_rows(&instrument.accelerometers.as_ref().unwrap().orientation, housing_deg_c).try_into().unwrap()
}

/// True axes at a housing temperature.
pub(crate) fn all_rows(orientation: &Orientation, housing_deg_c: f64) -> Vec<[f64; 3]> {
    let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        .map(|unit| orientation.project(unit, housing_deg_c));
    (0..columns[0].len()).map(|sensor| [0, 1, 2].map(|axis| columns[axis][sensor])).collect()
}

/// The unit's document before anything was calibrated: one nominal scale factor, no bias, axes along the case.
pub(crate) fn document() -> Document {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
    let mut document = Written::read(path.as_ref()).unwrap().document;
    let accel = document.accel.as_mut().unwrap();
    accel.output = AccelOutput::Counts;
    for (index, sensor) in accel.sensor.iter_mut().enumerate() {
        let nominal = Shape::Constant { value: 0.102 * HZ_PER_V };
        sensor.scale_factor = Curve::new(nominal).in_unit(AccelOutput::Counts.scale_unit());
        sensor.set(Feature::One, None);
        sensor.channel = Some(format!("accel{index}"));
        let Shape::Polynomial { range, .. } =
            document.gyro.sensor[0].terms.curve(Feature::One).unwrap().shape()
        else {
            unreachable!()
        };
        // The board's ratio is known from another calibration.
        let truth = instrument().accelerometers.unwrap().sensors[index];
        let coefficients = vec![0.0, truth.board_ratio[1] * 1e6, truth.board_ratio[2] * 1e6];
        let ratio = Shape::Polynomial { reference: truth.reference_deg_c, coefficients, range: *range };
        sensor.board_ratio_error = Some(Curve::new(ratio));
    }
    accel.orientation.rows = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    accel.orientation.thermal = None;
    document
}

/// Rotation from north, east, down to the case in a position.
fn attitude(plan: &Plan, position: usize, errors: [f64; 3]) -> Matrix3<f64> {
    let Attitude::Stand([first, second]) = plan.positions[position].attitude else { unreachable!() };
    let [level, tilt, square] = errors;
    // Stand axes: axis 2 to the north, axis 1 up, the third one to the east.
    let base = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
    let about = |axis: Vector3<f64>, angle: f64| *Rotation3::new(axis * angle).matrix();
    let (e1, e2, e3) = (Vector3::x(), Vector3::y(), Vector3::z());
    let turned = about(e2, -first) * about(e3, -square) * about(e1, -(second + level)) * about(e3, -tilt);
    // Case x along axis 2, y along axis 1, z along their cross product.
    turned * base
}

/// Motion at rest in an attitude.
fn motion(level_to_case: &Matrix3<f64>) -> Motion {
    let l = level_to_case;
    let level = libm::hypot(l[(0, 0)], l[(0, 1)]);
    let pitch = libm::atan2(-l[(0, 2)], level);
    let (heading, roll) = if level < 1e-12 {
        (0.0, libm::atan2(-l[(0, 2)].signum() * -l[(1, 0)], l[(1, 1)]))
    } else {
        (libm::atan2(l[(0, 1)], l[(0, 0)]), libm::atan2(l[(1, 2)], l[(2, 2)]))
    };
    Motion {
        gravity_m_per_s2: GRAVITY,
        heading_deg: heading.to_degrees(),
        pitch_deg: pitch.to_degrees(),
        roll_deg: roll.to_degrees(),
        ..Motion::rest(55.75)
    }
}

/// A log of positions at one temperature, with the times from when to when each was held.
pub(crate) fn log(
    instrument: &Instrument,
    chamber_deg_c: f64,
    plan: &Plan,
    order: &[usize],
    stand: &Stand,
) -> (Vec<LogEvent>, Vec<([f64; 2], usize)>) {
    let mut dice = Dice::new(stand.seed);
    let attitudes: Vec<Matrix3<f64>> = order
        .iter()
        .map(|position| {
            let error = Vector3::from(dice.vector(stand.positioning));
            Rotation3::new(error).matrix() * attitude(plan, *position, stand.errors)
        })
        .collect();
    let (events, spans) = through(instrument, chamber_deg_c, &attitudes, stand);
    (events, spans.into_iter().zip(order.iter().copied()).collect())
}

/// A log of attitudes (north, east, down to the case), each held; with the times. The first is held `start_s` longer.
pub(crate) fn through(
    instrument: &Instrument,
    chamber_deg_c: f64,
    attitudes: &[Matrix3<f64>],
    stand: &Stand,
) -> (Vec<LogEvent>, Vec<[f64; 2]>) {
    let tick_s = stand.tick_ns as f64 * 1e-9;
    let (mut events, mut held) = (Vec::new(), Vec::new());
    let (mut sequence, mut time_ns, mut segment) = (0_u64, 0_i64, 0_u64);
    let mut play = |motion: Motion, ticks: i64, events: &mut Vec<LogEvent>| -> [f64; 2] {
        let scenario = Scenario {
            seed: stand.seed.wrapping_mul(1000).wrapping_add(segment),
            start_ns: time_ns,
            duration_s: ticks as f64 * tick_s,
            tick_ns: stand.tick_ns,
            chamber: Profile::constant(chamber_deg_c),
            motion,
            instrument: instrument.clone(),
            ..mems_chamber(0)
        };
        let is_read_before = |event: &LogEvent| matches!(event, LogEvent::Temperature(reading) if reading.time.as_ns() <= time_ns);
        let first = segment == 0;
        events.extend(events_after(&scenario, sequence).filter(|event| first || !is_read_before(event)));
        let begin = time_ns as f64 * 1e-9;
        sequence += ticks.unsigned_abs();
        time_ns += ticks * stand.tick_ns;
        segment += 1;
        [begin, time_ns as f64 * 1e-9]
    };
    for (index, level_to_case) in attitudes.iter().enumerate() {
        if let (Some(speed), true) = (stand.turn_deg_per_s, index > 0) {
            let before = &attitudes[index - 1];
            // Half a turn has no axis in a rotation matrix, but in a quaternion it has.
            let seen = Rotation3::from_matrix_unchecked(level_to_case * before.transpose());
            let seen = UnitQuaternion::from_rotation_matrix(&seen);
            if let Some((axis, angle)) = seen.axis_angle() {
                // Components of what stands still turn the other way.
                let length = (angle.to_degrees() / speed / tick_s).ceil().max(1.0) as i64;
                let rate = angle.to_degrees() / (length as f64 * tick_s);
                let path = Path::ConstantRate { axis: (-axis.into_inner()).into(), rate_deg_per_s: rate };
                play(motion(before).along(path), length, &mut events);
            }
        }
        let hold_s = if index == 0 { stand.hold_s + stand.start_s } else { stand.hold_s };
        held.push(play(motion(level_to_case), (hold_s / tick_s).round() as i64, &mut events));
    }
    (events, held)
}

/// The log as a run.
pub(crate) fn run(name: &str, events: Vec<LogEvent>) -> Run {
    simulated_logs::run(name, "MEMS-0001", events)
}

/// A random attitude.
pub(crate) fn any_attitude(dice: &mut Dice) -> Matrix3<f64> {
    let [w, x, y] = dice.vector(1.0);
    let [z, ..] = dice.vector(1.0);
    *UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z)).to_rotation_matrix().matrix()
}

/// The log as a text file with its mapping.
pub(crate) fn as_text(events: &[LogEvent], counts: bool) -> (String, String) {
    use std::fmt::Write;
    let (mut text, mut temperatures) = (String::from("t,gx,gy,gz,ax,ay,az"), BTreeMap::new());
    for event in events {
        if let LogEvent::Temperature(reading) = event {
            temperatures.insert(reading.channel.to_string(), f64::NAN);
        }
    }
    for name in temperatures.keys() {
        write!(text, ",{name}").unwrap();
    }
    text.push('\n');
    let mut force = [0.0; 3];
    for event in events {
        match event {
            LogEvent::Temperature(reading) => {
                temperatures.insert(reading.channel.to_string(), reading.raw);
            }
            LogEvent::Accel { tick, .. } => force.copy_from_slice(&tick.readings),
            LogEvent::Gyro { tick, .. } => {
                write!(text, "{}", tick.end_time.as_ns()).unwrap();
                tick.readings.iter().chain(&force).for_each(|value| write!(text, ",{value}").unwrap());
                for value in temperatures.values() {
                    write!(text, ",{value}").unwrap();
                }
                text.push('\n');
            }
        }
    }
    let sensors = |letter: char, unit: &str| {
        let one = |axis: char| format!("{{ column = \"{letter}{axis}\", unit = \"{unit}\" }}");
        ['x', 'y', 'z'].map(one).join(", ")
    };
    let (output, unit) = if counts { ("counts", "counts") } else { ("mean", "m_per_s2") };
    let mut mapping = format!(
        "version = 1\ndescription = \"a simulated stand\"\n[[file]]\nname = \"log.csv\"\ndelimiter = \"comma\"\nheader = true\n\
         [file.time]\ncolumn = \"t\"\nunit = \"ns\"\ntick_ms = 100\n[file.gyro]\noutput = \"mean\"\nsensors = [{}]\n\
         [file.accel]\noutput = \"{output}\"\nsensors = [{}]\n",
        sensors('g', "rad_per_s"),
        sensors('a', unit)
    );
    for name in temperatures.keys() {
        write!(mapping, "[[file.temperature]]\nchannel = \"{name}\"\ncolumn = \"{name}\"\nunit = \"volt\"\nevery_rows = 10\n").unwrap();
    }
    (text, mapping)
}
