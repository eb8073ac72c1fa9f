//! Corrected ticks of two logs, subtracted where both have one.

use std::collections::VecDeque;

use isotherm_protocol::corrected::CorrectedTick;

use super::DifferenceSummary;
use super::nominal::ARCSEC;
use super::track::Track;
use super::unit::increments;

/// Most ticks of one log that wait for the other's.
const MAX_WAITING: usize = 1 << 16;

/// A tick that waits.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    at_ns: i64,
    increments: [f64; 6],
    angle_rad: [f64; 3],
}

/// The second log's ticks minus the first's.
#[derive(Debug)]
pub(super) struct Difference {
    waiting: [VecDeque<Waiting>; 2],
    /// Differences of rates (°/h), of specific forces (m/s²), and of the angles added up (″).
    pub(super) track: Track,
    pub(super) summary: DifferenceSummary,
    angle_arcsec: [f64; 3],
}

impl Difference {
    pub(super) fn new(detail: usize) -> Self {
        Self {
            waiting: [VecDeque::new(), VecDeque::new()],
            track: Track::new(9, detail),
            summary: DifferenceSummary::default(),
            angle_arcsec: [0.0; 3],
        }
    }

    /// Takes a tick of a log (0 or 1) at a time of the common axis.
    pub(super) fn take(&mut self, log: usize, at_ns: i64, tick: &CorrectedTick) {
        let waiting = Waiting { at_ns, increments: increments(tick), angle_rad: tick.delta_angle };
        let [first, second] = &mut self.waiting;
        (if log == 0 { first } else { second }).push_back(waiting);
        self.compare();
        self.give_up(MAX_WAITING);
    }

    /// There are no further ticks.
    pub(super) fn end(&mut self) {
        self.give_up(0);
    }

    /// Counts the first ticks of a log as its own alone, until so many wait.
    fn give_up(&mut self, most: usize) {
        let DifferenceSummary { only_first, only_second, .. } = &mut self.summary;
        for (queue, single) in self.waiting.iter_mut().zip([only_first, only_second]) {
            *single += queue.drain(..queue.len().saturating_sub(most)).count() as u64;
        }
    }

    fn compare(&mut self) {
        let [first, second] = &mut self.waiting;
        while let (Some(a), Some(b)) = (first.front().copied(), second.front().copied()) {
            let order = a.at_ns.cmp(&b.at_ns);
            if order.is_le() {
                first.pop_front();
            }
            if order.is_ge() {
                second.pop_front();
            }
            self.summary.only_first += u64::from(order.is_lt());
            self.summary.only_second += u64::from(order.is_gt());
            self.summary.common_ticks += u64::from(order.is_eq());
            if order.is_ne() {
                continue;
            }
            let mut values = [0.0; 9];
            for ((value, a), b) in values.iter_mut().zip(a.increments).zip(b.increments) {
                *value = b - a;
            }
            let differs = values.iter().any(|value| *value != 0.0);
            self.summary.differing_ticks += u64::from(differs);
            let angles = a.angle_rad.iter().zip(b.angle_rad);
            for ((sum, value), (a, b)) in
                self.angle_arcsec.iter_mut().zip(values.iter_mut().skip(6)).zip(angles)
            {
                *sum += (b - a) * ARCSEC;
                *value = *sum;
            }
            self.track.push(a.at_ns, &values, u32::from(differs));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tick(angle: f64) -> CorrectedTick {
        let duration = isotherm_correction::units::Span::from_ms(10);
        CorrectedTick { delta_angle: [angle, 0.0, 0.0], duration, ..CorrectedTick::default() }
    }

    #[test]
    fn ticks_of_one_time_are_subtracted_and_others_counted() {
        let mut difference = Difference::new(100);
        (0..10).for_each(|index| difference.take(0, index * 10, &tick(1e-6)));
        (5..12).for_each(|index| difference.take(1, index * 10, &tick(3e-6)));
        difference.end();
        let counts = DifferenceSummary { common_ticks: 5, differing_ticks: 5, only_first: 5, only_second: 2 };
        assert_eq!(difference.summary, counts);
        let finished = difference.track.finish(0);
        let rate = finished.overall(0, 1.0).unwrap();
        assert!((rate.mean - 2e-6 * 100.0 * 206_264.806).abs() < 1e-3, "{rate:?}");
        let angle = finished.overall(6, 1.0).unwrap();
        assert!((angle.max - 1e-5 * ARCSEC).abs() < 1e-9, "{angle:?}");
    }

    #[test]
    fn a_log_without_its_other_waits_in_bounded_memory() {
        let mut difference = Difference::new(100);
        (0..100_000).for_each(|index| difference.take(1, index, &tick(0.0)));
        assert!(difference.waiting[1].len() <= MAX_WAITING);
        difference.end();
        assert_eq!((difference.summary.common_ticks, difference.summary.only_second), (0, 100_000));
    }
}
