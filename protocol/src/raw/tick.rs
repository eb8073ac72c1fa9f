//! In what raw ticks of gyros and of accelerometers differ.

use isotherm_correction::sample::{AccelTick, GyroTick, HalfPeriodCounts, MAX_SENSORS, Sensors};
use isotherm_correction::units::{Span, Timestamp};

use super::resize;
use crate::codec::{Kind, Stretch, Writer};
use crate::version::{self, Versions};

/// A tick that a raw batch can hold: a gyro or an accelerometer tick.
pub trait RawTick: Default {
    /// Kind of the batch.
    const KIND: Kind;
    /// Versions of the batch.
    const VERSIONS: Versions;
    /// Whether the batch says the number of the producer's run.
    const HAS_SERIES: bool;

    /// What both have.
    fn parts(&self) -> Parts<'_>;
    /// Sets number, run and times; gives the readings, to be set next.
    fn begin(&mut self, sequence: u64, series: u64, times: (Timestamp, Span)) -> &mut Sensors<f64>;
    /// Writes what stands behind the readings.
    fn write_rest(&self, _: &mut Writer<'_>) {}
    /// Reads what stands behind the readings.
    fn read_rest(&mut self, _: &mut Stretch<'_>) -> Option<()> {
        Some(())
    }
}

/// What gyro and accelerometer ticks both have.
#[derive(Debug, Clone, Copy)]
pub struct Parts<'a> {
    /// Producer's number of the tick.
    pub sequence: u64,
    /// Number of the producer's run; 0 where the batch does not say it.
    pub series: u64,
    /// End on the producer's clock, and measured duration.
    pub times: (Timestamp, Span),
    /// One reading per sensor.
    pub readings: &'a Sensors<f64>,
    /// How many sensors have half-period counts.
    pub half_periods: usize,
}

impl RawTick for GyroTick {
    const KIND: Kind = Kind::RawGyro;
    const VERSIONS: Versions = version::RAW_GYRO;
    const HAS_SERIES: bool = true;

    #[inline]
    fn parts(&self) -> Parts<'_> {
        let Self { sequence, series, ref readings, .. } = *self;
        let times = (self.end_time, self.duration);
        Parts { sequence, series, times, readings, half_periods: self.half_periods.len() }
    }

    #[inline]
    fn begin(&mut self, sequence: u64, series: u64, times: (Timestamp, Span)) -> &mut Sensors<f64> {
        (self.sequence, self.series) = (sequence, series);
        (self.end_time, self.duration) = times;
        &mut self.readings
    }

    fn write_rest(&self, to: &mut Writer<'_>) {
        to.mode(self.mode);
        to.byte(self.switch_command.into());
        to.mode(self.meander);
        to.length(self.half_periods.len());
        for half in &self.half_periods {
            to.i32(half.positive);
            to.i32(half.negative);
        }
    }

    #[inline]
    fn read_rest(&mut self, part: &mut Stretch<'_>) -> Option<()> {
        self.mode = part.mode()?;
        self.switch_command = part.bool()?;
        self.meander = part.mode()?;
        resize(&mut self.half_periods, part.length(MAX_SENSORS)?);
        for half in &mut self.half_periods {
            let [positive, negative] = part.two_i32()?;
            *half = HalfPeriodCounts { positive, negative };
        }
        Some(())
    }
}

impl RawTick for AccelTick {
    const KIND: Kind = Kind::RawAccel;
    const VERSIONS: Versions = version::RAW_ACCEL;
    const HAS_SERIES: bool = false;

    #[inline]
    fn parts(&self) -> Parts<'_> {
        let Self { sequence, ref readings, .. } = *self;
        Parts { sequence, series: 0, times: (self.end_time, self.duration), readings, half_periods: 0 }
    }

    #[inline]
    fn begin(&mut self, sequence: u64, _: u64, times: (Timestamp, Span)) -> &mut Sensors<f64> {
        self.sequence = sequence;
        (self.end_time, self.duration) = times;
        &mut self.readings
    }
}
