//! Commands, a rollback among them: an order in, the unit's answer out, both written down.

use std::time::Instant;

use isotherm_correction::earth::Place;
use isotherm_correction::operation::{Command, Refusal, State};
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::units::Span;
use isotherm_document::{tidy, unplaced};
use isotherm_protocol::control::{
    CommandOrder, CommandReply, Order, PlaceOrder, PreLaunchOrder, SwapOptions, SwapOutcome, SwapReply,
};
use isotherm_protocol::history::{AuditEvent, CommandRecord, Source};
use isotherm_protocol::key::UnitId;

use super::change::reply;
use super::manager::Worker;
use super::request::Request;
use super::revision::Record;

/// Shortest and longest pre-launch calibration that can be asked for (s).
const DURATION_RANGE_S: [f64; 2] = [60.0, 7200.0];

/// A pre-launch calibration as it was asked for.
#[derive(Debug, Clone)]
pub(super) struct PreLaunchRun {
    pub(super) order: PreLaunchOrder,
    pub(super) by: String,
}

impl Worker {
    /// Carries a command out; `None` for a unit that has not appeared and that the command cannot reach.
    pub(super) fn command(&mut self, unit: &UnitId, asked: &CommandOrder) -> Option<CommandReply> {
        let CommandOrder { order, by, .. } = asked;
        let present = self.intake.present(unit);
        let is_reached = match order {
            Order::Rollback { .. } => true,
            Order::Forget if self.records.contains_key(unit) => true,
            Order::Forget => present.is_some() || self.store.last_good(unit).is_some(),
            _ => present.is_some(),
        };
        is_reached.then_some(())?;
        // What a unit begins in.
        let at_start = if self.in_standby { State::Standby } else { State::RunningWithoutReversal };
        let before = present.map_or(at_start, |present| present.state);
        let mut record = CommandRecord {
            command: words(order),
            accepted: true,
            reason: None,
            state_before: before.to_string(),
            state_after: before.to_string(),
            last_sequence: self.intake.with(unit, |actor| actor.last_sequence()).flatten(),
            order: Some(order.clone()),
        };
        let mut swap = None;
        let done = match order {
            Order::Forget => self.forget(unit, by, &record).map(|()| before),
            Order::Rollback { revision, dry_run } => {
                let options = SwapOptions { by: by.clone(), dry_run: *dry_run, ..SwapOptions::default() };
                self.command_rollback(unit, *revision, before, options, &mut swap)
            }
            other => self.core_command(other).and_then(|command| self.give_command(unit, &command)),
        };
        let accepted = done.is_ok();
        let (state, mut reason) = match done {
            Ok(state) => (state, (*order == Order::Forget).then(|| "forgotten".to_owned())),
            Err(reason) => (before, Some(reason)),
        };
        if let (true, Order::PreLaunch(asked)) = (accepted, order) {
            let run = PreLaunchRun { order: *asked, by: by.clone() };
            self.records.entry(unit.clone()).or_default().pre_launch = Some(run);
        }
        if !matches!(order, Order::Forget | Order::Rollback { dry_run: true, .. }) {
            (record.accepted, record.reason, record.state_after) =
                (accepted, reason.clone(), state.to_string());
            tracing::info!(
                %unit, by, %state, accepted, reason = reason.as_deref(), "command {}", record.command
            );
            // A unit must be stopped with a full disk too: the command stands, and whoever gave it is told.
            if let Err(error) = self.append(Some(unit), by, AuditEvent::Command(record)) {
                let words = format!("it is not in the audit file, and a restart forgets it: {error}");
                reason = Some(reason.map_or(words.clone(), |reason| format!("{reason}; {words}")));
            }
        }
        let allowed = state.allowed().iter().map(|name| (*name).to_owned()).collect();
        Some(CommandReply { accepted, unit: unit.to_string(), state, reason, allowed, swap })
    }

    /// Forgets a unit; or why not.
    fn forget(&mut self, unit: &UnitId, by: &str, record: &CommandRecord) -> Result<(), String> {
        if self.intake.with(unit, |actor| actor.is_heard(Instant::now())) == Some(true) {
            return Err("the unit is still sending: stop its producer first".to_owned());
        }
        if let Some(file) = self.folder.first_naming(unit) {
            return Err(format!("{} names the unit: remove the file first", file.display()));
        }
        let record = CommandRecord { state_after: "forgotten".to_owned(), ..record.clone() };
        // Written down first: what is forgotten must not come back with a restart.
        let written = self.append(Some(unit), by, AuditEvent::Command(record));
        written.map_err(|error| error.to_string())?;
        self.intake.tell_end(unit);
        self.let_go(unit);
        tracing::info!(%unit, by, "forgotten");
        Ok(())
    }

    /// Has nothing of a unit any more.
    pub(super) fn let_go(&mut self, unit: &UnitId) {
        self.records.remove(unit);
        self.losses.retain(|loss| loss.unit() != Some(unit));
        self.followed.retain(|(concerned, _)| concerned != unit);
        self.uncopied.remove(unit);
        self.intake.forget(unit);
    }

    /// Hands a command to the unit.
    fn give_command(&self, unit: &UnitId, command: &Command) -> Result<State, String> {
        let done = self.intake.with(unit, |actor| actor.command(command));
        done.ok_or("the unit was restarted after an alarm: try again".to_owned())?.map_err(|e| e.to_string())
    }

    fn command_rollback(
        &mut self,
        unit: &UnitId,
        revision: Option<u64>,
        state: State,
        options: SwapOptions,
        swapped: &mut Option<SwapReply>,
    ) -> Result<State, String> {
        if !state.allowed().contains(&"rollback") {
            return Err(Refusal::State { state, command: "rollback" }.to_string());
        }
        let swap = self.roll_back(unit, revision, options);
        let refused = (swap.outcome == SwapOutcome::Refused)
            .then(|| swap.problems.first().map(|problem| problem.message.clone()).unwrap_or_default());
        *swapped = Some(swap);
        let state = self.intake.present(unit).map_or(state, |present| present.state);
        refused.map_or(Ok(state), Err)
    }

    /// Goes back to the calibration before the present one, or to a stated revision: a swap like any other, with a document
    /// that was accepted before.
    fn roll_back(&mut self, unit: &UnitId, to: Option<u64>, options: SwapOptions) -> SwapReply {
        let set = match to {
            Some(revision) => self.store.by_revision(unit, revision),
            None => self.store.previous(unit),
        };
        let set = set.cloned().ok_or_else(|| self.why_no_rollback(unit, to));
        let found = set.and_then(|set| match self.store.document(&set.digest) {
            Ok(Some(bytes)) => Ok((set, bytes)),
            Ok(None) => Err(format!("the document of revision {} is no longer kept", set.revision)),
            Err(error) => Err(error.to_string()),
        });
        let (set, bytes) = match found {
            Ok(found) => found,
            Err(message) => {
                let last = self.records.get(unit).and_then(Record::last);
                // No matter of a file.
                let problems = vec![unplaced(None, message)];
                return SwapReply { problems, ..reply(SwapOutcome::Refused, unit.as_str(), last) };
            }
        };
        let name = format!("document of revision {}", set.revision);
        let request = Request {
            unit: Some(unit.clone()),
            name: self.store.document_name(&set.digest, || name),
            source: Source::Rollback { to: set.revision },
            overlay: set.overlay,
            // It was accepted for this unit once, whatever serial it names.
            options: SwapOptions { any_serial: true, ..options },
        };
        self.swap(&request, &bytes, None)
    }

    /// Why there is nothing to go back to, and what there is.
    fn why_no_rollback(&self, unit: &UnitId, to: Option<u64>) -> String {
        let sets = || self.store.good_sets(unit);
        let revisions: Vec<_> = sets().take(8).map(|set| set.revision.to_string()).collect();
        let latest = revisions.join(", ");
        match to {
            _ if revisions.is_empty() => format!("no document was ever accepted for unit {unit}"),
            Some(to) => format!("unit {unit} has no revision {to}; its latest are {latest}"),
            None if sets().zip(sets().skip(1)).all(|(a, b)| a.corrects_as(b)) => {
                format!("unit {unit} has had no other document than the present one")
            }
            None => format!(
                "unit {unit} has no older revision to roll back to: to go forward, give a revision; its latest are \
                 {latest}"
            ),
        }
    }

    /// The order as the state machine takes it.
    pub(super) fn core_command(&self, order: &Order) -> Result<Command, String> {
        Ok(match order {
            Order::Standby => Command::Standby,
            Order::SelfTest => Command::SelfTest,
            Order::PreLaunch(order) => Command::PreLaunch(self.pre_launch_settings(order)?),
            Order::Abort => Command::Abort,
            Order::Run { reversal } => Command::Run { reversal: *reversal },
            Order::Rest(order) => Command::Rest(place(order)?),
            Order::EndRest => Command::EndRest,
            Order::Rollback { .. } | Order::Forget => {
                return Err("this is not a command of the state machine".to_owned());
            }
        })
    }

    /// What is asked for, over what is configured.
    fn pre_launch_settings(&self, order: &PreLaunchOrder) -> Result<PreLaunchSettings, String> {
        let [shortest_s, longest_s] = DURATION_RANGE_S;
        // A shorter one could only be refused at its end.
        let shortest_s = shortest_s.max(tidy(self.pre_launch.limits.time_per_mode.as_s()));
        let duration = match order.duration_s {
            Some(s) if (shortest_s..=longest_s).contains(&s) => Span::from_s(s),
            Some(s) => {
                return Err(format!(
                    "duration_s is {s}, must be from {shortest_s} to {longest_s}, and not below \
                     pre_launch.min_time_per_mode_s"
                ));
            }
            None => self.pre_launch.duration,
        };
        Ok(PreLaunchSettings { duration, place: Some(place(&order.place)?), ..self.pre_launch })
    }
}

fn place(order: &PlaceOrder) -> Result<Place, String> {
    let place = Place::new(order.latitude_deg, order.heading_deg, order.pitch_roll_deg);
    place.map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
}

/// The order that led to a command; `None` where it names a place, which the command has in other units.
pub(super) fn order_of(command: &Command) -> Option<Order> {
    match command {
        Command::Standby => Some(Order::Standby),
        Command::SelfTest => Some(Order::SelfTest),
        Command::Abort => Some(Order::Abort),
        Command::Run { reversal } => Some(Order::Run { reversal: *reversal }),
        Command::EndRest => Some(Order::EndRest),
        Command::PreLaunch(_) | Command::Rest(_) => None,
    }
}

/// What stands in the place of a command where a pre-launch calibration has ended by itself.
pub(super) const PRE_LAUNCH_ENDED: &str = "pre-launch ended";

/// A command in words, for audit file and log.
pub(super) fn words(order: &Order) -> String {
    let at = |place: &PlaceOrder| {
        let PlaceOrder { latitude_deg, heading_deg, pitch_roll_deg } = place;
        let tilt = pitch_roll_deg.map_or("levelled".to_owned(), |[pitch_deg, roll_deg]| {
            format!("pitch {pitch_deg}°, roll {roll_deg}°")
        });
        format!("latitude {latitude_deg}°, heading {heading_deg}°, {tilt}")
    };
    match order {
        Order::Standby => "standby".to_owned(),
        Order::SelfTest => "self-test".to_owned(),
        Order::PreLaunch(order) => {
            let install = if order.install { "" } else { ", not put in force" };
            format!("pre-launch at {}{install}", at(&order.place))
        }
        Order::Abort => "abort".to_owned(),
        Order::Run { reversal: None } => "run".to_owned(),
        Order::Run { reversal: Some(true) } => "run with mode reversal".to_owned(),
        Order::Run { reversal: Some(false) } => "run without mode reversal".to_owned(),
        Order::Rest(place) => format!("rest at {}", at(place)),
        Order::EndRest => "end-rest".to_owned(),
        Order::Forget => "forget".to_owned(),
        Order::Rollback { revision: None, .. } => "rollback".to_owned(),
        Order::Rollback { revision: Some(revision), .. } => format!("rollback {revision}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::fixture::worker;

    #[test]
    fn a_pre_launch_calibration_that_is_too_short_for_its_modes_does_not_begin() {
        let mut worker = worker();
        worker.pre_launch.limits.time_per_mode = Span::from_s(120.0);
        let refused = |duration_s| {
            let place = PlaceOrder { latitude_deg: 50.0, heading_deg: 0.0, pitch_roll_deg: None };
            let order = PreLaunchOrder { place, duration_s, install: true };
            worker.core_command(&Order::PreLaunch(order)).is_err()
        };
        let cases = [None, Some(59.0), Some(119.0), Some(120.0), Some(7200.0), Some(7201.0)];
        assert_eq!(cases.map(refused), [false, true, true, false, false, true]);
    }
}
