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

    /// Producer's number of this tick.
    fn sequence(&self) -> u64;
    /// Number of the producer's run.
    fn series(&self) -> Option<u64>;
    /// End on the producer's clock, and measured duration.
    fn times(&self) -> (Timestamp, Span);
    /// Sets number, run and times.
    fn begin(&mut self, sequence: u64, series: u64, times: (Timestamp, Span));
    /// One reading per sensor.
    fn readings(&self) -> &Sensors<f64>;
    /// Likewise, to write to.
    fn readings_mut(&mut self) -> &mut Sensors<f64>;
    /// How many sensors have half-period counts.
    fn half_periods(&self) -> usize;
    /// Writes what stands behind the readings.
    fn write_rest(&self, to: &mut Writer<'_>);
    /// Reads what stands behind the readings.
    fn read_rest(&mut self, part: &mut Stretch<'_>) -> Option<()>;
}

impl RawTick for GyroTick {
    const KIND: Kind = Kind::RawGyro;
    const VERSIONS: Versions = version::RAW_GYRO;
    const HAS_SERIES: bool = true;

    fn sequence(&self) -> u64 {
        self.sequence
    }

    fn series(&self) -> Option<u64> {
        Some(self.series)
    }

    fn times(&self) -> (Timestamp, Span) {
        (self.end_time, self.duration)
    }

    fn begin(&mut self, sequence: u64, series: u64, times: (Timestamp, Span)) {
        (self.sequence, self.series) = (sequence, series);
        (self.end_time, self.duration) = times;
    }

    fn readings(&self) -> &Sensors<f64> {
        &self.readings
    }

    fn readings_mut(&mut self) -> &mut Sensors<f64> {
        &mut self.readings
    }

    fn half_periods(&self) -> usize {
        self.half_periods.len()
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
            *half = HalfPeriodCounts { positive: part.i32()?, negative: part.i32()? };
        }
        Some(())
    }
}

impl RawTick for AccelTick {
    const KIND: Kind = Kind::RawAccel;
    const VERSIONS: Versions = version::RAW_ACCEL;
    const HAS_SERIES: bool = false;

    fn sequence(&self) -> u64 {
        self.sequence
    }

    fn series(&self) -> Option<u64> {
        None
    }

    fn times(&self) -> (Timestamp, Span) {
        (self.end_time, self.duration)
    }

    fn begin(&mut self, sequence: u64, _: u64, times: (Timestamp, Span)) {
        self.sequence = sequence;
        (self.end_time, self.duration) = times;
    }

    fn readings(&self) -> &Sensors<f64> {
        &self.readings
    }

    fn readings_mut(&mut self) -> &mut Sensors<f64> {
        &mut self.readings
    }

    fn half_periods(&self) -> usize {
        0
    }

    fn write_rest(&self, _: &mut Writer<'_>) {}

    fn read_rest(&mut self, _: &mut Stretch<'_>) -> Option<()> {
        Some(())
    }
}
