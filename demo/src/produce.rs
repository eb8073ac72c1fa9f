//! One unit's producer: simulated ticks, at a steady pace, over a Zenoh session of its own.

use std::time::{Duration, Instant};

use isotherm_bus::{Producer, ProducerOptions, SessionOptions};
use isotherm_correction::units::Timestamp;
use isotherm_protocol::codec::MAX_TICKS;
use isotherm_simulator::{Simulation, Step};
use tokio::sync::mpsc::{Receiver, channel};

use super::fleet::Member;
use super::score::{SentBatch, SentTick, Temperatures};
use super::{CLOSE_LIMIT, DemoError};

/// Time between two batches of a unit (s of the wall clock): what a unit's electronics would put on a bus together.
const BATCH_S: f64 = 0.005;
/// Raw ticks of a unit that may be under way; reached only where the machine cannot keep the pace, which then drops.
const MAX_IN_FLIGHT: u64 = 4096;
/// Batches that are simulated ahead.
const AHEAD: usize = 16;

/// How a unit's time is laid on the wall clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pace {
    /// Event time per wall-clock time.
    pub(crate) compression: f64,
    pub(crate) batch_ticks: usize,
}

impl Pace {
    /// The pace at which the unit's whole scenario takes `seconds`.
    pub(crate) fn new(member: &Member, seconds: f64) -> Self {
        let compression = member.scenario.duration_s / seconds;
        let tick_s = Timestamp::from_ns(member.scenario.tick_ns).seconds_from(Timestamp::from_ns(0));
        Self { compression, batch_ticks: whole(BATCH_S * compression / tick_s).clamp(1, MAX_TICKS) }
    }
}

/// Publishes the whole scenario; `feed` hears of each batch before Zenoh does.
pub(crate) async fn produce(
    member: Member,
    pace: Pace,
    session: SessionOptions,
    feed: impl Fn(SentBatch) + Send,
) -> Result<(), DemoError> {
    let simulation = Simulation::new(&member.scenario)?;
    let accel_output = member.scenario.instrument.accel_output_kind();
    let session = isotherm_bus::open(&session).await?;
    let options = ProducerOptions {
        batch_ticks: pace.batch_ticks,
        max_in_flight: Some(MAX_IN_FLIGHT.max(2 * pace.batch_ticks as u64 + 256)),
        ..ProducerOptions::default()
    };
    let mut producer = Producer::declare(&session, &member.id, options).await?;

    let mut batches = simulate(simulation, pace.batch_ticks);
    let start = Instant::now();
    while let Some(steps) = batches.recv().await {
        let event_s = steps.last().map_or(0.0, |step| end_s(&member, step));
        let due = start + Duration::from_secs_f64(event_s / pace.compression);
        tokio::time::sleep_until(due.into()).await;

        feed(announce(&member, &steps));
        for step in steps {
            producer.temperatures(&step.temperatures).await?;
            if let (Some(output), Some(accel)) = (accel_output, step.accel) {
                producer.accel(output, accel).await?;
            }
            producer.gyro(member.nominal.output, step.gyro).await?;
        }
    }
    producer.flush().await?;
    producer.drain().await?;
    drop(producer);
    isotherm_bus::close(session, CLOSE_LIMIT).await?;
    Ok(())
}

/// Simulates on a thread of its own, a few batches ahead.
fn simulate(mut simulation: Simulation, batch_ticks: usize) -> Receiver<Vec<Step>> {
    let (sender, receiver) = channel(AHEAD);
    tokio::task::spawn_blocking(move || {
        loop {
            let steps: Vec<Step> = simulation.by_ref().take(batch_ticks).collect();
            // The receiver is gone where the producer has failed; its error is reported there.
            if steps.is_empty() || sender.blocking_send(steps).is_err() {
                return;
            }
        }
    });
    receiver
}

/// What the account has to know of a batch.
fn announce(member: &Member, steps: &[Step]) -> SentBatch {
    let tick = |step: &Step| {
        let duration_s = step.gyro.duration.as_s();
        SentTick {
            sequence: step.gyro.sequence,
            end_s: end_s(member, step),
            duration_s,
            raw: member.nominal.angle(&step.gyro.readings, duration_s),
            truth: step.truth.delta_angle,
            switch_command: step.gyro.switch_command,
        }
    };
    let temperatures = steps.last().map(|step| {
        let gyros = &step.truth.gyro_deg_c;
        Temperatures {
            time_s: end_s(member, step),
            chamber: step.truth.chamber_deg_c,
            gyros: gyros.iter().sum::<f64>() / count(gyros.len()),
            board: step.truth.board_deg_c,
        }
    });
    let ticks = steps.iter().map(tick).collect();
    SentBatch { at: Instant::now(), ticks, temperatures }
}

/// End of a tick after the start of the run (s).
fn end_s(member: &Member, step: &Step) -> f64 {
    step.gyro.end_time.seconds_from(Timestamp::from_ns(member.scenario.start_ns))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "ticks per batch; `as` saturates"
)]
fn whole(ticks: f64) -> usize {
    ticks.round() as usize
}

#[expect(clippy::cast_precision_loss, reason = "a handful of gyros")]
fn count(gyros: usize) -> f64 {
    gyros as f64
}
