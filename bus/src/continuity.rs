//! The rule by which a consumer notices that the transport lost a tick.

use isotherm_correction::sample::TickFlags;
use isotherm_protocol::corrected::CorrectedTick;

/// Account of one unit's corrected ticks, fed tick by tick in the order of arrival.
///
/// Ticks follow one another without loss if the first raw sequence number of each is one more than the last of its
/// predecessor plus what the tick announces as missing. After a tick flagged `RESTART` the account starts anew.
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
    last: Option<u64>,
}

impl Continuity {
    /// An account of nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Enters one tick.
    pub fn feed(&mut self, tick: &CorrectedTick) {
        self.enter(tick.sequence, tick.ticks, tick.missed, tick.flags.contains(TickFlags::RESTART));
        if tick.flags.contains(TickFlags::UNCALIBRATED) {
            self.uncalibrated += u64::from(tick.ticks.max(1));
        }
    }

    /// Enters one output by its figures: last raw sequence number, raw ticks in it, raw ticks announced as missing
    /// before it, and whether the producer restarted.
    pub fn enter(&mut self, sequence: u64, ticks: u16, missed: u64, restart: bool) {
        let ticks = u64::from(ticks.max(1));
        let first = sequence.saturating_sub(ticks - 1);
        match self.last {
            Some(_) if restart => self.restarts += 1,
            Some(last) => {
                let expected = last.saturating_add(1).saturating_add(missed);
                self.lost += first.saturating_sub(expected);
                self.duplicated += expected.saturating_sub(first);
            }
            None => {}
        }
        self.ticks += ticks;
        self.announced_missing += missed;
        self.last = Some(sequence);
    }

    /// Sequence number of the last tick.
    #[must_use]
    pub fn last_sequence(&self) -> Option<u64> {
        self.last
    }

    /// Whether nothing was lost and nothing came twice.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.lost == 0 && self.duplicated == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sequence, ticks, missed, restart.
    type Output = (u64, u16, u64, bool);

    /// The account after the outputs.
    fn account(outputs: &[Output]) -> [u64; 5] {
        let mut account = Continuity::new();
        for &(sequence, ticks, missed, restart) in outputs {
            account.enter(sequence, ticks, missed, restart);
        }
        [account.ticks, account.announced_missing, account.lost, account.duplicated, account.restarts]
    }

    #[test]
    fn what_is_announced_is_not_lost_and_what_is_lost_is_noticed() {
        let cases: &[(&str, &[Output], [u64; 5])] = &[
            ("whole", &[(7, 1, 0, false), (8, 1, 0, false)], [2, 0, 0, 0, 0]),
            ("announced gap", &[(7, 1, 0, false), (11, 1, 3, false)], [2, 3, 0, 0, 0]),
            ("lost", &[(7, 1, 0, false), (10, 1, 0, false)], [2, 0, 2, 0, 0]),
            ("gap announced in part", &[(7, 1, 0, false), (11, 1, 1, false)], [2, 1, 2, 0, 0]),
            ("twice", &[(7, 1, 0, false), (7, 1, 0, false)], [2, 0, 0, 1, 0]),
            ("steps of four", &[(3, 4, 0, false), (7, 4, 0, false)], [8, 0, 0, 0, 0]),
            ("a step lost", &[(3, 4, 0, false), (11, 4, 0, false)], [8, 0, 4, 0, 0]),
            ("restart", &[(900, 1, 0, false), (0, 1, 0, true), (1, 1, 0, false)], [3, 0, 0, 0, 1]),
            (
                "last number",
                &[(u64::MAX, 1, 0, false), (u64::MAX, 1, u64::MAX, false)],
                [2, u64::MAX, 0, 0, 0],
            ),
        ];
        for (name, outputs, expected) in cases {
            assert_eq!(account(outputs), *expected, "{name}");
        }
    }
}
