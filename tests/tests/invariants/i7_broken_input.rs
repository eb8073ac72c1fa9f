//! I7: no input, however broken, stops a unit or disturbs another; each kind has a counter and a flag.
//!
//! Here through the state machine and the frames; over real Zenoh sessions in `system/i7_broken_input_over_zenoh.rs`.

use isotherm_correction::sample::{
    AccelTick, CorrectedTick, GyroTick, SensorFlags, TemperatureReading, TickFlags,
};
use isotherm_correction::sigma::SigmaParts;
use isotherm_correction::unit::{Counters, Event, UnitSettings};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::key::{RawStream, UnitId};
use isotherm_protocol::stream::UnitStream;
use isotherm_tests::calibrations::{Feature, PutTerms, compile, identity, polynomial};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, end_of, gyro, temperature};
use proptest::prelude::*;

const RATES: [f64; 3] = [0.1, 0.2, 0.3];

/// The counter that a kind of broken input has.
type Count = fn(&Counters) -> u64;

/// Runs 100 good ticks, the broken events, then 100 good ticks; what came out and what was counted.
fn around(broken: Vec<Owned>) -> (Vec<CorrectedTick>, Counters) {
    let good = |k| [Owned::Accel(vec![accel(k, &RATES)]), Owned::Gyro(vec![gyro(k, &RATES)])];
    let mut events: Vec<Owned> = (0..100).flat_map(good).collect();
    events.extend(broken);
    events.extend((101..201).flat_map(good));
    let mut unit = drive::unit(&compile(&identity()));
    let out = drive::run(&mut unit, &events);
    (out, *unit.counters())
}

/// The unit goes on as before: all good ticks are there and right.
fn assert_goes_on(name: &str, out: &[CorrectedTick]) {
    for k in (0..100).chain(101..201) {
        let tick = out.iter().find(|tick| tick.sequence == k);
        let tick = tick.unwrap_or_else(|| panic!("{name}: tick {k} is missing"));
        for (angle, rate) in tick.delta_angle.iter().zip(RATES) {
            assert!((angle - rate * 0.005).abs() < 1e-15, "{name}: {tick:?}");
        }
    }
}

#[test]
fn i7_each_kind_of_broken_tick_is_counted_and_harmless() {
    let with = |change: &dyn Fn(&mut GyroTick)| {
        let mut tick = gyro(100, &RATES);
        change(&mut tick);
        vec![Owned::Accel(vec![accel(100, &RATES)]), Owned::Gyro(vec![tick])]
    };
    let cases: [(&str, Vec<Owned>, Count); 11] = [
        ("time going back", with(&|t| t.end_time = end_of(50)), |c| c.gyro_implausible),
        ("time in another century", with(&|t| t.end_time = Timestamp::from_ns(i64::MAX)), |c| {
            c.gyro_implausible
        }),
        ("time at the lower end", with(&|t| t.end_time = Timestamp::from_ns(i64::MIN)), |c| {
            c.gyro_implausible
        }),
        ("sequence jump", with(&|t| t.sequence = u64::MAX), |c| c.gyro_implausible),
        ("no duration", with(&|t| t.duration = Span::ZERO), |c| c.bad_duration),
        ("endless duration", with(&|t| t.duration = Span::from_ns(i64::MAX)), |c| c.bad_duration),
        ("NaN", with(&|t| t.readings[1] = f64::NAN), |c| c.not_finite_readings),
        ("infinity", with(&|t| t.readings[0] = f64::INFINITY), |c| c.not_finite_readings),
        ("at the rails", with(&|t| t.readings[2] = f64::MAX), |c| c.overrange_readings),
        ("too few sensors", with(&|t| t.readings.resize(t.readings.len() - 1)), |c| c.wrong_sensor_count),
        ("too many sensors", with(&|t| t.readings.push(0.0)), |c| c.wrong_sensor_count),
    ];
    for (name, broken, count) in cases {
        let (out, counters) = around(broken);
        assert_goes_on(name, &out);
        assert_eq!(count(&counters), 1, "{name}: {counters:?}");
        if let Some(tick) = out.iter().find(|tick| tick.sequence == 100) {
            assert!(tick.flags.contains(TickFlags::ANGLE_INVALID), "{name}: {tick:?}");
            assert!(tick.delta_angle.iter().all(|a| a.is_finite()), "{name}: {tick:?}");
            assert!(tick.gyro_flags.iter().any(|f| !f.contains(SensorFlags::VALID)), "{name}: {tick:?}");
        } else {
            let announced = out.iter().find(|tick| tick.sequence == 101).map(|tick| tick.missed);
            assert_eq!(announced, Some(1), "{name}");
        }
    }
}

#[test]
fn i7_nothing_is_known_of_the_error_of_an_invalid_velocity() {
    let mut parts = identity();
    parts.accels[0].sigma = Some(SigmaParts::default());
    let half = AccelTick { duration: Span::from_ns(2_500_000), ..accel(1, &RATES) };
    let events = [accel(0, &RATES), half].map(|tick| Owned::Accel(vec![tick]));
    let gyros = Owned::Gyro((0..2).map(|k| gyro(k, &RATES)).collect());
    let out = drive::run(&mut drive::unit(&compile(&parts)), &[&events[..], &[gyros]].concat());
    let invalid = |tick: &CorrectedTick| tick.flags.contains(TickFlags::VELOCITY_INVALID);
    let unknown = |tick: &CorrectedTick| tick.sigma.as_deref().unwrap().velocity.restoration[0].is_nan();
    assert_eq!(
        out.iter().map(|tick| [invalid(tick), unknown(tick)]).collect::<Vec<_>>(),
        [[false; 2], [true; 2]]
    );
}

#[test]
fn i7_broken_temperatures_are_held_and_flagged() {
    for (name, raw, at) in
        [("NaN", f64::NAN, 100), ("out of range", 1e9, 100), ("a century ahead", 20.0, u64::MAX / 2)]
    {
        let mut events = vec![Owned::Temperature(vec![temperature(0, 20.0)])];
        events.push(Owned::Temperature(vec![temperature(at, raw)]));
        let (out, _) = around(events);
        assert_goes_on(name, &out);
    }
    let (out, counters) = around(vec![
        Owned::Temperature(vec![temperature(0, 20.0)]),
        Owned::Temperature(vec![temperature(100, f64::NAN)]),
    ]);
    assert_eq!(counters.temperature_rejected, 1);
    assert!(out.last().unwrap().gyro_flags[0].contains(SensorFlags::STALE_TEMPERATURE));
}

#[test]
fn i7_a_broken_time_in_a_batch_does_not_hold_up_the_ticks_beside_it() {
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    for first in (0..400).step_by(10) {
        // One accelerometer tick is missing: its gyro tick waits for the window.
        let accels = (first..first + 10).filter(|k| *k != 105).map(|k| accel(k, &RATES)).collect();
        let mut gyros: Vec<_> = (first..first + 10).map(|k| gyro(k, &RATES)).collect();
        if first == 100 {
            gyros[9].end_time = Timestamp::from_ns(i64::MAX);
        }
        drive::hand(&mut unit, &Owned::Accel(accels), &mut out);
        drive::hand(&mut unit, &Owned::Gyro(gyros), &mut out);
    }
    assert_eq!(out.last().map(|tick| tick.sequence), Some(399));
    assert_eq!((unit.counters().gyro_implausible, unit.counters().accel_missing), (1, 1));
}

#[test]
fn i7_a_clock_that_steps_back_takes_no_term_back_with_it() {
    let mut parts = identity();
    parts.filter.stale_after_s = 1000.0;
    parts.gyros[0].terms.curve(Feature::One, polynomial(&[0.0, 1e-3]));
    parts.accels[0].terms.curve(Feature::One, polynomial(&[0.0, 1e-3]));
    parts.gyro_orientation.slopes_per_deg_c = vec![[0.0; 3], [0.0, 0.0, 1e-4], [0.0; 3]];
    let mut unit = drive::unit(&compile(&parts));
    let mut out = Vec::new();
    for (k, celsius) in [(0, 20.0), (2_000, 30.0)] {
        drive::hand(&mut unit, &Owned::Temperature(vec![temperature(k, celsius)]), &mut out);
    }
    // 30 °C has been reached after another ten seconds.
    for (series, k) in (4_990..5_000).map(|k| (0, k)).chain((0..10).map(|k| (1, k))) {
        if (series, k) == (1, 0) {
            unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
        }
        drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &RATES)]), &mut out);
        drive::hand(&mut unit, &Owned::Gyro(vec![GyroTick { series, ..gyro(k, &RATES) }]), &mut out);
    }
    assert_eq!(out.len(), 20);
    for tick in &out {
        let bits =
            |tick: &CorrectedTick| [tick.delta_angle, tick.delta_velocity].map(|v| v.map(f64::to_bits));
        assert_eq!(bits(tick), bits(&out[0]), "{tick:?}");
    }
}

#[test]
fn i7_a_reading_is_late_where_an_earlier_tick_of_its_run_should_have_felt_it() {
    let mut unit = drive::unit(&compile(&identity()));
    let [far, further] = [2e3, 3e3].map(Span::from_s);
    let mut late = |series, back: Span, ks: std::ops::Range<u64>, reading: u64| {
        let at = TemperatureReading { time: end_of(reading) - back, ..temperature(reading, 20.0) };
        let mut events = vec![Owned::Temperature(vec![at])];
        for k in ks {
            let end_time = end_of(k) - back;
            events.push(Owned::Accel(vec![AccelTick { end_time, ..accel(k, &RATES) }]));
            events.push(Owned::Gyro(vec![GyroTick { end_time, series, ..gyro(k, &RATES) }]));
        }
        let _ = drive::run(&mut unit, &events);
        unit.counters().temperature_late
    };
    assert_eq!(late(1, far, 0..100, 0), 0, "before the first tick, and before the epoch of the clock");
    assert_eq!(late(1, far, 100..200, 100), 0);
    assert_eq!(late(2, further, 0..100, 0), 0, "the clock went back with a restart");
    assert_eq!(late(2, further, 100..200, 50), 1);
}

#[test]
fn i7_a_channel_without_finite_limits_is_refused() {
    let mut parts = identity();
    parts.channels[0].range_deg_c = [f64::NEG_INFINITY, f64::INFINITY];
    let defects = isotherm_correction::calibration::Calibration::new(&parts).unwrap_err();
    assert_eq!(defects.len(), 2, "{defects:?}");
}

proptest! {
    #[test]
    fn i7_no_bytes_and_no_ticks_panic_or_give_a_number_that_is_none(
        frames in prop::collection::vec((0_usize..3, prop::collection::vec(any::<u8>(), 0..200)), 0..20),
        ticks in prop::collection::vec(
            (any::<u64>(), any::<i64>(), any::<i64>(), prop::collection::vec(any::<f64>(), 0..8), any::<bool>()),
            0..60,
        ),
    ) {
        let mut stream = UnitStream::new(UnitId::new("x").unwrap(), UnitSettings::default());
        stream.install(compile(&identity()), [0; 8]);
        for (i, frame) in &frames {
            prop_assert!(stream.receive(RawStream::ALL[*i], frame).is_err());
        }
        let mut unit = drive::unit(&compile(&identity()));
        let mut out = Vec::new();
        for (sequence, end, duration, readings, close) in ticks {
            // Half of the ticks near the last ones, where they are more likely to be taken.
            let tick = GyroTick {
                sequence: if close { sequence % 100 } else { sequence },
                end_time: if close { end_of(sequence % 100) } else { Timestamp::from_ns(end) },
                duration: if close { Span::from_ms(5) } else { Span::from_ns(duration) },
                readings: readings.into_iter().collect(),
                ..GyroTick::default()
            };
            drive::hand(&mut unit, &Owned::Gyro(vec![tick]), &mut out);
        }
        for tick in &out {
            prop_assert!(tick.delta_angle.iter().chain(&tick.delta_velocity).all(|x| x.is_finite()), "{:?}", tick);
        }
    }
}

#[test]
fn i7_a_stray_tick_of_another_run_does_not_stop_the_producer() {
    let in_series = |series, k| {
        let mut tick = gyro(k, &RATES);
        tick.series = series;
        [Owned::Accel(vec![accel(k, &RATES)]), Owned::Gyro(vec![tick])]
    };
    let mut events: Vec<Owned> = (0..100).flat_map(|k| in_series(1, k)).collect();
    events.extend(in_series(2, 7));
    events.extend((100..1000).flat_map(|k| in_series(1, k)));
    let mut unit = drive::unit(&compile(&identity()));
    let out = drive::run(&mut unit, &events);
    let back = out.iter().rposition(|tick| tick.flags.contains(TickFlags::RESTART)).expect("a restart");
    assert_eq!(out[back].sequence - 100, out[back].missed, "what was refused is announced");
    assert!(
        out[back..].iter().map(|tick| tick.sequence).eq(out[back].sequence..1000),
        "and the rest is there"
    );
    assert!(out[back].missed <= 256);
}
