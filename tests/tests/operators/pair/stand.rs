//! Both services of a pair with producers and a subscriber, and what may happen to one of them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use isotherm_bus::close;
use isotherm_correction::unit::At;
use isotherm_protocol::control::{Schedule, SwapOptions, SwapOutcome};
use isotherm_simulator::Scenario;
use isotherm_simulator::presets::zeeman_rest;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::dice::Dice;
use isotherm_tests::judged::{Sink, Source};
use isotherm_tests::operator::Operator;
use isotherm_tests::pair::{Pair, reports, speaker, until_compared, until_paired, until_speaks};
use isotherm_tests::process::resources;
use isotherm_tests::proxy::Fault;
use tokio::sync::{Mutex, MutexGuard};
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::documents::{base, valid};

pub(super) const TICK: Duration = Duration::from_millis(5);
/// How far ahead a swap is scheduled, in ticks: both services have heard of it by then.
const AHEAD: u64 = 200;
/// How long an instance of the pair may be silent before others give the connection up.
pub(super) const LEASE: Duration = Duration::from_millis(500);

/// One pair at a time: two would share the cores, and a pause of one would be the other's work.
static TURN: Mutex<()> = Mutex::const_new(());

/// Both services, what is produced for them, and who hears them.
pub(super) struct Stand {
    pub(super) pair: Pair,
    pub(super) session: Session,
    pub(super) operator: Operator,
    pub(super) sink: Sink,
    pub(super) sources: Arc<Mutex<Vec<Source>>>,
    over: Arc<AtomicBool>,
    playing: JoinHandle<()>,
    pub(super) revisions: Vec<u64>,
    /// From which tick on the last of them is in force.
    due: Vec<u64>,
    /// Units, the first ones, that are swapped and judged.
    pub(super) judged: usize,
    pub(super) dice: Dice,
    // Goes after those who live in it.
    _folder: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

pub(super) fn scenario(unit: &str, seed: u64) -> Scenario {
    let long = Scenario { duration_s: 100_000.0, ..zeeman_rest(seed) };
    Scenario { unit: unit.to_owned(), tick_ns: 5_000_000, ..long }
}

impl Stand {
    pub(super) async fn start(units: usize, extra: &str) -> Self {
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
        // As docs/operations.md tells producers: a service that hangs holds nobody for longer.
        let session = pair.session_with(Some(LEASE)).await;
        let sink = Sink::declare(&session).await;
        let mut sources = Vec::new();
        for (seed, (unit, document)) in (1..).zip(&documents) {
            sources.push(Source::declare(&session, scenario(unit, seed), document, &sink).await);
        }
        let (sources, over) = (Arc::new(Mutex::new(sources)), Arc::default());
        let playing = tokio::spawn(play(Arc::clone(&sources), Arc::clone(&over)));
        let (operator, revisions, due) = (Operator::new(session.clone()), vec![1; units], vec![0; units]);
        let stand = Self {
            _folder: folder,
            pair,
            session,
            operator,
            sink,
            sources,
            over,
            playing,
            revisions,
            due,
            judged: units,
            dice: Dice::new(21),
            _turn: turn,
        };
        until_paired(&stand.session, units).await;
        stand
    }

    pub(super) fn units(&self) -> usize {
        self.revisions.len()
    }

    /// Puts another document in force, from a tick on that is still to come.
    pub(super) async fn swap(&mut self, index: usize) {
        // One that is replaced while it waits would be in force there and not here, or the other way round.
        let mut sources = loop {
            let sources = self.sources.lock().await;
            if sources[index].last > self.due[index] + AHEAD / 10 {
                break sources;
            }
            drop(sources);
            tokio::time::sleep(TICK).await;
        };
        let (unit, at) = (sources[index].unit().to_owned(), sources[index].last + AHEAD);
        self.due[index] = at;
        let document = valid(&unit, &mut self.dice);
        self.revisions[index] += 1;
        sources[index].swap(&document, self.revisions[index], At::Sequence(at));
        drop(sources);
        let options = SwapOptions { schedule: Schedule::Sequence(at), ..SwapOptions::default() };
        let reply = self.operator.swap(&unit, document.as_bytes(), &options).await.unwrap();
        assert_eq!(
            (reply.outcome, reply.revision),
            (SwapOutcome::Accepted, self.revisions[index]),
            "{reply:?}"
        );
        let last = self.sources.lock().await[index].last;
        assert!(
            last < at,
            "the machine is too busy to judge: {unit} was at {last} when a swap for {at} was accepted"
        );
    }

    /// Index of the instance that speaks.
    pub(super) async fn speaker(&self) -> usize {
        speaker(&self.session).await
    }

    pub(super) fn restart(&mut self, index: usize) {
        tokio::task::block_in_place(|| self.pair.restart(index));
    }

    /// Ends the streams, and judges what came; what was doubled.
    pub(super) async fn judge(&mut self) -> u64 {
        self.over.store(true, Ordering::SeqCst);
        (&mut self.playing).await.unwrap();
        let sources = self.sources.lock().await;
        let mut doubled = 0;
        for unit in sources.iter().take(self.judged).map(Source::unit) {
            let account = self.sink.account(unit);
            assert_eq!((account.lost, account.wrong, account.unexpected), (0, 0, 0), "{unit}: {account:?}");
            assert!(account.used > 100, "{unit}: {account:?}");
            doubled += account.doubled;
        }
        doubled
    }

    /// Judges, and ends it all; what was doubled.
    pub(super) async fn end(mut self) -> u64 {
        let doubled = self.judge().await;
        self.nothing_differs().await;
        close(self.session, LIMIT).await.unwrap();
        doubled
    }
}

/// Sends a tick of every unit each 5 ms.
async fn play(sources: Arc<Mutex<Vec<Source>>>, over: Arc<AtomicBool>) {
    let mut times = tokio::time::interval(TICK);
    while !over.load(Ordering::SeqCst) {
        times.tick().await;
        for source in sources.lock().await.iter_mut() {
            source.tick().await;
        }
    }
}

/// Names the instances after their places: both read the same configuration otherwise.
pub(super) fn configuration(more: &str) -> String {
    format!("[pair]\n{more}\n")
}

/// What happens to the instance that speaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mishap {
    Killed,
    Stopped,
    /// It is given no more memory, and asked for what takes some.
    Starved,
    /// Its connections, where it is the second.
    Link(Fault),
}

impl Stand {
    /// Has the instance that speaks come to grief and come back; the longest pause that any unit's subscriber saw.
    pub(super) async fn suffer(&mut self, mishap: Mishap) -> Duration {
        let (speaking, at) = (self.speaker().await, Instant::now());
        match mishap {
            Mishap::Killed => self.pair.kill(speaking),
            Mishap::Stopped => self.pair.signal(speaking, "STOP"),
            Mishap::Starved => self.starve(speaking).await,
            Mishap::Link(fault) => self.pair.trouble(fault),
        }
        if !matches!(mishap, Mishap::Link(_)) || speaking == 1 {
            until_speaks(&self.session, 1 - speaking, self.units()).await;
        }
        self.until_lost(mishap).await;
        let pause = self.sink.longest_pause(at);
        // Who speaks now takes swaps, and counts on.
        self.swap(self.judged - 1).await;
        match mishap {
            Mishap::Killed | Mishap::Starved => self.restart(speaking),
            Mishap::Stopped => self.pair.signal(speaking, "CONT"),
            Mishap::Link(_) => self.pair.trouble(Fault::None),
        }
        until_paired(&self.session, self.units()).await;
        self.swap(0).await;
        pause
    }

    /// Has an instance need more memory than it gets, until it is dead, or has done without.
    async fn starve(&mut self, index: usize) {
        let service = self.pair.services[index].as_ref().expect("it is alive");
        service.limit(&format!("--data={}:", resources(service.id()).data_kb * 1024));
        // Nothing is changed by what is only asked for.
        let options = SwapOptions { dry_run: true, ..SwapOptions::default() };
        let text = format!("{}{}", base("PAIR-00"), "# as long as a document may be\n".repeat(30_000));
        for _ in 0..20 {
            if self.pair.services[index].as_mut().expect("it was alive").has_ended() {
                println!("without memory it died");
                return;
            }
            let asked = (0..16).map(|_| {
                let (operator, text, options) = (self.operator.clone(), text.clone(), options.clone());
                tokio::spawn(async move { operator.swap("PAIR-00", text.as_bytes(), &options).await.is_ok() })
            });
            for asked in asked.collect::<Vec<_>>() {
                // Who dies answers nobody.
                let _ = tokio::time::timeout(Duration::from_millis(500), asked).await;
            }
        }
        println!("without memory it lived on");
        self.pair.kill(index);
    }

    /// Waits until the connections of an instance are gone, or have been slow for as long as that would take.
    pub(super) async fn until_lost(&self, mishap: Mishap) {
        let slow = mishap == Mishap::Link(Fault::Throttle);
        let (begin, deadline) = (Instant::now(), Instant::now() + LIMIT);
        while self.session.info().peers_zid().await.count() > 1 && !(slow && begin.elapsed() > LEASE * 2) {
            assert!(Instant::now() < deadline, "{mishap:?}: still connected");
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// Has the second instance speak: the one whose connections can be troubled.
    pub(super) async fn second_speaks(&mut self) {
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
