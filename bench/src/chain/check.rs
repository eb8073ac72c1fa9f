//! Whether what came out is right, before its speed is told.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use isotherm_bus::inquiry::pair_reports;
use isotherm_correction::sample::TickFlags;
use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick};
use isotherm_protocol::document::Document;
use isotherm_protocol::key::RawStream;
use isotherm_protocol::pair::{Role, UnitRole};
use isotherm_protocol::stream::UnitStream;

use super::python::Constants;
use super::subject::{Subject, document};
use crate::error::Error;
use crate::part::frames::{Instrument, Message};
use crate::part::head::{PLAIN_HEAD, PLAIN_TICK};
use crate::part::{Kept, Plan, Received, open, runtime, unit_name};

/// How long both services may take to say what they are.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);
/// Most units of which ticks are compared one by one.
const MOST_UNITS: usize = 100;
/// Largest difference of an increment from what the same few lines give here (rad, m/s): the order of sums is free.
const LARGEST_DIFFERENCE: f64 = 1e-15;

/// Each tick at most once and in order; the first of each unit as an offline correction of the same frames gives them.
pub(crate) fn check(plan: &Plan, received: &Received) -> Result<(), Error> {
    let wrong = |what: String| plan.subject.wrong(what);
    let Received { duplicates, disordered, strange, ticks, .. } = *received;
    if duplicates + disordered + strange > 0 || ticks == 0 {
        return Err(wrong(format!(
            "{ticks} ticks came, {duplicates} of them twice, {disordered} out of order; {strange} messages were none of the bench"
        )));
    }
    let instrument = Instrument::simulate(plan.case.rate_hz)?;
    let mut by_unit: BTreeMap<usize, Vec<Kept>> = BTreeMap::new();
    for kept in plan.load::<Vec<Kept>>("kept.bin")? {
        by_unit.entry(kept.unit).or_default().push(kept);
    }
    let every = by_unit.len().div_ceil(MOST_UNITS).max(1);
    for (unit, kept) in by_unit.into_iter().step_by(every) {
        // The first output waits for the pairing window: what is behind it belongs to it.
        let messages = (plan.keep * 2).div_ceil(plan.case.batch).min(plan.messages);
        let sent = (0..messages).map(|index| instrument.message(&plan.case, unit, index));
        let sent: Vec<Message> = sent.collect::<Result<_, _>>()?;
        match plan.subject {
            Subject::Relay | Subject::Keyed => relayed(&sent, &kept),
            Subject::Service => corrected(unit, &sent, &kept)?,
            Subject::Python => plain(&sent, &kept),
        }
        .map_err(|what| wrong(format!("unit {unit}: {what}")))?;
    }
    Ok(())
}

/// Whether the two services are a pair: one stands by for every unit, and computes the same bits.
pub(crate) fn is_pair(plan: &Plan) -> Result<(), Error> {
    let session = open(plan)?;
    let reports = runtime()?.block_on(pair_reports(&session, ANSWER_LIMIT))?;
    let all = reports.iter().flat_map(|report| &report.units);
    let follows =
        |unit: &&UnitRole| unit.role == Role::Standby && unit.ticks_compared > 0 && unit.ticks_differing == 0;
    match all.filter(follows).count() {
        count if count == plan.case.units => Ok(()),
        count => {
            let of = plan.case.units;
            Err(plan.subject.wrong(format!("{count} of {of} units are followed by the standby: {reports:?}")))
        }
    }
}

/// Every frame as it was sent.
fn relayed(sent: &[Message], kept: &[Kept]) -> Result<(), String> {
    let strange = kept.iter().find(|kept| !sent.iter().any(|message| message.gyro == kept.frame));
    strange.map_or(Ok(()), |kept| Err(format!("a frame of {} bytes was never sent", kept.frame.len())))
}

/// Every tick, to the bit.
fn corrected(unit: usize, sent: &[Message], kept: &[Kept]) -> Result<Result<(), String>, Error> {
    let expected = offline(unit, sent)?;
    Ok(kept.iter().try_for_each(|kept| {
        let batch = codec::decode::<CorrectedBatch>(&kept.frame).map_err(|error| error.to_string())?;
        batch.ticks.iter().try_for_each(|tick| match expected.get(&tick.sequence) {
            Some(expected) if *expected == without_gap(tick) => Ok(()),
            Some(expected) => Err(format!("a tick is\n{tick:?}\nand offline\n{expected:?}")),
            None => Err(format!("tick {} was never sent", tick.sequence)),
        })
    }))
}

/// The tick as it would be if nothing had been missing before it: what was lost on the way in is missing at the sink, and told there; and
/// without the number of its revision, which counts what a service was given.
fn without_gap(tick: &CorrectedTick) -> CorrectedTick {
    let gap = if tick.missed > 0 { TickFlags::GAP } else { TickFlags::empty() };
    CorrectedTick { missed: 0, flags: tick.flags - gap, revision: 0, ..tick.clone() }
}

/// What an offline correction gives, by sequence number.
pub(crate) fn offline(unit: usize, sent: &[Message]) -> Result<BTreeMap<u64, CorrectedTick>, Error> {
    let parsed = Document::parse(&document(unit, 0)?, None);
    let parsed = parsed.map_err(|problems| Error::of("document")(format!("{problems:?}")))?;
    let mut stream = UnitStream::new(unit_name(unit)?, UnitSettings::default());
    stream.install(Arc::new(parsed.calibration), [0; 8]);
    let bad = Error::of("offline correction");
    for message in sent {
        if let Some(frame) = &message.temperatures {
            stream.receive(RawStream::Temperature, frame).map_err(&bad)?;
        }
        stream.receive(RawStream::Accel, &message.accel).map_err(&bad)?;
        stream.receive(RawStream::Gyro, &message.gyro).map_err(&bad)?;
    }
    stream.flush();
    Ok(stream
        .take_ready()
        .into_iter()
        .map(|tick| (tick.sequence, CorrectedTick { revision: 0, ..tick }))
        .collect())
}

/// Every tick, by the same few lines.
fn plain(sent: &[Message], kept: &[Kept]) -> Result<(), String> {
    let expected: BTreeMap<u64, [f64; 6]> =
        sent.iter().flat_map(|message| Constants::OF_MEMS.correct(message)).collect();
    for Kept { frame, .. } in kept {
        let Some((first, ticks)) = frame.split_first_chunk::<PLAIN_HEAD>() else {
            return Err("a message has no head".to_owned());
        };
        for (sequence, tick) in (u64::from_le_bytes(*first)..).zip(ticks.chunks(PLAIN_TICK)) {
            let (numbers, _) = tick.as_chunks::<8>();
            let Some(expected) = expected.get(&sequence) else {
                return Err(format!("tick {sequence} was never sent"));
            };
            for (number, expected) in numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).zip(expected) {
                let difference = (number - expected).abs();
                if difference.is_nan() || difference > LARGEST_DIFFERENCE {
                    return Err(format!(
                        "an increment of tick {sequence} is {number:e}, must be {expected:e}"
                    ));
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use arrayvec::ArrayVec;
    use isotherm_protocol::corrected::Revision;

    use super::*;
    use crate::chain::Case;

    fn sent() -> Vec<Message> {
        let case = Case::paced(1, 1000, 2, 0.1);
        let instrument = Instrument::simulate(1000).unwrap();
        (0..100).map(|index| instrument.message(&case, 0, index).unwrap()).collect()
    }

    #[test]
    fn every_tick_of_the_bench_is_corrected_soundly() {
        use isotherm_correction::sample::SensorFlags;

        let expected = offline(0, &sent()).unwrap();
        assert_eq!(expected.len(), 200);
        for tick in expected.values() {
            let sound = |flags: &SensorFlags| flags.contains(SensorFlags::VALID);
            assert!(tick.gyro_flags.iter().chain(&tick.accel_flags).all(sound), "{tick:?}");
            assert!(
                !tick.flags.intersects(TickFlags::UNCALIBRATED | TickFlags::ACCELEROMETER_MISSING),
                "{tick:?}"
            );
            assert_eq!((tick.missed, tick.gyro_flags.len(), tick.accel_flags.len()), (0, 3, 3));
        }
    }

    #[test]
    fn what_a_user_would_write_leaves_the_temperatures_out_and_no_more() {
        let sent = sent();
        let whole = offline(0, &sent).unwrap();
        for (sequence, plain) in sent.iter().flat_map(|message| Constants::OF_MEMS.correct(message)) {
            let tick = &whole[&sequence];
            let duration_s = 1e-3;
            for axis in 0..3 {
                let rate_error = (plain[axis] - tick.delta_angle[axis]) / duration_s;
                let force_error = (plain[3 + axis] - tick.delta_velocity[axis]) / duration_s;
                // 5 °C of self-heating: 20 °/h and 6 mm/s² per axis, and 1 % would be seen.
                assert!(rate_error.abs() < 2e-4 && force_error.abs() < 0.02, "{rate_error} {force_error}");
            }
        }
    }

    #[test]
    fn what_is_wrong_is_noticed() {
        let sent = sent();
        let frame = |frame: &[u8]| [Kept { unit: 0, frame: frame.to_vec() }];
        assert!(relayed(&sent, &frame(&sent[3].gyro)).is_ok());
        assert!(relayed(&sent, &frame(&sent[3].accel)).is_err());

        let ticks: Vec<CorrectedTick> = offline(0, &sent).unwrap().into_values().take(2).collect();
        let batch = |ticks| CorrectedBatch {
            unit: "BENCH-00000".to_owned(),
            series: 0,
            revision: Revision::default(),
            temperatures: ArrayVec::default(),
            ticks,
            sigmas: Vec::new(),
        };
        let right = codec::encode(&batch(ticks.clone())).unwrap();
        assert_eq!(corrected(0, &sent, &frame(&right)).unwrap(), Ok(()));
        let mut off = ticks;
        off[1].delta_angle[2] = f64::from_bits(off[1].delta_angle[2].to_bits() + 1);
        let wrong = codec::encode(&batch(off)).unwrap();
        assert!(corrected(0, &sent, &frame(&wrong)).unwrap().is_err());

        let (sequence, increments) = Constants::OF_MEMS.correct(&sent[1])[0];
        let mut bytes = sequence.to_le_bytes().to_vec();
        bytes.extend(increments.iter().flat_map(|increment| increment.to_le_bytes()));
        assert_eq!(plain(&sent, &frame(&bytes)), Ok(()));
        let end = bytes.len() - 1;
        bytes[end] ^= 1;
        assert!(plain(&sent, &frame(&bytes)).is_err());
    }
}
