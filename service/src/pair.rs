//! Several instances for one stream: who is there, who goes before whom, and what follows from it.
//!
//! | module | holds |
//! |---|---|
//! | `watch` | the thread that notices a silent instance, and hears the journals of others |
//! | `ask` | memories, histories and documents of the instance that speaks, asked for |
//! | [`crate::unit`] `speech` | one unit: what is kept, compared and published in the other's place |
//! | [`crate::registrar`] `carry` | histories and documents, written down here too |

mod ask;
mod watch;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError, RwLock};
use std::time::{Duration, Instant};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::pair::{Member, Mode, PairReport};

use crate::config::{PairSettings, Settings};
use crate::intake::Intake;
use crate::unit::{Standing, UnitActor};
pub(crate) use ask::{Asker, Questions};
pub(crate) use watch::Watch;

/// How long a unit that is not taken is remembered.
const PASSED_OVER: Duration = Duration::from_secs(10);
/// How long a process may stand still without losing its connections: well below the lease.
const SHORT: Duration = Duration::from_millis(300);
/// Most such units.
const MOST_PASSED_OVER: usize = 4096;

/// This instance among the others.
#[derive(Debug)]
pub(crate) struct Pair {
    me: Member,
    takeover: Duration,
    takes: Vec<String>,
    others: RwLock<BTreeMap<String, Member>>,
    alone_since: Mutex<Option<Instant>>,
    /// Whether it is not known yet which units the others speak for.
    opening: AtomicBool,
    /// Whether [`Self::others`] has any: asked with every message.
    accompanied: AtomicBool,
    start: Instant,
    /// When the watch last looked (µs since the start).
    beat: AtomicU64,
    passed_over: Mutex<BTreeMap<String, Instant>>,
}

impl Pair {
    /// `instance` is this one's Zenoh id as text; `others` are those that were there before it.
    pub(crate) fn new(
        settings: &Settings,
        instance: String,
        started_unix_ms: i64,
        others: Vec<Member>,
    ) -> Self {
        let PairSettings { name, mode, priority, takeover } = settings.pair.clone();
        let name = name.unwrap_or_else(|| instance.chars().take(8).collect());
        let group = Digest::of(settings.units.join("\n").as_bytes()).to_string().chars().take(8).collect();
        let me = Member { instance, name, mode, priority, started_unix_ms, group };
        let others: Vec<_> = others.into_iter().filter(|other| other.group == me.group).collect();
        let alone = others.is_empty().then(Instant::now);
        Self {
            me,
            takeover,
            takes: settings.units.clone(),
            opening: AtomicBool::new(!others.is_empty()),
            accompanied: AtomicBool::new(!others.is_empty()),
            others: RwLock::new(others.into_iter().map(|other| (other.instance.clone(), other)).collect()),
            alone_since: Mutex::new(alone),
            start: Instant::now(),
            beat: AtomicU64::new(0),
            passed_over: Mutex::default(),
        }
    }

    /// This instance.
    pub(crate) fn me(&self) -> &Member {
        &self.me
    }

    /// The others that are there, by instance.
    pub(crate) fn others(&self) -> Vec<Member> {
        self.others.read().unwrap_or_else(PoisonError::into_inner).values().cloned().collect()
    }

    /// Whether there are any.
    pub(crate) fn has_others(&self) -> bool {
        self.accompanied.load(Ordering::Acquire)
    }

    /// An instance has come; whether it is new.
    fn come(&self, member: Member) -> bool {
        if member.instance == self.me.instance || member.group != self.me.group {
            return false;
        }
        *self.alone_since.lock().unwrap_or_else(PoisonError::into_inner) = None;
        let mut others = self.others.write().unwrap_or_else(PoisonError::into_inner);
        // Looked seldom while it was alone.
        self.beat.store(self.since_start_us(Instant::now()), Ordering::Release);
        self.accompanied.store(true, Ordering::Release);
        others.insert(member.instance.clone(), member).is_none()
    }

    /// An instance has gone, or the connection to it; whether it was there.
    fn go(&self, instance: &str) -> bool {
        let mut others = self.others.write().unwrap_or_else(PoisonError::into_inner);
        let gone = others.remove(instance).is_some();
        if gone && others.is_empty() {
            self.accompanied.store(false, Ordering::Release);
            *self.alone_since.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
        }
        gone
    }

    /// Whether some other instance goes before this one.
    fn yields(&self) -> bool {
        let others = self.others.read().unwrap_or_else(PoisonError::into_inner);
        others.values().any(|other| other.goes_before(&self.me))
    }

    /// Whether a unit that nobody has heard before is this instance's to speak for.
    pub(crate) fn speaks_first(&self) -> bool {
        !self.is_opening() && !self.yields()
    }

    /// Whether it is not known yet which units the others speak for.
    pub(crate) fn is_opening(&self) -> bool {
        self.opening.load(Ordering::Acquire)
    }

    /// What a unit needs to know of it.
    pub(crate) fn standing(&self) -> Standing {
        Standing {
            takeover: self.takeover,
            active: self.me.mode == Mode::Active,
            yields: self.yields(),
            alone_since: *self.alone_since.lock().unwrap_or_else(PoisonError::into_inner),
        }
    }

    /// Where this process has stood still for so long that another instance may speak in its place by now: whether it was so short that no
    /// connection was lost by it.
    pub(crate) fn has_stood_still(&self, now: Instant) -> Option<bool> {
        if !self.has_others() {
            return None;
        }
        let still_us = self.since_start_us(now).saturating_sub(self.beat.load(Ordering::Acquire));
        let still = Duration::from_micros(still_us);
        (still > self.takeover + self.takeover / 2).then_some(still < SHORT)
    }

    /// The watch looks; whether it has stood still before.
    fn look(&self, now: Instant) -> Option<bool> {
        let still = self.has_stood_still(now);
        self.beat.store(self.since_start_us(now), Ordering::Release);
        still
    }

    fn since_start_us(&self, now: Instant) -> u64 {
        u64::try_from(now.saturating_duration_since(self.start).as_micros()).unwrap_or(u64::MAX)
    }

    /// It is known which units the others speak for: this instance speaks for the rest, where none goes before it.
    fn opened(&self, intake: &Intake, spoken: &BTreeSet<UnitId>) {
        self.opening.store(false, Ordering::Release);
        if self.yields() {
            return;
        }
        let (now, takeover) = (Instant::now(), self.takeover);
        intake.each_unit(|actor: &mut UnitActor| {
            if !spoken.contains(actor.id()) && !actor.speaks() {
                actor.speak(now, takeover);
            }
        });
    }

    /// A message of a unit came that is not taken.
    pub(crate) fn pass_over(&self, serial: &str) {
        let mut passed_over = self.passed_over.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = passed_over.get_mut(serial) {
            *at = Instant::now();
        } else if passed_over.len() < MOST_PASSED_OVER {
            passed_over.insert(serial.to_owned(), Instant::now());
        }
    }

    /// What this instance says of itself and its units.
    pub(crate) fn report(&self, intake: &Intake) -> PairReport {
        let now = Instant::now();
        let mut passed_over = self.passed_over.lock().unwrap_or_else(PoisonError::into_inner);
        passed_over.retain(|_, at| now.saturating_duration_since(*at) < PASSED_OVER);
        PairReport {
            member: self.me.clone(),
            takes: self.takes.clone(),
            units: intake.each_unit(|actor| actor.role()),
            passed_over: passed_over.keys().cloned().collect(),
        }
    }
}
