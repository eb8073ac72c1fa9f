//! What moves is seen, and named; what stands still is not disturbed.

use super::fixture::{Still, calibration};
use super::*;
use crate::sample::OutputKind;
use crate::units::Span;

/// 0.05° (rad).
const NUDGE_RAD: f64 = 8.727e-4;
/// 20 mg (m/s²).
const KNOCK: f64 = 0.196;

fn monitor() -> RestMonitor {
    RestMonitor::new(&RestLimits::default(), &calibration(OutputKind::Mean, 1.0, true))
}

/// What is known at the end of some seconds, in which `change` may alter each tick, given its end (s); the first motion,
/// if there was any.
fn watch(
    monitor: &mut RestMonitor,
    still: &mut Still,
    seconds: f64,
    mut change: impl FnMut(f64, &mut Observation),
) -> Option<Moved> {
    let end_s = still.now_s() + seconds;
    let mut moved = None;
    while still.now_s() < end_s {
        let mut observation = still.tick();
        change(still.now_s(), &mut observation);
        if let Rest::Moved(now) = monitor.observe(&observation) {
            moved.get_or_insert(now);
        }
    }
    moved
}

/// Adds to a component of the rate between two times.
fn turn(axis: usize, from_s: f64, to_s: f64, rad: f64) -> impl FnMut(f64, &mut Observation) {
    move |now_s, seen| {
        if now_s > from_s && now_s <= to_s {
            seen.angular_rate[axis] += rad / (to_s - from_s);
        }
    }
}

/// Adds to a component of the force between two times.
fn push(axis: usize, from_s: f64, to_s: f64, force: f64) -> impl FnMut(f64, &mut Observation) {
    move |now_s, seen| {
        if now_s > from_s && now_s <= to_s {
            seen.specific_force.as_mut().unwrap()[axis] += force;
        }
    }
}

#[test]
fn a_unit_at_rest_is_still_after_half_a_minute_and_stays_so() {
    for (seed, period_s) in [(1, None), (2, Some(60.0)), (3, Some(10.0))] {
        let (mut monitor, mut still) = (monitor(), Still { period_s, ..Still::new(seed) });
        assert_eq!(monitor.verdict(), Rest::Learning);
        assert_eq!(watch(&mut monitor, &mut still, 25.0, |_, _| {}), None);
        assert_eq!(monitor.verdict(), Rest::Learning);
        assert_eq!(watch(&mut monitor, &mut still, 1000.0, |_, _| {}), None);
        assert_eq!(monitor.finish(Timestamp::default()), Rest::Still);
    }
}

#[test]
fn a_magnetic_bias_that_is_not_what_the_calibration_says_is_no_motion() {
    // 20 °/h: twenty times more than a pre-launch calibration accepts.
    let mut still = Still { period_s: Some(60.0), change: [0.0, 1e-4], ..Still::new(4) };
    assert_eq!(watch(&mut monitor(), &mut still, 600.0, |_, _| {}), None);
}

#[test]
fn a_turn_is_seen_at_any_time_also_while_the_noise_is_being_learned() {
    for seed in 0..60_u32 {
        let at_s = f64::from(seed) * 1.37;
        for (length_s, noise) in [(1.0, 6e-7), (0.2, 6e-7), (1.0, 4.4e-5)] {
            let mut still = Still { period_s: Some(20.0), ..Still::new(u64::from(seed)) };
            still.walk[0] = noise;
            let moved = watch(&mut monitor(), &mut still, 200.0, turn(1, at_s, at_s + length_s, NUDGE_RAD));
            let moved = moved.unwrap_or_else(|| panic!("at {at_s} s, within {length_s} s, noise {noise}"));
            // Noise ten times that of a good gyro lets a turn that is shared by two of the first windows look like noise.
            assert!(
                moved.what == Motion::Turn || noise > 1e-5 && moved.what == Motion::RestlessTurn,
                "{moved}"
            );
            assert!(moved.axis == 1 && moved.value > moved.limit);
        }
    }
}

#[test]
fn a_turn_in_the_seconds_of_a_mode_switch_is_seen_and_the_switch_itself_is_not() {
    let switch = |now_s: f64, seen: &mut Observation| {
        // Three ticks of a prediction that is 12 counts of 2″ out, restored later.
        let age_s = now_s % 60.0;
        if now_s > 59.0 && age_s < 0.33 {
            seen.settled = false;
            seen.angular_rate[1] +=
                if age_s < 0.05 { 4e-5 / 0.02 } else { -8e-5 / 0.02 * (age_s - 0.19).signum() };
            seen.angular_rate[1] = if age_s < 0.07 { seen.angular_rate[1] } else { -1.3e-5 };
        }
    };
    let mut still = Still { period_s: Some(60.0), ..Still::new(5) };
    assert_eq!(watch(&mut monitor(), &mut still, 400.0, switch), None);
    for at_s in [60.0, 60.1, 119.95, 180.02, 359.9] {
        let mut still = Still { period_s: Some(60.0), ..Still::new(6) };
        let mut nudge = turn(1, at_s, at_s + 0.2, NUDGE_RAD);
        let both = |now_s: f64, seen: &mut Observation| {
            switch(now_s, seen);
            nudge(now_s, seen);
        };
        assert!(watch(&mut monitor(), &mut still, 400.0, both).is_some(), "{at_s}");
    }
}

#[test]
fn a_knock_and_a_shake_are_seen_at_any_time() {
    for seed in 0..40_u32 {
        let at_s = f64::from(seed) * 1.73;
        for noise in [3e-5, 1e-3] {
            let mut still = Still::new(u64::from(seed));
            still.walk[1] = noise;
            let knocked =
                watch(&mut monitor(), &mut still, 100.0, push(0, at_s, at_s + 0.2, -KNOCK)).unwrap();
            assert_eq!((knocked.what, knocked.axis), (Motion::Push, 0));

            let mut still = Still::new(u64::from(seed));
            still.walk[1] = noise;
            let mut sign = 1.0;
            let shake = |now_s: f64, seen: &mut Observation| {
                sign = -sign;
                push(2, at_s, at_s + 0.2, KNOCK * sign)(now_s, seen);
            };
            let shaken = watch(&mut monitor(), &mut still, 100.0, shake).unwrap();
            assert_eq!((shaken.what, shaken.axis), (Motion::Shake, 2));
        }
    }
}

#[test]
fn a_slow_turn_and_a_slow_tilt_are_seen() {
    // 0.05° within a minute, about an axis that no accelerometer feels.
    let moved = watch(&mut monitor(), &mut Still::new(7), 400.0, turn(2, 200.0, 260.0, NUDGE_RAD)).unwrap();
    assert_eq!((moved.what, moved.axis), (Motion::SlowTurn, 2));
    // A tilt by 0.1° within ten minutes, too slow for a gyro.
    let tilt = |now_s: f64, seen: &mut Observation| {
        seen.specific_force.as_mut().unwrap()[0] += 0.0171 * now_s / 600.0;
    };
    let moved = watch(&mut monitor(), &mut Still::new(8), 600.0, tilt).unwrap();
    assert_eq!((moved.what, moved.axis), (Motion::ForceChange, 0));
}

#[test]
fn a_slow_drift_of_the_sensors_is_no_motion() {
    // What 2 °C in ten minutes make of 4 °/h/°C and 0.12 mg/°C that nothing corrects.
    let drift = |now_s: f64, seen: &mut Observation| {
        seen.angular_rate[0] += 3.9e-5 * now_s / 600.0;
        seen.specific_force.as_mut().unwrap()[2] += 2.4e-3 * now_s / 600.0;
    };
    let mut still = Still { walk: [4.4e-5, 1e-3], ..Still::new(9) };
    assert_eq!(watch(&mut monitor(), &mut still, 600.0, drift), None);
}

#[test]
fn a_turntable_and_a_unit_in_noise_are_not_at_rest() {
    let fast = |_: f64, seen: &mut Observation| seen.angular_rate[2] += 2e-3;
    let moved = watch(&mut monitor(), &mut Still::new(10), 35.0, fast).unwrap();
    assert_eq!((moved.what, moved.axis), (Motion::Rate, 2));

    let mut restless = Still { walk: [3e-4, 3e-5], ..Still::new(11) };
    let moved = watch(&mut monitor(), &mut restless, 60.0, |_, _| {}).unwrap();
    assert_eq!(moved.what, Motion::RestlessTurn);
}

#[test]
fn counts_are_no_motion_however_coarse() {
    // Counts of 40″ and of 1 cm/s: the rate is far below one of them a second.
    let calibration = calibration(OutputKind::Counts, 2e-4, false);
    let mut monitor = RestMonitor::new(&RestLimits::default(), &calibration);
    let mut angle = [0.0_f64; 3];
    let count = |_: f64, seen: &mut Observation| {
        for (angle, rate) in angle.iter_mut().zip(&mut seen.angular_rate) {
            *angle += *rate * 0.02 / 2e-4;
            *rate = angle.floor() * 2e-4 / 0.02;
            *angle -= angle.floor();
        }
        seen.specific_force = None;
    };
    assert_eq!(watch(&mut monitor, &mut Still::new(12), 600.0, count), None);
    assert_eq!(monitor.verdict(), Rest::Still);
}

#[test]
fn after_a_motion_the_unit_is_learned_anew() {
    let (mut monitor, mut still) = (monitor(), Still::new(13));
    assert!(watch(&mut monitor, &mut still, 60.0, turn(0, 50.0, 51.0, NUDGE_RAD)).is_some());
    assert!(matches!(monitor.verdict(), Rest::Moved(_)));
    watch(&mut monitor, &mut still, 40.0, |_, _| {});
    assert_eq!(monitor.verdict(), Rest::Still);
    // A restart of the producer makes it learn too, and is no motion.
    let mut restarted = still.tick();
    restarted.flags |= TickFlags::RESTART;
    assert_eq!(monitor.observe(&restarted), Rest::Learning);
}

#[test]
fn a_nudge_in_the_last_moment_is_found_when_the_watch_ends() {
    let (mut monitor, mut still) = (monitor(), Still::new(14));
    assert_eq!(watch(&mut monitor, &mut still, 100.4, turn(0, 100.1, 100.4, NUDGE_RAD)), None);
    assert!(matches!(monitor.finish(Timestamp::default() + Span::from_ms(1)), Rest::Moved(_)));
}

#[test]
fn wrong_limits_are_named() {
    assert_eq!(RestLimits::default().validate(), []);
    let wrong =
        RestLimits { sigmas: 2.0, turn_rad: f64::NAN, push_ceiling_m_per_s: 0.0, ..RestLimits::default() };
    let names: alloc::vec::Vec<_> = wrong.validate().iter().map(|error| error.name).collect();
    assert_eq!(names, ["turn_rad", "sigmas", "push_ceiling_m_per_s"]);
}

#[test]
fn a_motion_reads_as_a_person_would_say_it() {
    let moved = |what, value, limit| Moved { what, axis: 2, value, limit, at: Timestamp::default() };
    let turned = alloc::format!("{}", moved(Motion::Turn, NUDGE_RAD, 7.3e-5));
    assert_eq!(turned, "the unit turned by 0.0500° about z, at most 0.0042° is rest");
    let pushed = alloc::format!("{}", moved(Motion::Push, 0.0392, 0.0049));
    assert_eq!(pushed, "the unit was pushed by 3.9973 mg·s along z, at most 0.4997 mg·s is rest");
}
