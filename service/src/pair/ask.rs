//! What a standby asks of the instance that speaks: memories of units, histories, documents.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use isotherm_bus::inquiry::{ask_all, ask_each, pair_reports};
use isotherm_protocol::codec;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::AuditEntry;
use isotherm_protocol::journal::{Joiner, JournalPart};
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::pair::{Member, Role};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use zenoh::Session;
use zenoh::sample::Sample;

use super::Pair;
use crate::control::{Carried, Inbox, Message};
use crate::receive::intake::Intake;

/// How long an answer is waited for.
const LIMIT: Duration = Duration::from_secs(2);
/// How long the next question for memories waits for the answers to the one before: a connection may have been lost with it.
const NEXT_MEMORY: Duration = Duration::from_millis(500);
/// How long after an entry of the journal histories are asked for: by then what follows from it is in the audit file, as a rule; and
/// once more, for the first tick of a calibration.
const DELAYS: [Duration; 2] = [Duration::from_millis(200), Duration::from_millis(1500)];
/// How long until what could not be written down is asked for again: a disk that was full may have room again.
const AGAIN: Duration = Duration::from_secs(2);
/// The parameter that says which instance asks for a memory.
pub(crate) const ASKS: &str = "instance";
/// Most entries of a history that are asked for.
const ENTRIES: u32 = 1000;

/// Where questions are handed in.
#[derive(Debug, Clone)]
pub(crate) struct Questions {
    /// The memory of a unit.
    pub(super) memories: UnboundedSender<UnitId>,
    /// The histories of a unit, or of all, and the documents in them.
    pub(super) records: UnboundedSender<Option<UnitId>>,
    /// What an instance of another group takes.
    pub(super) takes: UnboundedSender<String>,
}

/// What is asked with; its tasks end with the last [`Questions`].
#[derive(Debug, Clone)]
pub(crate) struct Asker {
    session: Session,
    pair: Arc<Pair>,
    intake: Arc<Intake>,
    inbox: Inbox,
}

impl Asker {
    /// Starts its tasks: a memory is not to wait until histories have come. The first they find out is which units other instances
    /// speak for.
    pub(crate) fn start(
        session: &Session,
        pair: &Arc<Pair>,
        intake: &Arc<Intake>,
        inbox: Inbox,
    ) -> (Questions, [JoinHandle<()>; 3]) {
        let (memories, memories_due) = unbounded_channel();
        let (records, records_due) = unbounded_channel();
        let (takes, takes_due) = unbounded_channel();
        let asker =
            Self { session: session.clone(), pair: Arc::clone(pair), intake: Arc::clone(intake), inbox };
        let tasks = [
            tokio::spawn(asker.clone().ask_memories(memories_due)),
            tokio::spawn(asker.clone().ask_takes(takes_due)),
            tokio::spawn(asker.ask_records(records_due)),
        ];
        (Questions { memories, records, takes }, tasks)
    }

    async fn ask_memories(self, mut questions: UnboundedReceiver<UnitId>) {
        while let Some(unit) = questions.recv().await {
            let mut units = BTreeSet::from([unit]);
            while let Ok(unit) = questions.try_recv() {
                units.insert(unit);
            }
            let answered = tokio::spawn(self.clone().memories(units));
            let _ = tokio::time::timeout(NEXT_MEMORY, answered).await;
        }
    }

    async fn ask_takes(self, mut questions: UnboundedReceiver<String>) {
        while let Some(instance) = questions.recv().await {
            for sample in self.ask(&key::pair(&instance)).await {
                if let Ok(report) = serde_json::from_slice(&sample.payload().to_bytes()) {
                    self.pair.elsewhere.said(&report);
                }
            }
        }
    }

    async fn ask_records(self, mut questions: UnboundedReceiver<Option<UnitId>>) {
        let mut copied = Copied::default();
        if self.pair.is_opening() {
            // What fails is asked for again when the other instance is introduced.
            let _ = self.records(None, &mut copied).await;
            let spoken = self.spoken().await;
            self.pair.opened(&self.intake, &spoken);
        }
        // When histories are asked for, and of which unit.
        let mut due: BTreeSet<(Instant, Option<UnitId>)> = BTreeSet::new();
        loop {
            let next = due.first().map(|(at, _)| at.saturating_duration_since(Instant::now()));
            match tokio::time::timeout(next.unwrap_or(Duration::from_secs(3600)), questions.recv()).await {
                Ok(None) => break,
                Ok(Some(unit)) => {
                    let now = Instant::now();
                    due.extend(DELAYS.map(|delay| (now + delay, unit.clone())));
                }
                Err(_) => {
                    let now = Instant::now();
                    let later = due.split_off(&(now, None));
                    let ripe: BTreeSet<_> =
                        std::mem::replace(&mut due, later).into_iter().map(|(_, unit)| unit).collect();
                    for unit in ripe {
                        let done = self.records(unit.clone(), &mut copied).await;
                        if !done && due.iter().all(|(_, other)| *other != unit) {
                            due.insert((Instant::now() + AGAIN, unit));
                        }
                    }
                }
            }
        }
    }

    /// What others answer on a key; those of this instance are left out.
    async fn ask(&self, selector: &str) -> Vec<Sample> {
        let own = format!("isotherm/{}/", self.pair.me().instance);
        match ask_all(&self.session, selector, LIMIT).await {
            Ok((replies, _)) => {
                let samples = replies.into_iter().filter_map(|reply| reply.into_result().ok());
                samples.filter(|sample| !sample.key_expr().as_str().starts_with(&own)).collect()
            }
            Err(error) => {
                tracing::warn!("{error}");
                Vec::new()
            }
        }
    }

    /// Units that others speak for.
    async fn spoken(&self) -> BTreeSet<UnitId> {
        let reports = pair_reports(&self.session, LIMIT).await.unwrap_or_else(|error| {
            tracing::warn!("{error}");
            Vec::new()
        });
        let others = reports.into_iter().filter(|report| report.member.instance != self.pair.me().instance);
        let units = others.flat_map(|report| report.units).filter(|unit| unit.role == Role::Speaking);
        units.filter_map(|unit| UnitId::new(&unit.unit).ok()).collect()
    }

    /// Has units go on from the memory of the instance that speaks for them, each as it comes. It says who asks: an instance that is
    /// followed and asks does not speak.
    async fn memories(self, mut units: BTreeSet<UnitId>) {
        let all = units.len() > 8;
        let keys: Vec<_> =
            if all { vec![key::ALL_JOURNALS.to_owned()] } else { units.iter().map(key::journal).collect() };
        let mut joiner = Joiner::new();
        for key in keys {
            let selector = format!("{key}?{ASKS}={}", self.pair.me().instance);
            let mut replies = match ask_each(&self.session, &selector, LIMIT).await {
                Ok(replies) => replies,
                Err(error) => {
                    tracing::warn!("{error}");
                    continue;
                }
            };
            while let Some(reply) = replies.recv().await {
                let Ok(sample) = reply.into_result() else { continue };
                let part = codec::decode::<JournalPart>(&sample.payload().to_bytes()).ok();
                let entry = part.and_then(|part| joiner.join(part).ok().flatten());
                let entry = entry.filter(|entry| entry.instance != self.pair.me().instance);
                let Some(unit) = entry.as_ref().and_then(|entry| UnitId::new(&entry.unit).ok()) else {
                    continue;
                };
                if let Some(entry) = entry.filter(|_| units.remove(&unit)) {
                    let standing = self.pair.standing();
                    self.intake.with(&unit, |actor| {
                        if !actor.speaks() {
                            actor.hear_journal(entry, Instant::now(), &standing);
                        }
                    });
                    if !all || units.is_empty() {
                        break;
                    }
                }
            }
        }
    }

    /// Has histories and documents written down here too: what came since it was done last. Of units that this instance speaks for, what
    /// others have accepted without it. Whether all of it is written down.
    async fn records(&self, unit: Option<UnitId>, copied: &mut Copied) -> bool {
        let others = self.pair.others();
        let speaks = |unit: &UnitId| self.intake.with(unit, |actor| actor.speaks()) == Some(true);
        if others.is_empty() || unit.as_ref().is_some_and(speaks) {
            // When one comes, all is asked for.
            return true;
        }
        let instances: Vec<_> = others.iter().map(|other| other.instance.clone()).collect();
        copied.of(others);
        let selector = unit.as_ref().map_or(key::ALL_HISTORY.to_owned(), key::history);
        let after = copied.after(unit.as_ref());
        let samples = self.ask(&format!("{selector}?limit={ENTRIES};after={after}")).await;
        let (mut done, last) = self.take_histories(samples, true, &mut copied.units).await;
        if unit.is_some() {
            return done;
        }
        copied.all = last.map_or(copied.all, |last| copied.all.max(last));
        let spoken = self.intake.each_unit(|actor| actor.speaks());
        if !(self.pair.speaks_first() || spoken.contains(&true)) {
            return done;
        }
        for instance in instances {
            let after = copied.below.get(&instance).copied().unwrap_or(0);
            let samples =
                self.ask(&format!("{selector}?limit={ENTRIES};after={after};instance={instance}")).await;
            let (all, last) = self.take_histories(samples, false, &mut BTreeMap::new()).await;
            done &= all;
            if let Some(last) = last {
                copied.below.insert(instance, after.max(last));
            }
        }
        done
    }

    /// Has histories written down, of those who speak (`holds`) or of others. Whether all is done that is to be, and the number of the
    /// last entry where nothing before it was left out.
    async fn take_histories(
        &self,
        samples: Vec<Sample>,
        holds: bool,
        units: &mut BTreeMap<UnitId, u64>,
    ) -> (bool, Option<u64>) {
        let (mut done, mut newest) = (true, Some(0));
        for sample in samples {
            let serial = key::parse_history(sample.key_expr().as_str());
            let Some(unit) = serial.and_then(|serial| UnitId::new(serial).ok()) else { continue };
            if !self.intake.takes(&unit) {
                continue;
            }
            let Ok(entries) = serde_json::from_slice::<Vec<AuditEntry>>(&sample.payload().to_bytes()) else {
                continue;
            };
            let Some(last) = entries.last().map(|entry| entry.number) else { continue };
            let is_due = self.intake.speaks_for(&unit) != holds;
            if is_due
                && self.copy(Carried { unit: unit.clone(), holds, entries, kept: BTreeMap::new() }).await
            {
                newest = newest.map(|newest| newest.max(last));
                units.insert(unit, last);
            } else {
                newest = None;
                done &= !is_due;
            }
        }
        (done, newest)
    }

    /// Has entries of a unit written down here, with the documents that they name; whether they are.
    async fn copy(&self, mut carried: Carried) -> bool {
        // A document may lie under an overlay: that is known when the overlay is there.
        for _ in 0..2 {
            let (answer, lacking) = oneshot::channel();
            let _ = self.inbox.tell(Message::Lacks(carried.clone(), answer));
            for digest in lacking.await.unwrap_or_default() {
                let found = self.ask(&key::kept("*", &digest)).await;
                let bytes = found.iter().map(|sample| sample.payload().to_bytes().into_owned());
                if let Some(bytes) = bytes.into_iter().find(|bytes| Digest::of(bytes) == digest) {
                    carried.kept.insert(digest, bytes);
                }
            }
        }
        let (answer, done) = oneshot::channel();
        let _ = self.inbox.tell(Message::Carry(carried, answer));
        done.await.is_ok()
    }
}

/// How far the audit file of another instance has been written down here: the number of an entry.
#[derive(Debug, Default)]
struct Copied {
    /// The instance; `None` where there are several, whose numbers differ.
    instance: Option<String>,
    /// Of all units.
    all: u64,
    units: BTreeMap<UnitId, u64>,
    /// Of what instances have accepted that do not speak.
    below: BTreeMap<String, u64>,
}

impl Copied {
    /// Begins anew where the other instance is another one.
    fn of(&mut self, others: Vec<Member>) {
        let instance = <[Member; 1]>::try_from(others).ok().map(|[other]| other.instance);
        if instance.is_none() || self.instance != instance {
            *self = Self { instance, ..Self::default() };
        }
    }

    fn after(&self, unit: Option<&UnitId>) -> u64 {
        self.all.max(unit.and_then(|unit| self.units.get(unit).copied()).unwrap_or(0))
    }
}
