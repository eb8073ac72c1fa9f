//! I3 at work: a thousand swaps in a stream of eight units, and nothing lost, doubled or corrected with the wrong set.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use isotherm_bus::{Consumer, ProducerOptions, open};
use isotherm_correction::calibration::Calibration;
use isotherm_correction::sample::CorrectedTick;
use isotherm_correction::unit::{At, Change, Event, Unit, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::codec::encode;
use isotherm_protocol::control::{Schedule, SwapOptions, SwapOutcome};
use isotherm_protocol::corrected::{CorrectedBatch, Revision};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Document;
use isotherm_protocol::history::{Acceptance, AuditEvent, FirstTick};
use isotherm_protocol::key::UnitId;
use isotherm_simulator::presets::zeeman_sine;
use isotherm_simulator::{Scenario, Simulation};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::dice::Dice;
use isotherm_tests::operator::{audit, kept};
use isotherm_tests::player::Player;
use serde_json::json;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::documents::{base, invalid, valid};
use crate::stand::{Folders, Stand};

const UNITS: u64 = 8;
const SWAPS: u64 = 1000;
/// Ticks of every unit for each swap: with 1000 swaps two minutes at 200 Hz, ten mode switches among them.
const TICKS_PER_SWAP: u64 = 24;
const TICKS: u64 = SWAPS * TICKS_PER_SWAP;
/// Ticks in a message, unit by unit.
const BATCHES: [usize; 8] = [1, 2, 3, 4, 6, 8, 12, 24];

fn serial(number: u64) -> String {
    format!("SWAP-{number}")
}

fn scenario(number: u64) -> Scenario {
    Scenario { unit: serial(number), duration_s: 121.0, ..zeeman_sine(number) }
}

/// The units at play: they follow a leash, so that the swaps are spread over the whole stream and never wait for it.
struct Play {
    leash: watch::Sender<u64>,
    players: Vec<(watch::Receiver<u64>, JoinHandle<()>)>,
}

impl Play {
    async fn start(stand: &Stand) -> Self {
        let (leash, _) = watch::channel(0);
        let mut players = Vec::new();
        for (number, batch_ticks) in (0..UNITS).zip(BATCHES) {
            let session = open(&stand.options).await.unwrap();
            let options = ProducerOptions {
                batch_ticks,
                max_in_flight: Some(1024),
                match_timeout: LIMIT,
                acknowledge_timeout: LIMIT,
            };
            let mut player = Player::declare(&session, &scenario(number), options).await;
            let (mut leash, (sent, progress)) = (leash.subscribe(), watch::channel(0));
            let playing = tokio::spawn(async move {
                let mut done = 0;
                while done < TICKS {
                    let allowed = *leash.wait_for(|allowed| *allowed > done).await.unwrap();
                    player.play(allowed - done).await;
                    done = allowed;
                    sent.send_replace(done);
                }
                player.flush().await;
                player.drain().await;
                drop(session);
            });
            players.push((progress, playing));
        }
        Self { leash, players }
    }

    /// Lets every unit play on, and waits until all have played what they were let before.
    async fn on(&mut self) {
        let before = *self.leash.borrow();
        self.leash.send_replace(before + TICKS_PER_SWAP);
        for (progress, _) in &mut self.players {
            progress.wait_for(|played| *played >= before).await.unwrap();
        }
    }
}

/// Takes everything in until every unit has given out all its ticks.
async fn collect(mut consumer: Consumer) -> (Consumer, BTreeMap<String, Vec<CorrectedBatch>>) {
    let mut batches: BTreeMap<String, Vec<CorrectedBatch>> = BTreeMap::new();
    while consumer.accounts().len() < BATCHES.len() || consumer.accounts().values().any(|a| a.ticks < TICKS) {
        let next = tokio::time::timeout(LIMIT, consumer.next()).await;
        let next = next.unwrap_or_else(|_| panic!("nothing more comes: {:?}", consumer.accounts()));
        let batch = next.expect("the session is open");
        batches.entry(batch.unit.clone()).or_default().push(batch);
    }
    (consumer, batches)
}

/// What was done to one unit, as those who did it saw it.
#[derive(Debug, Default)]
struct Ledger {
    accepted: u64,
    refused: u64,
    /// Revision counter and text of what was accepted last.
    revision: u64,
    text: String,
    /// Swaps to the next tick since the last one to a stated tick, or back.
    plain: u64,
}

/// One swap after the other, each seen through to what the service says of it.
struct Swaps<'s> {
    stand: &'s Stand,
    folders: &'s Folders,
    dice: Dice,
    ledgers: BTreeMap<String, Ledger>,
    /// Swaps by their ways.
    done: BTreeMap<&'static str, u64>,
}

impl Swaps<'_> {
    async fn next(&mut self) {
        let unit = serial(self.dice.below(UNITS));
        let good = self.dice.below(2) == 0;
        let way = self.dice.below(20);
        if way == 0 && self.ledgers[&unit].plain > 1 {
            *self.done.entry("rollback").or_default() += 1;
            return self.roll_back(&unit).await;
        }
        let document =
            if good { valid(&unit, &mut self.dice).into_bytes() } else { invalid(&unit, &mut self.dice) };
        let (name, options) = match way {
            0..7 => {
                let options = self.options(&unit);
                self.query(&unit, &document, &options, good).await;
                ("query", options)
            }
            7..13 => {
                let options = self.options(&unit);
                self.stand.operator.put(&unit, &document, &options).await;
                ("put", options)
            }
            _ => {
                self.write(&unit, &document);
                ("file", SwapOptions::default())
            }
        };
        *self.done.entry(name).or_default() += 1;
        let ledger = self.ledgers.get_mut(&unit).unwrap();
        if good {
            ledger.accepted += 1;
            ledger.revision += 1;
            ledger.plain = if options.schedule == Schedule::NextTick { ledger.plain + 1 } else { 0 };
            ledger.text = String::from_utf8(document).unwrap();
        } else {
            ledger.refused += 1;
        }
        self.see_through(&unit).await;
    }

    /// At once or at a stated tick or time near by, at once or over a time.
    fn options(&mut self, unit: &str) -> SwapOptions {
        let by = "the test".to_owned();
        let status = self.stand.service.status(&UnitId::new(unit).unwrap()).unwrap();
        let last = status.last_tick.unwrap_or_default();
        let ahead = self.dice.below(80);
        let schedule = match self.dice.below(6) {
            0 => Schedule::Sequence(last.sequence + ahead),
            1 => Schedule::TimeNs(last.end_time_ns + 5_000_000 * i64::try_from(ahead).unwrap()),
            _ => Schedule::NextTick,
        };
        let slew_s =
            [None, None, Some(0.0), Some(0.05), Some(1.0)][usize::try_from(self.dice.below(5)).unwrap()];
        SwapOptions { by, schedule, slew_s, ..SwapOptions::default() }
    }

    async fn query(&mut self, unit: &str, document: &[u8], options: &SwapOptions, good: bool) {
        let reply = self.stand.operator.swap(unit, document, options).await.unwrap();
        let before = &self.ledgers[unit];
        if good {
            assert_eq!(reply.outcome, SwapOutcome::Accepted, "{unit}: {:#?}", reply.problems);
            assert_eq!(
                (reply.revision, reply.digest),
                (before.revision + 1, Digest::of(document).to_string())
            );
            assert!(reply.problems.is_empty() && reply.difference.is_some());
        } else {
            assert_eq!(reply.outcome, SwapOutcome::Refused, "{unit}: {}", String::from_utf8_lossy(document));
            assert!(!reply.problems.is_empty());
            // What is in force: the last one accepted, or one before it while that one waits for its tick.
            let digest = Digest::of(before.text.as_bytes()).to_string();
            assert!(reply.revision <= before.revision, "what it was before");
            assert_eq!(reply.digest == digest, reply.revision == before.revision, "what it was before");
        }
    }

    /// Changes the unit's file as one editor or another would.
    fn write(&mut self, unit: &str, document: &[u8]) {
        let file = self.folders.documents.join(format!("{unit}.toml"));
        match self.dice.below(3) {
            0 => std::fs::write(file, document).unwrap(),
            1 => drop(self.folders.put(&format!("{unit}.toml"), document)),
            _ => {
                std::fs::remove_file(&file).unwrap();
                std::fs::write(&file, document).unwrap();
            }
        }
    }

    async fn roll_back(&mut self, unit: &str) {
        let reply = self.stand.operator.command(unit, json!({"command": "rollback"})).await.unwrap();
        let swap = reply.swap.expect("a rollback is a swap");
        assert_eq!(swap.outcome, SwapOutcome::Accepted, "{unit}: {:#?}", swap.problems);
        let text = self.stand.operator.active(unit).await.unwrap();
        assert_eq!(swap.digest, Digest::of(text.as_bytes()).to_string());
        let ledger = self.ledgers.get_mut(unit).unwrap();
        assert_ne!(text, ledger.text, "another one than before");
        *ledger = Ledger {
            accepted: ledger.accepted + 1,
            refused: ledger.refused,
            revision: ledger.revision + 1,
            text,
            plain: 0,
        };
        assert_eq!(swap.revision, ledger.revision);
        self.see_through(unit).await;
    }

    /// Waits until the unit says that it was given this, and sees that it was given nothing else.
    async fn see_through(&self, unit: &str) {
        let ledger = &self.ledgers[unit];
        let id = UnitId::new(unit).unwrap();
        let deadline = tokio::time::Instant::now() + LIMIT;
        loop {
            let swaps = self.stand.service.status(&id).unwrap().swaps;
            let seen = swaps.accepted + swaps.refused;
            assert!(seen <= ledger.accepted + ledger.refused, "{unit}: {swaps:?}, {ledger:?}");
            if seen == ledger.accepted + ledger.refused {
                assert_eq!(
                    (swaps.accepted, swaps.refused),
                    (ledger.accepted, ledger.refused),
                    "{unit}: {swaps:?}"
                );
                break;
            }
            assert!(tokio::time::Instant::now() < deadline, "{unit}: {swaps:?}, {ledger:?}");
            tokio::time::sleep(std::time::Duration::from_millis(2)).await;
        }
        assert_eq!(self.stand.operator.active(unit).await.unwrap(), ledger.text, "{unit}");
    }
}

/// A revision as the audit file has it.
#[derive(Debug, Clone)]
struct Written {
    acceptance: Acceptance,
    first: Option<FirstTick>,
}

/// Every revision of every unit, in order.
fn written(state: &Path) -> BTreeMap<String, Vec<Written>> {
    let mut units: BTreeMap<String, Vec<Written>> = BTreeMap::new();
    for entry in audit(state) {
        let Some(unit) = entry.unit else { continue };
        let revisions = units.entry(unit).or_default();
        match entry.event {
            AuditEvent::Accepted(acceptance) => {
                assert_eq!(acceptance.revision, revisions.len() as u64 + 1, "counted one by one");
                revisions.push(Written { acceptance, first: None });
            }
            AuditEvent::InForce(first) => {
                let of = revisions
                    .iter_mut()
                    .find(|written| written.acceptance.revision == first.revision)
                    .unwrap();
                assert_eq!(of.first.replace(first), None, "in force for the first time once");
            }
            AuditEvent::Withdrawn(withdrawal) => {
                let of = revisions
                    .iter()
                    .find(|written| written.acceptance.revision == withdrawal.revision)
                    .unwrap();
                assert_eq!(of.first, None, "what was withdrawn never was in force");
            }
            _ => {}
        }
    }
    units
}

/// A revision with its first tick, and what it needs offline.
struct Compiled {
    first: FirstTick,
    /// It and its slew; in front of it those that were replaced before a single tick was corrected with them. They made no
    /// tick, but a slew begins where they were.
    changes: Vec<(u64, Arc<Calibration>, Span)>,
}

/// The revisions that made ticks, compiled, in order.
fn compile(unit: &str, revisions: &[Written], state: &Path) -> Vec<Compiled> {
    let mut compiled = Vec::new();
    let mut changes = Vec::new();
    for Written { acceptance, first } in revisions {
        let Acceptance { revision, digest, slew_ms, schedule, .. } = acceptance;
        if first.is_none() && *schedule != Schedule::NextTick {
            continue;
        }
        let parsed = Document::parse(&kept(state, digest), None).expect("what was accepted is valid");
        assert_eq!(parsed.document.unit, unit);
        let slew = Span::from_ms(u32::try_from(*slew_ms).unwrap());
        changes.push((*revision, Arc::new(parsed.calibration), slew));
        if let Some(first) = *first {
            compiled.push(Compiled { first, changes: std::mem::take(&mut changes) });
        }
    }
    assert!(
        compiled.is_sorted_by_key(|revision| revision.first.first_sequence),
        "{unit}: in the order of their ticks"
    );
    compiled
}

/// The same ticks corrected offline, with the documents of the audit file from the ticks on that it names.
fn offline(scenario: &Scenario, revisions: &[Compiled]) -> Vec<CorrectedTick> {
    let output = scenario.instrument.gyros.output_kind();
    let accel_output = scenario.instrument.accel_output_kind().unwrap();
    let mut unit = Unit::new(UnitSettings::default());
    let mut ticks = Vec::new();
    let mut revisions = revisions.iter().peekable();
    for step in Simulation::new(scenario).unwrap().take(usize::try_from(TICKS).unwrap()) {
        if let Some(due) = revisions.next_if(|due| due.first.first_sequence == step.gyro.sequence) {
            for (revision, calibration, slew) in &due.changes {
                let (revision, calibration, slew) = (*revision, Arc::clone(calibration), *slew);
                unit.schedule(Change { calibration, revision, at: At::NextTick, slew });
            }
        }
        let mut emit = |tick: &CorrectedTick| ticks.push(tick.clone());
        unit.handle(Event::Temperature(&step.temperatures), &mut emit);
        let accel = step.accel.unwrap();
        unit.handle(Event::Accel { output: accel_output, ticks: &[accel] }, &mut emit);
        unit.handle(Event::Gyro { output, ticks: &[step.gyro] }, &mut emit);
    }
    unit.handle(Event::Flush, &mut |tick: &CorrectedTick| ticks.push(tick.clone()));
    assert!(revisions.next().is_none(), "every revision was put in force");
    ticks
}

/// Compares what one unit gave out with the audit file, and with what offline correction makes of the same ticks.
fn judge(number: u64, batches: &[CorrectedBatch], revisions: &[Written], state: &Path) {
    let unit = serial(number);
    let in_force: Vec<_> = revisions.iter().filter(|written| written.first.is_some()).collect();
    let compiled = compile(&unit, revisions, state);
    let expected = offline(&scenario(number), &compiled);
    let mut expected = expected.as_slice();
    let mut outputs = 0;
    for batch in batches {
        let first = batch.ticks[0].sequence;
        assert_eq!(first, outputs, "{unit}: each tick once, in order");
        outputs += batch.ticks.len() as u64;
        let last = batch.ticks.last().unwrap().sequence;
        for sequence in [first, last] {
            let of = in_force
                .iter()
                .rev()
                .find(|written| written.first.unwrap().first_sequence <= sequence)
                .unwrap();
            let Acceptance { revision: counter, digest, .. } = &of.acceptance;
            let written = Revision { counter: *counter, digest: digest.head() };
            assert_eq!(batch.revision, written, "{unit}: tick {sequence}");
        }
        let (of_batch, rest) = expected.split_at(batch.ticks.len());
        assert!(of_batch.iter().all(|tick| tick.revision == batch.revision.counter));
        let offline = CorrectedBatch { ticks: of_batch.to_vec(), ..batch.clone() };
        if encode(&offline).unwrap() != encode(batch).unwrap() {
            let differ = offline.ticks.iter().zip(&batch.ticks).find(|(offline, online)| offline != online);
            panic!("{unit}, {:?}: offline and online differ: {differ:#?}", batch.revision);
        }
        expected = rest;
    }
    assert_eq!((outputs, expected.len()), (TICKS, 0), "{unit}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_swaps_lose_nothing_and_every_tick_is_that_of_its_revision_to_the_bit() {
    let folders = Folders::new();
    let mut ledgers = BTreeMap::new();
    for number in 0..UNITS {
        let (unit, text) = (serial(number), base(&serial(number)));
        folders.put(&format!("{unit}.toml"), text.as_bytes());
        ledgers.insert(unit, Ledger { accepted: 0, revision: 1, text, ..Ledger::default() });
    }
    let mut settings = folders.settings();
    // Only a stream that has stopped is ever flushed, and none stops before its end.
    settings.tail_flush = LIMIT;
    let mut stand = Stand::start(settings).await;
    let mut play = Play::start(&stand).await;
    let consumer = std::mem::replace(
        &mut stand.consumer,
        Consumer::declare(stand.operator.session(), None).await.unwrap(),
    );
    let collecting = tokio::spawn(collect(consumer));
    // Every unit is there before it is swapped; what came before a first batch is known when the second is there.
    play.on().await;
    play.on().await;
    for number in 0..UNITS {
        stand.operator.until(&serial(number), |status| status.last_tick).await;
    }

    let dice = Dice::new(20_260_731);
    let mut swaps = Swaps { stand: &stand, folders: &folders, dice, ledgers, done: BTreeMap::new() };
    for number in 0..SWAPS {
        if number > 1 {
            play.on().await;
        }
        swaps.next().await;
    }
    let Swaps { ledgers, done, .. } = swaps;
    for (_, playing) in play.players {
        playing.await.unwrap();
    }
    let (consumer, batches) = collecting.await.unwrap();
    for (unit, account) in consumer.accounts() {
        assert!(
            account.is_whole() && account.announced_missing == 0 && account.restarts == 0,
            "{unit}: {account:?}"
        );
        assert_eq!((account.ticks, account.uncalibrated), (TICKS, 0), "{unit}");
    }
    drop(consumer);
    let totals = stand.stop().await;
    assert!(totals.units.values().all(|unit| unit.ticks_out == TICKS), "{totals:?}");

    let entries = audit(&folders.state);
    let count = |is: fn(&AuditEvent) -> bool| entries.iter().filter(|entry| is(&entry.event)).count() as u64;
    let (accepted, refused) =
        (count(|e| matches!(e, AuditEvent::Accepted(_))), count(|e| matches!(e, AuditEvent::Refused(_))));
    assert_eq!(accepted, ledgers.values().map(|ledger| ledger.accepted).sum::<u64>() + UNITS);
    assert_eq!(refused, ledgers.values().map(|ledger| ledger.refused).sum::<u64>());
    assert_eq!(accepted + refused, SWAPS + UNITS, "those at the start among them");
    assert!(
        refused > SWAPS / 3 && done.values().all(|ways| *ways > SWAPS / 100) && done.len() == 4,
        "{done:?}"
    );
    let revisions = written(&folders.state);
    for number in 0..UNITS {
        judge(number, &batches[&serial(number)], &revisions[&serial(number)], &folders.state);
    }
}
