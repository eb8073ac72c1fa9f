//! Whether a unit's corrected ticks go out: at once, or only where the instance that speaks for it is silent.
//!
//! While another instance speaks, what is computed here is kept for a while: to be compared with what that one publishes, and to be
//! published in its place from the last tick on that was heard of it.

mod following;
mod heard;
mod kept;
mod own;

use std::time::{Duration, Instant};

use isotherm_protocol::journal::JournalEvent;
use isotherm_protocol::key::Input;
use isotherm_protocol::pair::{Role, UnitRole};

use super::{Plan, UnitActor};
use crate::control::Notice;
use crate::receive::fault::FaultKind;
use following::Following;

/// How often the memory is asked for while none comes.
const ASK_INTERVAL: Duration = Duration::from_millis(250);
/// For how long an active instance publishes what it has heard of the other, too: that may have reached nobody else, and what is behind it
/// is published before the other is missed.
const REPEATED: Duration = Duration::from_millis(20);
/// How long nothing of any other instance must be seen before one that lacks something speaks: both may have lost the network, and
/// the other may be the one that went on. Longer than it takes to connect again once the network is back.
const LONELY: Duration = Duration::from_millis(1500);
/// The same for one that lacks nothing and goes before all others: two that have yielded to each other.
const MUTUAL: Duration = Duration::from_millis(100);

/// How the instance stands to the others, as a unit needs to know it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Standing {
    /// How long the other may be silent.
    pub(crate) takeover: Duration,
    /// Whether corrected ticks go out while another instance speaks, too.
    pub(crate) active: bool,
    /// Whether some other instance goes before this one.
    pub(crate) yields: bool,
    /// Since when no other instance is seen; `None` where one is.
    pub(crate) alone_since: Option<Instant>,
    /// Whether another instance was seen once, and none is now.
    pub(crate) deserted: bool,
}

/// What a unit's stream is worth when it begins to follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Footing {
    /// It may lack what the other instance has heard.
    Nothing,
    /// It lacks nothing, and speaks again where nobody is heard.
    Doubt,
    /// It lacks nothing; another instance speaks.
    All,
    /// It has lost the other instance and its producer: the network, as far as it can know.
    Isolated,
}

/// What a unit wants of its surroundings after a look.
#[derive(Debug, Default)]
pub(crate) struct Wants {
    /// The memory of the instance that speaks.
    pub(crate) memory: bool,
    /// It has begun to speak.
    pub(crate) spoke: bool,
    /// What was to be impossible, in words.
    pub(crate) alarm: Option<(FaultKind, String)>,
    /// When the other instance's output is late, if nothing is heard until then: the next look is due by that time.
    pub(crate) late_at: Option<Instant>,
}

/// Where the output of a unit goes, and what is known of the other instance's.
#[derive(Debug, Default)]
pub(super) struct Speech {
    following: Option<Box<Following>>,
    compared: u64,
    differing: u64,
    takeovers: u64,
    last_difference: Option<String>,
    /// Since when another instance publishes ticks that this one has published.
    doubled: Option<(Instant, Instant)>,
    two_told: bool,
    /// The journal has to say what the stream knows: another instance's said it until now.
    memory_due: bool,
    /// What was ordered here a moment ago, and when: another instance's memory may not have it yet.
    own: Vec<(Instant, JournalEvent)>,
    /// When the last other instance was lost.
    lost_at: Option<Instant>,
    /// The connection to the producer may have gone with the other instance: gyro ticks may be missing here that it has.
    pub(super) uncertain: bool,
}

impl UnitActor {
    /// Another instance speaks for the unit, or may do so: nothing goes out from here on.
    pub(crate) fn follow(&mut self, now: Instant, footing: Footing) {
        if self.speech.following.is_some() {
            return;
        }
        self.speech.doubled = None;
        self.speech.memory_due = false;
        self.speech.following = Some(Box::new(Following::new(&self.stream, now, footing)));
        self.status_due = true;
    }

    /// Highest revision counter that the unit was given.
    pub(crate) fn highest_revision(&self) -> u64 {
        self.stream.next_counter().saturating_sub(1)
    }

    /// Whether it is being found out if another instance speaks.
    pub(crate) fn doubts(&self) -> bool {
        self.speech.following.as_ref().is_some_and(|following| following.doubt)
    }

    /// Whether this instance publishes the unit's ticks, and swaps and commands are its own.
    pub(crate) fn speaks(&self) -> bool {
        self.speech.following.as_ref().is_none_or(|following| following.isolated)
    }

    /// Notes a frame before the stream is given it.
    pub(super) fn note_frame(&mut self, input: Input, frame: &[u8], arrival: Instant) {
        if let Some(following) = &mut self.speech.following {
            let ns = following.ns(arrival);
            following.follower.frame(input, ns, frame);
        }
    }

    /// Where a corrected frame goes.
    pub(super) fn let_out(&mut self, frame: Vec<u8>) -> Result<(), zenoh::Error> {
        // What an isolated unit gives out is the end of a stream that has stopped.
        let following = self.speech.following.as_mut().filter(|following| !following.isolated);
        let Some(following) = following else { return (self.outlet)(frame) };
        let now = Instant::now();
        let lacks = following.kept.computed(frame, now);
        following.intact &= following.follower.has_joined() || !lacks;
        if !following.also_out {
            return Ok(());
        }
        if lacks {
            // What is missing here the other may have: it says nothing until it has the other's memory.
            following.also_out = false;
            following.lose();
            return Ok(());
        }
        let due = following.kept.due(now, REPEATED);
        due.into_iter().map(|frame| (self.outlet)(frame)).fold(Ok(()), Result::and)
    }

    /// An active instance publishes what its stream makes as soon as that has joined, and what it made until then: the other may have
    /// stood still meanwhile, and published nothing.
    fn publish_owed(&mut self, now: Instant, active: bool) {
        let Some(following) = &mut self.speech.following else { return };
        following.also_out = active && following.follower.has_joined();
        if following.also_out {
            let owed = following.kept.due(now, REPEATED);
            self.publish_kept(owed);
        }
    }

    /// Publishes frames that were kept.
    fn publish_kept(&mut self, frames: Vec<Vec<u8>>) {
        for frame in frames {
            if let Err(error) = (self.outlet)(frame) {
                self.note_unpublished(1, &error);
            }
        }
    }

    /// Goes on as the journal says, as far as frames and entries have come.
    fn catch_up(&mut self, now: Instant) {
        let Some(following) = &mut self.speech.following else { return };
        let ns = following.ns(now);
        let had_joined = following.follower.has_joined();
        let (rebuilt, stuck) = following.follower.advance(&self.stream, following.kept.made, ns);
        if stuck {
            following.lose();
        }
        let Some(rebuilt) = rebuilt else { return };
        if !rebuilt.exact {
            tracing::debug!(unit = %self.stream.id(), "the last frame that the other instance received is unknown");
        }
        let before = had_joined.then_some(rebuilt.before);
        following.kept.replace(rebuilt.frames, before, now);
        (following.isolated, following.intact) = (false, true);
        self.stream = rebuilt.stream;
        if !had_joined && following.follower.has_joined() {
            following.note_given(&self.stream);
            tracing::info!(unit = %self.stream.id(), revision = self.stream.revision().counter, "in step with the \
                publishing instance");
        }
        self.do_own_again();
        let counters = self.counters();
        self.arrivals.go_on_from(now, &counters);
        self.status_due = true;
        self.look();
    }

    /// Looks at the unit as the clock goes on.
    pub(crate) fn watch_speech(&mut self, now: Instant, standing: &Standing) -> Wants {
        let mut wants = Wants::default();
        self.give_up_own(now);
        let lost_at = standing.alone_since.filter(|_| standing.deserted);
        if lost_at.is_some() && std::mem::replace(&mut self.speech.lost_at, lost_at) != lost_at {
            self.speech.uncertain = true;
        }
        if self.speech.following.is_none() {
            if standing.deserted && self.arrivals.is_over(now) {
                tracing::info!(unit = %self.stream.id(), "nothing is received from the other instance or the \
                    producer: standby");
                self.follow(now, Footing::Isolated);
                self.speech.uncertain = true;
                return wants;
            }
            wants.alarm = self.two_speak(now);
            // Another instance's journal went before.
            if std::mem::take(&mut self.speech.memory_due) {
                self.journal_memory();
            }
            return wants;
        }
        self.catch_up(now);
        self.publish_owed(now, standing.active);
        let Some(following) = &mut self.speech.following else { return wants };
        let joined = following.follower.has_joined();
        let settled = following.kept.settle(now, joined && !following.follower.is_waiting());
        self.speech.compared += settled.compared;
        self.speech.differing += settled.differing;
        if let Some((tick, words)) = settled.difference {
            let series = self.stream.incoming_series();
            let words = format!("unit {}, series {series}, sequence {tick}: {words}", self.stream.id());
            self.speech.last_difference = Some(words.clone());
            wants.alarm = Some((FaultKind::OtherBits, words));
            following.lose();
        } else if settled.missed {
            following.lose();
        }
        // Of a network that comes back, the producer may be heard first.
        let alone =
            standing.alone_since.map(|since| now.saturating_duration_since(since.max(following.listens)));
        let mutual = following.intact && !standing.yields && alone.is_none();
        let silence = if mutual { MUTUAL } else { LONELY };
        wants.late_at = following.kept.late_at(standing.takeover);
        let late = wants.late_at.is_some_and(|at| at <= now);
        // Nor does a unit that sends nothing wait for ever.
        let still_silent = now.saturating_duration_since(following.listens) > standing.takeover * 2;
        let lonely = alone.is_some_and(|alone| alone >= LONELY) || following.kept.is_silent(now, silence);
        // Who has just yielded knows what the other does, before the other's memory has come.
        let knows = joined || (following.intact && !following.doubt);
        let is_due =
            lonely || (knows && (alone.is_some() || late)) || (following.doubt && (late || still_silent));
        if is_due && !following.isolated {
            wants.spoke = !following.doubt;
            self.speak(now, standing.takeover);
            return wants;
        }
        let ask = !joined && !following.doubt && !following.isolated && !following.follower.has_memory();
        if ask && following.asked.is_none_or(|asked| now.saturating_duration_since(asked) >= ASK_INTERVAL) {
            following.asked = Some(now);
            wants.memory = true;
        }
        wants
    }

    /// Publishes from here on, beginning behind the last tick that was heard of another instance. What that one published within the
    /// last `overlap` is published again: of what it sent at its end, some may have come here and nowhere else.
    pub(crate) fn speak(&mut self, now: Instant, overlap: Duration) {
        let Some(following) = self.speech.following.take() else { return };
        let Following { mut kept, doubt, orders, follower, .. } = *following;
        // Of what an operator ordered nothing is lost with the instance that took it.
        if let Some(rebuilt) = follower.finish(&mut self.stream) {
            kept.replace(rebuilt.frames, Some(rebuilt.before), now);
            self.stream = rebuilt.stream;
            self.do_own_again();
        }
        self.publish_kept(kept.due(now, overlap));
        if !doubt {
            self.speech.takeovers += 1;
            self.speech.memory_due = true;
        }
        for order in orders {
            self.notices.untold.push_back(Notice::Followed(Box::new(order)));
        }
        self.notices.untold.push_back(Notice::Speaks);
        self.status_due = true;
        self.look();
    }

    /// Another instance asks for what the one that speaks knows. If that is the one that is followed here, nobody speaks, and of a unit
    /// without ticks nobody would miss it: this one speaks. So does the first of two that ask each other.
    pub(crate) fn is_asked_by(&mut self, instance: &str, now: Instant, standing: &Standing) {
        let Some(following) = &self.speech.following else { return };
        let nobody_speaks = if following.follower.has_joined() {
            following.follower.instance().is_some_and(|followed| *followed == *instance)
        } else {
            let listens = now.saturating_duration_since(following.listens);
            !standing.yields && listens >= LONELY && !following.kept.was_heard_within(now, LONELY)
        };
        if nobody_speaks {
            tracing::warn!(unit = %self.stream.id(), "no instance publishes: this one does from now on");
            self.speak(now, standing.takeover);
        }
    }

    /// An instance has come. What it did while there was no connection to it came here in no journal: its memory is taken anew. Instances
    /// that speak find out about one another by what the journal says that each knows.
    pub(crate) fn introduce(&mut self, instance: &str) {
        let Some(following) = &mut self.speech.following else {
            self.speech.memory_due = !self.speech.uncertain;
            return;
        };
        self.speech.memory_due = false;
        if following.follower.instance().is_some_and(|followed| *followed == *instance) {
            following.lose();
        }
    }

    /// Puts what a unit was last given in the place of what this instance had given it.
    pub(crate) fn plan_again(&mut self, plan: Plan) {
        self.plan = plan;
    }

    /// What the instance does for the unit.
    pub(crate) fn role(&self) -> UnitRole {
        let Speech { following, compared, differing, takeovers, last_difference, .. } = &self.speech;
        let role = match following {
            None => Role::Speaking,
            Some(following) if following.isolated => Role::Speaking,
            Some(following) if following.follower.has_joined() || following.doubt => Role::Standby,
            Some(_) => Role::Joining,
        };
        UnitRole {
            unit: self.stream.id().to_string(),
            role,
            ticks_compared: *compared,
            ticks_differing: *differing,
            takeovers: *takeovers,
            last_difference: last_difference.clone(),
        }
    }

    /// The stream has started anew after an alarm, or the process stood still for long: it is not what the other's is any more, and may lack
    /// what the other has heard.
    pub(crate) fn lose_step(&mut self) {
        if let Some(following) = &mut self.speech.following {
            following.lose();
            following.doubt = false;
        }
    }
}
