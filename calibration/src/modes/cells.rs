//! A run at rest in cells: means of the uncorrected rate beside the columns of the fit, each between two changes of sign.
//!
//! The columns are the corrector's own: static bias (T − `T_ref`)ʲ with the coefficient 1 °/h, less the bare correction. The
//! magnetic and the slow-meander term are the same polynomials with the tick's signs, so signs times columns are theirs.

use isotherm_correction::sample::{CorrectedTick, GyroTick, LasingMode, SensorFlags, TickFlags};
use isotherm_correction::unit::Unit;
use isotherm_correction::units::AngularRate;
use isotherm_log::offline::Loaded;
use isotherm_protocol::document::{Curve, Document, OrientationThermal, Shape};

use super::switches::dither_hz;
use crate::error::Error;
use crate::run::{Run, Troubles, Watch};
use crate::written::Written;

/// Largest power of temperature that is tried.
pub const MAX_POWER: usize = 3;
/// Seconds between the runs of one fit, so that nothing slow reaches from one to the next.
const BETWEEN_RUNS_S: f64 = 1e9;
/// Range of the columns (°C): no instrument goes there.
const ANY_DEG_C: [f64; 2] = [-200.0, 400.0];
/// Flags of a tick whose readings are not those of a settled instrument.
const UNSETTLED: TickFlags = TickFlags::INTERPOLATED
    .union(TickFlags::ANGLE_RESTORED)
    .union(TickFlags::SERVO_TRANSIENT)
    .union(TickFlags::WARM_UP)
    .union(TickFlags::UNCALIBRATED)
    .union(TickFlags::SWITCH_UNRESOLVED);

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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Longest cell (s).
    pub cell_s: f64,
    /// Time behind a switch that is left out (s), the lost ticks included.
    pub settle_s: f64,
    /// `T_ref` (°C).
    pub reference_deg_c: f64,
}

/// The document as it is for three gyros along their own input axes, the others as good as absent.
pub(crate) fn along_input_axes(document: &Document, group: [usize; 3]) -> Document {
    let mut own = document.clone();
    let orientation = &mut own.gyro.orientation;
    let axis = |sensor: usize| group.iter().position(|member| *member == sensor);
    let unit = |axis: usize| [0, 1, 2].map(|column| if column == axis { 1.0 } else { 0.0 });
    let count = own.gyro.sensor.len();
    orientation.rows = (0..count).map(|sensor| unit(axis(sensor).unwrap_or(0))).collect();
    orientation.weights = (count > 3)
        .then(|| (0..count).map(|sensor| if axis(sensor).is_some() { 1.0 } else { 1e-24 }).collect());
    orientation.thermal = None;
    orientation.parity = None;
    own
}

/// Documents of a gathering: bare, and one for each power of temperature.
fn documents(bare: &Document, group: [usize; 3], reference: f64) -> Result<Vec<Loaded>, Error> {
    let bare = along_input_axes(bare, group);
    let mut loaded = vec![Written::of(&bare)?.loaded];
    for power in 1..=MAX_POWER {
        let mut document = bare.clone();
        for sensor in &mut document.gyro.sensor {
            let mut coefficients = vec![0.0; power];
            coefficients.push(1.0);
            sensor.static_bias =
                Some(Curve::new(Shape::Polynomial { reference, coefficients, range: ANY_DEG_C }));
        }
        loaded.push(Written::of(&document)?.loaded);
    }
    Ok(loaded)
}

/// Gathers some runs for three gyros under a document without the terms that are to be fitted.
///
/// # Errors
/// As [`Run::correct_together`].
pub fn gather<W: Watch>(
    runs: &[Run],
    bare: &Document,
    group: [usize; 3],
    cut: Cut,
    mut watch: impl FnMut() -> W,
) -> Result<Gathered, Error> {
    let loaded = documents(bare, group, cut.reference_deg_c)?;
    let mut gathered = Gathered::default();
    let (mut velocity, mut force_s) = ([0.0; 3], 0.0);
    for (number, run) in runs.iter().enumerate() {
        #[expect(clippy::cast_precision_loss, reason = "few runs")]
        let begin_s = number as f64 * BETWEEN_RUNS_S;
        let mut knife =
            Knife::new(cut, group, bare, begin_s, gathered.cells.last().map_or(0, |cell| cell.stretch + 1));
        let troubles = run.correct_together(&loaded, watch(), |raw, ticks, unit| {
            let Some(bare) = ticks.first() else { return };
            gathered.ticks[0] += 1;
            gathered.ticks[1] += bare.missed;
            if !bare.accel_flags.is_empty() && !bare.flags.contains(TickFlags::ACCELEROMETER_MISSING) {
                velocity.iter_mut().zip(bare.delta_velocity).for_each(|(sum, dv)| *sum += dv);
                force_s += bare.duration.as_s();
            }
            knife.take(raw, ticks, unit, &mut gathered);
        })?;
        knife.close(&mut gathered);
        gathered.troubles.extend(troubles);
    }
    gathered.force = (force_s > 0.0).then(|| velocity.map(|sum| sum / force_s));
    Ok(gathered)
}

/// What gathers in a cell or a second.
#[derive(Debug, Clone, Default)]
struct Sums {
    begin_s: Option<f64>,
    good_s: f64,
    angle: [f64; 3],
    columns: [[f64; 3]; MAX_POWER],
    cycles: [f64; 3],
    velocity: [f64; 3],
}

impl Sums {
    fn add(&mut self, begin_s: f64, ticks: &[CorrectedTick], dither: [f64; 3]) {
        let Some(bare) = ticks.first() else { return };
        let seconds = bare.duration.as_s();
        self.begin_s.get_or_insert(begin_s);
        self.good_s += seconds;
        for axis in 0..3 {
            self.angle[axis] += bare.delta_angle[axis];
            self.velocity[axis] += bare.delta_velocity[axis];
            self.cycles[axis] += dither[axis] * seconds;
            for (column, with) in self.columns.iter_mut().zip(ticks.iter().skip(1)) {
                column[axis] += bare.delta_angle[axis] - with.delta_angle[axis];
            }
        }
    }

    fn rates(&self, sums: [f64; 3]) -> [f64; 3] {
        sums.map(|sum| AngularRate::from_rad_per_s(sum / self.good_s).as_deg_per_h())
    }
}

/// Cuts one run.
struct Knife {
    cut: Cut,
    group: [usize; 3],
    axes: Option<OrientationThermal>,
    begin_s: f64,
    first_ns: Option<i64>,
    signs: Option<(LasingMode, Option<LasingMode>)>,
    switched_ns: Option<i64>,
    stretch: usize,
    joined: bool,
    cell: Sums,
    second: Sums,
    axes_deg_c: f64,
}

impl Knife {
    fn new(cut: Cut, group: [usize; 3], bare: &Document, begin_s: f64, stretch: usize) -> Self {
        Self {
            cut,
            group,
            axes: bare.gyro.orientation.thermal.clone(),
            begin_s,
            first_ns: None,
            signs: None,
            switched_ns: None,
            stretch,
            joined: false,
            cell: Sums::default(),
            second: Sums::default(),
            axes_deg_c: f64::NAN,
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "a run is far below 2⁵³ ns")]
    fn take(&mut self, raw: &GyroTick, ticks: &[CorrectedTick], unit: &Unit, gathered: &mut Gathered) {
        let Some(bare) = ticks.first() else { return };
        let begin_ns = bare.end_time.as_ns().saturating_sub(bare.duration.as_ns());
        let first_ns = *self.first_ns.get_or_insert(begin_ns);
        let since_s = (begin_ns - first_ns) as f64 * 1e-9;
        let signs = bare.mode.map(|mode| (mode, raw.meander));
        if signs != self.signs {
            self.close(gathered);
            if signs.map(|s| s.0) != self.signs.map(|s| s.0) {
                self.joined = false;
                self.stretch += 1;
                self.switched_ns = self.signs.is_some().then_some(begin_ns);
            }
            self.signs = signs;
        }
        let settling =
            self.switched_ns.is_some_and(|switch| ((begin_ns - switch) as f64 * 1e-9) < self.cut.settle_s);
        let flags = |any: SensorFlags| bare.gyro_flags.iter().any(|flags| flags.intersects(any));
        let invalid = bare.gyro_flags.iter().any(|flags| !flags.contains(SensorFlags::VALID));
        let stale = flags(SensorFlags::STALE_TEMPERATURE);
        gathered.invalid += u64::from(invalid && !bare.flags.contains(TickFlags::INTERPOLATED));
        gathered.stale += u64::from(stale);
        gathered.warming_up += u64::from(bare.flags.contains(TickFlags::WARM_UP));
        if bare.flags.intersects(UNSETTLED)
            || settling
            || invalid
            || stale
            || signs.is_none()
            || bare.missed > 0
        {
            self.close(gathered);
            self.joined = false;
            if bare.missed == 0 {
                return;
            }
        }
        if let Some(thermal) = &self.axes {
            self.axes_deg_c = temperature(thermal, unit);
        }
        let dither = self.group.map(|sensor| dither_hz(raw, sensor).unwrap_or(f64::NAN));
        self.second.add(since_s, ticks, dither);
        self.cell.add(since_s, ticks, dither);
        if self.second.good_s > 1.0 - 0.5 * bare.duration.as_s() {
            self.close_second(gathered);
        }
        if self.cell.good_s > self.cut.cell_s - 0.5 * bare.duration.as_s() {
            self.close_cell(gathered);
        }
    }

    fn close(&mut self, gathered: &mut Gathered) {
        self.close_cell(gathered);
        // The rest of a second before a switch is too short to be compared.
        self.second = Sums::default();
    }

    fn close_second(&mut self, gathered: &mut Gathered) {
        let sums = std::mem::take(&mut self.second);
        let (Some(begin_s), Some((mode, _))) = (sums.begin_s, self.signs) else { return };
        gathered.seconds.push(Second {
            time_s: begin_s + 0.5 * sums.good_s,
            mode: mode.sign(),
            rate: sums.rates(sums.angle),
            force: sums.velocity.map(|sum| sum / sums.good_s),
        });
    }

    fn close_cell(&mut self, gathered: &mut Gathered) {
        let sums = std::mem::take(&mut self.cell);
        let (Some(begin_s), Some((mode, meander))) = (sums.begin_s, self.signs) else { return };
        gathered.cells.push(Cell {
            time_s: self.begin_s + begin_s + 0.5 * sums.good_s,
            good_s: sums.good_s,
            joined: self.joined,
            stretch: self.stretch,
            mode: mode.sign(),
            meander: meander.map_or(0.0, LasingMode::sign),
            rate: sums.rates(sums.angle),
            powers: sums.columns.map(|column| sums.rates(column)),
            dither_hz: sums.cycles.map(|cycles| cycles / sums.good_s),
            axes_deg_c: self.axes_deg_c,
        });
        self.joined = true;
    }
}

/// Mean of the channels that the orientation follows, as they are applied now (°C).
pub(crate) fn temperature(thermal: &OrientationThermal, unit: &Unit) -> f64 {
    let states = unit.channels().filter(|channel| thermal.channels.iter().any(|name| *name == *channel.name));
    let (sum, count) = states
        .filter_map(|channel| channel.state)
        .fold((0.0, 0.0), |(sum, count), state| (sum + state.temperature, count + 1.0));
    let [low, high] = thermal.range_deg_c;
    if count > 0.0 { (sum / count).clamp(low, high) } else { f64::NAN }
}
