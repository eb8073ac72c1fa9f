//! Producer, consumer and a stand-in for the service over real sessions on loopback.

#![expect(clippy::unwrap_used, reason = "a test may panic, its helpers included")]

use std::collections::HashMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use arrayvec::ArrayVec;
use isotherm_bus::{
    BusError, Consumer, Producer, ProducerOptions, SessionOptions, close, locators, open, presence,
};
use isotherm_correction::sample::{AccelTick, ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::{decode, encode};
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick, Revision};
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch};
use zenoh::Session;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Queryable;
use zenoh::sample::Locality;

const LIMIT: Duration = Duration::from_secs(20);

fn unit(serial: &str) -> UnitId {
    UnitId::new(serial).unwrap()
}

async fn connected(to: &Session) -> Session {
    open(&SessionOptions { connect: locators(to), ..SessionOptions::default() }).await.unwrap()
}

/// Gives every raw gyro tick back with its sequence number as increments; the publisher is declared in the
/// callback of the unit's first message and used at once, as the service does it.
async fn echo(session: &Session) -> (Subscriber<()>, Queryable<()>) {
    let publishers: Mutex<HashMap<String, Publisher<'static>>> = Mutex::default();
    let own = session.clone();
    let subscriber = session
        .declare_subscriber(key::ALL_RAW)
        .allowed_origin(Locality::Remote)
        .callback(move |sample| {
            use zenoh::Wait;
            let Some((serial, RawStream::Gyro)) = key::parse_raw(sample.key_expr().as_str()) else {
                return;
            };
            let raw: GyroBatch = decode(&sample.payload().to_bytes()).unwrap();
            let mut publishers = publishers.lock().unwrap();
            let publisher = publishers.entry(serial.to_owned()).or_insert_with(|| {
                own.declare_publisher(key::corrected(&unit(serial)))
                    .congestion_control(CongestionControl::Drop)
                    .priority(Priority::RealTime)
                    .wait()
                    .unwrap()
            });
            publisher.put(encode(&corrected(serial, &raw)).unwrap()).wait().unwrap();
        })
        .await
        .unwrap();
    let queryable = session.declare_queryable(key::ALL_STATUS).callback(drop).await.unwrap();
    (subscriber, queryable)
}

fn corrected(serial: &str, raw: &GyroBatch) -> CorrectedBatch {
    let ticks = raw.ticks.iter().map(|tick| CorrectedTick {
        sequence: tick.sequence,
        end_time: tick.end_time,
        duration: tick.duration,
        ticks: 1,
        ..CorrectedTick::default()
    });
    CorrectedBatch {
        unit: serial.to_owned(),
        series: 0,
        revision: Revision::default(),
        temperatures: ArrayVec::new(),
        sigmas: Vec::new(),
        ticks: ticks.collect(),
    }
}

fn gyro(sequence: u64) -> GyroTick {
    let end_time = Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000);
    GyroTick {
        sequence,
        end_time,
        duration: Span::from_ms(5),
        readings: [1.0, 2.0, 3.0].into_iter().collect(),
        ..GyroTick::default()
    }
}

fn accel(sequence: u64) -> AccelTick {
    let GyroTick { sequence, end_time, duration, readings, .. } = gyro(sequence);
    AccelTick { sequence, end_time, duration, readings }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_first_output_of_a_unit_that_appears_reaches_a_subscriber_that_was_there() {
    let service = open(&SessionOptions::default()).await.unwrap();
    let _echo = echo(&service).await;
    let source = connected(&service).await;
    for round in 0..100 {
        // Every other round the consumer's session is new too: its declarations have to have arrived.
        let sink = connected(&service).await;
        let mut consumer = Consumer::declare(&sink, None).await.unwrap();
        presence::wait_for_service(&sink, LIMIT).await.unwrap();
        let unit = unit(&format!("FIRST-{round}"));
        let mut producer = Producer::declare(&source, &unit, ProducerOptions::default()).await.unwrap();
        for sequence in 0..3 {
            producer.gyro(OutputKind::Counts, gyro(sequence)).await.unwrap();
        }
        for sequence in 0..3 {
            let batch = tokio::time::timeout(LIMIT, consumer.next()).await.expect("in time").unwrap();
            assert_eq!(
                (batch.unit.as_str(), batch.ticks[0].sequence),
                (unit.as_str(), sequence),
                "round {round}"
            );
        }
        drop(consumer);
        close(sink, LIMIT).await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_published_before_close_arrives() {
    let sink = open(&SessionOptions::default()).await.unwrap();
    for round in 0..20 {
        let mut consumer = Consumer::declare(&sink, None).await.unwrap();
        let source = connected(&sink).await;
        let publisher = source
            .declare_publisher(key::corrected(&unit("LAST")))
            .congestion_control(CongestionControl::Block)
            .priority(Priority::RealTime)
            .await
            .unwrap();
        let listener = publisher.matching_listener().await.unwrap();
        while !publisher.matching_status().await.unwrap().matching() {
            listener.recv_async().await.unwrap();
        }
        for sequence in 0..2000 {
            let ticks = vec![GyroTick { sequence, ..gyro(0) }];
            let batch = corrected("LAST", &GyroBatch { output: OutputKind::Counts, ticks });
            publisher.put(encode(&batch).unwrap()).await.unwrap();
        }
        close(source, LIMIT).await.unwrap();
        let mut count = 0;
        while count < 2000 {
            let batch = tokio::time::timeout(LIMIT, consumer.next()).await;
            let batch = batch.unwrap_or_else(|_| panic!("round {round}: {count} of 2000 arrived")).unwrap();
            count += batch.ticks.len();
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn batches_go_out_in_order_and_no_more_than_allowed_is_under_way() {
    let service = open(&SessionOptions::default()).await.unwrap();
    let (sender, mut seen) = tokio::sync::mpsc::unbounded_channel();
    let _order = service
        .declare_subscriber(key::ALL_RAW)
        .callback(move |sample| {
            let (_, stream) = key::parse_raw(sample.key_expr().as_str()).unwrap();
            let bytes = sample.payload().to_bytes();
            let count = match stream {
                RawStream::Gyro => decode::<GyroBatch>(&bytes).unwrap().ticks.len(),
                RawStream::Accel => decode::<AccelBatch>(&bytes).unwrap().ticks.len(),
                RawStream::Temperature | RawStream::Health => 0,
            };
            sender.send((stream, count)).unwrap();
        })
        .await
        .unwrap();
    let source = connected(&service).await;
    let options = ProducerOptions { batch_ticks: 4, ..ProducerOptions::default() };
    let mut producer = Producer::declare(&source, &unit("ORDER"), options).await.unwrap();
    let body = ChannelName::from("body").unwrap();
    for sequence in [0, 1, 2, 3, 4, 5, 9] {
        if sequence == 2 {
            let reading = TemperatureReading { channel: body, time: gyro(2).end_time, raw: 20.0 };
            producer.temperatures(&[reading]).await.unwrap();
        }
        producer.accel(OutputKind::Counts, accel(sequence)).await.unwrap();
        producer.gyro(OutputKind::Counts, gyro(sequence)).await.unwrap();
    }
    producer.flush().await.unwrap();
    // The jump from 5 to 9 ends a batch of either stream.
    let (temperature, accel, gyro) = (RawStream::Temperature, RawStream::Accel, RawStream::Gyro);
    let expected = [(temperature, 0), (accel, 4), (gyro, 4), (accel, 2), (accel, 1), (gyro, 2), (gyro, 1)];
    let mut order = Vec::new();
    while order.len() < expected.len() {
        order.push(tokio::time::timeout(LIMIT, seen.recv()).await.expect("in time").unwrap());
    }
    assert_eq!(order, expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bounded_producer_keeps_up_with_what_comes_back() {
    let service = open(&SessionOptions::default()).await.unwrap();
    let _echo = echo(&service).await;
    let source = connected(&service).await;
    let unit = unit("BOUND");
    let mut consumer = Consumer::declare(&source, Some(&unit)).await.unwrap();
    presence::wait_for_service(&source, LIMIT).await.unwrap();
    let options = ProducerOptions { batch_ticks: 7, max_in_flight: Some(512), ..ProducerOptions::default() };
    let mut producer = Producer::declare(&source, &unit, options).await.unwrap();
    for sequence in 0..50_000 {
        producer.gyro(OutputKind::Counts, gyro(sequence)).await.unwrap();
        assert!(producer.in_flight() <= 512);
    }
    producer.flush().await.unwrap();
    producer.drain().await.unwrap();
    while consumer.continuity(&unit).ticks < 50_000 {
        tokio::time::timeout(LIMIT, consumer.next()).await.expect("in time").unwrap();
    }
    let account = consumer.continuity(&unit);
    assert!(account.is_whole(), "{account:?}");
    assert_eq!(consumer.rejected(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn waits_end_with_a_sentence() {
    let alone = open(&SessionOptions::default()).await.unwrap();
    let short = Duration::from_millis(20);
    let options = ProducerOptions { match_timeout: short, ..ProducerOptions::default() };
    let error = Producer::declare(&alone, &unit("X"), options).await.unwrap_err();
    assert!(matches!(&error, BusError::NoSubscriber { key, .. } if key == "imu/X/raw/gyro"), "{error}");
    let error = presence::wait_for_service(&alone, short).await.unwrap_err();
    assert!(matches!(error, BusError::NoService { .. }), "{error}");

    // A subscriber that gives nothing back.
    let deaf = connected(&alone).await;
    let _subscriber = deaf.declare_subscriber(key::ALL_RAW).callback(drop).await.unwrap();
    let options = ProducerOptions {
        max_in_flight: Some(300),
        acknowledge_timeout: short,
        ..ProducerOptions::default()
    };
    let mut producer = Producer::declare(&alone, &unit("X"), options).await.unwrap();
    for sequence in 0..300 {
        producer.gyro(OutputKind::Counts, gyro(sequence)).await.unwrap();
    }
    let error = producer.gyro(OutputKind::Counts, gyro(300)).await.unwrap_err();
    assert!(matches!(error, BusError::NoAcknowledgement { in_flight: 300, .. }), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn closing_is_quick_and_bad_options_are_named() {
    let session = open(&SessionOptions::default()).await.unwrap();
    let other = connected(&session).await;
    let begun = Instant::now();
    close(session, LIMIT).await.unwrap();
    close(other, LIMIT).await.unwrap();
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());

    let options = SessionOptions { listen: vec!["no endpoint".to_owned()], ..SessionOptions::default() };
    let error = open(&options).await.unwrap_err();
    assert!(matches!(error, BusError::Endpoint { option: "listen", .. }), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn sites_in_different_namespaces_do_not_hear_each_other() {
    let here = SessionOptions { namespace: Some("site/a".to_owned()), ..SessionOptions::default() };
    let service = open(&here).await.unwrap();
    let _echo = echo(&service).await;
    let same = open(&SessionOptions { connect: locators(&service), ..here.clone() }).await.unwrap();
    presence::wait_for_service(&same, LIMIT).await.unwrap();
    let other = connected(&service).await;
    let error = presence::wait_for_service(&other, Duration::from_millis(50)).await.unwrap_err();
    assert!(matches!(error, BusError::NoService { .. }), "{error}");
    insta::assert_snapshot!(error.to_string().replace(&locators(&service)[0], "ENDPOINT"));
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_that_say_nothing_keep_no_client_out() {
    let session = open(&SessionOptions::default()).await.unwrap();
    let locators = locators(&session);
    let address = locators[0].strip_prefix("tcp/").unwrap().to_owned();
    let idle: Vec<_> = (0..500).map(|_| std::net::TcpStream::connect(&address).unwrap()).collect();
    let options = SessionOptions { connect: locators, ..SessionOptions::default() };
    let client = tokio::time::timeout(Duration::from_secs(8), open(&options)).await;
    client.expect("in time").unwrap();
    drop(idle);
}
