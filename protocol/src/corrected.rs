//! Corrected batches: what a navigation computer subscribes to.

mod sigma;

use arrayvec::ArrayVec;
use isotherm_correction::sample::{ChannelName, MAX_PARITY, MAX_SENSORS};
use serde::{Deserialize, Serialize};

pub use isotherm_correction::sample::CorrectedTick;
pub use sigma::SigmaRun;
pub(crate) use sigma::{MAX_RUN, append as append_sigmas, spread};

use crate::codec::{CodecError, Kind, MAX_NUMBER, MAX_TICKS, Message, append, append_text, bounded, whole};
use crate::raw::MAX_CHANNELS;
use crate::version::{CORRECTED, Versions};

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

/// Corrected ticks of one unit, all made by one calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorrectedBatch {
    /// Serial of the unit.
    pub unit: String,
    /// The producer's run that the ticks are of; 0 where it numbers none. Each of them has it once they have been decoded.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub series: u64,
    /// The calibration that made the ticks; each of them has its counter once they have been decoded.
    pub revision: Revision,
    /// Temperatures in use at the last tick of the batch.
    pub temperatures: ArrayVec<AppliedTemperature, MAX_CHANNELS>,
    /// 1…4096 ticks in order.
    #[serde(deserialize_with = "bounded::<_, _, MAX_TICKS>")]
    pub ticks: Vec<CorrectedTick>,
    /// Standard errors of the ticks' increments, for runs of ticks; none where the calibration does not ask for them. Each tick
    /// has its own once they have been decoded.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "bounded::<_, _, MAX_TICKS>")]
    pub sigmas: Vec<SigmaRun>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde hands it over")]
fn is_zero(series: &u64) -> bool {
    *series == 0
}

/// A batch without series and standard errors, as version 1 has it.
#[derive(Deserialize)]
struct Plain {
    unit: String,
    revision: Revision,
    temperatures: ArrayVec<AppliedTemperature, MAX_CHANNELS>,
    #[serde(deserialize_with = "bounded::<_, _, MAX_TICKS>")]
    ticks: Vec<CorrectedTick>,
}

/// What version 2 has behind it.
#[derive(Deserialize)]
struct Sigmas(#[serde(deserialize_with = "bounded::<_, _, MAX_TICKS>")] Vec<SigmaRun>);

impl Plain {
    fn with(self, Sigmas(sigmas): Sigmas) -> CorrectedBatch {
        let Self { unit, revision, temperatures, ticks } = self;
        CorrectedBatch { unit, series: 0, revision, temperatures, ticks, sigmas }
    }
}

impl Message for CorrectedBatch {
    const KIND: Kind = Kind::Corrected;
    const VERSIONS: Versions = CORRECTED;

    fn check(&self) -> Result<(), CodecError> {
        let count = self.ticks.len();
        if !(1..=MAX_TICKS).contains(&count) {
            return Err(CodecError::Ticks { count });
        }
        if self.sigmas.len() > MAX_TICKS {
            return Err(CodecError::Value { field: "sigmas", must_be: "at most 4096 runs" });
        }
        Ok(())
    }

    fn version(&self) -> u8 {
        version(self.series, &self.sigmas)
    }

    fn write_body(&self, frame: &mut Vec<u8>) -> Result<(), CodecError> {
        let temperatures = self.temperatures.iter();
        let temperatures = temperatures
            .map(|applied| (&applied.channel, [applied.temperature_deg_c, applied.rate_deg_c_per_s]));
        let Self { ref unit, series, revision, ref ticks, ref sigmas, .. } = *self;
        Head { unit, series, revision, temperatures, ticks: ticks.len() }.append(frame);
        for tick in ticks {
            append_tick(frame, tick);
        }
        sigma::append(frame, series, sigmas);
        Ok(())
    }

    fn read_body(version: u8, body: &[u8]) -> Result<Self, CodecError> {
        let mut batch: Self = match version {
            PLAIN => whole::<Plain>(body)?.with(Sigmas(Vec::new())),
            WITH_SIGMAS => whole::<(Plain, Sigmas)>(body).map(|(plain, sigmas)| plain.with(sigmas))?,
            _ => whole(body)?,
        };
        if version == WITH_SIGMAS && batch.sigmas.is_empty() {
            return Err(CodecError::Malformed);
        }
        spread(&batch.sigmas, &mut batch.ticks);
        let (revision, series) = (batch.revision.counter, batch.series);
        batch.ticks.iter_mut().for_each(|tick| (tick.revision, tick.series) = (revision, series));
        batch.check()?;
        Ok(batch)
    }
}

/// Version of a batch that has neither series nor standard errors, and of one that has standard errors.
const PLAIN: u8 = 1;
const WITH_SIGMAS: u8 = 2;

/// Version of a batch of a series with these standard errors: the oldest that can say them.
pub(crate) fn version(series: u64, sigmas: &[SigmaRun]) -> u8 {
    match (series, sigmas) {
        (0, []) => PLAIN,
        (0, _) => WITH_SIGMAS,
        _ => CORRECTED.current,
    }
}

/// What stands before the ticks of a batch.
pub(crate) struct Head<'a, T> {
    pub(crate) unit: &'a str,
    pub(crate) series: u64,
    pub(crate) revision: Revision,
    /// Channel, smoothed temperature (°C), its rate (°C/s).
    pub(crate) temperatures: T,
    pub(crate) ticks: usize,
}

impl<'a, T: Iterator<Item = (&'a ChannelName, [f64; 2])> + Clone> Head<'a, T> {
    /// Appends it to a frame.
    pub(crate) fn append(self, frame: &mut Vec<u8>) {
        let Self { unit, series, revision, temperatures, ticks } = self;
        append_text(frame, unit);
        append(frame, |to| {
            if series != 0 {
                to.u64(series);
            }
            to.u64(revision.counter);
            to.bytes(revision.digest);
            to.length(temperatures.clone().count());
        });
        for (channel, state) in temperatures {
            append_text(frame, channel);
            append(frame, |to| to.f64s(&state));
        }
        append(frame, |to| to.length(ticks));
    }
}

/// Longest form of a tick, in bytes.
pub(crate) const MAX_TICK: usize =
    8 * MAX_NUMBER + 6 * size_of::<f64>() + 2 * MAX_SENSORS + 4 + 2 * MAX_PARITY * size_of::<f64>();
// It is written in one part.
const _: () = assert!(MAX_TICK <= 255);

/// Whether two ticks are the same to the bit, standard errors included, their revision's counter and their series left out; numbers that are none are what their bits are.
#[must_use]
pub fn are_same(one: &CorrectedTick, other: &CorrectedTick) -> bool {
    let bytes = |tick: &CorrectedTick| {
        let mut bytes = Vec::with_capacity(MAX_TICK);
        append_tick(&mut bytes, tick);
        sigma::append(&mut bytes, 0, &SigmaRun::of([tick]));
        bytes
    };
    bytes(one) == bytes(other)
}

/// Appends one tick: the one place where corrected ticks become bytes.
pub(crate) fn append_tick(frame: &mut Vec<u8>, tick: &CorrectedTick) {
    append(frame, |to| {
        to.u64(tick.sequence);
        to.i64(tick.end_time.as_ns());
        to.u64(tick.duration.as_ns().unsigned_abs());
        to.u64(tick.ticks.into());
        to.u64(tick.missed);
        to.f64s(&tick.delta_angle);
        to.f64s(&tick.delta_velocity);
        to.mode(tick.mode);
        to.u64(tick.flags.bits().into());
        for flags in [&tick.gyro_flags, &tick.accel_flags] {
            to.length(flags.len());
            flags.iter().for_each(|flags| to.byte(flags.bits()));
        }
        for parity in [&tick.gyro_parity, &tick.accel_parity] {
            to.length(parity.len());
            to.f64s(parity);
        }
    });
}

#[cfg(test)]
mod tests {
    use isotherm_correction::sample::{LasingMode, SensorFlags, TickFlags};
    use isotherm_correction::units::{Span, Timestamp};
    use proptest::prelude::*;

    use super::*;

    prop_compose! {
        fn tick()(
            (sequence, end_ns, duration_ns) in any::<(u64, i64, i64)>(),
            (ticks, missed, flags) in any::<(u16, u64, u16)>(),
            mode in prop_oneof![Just(None), Just(Some(LasingMode::Plus)), Just(Some(LasingMode::Minus))],
            numbers in any::<[u64; 16]>(),
            (gyros, accels, gyro_parity, accel_parity) in (0..=8_usize, 0..=8_usize, 0..=5_usize, 0..=5_usize),
        ) -> CorrectedTick {
            let numbers = numbers.map(f64::from_bits);
            let sensors = |count| (0..count).map(|index| SensorFlags::from_bits_retain(255 - index)).collect();
            CorrectedTick {
                sequence,
                end_time: Timestamp::from_ns(end_ns),
                duration: Span::from_ns(duration_ns),
                ticks,
                missed,
                delta_angle: [numbers[0], numbers[1], numbers[2]],
                delta_velocity: [numbers[3], numbers[4], numbers[5]],
                mode,
                flags: TickFlags::from_bits_retain(flags),
                gyro_flags: sensors(u8::try_from(gyros).unwrap()),
                accel_flags: sensors(u8::try_from(accels).unwrap()),
                gyro_parity: numbers[6..].iter().copied().take(gyro_parity).collect(),
                accel_parity: numbers[11..].iter().copied().take(accel_parity).collect(),
                revision: 0,
                series: 0,
                sigma: None,
            }
        }
    }

    proptest! {
        #[test]
        fn a_tick_is_written_as_postcard_writes_it(tick in tick()) {
            let mut frame = Vec::new();
            append_tick(&mut frame, &tick);
            prop_assert!(frame.len() <= MAX_TICK);
            prop_assert_eq!(frame, postcard::to_allocvec(&tick).unwrap());
        }
    }
}
