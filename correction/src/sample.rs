//! What goes into a unit and what comes out: raw ticks, temperature readings, corrected ticks and flags.

use alloc::boxed::Box;

use arrayvec::{ArrayString, ArrayVec};
use bitflags::bitflags;
use serde::{Deserialize, Serialize};

pub use crate::lanes::Readings;
use crate::sigma::Sigma;
use crate::units::{Span, Timestamp};

/// Fewest sensors of a kind that can resolve three axes.
pub const MIN_SENSORS: usize = 3;
/// Most sensors of a kind in one unit.
pub const MAX_SENSORS: usize = 8;
/// Most parity residuals of one kind of sensor: N − 3.
pub const MAX_PARITY: usize = MAX_SENSORS - MIN_SENSORS;
/// Longest name of a temperature channel, in bytes of UTF-8.
pub const MAX_CHANNEL_NAME: usize = 24;

/// One value per sensor of a kind, in the order of the calibration document.
pub type Sensors<T> = ArrayVec<T, MAX_SENSORS>;
/// Name of a temperature channel, as the producer and the calibration document spell it.
pub type ChannelName = ArrayString<MAX_CHANNEL_NAME>;

/// What a raw reading stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum OutputKind {
    /// Counts accumulated over the tick (dimensionless, whole numbers).
    Counts,
    /// Mean of a continuous output over the tick: rad/s for a gyro; V or m/s² for an accelerometer.
    Mean,
}

/// Which of the two opposite circular polarisations the laser runs on: the sign of the magnetic bias.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LasingMode {
    /// Magnetic bias enters with sign +1.
    Plus,
    /// Magnetic bias enters with sign −1.
    Minus,
}

impl LasingMode {
    /// `s_m` of models §2: +1 or −1.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Plus => 1.0,
            Self::Minus => -1.0,
        }
    }

    /// The other mode.
    #[must_use]
    pub const fn reversed(self) -> Self {
        match self {
            Self::Plus => Self::Minus,
            Self::Minus => Self::Plus,
        }
    }
}

/// Counts of one tick, split by half period of the dither, in order of time.
///
/// The names are those of an instrument whose positive half always comes first. Where the dither's effect changes sign
/// with the lasing mode, the negative half comes first in one of them: `positive` is the first half all the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct HalfPeriodCounts {
    /// Counts in the tick's first half, with the sign of rotation.
    pub positive: i32,
    /// Counts in its second half, with the sign of rotation.
    pub negative: i32,
}

/// One raw tick of all gyros of a unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct GyroTick {
    /// Producer's number of this tick, one more than the last tick's.
    pub sequence: u64,
    /// End of the tick on the producer's clock.
    pub end_time: Timestamp,
    /// Measured duration of the tick.
    pub duration: Span,
    /// One reading per gyro: counts, or mean rate (rad/s), as the batch's [`OutputKind`] says.
    pub readings: Readings,
    /// Lasing mode that is commanded at the end of the tick; `None` for an instrument without modes.
    pub mode: Option<LasingMode>,
    /// The mode switch was commanded at the start of this tick: it is tick j = 1 of models §5.
    pub switch_command: bool,
    /// Phase of the slow meander where the producer reports it, with the same signs as the mode.
    pub meander: Option<LasingMode>,
    /// Half-period counts, one per gyro, or empty where the instrument has none.
    pub half_periods: Sensors<HalfPeriodCounts>,
    /// Number of the producer's run: where it changes, neither sequence nor time continue what came before.
    pub series: u64,
}

impl GyroTick {
    /// Whether it begins where another ended, to less than half its own duration.
    pub(crate) fn follows(&self, last_end: Timestamp) -> bool {
        // Mostly to the nanosecond.
        self.end_time - self.duration == last_end || self.nearly_follows(last_end)
    }

    #[cold]
    fn nearly_follows(&self, last_end: Timestamp) -> bool {
        let (since, own) = (self.end_time.since(last_end).as_ns(), self.duration.as_ns());
        since.abs_diff(own) < self.duration.half().as_ns().unsigned_abs()
    }
}

/// One raw tick of all accelerometers of a unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AccelTick {
    /// Producer's number of this tick, one more than the last tick's.
    pub sequence: u64,
    /// End of the tick on the producer's clock.
    pub end_time: Timestamp,
    /// Measured duration of the tick.
    pub duration: Span,
    /// One reading per accelerometer: counts, or mean output, as the batch's [`OutputKind`] says.
    pub readings: Readings,
}

/// One reading of one temperature channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TemperatureReading {
    /// Name of the channel.
    pub channel: ChannelName,
    /// Time of the reading on the producer's clock.
    pub time: Timestamp,
    /// Raw reading: V, counts or °C, whatever the channel's conversion polynomial takes.
    pub raw: f64,
}

bitflags! {
    /// What is to be known of one sensor in one corrected tick.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
    #[serde(into = "u8", from = "u8")]
    pub struct SensorFlags: u8 {
        /// The sensor's reading took part in this tick's increments as it stands.
        const VALID = 1;
        /// The reading was at or beyond the sensor's stated input range.
        const OVERRANGE = 1 << 1;
        /// An argument of the sensor's thermal terms was outside its fitted range and was clamped to it.
        const CLAMPED_TEMPERATURE = 1 << 2;
        /// The temperature that the sensor follows is missing, rejected or older than its limit.
        const STALE_TEMPERATURE = 1 << 3;
        /// The reading was not a finite number; the sensor's last good rate stands in for it.
        const NOT_FINITE = 1 << 4;
        /// Excluded by the parity check: the unit goes on with the other sensors.
        const EXCLUDED = 1 << 5;
        /// The rate was outside the range of the gyro's weight over rate, which was held at its end.
        const CLAMPED_RATE = 1 << 6;
    }
}

bitflags! {
    /// What is to be known of one corrected tick as a whole.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
    #[serde(into = "u16", from = "u16")]
    pub struct TickFlags: u16 {
        /// The increments are predicted over a mode switch (models §5, step 2).
        const INTERPOLATED = 1;
        /// Ticks are missing before this one; `missed` says how many.
        const GAP = 1 << 1;
        /// No accelerometer tick arrived for this tick; the velocity increments are zero.
        const ACCELEROMETER_MISSING = 1 << 2;
        /// A temperature channel has not yet seen enough readings for its derivatives.
        const WARM_UP = 1 << 3;
        /// No calibration is installed: the first three raw readings stand unscaled in the increments.
        const UNCALIBRATED = 1 << 4;
        /// The angle of a mode switch was restored in this tick (models §5, step 4).
        const ANGLE_RESTORED = 1 << 5;
        /// A mode switch before this tick could not be bridged with readings from both sides.
        const SWITCH_UNRESOLVED = 1 << 6;
        /// Coning and sculling terms are included; otherwise the increments are plain sums.
        const CONING_SCULLING = 1 << 7;
        /// The producer restarted or its clock stepped: sequence or time starts anew at this tick.
        const RESTART = 1 << 8;
        /// The parity residuals exceed their limit.
        const PARITY_EXCEEDED = 1 << 9;
        /// Fewer than three usable gyros: the angle increments are not to be trusted.
        const ANGLE_INVALID = 1 << 10;
        /// Fewer than three usable accelerometers, or their tick lasted a quarter longer or shorter than the gyros': the velocity
        /// increments are not to be trusted.
        const VELOCITY_INVALID = 1 << 11;
        /// The modelled or measured perimeter-servo transient was subtracted.
        const SERVO_TRANSIENT = 1 << 12;
        /// A perimeter-servo transient is running, but the half-period counts that would measure it are missing.
        const SERVO_UNMEASURED = 1 << 13;
        /// The tick begins half a tick or more after the end of the one before it, or before that, and none is missing: the
        /// increments are those of its own duration.
        const TIME_STEP = 1 << 14;
    }
}

/// One corrected tick (or navigation step) in case axes.
///
/// Its form in serde is that of the wire (`docs/wire.md`), whose names say the unit of measure.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CorrectedTick {
    /// Sequence number of the raw gyro tick; of the last one where several are summed.
    pub sequence: u64,
    /// End of the tick on the producer's clock.
    #[serde(rename = "end_time_ns")]
    pub end_time: Timestamp,
    /// Measured duration; the sum where several ticks are summed.
    #[serde(rename = "duration_ns", with = "unsigned")]
    pub duration: Span,
    /// Raw ticks in this output: 1, or the length of a navigation step.
    pub ticks: u16,
    /// Raw gyro ticks that are missing before this one and were not announced before.
    pub missed: u64,
    /// Angle increments about the case axes (rad).
    #[serde(rename = "delta_angle_rad")]
    pub delta_angle: [f64; 3],
    /// Velocity increments along the case axes (m/s).
    #[serde(rename = "delta_velocity_m_per_s")]
    pub delta_velocity: [f64; 3],
    /// Lasing mode of the tick.
    pub mode: Option<LasingMode>,
    /// Flags of the tick.
    pub flags: TickFlags,
    /// Flags of each gyro.
    pub gyro_flags: Sensors<SensorFlags>,
    /// Flags of each accelerometer.
    pub accel_flags: Sensors<SensorFlags>,
    /// Parity residuals of the gyros (rad/s), N − 3 of them.
    #[serde(rename = "gyro_parity_rad_per_s")]
    pub gyro_parity: ArrayVec<f64, MAX_PARITY>,
    /// Parity residuals of the accelerometers (m/s²), N − 3 of them.
    #[serde(rename = "accel_parity_m_per_s2")]
    pub accel_parity: ArrayVec<f64, MAX_PARITY>,
    /// Counter of the calibration revision that made this tick; 0 while uncalibrated. A batch says it once for all its ticks.
    #[serde(skip)]
    pub revision: u64,
    /// Series of the raw gyro tick; a batch says it once for all its ticks.
    #[serde(skip)]
    pub series: u64,
    /// Standard errors of the increments, where the calibration asks for them. A batch says them for runs of ticks.
    #[serde(skip)]
    pub sigma: Option<Box<Sigma>>,
}

/// Bits, known or not: the flags' own form in JSON is text.
impl From<SensorFlags> for u8 {
    fn from(flags: SensorFlags) -> Self {
        flags.bits()
    }
}

impl From<u8> for SensorFlags {
    fn from(bits: u8) -> Self {
        Self::from_bits_retain(bits)
    }
}

impl From<TickFlags> for u16 {
    fn from(flags: TickFlags) -> Self {
        flags.bits()
    }
}

impl From<u16> for TickFlags {
    fn from(bits: u16) -> Self {
        Self::from_bits_retain(bits)
    }
}

/// A duration as a number that has no sign; what is beyond the longest span becomes that.
mod unsigned {
    use serde::{Deserialize, Deserializer, Serializer};

    use crate::units::Span;

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde hands it over")]
    pub(super) fn serialize<S: Serializer>(span: &Span, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u64(span.as_ns().unsigned_abs())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Span, D::Error> {
        let ns = u64::deserialize(from)?;
        Ok(Span::from_ns(i64::try_from(ns).unwrap_or(i64::MAX)))
    }
}
