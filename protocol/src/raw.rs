//! Raw batches: what a producer publishes for one unit.

mod batcher;
mod direct;
mod health;

use arrayvec::ArrayVec;
use isotherm_correction::sample as core;
use isotherm_correction::sample::{ChannelName, MAX_SENSORS, OutputKind};
use isotherm_correction::units::{Span, Timestamp};
use serde::{Deserialize, Serialize};

pub use batcher::{BatchError, Batcher, RawFrame};
pub use direct::{read_accel, read_gyro, read_temperatures};
pub use health::{HealthBatch, HealthReading, HealthTick, MAX_HEALTH};

use crate::codec::{CodecError, Kind, MAX_TICKS, Message, bounded};
use crate::version::{self, Versions};

/// Most temperature channels in one batch.
pub const MAX_CHANNELS: usize = 16;

/// Readings of one tick, one per sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Readings {
    /// Counts accumulated over the tick.
    Counts(ArrayVec<i32, MAX_SENSORS>),
    /// Means over the tick: rad/s for gyros; V or m/s² for accelerometers.
    Means(ArrayVec<f64, MAX_SENSORS>),
}

impl Readings {
    /// Number of sensors.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Counts(counts) => counts.len(),
            Self::Means(means) => means.len(),
        }
    }

    /// Whether there is no reading at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What the readings stand for.
    #[must_use]
    pub fn kind(&self) -> OutputKind {
        match self {
            Self::Counts(_) => OutputKind::Counts,
            Self::Means(_) => OutputKind::Mean,
        }
    }

    /// The readings as numbers; counts are exact.
    #[must_use]
    pub fn values(&self) -> core::Sensors<f64> {
        match self {
            Self::Counts(counts) => counts.iter().copied().map(f64::from).collect(),
            Self::Means(means) => means.clone(),
        }
    }

    /// From numbers; counts must be whole and fit 32 bits, or `None`.
    #[must_use]
    pub fn from_values(kind: OutputKind, values: &[f64]) -> Option<Self> {
        if values.len() > MAX_SENSORS {
            return None;
        }
        match kind {
            OutputKind::Mean => Some(Self::Means(values.iter().copied().collect())),
            OutputKind::Counts => {
                values.iter().map(|&value| whole(value)).collect::<Option<_>>().map(Self::Counts)
            }
        }
    }
}

/// A whole number that fits 32 bits.
fn whole(value: f64) -> Option<i32> {
    #[expect(clippy::cast_possible_truncation, reason = "compared with the original right after")]
    let count = value as i32;
    #[expect(clippy::float_cmp, reason = "exactness is the question")]
    let exact = f64::from(count) == value;
    exact.then_some(count)
}

/// Sign of the lasing mode or of the slow meander's phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// +1.
    Plus,
    /// −1.
    Minus,
}

impl From<core::LasingMode> for Mode {
    fn from(mode: core::LasingMode) -> Self {
        match mode {
            core::LasingMode::Plus => Self::Plus,
            core::LasingMode::Minus => Self::Minus,
        }
    }
}

impl From<Mode> for core::LasingMode {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::Plus => Self::Plus,
            Mode::Minus => Self::Minus,
        }
    }
}

/// Half-period counts of one gyro in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HalfPeriod {
    /// Counts in the positive half period of the dither.
    pub positive: i32,
    /// Counts in the negative half period of the dither.
    pub negative: i32,
}

/// One raw gyro tick; its sequence number is the batch's first plus its index.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GyroTick {
    /// End of the tick (ns on the producer's clock).
    pub end_time_ns: i64,
    /// Measured duration (ns).
    pub duration_ns: u64,
    /// One reading per gyro.
    pub readings: Readings,
    /// Lasing mode commanded at the end of the tick, where the instrument has modes.
    pub mode: Option<Mode>,
    /// A mode switch was commanded at the start of this tick.
    pub switch_command: bool,
    /// Phase of the slow meander, where the producer reports it.
    pub meander: Option<Mode>,
    /// Half-period counts, one per gyro, or none.
    pub half_periods: ArrayVec<HalfPeriod, MAX_SENSORS>,
}

/// Consecutive gyro ticks of one unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GyroBatch {
    /// Sequence number of the first tick.
    pub first_sequence: u64,
    /// Number of the producer's run, e.g. the time of its start: where it changes, neither sequence nor time
    /// continue what came before. A producer without such a number sends 0 for ever.
    pub series: u64,
    /// 1…4096 ticks, all with readings of one kind and number.
    #[serde(deserialize_with = "bounded::<_, _, MAX_TICKS>")]
    pub ticks: Vec<GyroTick>,
}

/// One raw accelerometer tick; its sequence number is the batch's first plus its index.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccelTick {
    /// End of the tick (ns on the producer's clock).
    pub end_time_ns: i64,
    /// Measured duration (ns).
    pub duration_ns: u64,
    /// One reading per accelerometer.
    pub readings: Readings,
}

/// Consecutive accelerometer ticks of one unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccelBatch {
    /// Sequence number of the first tick.
    pub first_sequence: u64,
    /// 1…4096 ticks, all with readings of one kind and number.
    #[serde(deserialize_with = "bounded::<_, _, MAX_TICKS>")]
    pub ticks: Vec<AccelTick>,
}

/// Readings of all channels of a batch at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TemperatureTick {
    /// Time of the readings (ns on the producer's clock).
    pub time_ns: i64,
    /// One raw reading per channel of the batch; NaN where a channel gave none.
    pub raw: ArrayVec<f64, MAX_CHANNELS>,
}

/// Temperature readings of one unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TemperatureBatch {
    /// Names of the channels.
    pub channels: ArrayVec<ChannelName, MAX_CHANNELS>,
    /// 1…4096 ticks.
    #[serde(deserialize_with = "bounded::<_, _, MAX_TICKS>")]
    pub ticks: Vec<TemperatureTick>,
}

/// Checks the number of ticks and that all have readings like the first.
fn check_ticks<'a>(readings: impl ExactSizeIterator<Item = &'a Readings>) -> Result<(), CodecError> {
    let count = readings.len();
    if !(1..=MAX_TICKS).contains(&count) {
        return Err(CodecError::Ticks { count });
    }
    let mut first = None;
    for (index, readings) in readings.enumerate() {
        let like = (readings.kind(), readings.len());
        if *first.get_or_insert(like) != like {
            return Err(CodecError::MixedReadings { index });
        }
    }
    Ok(())
}

impl Message for GyroBatch {
    const KIND: Kind = Kind::RawGyro;
    const VERSIONS: Versions = version::RAW_GYRO;

    fn check(&self) -> Result<(), CodecError> {
        check_ticks(self.ticks.iter().map(|tick| &tick.readings))?;
        for (index, tick) in self.ticks.iter().enumerate() {
            let (got, need) = (tick.half_periods.len(), tick.readings.len());
            if got != 0 && got != need {
                return Err(CodecError::HalfPeriods { index, got, need });
            }
        }
        Ok(())
    }
}

impl Message for AccelBatch {
    const KIND: Kind = Kind::RawAccel;
    const VERSIONS: Versions = version::RAW_ACCEL;

    fn check(&self) -> Result<(), CodecError> {
        check_ticks(self.ticks.iter().map(|tick| &tick.readings))
    }
}

impl Message for TemperatureBatch {
    const KIND: Kind = Kind::RawTemperature;
    const VERSIONS: Versions = version::RAW_TEMPERATURE;

    fn check(&self) -> Result<(), CodecError> {
        let count = self.ticks.len();
        if !(1..=MAX_TICKS).contains(&count) {
            return Err(CodecError::Ticks { count });
        }
        match self.ticks.iter().position(|tick| tick.raw.len() != self.channels.len()) {
            Some(index) => Err(CodecError::MixedReadings { index }),
            None => Ok(()),
        }
    }
}

/// A span from a wire duration; what does not fit becomes the longest span, which the core then refuses.
fn span(duration_ns: u64) -> Span {
    Span::from_ns(i64::try_from(duration_ns).unwrap_or(i64::MAX))
}

/// Wire duration of a span.
fn duration_ns(span: Span) -> u64 {
    span.as_ns().unsigned_abs()
}

impl GyroBatch {
    /// What the readings stand for; counts for an empty batch, which no decoder lets through.
    #[must_use]
    pub fn output(&self) -> OutputKind {
        self.ticks.first().map_or(OutputKind::Counts, |tick| tick.readings.kind())
    }

    /// The ticks as the core takes them.
    pub fn to_core(&self) -> impl Iterator<Item = core::GyroTick> {
        self.ticks.iter().zip(0..).map(|(tick, index)| core::GyroTick {
            sequence: self.first_sequence.saturating_add(index),
            end_time: Timestamp::from_ns(tick.end_time_ns),
            duration: span(tick.duration_ns),
            readings: tick.readings.values(),
            mode: tick.mode.map(Into::into),
            switch_command: tick.switch_command,
            meander: tick.meander.map(Into::into),
            half_periods: tick
                .half_periods
                .iter()
                .map(|half| core::HalfPeriodCounts { positive: half.positive, negative: half.negative })
                .collect(),
            series: self.series,
        })
    }

    /// A batch of consecutive ticks of one series; `None` where a reading is not a count though counts are asked for.
    #[must_use]
    pub fn from_core(kind: OutputKind, ticks: &[core::GyroTick]) -> Option<Self> {
        let wire = ticks.iter().map(|tick| {
            Some(GyroTick {
                end_time_ns: tick.end_time.as_ns(),
                duration_ns: duration_ns(tick.duration),
                readings: Readings::from_values(kind, &tick.readings)?,
                mode: tick.mode.map(Into::into),
                switch_command: tick.switch_command,
                meander: tick.meander.map(Into::into),
                half_periods: tick
                    .half_periods
                    .iter()
                    .map(|half| HalfPeriod { positive: half.positive, negative: half.negative })
                    .collect(),
            })
        });
        let first = ticks.first()?;
        Some(Self {
            first_sequence: first.sequence,
            series: first.series,
            ticks: wire.collect::<Option<_>>()?,
        })
    }
}

impl AccelBatch {
    /// What the readings stand for; counts for an empty batch, which no decoder lets through.
    #[must_use]
    pub fn output(&self) -> OutputKind {
        self.ticks.first().map_or(OutputKind::Counts, |tick| tick.readings.kind())
    }

    /// The ticks as the core takes them.
    pub fn to_core(&self) -> impl Iterator<Item = core::AccelTick> {
        self.ticks.iter().zip(0..).map(|(tick, index)| core::AccelTick {
            sequence: self.first_sequence.saturating_add(index),
            end_time: Timestamp::from_ns(tick.end_time_ns),
            duration: span(tick.duration_ns),
            readings: tick.readings.values(),
        })
    }

    /// A batch of consecutive ticks; `None` where a reading is not a count though counts are asked for.
    #[must_use]
    pub fn from_core(kind: OutputKind, ticks: &[core::AccelTick]) -> Option<Self> {
        let wire = ticks.iter().map(|tick| {
            Some(AccelTick {
                end_time_ns: tick.end_time.as_ns(),
                duration_ns: duration_ns(tick.duration),
                readings: Readings::from_values(kind, &tick.readings)?,
            })
        });
        Some(Self { first_sequence: ticks.first()?.sequence, ticks: wire.collect::<Option<_>>()? })
    }
}

impl TemperatureBatch {
    /// The readings as the core takes them, in time order per channel.
    pub fn to_core(&self) -> impl Iterator<Item = core::TemperatureReading> {
        self.ticks.iter().flat_map(|tick| {
            self.channels.iter().zip(&tick.raw).map(|(&channel, &raw)| core::TemperatureReading {
                channel,
                time: Timestamp::from_ns(tick.time_ns),
                raw,
            })
        })
    }
}
