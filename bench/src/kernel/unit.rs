//! Units of several kinds through the state machine, on simulated ticks.

use std::path::Path;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::sample::{
    AccelTick, CorrectedTick, GyroTick, OutputKind, SensorFlags, TemperatureReading, TickFlags,
};
use isotherm_correction::thermal::Feature;
use isotherm_correction::unit::{Event, Unit, UnitSettings};
use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2};
use isotherm_protocol::document::{Curve, Document, Shape};
use isotherm_simulator::effects::{AccelerometerEffects, Effects, GyroEffects};
use isotherm_simulator::{Scenario, Simulation, presets};

use super::Kernel;
use crate::error::Error;

/// Ticks of a pass: two switches of a unit that reverses its mode every two minutes at 200 Hz.
const TICKS: usize = 48_000;
/// Gyro ticks in one event.
const BATCH: usize = 8;
/// Largest mean error of the rate over a pass (rad/s): 1 °/h, far below what is left out where a term is missing.
const LARGEST_RATE_ERROR: f64 = 4.85e-6;

/// What is handed over at once.
#[derive(Debug)]
struct Bundle {
    temperatures: Vec<TemperatureReading>,
    accels: Vec<AccelTick>,
    gyros: Vec<GyroTick>,
}

/// A unit and its ticks.
#[derive(Debug)]
pub(crate) struct UnitCase {
    name: &'static str,
    settings: UnitSettings,
    pub(super) calibration: Arc<Calibration>,
    /// What the readings of its gyros stand for.
    pub(super) output: OutputKind,
    pub(super) accel_output: OutputKind,
    bundles: Vec<Bundle>,
    truth: [f64; 3],
    /// Whether the calibration is the one that fits the simulated unit.
    fits: bool,
}

/// Unit scale along the case axes, and nothing else.
pub(crate) fn identity() -> Result<UnitCase, Error> {
    UnitCase::new("identity", "MEMS-0001.toml", strip_all, &presets::mems_chamber(1), false)
}

/// What an autopilot has, from the document of a MEMS unit.
pub(crate) fn steady() -> Result<UnitCase, Error> {
    let name = "static bias, scale, orientation";
    UnitCase::new(name, "MEMS-0001.toml", |_| {}, &presets::mems_chamber(1), true)
}

/// The same unit with what follows its motion: drift with acceleration and accelerometers away from the reference point.
pub(crate) fn in_motion() -> Result<UnitCase, Error> {
    const DEG_PER_H_PER_G: [f64; 3] = [12.0, -7.0, 4.0];
    let positions_m = [[0.03, 0.0, -0.01], [-0.01, 0.025, 0.0], [0.0, -0.02, 0.03]];
    let mut scenario = presets::mems_chamber(1);
    let one_deg_per_h_per_g = AngularRate::from_deg_per_h(1.0).as_rad_per_s() / STANDARD_GRAVITY_M_PER_S2;
    let gyro = GyroEffects {
        acceleration_rad_per_s_per_m_per_s2: DEG_PER_H_PER_G.map(|drift| drift * one_deg_per_h_per_g),
        ..GyroEffects::default()
    };
    let accel = |position_m| AccelerometerEffects { position_m, ..AccelerometerEffects::default() };
    scenario.instrument.effects = Effects {
        gyros: vec![gyro; 3],
        accelerometers: positions_m.map(accel).to_vec(),
        ..Effects::default()
    };
    let name = "the same, drift with acceleration, size effect";
    let state = |document: &mut Document| {
        for sensor in &mut document.gyro.sensor {
            let axes = [Feature::ForceX, Feature::ForceY, Feature::ForceZ];
            for (axis, value) in axes.into_iter().zip(DEG_PER_H_PER_G) {
                sensor.set(axis, Curve::new(Shape::Constant { value }));
            }
        }
        let sensors = document.accel.iter_mut().flat_map(|accel| &mut accel.sensor);
        sensors.zip(positions_m).for_each(|(sensor, position_m)| sensor.position_m = Some(position_m));
    };
    UnitCase::new(name, "MEMS-0001.toml", state, &scenario, true)
}

/// Every term of a Zeeman unit.
pub(crate) fn zeeman() -> Result<UnitCase, Error> {
    let name = "Zeeman: every term, a switch each 24 000 ticks";
    UnitCase::new(name, "ZLG-0001.toml", |_| {}, &presets::zeeman_rest(1), true)
}

/// Thermal lags.
pub(crate) fn fibre_optic() -> Result<UnitCase, Error> {
    let scenario = presets::fibre_optic_chamber(1, presets::judging_profile());
    UnitCase::new("fibre-optic: six lags per gyro", "FOG-0001.toml", |_| {}, &scenario, true)
}

/// Twice as many sensors as axes.
pub(crate) fn skewed_six() -> Result<UnitCase, Error> {
    let scenario = presets::skewed_six(1, None);
    UnitCase::new("six skewed sensors, parity", "MEMS-0001.toml", skew, &scenario, false)
}

/// Ticks summed to navigation steps.
pub(crate) fn coning_sculling() -> Result<UnitCase, Error> {
    // Four ticks are a step that there is.
    let step = NavigationStep::new(4, true).unwrap_or_default();
    let settings = UnitSettings { navigation: step, ..UnitSettings::default() };
    Ok(UnitCase { name: "coning and sculling, 4 ticks", settings, ..steady()? })
}

/// Nothing but unit scale along the case axes.
fn strip_all(document: &mut Document) {
    for sensor in &mut document.gyro.sensor {
        sensor.terms.retain(|feature| !matches!(feature, Feature::Reading | Feature::One));
    }
    document.gyro.orientation.thermal = None;
    if let Some(accel) = &mut document.accel {
        accel.orientation.thermal = None;
        for sensor in &mut accel.sensor {
            sensor.set(Feature::One, None);
            sensor.board_ratio_error = None;
        }
    }
}

/// Three more sensors of each kind, along the axes of a dodecahedron as the simulated unit has them.
fn skew(document: &mut Document) {
    let rows = isotherm_simulator::orientation::Orientation::dodecahedron().rows;
    let gyro = &mut document.gyro;
    gyro.sensor.extend(gyro.sensor.clone());
    (0..).zip(&mut gyro.sensor).for_each(|(index, sensor)| sensor.name = format!("g{index}"));
    gyro.orientation.rows.clone_from(&rows);
    gyro.orientation.thermal = None;
    if let Some(accel) = &mut document.accel {
        accel.sensor.extend(accel.sensor.clone());
        (0..).zip(&mut accel.sensor).for_each(|(index, sensor)| sensor.name = format!("a{index}"));
        accel.orientation.rows.clone_from(&rows);
        accel.orientation.thermal = None;
    }
}

impl UnitCase {
    fn new(
        name: &'static str,
        document: &str,
        change: impl FnOnce(&mut Document),
        scenario: &Scenario,
        fits: bool,
    ) -> Result<Self, Error> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/calibration").join(document);
        let text = std::fs::read_to_string(&path).map_err(|source| Error::file(&path, source))?;
        let invalid = |what: String| Error::invalid(&path, what);
        let mut document =
            Document::parse(&text, None).map_err(|found| invalid(format!("{found:?}")))?.document;
        change(&mut document);
        let calibration =
            Calibration::new(&document.to_parts()).map_err(|defects| invalid(format!("{defects:?}")))?;
        let mut bundles: Vec<Bundle> = Vec::new();
        let mut truth = [0.0; 3];
        let steps = Simulation::new(scenario).map_err(|error| invalid(error.to_string()))?;
        for (index, step) in steps.take(TICKS).enumerate() {
            if index % BATCH == 0 {
                bundles.push(Bundle { temperatures: Vec::new(), accels: Vec::new(), gyros: Vec::new() });
            }
            truth.iter_mut().zip(step.truth.delta_angle).for_each(|(sum, delta)| *sum += delta);
            if let Some(bundle) = bundles.last_mut() {
                bundle.temperatures.extend(step.temperatures);
                bundle.accels.extend(step.accel);
                bundle.gyros.push(step.gyro);
            }
        }
        Ok(Self {
            name,
            settings: UnitSettings::default(),
            calibration: Arc::new(calibration),
            output: scenario.instrument.gyros.output_kind(),
            accel_output: scenario.instrument.accel_output_kind().unwrap_or(OutputKind::Mean),
            bundles,
            truth,
            fits,
        })
    }

    /// Hands everything over; `emit` sees every corrected tick.
    fn drive(&self, emit: &mut dyn FnMut(&CorrectedTick)) {
        let mut unit = Unit::new(self.settings);
        unit.install(Arc::clone(&self.calibration), 1);
        for bundle in &self.bundles {
            if !bundle.temperatures.is_empty() {
                unit.handle(Event::Temperature(&bundle.temperatures), emit);
            }
            for accel in bundle.accels.chunks(BATCH) {
                unit.handle(Event::Accel { output: self.accel_output, ticks: accel }, emit);
            }
            unit.handle(Event::Gyro { output: self.output, ticks: &bundle.gyros }, emit);
        }
        unit.handle(Event::Flush, emit);
    }
}

impl Kernel for UnitCase {
    fn name(&self) -> &str {
        self.name
    }

    fn ticks(&self) -> usize {
        self.bundles.iter().map(|bundle| bundle.gyros.len()).sum()
    }

    #[inline(never)]
    fn pass(&mut self) -> f64 {
        let mut sum = 0.0;
        self.drive(&mut |tick| {
            sum += tick.delta_angle.iter().chain(&tick.delta_velocity).sum::<f64>();
        });
        sum
    }

    /// Every tick once and in order, sound as far as its calibration fits, and the angle that was really turned through.
    #[expect(clippy::cast_precision_loss, reason = "some ten thousand ticks")]
    fn check(&mut self) -> Result<(), Error> {
        let (mut count, mut last, mut disorder, mut unsound) = (0_u64, None::<u64>, 0_u64, 0_u64);
        let (mut angle, mut seconds) = ([0.0; 3], 0.0);
        self.drive(&mut |tick| {
            count += u64::from(tick.ticks);
            disorder += u64::from(
                last.is_some_and(|last| tick.sequence != last + u64::from(tick.ticks)) || tick.missed > 0,
            );
            last = Some(tick.sequence);
            let flagged = tick.flags.intersects(TickFlags::INTERPOLATED | TickFlags::WARM_UP);
            let sound = tick
                .gyro_flags
                .iter()
                .chain(&tick.accel_flags)
                .all(|flags| flags.contains(SensorFlags::VALID));
            unsound += u64::from(!sound && !flagged);
            angle.iter_mut().zip(tick.delta_angle).for_each(|(sum, delta)| *sum += delta);
            seconds += tick.duration.as_s();
        });
        let wrong = |what, value: f64, limit: f64| {
            let case = self.name.to_owned();
            if value > limit { Err(Error::Wrong { case, what, value, limit }) } else { Ok(()) }
        };
        wrong(
            "number of ticks that are missing or too many",
            (count as f64 - self.ticks() as f64).abs(),
            0.0,
        )?;
        wrong("number of ticks out of order", disorder as f64, 0.0)?;
        if self.fits {
            wrong("number of unsound ticks", unsound as f64, 0.0)?;
            let errors = angle.iter().zip(self.truth).map(|(angle, truth)| (angle - truth).abs() / seconds);
            wrong("mean error of the rate (rad/s)", errors.fold(0.0, f64::max), LARGEST_RATE_ERROR)?;
        }
        Ok(())
    }
}

impl UnitCase {
    /// Its gyro ticks in order.
    pub(crate) fn gyro_ticks(&self) -> impl Iterator<Item = &GyroTick> {
        self.bundles.iter().flat_map(|bundle| &bundle.gyros)
    }

    /// Its accelerometer ticks in order.
    pub(crate) fn accel_ticks(&self) -> impl Iterator<Item = &AccelTick> {
        self.bundles.iter().flat_map(|bundle| &bundle.accels)
    }

    /// Its temperature readings in order.
    pub(crate) fn temperatures(&self) -> impl Iterator<Item = &TemperatureReading> {
        self.bundles.iter().flat_map(|bundle| &bundle.temperatures)
    }

    /// Every corrected tick.
    pub(crate) fn corrected(&self) -> Vec<CorrectedTick> {
        let mut ticks = Vec::with_capacity(TICKS);
        self.drive(&mut |tick| ticks.push(tick.clone()));
        ticks
    }
}
