//! Sensors held back by part of a tick, so that all of them tell of the same time as the one that lags most (models §3).
//!
//! The integral of what a sensor reads is interpolated by the parabola through its last three ends of ticks: what a tick holds back, the
//! next one gives, so that nothing is lost and nothing counted twice.

use alloc::boxed::Box;
use core::array;

use serde::{Deserialize, Serialize};

use super::{Corrector, Paired, withdraw};
use crate::calibration::Calibration;
use crate::lanes::{Lanes, narrow, put};
use crate::orientation::SensorMask;
use crate::sample::{CorrectedTick, MAX_SENSORS, TickFlags};
use crate::units::Span;

/// What holds for a tick that has part of such a tick in it, too.
const CARRIED: TickFlags =
    TickFlags::INTERPOLATED.union(TickFlags::ANGLE_RESTORED).union(TickFlags::SWITCH_UNRESOLVED);

/// What was held back of the last ticks of a unit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct HeldBack {
    gyros: Held,
    accels: Held,
    /// Of the last two ticks, without what these have of others, newest first.
    flags: [TickFlags; 2],
}

/// Likewise of one kind of sensor (rad, or m/s).
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Held {
    /// No tick of the series has come yet.
    fresh: bool,
    /// Increments of the last tick; `None` before the first and after a gap.
    before: Option<Lanes>,
    /// Whether what the next tick is to give was found with those of the tick before the last one.
    curved: bool,
    /// What the next tick is to give.
    owed: Lanes,
    /// Sensors whose last reading does not count.
    unusable: SensorMask,
}

impl Held {
    /// Holds part of a tick's increments back, and gives what was held back of the last one. A sensor whose last reading did not count
    /// leaves `usable`. Whether what is left of all sensors is of the same time: not next to the beginning or a gap.
    fn pass<const N: usize>(
        &mut self,
        ticks: &[f64; N],
        (increments, usable): (&mut [f64; N], &mut SensorMask),
    ) -> bool {
        // What stood in for a reading that did not count tells of no slope.
        let before: [f64; N] = array::from_fn(|lane| match &self.before {
            Some(before) if !self.unusable.contains(lane) => before[lane],
            _ => increments[lane],
        });
        let curved = self.before.is_some();
        let comparable = core::mem::replace(&mut self.curved, curved) && curved;
        let back: [f64; N] = array::from_fn(|lane| {
            let (held, increment) = (ticks[lane], increments[lane]);
            held * increment + 0.5 * held * (1.0 - held) * (increment - before[lane])
        });
        // The first tick is taken to go on as what was before it.
        let given = if self.fresh { back } else { *narrow(&self.owed) };
        self.fresh = false;
        let mut now = [0.0; MAX_SENSORS];
        put(&mut now, *increments);
        self.before = Some(now);
        put(&mut self.owed, back);
        *increments = array::from_fn(|lane| increments[lane] - back[lane] + given[lane]);
        for (lane, given) in given.into_iter().enumerate() {
            let (counts, counted) = (usable.contains(lane), !self.unusable.contains(lane));
            *usable = usable.set(lane, counts && (counted || given == 0.0));
            self.unusable = self.unusable.set(lane, !counts);
        }
        comparable
    }

    /// Whether the next tick is to give nothing.
    fn owes_nothing(&self) -> bool {
        self.owed.iter().all(|owed| *owed == 0.0)
    }
}

impl HeldBack {
    /// Before the first tick of a series, or in the middle of one.
    fn new(fresh: bool) -> Self {
        let held = || Held { fresh, ..Held::default() };
        Self { gyros: held(), accels: held(), flags: [TickFlags::empty(); 2] }
    }

    /// Forgets the increments of the last tick: ticks are missing behind it.
    pub(super) fn interrupt(&mut self) {
        self.gyros.before = None;
        self.miss_accels();
    }

    /// Forgets those of the accelerometers: their tick is missing.
    pub(super) fn miss_accels(&mut self) {
        self.accels.before = None;
    }
}

impl Corrector {
    /// What is held back; before a tick that is the first of its series, nothing.
    fn held(&mut self, tick: &Paired<'_>) -> &mut HeldBack {
        let is_first = tick.before.restart || self.seen.duration == Span::ZERO;
        self.motion.held.get_or_insert_with(|| Box::new(HeldBack::new(is_first)))
    }

    /// Which flags of this tick and the last one are their own, and how many ticks each gyro is held back; `None` where none is.
    pub(super) fn gyros_held_back(
        &self,
        calibration: &Calibration,
        flags: TickFlags,
    ) -> ([TickFlags; 2], Option<Lanes>) {
        let Some(held) = self.motion.held.as_deref() else { return ([flags, TickFlags::empty()], None) };
        let ticks = self.on_its_way(calibration, |motion| &motion.held_back_ticks[0]);
        ([(flags - CARRIED) | held.flags[0], held.flags[1]], Some(ticks))
    }

    /// Holds the gyros' increments (rad) back; what the substitution made of the last two ticks holds for this one too. Gives their mean
    /// rates (rad/s), and whether parity can compare them.
    #[cold]
    pub(super) fn hold_gyros_back<const N: usize>(
        &mut self,
        calibration: &Calibration,
        tick: &Paired<'_>,
        (increments, usable): (&mut [f64; N], &mut SensorMask),
        out: &mut CorrectedTick,
    ) -> ([f64; N], bool) {
        let [gyros, accels] = [0, 1]
            .map(|kind: usize| self.on_its_way::<N>(calibration, |motion| &motion.held_back_ticks[kind]));
        let held = self.held(tick);
        let comparable = held.gyros.pass(&gyros, (increments, usable));
        let [last, one_before] = held.flags;
        held.flags = [out.flags & CARRIED, last];
        out.flags |= last | one_before;
        withdraw(&mut out.gyro_flags, *usable);
        let carries = out.flags.intersects(CARRIED);
        let none = !carries && gyros.iter().chain(&accels).all(|ticks| *ticks == 0.0);
        if none && held.gyros.owes_nothing() && held.accels.owes_nothing() {
            self.motion.held = None;
            self.disturb();
        }
        let per_second = 1.0 / tick.gyro.duration.as_s();
        (increments.map(|increment| increment * per_second), comparable && !carries)
    }

    /// Holds back what the accelerometers feel (m/s²) over a tick of `duration_s`. Whether parity can compare what is left.
    #[cold]
    pub(super) fn hold_accels_back<const N: usize>(
        &mut self,
        calibration: &Calibration,
        tick: &Paired<'_>,
        duration_s: f64,
        (forces, usable): (&mut [f64; N], &mut SensorMask),
    ) -> bool {
        let ticks = self.on_its_way::<N>(calibration, |motion| &motion.held_back_ticks[1]);
        let mut increments = forces.map(|force| force * duration_s);
        let comparable = self.held(tick).accels.pass(&ticks, (&mut increments, usable));
        *forces = increments.map(|increment| increment / duration_s);
        comparable
    }
}
