//! What is known of each temperature channel before anything is fitted.

use std::collections::{BTreeMap, BTreeSet};

use isotherm_protocol::document::{Channel, Document, Filter};

use super::branches::History;
use super::checks::SMALLEST_RANGE_DEG_C;
use super::columns::{Basis, Columns};
use super::fit::Sensor;
use super::samples::Samples;
use crate::error::Error;
use crate::report::{counted, short};

/// What chambers for instruments hardly reach (°C).
const HOTTEST_DEG_C: f64 = 130.0;
const COLDEST_DEG_C: f64 = -80.0;

/// What is known of a channel before the fit.
#[derive(Debug)]
pub(super) struct Known {
    pub(super) history: History,
    pub(super) temperature: Vec<f64>,
}

impl Known {
    pub(super) fn basis(&self, channel: Channel, filter: &Filter) -> Basis {
        let [low, high] = self.history.range_deg_c;
        let range_deg_c = [libm::floor(2.0 * low - 0.5) / 2.0, libm::ceil(2.0 * high + 0.5) / 2.0];
        Basis {
            channel,
            filter: filter.clone(),
            reference_deg_c: libm::round(0.5 * (low + high)),
            range_deg_c,
            derivatives: [[0.0; 2]; 2],
        }
    }
}

pub(super) fn channel(document: &Document, name: &str) -> Result<Channel, Error> {
    let channel = document.temperature.channel.iter().find(|channel| channel.name == name);
    channel.cloned().ok_or_else(|| {
        Error::refused(format!(
            "the document has no temperature channel {name:?}: add [[temperature.channel]]"
        ))
    })
}

/// Thermal history of each channel that a sensor follows.
pub(super) fn histories(
    bare: &Document,
    filter: &Filter,
    sensors: &[Sensor],
    samples: &[Samples],
    warnings: &mut Vec<String>,
) -> Result<BTreeMap<String, Known>, Error> {
    let names: BTreeSet<&String> = sensors.iter().map(|sensor| &sensor.channel).collect();
    let mut known = BTreeMap::new();
    let mut refusals = Vec::new();
    for name in names {
        let without = samples.iter().filter(|run| run.temperatures.get(name).is_none_or(Vec::is_empty));
        let without: Vec<&str> = without.map(|run| run.name.as_str()).collect();
        if !without.is_empty() {
            refusals.push(format!(
                "{}: no readings of temperature channel {name:?}, which the document's sensors follow: check its name in the mapping",
                without.join(", ")
            ));
            continue;
        }
        let channel = channel(bare, name)?;
        let plain = channel.conversion_deg_c == [0.0, 1.0];
        let basis = Basis {
            channel,
            filter: filter.clone(),
            reference_deg_c: 0.0,
            range_deg_c: [-300.0, 1000.0],
            derivatives: [[0.0; 2]; 2],
        };
        let temperature = Columns::new(basis, samples).temperature()?;
        let mut later = temperature.as_slice();
        let part = |run: &Samples| {
            let own;
            (own, later) = later.split_at(run.time_s.len());
            (own, run.window_s)
        };
        let history = History::of(&samples.iter().map(part).collect::<Vec<_>>());
        let [low, high] = history.range_deg_c;
        if !temperature.iter().any(|deg_c| deg_c.is_finite()) {
            refusals.push(format!(
                "temperature channel {name:?} has no valid reading at the time of any window of the gyros: do its times fit theirs, do \
                 both files belong together?"
            ));
        } else if high - low < SMALLEST_RANGE_DEG_C {
            refusals.push(stays(name, [low, high], plain));
        }
        if high > HOTTEST_DEG_C || low < COLDEST_DEG_C {
            warnings.push(format!(
                "channel {name:?} goes from {low:.1} to {high:.1} °C, an unusual range: is it in °F, or its \
                 conversion in the document or the mapping wrong?"
            ));
        }
        warnings.extend(doubts(name, &history));
        known.insert(name.clone(), Known { history, temperature });
    }
    if refusals.is_empty() { Ok(known) } else { Err(Error::Refused(refusals)) }
}

/// That a channel hardly moves; `plain` where its readings are taken as °C just as they are.
fn stays(name: &str, [low, high]: [f64; 2], plain: bool) -> String {
    let needed = format!(
        "a fit over temperature needs at least {SMALLEST_RANGE_DEG_C} °C, better the whole range of use"
    );
    if !plain {
        return format!(
            "temperature channel {name:?} stays between {low:.1} and {high:.1} °C: {needed}; run the chamber through it"
        );
    }
    format!(
        "temperature channel {name:?} stays between {} and {}, taken as °C, because there is no conversion: \
         {needed}. If the channel is in volts or counts, give a document with its conversion (--calibration); if it \
         is not a thermometer, name the right column in the mapping; otherwise run the chamber",
        short(low),
        short(high)
    )
}

/// What a channel's history leaves to be wished for.
fn doubts(name: &str, history: &History) -> Vec<String> {
    let mut doubts = Vec::new();
    let levels = history.levels();
    if levels < 2 {
        doubts.push(format!(
            "channel {name:?}: {} of different temperature, 2 or more are needed to separate the static bias from \
             rate terms: hold the chamber at its ends until the output settles (an hour for a fibre coil)",
            counted(levels, "plateau", "plateaus")
        ));
    }
    if !history.both_directions() {
        doubts.push(format!(
            "channel {name:?}: the temperature goes one way only, so rate terms cannot be separated from the static \
             bias: only a static bias is fitted; run the chamber both ways"
        ));
    }
    doubts
}
