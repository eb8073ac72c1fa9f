//! Several instances for one stream: who is there, who goes before whom, and what follows from it.
//!
//! | module | holds |
//! |---|---|
//! | `watch` | the thread that notices a silent instance, and hears the journals of others |
//! | `join` | who is there at the start |
//! | `elsewhere` | which units instances of other groups take |
//! | `ask` | memories, histories and documents of the instance that speaks, asked for |
//! | [`crate::receive::unit`] `speech` | one unit: what is kept, compared and published in the other's place |
//! | [`crate::control`] `carry` | histories and documents, written down here too |

mod ask;
mod elsewhere;
mod join;
mod watch;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, RwLock};
use std::time::{Duration, Instant};

use isotherm_bus::endpoint::address;
use isotherm_operator::status::unix_ms;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::pair::{Member, Mode, PairReport};
use zenoh::Session;

use crate::ServiceError;
use crate::config::{PairSettings, Settings};
use crate::receive::intake::{Intake, lock, read, write};
use crate::receive::unit::{Footing, Standing, UnitActor};
pub(crate) use ask::{ASKS, Asker, Questions};
use elsewhere::Elsewhere;
pub(crate) use watch::Watch;

/// How long a unit that is not taken is remembered.
const PASSED_OVER: Duration = Duration::from_secs(10);
/// How long a process may stand still without losing its connections: well below the lease.
const SHORT: Duration = Duration::from_millis(300);
/// How long the other instance may be away before that is a fault: two are seldom started at once.
const MISSING: Duration = Duration::from_secs(5);
/// Most such units.
const MOST_PASSED_OVER: usize = 4096;

/// The others of the pair.
#[derive(Debug)]
struct Others {
    /// Those that are there, by instance.
    there: BTreeMap<String, Member>,
    /// Since when none is.
    alone_since: Option<Instant>,
    /// Whether one was there once.
    were_there: bool,
}

impl Others {
    /// Whether some of them goes before this one.
    fn go_before(&self, me: &Member) -> bool {
        self.there.values().any(|other| other.goes_before(me))
    }
}

/// This instance among the others.
#[derive(Debug)]
pub(crate) struct Pair {
    me: Member,
    takeover: Duration,
    takes: Vec<String>,
    /// Where others are, as configured, without what may be secret.
    addresses: Vec<String>,
    others: RwLock<Others>,
    /// Whether another instance is meant to be there.
    is_meant: bool,
    /// Whether it is not known yet which units the others speak for.
    opening: AtomicBool,
    /// Whether [`Self::others`] has any: asked with every message.
    accompanied: AtomicBool,
    start: Instant,
    /// When the watch last looked (µs since the start).
    beat: AtomicU64,
    /// For how long the process stood still before, where the units were not told yet (µs).
    still_us: AtomicU64,
    elsewhere: Elsewhere,
    passed_over: Mutex<BTreeMap<String, Instant>>,
}

impl Pair {
    /// Joins those that are there.
    pub(crate) async fn join(settings: &Settings, session: &Session) -> Result<Self, ServiceError> {
        // Asked before the start is stamped: of two the earlier goes before.
        let others = Box::pin(join::others(settings, session, &group(settings))).await?;
        Ok(Self::new(settings, session.zid().to_string(), unix_ms(), others))
    }

    /// `instance` is this one's Zenoh id as text; `others` are those that were there before it.
    pub(crate) fn new(
        settings: &Settings,
        instance: String,
        started_unix_ms: i64,
        others: Vec<Member>,
    ) -> Self {
        let PairSettings { name, mode, priority, takeover, other, .. } = settings.pair.clone();
        let name = name.unwrap_or_else(|| instance.chars().take(8).collect());
        let me = Member { instance, name, mode, priority, started_unix_ms, group: group(settings) };
        Self {
            me,
            takeover,
            takes: settings.units.clone(),
            addresses: other
                .into_iter()
                .chain(settings.zenoh.session.connects_to().unwrap_or_default())
                .map(|endpoint| address(&endpoint).to_owned())
                .collect(),
            is_meant: settings.pair.is_meant(),
            opening: AtomicBool::new(!others.is_empty()),
            accompanied: AtomicBool::new(!others.is_empty()),
            others: RwLock::new(Others {
                alone_since: others.is_empty().then(Instant::now),
                were_there: !others.is_empty(),
                there: others.into_iter().map(|other| (other.instance.clone(), other)).collect(),
            }),
            start: Instant::now(),
            beat: AtomicU64::new(0),
            still_us: AtomicU64::new(0),
            passed_over: Mutex::default(),
            elsewhere: Elsewhere::default(),
        }
    }

    /// This instance.
    pub(crate) fn me(&self) -> &Member {
        &self.me
    }

    /// The others that are there, by instance.
    pub(crate) fn others(&self) -> Vec<Member> {
        read(&self.others).there.values().cloned().collect()
    }

    /// Whether another instance of the pair is there.
    fn is_there(&self, instance: &str) -> bool {
        read(&self.others).there.contains_key(instance)
    }

    /// Whether there are any.
    pub(crate) fn has_others(&self) -> bool {
        self.accompanied.load(Ordering::Acquire)
    }

    /// An instance of another group has come; whether it is one.
    fn come_elsewhere(&self, member: &Member) -> bool {
        let is_elsewhere = member.group != self.me.group;
        if is_elsewhere {
            self.elsewhere.come(&member.instance);
        }
        is_elsewhere
    }

    /// Whether an instance of another group takes a unit, or may.
    pub(crate) fn is_taken_elsewhere(&self, unit: &UnitId) -> bool {
        self.elsewhere.may_take(unit)
    }

    /// An instance has come; whether it is new.
    fn come(&self, member: Member) -> bool {
        if member.instance == self.me.instance || member.group != self.me.group {
            return false;
        }
        let mut others = write(&self.others);
        (others.alone_since, others.were_there) = (None, true);
        if !self.accompanied.load(Ordering::Acquire) {
            // Looked seldom while it was alone.
            self.beat.store(self.since_start_us(Instant::now()), Ordering::Release);
        }
        self.accompanied.store(true, Ordering::Release);
        others.there.insert(member.instance.clone(), member).is_none()
    }

    /// An instance has gone, or the connection to it; whether it was there.
    fn go(&self, instance: &str) -> bool {
        self.elsewhere.go(instance);
        let mut others = write(&self.others);
        let gone = others.there.remove(instance).is_some();
        if gone && others.there.is_empty() {
            // Whoever stood still for longer than the lease finds the others gone before it looks again.
            self.still_us.fetch_max(self.stands_still_us(Instant::now()), Ordering::AcqRel);
            self.accompanied.store(false, Ordering::Release);
            others.alone_since = Some(Instant::now());
        }
        gone
    }

    /// Whether some other instance goes before this one.
    fn yields(&self) -> bool {
        read(&self.others).go_before(&self.me)
    }

    /// Whether a unit that nobody has heard before is this instance's to speak for.
    pub(crate) fn speaks_first(&self) -> bool {
        !self.is_opening() && !self.yields()
    }

    /// Whether it is not known yet which units the others speak for.
    pub(crate) fn is_opening(&self) -> bool {
        self.opening.load(Ordering::Acquire)
    }

    /// That the other instance that is meant to be there has not been for a while.
    pub(crate) fn is_missing_other(&self, now: Instant) -> bool {
        let since = read(&self.others).alone_since.filter(|_| self.is_meant);
        since.is_some_and(|since| now.saturating_duration_since(since) >= MISSING)
    }

    /// What a unit needs to know of it.
    pub(crate) fn standing(&self) -> Standing {
        let others = read(&self.others);
        Standing {
            takeover: self.takeover,
            active: self.me.mode == Mode::Active,
            yields: others.go_before(&self.me),
            alone_since: others.alone_since,
            deserted: others.alone_since.is_some() && others.were_there,
        }
    }

    /// Where this process has stood still for so long that another instance may speak in its place by now: whether it was so short that no
    /// connection was lost by it.
    pub(crate) fn has_stood_still(&self, now: Instant) -> Option<bool> {
        let before_us = self.still_us.load(Ordering::Acquire);
        let still_us = if self.has_others() { before_us.max(self.stands_still_us(now)) } else { before_us };
        (still_us > 0).then_some(Duration::from_micros(still_us) < SHORT)
    }

    /// For how long nobody has looked, where that is too long; else 0 (µs).
    fn stands_still_us(&self, now: Instant) -> u64 {
        let still_us = self.since_start_us(now).saturating_sub(self.beat.load(Ordering::Acquire));
        if Duration::from_micros(still_us) > self.takeover + self.takeover / 2 { still_us } else { 0 }
    }

    /// The watch begins to look: until now the process was starting.
    fn begin(&self, now: Instant) {
        self.beat.store(self.since_start_us(now), Ordering::Release);
    }

    /// The watch looks; whether it has stood still before. It holds for other threads until the units are [`Self::told`].
    fn look(&self, now: Instant) -> Option<bool> {
        let still = self.has_stood_still(now);
        if still.is_some() {
            self.still_us.fetch_max(self.stands_still_us(now), Ordering::AcqRel);
        }
        self.beat.store(self.since_start_us(now), Ordering::Release);
        still
    }

    /// The units know that the process stood still.
    fn told(&self) {
        self.still_us.store(0, Ordering::Release);
    }

    /// What a unit stands on after the process stood still.
    pub(crate) fn footing(short: bool) -> Footing {
        if short { Footing::Doubt } else { Footing::Nothing }
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
        let mut passed_over = lock(&self.passed_over);
        if let Some(at) = passed_over.get_mut(serial) {
            *at = Instant::now();
        } else if passed_over.len() < MOST_PASSED_OVER {
            passed_over.insert(serial.to_owned(), Instant::now());
        }
    }

    /// What this instance says of itself and its units.
    pub(crate) fn report(&self, intake: &Intake) -> PairReport {
        let mut passed_over = lock(&self.passed_over);
        passed_over.retain(|_, at| at.elapsed() < PASSED_OVER);
        PairReport {
            member: self.me.clone(),
            takes: self.takes.clone(),
            units: intake.each_unit(|actor| actor.role()),
            passed_over: passed_over.keys().cloned().collect(),
            others: self.others().into_iter().map(|other| other.name).collect(),
            addresses: self.addresses.clone(),
        }
    }
}

/// Of the units that an instance takes, in whatever order they are named.
fn group(settings: &Settings) -> String {
    let units: BTreeSet<&str> = settings.units.iter().map(String::as_str).collect();
    let units: Vec<_> = units.into_iter().collect();
    Digest::of(units.join("\n").as_bytes()).to_string().chars().take(8).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use isotherm_correction::sample::{GyroTick, OutputKind};
    use isotherm_correction::units::{Span, Timestamp};
    use isotherm_protocol::codec::encode;
    use isotherm_protocol::raw::GyroBatch;

    use super::*;
    use crate::control::revision::Calibrations;
    use crate::receive::intake::{Answers, OutletMaker};

    fn other() -> Member {
        let group = Pair::new(&Settings::default(), "me".to_owned(), 2, Vec::new()).me.group;
        let (instance, name) = ("other".to_owned(), "other".to_owned());
        Member { instance, name, mode: Mode::Standby, priority: 0, started_unix_ms: 1, group }
    }

    #[test]
    fn whoever_stood_still_knows_it_though_the_others_are_gone_when_it_looks() {
        let pair = Pair::new(&Settings::default(), "me".to_owned(), 2, vec![other()]);
        let start = Instant::now();
        assert_eq!(pair.look(start), None);
        std::thread::sleep(Duration::from_millis(40));
        // The lease is over: it hears of that first.
        assert!(pair.go("other"));
        assert!(!pair.has_others());
        assert_eq!(pair.has_stood_still(Instant::now()), Some(true), "a receive thread");
        assert_eq!(pair.look(Instant::now()), Some(true));
        assert_eq!(pair.has_stood_still(Instant::now()), Some(true), "until the units are told");
        pair.told();
        assert_eq!(pair.look(Instant::now()), None);
        assert!(pair.standing().deserted);
    }

    #[test]
    fn an_instance_that_is_meant_to_be_there_and_is_not_is_missed_until_it_comes() {
        for (name, is_missed) in [(Some("north".to_owned()), true), (None, false)] {
            let settings =
                Settings { pair: PairSettings { name, ..PairSettings::default() }, ..Settings::default() };
            let pair = Pair::new(&settings, "me".to_owned(), 2, Vec::new());
            let missing_in = |s| pair.is_missing_other(Instant::now() + Duration::from_secs(s));
            assert_eq!([missing_in(0), missing_in(6)], [false, is_missed]);
            pair.come(other());
            assert!(!missing_in(6));
            pair.go("other");
            assert_eq!([missing_in(0), missing_in(6)], [false, is_missed]);
        }
    }

    #[test]
    fn an_instance_that_comes_does_not_hide_that_this_one_stood_still() {
        let pair = Pair::new(&Settings::default(), "me".to_owned(), 2, vec![other()]);
        pair.look(Instant::now());
        std::thread::sleep(Duration::from_millis(40));
        pair.come(Member { instance: "third".to_owned(), ..other() });
        assert_eq!(pair.look(Instant::now()), Some(true));
    }

    /// An intake with a unit that has appeared beside another instance, and how many frames it has published.
    fn beside_another() -> (Arc<Pair>, Intake, Arc<AtomicU64>) {
        let pair = Arc::new(Pair::new(&Settings::default(), "me".to_owned(), 2, vec![other()]));
        let published = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&published);
        let outlets: OutletMaker = Box::new(move |_| {
            let count = Arc::clone(&count);
            Ok(Box::new(move |_| {
                count.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }))
        });
        let intake = Intake::new(Settings::default(), Calibrations::default(), outlets);
        let intake = intake.paired_with(Arc::clone(&pair));
        pair.opened(&intake, &BTreeSet::new());
        for sequence in 0..20 {
            let end_time = Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000);
            let readings = [1.0, 2.0, 3.0].into_iter().collect();
            let tick =
                GyroTick { sequence, end_time, duration: Span::from_ms(5), readings, ..GyroTick::default() };
            let frame = encode(&GyroBatch { output: OutputKind::Counts, ticks: vec![tick] }).unwrap();
            intake.receive("imu/U/raw/gyro", Some(&frame), Instant::now());
        }
        (pair, intake, published)
    }

    #[test]
    fn a_unit_that_appears_beside_another_instance_waits_for_what_that_one_knows() {
        let start = Instant::now();
        let (pair, intake, published) = beside_another();
        let speaks_after = |ms| {
            let now = start + Duration::from_millis(ms);
            intake.each_unit(|actor| actor.watch_speech(now, &pair.standing()).spoke)
        };
        assert_eq!((speaks_after(100), published.load(Ordering::Relaxed)), (vec![false], 0));
        assert_eq!(speaks_after(3000), [true], "nobody else speaks");
        assert!(published.load(Ordering::Relaxed) > 0);
    }

    #[test]
    fn what_is_asked_while_nobody_publishes_any_more_waits_for_the_takeover() {
        let (pair, intake, _) = beside_another();
        let unit = UnitId::new("U").unwrap();
        assert_eq!(intake.answers_for(&unit), Answers::Elsewhere);
        pair.go("other");
        std::thread::scope(|scope| {
            let answers = scope.spawn(|| intake.answers_for(&unit));
            // However long that is, the answer is the same; it is long enough for one that does not wait.
            std::thread::sleep(Duration::from_millis(30));
            intake.with(&unit, |actor| actor.speak(Instant::now(), Duration::ZERO)).unwrap();
            assert_eq!(answers.join().unwrap(), Answers::Here);
        });
        // Before the watch has looked, a process that was stopped speaks as far as its units know.
        pair.come(other());
        std::thread::sleep(pair.takeover * 2);
        std::thread::scope(|scope| {
            let answers = scope.spawn(|| intake.answers_for(&unit));
            std::thread::sleep(Duration::from_millis(30));
            intake.with(&unit, |actor| actor.follow(Instant::now(), Footing::All)).unwrap();
            pair.look(Instant::now());
            pair.told();
            assert_eq!(answers.join().unwrap(), Answers::Unknown, "no word of what is not done is worse");
        });
    }
}
