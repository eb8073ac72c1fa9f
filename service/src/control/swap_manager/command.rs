//! Commands: an order in, the unit's answer out, both written down.

use std::fmt::Display;
use std::time::Instant;

use isotherm_correction::earth::Place;
use isotherm_correction::operation::{Command, State};
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::units::Span;
use isotherm_protocol::control::{
    CommandOrder, CommandReply, Order, PlaceOrder, PreLaunchOrder, SwapOptions, SwapOutcome,
};
use isotherm_protocol::history::{AuditEvent, CommandRecord};
use isotherm_protocol::key::UnitId;

use super::worker::Worker;

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
    pub(super) fn command(&mut self, unit: &UnitId, order: &CommandOrder) -> Option<CommandReply> {
        if order.order == Order::Forget {
            return self.forget(unit, &order.by);
        }
        let present = self.intake.present(unit);
        if present.is_none() && !matches!(order.order, Order::Rollback { .. }) {
            return None;
        }
        let before = present.map_or(self.at_start(), |present| present.state);
        let last_sequence = self.intake.with(unit, |actor| actor.last_sequence()).flatten();
        let mut reply = CommandReply {
            accepted: true,
            unit: unit.to_string(),
            state: before,
            reason: None,
            allowed: Vec::new(),
            swap: None,
        };
        let done = match &order.order {
            Order::Rollback { revision, dry_run } => {
                let options =
                    SwapOptions { by: order.by.clone(), dry_run: *dry_run, ..SwapOptions::default() };
                self.command_rollback(unit, *revision, before, options, &mut reply)
            }
            other => self.core_command(other).and_then(|command| self.give_command(unit, &command)),
        };
        match done {
            Ok(state) => reply.state = state,
            Err(reason) => (reply.accepted, reply.reason) = (false, Some(reason)),
        }
        if let (true, Order::PreLaunch(asked)) = (reply.accepted, &order.order) {
            let run = PreLaunchRun { order: *asked, by: order.by.clone() };
            self.records.entry(unit.clone()).or_default().pre_launch = Some(run);
        }
        reply.allowed = reply.state.allowed().iter().map(|name| (*name).to_owned()).collect();
        if matches!(order.order, Order::Rollback { dry_run: true, .. }) {
            return Some(reply);
        }
        let record = CommandRecord {
            command: words(&order.order),
            accepted: reply.accepted,
            reason: reply.reason.clone(),
            state_before: before.to_string(),
            state_after: reply.state.to_string(),
            last_sequence,
            order: Some(order.order.clone()),
        };
        tracing::info!(
            %unit, by = order.by, state = %reply.state, accepted = reply.accepted, reason = reply.reason.as_deref(),
            "command {}", record.command
        );
        // A unit must be stopped with a full disk too: the command stands, and whoever gave it is told.
        if let Err(error) = self.append(Some(unit), &order.by, AuditEvent::Command(record)) {
            let words = format!("it is not in the audit file: {error}");
            reply.reason = Some(reply.reason.map_or(words.clone(), |reason| format!("{reason}; {words}")));
        }
        Some(reply)
    }

    /// What a unit begins in.
    fn at_start(&self) -> State {
        if self.in_standby { State::Standby } else { State::RunningWithoutReversal }
    }

    /// Forgets a unit; `None` for one of which nothing is known.
    fn forget(&mut self, unit: &UnitId, by: &str) -> Option<CommandReply> {
        let present = self.intake.present(unit);
        let is_known =
            present.is_some() || self.records.contains_key(unit) || self.store.last_good(unit).is_some();
        is_known.then_some(())?;
        let before = present.map_or(self.at_start(), |present| present.state);
        let is_heard = self.intake.with(unit, |actor| actor.is_heard(Instant::now())) == Some(true);
        let file = self.folder.first_naming(unit);
        let mut reason = match file {
            _ if is_heard => Some("the unit is still sending: stop its producer first".to_owned()),
            Some(file) => Some(format!("{} names the unit: remove the file first", file.display())),
            None => None,
        };
        if reason.is_none() {
            let record = CommandRecord {
                command: words(&Order::Forget),
                accepted: true,
                reason: None,
                state_before: before.to_string(),
                state_after: "forgotten".to_owned(),
                last_sequence: self.intake.with(unit, |actor| actor.last_sequence()).flatten(),
                order: Some(Order::Forget),
            };
            // Written down first: what is forgotten must not come back with a restart.
            reason =
                self.append(Some(unit), by, AuditEvent::Command(record)).err().map(|error| error.to_string());
        }
        let accepted = reason.is_none();
        if accepted {
            self.records.remove(unit);
            self.losses.retain(|(concerned, _)| concerned.as_ref() != Some(unit));
            self.intake.forget(unit);
            tracing::info!(%unit, by, "forgotten");
        }
        let allowed = before.allowed().iter().map(|name| (*name).to_owned()).collect();
        let reason = reason.or_else(|| Some("forgotten".to_owned()));
        Some(CommandReply { accepted, unit: unit.to_string(), state: before, reason, allowed, swap: None })
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
        reply: &mut CommandReply,
    ) -> Result<State, String> {
        if !state.allowed().contains(&"rollback") {
            let refusal = isotherm_correction::operation::Refusal::State { state, command: "rollback" };
            return Err(refusal.to_string());
        }
        let swap = self.roll_back(unit, revision, options);
        let refused = (swap.outcome == SwapOutcome::Refused)
            .then(|| swap.problems.first().map(|problem| problem.message.clone()).unwrap_or_default());
        reply.swap = Some(swap);
        let state = self.intake.present(unit).map_or(state, |present| present.state);
        refused.map_or(Ok(state), Err)
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
        let duration = match order.duration_s {
            Some(s) if (shortest_s..=longest_s).contains(&s) => Span::from_s(s),
            Some(s) => return Err(format!("duration_s is {s}, must be from {shortest_s} to {longest_s}")),
            None => self.pre_launch.duration,
        };
        Ok(PreLaunchSettings { duration, place: Some(place(&order.place)?), ..self.pre_launch })
    }
}

fn place(order: &PlaceOrder) -> Result<Place, String> {
    let place = Place::new(order.latitude_deg, order.heading_deg, order.pitch_roll_deg);
    place.map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
}

/// A command in words, for audit file and log.
fn words(order: &Order) -> String {
    let at = |place: &PlaceOrder| {
        let PlaceOrder { latitude_deg, heading_deg, pitch_roll_deg } = place;
        let tilt = pitch_roll_deg.map_or("levelled".to_owned(), |[pitch_deg, roll_deg]| {
            format!("pitch {pitch_deg}°, roll {roll_deg}°")
        });
        format!("latitude {latitude_deg}°, heading {heading_deg}°, {tilt}")
    };
    let optional = |name: &str, value: Option<&dyn Display>| {
        value.map_or(name.to_owned(), |value| format!("{name} {value}"))
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
        Order::Rollback { revision, .. } => {
            optional("rollback", revision.as_ref().map(|revision| revision as &dyn Display))
        }
    }
}
