//! The rule by which a consumer notices that the transport lost a tick.

use isotherm_correction::sample::TickFlags;
use isotherm_protocol::corrected::CorrectedTick;

/// Account of one unit's corrected ticks, fed tick by tick in the order of arrival.
///
/// Ticks follow one another without loss if the first raw sequence number of each is one more than the last of its
/// predecessor plus what the tick announces as missing. With another series or a tick flagged `RESTART` the account starts anew.
/// The first tick of all begins the account; what was before it is not known.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Continuity {
    /// Raw gyro ticks that arrived corrected.
    pub ticks: u64,
    /// Raw gyro ticks that the outputs announced as missing.
    pub announced_missing: u64,
    /// Raw gyro ticks that are neither here nor announced: lost between the service and here.
    pub lost: u64,
    /// Raw gyro ticks that arrived though they had been there or had been announced as missing.
    pub duplicated: u64,
    /// Times that the producer restarted.
    pub restarts: u64,
    /// Raw gyro ticks that came back as they were, because the unit has no calibration.
    pub uncalibrated: u64,
    /// Series and sequence number of the last tick.
    last: Option<(u64, u64)>,
}

impl Continuity {
    /// Enters one tick.
    pub fn feed(&mut self, tick: &CorrectedTick) {
        let CorrectedTick { series, sequence, missed, flags, .. } = *tick;
        let ticks = u64::from(tick.ticks.max(1));
        let first = sequence.saturating_sub(ticks - 1);
        match self.last {
            Some(_) if flags.contains(TickFlags::RESTART) => self.restarts += 1,
            Some((same, last)) if same == series => {
                let expected = last.saturating_add(1).saturating_add(missed);
                add(&mut self.lost, first.saturating_sub(expected));
                add(&mut self.duplicated, expected.saturating_sub(first));
            }
            _ => {}
        }
        self.ticks += ticks;
        add(&mut self.announced_missing, missed);
        self.last = Some((series, sequence));
        if flags.contains(TickFlags::UNCALIBRATED) {
            self.uncalibrated += ticks;
        }
    }

    /// Sequence number of the last tick.
    #[must_use]
    pub fn last_sequence(&self) -> Option<u64> {
        self.last.map(|(_, sequence)| sequence)
    }

    /// Whether nothing was lost and nothing came twice.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.lost == 0 && self.duplicated == 0
    }
}

/// What a frame says may be any number.
fn add(counter: &mut u64, ticks: u64) {
    *counter = counter.saturating_add(ticks);
}
