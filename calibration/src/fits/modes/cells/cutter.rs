//! Cuts one run into cells and seconds.

use isotherm_correction::sample::{CorrectedTick, GyroTick, LasingMode, SensorFlags, TickFlags};
use isotherm_correction::unit::Unit;
use isotherm_correction::units::AngularRate;
use isotherm_protocol::document::{Document, OrientationThermal};

use super::{Cell, Cut, Gathered, MAX_POWER, Second, temperature};
use crate::fits::modes::switches::dither_hz;
use crate::numbers::seconds;

/// Flags of a tick whose readings are not those of a settled instrument.
const UNSETTLED: TickFlags = TickFlags::INTERPOLATED
    .union(TickFlags::ANGLE_RESTORED)
    .union(TickFlags::SERVO_TRANSIENT)
    .union(TickFlags::WARM_UP)
    .union(TickFlags::UNCALIBRATED)
    .union(TickFlags::SWITCH_UNRESOLVED);

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
#[derive(Default)]
pub(super) struct Cutter {
    cut: Cut,
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

impl Cutter {
    pub(super) fn new(cut: Cut, bare: &Document, begin_s: f64, stretch: usize) -> Self {
        Self {
            cut,
            axes: bare.gyro.orientation.thermal.clone(),
            begin_s,
            stretch,
            axes_deg_c: f64::NAN,
            ..Self::default()
        }
    }

    pub(super) fn take(
        &mut self,
        raw: &GyroTick,
        ticks: &[CorrectedTick],
        unit: &Unit,
        gathered: &mut Gathered,
    ) {
        let Some(bare) = ticks.first() else { return };
        let begin_ns = bare.end_time.as_ns().saturating_sub(bare.duration.as_ns());
        let first_ns = *self.first_ns.get_or_insert(begin_ns);
        let since_s = seconds(begin_ns - first_ns);
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
        let settling = self.switched_ns.is_some_and(|switch| seconds(begin_ns - switch) < self.cut.settle_s);
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
            self.axes_deg_c = temperature(thermal, |name| {
                let channel = unit.channels().find(|channel| *channel.name == *name)?;
                channel.state.map(|state| state.temperature)
            });
        }
        let dither = [0, 1, 2].map(|sensor| dither_hz(raw, sensor).unwrap_or(f64::NAN));
        self.second.add(since_s, ticks, dither);
        self.cell.add(since_s, ticks, dither);
        if self.second.good_s > 1.0 - 0.5 * bare.duration.as_s() {
            self.close_second(gathered);
        }
        if self.cell.good_s > self.cut.cell_s - 0.5 * bare.duration.as_s() {
            self.close_cell(gathered);
        }
    }

    pub(super) fn close(&mut self, gathered: &mut Gathered) {
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
