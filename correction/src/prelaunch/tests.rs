//! The pair of equations, the stated errors, and every reason for a refusal.

use alloc::string::ToString;
use alloc::vec::Vec;

use super::*;
use crate::rest::fixture::{FORCE_M_PER_S2, RATE_RAD_PER_S, Still, calibration};
use crate::sample::OutputKind;
use crate::units::AngularRate;

fn deg_per_h(value: f64) -> f64 {
    AngularRate::from_deg_per_h(value).as_rad_per_s()
}

/// Three minutes at the equator, x to the north.
fn settings() -> PreLaunchSettings {
    PreLaunchSettings {
        duration: Span::from_s(200.0),
        place: Some(Place::new(0.0, 0.0, Some([0.0, 0.0])).unwrap()),
        ..PreLaunchSettings::default()
    }
}

/// What was asked for, of a unit whose rates are those of the place and what `still` adds.
fn run(
    settings: &PreLaunchSettings,
    mut still: Still,
    seconds: f64,
    mut change: impl FnMut(f64, &mut Observation),
) -> PreLaunch {
    let mut pre_launch = PreLaunch::new(settings, &calibration(OutputKind::Mean, 1.0, true)).unwrap();
    while still.now_s() < seconds {
        let mut seen = still.tick();
        let earth = [crate::earth::EARTH_RATE.as_rad_per_s(), 0.0, 0.0];
        for ((rate, at_rest), earth) in seen.gyros.rate.iter_mut().zip(RATE_RAD_PER_S).zip(earth) {
            *rate += earth - at_rest;
        }
        change(still.now_s(), &mut seen);
        pre_launch.observe(&seen);
    }
    pre_launch
}

fn with_modes(seed: u64) -> Still {
    let change = [deg_per_h(0.7), deg_per_h(-0.4)];
    Still { period_s: Some(50.0), change, ..Still::new(seed) }
}

#[track_caller]
fn accepted(pre_launch: &PreLaunch) -> &[GyroConstants] {
    match pre_launch.outcome() {
        Some(Outcome::Accepted(constants)) => constants,
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn refused(pre_launch: &PreLaunch) -> &[Refusal] {
    match pre_launch.outcome() {
        Some(Outcome::Refused(refusals)) => refusals,
        other => panic!("{other:?}"),
    }
}

#[test]
fn both_constants_are_found_without_noise_to_the_last_digits() {
    let still = Still { walk: [0.0; 2], ..with_modes(1) };
    let pre_launch = run(&settings(), still, 201.0, |_, _| {});
    for constants in accepted(&pre_launch) {
        assert!((constants.static_bias_change_rad_per_s - deg_per_h(0.7)).abs() < 1e-15);
        assert!((constants.magnetic_bias_change_rad_per_s.unwrap() - deg_per_h(-0.4)).abs() < 1e-15);
        assert_eq!((constants.modes.plus.ticks, constants.modes.minus.ticks), (5000, 5000));
    }
}

#[test]
fn modes_that_see_different_temperatures_and_times_are_no_average() {
    // 105 s of one mode and 95 s of the other, and a bias that grows: neither constant takes anything of it.
    let still = Still { walk: [0.0; 2], period_s: Some(105.0), ..with_modes(2) };
    let pre_launch = run(&settings(), still, 201.0, |_, _| {});
    let constants = accepted(&pre_launch)[1];
    assert!((constants.static_bias_change_rad_per_s - deg_per_h(0.7)).abs() < 1e-15);
    let [plus, minus] =
        [constants.modes.plus, constants.modes.minus].map(|m| m.mean_temperature_deg_c.unwrap());
    assert!((minus - plus - 100.0 / 300.0).abs() < 1e-6);
}

#[test]
fn an_instrument_without_modes_has_only_c0() {
    let still = Still { period_s: None, change: [deg_per_h(-0.3), 0.0], ..with_modes(3) };
    let pre_launch = run(&settings(), still, 201.0, |_, _| {});
    for constants in accepted(&pre_launch) {
        let error = constants.static_bias_change_rad_per_s - deg_per_h(-0.3);
        assert!(error.abs() < 4.0 * constants.static_bias_sigma_rad_per_s);
        assert_eq!(constants.magnetic_bias_change_rad_per_s, None);
        assert_eq!(constants.magnetic_bias_sigma_rad_per_s, None);
    }
}

#[test]
fn the_shortest_time_is_enough_where_every_tick_is_good() {
    let settings = PreLaunchSettings { duration: Span::from_s(60.0), ..settings() };
    let outcome = |spoil: bool| {
        let still = Still { tick_s: 0.01, ..Still::new(3) };
        let spoils = |now_s: f64, seen: &mut Observation| {
            if spoil && (29.995..30.005).contains(&now_s) {
                seen.gyros.flags[1] |= SensorFlags::OVERRANGE;
            }
        };
        run(&settings, still, 60.5, spoils)
    };
    let time_s = accepted(&outcome(false))[0].modes.without.time_s;
    assert!(time_s < 60.0 && 60.0 - time_s < 1e-9, "the sum falls short, and no tick does: {time_s}");
    assert!(matches!(refused(&outcome(true)), [Refusal::TooLittleTime { gyro: 1, .. }]));
}

#[test]
fn the_standard_error_is_that_of_the_walk_whatever_the_modes_and_drifts_do() {
    // 6e-7 rad/√s over 200 s: 4.2e-8 rad/s. A step of 20 °/h at each switch and a drift of 1 °/h do not change it.
    let expected = 6e-7 / f64::sqrt(200.0);
    let limits =
        PreLaunchLimits { magnetic_bias_change_rad_per_s: deg_per_h(30.0), ..PreLaunchLimits::default() };
    let settings = PreLaunchSettings { limits, ..settings() };
    let mut sum = 0.0;
    for seed in 0..20 {
        let still = Still { change: [0.0, deg_per_h(10.0)], ..with_modes(seed) };
        let drift = |now_s: f64, seen: &mut Observation| seen.gyros.rate[0] += deg_per_h(1.0) * now_s / 200.0;
        let pre_launch = run(&settings, still, 201.0, drift);
        sum += accepted(&pre_launch)[0].static_bias_sigma_rad_per_s;
    }
    let ratio = sum / 20.0 / expected;
    assert!((1.05..1.4).contains(&ratio), "an upper limit, and not far from it: {ratio}");
}

#[test]
fn counts_that_are_cut_in_two_are_in_the_standard_error() {
    // No noise but that of counts of 10″, two stretches of 100 s: √(2/6) counts over 200 s.
    let count = 4.848e-5;
    let mut settings = settings();
    // The other two gyros count the Earth as well, where it is none.
    settings.limits.static_bias_change_rad_per_s = deg_per_h(20.0);
    let mut pre_launch = PreLaunch::new(&settings, &calibration(OutputKind::Counts, count, true)).unwrap();
    let mut still = Still { period_s: Some(100.0), walk: [0.0, 3e-5], ..Still::new(4) };
    let mut angle = 0.37;
    while still.now_s() < 200.5 {
        let mut seen = still.tick();
        angle += (7.292e-5 * 0.02) / count;
        let rate = f64::floor(angle) * count / 0.02;
        angle -= f64::floor(angle);
        seen.gyros.rate = seen.gyros.bias.map(|bias| bias + rate);
        pre_launch.observe(&seen);
    }
    let constants = accepted(&pre_launch)[0];
    let expected = f64::sqrt(2.0 / 6.0) * count / 200.0;
    let ratio = constants.static_bias_sigma_rad_per_s / expected;
    assert!((0.99..1.4).contains(&ratio), "{ratio}");
    assert!(constants.static_bias_change_rad_per_s.abs() < 3.0 * constants.static_bias_sigma_rad_per_s);
}

#[test]
fn a_levelled_unit_is_calibrated_as_one_of_given_attitude() {
    let [x, y, z] = FORCE_M_PER_S2;
    let pitch = f64::atan2(x, f64::hypot(y, z)).to_degrees();
    let roll = f64::atan2(-y, -z).to_degrees();
    let given = Place::new(55.0, 20.0, Some([pitch, roll])).unwrap();
    let levelled = Place::new(55.0, 20.0, None).unwrap();
    let limits =
        PreLaunchLimits { static_bias_change_rad_per_s: deg_per_h(30.0), ..PreLaunchLimits::default() };
    let results = [given, levelled].map(|place| {
        let settings = PreLaunchSettings { place: Some(place), limits, ..settings() };
        accepted(&run(&settings, with_modes(5), 201.0, |_, _| {})).to_vec()
    });
    for (given, levelled) in results[0].iter().zip(&results[1]) {
        let change = given.static_bias_change_rad_per_s - levelled.static_bias_change_rad_per_s;
        assert!(change.abs() < deg_per_h(1e-4), "{change}");
    }
}

#[test]
fn motion_and_temperature_are_refused_at_once_and_the_rest_is_not_looked_at() {
    let nudge = |now_s: f64, seen: &mut Observation| {
        if now_s > 80.0 && now_s <= 81.0 {
            seen.angular_rate[2] += 8.7e-4;
        }
    };
    let pre_launch = run(&settings(), with_modes(6), 90.0, nudge);
    assert!(matches!(refused(&pre_launch), [Refusal::Moved(_)]));

    let clamped = |now_s: f64, seen: &mut Observation| {
        if now_s > 70.0 {
            seen.gyros.flags[1] |= SensorFlags::CLAMPED_TEMPERATURE;
        }
    };
    let pre_launch = run(&settings(), with_modes(7), 71.0, clamped);
    let [Refusal::TemperatureOutOfRange { gyro: 1, temperature_deg_c }] = refused(&pre_launch) else {
        panic!("{:?}", pre_launch.outcome());
    };
    assert!((temperature_deg_c - 20.23).abs() < 0.01);

    let restarted = |now_s: f64, seen: &mut Observation| {
        if (now_s - 50.0).abs() < 0.001 {
            seen.flags |= TickFlags::RESTART;
        }
    };
    let pre_launch = run(&settings(), with_modes(8), 201.0, restarted);
    assert_eq!(refused(&pre_launch), [Refusal::Restarted]);
}

#[test]
fn a_restart_that_the_first_tick_announces_is_none() {
    let mut first = true;
    let restarted = |_: f64, seen: &mut Observation| {
        if core::mem::take(&mut first) {
            seen.flags |= TickFlags::RESTART;
        }
    };
    accepted(&run(&settings(), with_modes(9), 201.0, restarted));
}

#[test]
fn a_stream_that_ends_is_too_short_and_before_that_there_is_no_outcome() {
    let mut pre_launch = run(&settings(), with_modes(10), 199.9, |_, _| {});
    assert_eq!(pre_launch.outcome(), None);
    let Outcome::Refused(refusals) = pre_launch.finish() else { panic!() };
    let [Refusal::TooShort { elapsed, .. }] = refusals.as_slice() else { panic!("{refusals:?}") };
    assert!((elapsed.as_s() - 199.9).abs() < 0.03);
    // A tick that comes after the end changes nothing.
    pre_launch.observe(&with_modes(10).tick());
    assert!(matches!(refused(&pre_launch), [Refusal::TooShort { .. }]));
}

#[test]
fn unbalanced_modes_and_a_mode_that_hardly_was_are_refused() {
    let still = Still { period_s: Some(150.0), ..with_modes(11) };
    let pre_launch = run(&settings(), still, 201.0, |_, _| {});
    let refusals = refused(&pre_launch);
    let too_little =
        refusals.iter().filter(|refusal| matches!(refusal, Refusal::TooLittleTime { .. })).count();
    let unbalanced = refusals.iter().filter_map(|refusal| match refusal {
        Refusal::ModesUnbalanced { imbalance, .. } => Some(*imbalance),
        _ => None,
    });
    assert_eq!((too_little, unbalanced.clone().count()), (3, 3));
    assert!(unbalanced.into_iter().all(|imbalance| (imbalance - 0.5).abs() < 0.01));

    let never = Still { period_s: Some(1e9), ..with_modes(12) };
    let pre_launch = run(&settings(), never, 201.0, |_, _| {});
    assert!(refused(&pre_launch).iter().any(|r| matches!(r, Refusal::ModesUnbalanced { .. })));
}

#[test]
fn bad_and_missing_ticks_are_counted_and_too_many_are_refused() {
    let stale = |now_s: f64, seen: &mut Observation| {
        if now_s % 10.0 < 2.0 {
            seen.gyros.flags[2] |= SensorFlags::STALE_TEMPERATURE;
        }
    };
    let pre_launch = run(&settings(), with_modes(13), 201.0, stale);
    let [Refusal::TooManyBadTicks { gyro: 2, good_share, .. }] = refused(&pre_launch) else {
        panic!("{:?}", pre_launch.outcome());
    };
    assert!((good_share - 0.8).abs() < 0.01);

    let gaps = |now_s: f64, seen: &mut Observation| {
        if now_s % 10.0 < 0.015 {
            seen.missed = 100;
        }
    };
    let pre_launch = run(&settings(), with_modes(14), 201.0, gaps);
    let shares = refused(&pre_launch).iter().filter_map(|refusal| match refusal {
        Refusal::TooManyBadTicks { good_share, .. } => Some(*good_share),
        _ => None,
    });
    let shares: Vec<_> = shares.collect();
    assert!(shares.len() == 3 && shares.iter().all(|share| (share - 0.84).abs() < 0.02), "{shares:?}");
}

#[test]
fn a_change_beyond_its_limit_names_gyro_and_constant() {
    let far = Still { change: [deg_per_h(0.1), deg_per_h(1.5)], ..with_modes(15) };
    let pre_launch = run(&settings(), far, 201.0, |_, seen| seen.gyros.rate[1] += deg_per_h(-2.0));
    let words: Vec<_> = refused(&pre_launch).iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(words.join("\n"));
}

#[test]
fn modes_that_never_stand_still_give_no_noise_and_a_unit_without_rest_no_result() {
    let fast = Still { period_s: Some(10.0), ..with_modes(16) };
    let pre_launch = run(&settings(), fast, 201.0, |_, _| {});
    assert!(matches!(refused(&pre_launch), [Refusal::NoiseNotSeen { gyro: 0 }, ..]));

    let blind = |_: f64, seen: &mut Observation| seen.flags |= TickFlags::ANGLE_INVALID;
    let pre_launch = run(&settings(), with_modes(17), 201.0, blind);
    assert_eq!(refused(&pre_launch)[0], Refusal::RestNotSeen);
}

#[test]
fn what_cannot_be_levelled_is_refused() {
    let place = Some(Place::new(55.0, 20.0, None).unwrap());
    let levelled = PreLaunchSettings { place, ..settings() };
    let without = run(&levelled, with_modes(18), 201.0, |_, seen| seen.specific_force = None);
    assert_eq!(refused(&without), [Refusal::NotLevelled { mean_force_m_per_s2: None }]);
    let light = |_: f64, seen: &mut Observation| seen.specific_force = Some([0.0, 0.0, -9.0]);
    let pre_launch = run(&levelled, with_modes(19), 201.0, light);
    assert!(matches!(refused(&pre_launch), [Refusal::NotLevelled { mean_force_m_per_s2: Some(_) }]));
}

#[test]
fn wrong_settings_are_all_named_before_anything_begins() {
    let gyros_only = calibration(OutputKind::Mean, 1.0, false);
    let mut wrong = PreLaunchSettings { duration: Span::from_s(10.0), ..PreLaunchSettings::default() };
    wrong.limits.good_share = f64::NAN;
    wrong.limits.rest.sigmas = 0.0;
    let errors = PreLaunch::new(&wrong, &gyros_only).unwrap_err();
    let words: Vec<_> = errors.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(words.join("\n"));

    let place = Some(Place::new(55.0, 0.0, None).unwrap());
    let levelled = PreLaunchSettings { place, ..PreLaunchSettings::default() };
    assert_eq!(PreLaunch::new(&levelled, &gyros_only).unwrap_err(), [PreLaunchError::NoAccelerometers]);
}

#[test]
fn progress_tells_time_ticks_and_the_errors_so_far() {
    let progress = run(&settings(), with_modes(20), 10.0, |_, _| {}).progress();
    assert!((progress.elapsed.as_s() - 10.0).abs() < 1e-9);
    assert_eq!(progress.gyros[0].standard_error_rad_per_s, None);
    let progress = run(&settings(), with_modes(20), 120.0, |_, _| {}).progress();
    let gyro = progress.gyros[2];
    assert_eq!((gyro.modes.plus.ticks, gyro.modes.minus.ticks), (3500, 2500));
    let sum = |mode: ModeTotals| mode.mean_temperature_deg_c.unwrap() * mode.time_s;
    let mean = (sum(gyro.modes.plus) + sum(gyro.modes.minus)) / 120.0;
    assert!((mean - 20.2).abs() < 1e-3);
    assert!(gyro.standard_error_rad_per_s.unwrap() > 0.0);
}
