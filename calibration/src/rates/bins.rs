//! A run as short means of the rates along the gyros' own input axes, under the document that it starts from.

use isotherm_correction::sample::{SensorFlags, TickFlags};
use isotherm_correction::units::AngularRate;
use isotherm_log::offline::Loaded;
use isotherm_protocol::document::Document;

use crate::error::Error;
use crate::modes::cells::{along_input_axes, temperature};
use crate::run::{Run, Troubles, Watch};
use crate::written::Written;

/// Length of a bin (s).
pub const BIN_S: f64 = 0.5;
/// Flags of a tick that carries no reading of its own.
const NOT_OWN: TickFlags = TickFlags::INTERPOLATED
    .union(TickFlags::ANGLE_RESTORED)
    .union(TickFlags::SERVO_TRANSIENT)
    .union(TickFlags::UNCALIBRATED)
    .union(TickFlags::SWITCH_UNRESOLVED);

/// Means over a bin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bin {
    /// Its beginning since that of the run (s).
    pub begin_s: f64,
    /// Its length (s).
    pub length_s: f64,
    /// Time of its good ticks (s).
    pub good_s: f64,
    /// Mean rate of each gyro along its input axis (°/h), biases of the document subtracted.
    pub rate: Vec<f64>,
    /// Mean specific force along the case axes (m/s²); `None` without accelerometers.
    pub force: Option<[f64; 3]>,
    /// Whether ticks are missing before or in it.
    pub broken: bool,
    /// Whether a gyro was at its input limit.
    pub overrange: bool,
}

/// A run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Binned {
    /// Its bins.
    pub bins: Vec<Bin>,
    /// Mean specific force over the first second (m/s²), for levelling; `None` without accelerometers.
    pub first_force: Option<[f64; 3]>,
    /// Mean temperature that the orientation follows (°C), and mean temperatures of all channels by name.
    pub axes_deg_c: Option<f64>,
    /// Mean temperature of all channels (°C).
    pub temperature_deg_c: Option<f64>,
    /// What the correction passed over.
    pub troubles: Troubles,
}

/// Bins a run. `watch` is asked for each reading of it.
///
/// # Errors
/// As [`Run::correct`].
pub fn binned<W: Watch>(
    run: &Run,
    document: &Document,
    mut watch: impl FnMut() -> W,
) -> Result<Binned, Error> {
    let sensors = document.gyro.sensor.len();
    let mut whole = Binned::default();
    let starts = (0..sensors).step_by(3).map(|start| start.min(sensors.saturating_sub(3)));
    for start in starts {
        let group = [start, start + 1, start + 2];
        let part = of_group(run, document, group, watch())?;
        if whole.bins.is_empty() {
            whole = part;
            whole.bins.iter_mut().for_each(|bin| bin.rate.resize(sensors, f64::NAN));
            for bin in &mut whole.bins {
                let own = [bin.rate[0], bin.rate[1], bin.rate[2]];
                group.into_iter().zip(own).for_each(|(sensor, rate)| bin.rate[sensor] = rate);
            }
        } else {
            for (bin, of) in whole.bins.iter_mut().zip(&part.bins) {
                group.into_iter().zip(&of.rate).for_each(|(sensor, rate)| bin.rate[sensor] = *rate);
            }
        }
    }
    Ok(whole)
}

#[derive(Default)]
struct Sums {
    begin_s: f64,
    length_s: f64,
    good_s: f64,
    angle: [f64; 3],
    velocity: [f64; 3],
    force_s: f64,
    broken: bool,
    overrange: bool,
}

fn of_group(run: &Run, document: &Document, group: [usize; 3], watch: impl Watch) -> Result<Binned, Error> {
    let loaded = Written::of(&along_input_axes(document, group))?.loaded;
    let thermal = document.gyro.orientation.thermal.clone();
    let mut binned = Binned::default();
    let mut sums = Sums::default();
    let mut first = None;
    let (mut velocity, mut force_s) = ([0.0; 3], 0.0);
    let (mut of_axes, mut of_all) = (Mean::default(), Mean::default());
    let troubles = run.of_gyros(group).correct(&loaded, watch, |tick, unit| {
        let begin = tick.end_time.as_ns().saturating_sub(tick.duration.as_ns());
        #[expect(clippy::cast_precision_loss, reason = "a run is far below 2⁵³ ns")]
        let since_s = (begin - *first.get_or_insert(begin)) as f64 * 1e-9;
        let seconds = tick.duration.as_s();
        if sums.length_s <= 0.0 {
            sums.begin_s = since_s;
        }
        sums.length_s += seconds;
        sums.broken |= tick.missed > 0;
        sums.overrange |= tick.gyro_flags.iter().any(|flags| flags.contains(SensorFlags::OVERRANGE));
        let valid = tick.gyro_flags.iter().all(|flags| flags.contains(SensorFlags::VALID));
        if valid && !tick.flags.intersects(NOT_OWN) {
            sums.good_s += seconds;
            sums.angle.iter_mut().zip(tick.delta_angle).for_each(|(sum, angle)| *sum += angle);
        }
        if !tick.accel_flags.is_empty() && !tick.flags.contains(TickFlags::ACCELEROMETER_MISSING) {
            sums.velocity.iter_mut().zip(tick.delta_velocity).for_each(|(sum, dv)| *sum += dv);
            sums.force_s += seconds;
            if force_s < 1.0 {
                velocity.iter_mut().zip(tick.delta_velocity).for_each(|(sum, dv)| *sum += dv);
                force_s += seconds;
            }
        }
        if sums.length_s > BIN_S - 0.5 * seconds {
            let Sums { begin_s, length_s, good_s, angle, velocity, force_s, broken, overrange } =
                std::mem::take(&mut sums);
            let rate = angle.map(|sum| AngularRate::from_rad_per_s(sum / good_s).as_deg_per_h()).to_vec();
            let force = (force_s > 0.0).then(|| velocity.map(|sum| sum / force_s));
            binned.bins.push(Bin { begin_s, length_s, good_s, rate, force, broken, overrange });
            if let Some(thermal) = &thermal {
                of_axes.add(temperature(thermal, unit));
            }
            unit.channels()
                .filter_map(|channel| channel.state)
                .for_each(|state| of_all.add(state.temperature));
        }
    })?;
    binned.troubles = troubles;
    binned.axes_deg_c = of_axes.value();
    binned.temperature_deg_c = of_all.value();
    binned.first_force = (force_s > 0.0).then(|| velocity.map(|sum| sum / force_s));
    Ok(binned)
}

#[derive(Default)]
struct Mean(f64, f64);

impl Mean {
    fn add(&mut self, value: f64) {
        if value.is_finite() {
            *self = Self(self.0 + value, self.1 + 1.0);
        }
    }

    fn value(&self) -> Option<f64> {
        (self.1 > 0.0).then(|| self.0 / self.1)
    }
}

/// Mean corrected rates in case axes (°/h) over windows of a run (s since its beginning), by the ticks whose middle lies
/// in them.
///
/// # Errors
/// As [`Run::correct`].
pub fn means_within(
    run: &Run,
    loaded: &Loaded,
    windows: &[[f64; 2]],
    watch: impl Watch,
) -> Result<Vec<[f64; 3]>, Error> {
    let mut sums = vec![([0.0; 3], 0.0); windows.len()];
    let mut first = None;
    run.correct(loaded, watch, |tick, _| {
        let begin = tick.end_time.as_ns().saturating_sub(tick.duration.as_ns());
        #[expect(clippy::cast_precision_loss, reason = "a run is far below 2⁵³ ns")]
        let since_s = (begin - *first.get_or_insert(begin)) as f64 * 1e-9;
        let seconds = tick.duration.as_s();
        let middle_s = since_s + 0.5 * seconds;
        for ([from_s, to_s], (sum, time_s)) in windows.iter().zip(&mut sums) {
            if (*from_s..*to_s).contains(&middle_s) {
                *time_s += seconds;
                sum.iter_mut().zip(tick.delta_angle).for_each(|(sum, angle)| *sum += angle);
            }
        }
    })?;
    let mean =
        |(sum, time_s): ([f64; 3], f64)| sum.map(|x| AngularRate::from_rad_per_s(x / time_s).as_deg_per_h());
    Ok(sums.into_iter().map(mean).collect())
}
