//! Which units are shown, and in which order.

use std::cmp::{Ordering, Reverse};

use crate::page::{Unit, channel_in_view, state_word};

/// What units are sorted by; within it by serial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Sort {
    /// What is gravest first, then by state: of hundreds of units the screen shows those that need somebody.
    #[default]
    State,
    /// Serial.
    Serial,
    /// The hottest first.
    Temperature,
    /// The slowest first.
    Latency,
    /// The one with most gaps first.
    Gaps,
}

impl Sort {
    /// In the order of the variants, with their names.
    const ALL: [(Self, &'static str); 5] = [
        (Self::State, "state"),
        (Self::Serial, "serial"),
        (Self::Temperature, "temperature"),
        (Self::Latency, "latency"),
        (Self::Gaps, "gaps"),
    ];

    /// Its name.
    pub(super) fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// The next one.
    pub(super) fn next(self) -> Self {
        Self::ALL[(self as usize + 1) % Self::ALL.len()].0
    }

    /// The one before.
    pub(super) fn previous(self) -> Self {
        Self::ALL[(self as usize + Self::ALL.len() - 1) % Self::ALL.len()].0
    }

    fn compare(self, a: &Unit<'_>, b: &Unit<'_>) -> Ordering {
        let by_serial = || (&a.status.unit, &a.status.instance).cmp(&(&b.status.unit, &b.status.instance));
        let order = match self {
            Self::Serial => Ordering::Equal,
            Self::State => {
                let rank = |unit: &Unit<'_>| (Reverse(unit.level()), state_word(unit.status.state));
                rank(a).cmp(&rank(b))
            }
            Self::Temperature => temperature(b).total_cmp(&temperature(a)),
            Self::Latency => b.status.latency.p99_ns.cmp(&a.status.latency.p99_ns),
            Self::Gaps => b.status.counter("gaps").cmp(&a.status.counter("gaps")),
        };
        order.then_with(by_serial)
    }
}

/// The temperature that stands in the line; where there is none it sorts last.
fn temperature(unit: &Unit<'_>) -> f64 {
    let channel = channel_in_view(unit.status).and_then(|channel| channel.temperature_deg_c);
    channel.filter(|temperature| !temperature.is_nan()).unwrap_or(f64::NEG_INFINITY)
}

/// Keeps the units that match the filter, and sorts them.
pub(super) fn arrange<'a>(
    mut units: Vec<Unit<'a>>,
    sort: Sort,
    reversed: bool,
    filter: &str,
) -> Vec<Unit<'a>> {
    let filter = filter.to_lowercase();
    units.retain(|unit| matches(unit, &filter));
    // The level of each unit is looked up often: 200 units compare some 1 500 times.
    units.sort_by(|a, b| sort.compare(a, b));
    if reversed {
        units.reverse();
    }
    units
}

/// All of them, those that need somebody first.
#[must_use]
pub fn worst_first(units: Vec<Unit<'_>>) -> Vec<Unit<'_>> {
    arrange(units, Sort::State, false, "")
}

/// Whether serial, state or what is to be noticed contains the text, which is in lower case.
fn matches(unit: &Unit<'_>, filter: &str) -> bool {
    if filter.is_empty() {
        return true;
    }
    let contains = |text: &str| text.to_lowercase().contains(filter);
    contains(&unit.status.unit)
        || contains(state_word(unit.status.state))
        || unit.remarks().iter().any(|remark| contains(&remark.words))
}
