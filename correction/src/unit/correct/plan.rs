//! What the coming ticks are corrected with as long as nothing but time goes on: gathered once, sensor beside sensor.
//!
//! A plan copies what a tick would look up; it decides nothing. It holds from one tick of the general path to the next,
//! and in between only readings change: whatever else could (a temperature reading, a restart, a swap, a sensor left out)
//! takes the general path. It is no memory of the unit: a unit that was read back gathers it anew.

use alloc::boxed::Box;
use core::array;

use super::Corrector;
use crate::calibration::Calibration;
use crate::orientation::{Inverse, Orientation, SensorMask};
use crate::sample::SensorFlags;
use crate::thermal::{AccelModel, AccelThermal, GyroModel, GyroThermal, Ramp, TrendModel, share};
use crate::unit::axes::Axes;
use crate::unit::footing::Footing;
use crate::unit::thermal_memory::ThermalMemory;
use crate::units::Timestamp;

/// The plan of a unit, as wide as its sensors need; the rooms are kept.
///
/// One value for each sensor: four fill two registers of every x86-64, and suffice for most units.
#[derive(Debug, Default)]
pub(in crate::unit) struct Plan {
    holds: bool,
    four: Option<Box<Lines<4>>>,
    eight: Option<Box<Lines<8>>>,
}

/// Everything that up to `N` gyros and accelerometers are corrected with.
#[derive(Debug)]
pub(super) struct Lines<const N: usize> {
    pub(super) gyros: GyroLines<N>,
    pub(super) gyro_axes: AxesLines<N>,
    pub(super) accels: Option<(AccelLines<N>, AxesLines<N>)>,
    /// Ticks that end later rest on temperatures that are too old.
    pub(super) fresh_until: Timestamp,
}

/// How far along their lines the terms are.
#[derive(Debug)]
pub(super) struct Pace<const N: usize> {
    start: [Timestamp; N],
    per_second: [f64; N],
}

/// One term of each sensor on its straight line.
#[derive(Debug)]
pub(super) struct Line<const N: usize> {
    from: [f64; N],
    step: [f64; N],
}

/// The gyros.
#[derive(Debug)]
pub(super) struct GyroLines<const N: usize> {
    pub(super) pace: Pace<N>,
    pub(super) increment_weight: Line<N>,
    pub(super) bias: Line<N>,
    pub(super) magnetic: Line<N>,
    pub(super) meander: Line<N>,
    pub(super) limit: [f64; N],
    pub(super) temperature_deg_c: [f64; N],
    /// `None` where no gyro has one.
    pub(super) trend: Option<Trend<N>>,
    /// `None` where no gyro has one.
    pub(super) servos: Option<Servos<N>>,
}

/// The perimeter servos.
#[derive(Debug)]
pub(super) struct Servos<const N: usize> {
    /// The gyros that have one.
    pub(super) of: SensorMask,
    /// The longest time that one takes to settle (s).
    pub(super) settles_s: f64,
    /// What a settled one adds to the bias: 0, and −0, which changes no number, where there is none.
    pub(super) settled: [f64; N],
}

/// The trends: coefficients by power and gyro, held outside their intervals (s).
#[derive(Debug)]
pub(super) struct Trend<const N: usize> {
    coefficients: [[f64; N]; 3],
    from_s: [f64; N],
    to_s: [f64; N],
}

/// The accelerometers.
#[derive(Debug)]
pub(super) struct AccelLines<const N: usize> {
    pub(super) pace: Pace<N>,
    pub(super) board_pace: Pace<N>,
    pub(super) bias: Line<N>,
    pub(super) per_scale_factor: Line<N>,
    pub(super) ratio: Line<N>,
    pub(super) limit: [f64; N],
}

/// The inverse on its way, column by column; the fourth axis is none.
#[derive(Debug)]
pub(super) struct AxesLines<const N: usize> {
    start: Timestamp,
    per_second: f64,
    from: [[f64; 4]; N],
    step: [[f64; 4]; N],
    to: [[f64; 4]; N],
}

impl Plan {
    /// The lines for up to four sensors, where they hold.
    pub(super) fn four(&self) -> Option<&Lines<4>> {
        self.four.as_deref().filter(|_| self.holds)
    }

    /// The lines for more than four sensors, where they hold.
    pub(super) fn eight(&self) -> Option<&Lines<8>> {
        self.eight.as_deref().filter(|_| self.holds)
    }

    /// Holds no longer: something was changed that it has copied.
    pub(super) fn lapse(&mut self) {
        self.holds = false;
    }

    /// Holds from the next tick on, where the corrector stands so that it can.
    pub(super) fn gather(&mut self, calibration: &Calibration, corrector: &Corrector) {
        let sensors = calibration.gyros.len().max(calibration.accels.len());
        self.holds = fresh_until(corrector).is_some_and(|fresh_until| {
            if sensors <= 4 {
                renew(&mut self.four, Lines::of(calibration, &corrector.thermal, fresh_until))
            } else {
                renew(&mut self.eight, Lines::of(calibration, &corrector.thermal, fresh_until))
            }
        });
    }
}

/// Puts lines in their room, which is made with the first of them; whether there are any.
fn renew<const N: usize>(room: &mut Option<Box<Lines<N>>>, lines: Option<Lines<N>>) -> bool {
    let Some(lines) = lines else { return false };
    match room {
        Some(room) => **room = lines,
        None => *room = Some(Box::new(lines)),
    }
    true
}

/// Up to which end ticks rest on fresh temperatures; `None` where a tick must look closer: in a slew, or where a temperature
/// is missing, too old already, or outside its range.
fn fresh_until(corrector: &Corrector) -> Option<Timestamp> {
    let footings = &corrector.thermal.footings;
    let mut fresh_until = Timestamp::from_ns(i64::MAX);
    for footing in footings.gyros.iter().chain(&footings.accels) {
        let (flags, until) = footing.until();
        if flags != SensorFlags::VALID {
            return None;
        }
        fresh_until = fresh_until.min(until);
    }
    (corrector.slew.is_none() && corrector.seen.end_time < fresh_until).then_some(fresh_until)
}

impl<const N: usize> Lines<N> {
    /// As the terms stand; `None` with a sensor left out, and where a line begins so far away that differences of time
    /// saturate.
    fn of(calibration: &Calibration, thermal: &ThermalMemory, fresh_until: Timestamp) -> Option<Self> {
        let gyro_axes = AxesLines::of(&thermal.gyro_axes, &calibration.gyro_orientation)?;
        let gyros = GyroLines::of(&calibration.gyros, &thermal.gyros, &thermal.footings.gyros);
        let accels = match (&calibration.accel_orientation, &thermal.accel_axes) {
            (Some(orientation), Some(axes)) => Some((
                AccelLines::of(&calibration.accels, &thermal.accels),
                AxesLines::of(axes, orientation)?,
            )),
            (None, _) => None,
            (Some(_), None) => return None,
        };
        let near = |axes: &AxesLines<N>| axes.start.is_near();
        let accels_near = accels
            .as_ref()
            .is_none_or(|(accels, axes)| accels.pace.is_near() && accels.board_pace.is_near() && near(axes));
        let all_near = gyros.pace.is_near() && near(&gyro_axes) && accels_near;
        all_near.then_some(Self { gyros, gyro_axes, accels, fresh_until })
    }
}

/// The ramp of each sensor; where there is no sensor, zeros that stand still.
fn ramps<'a, S, const T: usize, const N: usize>(
    sensors: &'a [S],
    still: &'a Ramp<T>,
    ramp: fn(&S) -> &Ramp<T>,
) -> [&'a Ramp<T>; N] {
    array::from_fn(|i| sensors.get(i).map_or(still, ramp))
}

/// One number of each sensor; `absent` where there is none.
fn numbers<S, const N: usize>(sensors: &[S], absent: f64, number: impl Fn(&S) -> f64) -> [f64; N] {
    array::from_fn(|i| sensors.get(i).map_or(absent, &number))
}

impl<const N: usize> Pace<N> {
    fn of<const T: usize>(ramps: &[&Ramp<T>; N]) -> Self {
        Self { start: ramps.map(|ramp| ramp.pace().0), per_second: ramps.map(|ramp| ramp.pace().1) }
    }

    /// Whether no difference to a near time saturates.
    fn is_near(&self) -> bool {
        self.start.iter().all(|start| start.is_near())
    }

    /// How far along their lines the terms are at `time`, which is near, 0…1 each.
    pub(super) fn share(&self, time: Timestamp) -> [f64; N] {
        array::from_fn(|i| share(time.seconds_from_near(self.start[i]), self.per_second[i]))
    }
}

impl<const N: usize> Line<N> {
    /// The term of this number on each ramp.
    fn of<const T: usize>(ramps: &[&Ramp<T>; N], term: usize) -> Self {
        let number = |values: &[f64; T]| values.get(term).copied().unwrap_or_default();
        Self { from: ramps.map(|ramp| number(ramp.line().0)), step: ramps.map(|ramp| number(ramp.line().1)) }
    }

    /// The term so far along its line.
    pub(super) fn at(&self, share: &[f64; N]) -> [f64; N] {
        array::from_fn(|i| self.from[i] + self.step[i] * share[i])
    }
}

impl<const N: usize> GyroLines<N> {
    fn of(models: &[GyroModel], thermals: &[GyroThermal], footings: &[Footing]) -> Self {
        let ramps = ramps(thermals, const { &Ramp::hold([0.0; 4]) }, GyroThermal::ramp);
        let line = |term| Line::of(&ramps, term);
        Self {
            pace: Pace::of(&ramps),
            increment_weight: line(0),
            bias: line(1),
            magnetic: line(2),
            meander: line(3),
            limit: numbers(models, f64::INFINITY, |model| model.input_limit),
            temperature_deg_c: numbers(footings, 0.0, |footing| footing.temperature_deg_c),
            trend: models.iter().any(|model| model.trend.is_some()).then(|| Trend::of(models)),
            servos: models.iter().any(|model| model.servo.is_some()).then(|| Servos::of(models)),
        }
    }
}

impl<const N: usize> Servos<N> {
    fn of(models: &[GyroModel]) -> Self {
        let with = models.iter().enumerate().filter_map(|(i, model)| Some((i, model.servo.as_ref()?)));
        Self {
            of: with.clone().fold(SensorMask::NONE, |mask, (i, _)| mask.with(i)),
            settles_s: with.fold(0.0, |longest, (_, servo)| f64::max(longest, servo.settle_time_s())),
            settled: numbers(models, -0.0, |model| if model.servo.is_some() { 0.0 } else { -0.0 }),
        }
    }
}

impl<const N: usize> Trend<N> {
    fn of(models: &[GyroModel]) -> Self {
        fn parts(model: &GyroModel) -> (&[f64], [f64; 2]) {
            model.trend.as_ref().map(TrendModel::parts).unwrap_or_default()
        }
        let coefficient =
            |power: usize| numbers(models, 0.0, |model| parts(model).0.get(power).copied().unwrap_or(0.0));
        Self {
            coefficients: array::from_fn(coefficient),
            from_s: numbers(models, 0.0, |model| parts(model).1[0]),
            to_s: numbers(models, 0.0, |model| parts(model).1[1]),
        }
    }

    /// As [`TrendModel::at`] of each gyro; zero for one without a trend.
    pub(super) fn at(&self, since_turn_on_s: f64) -> [f64; N] {
        array::from_fn(|i| {
            let t = since_turn_on_s.max(self.from_s[i]).min(self.to_s[i]);
            self.coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c[i])
        })
    }
}

impl<const N: usize> AccelLines<N> {
    fn of(models: &[AccelModel], thermals: &[AccelThermal]) -> Self {
        let sensor = ramps(thermals, const { &Ramp::hold([0.0; 2]) }, |thermal| thermal.ramps().0);
        let board = ramps(thermals, const { &Ramp::hold([0.0]) }, |thermal| thermal.ramps().1);
        Self {
            pace: Pace::of(&sensor),
            board_pace: Pace::of(&board),
            bias: Line::of(&sensor, 0),
            per_scale_factor: Line::of(&sensor, 1),
            ratio: Line::of(&board, 0),
            limit: numbers(models, f64::INFINITY, |model| model.input_limit),
        }
    }
}

impl<const N: usize> AxesLines<N> {
    fn of(axes: &Axes, orientation: &Orientation) -> Option<Self> {
        let (ramp, from, to) = axes.of_all(orientation)?;
        let (start, per_second) = ramp.pace();
        let column = |inverse: &Inverse, i: usize| {
            let [x, y, z] = inverse.columns().get(i).copied().unwrap_or_default();
            [x, y, z, 0.0]
        };
        let step = |i| {
            let (from, to) = (column(from, i), column(to, i));
            array::from_fn(|axis| to[axis] - from[axis])
        };
        Some(Self {
            start,
            per_second,
            from: array::from_fn(|i| column(from, i)),
            step: array::from_fn(step),
            to: array::from_fn(|i| column(to, i)),
        })
    }

    /// As [`Inverse::lerp_apply`]: case axes from the readings at `time`, which is near.
    pub(super) fn resolve(&self, time: Timestamp, readings: &[f64; N]) -> [f64; 3] {
        let share = share(time.seconds_from_near(self.start), self.per_second);
        let mut sum = [0.0; 4];
        for (i, reading) in readings.iter().enumerate() {
            // At its end the line is the end itself.
            let column: [f64; 4] = if share < 1.0 {
                array::from_fn(|axis| self.from[i][axis] + self.step[i][axis] * share)
            } else {
                self.to[i]
            };
            sum = array::from_fn(|axis| sum[axis] + column[axis] * reading);
        }
        let [x, y, z, _] = sum;
        [x, y, z]
    }
}
