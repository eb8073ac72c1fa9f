//! A run at rest in cells: means of the uncorrected rate beside the columns of the fit, each between two changes of sign.
//!
//! The columns are the corrector's own: static bias (T − `T_ref`)ʲ with the coefficient 1 °/h, less the bare correction. The
//! magnetic and the slow-meander term are the same polynomials with the tick's signs, so signs times columns are theirs.

mod cutter;

use isotherm_correction::sample::TickFlags;
use isotherm_correction::thermal::Feature;
use isotherm_log::offline::Loaded;
use isotherm_protocol::document::{Curve, Document, Orientation, OrientationThermal, Shape};

use cutter::Cutter;

use crate::document::Written;
use crate::error::Error;
use crate::numbers::{mean_if_any, real};
use crate::runs::{Run, Troubles};

/// Largest power of temperature that is tried.
pub const MAX_POWER: usize = 3;
/// Seconds between the runs of one fit, so that nothing slow reaches from one to the next.
const BETWEEN_RUNS_S: f64 = 1e9;
/// Range of the columns (°C): no instrument goes there.
const ANY_DEG_C: [f64; 2] = [-200.0, 400.0];

/// Means of three gyros, each along its own input axis, between two changes of sign.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cell {
    /// Its middle (s); runs are far apart.
    pub time_s: f64,
    /// Good time in it (s).
    pub good_s: f64,
    /// Whether it follows the one before without a lost tick.
    pub joined: bool,
    /// Number of the switch that it lies behind, over all runs.
    pub stretch: usize,
    /// Sign of the lasing mode.
    pub mode: f64,
    /// Sign of the slow meander; 0 where it is not known.
    pub meander: f64,
    /// Mean rate (°/h), the Earth's not yet removed.
    pub rate: [f64; 3],
    /// Means of (T − `T_ref`)ʲ, j = 1…3 (°Cʲ).
    pub powers: [[f64; 3]; MAX_POWER],
    /// Mean dither frequency (Hz); no number without half-period counts.
    pub dither_hz: [f64; 3],
    /// Temperature that the orientation follows (°C); no number where it follows none.
    pub axes_deg_c: f64,
}

/// One second of a run: what says whether it stood still.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Second {
    /// Its middle since the beginning of the run (s).
    pub time_s: f64,
    /// Sign of the lasing mode.
    pub mode: f64,
    /// Mean rates of the three gyros (°/h).
    pub rate: [f64; 3],
    /// Mean specific force (m/s²); zero without accelerometers.
    pub force: [f64; 3],
}

/// What a run says of three gyros.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gathered {
    /// The cells.
    pub cells: Vec<Cell>,
    /// The seconds.
    pub seconds: Vec<Second>,
    /// Mean specific force in case axes (m/s²); `None` without accelerometers.
    pub force: Option<[f64; 3]>,
    /// Ticks that are there, and that are missing.
    pub ticks: [u64; 2],
    /// Ticks with a gyro that is not valid.
    pub invalid: u64,
    /// Ticks whose temperature was missing or stale.
    pub stale: u64,
    /// Ticks at which a channel of the document still had too few readings.
    pub warming_up: u64,
    /// What the correction passed over.
    pub troubles: Troubles,
}

/// How a run is cut.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cut {
    /// Longest cell (s).
    pub cell_s: f64,
    /// Time behind a switch that is left out (s), the lost ticks included.
    pub settle_s: f64,
    /// `T_ref` (°C).
    pub reference_deg_c: f64,
}

/// Three gyros at a time; the last three where the number is no multiple.
pub(crate) fn groups(sensors: usize) -> Vec<[usize; 3]> {
    let starts = (0..sensors / 3).map(|group| 3 * group);
    let last = (!sensors.is_multiple_of(3)).then(|| sensors.saturating_sub(3));
    starts.chain(last).map(|start| [start, start + 1, start + 2]).collect()
}

/// The document of three gyros along their own input axes, for a run that has no others ([`Run::of_gyros`]).
pub(crate) fn along_input_axes(document: &Document, group: [usize; 3]) -> Document {
    let mut own = document.clone();
    own.gyro.sensor = group.iter().filter_map(|sensor| document.gyro.sensor.get(*sensor).cloned()).collect();
    own.gyro.orientation = Orientation::along_case_axes();
    // It tells the gyros of all of them.
    own.self_test = None;
    own
}

/// Documents of a gathering: bare, and one for each power of temperature.
fn documents(bare: &Document, group: [usize; 3], reference: f64) -> Result<Vec<Loaded>, Error> {
    let bare = along_input_axes(bare, group);
    let mut loaded = vec![Written::compiled(&bare)?];
    for power in 1..=MAX_POWER {
        let mut document = bare.clone();
        for sensor in &mut document.gyro.sensor {
            let mut coefficients = vec![0.0; power];
            coefficients.push(1.0);
            let shape = Shape::Polynomial { reference, coefficients, range: ANY_DEG_C };
            sensor.set(Feature::One, Curve::new(shape));
        }
        loaded.push(Written::compiled(&document)?);
    }
    Ok(loaded)
}

/// Gathers some runs for three gyros under a document without the terms that are to be fitted.
///
/// # Errors
/// As [`Run::correct_together`].
pub fn gather(runs: &[Run], bare: &Document, group: [usize; 3], cut: Cut) -> Result<Gathered, Error> {
    let loaded = documents(bare, group, cut.reference_deg_c)?;
    let mut gathered = Gathered::default();
    let (mut velocity, mut force_s) = ([0.0; 3], 0.0);
    for (number, run) in runs.iter().enumerate() {
        let begin_s = real(number) * BETWEEN_RUNS_S;
        let run = run.of_gyros(group);
        let mut cutter =
            Cutter::new(cut, bare, begin_s, gathered.cells.last().map_or(0, |cell| cell.stretch + 1));
        let troubles = run.correct_together(&loaded, |raw, ticks, unit| {
            let Some(bare) = ticks.first() else { return };
            gathered.ticks[0] += 1;
            gathered.ticks[1] += bare.missed;
            if !bare.accel_flags.is_empty() && !bare.flags.contains(TickFlags::ACCELEROMETER_MISSING) {
                velocity.iter_mut().zip(bare.delta_velocity).for_each(|(sum, dv)| *sum += dv);
                force_s += bare.duration.as_s();
            }
            cutter.take(raw, ticks, unit, &mut gathered);
        })?;
        cutter.close(&mut gathered);
        gathered.troubles.extend(troubles.into_iter().next().unwrap_or_default());
    }
    gathered.force = (force_s > 0.0).then(|| velocity.map(|sum| sum / force_s));
    Ok(gathered)
}

/// Mean of the channels that an orientation follows (°C), each by its name; no number where none has one.
pub(crate) fn temperature(thermal: &OrientationThermal, of: impl Fn(&str) -> Option<f64>) -> f64 {
    let [low, high] = thermal.range_deg_c;
    let mean = mean_if_any(thermal.channels.iter().filter_map(|name| of(name)));
    mean.map_or(f64::NAN, |deg_c| deg_c.clamp(low, high))
}
