//! A run as a table, made in one pass by the service's own code: a row for each tick or window, columns of what it was, of the
//! corrected outputs along the case axes and of the temperatures.

use std::collections::BTreeMap;
use std::slice;

use isotherm_correction::earth::{LEVELLING_TOLERANCE, Place};
use isotherm_correction::sample::{CorrectedTick, GyroTick, SensorFlags, Sensors, TickFlags};
use isotherm_correction::unit::Unit;
use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2, Timestamp};
use isotherm_log::offline::Loaded;

use super::{Run, Troubles};
use crate::error::Error;
use crate::finding::Kind;
use crate::numbers::{Size, real, seconds};

/// Flags of a tick that carries no reading of its own.
const NOT_OWN: TickFlags = TickFlags::INTERPOLATED
    .union(TickFlags::ANGLE_RESTORED)
    .union(TickFlags::SERVO_TRANSIENT)
    .union(TickFlags::UNCALIBRATED)
    .union(TickFlags::SWITCH_UNRESOLVED);

/// Which ticks count for a row's means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Takes {
    /// All.
    All,
    /// Those with valid sensors.
    Valid,
    /// Those, as far as the gyros' readings are their own: not lost in a mode switch, and not behind one.
    Own,
    /// Those, and what was bridged over a mode switch.
    Bridged,
}

/// How a run becomes rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rows {
    /// Length of a row (s); 0 for a row for each tick.
    pub length_s: f64,
    /// Which ticks count.
    pub takes: Takes,
    /// Share of a row that must be there and count for the row to have numbers; `None` where any tick is enough.
    pub whole: Option<f64>,
}

impl Rows {
    /// Windows of valid ticks that are whole but for a thousandth: what is stated of a unit is a mean over these.
    pub const fn valid(length_s: f64) -> Self {
        Self { length_s, takes: Takes::Valid, whole: Some(0.999) }
    }

    /// Windows of valid ticks of which less than a fifth is missing: single readings that are no numbers take no window away.
    pub const fn mostly_valid(length_s: f64) -> Self {
        Self { whole: Some(0.8), ..Self::valid(length_s) }
    }

    /// Every tick.
    pub const TICKS: Self = Self { length_s: 0.0, takes: Takes::All, whole: None };
}

/// Columns of equal length, a row for each window of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Length that rows were to have (s).
    pub window_s: f64,
    /// End of the last tick (ns on the producer's clock).
    pub end_ns: Vec<i64>,
    /// Beginning since that of the run's first tick (s).
    pub begin_s: Vec<f64>,
    /// Length of the ticks (s).
    pub length_s: Vec<f64>,
    /// Middle since the beginning of the run's first tick (s).
    pub time_s: Vec<f64>,
    /// Whether ticks are missing right before the row.
    pub gap_before: Vec<bool>,
    /// Length of the ticks that are missing in it (s).
    pub missed_s: Vec<f64>,
    /// Whether a gyro was at its input limit.
    pub overrange: Vec<bool>,
    /// Length of the ticks that count for the rates, and for the forces (s).
    pub taken_s: [Vec<f64>; 2],
    /// Mean rate about each case axis (°/h) over the ticks that count.
    pub rate_deg_per_h: [Vec<f64>; 3],
    /// Mean specific force along each case axis (m/s²), likewise.
    pub force_m_per_s2: [Vec<f64>; 3],
    /// Smoothed temperatures by channel, as they were applied at the row's end (°C); no number where they are stale.
    pub temperature_deg_c: BTreeMap<String, Vec<f64>>,
    /// What the correction passed over.
    pub troubles: Troubles,
}

/// Whether the mean specific force of a unit at rest has the size of gravity (m/s²), within [`LEVELLING_TOLERANCE`].
pub fn is_one_g(size: f64) -> bool {
    (size / STANDARD_GRAVITY_M_PER_S2 - 1.0).abs() <= LEVELLING_TOLERANCE
}

/// The Earth's rate in case axes (rad/s); levelled by the mean specific force (m/s²) where the attitude is not stated.
///
/// # Errors
/// [`Error::Found`] where the unit cannot be levelled.
pub fn earth_rate(place: &Place, force: Option<[f64; 3]>) -> Result<[f64; 3], Error> {
    let not_level = || Kind::NotLevel { at_beginning: false, force, troubles: Vec::new() };
    place.earth_rate_in_case(force).ok_or_else(|| Error::Found(vec![not_level().into()]))
}

/// Length of the windows that what is left is stated over (s), for runs as long as the longest of some: in long runs several of
/// `shortest_s`, so that white noise does not hide what they are about. `thermal` and `validate` have it from here.
pub fn usual_window_s(longest_run_s: f64, shortest_s: f64) -> f64 {
    const WINDOWS_OF_A_RUN: f64 = 200.0;
    const MOST: f64 = 10.0;
    shortest_s * libm::floor(longest_run_s / (WINDOWS_OF_A_RUN * shortest_s)).clamp(1.0, MOST)
}

/// What gathers in one row.
#[derive(Debug, Default)]
struct Row {
    begin: Option<Timestamp>,
    length_s: f64,
    gap_before: bool,
    missed_s: f64,
    overrange: bool,
    sums: [[f64; 3]; 2],
    taken_s: [f64; 2],
}

impl Row {
    fn take(&mut self, tick: &CorrectedTick, takes: Takes) {
        let seconds = tick.duration.as_s();
        match self.begin {
            None => {
                let begin = tick.end_time.as_ns().saturating_sub(tick.duration.as_ns());
                self.begin = Some(Timestamp::from_ns(begin));
                self.gap_before = tick.missed > 0;
            }
            Some(_) => self.missed_s += real(tick.missed) * seconds,
        }
        self.length_s += seconds;
        self.overrange |= tick.gyro_flags.iter().any(|flags| flags.contains(SensorFlags::OVERRANGE));
        let valid = |flags: &Sensors<SensorFlags>| {
            !flags.is_empty() && flags.iter().all(|flags| flags.contains(SensorFlags::VALID))
        };
        let rates = match takes {
            Takes::All => true,
            Takes::Valid => valid(&tick.gyro_flags),
            Takes::Own => valid(&tick.gyro_flags) && !tick.flags.intersects(NOT_OWN),
            Takes::Bridged => valid(&tick.gyro_flags) || tick.flags.contains(TickFlags::INTERPOLATED),
        };
        let forces = takes == Takes::All || valid(&tick.accel_flags);
        for (kind, (counts, increments)) in
            [(rates, tick.delta_angle), (forces, tick.delta_velocity)].into_iter().enumerate()
        {
            if counts {
                self.sums[kind].iter_mut().zip(increments).for_each(|(sum, increment)| *sum += increment);
                self.taken_s[kind] += seconds;
            }
        }
    }
}

impl Table {
    /// Corrects a run and averages what comes out. A row without a valid tick of a kind of sensor, or with a gap, has no number there.
    ///
    /// # Errors
    /// As [`Run::correct_together`].
    pub fn of(run: &Run, loaded: &Loaded, window_s: f64) -> Result<Self, Error> {
        Self::of_rows(run, loaded, Rows::valid(window_s))
    }

    /// The same with rows of any kind.
    ///
    /// # Errors
    /// As [`Run::correct_together`].
    pub fn of_rows(run: &Run, loaded: &Loaded, rows: Rows) -> Result<Self, Error> {
        Ok(Self::together(run, slice::from_ref(loaded), rows)?.pop().unwrap_or_default())
    }

    /// Corrects a run with several calibrations of the same channels and sensors at once: a table for each, with the same rows.
    ///
    /// # Errors
    /// As [`Run::correct_together`].
    pub fn together(run: &Run, loaded: &[Loaded], rows: Rows) -> Result<Vec<Self>, Error> {
        Self::together_seen(run, loaded, rows, |_, _| ())
    }

    /// The same; `seen` sees each tick of the first calibration, and its unit as it stands behind it.
    ///
    /// # Errors
    /// As [`Run::correct_together`].
    pub fn together_seen(
        run: &Run,
        loaded: &[Loaded],
        Rows { length_s: window_s, takes, whole }: Rows,
        mut seen: impl FnMut(&CorrectedTick, &Unit),
    ) -> Result<Vec<Self>, Error> {
        let mut tables = vec![Self { window_s, ..Self::default() }; loaded.len()];
        let mut rows: Vec<Row> = loaded.iter().map(|_| Row::default()).collect();
        let mut first = None;
        let each = |_: &GyroTick, ticks: &[CorrectedTick], unit: &Unit| {
            let Some(tick) = ticks.first() else { return };
            seen(tick, unit);
            rows.iter_mut().zip(ticks).for_each(|(row, tick)| row.take(tick, takes));
            let Some(begin) = rows.first().and_then(|row| row.begin) else { return };
            let first = *first.get_or_insert(begin);
            if rows.first().is_some_and(|row| row.length_s > window_s - 0.5 * tick.duration.as_s()) {
                for (table, row) in tables.iter_mut().zip(&mut rows) {
                    table.close(&std::mem::take(row), (first, tick.end_time), unit);
                }
            }
        };
        let troubles = run.correct_together(loaded, each)?;
        for (table, troubles) in tables.iter_mut().zip(troubles) {
            table.troubles = troubles;
            if let Some(share) = whole {
                table.keep_whole(share);
            }
        }
        Ok(tables)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Leaves numbers only in rows of which at least this share is there and counts.
    fn keep_whole(&mut self, share: f64) {
        let kinds = [&mut self.rate_deg_per_h, &mut self.force_m_per_s2];
        for (columns, taken_s) in kinds.into_iter().zip(&self.taken_s) {
            for (row, taken_s) in taken_s.iter().enumerate() {
                if *taken_s <= share * (self.length_s[row] + self.missed_s[row]) {
                    for column in columns.iter_mut() {
                        column[row] = f64::NAN;
                    }
                }
            }
        }
    }

    /// Axis 0…2.
    pub fn rate(&self, axis: usize) -> &[f64] {
        self.rate_deg_per_h.get(axis).map_or(&[], Vec::as_slice)
    }

    /// Axis 0…2.
    pub fn force(&self, axis: usize) -> &[f64] {
        self.force_m_per_s2.get(axis).map_or(&[], Vec::as_slice)
    }

    /// Mean specific force along the case axes (m/s²); `None` where an axis has no number.
    pub fn mean_force(&self) -> Option<[f64; 3]> {
        let sizes = [0, 1, 2].map(|axis| Size::of(self.force(axis)));
        sizes.iter().all(|size| size.count > 0).then(|| sizes.map(|size| size.mean))
    }

    /// Mean rate (°/h) over the rows whose middle lies in a window (s since the beginning).
    pub fn mean_rate_within(&self, [from_s, to_s]: [f64; 2]) -> [f64; 3] {
        let inside = || (0..self.len()).filter(|&row| (from_s..to_s).contains(&self.time_s[row]));
        let length_s: f64 = inside().map(|row| self.length_s[row]).sum();
        self.rate_deg_per_h
            .each_ref()
            .map(|column| inside().map(|row| column[row] * self.length_s[row]).sum::<f64>() / length_s)
    }

    fn close(&mut self, row: &Row, (first, end): (Timestamp, Timestamp), unit: &Unit) {
        let Some(begin) = row.begin else { return };
        let begin_s = seconds(begin.as_ns().saturating_sub(first.as_ns()));
        self.end_ns.push(end.as_ns());
        self.begin_s.push(begin_s);
        self.length_s.push(row.length_s);
        self.time_s.push(begin_s + 0.5 * row.length_s);
        self.gap_before.push(row.gap_before);
        self.missed_s.push(row.missed_s);
        self.overrange.push(row.overrange);
        let [angle, velocity] = row.sums;
        let [rate_s, force_s] = row.taken_s;
        for (column, sum) in self.rate_deg_per_h.iter_mut().zip(angle) {
            column.push(AngularRate::from_rad_per_s(sum / rate_s).as_deg_per_h());
        }
        for (column, sum) in self.force_m_per_s2.iter_mut().zip(velocity) {
            column.push(sum / force_s);
        }
        self.taken_s.iter_mut().zip(row.taken_s).for_each(|(column, taken_s)| column.push(taken_s));
        let count = self.len();
        for channel in unit.channels() {
            let column = self.temperature_deg_c.entry(channel.name.to_string()).or_default();
            column.resize(count - 1, f64::NAN);
            column.push(channel.state.filter(|_| !channel.stale).map_or(f64::NAN, |state| state.temperature));
        }
        // A channel that is no longer there has no number.
        self.temperature_deg_c.values_mut().for_each(|column| column.resize(count, f64::NAN));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Written;
    use crate::fixture::simulated;

    #[test]
    fn windows_hold_the_mean_of_their_ticks() {
        let scenario = isotherm_simulator::presets::mems_chamber(1);
        let scenario = isotherm_simulator::Scenario { duration_s: 60.0, ..scenario };
        let mut truth = [0.0; 3];
        let run = simulated(&scenario, |step| {
            truth.iter_mut().zip(step.truth.delta_velocity).for_each(|(sum, delta)| *sum += delta);
        });
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
        let written = Written::read(path.as_ref()).unwrap();
        let means = Table::of(&run, &written.loaded, 10.0).unwrap();
        let middles = [5.0, 15.0, 25.0, 35.0, 45.0, 55.0];
        assert!(means.time_s.iter().zip(middles).all(|(time, middle)| (time - middle).abs() < 1e-9));
        let force = means.mean_force().unwrap();
        for (axis, (mean, truth)) in force.iter().zip(truth).enumerate() {
            assert!((mean - truth / 60.0).abs() < 0.02, "axis {axis}: {mean} {}", truth / 60.0);
        }
        let mut without = means.clone();
        without.force_m_per_s2[1].fill(f64::NAN);
        assert_eq!(without.mean_force(), None, "it levels nothing");
        assert!(
            means
                .temperature_deg_c
                .values()
                .all(|column| column.len() == 6 && column.iter().all(|t| t.is_finite()))
        );
        let bare = Written::compiled(&written.document.nominal()).unwrap();
        let before = Table::of(&run, &bare, 10.0).unwrap();
        assert_ne!(before.rate(0), means.rate(0), "the bias is in one of them");
        assert_eq!(run.series().unwrap().gyros.len(), 60 * 100);
        // Together they are what each is alone.
        let rows = Rows::valid(10.0);
        let both = Table::together(&run, &[written.loaded.clone(), bare], rows).unwrap();
        assert_eq!(both, [means.clone(), before]);
        // Ticks as rows.
        let rows = Rows::TICKS;
        let ticks = Table::together(&run, slice::from_ref(&written.loaded), rows).unwrap().remove(0);
        assert_eq!((ticks.len(), ticks.end_ns.len()), (6000, 6000));
        let within = ticks.mean_rate_within([10.0, 20.0]);
        assert!((0..3).all(|axis| (within[axis] / means.rate(axis)[1] - 1.0).abs() < 1e-9));
    }
}
