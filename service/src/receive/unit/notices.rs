//! What a unit has to tell: looked for after every frame, kept until it is taken.

use std::collections::VecDeque;

use isotherm_correction::operation::State;
use isotherm_correction::prelaunch::Outcome;
use isotherm_correction::unit::PreLaunchView;
use isotherm_protocol::stream::UnitStream;

use crate::control::{Inbox, Notice, PreLaunchEnd};

/// Watches a stream for what the swap manager and the readers of the status should hear of.
#[derive(Debug, Default)]
pub(super) struct NoticeCollector {
    /// To whom notices go.
    pub(super) inbox: Option<Inbox>,
    /// Not taken yet: the swap manager had too much waiting.
    pub(super) untold: VecDeque<Notice>,
    state: Option<State>,
    revision: u64,
    /// End of the last tick before a pre-launch calibration began (ns on the producer's clock).
    pre_launch_start_ns: Option<i64>,
    /// What the last pre-launch calibration was given up for, where no command did it.
    pub(super) given_up: Option<String>,
}

impl NoticeCollector {
    /// Looks at the stream; whether state or revision are others than at the last look.
    pub(super) fn look(&mut self, stream: &mut UnitStream) -> bool {
        while let Some(first) = stream.take_in_force() {
            self.untold.push_back(Notice::InForce(first));
        }
        let (state, revision) =
            (stream.unit().state(), stream.unit().calibration().map_or(0, |(_, counter)| counter));
        let changed = self.state != Some(state) || self.revision != revision;
        if changed {
            let end_ns = stream.unit().observation().map(|seen| seen.end_time.as_ns());
            if state == State::PreLaunchCalibration {
                self.pre_launch_start_ns = end_ns;
                self.given_up = None;
            } else if self.state == Some(State::PreLaunchCalibration) {
                self.pre_launch_ended(stream, revision, end_ns);
            }
            (self.state, self.revision) = (Some(state), revision);
        }
        if !self.untold.is_empty() {
            self.tell(stream);
        }
        changed
    }

    /// Notes what a pre-launch calibration led to, or what it was given up for; `revision` is what is in force now.
    fn pre_launch_ended(&mut self, stream: &UnitStream, revision: u64, end_ns: Option<i64>) {
        let outcome: Option<Outcome> = match stream.unit().pre_launch() {
            Some(PreLaunchView::Ended(outcome)) => Some(outcome.clone()),
            Some(PreLaunchView::Aborted | PreLaunchView::Running(_)) if self.revision != revision => {
                self.given_up = Some(format!("a swap of the calibration (revision {revision})"));
                None
            }
            // By a command, which is written down as such.
            Some(PreLaunchView::Aborted | PreLaunchView::Running(_)) => None,
            None => {
                self.given_up = Some("the unit was restarted after an alarm".to_owned());
                None
            }
        };
        let end_ns = end_ns.unwrap_or_default();
        self.untold.push_back(Notice::PreLaunch(PreLaunchEnd {
            outcome,
            given_up: self.given_up.clone(),
            revision: self.revision,
            start_ns: self.pre_launch_start_ns.unwrap_or(end_ns),
            end_ns,
        }));
    }

    /// Hands over what is untold, as far as it is taken.
    pub(super) fn tell(&mut self, stream: &UnitStream) {
        let Some(inbox) = &self.inbox else {
            self.untold.clear();
            return;
        };
        while let Some(notice) = self.untold.pop_front() {
            if let Err(notice) = inbox.notice(stream.id(), notice) {
                self.untold.push_front(notice);
                return;
            }
        }
    }
}
