//! The source: publishes raw ticks of simulated units at their times, and writes down when.

use std::time::Duration;

use isotherm_bus::presence::wait_for_subscriber;
use isotherm_protocol::key::{self, RawStream};
use serde::{Deserialize, Serialize};
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use super::frames::{Instrument, Message};
use super::{LONGEST_WAIT, Plan, Ready, hear, open, runtime, say, unit_name, wait_for_middle};
use crate::chain::{Case, Pace};
use crate::clock::{now_ns, sleep_until};
use crate::error::Error;

/// What the source reports.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sent {
    /// Messages of gyro ticks of each unit that went out behind the prelude.
    pub(crate) messages: usize,
    /// How long that took (s).
    pub(crate) seconds: f64,
    /// How far it was behind its times: in the median, 99 of 100 times, and at most (µs).
    pub(crate) late_us: [f64; 3],
}

/// Publishers of one unit.
struct Outlets {
    temperatures: Publisher<'static>,
    accel: Publisher<'static>,
    gyro: Publisher<'static>,
}

/// Publishes when it is told to.
pub(crate) fn run(plan: &Plan) -> Result<(), Error> {
    let session = open(plan)?;
    let case = &plan.case;
    let units: Vec<_> =
        (0..case.units).map(|unit| Outlets::declare(&session, unit)).collect::<Result<_, _>>()?;
    wait_for_middle(&session)?;
    let runtime = runtime()?;
    for outlets in &units {
        runtime.block_on(wait_for_subscriber(&outlets.gyro, LONGEST_WAIT))?;
    }

    let instrument = Instrument::simulate(case.rate_hz)?;
    let mut bursts = Vec::with_capacity(plan.messages);
    for index in 0..plan.messages {
        let burst = (0..case.units).map(|unit| instrument.message(case, unit, index));
        bursts.push(burst.collect::<Result<Vec<_>, _>>()?);
    }
    // The pages are there before the clock runs.
    let mut sent = vec![u64::MAX; case.units * plan.messages];
    say(&Ready::default())?;
    if hear().is_none() {
        return Ok(());
    }
    let rest = bursts.split_off(plan.prelude.min(bursts.len()));
    prelude(&units, bursts)?;
    say(&Ready::default())?;
    if hear().is_none() {
        return Ok(());
    }
    let behind = sent.get_mut(plan.prelude * case.units..).unwrap_or_default();
    let report = publish(case, &units, rest, behind)?;
    plan.save("sent.bin", &sent)?;
    say(&report)?;
    // The session stays open until everything has come through.
    while hear().is_some() {}
    Ok(())
}

/// Publishes what units appear with, one after the other: to the one in the middle a unit that appears is work, the more the more units there
/// are, and a session that is not read from for 5 s is closed.
fn prelude(units: &[Outlets], bursts: Vec<Vec<Message>>) -> Result<(), Error> {
    /// Time for a unit to appear, for each unit that there is.
    const APPEARANCE: Duration = Duration::from_micros(2);
    for (index, burst) in bursts.into_iter().enumerate() {
        for (outlets, message) in units.iter().zip(burst) {
            outlets.put(message)?;
            if index == 0 {
                std::thread::sleep(APPEARANCE.saturating_mul(u32::try_from(units.len()).unwrap_or(u32::MAX)));
            }
        }
    }
    Ok(())
}

/// Publishes everything; `sent` is by message, then by unit.
fn publish(
    case: &Case,
    units: &[Outlets],
    bursts: Vec<Vec<Message>>,
    sent: &mut [u64],
) -> Result<Sent, Error> {
    let begin = now_ns() + 1_000_000;
    let mut late = Vec::with_capacity(bursts.len());
    let mut messages = 0;
    for ((index, burst), sent) in (0_u64..).zip(bursts).zip(sent.chunks_mut(case.units.max(1))) {
        let due = begin + index * case.period_ns();
        match case.pace {
            Pace::Burst => late.push(sleep_until(due)),
            Pace::Saturated { limit_ms } if now_ns() > begin + limit_ms * 1_000_000 => break,
            Pace::Saturated { .. } => {}
        }
        for ((outlets, message), sent) in units.iter().zip(burst).zip(sent) {
            *sent = now_ns();
            outlets.put(message)?;
        }
        messages += 1;
    }
    late.sort_unstable();
    #[expect(clippy::cast_precision_loss, reason = "far below 2⁵³ ns")]
    let (seconds, late_us) = {
        let at = |share: usize| late.get((late.len() * share / 100).min(late.len().saturating_sub(1)));
        (
            (now_ns() - begin.min(now_ns())) as f64 * 1e-9,
            [50, 99, 100].map(|share| at(share).map_or(0.0, |ns| *ns as f64 * 1e-3)),
        )
    };
    Ok(Sent { messages, seconds, late_us })
}

impl Outlets {
    fn declare(session: &Session, unit: usize) -> Result<Self, Error> {
        let unit = unit_name(unit)?;
        let declare = |stream| {
            // As the project's own producers do.
            session
                .declare_publisher(key::raw(&unit, stream))
                .congestion_control(CongestionControl::Block)
                .priority(Priority::RealTime)
                .wait()
                .map_err(Error::zenoh("source"))
        };
        Ok(Self {
            temperatures: declare(RawStream::Temperature)?,
            accel: declare(RawStream::Accel)?,
            gyro: declare(RawStream::Gyro)?,
        })
    }

    fn put(&self, message: Message) -> Result<(), Error> {
        let put = |publisher: &Publisher<'static>, frame: Vec<u8>| {
            publisher.put(frame).wait().map_err(Error::zenoh("source"))
        };
        if let Some(frame) = message.temperatures {
            put(&self.temperatures, frame)?;
        }
        put(&self.accel, message.accel)?;
        put(&self.gyro, message.gyro)
    }
}
