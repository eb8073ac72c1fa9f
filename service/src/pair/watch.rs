//! The thread that looks after units that another instance speaks for.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use isotherm_protocol::codec;
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalEvent, JournalPart};
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::pair::Member;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};

use super::{Pair, Questions};
use crate::ServiceError;
use crate::receive::intake::Intake;
use crate::receive::unit::Wants;
use crate::service::declare::subscribe;

/// How often the units are looked at where no other instance is there.
const ALONE: Duration = Duration::from_millis(100);
/// Shortest and longest interval where one is.
const INTERVAL: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(5)];

/// What the thread hears.
#[derive(Debug)]
enum Event {
    /// An instance has come.
    Came(Member),
    /// An instance has gone.
    Gone(String),
    /// A part of another instance's journal.
    Journal(Vec<u8>),
    /// End.
    Stop,
}

/// The running watch.
#[derive(Debug)]
pub(crate) struct Watch {
    events: Sender<Event>,
    thread: JoinHandle<()>,
    subscribers: Vec<Subscriber<()>>,
}

impl Watch {
    /// Subscribes to what other instances publish, and starts the thread.
    pub(crate) async fn start(
        session: &Session,
        pair: &Arc<Pair>,
        intake: &Arc<Intake>,
        questions: Questions,
    ) -> Result<Self, ServiceError> {
        let (events, receiver) = channel();
        let hears = Arc::clone(intake);
        let corrected = subscribe(session, key::ALL_CORRECTED, move |sample| {
            if let Some(serial) = key::parse_corrected(sample.key_expr().as_str()) {
                hears.hear(serial, &sample.payload().to_bytes(), Instant::now());
            }
        });
        let corrected = corrected.await?;
        let told = events.clone();
        let journals = subscribe(session, key::ALL_JOURNALS, move |sample| {
            let _ = told.send(Event::Journal(sample.payload().to_bytes().into_owned()));
        });
        let journals = journals.await?;
        let told = events.clone();
        let members = session
            .liveliness()
            .declare_subscriber(key::ALL_MEMBERS)
            .history(true)
            .callback(move |sample: Sample| {
                let Some(member) = Member::parse(sample.key_expr().as_str()) else { return };
                let came = sample.kind() == SampleKind::Put;
                let event = if came { Event::Came(member) } else { Event::Gone(member.instance) };
                let _ = told.send(event);
            })
            .await
            .map_err(|source| ServiceError::Declare { key: key::ALL_MEMBERS, source })?;
        let work = Work {
            pair: Arc::clone(pair),
            intake: Arc::clone(intake),
            joiner: Joiner::new(),
            interval: (pair.takeover / 10).clamp(INTERVAL[0], INTERVAL[1]),
            questions,
        };
        let thread = std::thread::Builder::new()
            .name("isotherm-pair".to_owned())
            .spawn(move || work.run(&receiver))
            .map_err(ServiceError::Thread)?;
        Ok(Self { events, thread, subscribers: vec![corrected, journals, members] })
    }

    /// Ends it; whether it ended in order.
    pub(crate) fn stop(self) -> bool {
        let undeclared = self.subscribers.into_iter().map(|it| it.undeclare().wait().is_ok());
        let undeclared = undeclared.fold(true, |all, one| all & one);
        undeclared & self.events.send(Event::Stop).is_ok() & self.thread.join().is_ok()
    }
}

/// What the thread works with.
struct Work {
    pair: Arc<Pair>,
    intake: Arc<Intake>,
    joiner: Joiner,
    interval: Duration,
    questions: Questions,
}

impl Work {
    fn run(mut self, events: &Receiver<Event>) {
        let mut next = Instant::now();
        self.pair.begin(next);
        loop {
            match events.recv_timeout(next.saturating_duration_since(Instant::now())) {
                Ok(Event::Stop) | Err(RecvTimeoutError::Disconnected) => break,
                Ok(event) => {
                    self.take(event);
                    next = next.min(Instant::now() + self.interval);
                }
                Err(RecvTimeoutError::Timeout) => {
                    let now = Instant::now();
                    let late_at = self.look(now);
                    next = now + if self.pair.has_others() { self.interval } else { ALONE };
                    next = late_at.map_or(next, |at| next.min(at));
                }
            }
        }
    }

    fn take(&mut self, event: Event) {
        match event {
            Event::Came(member) => {
                let (name, mode, priority) = (member.name.clone(), member.mode.name(), member.priority);
                let instance = member.instance.clone();
                if self.pair.come_elsewhere(&member) {
                    let _ = self.questions.takes.send(instance);
                } else if self.pair.come(member) {
                    tracing::info!(name, mode, priority, "another service instance has appeared");
                    let _ = self.questions.records.send(None);
                    self.intake.each_unit(|actor| actor.introduce(&instance));
                }
                self.look(Instant::now());
            }
            Event::Gone(instance) => {
                if self.pair.go(&instance) {
                    tracing::warn!(instance, "the other service instance, or the connection to it, is gone");
                }
                self.look(Instant::now());
            }
            Event::Journal(frame) => {
                // What is no part of an entry, or of an incomplete one, is found missing by its number.
                let entry = codec::decode::<JournalPart>(&frame).ok();
                let entry = entry.and_then(|part| self.joiner.join(part).ok().flatten());
                if let Some(entry) = entry {
                    self.entry(entry);
                }
            }
            Event::Stop => {}
        }
    }

    /// An entry of another instance's journal. Who speaks takes nothing of one that is none of the pair.
    fn entry(&self, entry: JournalEntry) {
        let Ok(unit) = UnitId::new(&entry.unit) else { return };
        // One that ends may have been forgotten.
        let is_written_down = matches!(
            entry.event,
            JournalEvent::Changed { .. } | JournalEvent::Commanded { .. } | JournalEvent::Ended
        );
        let standing = self.pair.standing();
        let is_member = self.pair.is_there(&entry.instance);
        self.intake.with(&unit, |actor| {
            if is_member || !actor.speaks() {
                actor.hear_journal(entry, Instant::now(), &standing);
            }
        });
        if is_written_down {
            let _ = self.questions.records.send(Some(unit));
        }
    }

    /// Looks at every unit; says when the first of them that waits for the other instance has waited for too long.
    fn look(&self, now: Instant) -> Option<Instant> {
        let still = self.pair.look(now);
        let standing = self.pair.standing();
        let mut first_late = None;
        let looked = self.intake.each_unit(|actor| {
            match still {
                Some(short) if actor.speaks() => actor.follow(now, Pair::footing(short)),
                // Connections were lost: what the other did meanwhile is in its memory alone.
                Some(false) => actor.lose_step(),
                _ => {}
            }
            let Wants { memory, spoke, alarm, late_at } = actor.watch_speech(now, &standing);
            // Who is late already and does not take over is looked at as often as all.
            first_late = first_late.into_iter().chain(late_at.filter(|at| *at > now)).min();
            (memory || spoke || alarm.is_some()).then(|| (actor.id().clone(), memory, spoke, alarm))
        });
        if still.is_some() {
            self.pair.told();
            tracing::warn!(
                "this process was stopped for a while: it checks whether another instance publishes"
            );
        }
        let mut spoken = Vec::new();
        for (unit, memory, spoke, alarm) in looked.into_iter().flatten() {
            if memory {
                let _ = self.questions.memories.send(unit.clone());
            }
            if let Some((kind, words)) = alarm {
                self.intake.alarm(kind, words);
            }
            if spoke {
                spoken.push(unit.to_string());
            }
        }
        if !spoken.is_empty() {
            tracing::warn!(
                units = spoken.join(" "),
                "this instance publishes from now on, instead of another"
            );
        }
        first_late
    }
}
