//! Ticks of one unit as they go by: raw and corrected, in bins that a chart draws.
//!
//! Nothing is kept for it and no receive thread does anything for it: while somebody watches, a thread looks at the unit's last tick
//! every few milliseconds, as it is when it looks. Of a unit at 200 Hz that is nearly every tick, of a faster one a sample.

use std::time::{Duration, Instant};

use isotherm_correction::observation::Observation;
use isotherm_correction::unit::Applied;
use isotherm_protocol::key::UnitId;
use serde::Serialize;

use crate::receive::intake::Intake;

/// How long is looked for one answer.
const WATCH: Duration = Duration::from_millis(500);
/// Distance of two looks.
const LOOK: Duration = Duration::from_millis(5);
/// Looks in a bin.
const LOOKS: u32 = 10;

/// What went by.
#[derive(Debug, Default, Serialize)]
pub(super) struct Live {
    /// Not one where no tick was corrected.
    bins: Vec<Bin>,
}

/// Some ticks, one after the other.
#[derive(Debug, Clone, Serialize)]
struct Bin {
    /// How long before the answer it ended (s).
    age_s: f64,
    /// Ticks that were seen.
    ticks: u32,
    raw_rad_per_s: [Spread; 3],
    corrected_rad_per_s: [Spread; 3],
    /// Of the ticks that have a specific force.
    raw_m_per_s2: Option<[Spread; 3]>,
    corrected_m_per_s2: Option<[Spread; 3]>,
}

/// Smallest, mean and largest of some values.
#[derive(Debug, Clone, Copy)]
struct Spread {
    low: f64,
    sum: f64,
    high: f64,
    count: f64,
}

impl Spread {
    const EMPTY: Self = Self { low: f64::INFINITY, sum: 0.0, high: f64::NEG_INFINITY, count: 0.0 };

    fn add(&mut self, value: f64) {
        // Values that are no numbers have no place in a chart.
        if value.is_finite() {
            (self.low, self.high) = (self.low.min(value), self.high.max(value));
            (self.sum, self.count) = (self.sum + value, self.count + 1.0);
        }
    }
}

impl Serialize for Spread {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mean = self.sum / self.count;
        // Not finite without any value: null then.
        serializer.collect_seq([self.low, mean, self.high])
    }
}

impl Bin {
    fn new() -> Self {
        let empty = [Spread::EMPTY; 3];
        Self {
            age_s: 0.0,
            ticks: 0,
            raw_rad_per_s: empty,
            corrected_rad_per_s: empty,
            raw_m_per_s2: None,
            corrected_m_per_s2: None,
        }
    }

    fn add(&mut self, tick: &Observation, subtracted: &Applied) {
        fn put(spreads: &mut [Spread; 3], values: [f64; 3]) {
            spreads.iter_mut().zip(values).for_each(|(spread, value)| spread.add(value));
        }
        let raw =
            |corrected: [f64; 3], subtracted: [f64; 3]| std::array::from_fn(|i| corrected[i] + subtracted[i]);
        self.ticks += 1;
        put(&mut self.raw_rad_per_s, raw(tick.angular_rate, subtracted.angular_rate));
        put(&mut self.corrected_rad_per_s, tick.angular_rate);
        if let Some(force) = tick.specific_force {
            let empty = [Spread::EMPTY; 3];
            put(self.raw_m_per_s2.get_or_insert(empty), raw(force, subtracted.specific_force));
            put(self.corrected_m_per_s2.get_or_insert(empty), force);
        }
    }
}

/// Watches a unit for half a second; `None` where this service does not have it.
pub(super) fn watch(intake: &Intake, unit: &UnitId) -> Option<Live> {
    intake.has(unit).then_some(())?;
    let start = Instant::now();
    let place = |tick: &Observation| (tick.end_time, tick.sequence);
    let mut last = intake.with(unit, |actor| actor.tick_seen())?.map(|(tick, _)| place(&tick));
    let mut bins: Vec<(Instant, Bin)> = Vec::new();
    while start.elapsed() < WATCH {
        let mut bin = Bin::new();
        for _ in 0..LOOKS {
            std::thread::sleep(LOOK);
            // A unit that starts anew after an alarm is looked at again.
            let seen = intake.with(unit, |actor| actor.tick_seen()).flatten();
            if let Some((tick, subtracted)) = seen.filter(|(tick, _)| Some(place(tick)) != last) {
                last = Some(place(&tick));
                bin.add(&tick, &subtracted);
            }
        }
        if bin.ticks > 0 {
            bins.push((Instant::now(), bin));
        }
    }
    let now = Instant::now();
    let aged = bins
        .into_iter()
        .map(|(at, bin)| Bin { age_s: now.saturating_duration_since(at).as_secs_f64(), ..bin });
    Some(Live { bins: aged.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bin_holds_smallest_mean_and_largest_and_null_for_what_is_not_there() {
        let mut bin = Bin::new();
        let subtracted = Applied { angular_rate: [0.5, 0.0, 0.0], ..Applied::default() };
        for rate in [1.0, 3.0, f64::NAN] {
            let tick = Observation { angular_rate: [rate, 0.0, -rate], ..Observation::default() };
            bin.add(&tick, &subtracted);
        }
        let json = serde_json::to_value(&bin).unwrap();
        assert_eq!(json["corrected_rad_per_s"][0], serde_json::json!([1.0, 2.0, 3.0]));
        assert_eq!(json["raw_rad_per_s"][0], serde_json::json!([1.5, 2.5, 3.5]));
        assert_eq!((&json["ticks"], &json["raw_m_per_s2"]), (&3.into(), &serde_json::Value::Null));
        let empty = serde_json::to_value(Bin::new()).unwrap();
        assert_eq!(empty["corrected_rad_per_s"][0], serde_json::json!([null, null, null]));
    }
}
