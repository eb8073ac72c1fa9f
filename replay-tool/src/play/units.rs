//! The units that a log is played as.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use isotherm_bus::Outlet;
use isotherm_log::faults::{Departure, Faults};
use isotherm_log::offline::unit_id;
use isotherm_protocol::key::UnitId;

use super::playlist::{Cue, Frame, Load};
use super::report::{Counts, UnitReport};
use super::{Acknowledge, PlayOptions};
use crate::error::Error;

/// Gyro ticks that may be under way of one unit, and of all together, where nothing else is said.
const IN_FLIGHT: u64 = 4096;
const ALL_IN_FLIGHT: u64 = 16_384;

/// A unit on the bus.
#[derive(Debug)]
pub(super) struct PlayedUnit {
    /// Its serial.
    pub(super) unit: UnitId,
    /// The unit in the log.
    of: UnitId,
    faults: Option<Faults<Arc<Frame>>>,
    /// Where its frames go; `None` until its first goes out.
    pub(super) outlet: Option<Outlet>,
    /// What was sent of it.
    pub(super) counts: Counts,
}

/// All of them, in the order in which the log names them.
#[derive(Debug)]
pub(super) struct Units<'a> {
    options: &'a PlayOptions,
    pub(super) all: Vec<PlayedUnit>,
    /// Places of the units that one of the log is played as.
    of: BTreeMap<UnitId, Range<usize>>,
}

impl<'a> Units<'a> {
    /// None yet.
    pub(super) fn new(options: &'a PlayOptions) -> Self {
        Self { options, all: Vec::new(), of: BTreeMap::new() }
    }

    /// The places of the units that a unit of the log is played as.
    ///
    /// # Errors
    /// [`Error::Usage`] where two units of the log would be one on the bus, or a serial becomes too long.
    pub(super) fn places(&mut self, of: &UnitId) -> Result<Range<usize>, Error> {
        if let Some(places) = self.of.get(of) {
            return Ok(places.clone());
        }
        let base = self.options.names.get(of).unwrap_or(of);
        let serials = match self.options.copies {
            None => vec![base.clone()],
            Some(copies) => {
                let serial = |number| unit_id(&format!("{base}-{number:03}"));
                (1..=copies).map(serial).collect::<Result<_, _>>()?
            }
        };
        let begin = self.all.len();
        for unit in serials {
            if self.all.iter().any(|other| other.unit == unit) {
                return Err(Error::Usage(format!(
                    "{of} and another unit of the log would both be played as {unit}: give one of them another \
                     serial with --remap"
                )));
            }
            let faults = (!self.options.faults.is_none())
                .then(|| Faults::new(self.options.faults, self.options.seed, stream(&unit)));
            self.all.push(PlayedUnit {
                unit,
                of: of.clone(),
                faults,
                outlet: None,
                counts: Counts::default(),
            });
        }
        let places = begin..self.all.len();
        self.of.insert(of.clone(), places.clone());
        // The more units, the less each may have under way: together it must fit the queues in between.
        if let Some(limit) = self.max_in_flight() {
            self.all.iter_mut().filter_map(|unit| unit.outlet.as_mut()).for_each(|it| it.allow(limit));
        }
        Ok(places)
    }

    /// Most gyro ticks of a unit under way; `None` without a bound.
    pub(super) fn max_in_flight(&self) -> Option<u64> {
        match self.options.acknowledge {
            Acknowledge::No => None,
            Acknowledge::Bounded(Some(given)) => Some(given),
            Acknowledge::Bounded(None) => Some((ALL_IN_FLIGHT / self.all.len().max(1) as u64).min(IN_FLIGHT)),
        }
    }
}

impl PlayedUnit {
    /// What goes out for a message of the log.
    pub(super) fn pass(&mut self, cue: &Cue, out: &mut Vec<Departure<Arc<Frame>>>) {
        let Some(faults) = &mut self.faults else {
            let item = Arc::clone(&cue.frame);
            out.push(Departure { at_ns: cue.at_ns, item, again: false, held_back: false });
            return;
        };
        if cue.begins_series {
            // What is held back of the series before would come too late behind this.
            faults.flush(out);
        }
        if !faults.pass(cue.frame.input.index(), cue.at_ns, Arc::clone(&cue.frame), out) {
            self.counts.messages_withheld += 1;
            if let Load::Gyro(ticks) = cue.frame.load {
                self.counts.ticks_withheld += ticks.count;
            }
        }
    }

    /// What is held back goes out: the log is over.
    pub(super) fn flush(&mut self, out: &mut Vec<Departure<Arc<Frame>>>) {
        if let Some(faults) = &mut self.faults {
            faults.flush(out);
        }
    }

    /// Time begins anew.
    pub(super) fn begin_anew(&mut self) {
        if let Some(faults) = &mut self.faults {
            faults.begin_anew();
        }
    }

    /// What was sent of it, and what became of that.
    pub(super) fn report(&self) -> UnitReport {
        let account = self.outlet.as_ref().and_then(Outlet::account);
        UnitReport::new(self.unit.as_str(), self.of.as_str(), self.counts, account)
    }
}

/// Which random numbers of a seed are a unit's: by its serial alone (FNV-1a), whatever else is played.
fn stream(unit: &UnitId) -> u64 {
    let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    unit.as_str().bytes().fold(0xcbf2_9ce4_8422_2325, mix)
}
