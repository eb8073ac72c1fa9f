use alloc::vec;
use alloc::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::curve::CurveParts;

const TICK: Span = Span::from_ns(5_000_000);
const TAU_S: f64 = 0.05;
/// A thousand times a real instrument's, so that the rounding of counts does not hide the model's error.
const REST_HZ: f64 = 4e7;
const FIRST_HZ: f64 = 3.6e7;
/// 0.002 ″ per count.
const SCALE: f64 = 2e-3 * core::f64::consts::PI / 180.0 / 3600.0;

const FORMS: [ServoForm; 3] = [ServoForm::Measured, ServoForm::Modelled, ServoForm::Fitted];

fn servo(form: ServoForm) -> Servo {
    Servo::new(&ServoParts {
        form,
        time_constant_s: TAU_S,
        rest_frequency: CurveParts::PiecewiseLinear {
            knots: vec![[-40.0, REST_HZ - 60.0], [80.0, REST_HZ + 60.0]],
        },
        settle_time_constants: DEFAULT_SETTLE_TIME_CONSTANTS,
    })
    .unwrap()
}

/// A dithered counter, integrated step by step: counts of both halves of the tick that starts `start_s` after the
/// transition, with an input rate in counts per second. The dither has the sign `first` in the first of them.
fn halves(first: f64, start_s: f64, tick_s: f64, input: f64) -> [f64; 2] {
    let steps = 2000;
    let step = tick_s / 2.0 / f64::from(steps);
    [(0.0, first), (tick_s / 2.0, -first)].map(|(offset, sign)| {
        (0..steps)
            .map(|i| start_s + offset + (f64::from(i) + 0.5) * step)
            .map(|t| REST_HZ - (REST_HZ - FIRST_HZ) * libm::exp(-2.0 * t / TAU_S))
            .map(|f| (sign * f + input) * step)
            .sum()
    })
}

#[expect(clippy::cast_possible_truncation, reason = "counts of one tick are small")]
fn whole(counts: f64) -> i32 {
    libm::round(counts) as i32
}

fn tick(end_ns: i64, half_periods: Option<HalfPeriodCounts>) -> ServoTick {
    ServoTick {
        end_time: Timestamp::from_ns(end_ns),
        duration: TICK,
        temperature_deg_c: 20.0,
        scale_rad_per_count: SCALE,
        half_periods,
    }
}

/// Runs one transition of three ticks and then `ticks` good ones; gives the residual rate of each after the
/// correction and the transient itself (rad/s).
fn run(form: ServoForm, sign: f64, input: f64, ticks: i32) -> Vec<(f64, Transient)> {
    let servo = servo(form);
    let mut memory = ServoMemory::default();
    for j in 1..=3_i64 {
        memory.advance(true, Timestamp::from_ns((j - 3) * TICK.as_ns()), TICK);
    }
    (0..ticks)
        .map(|i| {
            let [positive, negative] = halves(sign, f64::from(i) * TICK.as_s(), TICK.as_s(), input);
            let counts = HalfPeriodCounts { positive: whole(positive), negative: whole(negative) };
            let tick = tick(i64::from(i + 1) * TICK.as_ns(), Some(counts));
            memory.advance(false, tick.end_time, TICK);
            let transient = memory.apparent_rate(0, &servo, &tick);
            let rate = SCALE * (positive + negative) / TICK.as_s();
            (rate - SCALE * input - transient.rate_rad_per_s(), transient)
        })
        .collect()
}

#[test]
fn the_transient_of_a_dithered_counter_is_removed() {
    // Inputs: none, small, and beyond the dither amplitude, where the negative half counts forward too. Either half first.
    for (input, sign) in
        [0.0, 1e6, -1e6, 6e7, -6e7].into_iter().flat_map(|input| [(input, 1.0), (input, -1.0)])
    {
        for form in FORMS {
            let raw = SCALE * (FIRST_HZ - REST_HZ) * TICK.as_s() / (2.0 * TAU_S);
            for (residual, transient) in run(form, sign, input, 40) {
                assert!(matches!(transient, Transient::Apparent { .. }));
                // What is left is the rounding of the counts: one count through f_i.
                let left = residual.abs() / raw.abs();
                assert!(left < 1e-4, "{form:?}, first half {sign}: {residual} of {raw} at input {input}");
            }
        }
    }
}

#[test]
fn the_half_that_comes_first_gives_the_transient_its_sign() {
    for form in FORMS {
        for ((_, positive), (_, negative)) in
            run(form, 1.0, 0.0, 40).into_iter().zip(run(form, -1.0, 0.0, 40))
        {
            let (positive, negative) = (positive.rate_rad_per_s(), negative.rate_rad_per_s());
            assert!(positive < 0.0 && (negative + positive).abs() <= 1e-12 * negative, "{form:?}");
        }
    }
}

#[test]
fn a_frequency_farther_than_half_of_its_rest_value_is_not_the_dithers() {
    for form in FORMS {
        let transient = |share: f64| {
            let mut memory = ServoMemory::default();
            memory.advance(true, Timestamp::from_ns(0), TICK);
            let half = whole(share * REST_HZ * TICK.as_s() / 2.0);
            let tick = tick(TICK.as_ns(), Some(HalfPeriodCounts { positive: half, negative: -half }));
            memory.advance(false, tick.end_time, TICK);
            memory.apparent_rate(0, &servo(form), &tick)
        };
        for share in [0.0, 0.49, 1.51, 30.0, -0.49, -1.51] {
            assert_eq!(transient(share), Transient::Unmeasured, "{form:?}: {share} of f0");
        }
        for share in [0.51, 0.9, 1.49, -0.51, -0.9, -1.49] {
            assert!(matches!(transient(share), Transient::Apparent { .. }), "{form:?}: {share} of f0");
        }
    }
}

/// Angle that the transients of a hundred switches leave behind (counts rms), of an instrument whose half-period counts are
/// whole and carry their fraction on.
fn left_behind(form: ServoForm) -> f64 {
    const COARSE_HZ: f64 = 61_307.3;
    const FINE: f64 = COARSE_HZ / REST_HZ;
    let parts = ServoParts {
        form,
        time_constant_s: TAU_S,
        rest_frequency: CurveParts::PiecewiseLinear { knots: vec![[-40.0, COARSE_HZ], [80.0, COARSE_HZ]] },
        settle_time_constants: DEFAULT_SETTLE_TIME_CONSTANTS,
    };
    let servo = Servo::new(&parts).unwrap();
    let mut memory = ServoMemory::default();
    let mut left = Vec::new();
    for switch in 0..100 {
        memory.reset();
        memory.advance(true, Timestamp::from_ns(0), TICK);
        // Any fraction to begin with, and an input that is no whole number of counts.
        let (mut fraction, mut angle) = ((0.618 * f64::from(switch)).fract(), 0.0);
        for i in 0..90 {
            let input = 4321.9;
            let exact = halves(1.0, f64::from(i) * TICK.as_s(), TICK.as_s(), input / FINE);
            let [positive, negative] = exact.map(|exact| {
                let all = exact * FINE + fraction;
                fraction = all - all.floor();
                whole(all.floor())
            });
            let counts = HalfPeriodCounts { positive, negative };
            let tick =
                ServoTick { scale_rad_per_count: 1.0, ..tick(i64::from(i + 1) * TICK.as_ns(), Some(counts)) };
            memory.advance(false, tick.end_time, TICK);
            angle -= memory.apparent_rate(0, &servo, &tick).rate_rad_per_s() * TICK.as_s();
            angle += f64::from(positive) + f64::from(negative) - input * TICK.as_s();
        }
        // What the counter holds back is no fault of the servo's.
        left.push(angle + fraction - (0.618 * f64::from(switch)).fract());
    }
    libm::sqrt(left.iter().map(|left| left * left).sum::<f64>() / 100.0)
}

#[test]
fn an_exponential_through_all_ticks_leaves_less_of_the_counts_rounding() {
    let [measured, modelled, fitted] = FORMS.map(left_behind);
    assert!(fitted < modelled / 1.5, "measured {measured}, modelled {modelled}, fitted {fitted}");
    assert!(fitted < measured / 1.25, "measured {measured}, modelled {modelled}, fitted {fitted}");
}

#[test]
fn what_the_first_ticks_took_of_a_better_known_decay_comes_back() {
    // The first tick alone is 20 % wrong; three that are right follow.
    let gain = 2.0;
    let mut decay = Decay::default();
    let shape = [1.0, 0.8, 0.64, 0.512];
    let mut taken = 0.0;
    for (i, d) in shape.into_iter().enumerate() {
        let measured = if i == 0 { 1.2 * 50.0 } else { 50.0 * d };
        taken += decay.take(d, Some(measured), gain).unwrap().1;
    }
    let norm: f64 = shape.iter().map(|d| d * d).sum();
    let amplitude = 50.0 * (norm + 0.2) / norm;
    assert!((taken - amplitude * gain * shape.iter().sum::<f64>()).abs() < 1e-10);
    // A tick without counts goes on; without any there is nothing to go on with.
    let (hz, more) = decay.take(0.4, None, gain).unwrap();
    assert!((hz - 0.4 * amplitude).abs() < 1e-12 && (more - gain * hz).abs() < 1e-10);
    assert_eq!(Decay::default().take(1.0, None, gain), None);
    assert_eq!(decay.take(f64::NAN, Some(1.0), gain), None);
}

#[test]
fn a_dither_that_is_still_rising_shows_as_a_negative_rate() {
    let (_, first) = run(ServoForm::Measured, 1.0, 0.0, 1)[0];
    let expected = SCALE * (FIRST_HZ - REST_HZ) * TICK.as_s() / (2.0 * TAU_S);
    assert!(first.rate_rad_per_s() < 0.0);
    // Mean over the first tick: e^(−Δt/τ) of the start; models §6 to first order in Δt/τ.
    let ratio = first.rate_rad_per_s() / (expected * libm::exp(-TICK.as_s() / TAU_S));
    assert!((ratio - 1.0).abs() < 0.01);
}

#[test]
fn the_correction_begins_with_the_first_good_tick_and_ends_when_settled() {
    let servo = servo(ServoForm::Measured);
    let mut memory = ServoMemory::default();
    let counts = Some(HalfPeriodCounts { positive: 100_000, negative: -100_000 });
    let at = |k: i64| tick(k * TICK.as_ns(), counts);
    memory.advance(false, at(0).end_time, TICK);
    assert_eq!(memory.apparent_rate(0, &servo, &at(0)), Transient::Settled);
    memory.advance(true, at(1).end_time, TICK);
    assert_eq!(memory.apparent_rate(0, &servo, &at(1)), Transient::Settled);
    for k in 2..200 {
        memory.advance(false, at(k).end_time, TICK);
        // 8·τ = 0.4 s = 80 ticks after the transition's end at tick 1.
        let running = matches!(memory.apparent_rate(0, &servo, &at(k)), Transient::Apparent { .. });
        assert_eq!(running, k <= 81, "tick {k}");
    }
}

#[test]
fn without_half_periods_nothing_is_subtracted_and_it_says_so() {
    let mut memory = ServoMemory::default();
    memory.advance(true, Timestamp::from_ns(0), TICK);
    let none = tick(TICK.as_ns(), None);
    memory.advance(false, none.end_time, TICK);
    for form in FORMS {
        let transient = memory.apparent_rate(0, &servo(form), &none);
        assert_eq!(transient, Transient::Unmeasured);
        assert_eq!(transient.rate_rad_per_s().to_bits(), 0.0_f64.to_bits());
    }
    // The model begins with the first tick that has counts and then goes on without.
    let counts = Some(HalfPeriodCounts { positive: 95_000, negative: -95_000 });
    let modelled = servo(ServoForm::Modelled);
    let second = tick(2 * TICK.as_ns(), counts);
    let first_rate = memory.apparent_rate(0, &modelled, &second).rate_rad_per_s();
    let third_rate = memory.apparent_rate(0, &modelled, &tick(3 * TICK.as_ns(), None));
    let decay = libm::exp(-2.0 * TICK.as_s() / TAU_S);
    assert!((third_rate.rate_rad_per_s() / first_rate - decay).abs() < 1e-12);
    // The other gyros have no f_1 yet.
    assert_eq!(memory.apparent_rate(1, &modelled, &none), Transient::Unmeasured);
}

#[test]
fn every_error_is_reported_at_once() {
    let parts = ServoParts {
        form: ServoForm::Modelled,
        time_constant_s: 0.0,
        rest_frequency: CurveParts::Spline { knots: vec![] },
        settle_time_constants: f64::NAN,
    };
    let errors = Servo::new(&parts).unwrap_err();
    let paths: Vec<_> = errors.iter().map(|defect| defect.path.as_str()).collect();
    assert_eq!(paths, ["time_constant_s", "settle_time_constants", "rest_frequency"]);
}

proptest! {
    #[test]
    fn no_input_panics_or_gives_anything_but_a_finite_rate(
        ticks in prop::collection::vec((any::<bool>(), any::<i64>(), any::<i64>(), any::<[i32; 2]>()), 0..20),
        numbers in prop::array::uniform2(prop::num::f64::ANY),
        sensor in 0..20_usize,
    ) {
        for form in FORMS {
            let servo = servo(form);
            let mut memory = ServoMemory::default();
            for (lost, end, duration, [positive, negative]) in &ticks {
                let tick = ServoTick {
                    end_time: Timestamp::from_ns(*end),
                    duration: Span::from_ns(*duration),
                    temperature_deg_c: numbers[0],
                    scale_rad_per_count: numbers[1],
                    half_periods: Some(HalfPeriodCounts { positive: *positive, negative: *negative }),
                };
                memory.advance(*lost, tick.end_time, tick.duration);
                let transient = memory.apparent_rate(sensor, &servo, &tick);
                prop_assert!(transient.rate_rad_per_s().is_finite());
            }
        }
    }
}

#[test]
fn an_input_that_accelerates_is_not_taken_for_dither() {
    // 1° at 1 Hz at its turning point: 39.5 °/s², in counts per second squared.
    let input = 39.5 * 3600.0 / 2e-3;
    let (tick_s, half_s) = (TICK.as_s(), TICK.as_s() / 2.0);
    let counts = |start_s: f64, [positive, negative]: [f64; 2]| {
        let gained = |from_s: f64| input * half_s * (from_s + half_s / 2.0);
        [positive + gained(start_s), negative + gained(start_s + half_s)]
    };
    for (form, sign) in FORMS.into_iter().flat_map(|form| [(form, 1.0), (form, -1.0)]) {
        let servo = servo(form);
        let mut memory = ServoMemory::default();
        let take = |memory: &mut ServoMemory, start_s: f64, start_ns: i64, [positive, negative]: [f64; 2]| {
            let halves = HalfPeriodCounts { positive: whole(positive), negative: whole(negative) };
            let tick = tick(start_ns + TICK.as_ns(), Some(halves));
            memory.advance(false, tick.end_time, TICK);
            let transient = memory.apparent_rate(0, &servo, &tick).rate_rad_per_s();
            SCALE * ((positive + negative) / tick_s - input * (start_s + half_s)) - transient
        };
        // The last good tick before three that carry nothing.
        let rest = counts(-4.0 * tick_s, [REST_HZ * half_s, -REST_HZ * half_s]);
        take(&mut memory, -4.0 * tick_s, -4 * TICK.as_ns(), rest);
        for j in 1..=3_i64 {
            memory.advance(true, Timestamp::from_ns((j - 3) * TICK.as_ns()), TICK);
        }
        let raw = SCALE * (FIRST_HZ - REST_HZ) * tick_s / (2.0 * TAU_S);
        for i in 0..40_i32 {
            let start_s = f64::from(i) * tick_s;
            let measured = counts(start_s, halves(sign, start_s, tick_s, 0.0));
            let residual = take(&mut memory, start_s, i64::from(i) * TICK.as_ns(), measured);
            assert!(residual.abs() < raw.abs() / 10_000.0, "{form:?}, tick {i}: {residual} of {raw}");
        }
    }
}
