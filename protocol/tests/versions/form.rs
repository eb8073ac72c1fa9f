//! The forms of raw and corrected batches as plain structures, which serde writes and reads: a second reader, which knows nothing
//! of the first, and the values that `docs/wire.md` shows.

use arrayvec::ArrayVec;
use isotherm_correction::sample::{
    self as core, ChannelName, LasingMode, MAX_PARITY, MAX_SENSORS, OutputKind, SensorFlags, TickFlags,
};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::Message;
use isotherm_protocol::corrected::{self, AppliedTemperature, Revision};
use isotherm_protocol::raw::{self, MAX_CHANNELS};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// A form, and what the library makes of it.
pub(super) trait Form: Serialize + DeserializeOwned + std::fmt::Debug {
    /// The library's message.
    type Message: Message + std::fmt::Debug;

    /// The same as the library has it.
    fn message(&self) -> Self::Message;

    /// Whether the library can write it: times that it has longer than the longest span it shortens, and a temperature batch
    /// without channels it only reads.
    fn is_written(&self) -> bool;
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Readings {
    Counts(ArrayVec<i32, MAX_SENSORS>),
    Means(ArrayVec<f64, MAX_SENSORS>),
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct HalfPeriod {
    pub(super) positive: i32,
    pub(super) negative: i32,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct GyroTick {
    pub(super) end_time_ns: i64,
    pub(super) duration_ns: u64,
    pub(super) readings: Readings,
    pub(super) mode: Option<LasingMode>,
    pub(super) switch_command: bool,
    pub(super) meander: Option<LasingMode>,
    pub(super) half_periods: ArrayVec<HalfPeriod, MAX_SENSORS>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct GyroBatch {
    pub(super) first_sequence: u64,
    pub(super) series: u64,
    pub(super) ticks: Vec<GyroTick>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct AccelTick {
    pub(super) end_time_ns: i64,
    pub(super) duration_ns: u64,
    pub(super) readings: Readings,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct AccelBatch {
    pub(super) first_sequence: u64,
    pub(super) ticks: Vec<AccelTick>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct TemperatureTick {
    pub(super) time_ns: i64,
    pub(super) raw: ArrayVec<f64, MAX_CHANNELS>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct TemperatureBatch {
    pub(super) channels: ArrayVec<ChannelName, MAX_CHANNELS>,
    pub(super) ticks: Vec<TemperatureTick>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct CorrectedTick {
    pub(super) sequence: u64,
    pub(super) end_time_ns: i64,
    pub(super) duration_ns: u64,
    pub(super) ticks: u16,
    pub(super) missed: u64,
    pub(super) delta_angle_rad: [f64; 3],
    pub(super) delta_velocity_m_per_s: [f64; 3],
    pub(super) mode: Option<LasingMode>,
    pub(super) flags: u16,
    pub(super) gyro_flags: ArrayVec<u8, MAX_SENSORS>,
    pub(super) accel_flags: ArrayVec<u8, MAX_SENSORS>,
    pub(super) gyro_parity_rad_per_s: ArrayVec<f64, MAX_PARITY>,
    pub(super) accel_parity_m_per_s2: ArrayVec<f64, MAX_PARITY>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct CorrectedBatch {
    pub(super) unit: String,
    pub(super) revision: Revision,
    pub(super) temperatures: ArrayVec<AppliedTemperature, MAX_CHANNELS>,
    pub(super) ticks: Vec<CorrectedTick>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Sigma {
    pub(super) from_tick: u16,
    pub(super) angle_noise_rad: [f64; 3],
    pub(super) angle_restoration_rad: [f64; 3],
    pub(super) angle_calibration_rad: [f64; 3],
    pub(super) angle_clamping_rad: [f64; 3],
    pub(super) velocity_noise_m_per_s: [f64; 3],
    pub(super) velocity_restoration_m_per_s: [f64; 3],
    pub(super) velocity_calibration_m_per_s: [f64; 3],
    pub(super) velocity_clamping_m_per_s: [f64; 3],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct CorrectedBatch2 {
    pub(super) unit: String,
    pub(super) revision: Revision,
    pub(super) temperatures: ArrayVec<AppliedTemperature, MAX_CHANNELS>,
    pub(super) ticks: Vec<CorrectedTick>,
    pub(super) sigmas: Vec<Sigma>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct CorrectedBatch3 {
    pub(super) unit: String,
    pub(super) series: u64,
    pub(super) revision: Revision,
    pub(super) temperatures: ArrayVec<AppliedTemperature, MAX_CHANNELS>,
    pub(super) ticks: Vec<CorrectedTick>,
    pub(super) sigmas: Vec<Sigma>,
}

impl Readings {
    pub(super) fn len(&self) -> usize {
        self.values().len()
    }

    fn values(&self) -> core::Sensors<f64> {
        match self {
            Self::Counts(counts) => counts.iter().copied().map(f64::from).collect(),
            Self::Means(means) => means.clone(),
        }
    }

    fn output(&self) -> OutputKind {
        match self {
            Self::Counts(_) => OutputKind::Counts,
            Self::Means(_) => OutputKind::Mean,
        }
    }
}

fn span(duration_ns: u64) -> Span {
    Span::from_ns(i64::try_from(duration_ns).unwrap_or(i64::MAX))
}

fn fits(duration_ns: u64) -> bool {
    i64::try_from(duration_ns).is_ok()
}

impl Form for GyroBatch {
    type Message = raw::GyroBatch;

    fn message(&self) -> Self::Message {
        let tick = |(tick, index): (&GyroTick, u64)| core::GyroTick {
            sequence: self.first_sequence.saturating_add(index),
            end_time: Timestamp::from_ns(tick.end_time_ns),
            duration: span(tick.duration_ns),
            readings: tick.readings.values().into(),
            mode: tick.mode,
            switch_command: tick.switch_command,
            meander: tick.meander,
            half_periods: tick
                .half_periods
                .iter()
                .map(|half| core::HalfPeriodCounts { positive: half.positive, negative: half.negative })
                .collect(),
            series: self.series,
        };
        let output = self.ticks[0].readings.output();
        raw::GyroBatch { output, ticks: self.ticks.iter().zip(0..).map(tick).collect() }
    }

    fn is_written(&self) -> bool {
        self.ticks.iter().all(|tick| fits(tick.duration_ns))
    }
}

impl Form for AccelBatch {
    type Message = raw::AccelBatch;

    fn message(&self) -> Self::Message {
        let tick = |(tick, index): (&AccelTick, u64)| core::AccelTick {
            sequence: self.first_sequence.saturating_add(index),
            end_time: Timestamp::from_ns(tick.end_time_ns),
            duration: span(tick.duration_ns),
            readings: tick.readings.values().into(),
        };
        let output = self.ticks[0].readings.output();
        raw::AccelBatch { output, ticks: self.ticks.iter().zip(0..).map(tick).collect() }
    }

    fn is_written(&self) -> bool {
        self.ticks.iter().all(|tick| fits(tick.duration_ns))
    }
}

impl Form for TemperatureBatch {
    type Message = raw::TemperatureBatch;

    fn message(&self) -> Self::Message {
        let tick = |tick: &TemperatureTick| {
            let time = Timestamp::from_ns(tick.time_ns);
            let readings = self.channels.clone().into_iter().zip(tick.raw.clone());
            readings.map(move |(channel, raw)| core::TemperatureReading { channel, time, raw })
        };
        raw::TemperatureBatch { readings: self.ticks.iter().flat_map(tick).collect() }
    }

    fn is_written(&self) -> bool {
        !self.channels.is_empty()
    }
}

impl Form for CorrectedBatch {
    type Message = corrected::CorrectedBatch;

    fn message(&self) -> Self::Message {
        let flags = |flags: &[u8]| flags.iter().copied().map(SensorFlags::from_bits_retain).collect();
        let tick = |tick: &CorrectedTick| corrected::CorrectedTick {
            sequence: tick.sequence,
            end_time: Timestamp::from_ns(tick.end_time_ns),
            duration: span(tick.duration_ns),
            ticks: tick.ticks,
            missed: tick.missed,
            delta_angle: tick.delta_angle_rad,
            delta_velocity: tick.delta_velocity_m_per_s,
            mode: tick.mode,
            flags: TickFlags::from_bits_retain(tick.flags),
            gyro_flags: flags(&tick.gyro_flags),
            accel_flags: flags(&tick.accel_flags),
            gyro_parity: tick.gyro_parity_rad_per_s.clone(),
            accel_parity: tick.accel_parity_m_per_s2.clone(),
            revision: self.revision.counter,
            series: 0,
            sigma: None,
        };
        corrected::CorrectedBatch {
            unit: self.unit.clone(),
            series: 0,
            revision: self.revision,
            temperatures: self.temperatures.clone(),
            ticks: self.ticks.iter().map(tick).collect(),
            sigmas: Vec::new(),
        }
    }

    fn is_written(&self) -> bool {
        self.ticks.iter().all(|tick| fits(tick.duration_ns))
    }
}

impl Form for CorrectedBatch2 {
    type Message = corrected::CorrectedBatch;

    fn message(&self) -> Self::Message {
        let Self { unit, revision, temperatures, ticks, .. } = self.clone();
        let mut batch = CorrectedBatch { unit, revision, temperatures, ticks }.message();
        let run = |sigma: &Sigma| corrected::SigmaRun {
            from_tick: sigma.from_tick,
            angle_noise_rad: sigma.angle_noise_rad,
            angle_restoration_rad: sigma.angle_restoration_rad,
            angle_calibration_rad: sigma.angle_calibration_rad,
            angle_clamping_rad: sigma.angle_clamping_rad,
            velocity_noise_m_per_s: sigma.velocity_noise_m_per_s,
            velocity_restoration_m_per_s: sigma.velocity_restoration_m_per_s,
            velocity_calibration_m_per_s: sigma.velocity_calibration_m_per_s,
            velocity_clamping_m_per_s: sigma.velocity_clamping_m_per_s,
        };
        batch.sigmas = self.sigmas.iter().map(run).collect();
        for (index, tick) in batch.ticks.iter_mut().enumerate() {
            let last = batch.sigmas.iter().rev().find(|run| usize::from(run.from_tick) <= index);
            tick.sigma = last.map(|run| Box::new(run.sigma()));
        }
        batch
    }

    fn is_written(&self) -> bool {
        self.ticks.iter().all(|tick| fits(tick.duration_ns))
    }
}

impl Form for CorrectedBatch3 {
    type Message = corrected::CorrectedBatch;

    fn message(&self) -> Self::Message {
        let Self { unit, series, revision, temperatures, ticks, sigmas } = self.clone();
        let mut batch = CorrectedBatch2 { unit, revision, temperatures, ticks, sigmas }.message();
        batch.series = series;
        batch.ticks.iter_mut().for_each(|tick| tick.series = series);
        batch
    }

    fn is_written(&self) -> bool {
        self.series != 0 && self.ticks.iter().all(|tick| fits(tick.duration_ns))
    }
}
