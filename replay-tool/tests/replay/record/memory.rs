//! When a recorder asks a service for the memory of its units.

use isotherm_protocol::codec;
use isotherm_protocol::journal::{JournalEntry, JournalEvent, JournalPart, split};
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::stream::Heard;
use tokio::sync::mpsc::unbounded_channel;
use tokio::time::timeout;
use zenoh::Wait;

use super::bus::{Bench, LIMIT, read};

/// A memory that is told from others by its number.
fn memory(unit: &UnitId, number: u64) -> JournalEntry {
    let event = JournalEvent::Memory { memory: vec![7; 100], document: None, pending: None };
    let heard = [Heard::default(); 5];
    JournalEntry { unit: unit.to_string(), instance: "one".to_owned(), number, heard, event }
}

#[tokio::test(flavor = "multi_thread")]
async fn memories_are_asked_for_when_it_begins_when_links_have_come_up_and_when_it_ends() {
    let bench = Bench::new().await;
    // A service as far as a recorder sees one.
    let status = bench.session.declare_queryable(key::ALL_STATUS).callback(drop).await.unwrap();
    let (told, mut asked) = unbounded_channel();
    let mut number = 0;
    let unit = UnitId::new("A-1").unwrap();
    let answer = move |query: zenoh::query::Query| {
        number += 1;
        for part in split(&memory(&unit, number)) {
            query.reply(key::journal(&unit), codec::encode(&part).unwrap()).wait().unwrap();
        }
        told.send(number).unwrap();
    };
    let answer = std::sync::Mutex::new(answer);
    let journals = bench.session.declare_queryable(key::ALL_JOURNALS);
    let journals = journals.callback(move |query| (answer.lock().unwrap())(query)).await.unwrap();

    let recorder = bench.start("", &["--out", "run", "--timeout", "30"]);
    for number in 1..=2 {
        // One file, and no service that came: the second time it asks of its own accord.
        assert_eq!(timeout(LIMIT, asked.recv()).await.unwrap(), Some(number));
    }
    recorder.interrupt();
    assert_eq!(timeout(LIMIT, asked.recv()).await.unwrap(), Some(3), "at the end");
    let (code, _, errors) = recorder.end();
    assert_eq!(code, Some(0), "{errors}");
    assert!(asked.try_recv().is_err(), "and no more");

    let (frames, _) = read(&[bench.path("run.mcap")]);
    let numbers =
        frames["imu/A-1/journal"].iter().map(|frame| codec::decode::<JournalPart>(frame).unwrap().number);
    assert_eq!(numbers.collect::<Vec<_>>(), [1, 2, 3], "all of them are in the file");
    for queryable in [status, journals] {
        queryable.undeclare().await.unwrap();
    }
    bench.end().await;
}
