//! A subscriber made with the Python package gets what a Rust consumer gets, to the bit.
//!
//! `tests/python/run.sh` sets `ISOTHERM_PYTHON` to an interpreter with the package, and runs this.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};

use isotherm_bus::{Producer, ProducerOptions, close, open};
use isotherm_correction::reversal::ReversalParts;
use isotherm_correction::sample::{GyroTick, LasingMode, OutputKind, TickFlags};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::UnitId;
use isotherm_service::receive::fault::FaultKind;
use isotherm_tests::bench::{Bench, LIMIT};
use isotherm_tests::calibrations::{Feature, PutTerms, compile, identity, mode_reversed, polynomial};
use isotherm_tests::data::root;
use isotherm_tests::streams::{accel, gyro, temperature};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use zenoh::Session;

/// Gyro ticks that each unit sends.
const TICKS: u64 = 1500;
/// Ticks of [`THERMAL`] that are never sent.
const MISSING: std::ops::Range<u64> = 700..705;
/// Tick at which the sequences of [`REVERSED`] and [`BARE`] start anew.
const RESTART: u64 = 800;

/// Calibrated, with accelerometers and temperatures, and with a gap.
const THERMAL: &str = "PY-THERMAL";
/// Calibrated, with mode switches, and with a restart of its producer.
const REVERSED: &str = "PY-REVERSED";
/// Eight gyros that count, no calibration, and a second producer that takes over.
const BARE: &str = "PY-BARE";

/// What the subscriber says of one unit, as this side counts it.
struct Account {
    outputs: u64,
    flags_seen: u16,
    revision: Value,
    sums: [f64; 6],
    sha256: Sha256,
}

impl Default for Account {
    fn default() -> Self {
        Self { outputs: 0, flags_seen: 0, revision: Value::Null, sums: [0.0; 6], sha256: Sha256::new() }
    }
}

impl Account {
    fn enter(&mut self, batch: &CorrectedBatch) {
        let digest = hex(&batch.revision.digest);
        self.revision = json!({ "counter": batch.revision.counter, "digest": digest });
        for tick in &batch.ticks {
            self.outputs += 1;
            self.flags_seen |= tick.flags.bits();
            self.sha256.update(tick.sequence.to_le_bytes());
            self.sha256.update(tick.end_time.as_ns().to_le_bytes());
            self.sha256.update(tick.flags.bits().to_le_bytes());
            let increments = tick.delta_angle.iter().chain(&tick.delta_velocity);
            for (sum, increment) in self.sums.iter_mut().zip(increments) {
                *sum += increment;
                self.sha256.update(increment.to_le_bytes());
            }
        }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

/// The subscriber's process; killed when dropped.
struct Subscriber(Child);

impl Subscriber {
    /// Starts it, and waits until it can miss nothing.
    fn start(python: &str, locator: &str, ticks: u64) -> Self {
        let idle = LIMIT.as_secs().to_string();
        let mut child = Command::new(python)
            .args(["-B", "tests/python/subscriber.py", locator, &ticks.to_string(), &idle])
            .current_dir(root())
            .stdout(Stdio::piped())
            .spawn()
            .expect("ISOTHERM_PYTHON is an interpreter");
        let mut line = String::new();
        // One byte at a time: what follows the line belongs to `finish`.
        BufReader::with_capacity(1, child.stdout.as_mut().expect("piped"))
            .read_line(&mut line)
            .expect("text");
        assert_eq!(line, "{\"ready\": true}\n");
        Self(child)
    }

    /// Waits for its end; what it said.
    fn finish(mut self) -> Value {
        let mut text = String::new();
        self.0.stdout.as_mut().expect("piped").read_to_string(&mut text).expect("text");
        let status = self.0.wait().expect("it ends");
        assert!(status.success(), "{status}: {text}");
        serde_json::from_str(&text).expect("one line of JSON")
    }
}

impl Drop for Subscriber {
    fn drop(&mut self) {
        // Ended already after `finish`.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Something between −1 and 1 with all its digits in use.
fn wave(k: u64, period: f64) -> f64 {
    let k = u32::try_from(k).expect("a small number");
    (f64::from(k) / period).sin()
}

async fn producer(session: &Session, unit: &str, batch_ticks: usize) -> Producer {
    let options = ProducerOptions { batch_ticks, max_in_flight: None, ..ProducerOptions::default() };
    Producer::declare(session, &UnitId::new(unit).unwrap(), options).await.unwrap()
}

/// Sequence number of tick `k` where the producer starts anew.
fn since_restart(k: u64) -> u64 {
    if k < RESTART { k } else { k - RESTART }
}

/// A tick of the unit with mode switches, whose producer starts anew at [`RESTART`] without a word.
fn reversed(k: u64) -> GyroTick {
    let switch = k % 97 == 96;
    let mode = if ((k + 1) / 97).is_multiple_of(2) { LasingMode::Plus } else { LasingMode::Minus };
    let rates = [wave(k, 11.0), wave(k, 17.0), wave(k, 23.0)];
    GyroTick { sequence: since_restart(k), mode: Some(mode), switch_command: switch, ..gyro(k, &rates) }
}

/// Sends every unit's ticks, in batches of 7, 1 and 64.
async fn produce(session: &Session) {
    let mut thermal = producer(session, THERMAL, 7).await;
    let mut bare = producer(session, BARE, 64).await;
    let mut modes = producer(session, REVERSED, 1).await;
    for k in 0..TICKS {
        if k % 20 == 0 {
            thermal.temperatures(&[temperature(k, 30.0 + 5.0 * wave(k, 300.0))]).await.unwrap();
        }
        if !MISSING.contains(&k) {
            let forces = [wave(k, 13.0), wave(k, 19.0), 9.8];
            thermal.accel(OutputKind::Mean, accel(k, &forces)).await.unwrap();
            let rates = [wave(k, 29.0), wave(k, 31.0), wave(k, 37.0)];
            thermal.gyro(OutputKind::Mean, gyro(k, &rates)).await.unwrap();
        }
        let counts = [1.0, -2.0, 3.0, -4.0, 5.0, -6.0, 7.0, -8.0].map(|c| (c * 1e4 * wave(k, 41.0)).round());
        if k == RESTART {
            bare.flush().await.unwrap();
            bare = producer(session, BARE, 64).await;
        }
        let tick = GyroTick { sequence: since_restart(k), ..gyro(k, &counts) };
        bare.gyro(OutputKind::Counts, tick).await.unwrap();
        modes.gyro(OutputKind::Mean, reversed(k)).await.unwrap();
    }
    for producer in [&mut thermal, &mut bare, &mut modes] {
        producer.flush().await.unwrap();
    }
}

/// Receives until every tick is there or announced as missing.
async fn receive(bench: &mut Bench, ticks: u64) -> BTreeMap<String, Account> {
    let mut accounts = BTreeMap::<String, Account>::new();
    let receive = async {
        let mut accounted = 0;
        while accounted < ticks {
            let batch = bench.consumer.next().await.expect("the session is open");
            accounted += batch.ticks.iter().map(|tick| u64::from(tick.ticks) + tick.missed).sum::<u64>();
            accounts.entry(batch.unit.clone()).or_default().enter(&batch);
        }
    };
    tokio::time::timeout(LIMIT, receive).await.expect("every tick comes in time");
    accounts
}

#[tokio::test(flavor = "multi_thread")]
async fn the_python_subscriber_gets_every_increment_to_the_bit() {
    let Ok(python) = std::env::var("ISOTHERM_PYTHON") else {
        println!("skipped: ISOTHERM_PYTHON is not set");
        return;
    };
    let mut parts = identity();
    parts.gyros[0].terms.curve(Feature::One, polynomial(&[1e-4, 1e-6]));
    let calibrations =
        [(THERMAL, compile(&parts)), (REVERSED, compile(&mode_reversed(ReversalParts::default())))];
    let mut bench = Bench::start(&calibrations).await;
    let locator = bench.options.connect[0].clone();
    let subscriber = tokio::task::spawn_blocking(move || Subscriber::start(&python, &locator, 3 * TICKS));
    let subscriber = subscriber.await.unwrap();

    let session = open(&bench.options).await.unwrap();
    produce(&session).await;
    let accounts = receive(&mut bench, 3 * TICKS).await;
    let said = tokio::task::spawn_blocking(|| subscriber.finish()).await.unwrap();

    assert_eq!(said["rejected"], 0);
    assert_eq!(said["units"].as_object().unwrap().len(), 3);
    let mut flags_seen = TickFlags::empty();
    for (unit, account) in accounts {
        let continuity = bench.consumer.continuity(&UnitId::new(&unit).unwrap());
        let expected = json!({
            "outputs": account.outputs,
            "ticks": continuity.ticks,
            "announced_missing": continuity.announced_missing,
            "lost": 0,
            "duplicated": 0,
            "restarts": u64::from(unit != THERMAL),
            "last_sequence": continuity.last_sequence(),
            "flags_seen": account.flags_seen,
            "revision": account.revision,
            "sum_bits": account.sums.map(|sum| format!("{:016x}", sum.to_bits())),
            "sha256": hex(&account.sha256.finalize()),
        });
        assert_eq!(said["units"][&unit], expected, "{unit}");
        flags_seen |= TickFlags::from_bits_retain(account.flags_seen);
    }
    // The run was worth the comparison.
    let interesting = TickFlags::INTERPOLATED
        | TickFlags::GAP
        | TickFlags::ACCELEROMETER_MISSING
        | TickFlags::UNCALIBRATED
        | TickFlags::ANGLE_RESTORED
        | TickFlags::RESTART;
    assert!(flags_seen.contains(interesting), "{flags_seen:?}");
    close(session, LIMIT).await.unwrap();
    bench.stop().await;
}

#[test]
fn the_page_names_every_counter_of_the_service() {
    let page = std::fs::read_to_string(root().join("docs/wire.md")).unwrap();
    // The last one is the protocol's own.
    for name in FaultKind::ALL.iter().map(|kind| kind.name()).chain(["bad_frames"]) {
        assert!(page.contains(&format!("\n- `{name}`: ")), "{name}");
    }
}
