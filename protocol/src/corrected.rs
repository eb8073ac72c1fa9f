//! Corrected batches: what a navigation computer subscribes to.

use std::collections::VecDeque;

use arrayvec::ArrayVec;
use isotherm_correction::sample::{
    self as core, ChannelName, MAX_PARITY, MAX_SENSORS, SensorFlags, TickFlags,
};
use isotherm_correction::units::{Span, Timestamp};
use serde::{Deserialize, Serialize, Serializer};

use crate::codec::{CodecError, Kind, MAX_TICKS, Message, bounded, encode_as};
use crate::raw::{MAX_CHANNELS, Mode};
use crate::version::{self, Versions};

/// Which calibration made an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
pub struct Revision {
    /// Counts the calibrations that this unit has been given; 0 is none.
    pub counter: u64,
    /// First eight bytes of the SHA-256 of the document's text; hexadecimal digits in JSON.
    #[serde(with = "crate::digest::hex")]
    pub digest: [u8; 8],
}

/// A temperature as it was applied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AppliedTemperature {
    /// Name of the channel.
    pub channel: ChannelName,
    /// Smoothed temperature (°C).
    pub temperature_deg_c: f64,
    /// Its rate (°C/s).
    pub rate_deg_c_per_s: f64,
}

/// One corrected tick in case axes; see [`core::CorrectedTick`] for the meaning of each field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorrectedTick {
    /// Sequence number of the raw gyro tick.
    pub sequence: u64,
    /// End of the tick (ns on the producer's clock).
    pub end_time_ns: i64,
    /// Measured duration (ns).
    pub duration_ns: u64,
    /// Raw ticks in this output.
    pub ticks: u16,
    /// Raw ticks missing before this one.
    pub missed: u64,
    /// Angle increments about the case axes (rad).
    pub delta_angle_rad: [f64; 3],
    /// Velocity increments along the case axes (m/s).
    pub delta_velocity_m_per_s: [f64; 3],
    /// Lasing mode.
    pub mode: Option<Mode>,
    /// Bits of [`TickFlags`].
    pub flags: u16,
    /// Bits of [`SensorFlags`], one byte per gyro.
    pub gyro_flags: ArrayVec<u8, MAX_SENSORS>,
    /// Bits of [`SensorFlags`], one byte per accelerometer.
    pub accel_flags: ArrayVec<u8, MAX_SENSORS>,
    /// Parity residuals of the gyros (rad/s).
    pub gyro_parity_rad_per_s: ArrayVec<f64, MAX_PARITY>,
    /// Parity residuals of the accelerometers (m/s²).
    pub accel_parity_m_per_s2: ArrayVec<f64, MAX_PARITY>,
}

/// Corrected ticks of one unit, all made by one calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorrectedBatch {
    /// Serial of the unit.
    pub unit: String,
    /// The calibration that made the ticks.
    pub revision: Revision,
    /// Temperatures in use at the last tick of the batch.
    pub temperatures: ArrayVec<AppliedTemperature, MAX_CHANNELS>,
    /// 1…4096 ticks in order.
    #[serde(deserialize_with = "bounded::<_, _, MAX_TICKS>")]
    pub ticks: Vec<CorrectedTick>,
}

impl Message for CorrectedBatch {
    const KIND: Kind = Kind::Corrected;
    const VERSIONS: Versions = version::CORRECTED;

    fn check(&self) -> Result<(), CodecError> {
        check_count(self.ticks.len())
    }
}

/// A [`CorrectedBatch`] whose ticks stay where they are: the same bytes, nothing copied.
#[derive(Debug, Serialize)]
pub struct CorrectedBody<'a> {
    /// Serial of the unit.
    pub unit: &'a str,
    /// The calibration that made the ticks.
    pub revision: Revision,
    /// Temperatures in use at the last tick of the batch.
    pub temperatures: ArrayVec<AppliedTemperature, MAX_CHANNELS>,
    /// The ticks.
    pub ticks: Ticks<'a>,
}

/// The first ticks of those that are ready.
#[derive(Debug)]
pub struct Ticks<'a> {
    /// All that are ready.
    pub ready: &'a VecDeque<core::CorrectedTick>,
    /// How many of them.
    pub count: usize,
}

impl CorrectedBody<'_> {
    /// Encodes it into `frame`, as [`codec::encode_into`](crate::codec::encode_into) does the batch.
    ///
    /// # Errors
    /// [`CodecError::Ticks`] outside 1…4096 ticks; [`CodecError::Length`] beyond the longest frame.
    pub fn encode_into(&self, frame: &mut Vec<u8>) -> Result<(), CodecError> {
        check_count(self.ticks.count.min(self.ticks.ready.len()))?;
        encode_as::<CorrectedBatch>(self, frame)
    }
}

/// Checks the number of ticks of a batch.
fn check_count(count: usize) -> Result<(), CodecError> {
    if (1..=MAX_TICKS).contains(&count) { Ok(()) } else { Err(CodecError::Ticks { count }) }
}

impl Serialize for Ticks<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.ready.iter().take(self.count).map(CorrectedTick::from))
    }
}

impl From<&core::CorrectedTick> for CorrectedTick {
    fn from(tick: &core::CorrectedTick) -> Self {
        Self {
            sequence: tick.sequence,
            end_time_ns: tick.end_time.as_ns(),
            duration_ns: tick.duration.as_ns().unsigned_abs(),
            ticks: tick.ticks,
            missed: tick.missed,
            delta_angle_rad: tick.delta_angle,
            delta_velocity_m_per_s: tick.delta_velocity,
            mode: tick.mode.map(Into::into),
            flags: tick.flags.bits(),
            gyro_flags: tick.gyro_flags.iter().map(SensorFlags::bits).collect(),
            accel_flags: tick.accel_flags.iter().map(SensorFlags::bits).collect(),
            gyro_parity_rad_per_s: tick.gyro_parity.clone(),
            accel_parity_m_per_s2: tick.accel_parity.clone(),
        }
    }
}

impl CorrectedTick {
    /// The tick as the core made it, under the batch's revision counter.
    #[must_use]
    pub fn to_core(&self, revision: u64) -> core::CorrectedTick {
        core::CorrectedTick {
            sequence: self.sequence,
            end_time: Timestamp::from_ns(self.end_time_ns),
            duration: Span::from_ns(i64::try_from(self.duration_ns).unwrap_or(i64::MAX)),
            ticks: self.ticks,
            missed: self.missed,
            delta_angle: self.delta_angle_rad,
            delta_velocity: self.delta_velocity_m_per_s,
            mode: self.mode.map(Into::into),
            flags: TickFlags::from_bits_retain(self.flags),
            gyro_flags: self.gyro_flags.iter().map(|&bits| SensorFlags::from_bits_retain(bits)).collect(),
            accel_flags: self.accel_flags.iter().map(|&bits| SensorFlags::from_bits_retain(bits)).collect(),
            gyro_parity: self.gyro_parity_rad_per_s.clone(),
            accel_parity: self.accel_parity_m_per_s2.clone(),
            revision,
        }
    }
}
