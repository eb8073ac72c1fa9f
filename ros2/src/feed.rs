//! From messages of ROS 2 to raw ticks of one unit: numbers, times, units of measure. No clock, no session.

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::mapping::SensorUnit;
use isotherm_log::ros2::{CdrError, Imu, Temperature, Time, from_cdr};
use isotherm_log::text::timeline::{Timeline, Timing};
use thiserror::Error;

use crate::attachment::{Attachment, AttachmentError};
use crate::mapping::UnitMapping;
use crate::name::Gid;

/// Messages in a row that must contradict what came before until they are believed.
const BELIEVED_AFTER: u32 = 8;
/// Longest name of a frame, in bytes.
const LONGEST_FRAME: usize = 255;

/// Why a message was not taken.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Refusal {
    /// Nobody can say which message it is.
    #[error(transparent)]
    Attachment(#[from] AttachmentError),
    /// It does not decode.
    #[error(transparent)]
    Payload(#[from] CdrError),
    /// The name of its frame is too long.
    #[error("has a frame_id of {length} bytes, may have {LONGEST_FRAME}")]
    Frame {
        /// Its length in bytes.
        length: usize,
    },
    /// Its stamp is none.
    #[error(
        "has the stamp {sec}.{nanosec:09}, must be after 1970 with less than 10^9 ns: does its driver set header.stamp?"
    )]
    Stamp {
        /// Seconds.
        sec: i32,
        /// Nanoseconds.
        nanosec: u32,
    },
    /// Its stamp is not after the one before.
    #[error("has a stamp {back_ns} ns before that of the message before it, must be after it")]
    StampNotNewer {
        /// How far it is back.
        back_ns: i64,
    },
    /// It came before.
    #[error("has the number {sequence} again")]
    Repeated {
        /// Its number.
        sequence: i64,
    },
    /// It says that it has no angular velocity.
    #[error("says that it has no angular velocity (angular_velocity_covariance[0] is -1)")]
    NoRate,
    /// A second publisher is on the topic.
    #[error("is of a second publisher: a unit has one")]
    SecondPublisher,
    /// Readings that are to be counts are not whole.
    #[error("has readings that are not counts as in the mapping: they must be whole and fit 32 bits")]
    NotCounts,
    /// More are waiting than may.
    #[error("found {waiting} messages waiting for the service")]
    QueueFull {
        /// How many.
        waiting: usize,
    },
}

impl Refusal {
    /// Its name among the counters.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Attachment(AttachmentError::None) => "no_attachment",
            Self::Attachment(AttachmentError::Old) => "old_attachment",
            Self::Attachment(AttachmentError::Other { .. }) => "bad_attachment",
            Self::Payload(CdrError::Encapsulation(_)) => "bad_encapsulation",
            Self::Payload(_) | Self::Frame { .. } => "bad_payload",
            Self::Stamp { .. } => "bad_stamp",
            Self::StampNotNewer { .. } => "stamp_not_newer",
            Self::Repeated { .. } => "repeated",
            Self::NoRate => "no_angular_velocity",
            Self::SecondPublisher => "second_publisher",
            Self::NotCounts => "not_counts",
            Self::QueueFull { .. } => "queue_full",
        }
    }
}

/// Ticks of one Imu message.
#[derive(Debug, Clone, PartialEq)]
pub struct Ticks {
    /// They begin a run: neither number nor time goes on with what came before.
    pub restart: bool,
    /// What the gyros' readings stand for.
    pub output: OutputKind,
    /// The gyros.
    pub gyro: GyroTick,
    /// The accelerometers, where the message has them, and what they stand for.
    pub accel: Option<(OutputKind, AccelTick)>,
    /// The frame of the message.
    pub frame_id: String,
    /// Ticks that are missing before these.
    pub missing: u64,
    /// How far the stamp is from one nominal tick after the one before (ns); `None` after a gap.
    pub deviation_ns: Option<i64>,
}

/// Turns messages into ticks.
#[derive(Debug)]
pub struct Feeder {
    mapping: UnitMapping,
    timeline: Timeline,
    last: Option<Last>,
    /// The publisher of the present run has left the graph.
    gone: bool,
    /// Messages in a row of another publisher, or with a stamp in the past.
    contradicting: u32,
}

/// The message before.
#[derive(Debug, Clone, Copy)]
struct Last {
    gid: Gid,
    /// Its own number.
    sequence: i64,
    stamp: i64,
    /// Number of its tick.
    tick: u64,
}

impl Feeder {
    /// Has taken nothing yet.
    #[must_use]
    pub fn new(mapping: &UnitMapping) -> Self {
        let timeline = Timeline::new(&mapping.time.to_time());
        Self { mapping: mapping.clone(), timeline, last: None, gone: false, contradicting: 0 }
    }

    /// A publisher has left the graph: another may follow at once.
    pub fn left(&mut self, gid: &Gid) {
        self.gone |= self.last.is_some_and(|last| last.gid == *gid);
    }

    /// Takes an Imu message.
    ///
    /// # Errors
    /// [`Refusal`]; nothing has changed then, but that several in a row are believed, and that one refused for its stamp has come.
    pub fn imu(&mut self, payload: &[u8], attachment: Option<&[u8]>) -> Result<Ticks, Refusal> {
        let attachment = Attachment::parse(attachment)?;
        let Imu {
            header,
            angular_velocity,
            angular_velocity_covariance,
            linear_acceleration,
            linear_acceleration_covariance,
            ..
        } = from_cdr(payload)?;
        let stamp = stamp(header.stamp)?;
        if header.frame_id.len() > LONGEST_FRAME {
            return Err(Refusal::Frame { length: header.frame_id.len() });
        }
        if is_missing(&angular_velocity_covariance) {
            return Err(Refusal::NoRate);
        }
        let rates = <[f64; 3]>::from(angular_velocity);
        let forces = <[f64; 3]>::from(linear_acceleration);
        let gyro = self.mapping.gyro.unit;
        let accel = self.mapping.accel.map(|accel| accel.unit);
        let accel = accel.filter(|_| !is_missing(&linear_acceleration_covariance));
        if !fits(gyro, rates) || accel.is_some_and(|accel| !fits(accel, forces)) {
            return Err(Refusal::NotCounts);
        }

        let last = self.follows(&attachment, stamp)?;
        let restart = last.is_none();
        if restart {
            self.timeline = Timeline::new(&self.mapping.time.to_time());
        }
        // What was lost on the way is missing by number, what the driver never sent by time.
        let missing = last.map_or(0, |last| {
            let never_came = attachment.sequence.abs_diff(last.sequence).saturating_sub(1);
            never_came.max(self.timeline.missing(stamp))
        });
        let tick = last.map_or(0, |last| last.tick.saturating_add(1).saturating_add(missing));
        let timing = self.timeline.tick(stamp, Some(tick), None);
        let deviation_ns = last
            .filter(|_| missing == 0)
            .map(|last| stamp.saturating_sub(last.stamp).saturating_sub(self.mapping.time.tick().as_ns()));
        self.last = Some(Last { gid: attachment.gid, sequence: attachment.sequence, stamp, tick });
        (self.gone, self.contradicting) = (false, 0);
        let Timing { sequence, end_ns, duration } = timing;
        let end_time = Timestamp::from_ns(end_ns);
        let accel = accel.map(|accel| {
            let readings = readings(accel, forces, duration).collect();
            (output(accel), AccelTick { sequence, end_time, duration, readings })
        });
        let readings = readings(gyro, rates, duration).collect();
        Ok(Ticks {
            restart,
            output: output(gyro),
            gyro: GyroTick { sequence, end_time, duration, readings, ..GyroTick::default() },
            accel,
            frame_id: header.frame_id,
            missing,
            deviation_ns,
        })
    }

    /// The message that this one goes on after; `None` where it begins a run.
    fn follows(&mut self, attachment: &Attachment, stamp: i64) -> Result<Option<Last>, Refusal> {
        let Some(last) = self.last else { return Ok(None) };
        let refusal = if attachment.gid != last.gid {
            if self.gone {
                return Ok(None);
            }
            Refusal::SecondPublisher
        } else if attachment.sequence <= last.sequence {
            // One that came before says nothing of the clock.
            return Err(Refusal::Repeated { sequence: attachment.sequence });
        } else if stamp <= last.stamp {
            Refusal::StampNotNewer { back_ns: last.stamp.saturating_sub(stamp) }
        } else {
            return Ok(Some(last));
        };
        self.contradicting += 1;
        if self.contradicting >= BELIEVED_AFTER {
            return Ok(None);
        }
        if let (Refusal::StampNotNewer { .. }, Some(last)) = (&refusal, &mut self.last) {
            // It came: its number is not missing. Whether a tick is, the next stamp says.
            last.sequence = attachment.sequence;
        }
        Err(refusal)
    }

    /// Takes a Temperature message of one of the unit's topics, by its place in the mapping.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn temperature(
        &self,
        topic: usize,
        payload: &[u8],
        attachment: Option<&[u8]>,
    ) -> Result<Option<TemperatureReading>, Refusal> {
        Attachment::parse(attachment)?;
        let Temperature { header, temperature, .. } = from_cdr(payload)?;
        let time = Timestamp::from_ns(stamp(header.stamp)?);
        let mapping = self.mapping.temperatures.get(topic);
        Ok(mapping.map(|mapping| TemperatureReading {
            channel: mapping.channel,
            time,
            raw: mapping.unit.read(temperature),
        }))
    }
}

/// A stamp (ns).
fn stamp(time: Time) -> Result<i64, Refusal> {
    const SECOND: i64 = 1_000_000_000;
    let Time { sec, nanosec } = time;
    let ns = i64::from(sec) * SECOND + i64::from(nanosec);
    if sec >= 0 && i64::from(nanosec) < SECOND && ns > 0 {
        Ok(ns)
    } else {
        Err(Refusal::Stamp { sec, nanosec })
    }
}

/// Whether a covariance says that there is nothing that it would be of (REP 145).
fn is_missing(covariance: &[f64; 9]) -> bool {
    covariance.first().is_some_and(|first| first.total_cmp(&-1.0).is_eq())
}

/// What readings in a unit stand for.
fn output(unit: impl SensorUnit) -> OutputKind {
    if unit.in_si().is_none() { OutputKind::Counts } else { OutputKind::Mean }
}

/// Whether readings that the mapping says to be counts are whole numbers of 32 bits.
fn fits(unit: impl SensorUnit, readings: [f64; 3]) -> bool {
    let is_count =
        |reading: f64| reading.fract().abs().total_cmp(&0.0).is_eq() && reading.abs() <= f64::from(i32::MAX);
    output(unit) == OutputKind::Mean || readings.into_iter().all(is_count)
}

/// Readings in SI units, increments divided by the duration of their tick.
fn readings(unit: impl SensorUnit, values: [f64; 3], duration: Span) -> impl Iterator<Item = f64> {
    let in_si = unit.in_si();
    values.into_iter().map(move |value| match in_si {
        None => value,
        Some((factor, false)) => value * factor,
        Some((factor, true)) => value * factor / duration.as_s(),
    })
}

#[cfg(test)]
mod tests;
