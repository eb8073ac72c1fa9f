//! Two pairs of services share the units of a site, without anybody who assigns them.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use isotherm_bus::{SessionOptions, close, open};
use isotherm_protocol::codec;
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::pair::{PairReport, Role};
use isotherm_protocol::raw::TemperatureBatch;
use isotherm_simulator::Scenario;
use isotherm_simulator::presets::mems_chamber;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::judged::{Sink, Source};
use isotherm_tests::pair::{Pair, until};
use isotherm_tests::process::{Service, resources, run};
use isotherm_tests::streams;
use zenoh::Session;

const DOCUMENT: &str = include_str!("../../../config/calibration/MEMS-0001.toml");
/// Units of each pair.
const UNITS: usize = 200;
const BATCH: usize = 10;

fn serials(group: &str) -> Vec<String> {
    (0..UNITS).map(|number| format!("{group}-{number:03}")).collect()
}

/// One of the pairs, which takes the units of a group.
fn pair(folder: &std::path::Path, group: &str) -> Pair {
    let document = |unit: String| {
        let text = DOCUMENT.replace("unit = \"MEMS-0001\"", &format!("unit = \"{unit}\""));
        (unit, text)
    };
    let documents: Vec<_> = serials(group).into_iter().map(document).collect();
    Pair::start(
        &folder.join(group),
        &documents,
        // On a busy machine what was sent by an instance that is killed may be this late at a sink that judges four hundred units.
        &format!("max_units = 250\nunits = [\"{group}-*\"]\n[pair]\ntakeover_ms = 200\n"),
    )
}

/// Units in a role by the instances that take a group.
fn units(reports: &[PairReport], group: &str, role: Role) -> BTreeSet<String> {
    let of_group = reports.iter().filter(|report| report.takes == [format!("{group}-*")]);
    let units = of_group.flat_map(|report| &report.units).filter(|unit| unit.role == role);
    units.map(|unit| unit.unit.clone()).collect()
}

/// Waits until each group's pair speaks for all of its units and for no other, each of them once.
async fn until_shared(session: &Session, standbys: bool) {
    let shared = |reports: &[PairReport]| {
        ["A", "B"].iter().all(|group| {
            let all: BTreeSet<_> = serials(group).into_iter().collect();
            let speaking =
                reports.iter().flat_map(|report| &report.units).filter(|it| it.role == Role::Speaking);
            units(reports, group, Role::Speaking) == all
                && (!standbys || units(reports, group, Role::Standby) == all)
                && speaking.count() == UNITS * 2
        })
    };
    until(session, shared).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn two_pairs_share_four_hundred_units_and_a_unit_that_nobody_takes_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_owned();
    let starting = tokio::task::spawn_blocking(move || ["A", "B"].map(|group| pair(&path, group)));
    let mut pairs = starting.await.unwrap();
    let connect: Vec<_> = pairs.iter().flat_map(Pair::endpoints).collect();
    let session =
        open(&SessionOptions { connect: connect.clone(), ..SessionOptions::default() }).await.unwrap();
    let sink = Sink::declare(&session).await;
    let mut sources = Vec::new();
    for (seed, unit) in (1..).zip(["A", "B"].iter().flat_map(|group| serials(group))) {
        let document = DOCUMENT.replace("unit = \"MEMS-0001\"", &format!("unit = \"{unit}\""));
        let scenario = Scenario { unit, tick_ns: 10_000_000, ..mems_chamber(seed) };
        sources.push(Source::declare(&session, scenario, &document, &sink).await.in_batches_of(BATCH));
    }
    let bytes = Arc::new(AtomicU64::new(0));
    let count = Arc::clone(&bytes);
    let counting = session.declare_subscriber(key::ALL_CORRECTED).callback(move |sample| {
        count.fetch_add(sample.payload().len() as u64, Ordering::Relaxed);
    });
    let counting = counting.await.unwrap();
    // A unit of neither group.
    let stray = UnitId::new("C-000").unwrap();
    // Temperatures alone are heard of units that an instance does not take.
    let readings = vec![streams::temperature(0, 20.0)];
    let frame = codec::encode(&TemperatureBatch { readings }).unwrap();

    let over = Arc::new(AtomicBool::new(false));
    let playing = tokio::spawn({
        let (session, over) = (session.clone(), Arc::clone(&over));
        async move {
            let mut times = tokio::time::interval(Duration::from_millis(100));
            while !over.load(Ordering::SeqCst) {
                times.tick().await;
                session.put(key::raw(&stray, RawStream::Temperature), frame.clone()).await.unwrap();
                for source in &mut sources {
                    for _ in 0..BATCH {
                        source.tick().await;
                    }
                }
                // A machine that cannot do as much in the time has it to spare for the services all the same.
                times.reset();
            }
            sources
        }
    });
    until_shared(&session, true).await;
    // One instance of each pair is gone: the other has all of its units, and those of no other group.
    for pair in &mut pairs {
        pair.kill(0);
    }
    until_shared(&session, false).await;
    for pair in &mut pairs {
        tokio::task::block_in_place(|| pair.restart(0));
    }
    until_shared(&session, true).await;

    let ids = pairs.iter().flat_map(|pair| pair.services.iter().flatten()).map(Service::id);
    for used in ids.map(resources) {
        println!("{} units: {} kB, {:?} of computing", UNITS, used.resident_kb, used.cpu);
    }
    let connect: Vec<_> = connect.iter().flat_map(|it| ["--connect", it.as_str()]).collect();
    let deadline = Instant::now() + LIMIT;
    loop {
        let status = tokio::task::block_in_place(|| run("isotherm", &[&["status"], &connect[..]].concat()));
        let shown = String::from_utf8_lossy(&status.stdout);
        if ["A-199", "B-199", "C-000"].iter().all(|unit| shown.contains(unit)) {
            break;
        }
        // On a busy machine a standby takes over now and then, and for that moment nobody speaks for its units.
        assert!(Instant::now() < deadline, "{shown}");
    }
    over.store(true, Ordering::SeqCst);
    let sources = playing.await.unwrap();
    drop(counting);
    let published: u64 =
        sources.iter().map(|source| sink.account(source.unit())).map(|it| it.used + it.doubled).sum();
    println!("{} bytes of corrected frames a tick", bytes.load(Ordering::Relaxed) / published.max(1));
    for source in &sources {
        let account = sink.account(source.unit());
        assert_eq!((account.lost, account.wrong), (0, 0), "{}: {account:?}", source.unit());
        assert!(account.used > 100, "{}: {account:?}", source.unit());
    }
    close(session, LIMIT).await.unwrap();
}
