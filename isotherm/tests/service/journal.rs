//! A log alone is enough: what a recorder hears on the raw topics and in the journal gives the service's output again, to
//! the bit, from the beginning and from any memory on.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use isotherm_bus::{SessionOptions, close, locators, open, presence};
use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, LasingMode, OutputKind, Readings, TemperatureReading,
};
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::{decode, encode};
use isotherm_protocol::control::{CommandReply, SwapOutcome, SwapReply};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalEvent, JournalPart};
use isotherm_protocol::key::{self, Input, RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::stream::UnitStream;
use isotherm_service::{Settings, start};
use zenoh::Session;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::ConsolidationMode;

const LIMIT: Duration = Duration::from_secs(30);
const EXAMPLE: &str = include_str!("../../../config/calibration/example-full.toml");
/// The last tick that is sent.
const LAST: u64 = 60 + 6 * 400 - 1;
const TICK_NS: i64 = 5_000_000;
const CHANNELS: [(&str, f64); 4] = [("block", 1.8), ("coil", 25.0), ("accel", 4770.0), ("board", 30.0)];

fn unit() -> UnitId {
    UnitId::new("EXAMPLE-0001").unwrap()
}

/// The example with another constant.
fn document(bias_deg_per_h: f64) -> String {
    let text = EXAMPLE.replacen("[1.284,", &format!("[{bias_deg_per_h:.3},"), 1);
    assert_ne!(text, EXAMPLE);
    text
}

/// What was heard of everything.
#[derive(Default)]
struct Log {
    inputs: Vec<(Input, Vec<u8>)>,
    joiner: Joiner,
    entries: Vec<JournalEntry>,
    batches: Vec<CorrectedBatch>,
}

impl Log {
    /// Ticks under their revision, every digit of them.
    fn ticks(&self) -> Vec<String> {
        ticks(&self.batches)
    }
}

fn ticks(batches: &[CorrectedBatch]) -> Vec<String> {
    let each = |batch: &CorrectedBatch| -> Vec<String> {
        batch.ticks.iter().map(|tick| format!("{:?} {tick:?}", batch.revision)).collect()
    };
    batches.iter().flat_map(each).collect()
}

type Shared = Arc<Mutex<Log>>;

/// Subscribes to inputs, journal and output, as a recorder does.
async fn record(session: &Session) -> Shared {
    let log = Shared::default();
    for key in [key::ALL_RAW, key::ALL_REFERENCE, key::ALL_JOURNALS, key::ALL_CORRECTED] {
        let log = Arc::clone(&log);
        let take = move |sample: zenoh::sample::Sample| {
            let (key, bytes) = (sample.key_expr().as_str(), sample.payload().to_bytes());
            let mut log = log.lock().unwrap();
            if let Some((_, input)) = key::parse_input(key) {
                log.inputs.push((input, bytes.to_vec()));
            } else if key::parse_journal(key).is_some() {
                let joined = log.joiner.join(decode::<JournalPart>(&bytes).unwrap()).unwrap();
                log.entries.extend(joined);
            } else {
                log.batches.push(decode(&bytes).unwrap());
            }
        };
        session.declare_subscriber(key).callback(take).background().await.unwrap();
    }
    log
}

/// Waits until what was recorded is as it must be.
async fn until(log: &Shared, what: &str, is: impl Fn(&Log) -> bool) {
    let start = Instant::now();
    while !is(&log.lock().unwrap()) {
        assert!(start.elapsed() < LIMIT, "{what} in time");
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
}

async fn put(session: &Session, input: Input, frame: Vec<u8>) {
    let put = session.put(key::input(&unit(), input), frame);
    put.congestion_control(CongestionControl::Block).priority(Priority::RealTime).await.unwrap();
}

fn end_ns(sequence: u64) -> i64 {
    i64::try_from(sequence + 1).unwrap() * TICK_NS
}

/// The messages of one tick of the example; the last of a stretch goes without its accelerometers.
fn messages(sequence: u64, last: bool) -> Vec<(Input, Vec<u8>)> {
    let (end_time, duration) = (Timestamp::from_ns(end_ns(sequence)), Span::from_ns(TICK_NS));
    let wobble = f64::from(u32::try_from(sequence * 7 % 11).unwrap());
    let readings: Readings = [wobble, 2.0, -wobble, 1.0].into_iter().collect();
    let mut messages = Vec::new();
    if sequence.is_multiple_of(20) {
        let time = Timestamp::from_ns(end_ns(sequence) - TICK_NS);
        let readings = CHANNELS.iter().map(|(name, raw)| TemperatureReading {
            channel: ChannelName::from(name).unwrap(),
            time,
            raw: raw * (1.0 + 1e-6 * f64::from(u32::try_from(sequence).unwrap())),
        });
        let batch = TemperatureBatch { readings: readings.collect() };
        messages.push((Input::Raw(RawStream::Temperature), encode(&batch).unwrap()));
    }
    if !last {
        let accel = AccelTick { sequence, end_time, duration, readings };
        let batch = AccelBatch { output: OutputKind::Counts, ticks: vec![accel] };
        messages.push((Input::Raw(RawStream::Accel), encode(&batch).unwrap()));
    }
    let switches = sequence / 50;
    let mode = if switches.is_multiple_of(2) { LasingMode::Plus } else { LasingMode::Minus };
    let gyro = GyroTick {
        sequence,
        end_time,
        duration,
        readings,
        mode: Some(mode),
        switch_command: sequence.is_multiple_of(50) && sequence > 0,
        series: 3,
        ..GyroTick::default()
    };
    let batch = GyroBatch { output: OutputKind::Counts, ticks: vec![gyro] };
    messages.push((Input::Raw(RawStream::Gyro), encode(&batch).unwrap()));
    messages
}

/// Sends ticks: some doubled, some lost, some with a broken frame or a reference behind them.
async fn produce(session: &Session, sequences: std::ops::Range<u64>) {
    let end = sequences.end;
    for sequence in sequences {
        let last = sequence + 1 == end;
        for (input, frame) in messages(sequence, last) {
            if sequence % 37 == 5 && !last {
                continue;
            }
            put(session, input, frame.clone()).await;
            if sequence % 41 == 7 {
                put(session, input, frame.clone()).await;
            }
            if sequence % 53 == 9 {
                put(session, input, frame[..frame.len() / 2].to_vec()).await;
            }
        }
        if sequence % 300 == 299 {
            let reference = Reference {
                start_ns: end_ns(sequence) - 1_400_000_000,
                end_ns: end_ns(sequence) - 200_000_000,
                angular_rate_rad_per_s: [1e-6, -2e-6, 3e-6],
                sigma_rad_per_s: 1e-7,
            };
            put(session, Input::Reference, encode(&reference).unwrap()).await;
        }
    }
}

async fn ask(session: &Session, key: String, payload: Option<String>) -> Vec<Vec<u8>> {
    let mut get = session.get(key).consolidation(ConsolidationMode::None);
    if let Some(payload) = payload {
        get = get.payload(payload);
    }
    let replies = get.await.unwrap();
    let mut payloads = Vec::new();
    while let Ok(reply) = tokio::time::timeout(LIMIT, replies.recv_async()).await.expect("in time") {
        payloads.push(reply.into_result().expect("an answer").payload().to_bytes().to_vec());
    }
    payloads
}

async fn swap(session: &Session, options: &str, bias_deg_per_h: f64) {
    let key = format!("{}?{options}", key::calibration(&unit()));
    let replies = ask(session, key, Some(document(bias_deg_per_h))).await;
    let reply: SwapReply = serde_json::from_slice(&replies[0]).unwrap();
    assert_eq!(reply.outcome, SwapOutcome::Accepted, "{reply:?}");
}

/// A swap at once, slewed, where nothing else is to be left waiting.
async fn swap_unless(waits: bool, session: &Session, bias_deg_per_h: f64) {
    if !waits {
        swap(session, "by=ann;slew_s=0.4", bias_deg_per_h).await;
    }
}

async fn command(session: &Session, json: &str, accepted: bool) {
    let replies = ask(session, key::command(&unit()), Some(json.to_owned())).await;
    let reply: CommandReply = serde_json::from_slice(&replies[0]).unwrap();
    assert_eq!(reply.accepted, accepted, "{reply:?}");
}

/// The unit's memory, as one entry.
async fn memory(session: &Session) -> JournalEntry {
    let mut joiner = Joiner::new();
    let parts = ask(session, key::journal(&unit()), None).await;
    let entries: Vec<_> =
        parts.iter().filter_map(|part| joiner.join(decode(part).unwrap()).unwrap()).collect();
    let [entry] = entries.try_into().expect("one unit, one memory");
    entry
}

/// Corrects a log: each event where the stream has heard what the entry says, frames in the order of their recording.
fn correct(mut stream: UnitStream, log: &Log, after: u64) -> (UnitStream, Vec<CorrectedBatch>) {
    let mut batches = Vec::new();
    let mut give = |stream: &mut UnitStream| {
        let mut frame = Vec::new();
        while stream.next_frame(&mut frame).is_some() {
            batches.push(decode(&frame).unwrap());
        }
    };
    // Frames that the stream has heard already are not given to it again.
    let mut skip = stream.heard().map(|heard| heard.frames);
    let mut frames: Vec<_> = log
        .inputs
        .iter()
        .filter(|(input, _)| {
            let left = &mut skip[input.index()];
            let known = *left > 0;
            *left = left.saturating_sub(1);
            !known
        })
        .collect();
    let mut number = after;
    for entry in log.entries.iter().filter(|entry| entry.number > after) {
        number += 1;
        assert_eq!(entry.number, number, "no entry is missing");
        frames.retain(|(input, frame)| {
            let due = stream.heard()[input.index()].frames < entry.heard[input.index()].frames;
            if due {
                drop(stream.receive(*input, frame));
                give(&mut stream);
            }
            !due
        });
        assert_eq!(stream.heard(), entry.heard, "entry {number} stands where it says");
        stream.carry_out(&entry.event).unwrap();
        give(&mut stream);
    }
    assert!(frames.is_empty(), "the last entry stands behind every frame");
    (stream, batches)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_log_alone_gives_the_corrected_output_again() {
    let mut settings = Settings { tail_flush: Duration::from_millis(50), ..Settings::default() };
    settings.congestion = CongestionControl::Block;
    settings.unit.subtract_drift = true;
    settings.unit.pairing_window = Span::from_ms(20);
    let session = open(&settings.zenoh.session).await.unwrap();
    let locators = locators(&session);
    let service = start(settings.clone(), session).await.unwrap();
    let options = SessionOptions { connect: locators, ..SessionOptions::default() };
    let (bench, operator) = (open(&options).await.unwrap(), open(&options).await.unwrap());
    let log = record(&bench).await;
    presence::wait_for_service(&bench, LIMIT).await.unwrap();
    presence::wait_for_service(&operator, LIMIT).await.unwrap();

    produce(&bench, 0..60).await;
    until(&log, "the end of the first stretch", |log| {
        log.entries.iter().any(|entry| entry.event == JournalEvent::Flushed)
    })
    .await;
    swap(&operator, "by=ann", 1.5).await;
    let mut middle = None;
    for round in 0..6_u32 {
        let first = 60 + 400 * u64::from(round);
        let bias_deg_per_h = 2.0 + 0.125 * f64::from(round);
        // While ticks come: which of them come before what is decided in the service, and told.
        let operate = async {
            match round {
                2 => {
                    command(&operator, r#"{"command":"standby"}"#, true).await;
                    command(&operator, r#"{"command":"abort"}"#, false).await;
                    command(&operator, r#"{"command":"run"}"#, true).await;
                }
                3 => middle = Some(memory(&operator).await),
                _ => {
                    let options = format!("by=ann;at_sequence={};slew_s=0.2", first + 250);
                    swap(&operator, &options, bias_deg_per_h).await;
                }
            }
            swap_unless(round % 2 == 0, &operator, bias_deg_per_h + 0.0625).await;
        };
        tokio::join!(produce(&bench, first..first + 400), operate);
    }
    let middle = middle.expect("asked for");
    let configuration = ask(&operator, key::ALL_CONFIGURATIONS.to_owned(), None).await;
    // The tail of the stream goes out by the clock; then nothing waits.
    until(&log, "the tail", |log| {
        log.batches.last().and_then(|batch| batch.ticks.last()).is_some_and(|tick| tick.sequence == LAST)
    })
    .await;
    let at_end = memory(&operator).await;
    let totals = service.stop().await;
    assert!(!totals.lost(), "{totals:?}");
    until(&log, "the last entry", |log| {
        log.entries.last().is_some_and(|entry| entry.event == JournalEvent::Ended)
    })
    .await;
    close(bench, LIMIT).await.unwrap();

    let log = log.lock().unwrap();
    let online = log.ticks();
    let count = |name| log.entries.iter().filter(|entry| entry.event.name() == name).count();
    assert_eq!(["began", "changed", "commanded", "memory", "ended"].map(count), [1, 8, 3, 0, 1]);
    assert!(count("flushed") >= 2, "{}", count("flushed"));
    // From the beginning.
    let (stream, batches) = correct(UnitStream::new(unit(), UnitSettings::default()), &log, 0);
    let offline = ticks(&batches);
    let differs = online.iter().zip(&offline).position(|(a, b)| a != b);
    assert!(
        online == offline,
        "first difference at tick {differs:?} of {} and {}",
        online.len(),
        offline.len()
    );
    assert_eq!(online.len() as u64, totals.unit(&unit()).ticks_out);
    // What it knows in the end is what the service knew.
    let JournalEvent::Memory { memory, document: text, .. } = &at_end.event else { panic!("{at_end:?}") };
    let remembered = UnitStream::from_memory(memory).unwrap();
    assert_eq!((remembered.heard(), remembered.revision()), (stream.heard(), stream.revision()));
    assert_eq!(remembered.counters(), stream.counters());
    assert_eq!(text.as_deref(), Some(&*document(2.0 + 0.125 * 5.0 + 0.0625)));
    // From the middle.
    let JournalEvent::Memory { memory, .. } = &middle.event else { panic!("{middle:?}") };
    let (_, batches) = correct(UnitStream::from_memory(memory).unwrap(), &log, middle.number);
    let tail = ticks(&batches);
    assert!(tail.len() > 600 && tail.len() < online.len() - 600, "{} of {}", tail.len(), online.len());
    assert!(online.ends_with(&tail), "{} ticks from a memory", tail.len());

    let [text] = configuration.try_into().expect("one instance");
    let text = String::from_utf8(text).unwrap();
    let first_line = concat!("# isotherm ", env!("CARGO_PKG_VERSION"));
    assert_eq!(text.lines().next(), Some(first_line), "{text}");
    assert_eq!(Settings::parse(&text, Path::new("effective.toml")).unwrap(), settings);
}
