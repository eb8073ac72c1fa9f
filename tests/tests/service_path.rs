//! What a message costs in allocations on its way through the service, Zenoh left out: nothing but the frame that is published.

#![expect(clippy::expect_used, reason = "what does not hold ends the test")]

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, OutputKind, Readings, TemperatureReading,
};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec;
use isotherm_protocol::document::Document;
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};
use isotherm_service::config::Settings;
use isotherm_service::control::revision::Calibrations;
use isotherm_service::receive::intake::Intake;
use isotherm_service::receive::unit::Outlet;

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

const TICK_NS: u64 = 5_000_000;
const TICKS_PER_S: u64 = 200;
/// Ticks in a message.
const BATCHES: [u64; 3] = [1, 10, 32];

/// A message of a unit: its key and its frame.
type Message = (String, Vec<u8>);

#[test]
fn a_message_allocates_nothing_but_the_frame_that_it_publishes() {
    let text = include_str!("../../config/calibration/MEMS-0001.toml");
    let parsed = Document::parse(text, None).expect("the document holds");
    let channels: Vec<ChannelName> =
        parsed.calibration.channels().iter().map(|channel| *channel.name()).collect();
    let units = ["A", "B"].map(|name| UnitId::new(name).expect("a serial"));
    let calibration = Arc::new(parsed.calibration);
    // One after the other: the profiler counts for the whole process.
    for batch in BATCHES {
        let mut calibrations = Calibrations::default();
        for unit in &units {
            calibrations.insert(unit.clone(), Arc::clone(&calibration), [7; 8]);
        }
        let published = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&published);
        let outlets = Box::new(move |_: &UnitId| {
            let count = Arc::clone(&count);
            let outlet: Outlet = Box::new(move |frame| {
                count.fetch_add(1, Ordering::Relaxed);
                drop(frame);
                Ok(())
            });
            Ok(outlet)
        });
        let intake = Intake::new(Settings::default(), calibrations, outlets);
        let messages = |from: u64, to: u64| -> Vec<Message> {
            let firsts = (from..to).step_by(usize::try_from(batch).expect("a few"));
            // Units take turns, so that what one leaves behind is used by the other.
            firsts
                .flat_map(|first| units.iter().flat_map(move |unit| [(unit, first)]))
                .flat_map(|(unit, first)| messages(unit, first, batch, &channels))
                .collect()
        };
        let seconds = 20;
        let warm_up = messages(0, 3200);
        let steady = messages(3200, 3200 + seconds * 1600);
        let receive = |messages: &[Message]| {
            for (key, frame) in messages {
                intake.receive(key, Some(frame), Instant::now());
            }
        };
        receive(&warm_up);
        let before = published.load(Ordering::Relaxed);
        let profiler = dhat::Profiler::builder().testing().build();
        let blocks = dhat::HeapStats::get().total_blocks;
        receive(&steady);
        let blocks = dhat::HeapStats::get().total_blocks - blocks;
        drop(profiler);
        let frames = published.load(Ordering::Relaxed) - before;
        assert_eq!(frames, 2 * seconds * 1600 / batch, "each message of gyro ticks is published");
        // A latency in a power of two that there was none in before makes its buckets.
        let buckets = blocks - frames.min(blocks);
        assert!(
            blocks >= frames && buckets < 60,
            "batches of {batch}: {} messages allocated {blocks} blocks for {frames} frames",
            steady.len()
        );
        println!("batches of {batch}: {} messages, {frames} frames, {blocks} blocks", steady.len());
        assert_eq!(intake.totals().refused.len(), 0);
        assert!(intake.totals().units.values().all(|unit| unit.bad == 0 && unit.gaps == 0));
    }
}

/// The messages with a batch of ticks, readings of every channel once a second before it.
fn messages(unit: &UnitId, first: u64, batch: u64, channels: &[ChannelName]) -> Vec<Message> {
    let end_time = |tick: u64| Timestamp::from_ns(((tick + 1) * TICK_NS).cast_signed());
    let duration = Span::from_ns(TICK_NS.cast_signed());
    let readings: Readings = [0.01, 0.02, 0.03].into_iter().collect();
    let output = OutputKind::Mean;
    let ticks = first..first + batch;
    let mut messages = Vec::new();
    let message = |stream, frame: Result<Vec<u8>, codec::CodecError>| {
        (key::raw(unit, stream), frame.expect("a batch that can be written"))
    };
    if let Some(second) = ticks.clone().find(|tick| tick % TICKS_PER_S == 0) {
        let celsius = if (second / TICKS_PER_S).is_multiple_of(2) { 1.75 } else { 1.76 };
        let time = Timestamp::from_ns((second * TICK_NS).cast_signed());
        let readings = channels.iter().map(|&channel| TemperatureReading { channel, time, raw: celsius });
        let batch = TemperatureBatch { readings: readings.collect() };
        messages.push(message(RawStream::Temperature, codec::encode(&batch)));
    }
    let accels = ticks.clone().map(|sequence| AccelTick {
        sequence,
        end_time: end_time(sequence),
        duration,
        readings,
    });
    let accels = AccelBatch { output, ticks: accels.collect() };
    messages.push(message(RawStream::Accel, codec::encode(&accels)));
    let gyros = ticks.map(|sequence| GyroTick {
        sequence,
        end_time: end_time(sequence),
        duration,
        readings,
        ..GyroTick::default()
    });
    let gyros = GyroBatch { output, ticks: gyros.collect() };
    messages.push(message(RawStream::Gyro, codec::encode(&gyros)));
    messages
}
