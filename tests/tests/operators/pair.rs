//! Two services for one stream: one is killed, or stands still, and no tick is lost, changed or late for long.

use std::sync::Arc;
use std::time::{Duration, Instant};

use isotherm_bus::close;
use isotherm_correction::unit::At;
use isotherm_protocol::control::{Schedule, SwapOptions, SwapOutcome};
use isotherm_protocol::history::AuditEvent;
use isotherm_simulator::Scenario;
use isotherm_simulator::presets::zeeman_rest;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::dice::Dice;
use isotherm_tests::operator::{Operator, audit};
use isotherm_tests::pair::{Ears, Made, Pair, reports, speaker, until_compared, until_paired, until_speaks};
use isotherm_tests::proxy::Fault;
use tokio::sync::{Mutex, MutexGuard};
use tokio::task::JoinHandle;
use zenoh::Session;
use zenoh::qos::CongestionControl;

use crate::documents::{base, valid};

const TICK: Duration = Duration::from_millis(5);
/// How far ahead a swap is scheduled, in ticks: both services have heard of it by then.
const AHEAD: u64 = 100;
/// How long an instance of the pair may be silent before others give the connection up.
const LEASE: Duration = Duration::from_millis(500);

/// One pair at a time: two would share the cores, and a pause of one would be the other's work.
static TURN: Mutex<()> = Mutex::const_new(());

/// Both services, what is produced for them, and who hears them.
struct Stand {
    pair: Pair,
    session: Session,
    operator: Operator,
    ears: Ears,
    made: Arc<Mutex<Vec<Made>>>,
    playing: JoinHandle<()>,
    revisions: Vec<u64>,
    dice: Dice,
    // Goes after those who live in it.
    _folder: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

fn scenario(unit: &str, seed: u64) -> Scenario {
    let long = Scenario { duration_s: 100_000.0, ..zeeman_rest(seed) };
    Scenario { unit: unit.to_owned(), tick_ns: 5_000_000, ..long }
}

impl Stand {
    async fn start(units: usize, extra: &str) -> Self {
        let turn = TURN.lock().await;
        let folder = tempfile::tempdir().unwrap();
        let names: Vec<String> = (0..units).map(|number| format!("PAIR-{number:02}")).collect();
        let documents: Vec<_> = names.iter().map(|unit| (unit.clone(), base(unit))).collect();
        let (path, extra) = (folder.path().to_owned(), extra.to_owned());
        let starting = tokio::task::spawn_blocking({
            let documents = documents.clone();
            move || Pair::start(&path, &documents, &extra)
        });
        let pair = starting.await.unwrap();
        let session = pair.session().await;
        let ears = Ears::declare(&session).await;
        let mut made = Vec::new();
        for (seed, (unit, document)) in (1..).zip(&documents) {
            made.push(Made::declare(&session, scenario(unit, seed), document).await);
        }
        let made = Arc::new(Mutex::new(made));
        let playing = tokio::spawn(play(Arc::clone(&made)));
        let (operator, revisions) = (Operator::new(session.clone()), vec![1; units]);
        let stand = Self {
            _folder: folder,
            pair,
            session,
            operator,
            ears,
            made,
            playing,
            revisions,
            dice: Dice::new(21),
            _turn: turn,
        };
        until_paired(&stand.session, units).await;
        stand
    }

    fn units(&self) -> usize {
        self.revisions.len()
    }

    /// Puts another document in force, from a tick on that is still to come.
    async fn swap(&mut self, index: usize) {
        let mut made = self.made.lock().await;
        let (unit, at) = (made[index].unit().to_owned(), made[index].last + AHEAD);
        let document = valid(&unit, &mut self.dice);
        self.revisions[index] += 1;
        made[index].swap(&document, self.revisions[index], At::Sequence(at));
        drop(made);
        let options = SwapOptions { schedule: Schedule::Sequence(at), ..SwapOptions::default() };
        let reply = self.operator.swap(&unit, document.as_bytes(), &options).await.unwrap();
        assert_eq!(
            (reply.outcome, reply.revision),
            (SwapOutcome::Accepted, self.revisions[index]),
            "{reply:?}"
        );
    }

    /// Index of the instance that speaks.
    async fn speaker(&self) -> usize {
        speaker(&self.session).await
    }

    fn restart(&mut self, index: usize) {
        tokio::task::block_in_place(|| self.pair.restart(index));
    }

    /// The longest time that any unit was without a fresh tick since a moment.
    async fn pause_since(&self, from: Instant) -> Duration {
        let made = self.made.lock().await;
        let now = Instant::now();
        made.iter().map(|made| self.ears.longest_pause(made.unit(), from, now)).max().unwrap_or_default()
    }

    /// Ends it all; what was doubled.
    async fn end(self) -> u64 {
        self.playing.abort();
        let _ = self.playing.await;
        let made = self.made.lock().await;
        let mut doubled = 0;
        for made in made.iter() {
            let account = self.ears.account(made);
            assert_eq!((account.lost, account.wrong), (0, 0), "{}: {account:?}", made.unit());
            assert!(account.used > 100, "{}: {account:?}", made.unit());
            doubled += account.doubled;
        }
        close(self.session, LIMIT).await.unwrap();
        doubled
    }
}

/// Sends a tick of every unit each 5 ms.
async fn play(made: Arc<Mutex<Vec<Made>>>) {
    let mut times = tokio::time::interval(TICK);
    loop {
        times.tick().await;
        for made in made.lock().await.iter_mut() {
            made.tick().await;
        }
    }
}

/// Names the instances after their places: both read the same configuration otherwise.
fn configuration(more: &str) -> String {
    format!("[pair]\n{more}\n")
}

/// What happens to the instance that speaks.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mishap {
    Killed,
    Stopped,
    /// Its connections, where it is the second.
    Link(Fault),
}

impl Stand {
    /// Has the instance that speaks come to grief and come back; the longest pause that any unit's subscriber saw.
    async fn suffer(&mut self, mishap: Mishap) -> Duration {
        let (speaking, at) = (self.speaker().await, Instant::now());
        match mishap {
            Mishap::Killed => self.pair.kill(speaking),
            Mishap::Stopped => self.pair.signal(speaking, "STOP"),
            Mishap::Link(fault) => self.pair.trouble(fault),
        }
        if !matches!(mishap, Mishap::Link(_)) || speaking == 1 {
            until_speaks(&self.session, 1 - speaking, self.units()).await;
        }
        self.until_lost(mishap).await;
        let pause = self.pause_since(at).await;
        // Who speaks now takes swaps, and counts on.
        self.swap(self.units() - 1).await;
        match mishap {
            Mishap::Killed => self.restart(speaking),
            Mishap::Stopped => self.pair.signal(speaking, "CONT"),
            Mishap::Link(_) => self.pair.trouble(Fault::None),
        }
        until_paired(&self.session, self.units()).await;
        self.swap(0).await;
        pause
    }

    /// Waits until the connections of an instance are gone, or have been slow for as long as that would take.
    async fn until_lost(&self, mishap: Mishap) {
        let slow = mishap == Mishap::Link(Fault::Throttle);
        let (begin, deadline) = (Instant::now(), Instant::now() + LIMIT);
        while self.session.info().peers_zid().await.count() > 1 && !(slow && begin.elapsed() > LEASE * 2) {
            assert!(Instant::now() < deadline, "{mishap:?}: still connected");
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// Has the second instance speak: the one whose connections can be troubled.
    async fn second_speaks(&mut self) {
        until_compared(&self.session, self.units(), 50).await;
        while self.speaker().await == 0 {
            self.suffer(Mishap::Killed).await;
        }
    }

    async fn nothing_differs(&self) {
        let compared: Vec<_> =
            reports(&self.session).await.into_iter().flat_map(|report| report.units).collect();
        assert!(compared.iter().all(|unit| unit.ticks_differing == 0), "{compared:#?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_killed_and_a_stopped_service_are_not_missed() {
    let mut stand = Stand::start(2, &configuration("")).await;
    until_compared(&stand.session, 2, 50).await;
    stand.swap(0).await;
    for mishap in [Mishap::Killed, Mishap::Stopped] {
        let pause = stand.suffer(mishap).await;
        println!("{mishap:?}: longest pause {pause:?}");
        assert!(pause < Duration::from_secs(1), "{pause:?}");
    }
    until_compared(&stand.session, 2, 50).await;
    stand.nothing_differs().await;
    // What was done is in both state folders, whoever did it.
    let deadline = Instant::now() + LIMIT;
    loop {
        let histories = [0, 1].map(|index| accepted(&stand, index));
        let whole = histories[0].len() as u64 == stand.revisions.iter().sum::<u64>();
        if whole && histories[0] == histories[1] {
            break;
        }
        assert!(Instant::now() < deadline, "{histories:#?}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    println!("doubled {}", stand.end().await);
}

/// What the audit file of an instance says was accepted: unit, revision, digest.
fn accepted(stand: &Stand, index: usize) -> std::collections::BTreeSet<(Option<String>, u64, String)> {
    let entries = audit(&stand.pair.state(index)).into_iter();
    let accepted = entries.filter_map(|entry| match entry.event {
        AuditEvent::Accepted(accepted) => Some((entry.unit, accepted.revision, accepted.digest.to_string())),
        _ => None,
    });
    accepted.collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cut_link_loses_nothing() {
    let mut stand = Stand::start(1, &configuration("")).await;
    stand.second_speaks().await;
    for fault in faults() {
        let pause = stand.suffer(Mishap::Link(fault)).await;
        println!("{fault:?} of the speaking instance's connections: longest pause {pause:?}");
        let pause = stand.suffer(Mishap::Link(fault)).await;
        println!("{fault:?} of the standby's connections: longest pause {pause:?}");
        stand.second_speaks().await;
    }
    stand.nothing_differs().await;
    println!("doubled {}", stand.end().await);
}

/// `ISOTHERM_PAIR` asks for all of them.
fn faults() -> Vec<Fault> {
    let all = [Fault::Cut, Fault::Stall, Fault::HalfOpen, Fault::Throttle];
    if std::env::var_os("ISOTHERM_PAIR").is_some() { all.into() } else { vec![Fault::Cut] }
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_active_services_either_may_be_killed_without_a_pause() {
    let mut stand = Stand::start(1, &configuration("mode = \"active\"")).await;
    until_compared(&stand.session, 1, 50).await;
    let pause = stand.suffer(Mishap::Killed).await;
    println!("active, killed: longest pause {pause:?}");
    until_compared(&stand.session, 1, 50).await;
    stand.nothing_differs().await;
    // Both publish: a subscriber that takes the first of each tick drops the others, and counts them.
    let doubled = stand.end().await;
    assert!(doubled > 100, "{doubled}");
}

/// A source that publishes with `Block` is held by a stopped service no longer than by the lease of both.
#[tokio::test(flavor = "multi_thread")]
async fn a_stopped_service_holds_no_source_for_longer_than_its_lease() {
    let stand = Stand::start(1, &configuration("")).await;
    let stopped = 1 - stand.speaker().await;
    let source = stand.pair.session_with(Some(LEASE)).await;
    let publisher =
        source.declare_publisher("imu/PAIR-00/raw/health").congestion_control(CongestionControl::Block);
    let publisher = publisher.await.unwrap();
    stand.pair.signal(stopped, "STOP");
    let (begin, mut longest) = (Instant::now(), Duration::ZERO);
    while begin.elapsed() < Duration::from_secs(2) {
        let at = Instant::now();
        // No health reading: refused and counted, but it fills what is between the two.
        publisher.put(vec![0_u8; 60_000]).await.unwrap();
        longest = longest.max(at.elapsed());
    }
    println!("longest put {longest:?}");
    assert!(longest > Duration::from_millis(100), "the source was not held at all: {longest:?}");
    assert!(longest < Duration::from_millis(1500), "{longest:?}");
    stand.pair.signal(stopped, "CONT");
    until_paired(&stand.session, 1).await;
    close(source, LIMIT).await.unwrap();
}

/// `ISOTHERM_PAIR=UNITS,KILLS,STOPS,CUTS` makes it shorter.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "takes ten minutes: just pair"]
async fn a_hundred_kills_fifty_stops_and_fifty_cuts_lose_nothing() {
    let sizes = std::env::var("ISOTHERM_PAIR").unwrap_or_else(|_| "20,100,50,50".to_owned());
    let sizes: Vec<usize> = sizes.split(',').map(|size| size.parse().expect("a number")).collect();
    let [units, kills, stops, cuts] = sizes[..] else { panic!("ISOTHERM_PAIR=UNITS,KILLS,STOPS,CUTS") };
    let mut stand = Stand::start(units, &configuration("")).await;
    until_compared(&stand.session, units, 50).await;
    for (mishap, count) in
        [(Mishap::Killed, kills), (Mishap::Stopped, stops), (Mishap::Link(Fault::Cut), cuts)]
    {
        let mut pauses = Vec::new();
        for _ in 0..count {
            let moment = stand.dice.below(1000);
            tokio::time::sleep(Duration::from_millis(moment)).await;
            pauses.push(stand.suffer(mishap).await);
        }
        pauses.sort_unstable();
        let share =
            |share: usize| pauses.get((pauses.len() * share / 100).min(pauses.len().saturating_sub(1)));
        println!(
            "{mishap:?} {count}: pauses p50 {:?}, p99 {:?}, longest {:?}",
            share(50),
            share(99),
            pauses.last()
        );
    }
    stand.nothing_differs().await;
    println!("doubled {}", stand.end().await);
}
