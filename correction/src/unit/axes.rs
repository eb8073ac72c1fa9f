//! Input axes to case axes, following temperature on a straight line.

use core::array;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use crate::orientation::{Inverse, Orientation, ParityCheck, SensorMask, sum_of_columns};
use crate::sample::{MAX_PARITY, TickFlags};
use crate::thermal::{MAX_PLAYS, Ramp, drag};
use crate::units::{Span, Timestamp};

/// Memory of one kind of sensor's orientation.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[expect(clippy::struct_excessive_bools, reason = "each holds, or not, without the others")]
pub(super) struct Axes {
    /// Temperature that the orientation follows (°C); `share` of its way is the share between the inverses.
    temperature: Ramp,
    target: f64,
    /// Where the plays have been dragged to (°C).
    played: ArrayVec<f64, MAX_PLAYS>,
    /// What readings of the last moment found.
    found: Option<Found>,
    clamped: bool,
    /// Whether a temperature was read: the first one is not approached from the assumed one, but met.
    started: bool,
    /// Sensors that there are, and those that are resolved.
    all: SensorMask,
    mask: SensorMask,
    /// Inverses at both ends of the way; nothing where the sensors do not span the space.
    ends: [Inverse; 2],
    /// Whether they do.
    spans: bool,
    /// They do, and are all that there are.
    whole: bool,
    /// There is no way from the one to the other.
    stands: bool,
    /// Sensors that the parity check has not excluded.
    included: SensorMask,
    parity: ParityCheck,
}

/// What the readings of one moment found, whichever of them came first: they act together.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Found {
    start: Timestamp,
    /// Longest time over which one of them acts.
    over: Span,
    played: ArrayVec<f64, MAX_PLAYS>,
    started: bool,
}

impl Axes {
    /// Starts at the assumed temperature (°C).
    pub(super) fn new(orientation: &Orientation, target: f64) -> Self {
        let mask = SensorMask::all(orientation.sensors());
        let inverse = orientation.inverse(target, mask);
        Self {
            temperature: Ramp::hold(target),
            target,
            played: orientation.plays().iter().map(|_| target).collect(),
            found: None,
            clamped: outside(orientation, target),
            started: false,
            all: mask,
            mask,
            ends: [inverse.unwrap_or_default(); 2],
            spans: inverse.is_some(),
            whole: inverse.is_some(),
            stands: true,
            included: mask,
            parity: ParityCheck::default(),
        }
    }

    /// Turns towards the orientation at a new temperature (°C).
    pub(super) fn update(
        &mut self,
        orientation: &Orientation,
        temperature: f64,
        start: Timestamp,
        over: Span,
    ) {
        let found = match self.found.take().filter(|found| found.start == start) {
            Some(found) => Found { over: found.over.max(over), ..found },
            None => Found { start, over, played: self.played.clone(), started: self.started },
        };
        self.played.clone_from(&found.played);
        self.started = found.started;
        let over = if self.started { found.over } else { Span::ZERO };
        self.found = Some(found);
        let clamped = outside(orientation, temperature);
        let temperature = self.stick(orientation, temperature);
        self.started = true;
        let now = self.at(start);
        let to = orientation.inverse(temperature, self.mask);
        self.set_out(orientation, (now.or(to), to), [self.temperature.at(start), temperature]);
        self.target = temperature;
        self.clamped = clamped;
        self.temperature.turn(start, over, temperature);
        if over == Span::ZERO {
            self.settle();
        }
    }

    /// Temperature that axes which stick turn as if it were (°C): `T + Σ share·(p_w[T] − T)`. The first of all is taken to have stood
    /// for ever.
    fn stick(&mut self, orientation: &Orientation, temperature: f64) -> f64 {
        let mut felt = temperature;
        for (play, state) in orientation.plays().iter().zip(&mut self.played) {
            let from = if self.started { *state } else { temperature };
            *state = drag(from, temperature, play.half_width_deg_c);
            felt += play.share * (*state - temperature);
        }
        felt
    }

    /// Arrives at once where it is heading, after a step of the producer's clock.
    pub(super) fn settle(&mut self) {
        self.temperature.settle();
        self.ends[0] = self.ends[1];
        self.stands = true;
    }

    /// Whether the temperature is outside the fitted range.
    pub(super) fn clamped(&self) -> bool {
        self.clamped
    }

    /// Sensors that the parity check has not excluded.
    pub(super) fn included(&self) -> SensorMask {
        self.included
    }

    /// Whether these sensors span the space at `time`.
    pub(super) fn are_spanned_by(
        &self,
        orientation: &Orientation,
        sensors: SensorMask,
        time: Timestamp,
    ) -> bool {
        orientation.inverse(self.temperature.at(time), sensors).is_some()
    }

    /// The inverse at `time`, where it takes all sensors and none is excluded.
    #[inline]
    pub(super) fn inverse<const N: usize>(&self, time: Timestamp) -> Option<[[f64; 4]; N]> {
        let [from, to] = &self.ends;
        (self.whole && self.included == self.all).then(|| from.columns_to(to, self.share(time)))
    }

    /// Case axes from the sensors of `usable`, and whether they can be trusted: where the usable ones do not span the space, from
    /// all that are not excluded, and not to be trusted. `inverse`: that of all sensors, where it is worked out already.
    #[expect(clippy::inline_always, reason = "twice per tick: a call costs as much as half of the work")]
    #[inline(always)]
    pub(super) fn resolve<const N: usize>(
        &mut self,
        orientation: &Orientation,
        usable: SensorMask,
        (readings, inverse): (&[f64; N], Option<[[f64; 4]; N]>),
        time: Timestamp,
    ) -> ([f64; 3], bool) {
        if self.whole && usable == self.all {
            let [from, to] = &self.ends;
            // Two sums, rather than one of a copy.
            let axes = match inverse {
                Some(known) => sum_of_columns(&known, readings),
                // By themselves: else the share is worked out for both.
                None if self.stands => from.apply_to(to, 1.0, readings),
                None => from.apply_to(to, self.share(time), readings),
            };
            return (axes, true);
        }
        // A copy, so that the readings themselves need no place in memory.
        let readings = *readings;
        self.resolve_some(orientation, usable, &readings, time)
    }

    /// Likewise from some of the sensors, or with others than the last time.
    #[cold]
    pub(super) fn resolve_some<const N: usize>(
        &mut self,
        orientation: &Orientation,
        usable: SensorMask,
        readings: &[f64; N],
        time: Timestamp,
    ) -> ([f64; 3], bool) {
        if usable != self.mask {
            self.choose(orientation, usable, time);
        }
        let trusted = self.spans;
        if !trusted {
            self.choose(orientation, self.included, time);
        }
        if !self.spans {
            return ([0.0; 3], false);
        }
        let [from, to] = &self.ends;
        let readings = array::from_fn(|lane| if self.mask.contains(lane) { readings[lane] } else { 0.0 });
        (from.apply_to::<N>(to, self.share(time), &readings), trusted)
    }

    /// How far along the way between the inverses `time` is.
    #[inline]
    fn share(&self, time: Timestamp) -> f64 {
        if self.stands { 1.0 } else { self.temperature.pace.share(time) }
    }

    /// Goes on with other sensors: both ends anew, from where the temperature is now, so that the change of sensors is all that
    /// steps.
    fn choose(&mut self, orientation: &Orientation, mask: SensorMask, time: Timestamp) {
        self.mask = mask;
        self.temperature.set_out(time);
        let now = self.temperature.at(time);
        let [from, to] = [now, self.target].map(|temperature| orientation.inverse(temperature, mask));
        self.set_out(orientation, (from, to), [now, self.target]);
    }

    /// Sets out from one inverse to the other, which hold at two temperatures (°C). Gives both up where the axes of the sensors in use come
    /// into one plane between them: both ends may be sound, and what is between them nonsense. With all sensors that cannot be: the
    /// calibration was refused.
    fn set_out(
        &mut self,
        orientation: &Orientation,
        (from, to): (Option<Inverse>, Option<Inverse>),
        [now, target]: [f64; 2],
    ) {
        let is_clear = |_: &_| orientation.is_conditioned_between(self.mask, now, target);
        let ends = from.zip(to).filter(is_clear);
        self.spans = ends.is_some();
        self.whole = self.spans && self.mask == self.all;
        self.ends = ends.map_or_else(Default::default, |(from, to)| [from, to]);
        let [from, to] = &self.ends;
        self.stands = from == to;
    }

    /// Temperature that the orientation follows (°C).
    pub(super) fn temperature_deg_c(&self, time: Timestamp) -> f64 {
        self.temperature.at(time)
    }

    /// The inverse in use at `time` and the sensors that it takes.
    pub(super) fn in_use(&self, time: Timestamp) -> Option<(SensorMask, Inverse)> {
        self.at(time).map(|inverse| (self.mask, inverse))
    }

    /// Watches the parity of readings, where there are more sensors than axes, and excludes a sensor where that calls for it;
    /// what is left over goes to the corrected tick. Whether a sensor was excluded.
    pub(super) fn watch(
        &mut self,
        orientation: &Orientation,
        usable: SensorMask,
        readings: &[f64],
        (parity, flags): (&mut ArrayVec<f64, MAX_PARITY>, &mut TickFlags),
    ) -> bool {
        let verdict = self.parity.check(orientation, self.target, usable, readings);
        *parity = verdict.residuals;
        if verdict.exceeded {
            *flags |= TickFlags::PARITY_EXCEEDED;
        }
        if let Some(sensor) = verdict.exclude {
            self.included = self.included.without(sensor);
        }
        verdict.exclude.is_some()
    }

    fn at(&self, time: Timestamp) -> Option<Inverse> {
        let [from, to] = &self.ends;
        self.spans.then(|| from.lerp(to, self.temperature.pace.share(time)))
    }
}

/// Whether a temperature (°C) is outside the range over which the orientation was fitted.
fn outside(orientation: &Orientation, temperature: f64) -> bool {
    let [first, last] = orientation.range_deg_c();
    !(first..=last).contains(&temperature)
}

#[cfg(test)]
mod tests {
    use alloc::vec;
    use alloc::vec::Vec;

    use super::*;
    use crate::orientation::{AxesPlay, OrientationParts};

    const TICK: Span = Span::from_ns(1_000_000_000);

    fn seconds(s: i64) -> Timestamp {
        Timestamp::from_ns(1_000_000_000 * s)
    }

    /// Along the case axes at 20 °C, with a fourth sensor if there is one.
    fn orientation(
        fourth: Option<[f64; 3]>,
        slopes_per_deg_c: Vec<[f64; 3]>,
        plays: Vec<AxesPlay>,
        range_deg_c: [f64; 2],
    ) -> Orientation {
        let along = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let parts = OrientationParts {
            reference_deg_c: 20.0,
            rows: along.into_iter().chain(fourth).collect(),
            slopes_per_deg_c,
            plays,
            weights: vec![],
            range_deg_c,
            parity_limit: None,
            parity_confirm_ticks: 0,
        };
        Orientation::new(&parts).unwrap()
    }

    /// What its sensors feel of a vector at a temperature.
    fn felt(orientation: &Orientation, deg_c: f64, v: [f64; 3]) -> [f64; 4] {
        let mut lanes = [0.0; 4];
        lanes.iter_mut().zip(orientation.forward(deg_c, v)).for_each(|(lane, felt)| *lane = felt);
        lanes
    }

    #[test]
    fn readings_of_one_moment_act_together_in_whatever_order_they_come() {
        let plays = vec![AxesPlay { half_width_deg_c: 0.3, share: 0.5 }];
        let orientation = orientation(None, vec![], plays, [0.0, 50.0]);
        // The first of two channels leaves the mean at either; the second has been silent for long.
        let run = |firsts: [f64; 2], over: [Span; 2]| {
            let mut axes = Axes::new(&orientation, 20.0);
            for (moment, (first, both)) in (0..).zip(firsts.into_iter().zip([24.0, 26.0])) {
                for (mean, over) in [first, both].into_iter().zip(over) {
                    axes.update(&orientation, mean, seconds(10 * moment), over);
                }
            }
            [0, 5, 11, 20].map(|s| axes.temperature_deg_c(seconds(s)))
        };
        let long = Span::from_ns(4 * TICK.as_ns());
        let found = run([22.0, 25.0], [TICK, long]);
        assert_eq!(found.map(f64::to_bits), run([24.5, 27.0], [long, TICK]).map(f64::to_bits), "{found:?}");
        assert!((found[0] - 24.0).abs() < 1e-12 && (found[3] - 25.85).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_change_of_sensors_on_the_way_is_all_that_steps() {
        let slopes = vec![[0.0, 1e-3, 0.0], [0.0, 0.0, 2e-3], [-1e-3, 0.0, 0.0], [0.0; 3]];
        let orientation = orientation(Some([0.6, 0.0, 0.8]), slopes, vec![], [0.0, 50.0]);
        let truth = [1e-5, 4e-5, -2e-5];
        let mut axes = Axes::new(&orientation, 20.0);
        axes.update(&orientation, 20.0, seconds(0), TICK);
        axes.update(&orientation, 30.0, seconds(1), Span::from_ns(10 * TICK.as_ns()));
        for (s, sensors) in [(3, 3), (4, 4), (6, 3), (7, 4), (11, 3), (12, 4)] {
            let deg_c = f64::from(i32::try_from(20 + (s - 1).min(10)).unwrap());
            let felt = felt(&orientation, deg_c, truth);
            let (rate, _) = axes.resolve(&orientation, SensorMask::all(sensors), (&felt, None), seconds(s));
            let off = rate.iter().zip(truth).map(|(rate, truth)| (rate - truth).abs()).fold(0.0, f64::max);
            assert!(
                off < 1e-17 && (axes.temperature_deg_c(seconds(s)) - deg_c).abs() < 1e-12,
                "{s} s: {off}"
            );
        }
    }

    #[test]
    fn sensors_left_that_come_into_one_plane_on_their_way_are_not_trusted() {
        // Without the fourth, the first two come to point the same way at 30 °C.
        let skewed = libm::sqrt(1.0 / 3.0);
        let slope = 0.1;
        let slopes = vec![[0.0, slope, 0.0], [slope, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        let orientation = orientation(Some([skewed, -skewed, skewed]), slopes, vec![], [20.0, 50.0]);
        let (all, three) = (SensorMask::all(4), SensorMask::all(3));
        let truth = [1e-5, 4e-5, -2e-5];
        let resolve = |axes: &mut Axes, usable, s| {
            let felt = felt(&orientation, axes.temperature_deg_c(seconds(s)), truth);
            axes.resolve(&orientation, usable, (&felt, None), seconds(s))
        };
        let mut axes = Axes::new(&orientation, 20.0);
        axes.update(&orientation, 20.0, seconds(0), TICK);
        assert!(resolve(&mut axes, three, 1).1);
        // Both ends of the way are sound, and what is between them is not.
        axes.update(&orientation, 45.0, seconds(1), Span::from_ns(10 * TICK.as_ns()));
        assert!([20.0, 45.0].iter().all(|t| orientation.inverse(*t, three).is_some()));
        for s in 2..=4 {
            assert!(!resolve(&mut axes, three, s).1, "{s} s");
        }
        assert!(resolve(&mut axes, three, 7).1, "beyond 30 °C there is no plane in the way any more");
        assert!(resolve(&mut axes, all, 9).1, "all four span the space at every temperature");
        axes.update(&orientation, 48.0, seconds(11), TICK);
        let (rate, trusted) = resolve(&mut axes, three, 12);
        assert!(trusted && rate.iter().zip(truth).all(|(a, b)| (a - b).abs() < 1e-9), "{rate:?}");
    }
}
