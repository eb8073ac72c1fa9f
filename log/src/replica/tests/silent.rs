//! Recordings that began while the service knew the unit already and the unit was silent.

use super::session::{Session, Way, kinds, replay};
use super::*;

const SECOND_NS: u64 = 1_000_000_000;
const TICKS: u64 = 600;

/// A recorder comes to a unit that has been silent; it asks at once, and again two seconds later, as `record` does.
struct Later {
    session: Session,
    again_ns: Option<u64>,
}

impl Later {
    fn new(speed: u64, raw_later_ns: i64) -> Self {
        let mut session = Session { raw_later_ns, speed, ..Session::new() };
        session.ticks(TICKS);
        session.now_ns += 10 * SECOND_NS;
        session.recorded.clear();
        session.memory();
        let again_ns = Some(session.now_ns + 2 * SECOND_NS);
        Self { session, again_ns }
    }

    fn wait(&mut self, ns: u64) {
        let until_ns = self.session.now_ns + ns;
        self.ask(until_ns);
        self.session.now_ns = until_ns;
    }

    fn ask(&mut self, until_ns: u64) {
        if let Some(at_ns) = self.again_ns.filter(|at_ns| *at_ns <= until_ns) {
            self.session.now_ns = at_ns.max(self.session.now_ns);
            self.session.memory();
            self.again_ns = None;
        }
    }

    /// A player; one that repeats sends what was sent before.
    fn play(&mut self, repeats: bool) {
        if repeats {
            self.session.sequence = 0;
        }
        for _ in 0..TICKS {
            self.ask(self.session.now_ns);
            self.session.ticks(1);
        }
    }
}

#[test]
fn a_unit_that_was_silent_is_made_again_from_its_first_tick() {
    for (speed, repeats) in [1, 10, 840].into_iter().flat_map(|speed| [(speed, true), (speed, false)]) {
        for (plays, raw_later_ns) in [(1, 0), (1, 25_000_000), (1, -25_000_000), (2, 0), (3, 25_000_000)] {
            for wait_ms in [50, 1000, 1990, 2500, 30_000] {
                let case =
                    format!("{speed}×, repeats {repeats}, {plays} plays, {raw_later_ns} ns, {wait_ms} ms");
                let mut later = Later::new(speed, raw_later_ns);
                for _ in 0..plays {
                    later.wait(wait_ms * 1_000_000);
                    later.play(repeats);
                }
                later.wait(SECOND_NS);
                later.session.memory();
                let (account, report) = replay(&later.session.recording(), Changes::default());
                assert_eq!(kinds(&report), Vec::<&str>::new(), "{case}: {report:#?}");
                assert!(account.is_identical(), "{case}: {account:#?}");
                // Of ticks that come a second time with an earlier end the first are refused, as the service does.
                let refused = if repeats { TICKS / 2 } else { 0 };
                assert!(account.ticks >= plays * (TICKS - refused), "{case}: {account:#?}");
                assert_eq!(report.frames_before, 0, "{case}");
                assert!(report.memories_equal >= 1, "{case}: {report:#?}");
            }
        }
    }
}

#[test]
fn frames_that_the_recorder_missed_of_a_unit_that_had_been_silent_are_told() {
    let mut later = Later::new(1, 0);
    later.wait(10 * SECOND_NS);
    later.session.way = |_, sequence| if sequence < TICKS + 20 { Way::Service } else { Way::Both };
    later.play(false);
    later.session.memory();
    let (account, report) = replay(&later.session.recording(), Changes::default());
    assert!(kinds(&report).contains(&"not recorded") && !account.agrees(), "{account:#?} {report:#?}");
}
