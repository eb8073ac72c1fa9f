use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use proptest::prelude::*;

use super::*;
use crate::defect::{Defect, DefectKind};
use crate::sample::Sensors;

const ARCSEC: f64 = PI / 180.0 / 3600.0;
const TICK_NS: i64 = 5_000_000;
const TICK_S: f64 = 5e-3;
const ALL: SensorMask = SensorMask::all(MAX_SENSORS);

fn reversal(parts: ReversalParts) -> Reversal {
    Reversal::new(&parts).unwrap()
}

fn paper(transition_ticks: u8, predict_degree: u8) -> Reversal {
    let transition = Transition::Ticks(transition_ticks);
    reversal(ReversalParts { transition, predict_degree, ..ReversalParts::default() })
}

/// A stream of 5 ms ticks of one gyro whose angle over time is given; `k` is the tick that ends at k·T.
struct Bench<A: Fn(f64) -> f64> {
    angle: A,
    reversal: Reversal,
    substitution: Substitution,
    mode: LasingMode,
    missed: u64,
    /// Angle published and true angle of the published ticks (rad).
    published: f64,
    truth: f64,
    flags: Vec<TickFlags>,
}

impl<A: Fn(f64) -> f64> Bench<A> {
    fn new(reversal: Reversal, angle: A) -> Self {
        Self {
            angle,
            reversal,
            substitution: Substitution::default(),
            mode: LasingMode::Plus,
            missed: 0,
            published: 0.0,
            truth: 0.0,
            flags: Vec::new(),
        }
    }

    fn error(&self) -> f64 {
        self.published - self.truth
    }

    /// Feeds tick k; a lost tick reads NaN, which nothing may look at. Returns its flags and increment.
    fn step(&mut self, k: i32, command: bool) -> (TickFlags, f64) {
        if command {
            self.mode = self.mode.reversed();
        }
        let end = f64::from(k) * TICK_S;
        let increment = (self.angle)(end) - (self.angle)(end - TICK_S);
        let input = TickInput {
            end_time: Timestamp::from_ns(i64::from(k) * TICK_NS),
            duration: Span::from_ns(TICK_NS),
            mode: Some(self.mode),
            switch_command: command,
            missed: core::mem::take(&mut self.missed),
            restart: false,
        };
        let lost = self.substitution.is_lost(&self.reversal, &input);
        let mut increments = Sensors::new();
        increments.push(if lost { f64::NAN } else { increment });
        let flags = self.substitution.tick(&self.reversal, input, &mut increments, ALL);
        assert_eq!(lost, flags.contains(TickFlags::INTERPOLATED));
        self.published += increments[0];
        self.truth += increment;
        self.flags.push(flags);
        (flags, increments[0])
    }

    fn run(&mut self, ticks: core::ops::RangeInclusive<i32>) {
        for k in ticks {
            self.step(k, false);
        }
    }
}

/// Root mean square over the phase of a sine of 1° amplitude of the angle error (″) right after the transition
/// and after step 4.
fn rms_errors(frequency_hz: f64, n: u8, degree: u8) -> [f64; 2] {
    let phases = 72;
    let mut sums = [0.0; 2];
    for phase in 0..phases {
        let phase = TAU * f64::from(phase) / f64::from(phases);
        let angle = move |t: f64| PI / 180.0 * libm::sin(TAU * frequency_hz * t + phase);
        let mut bench = Bench::new(paper(n, degree), angle);
        bench.run(-9..=0);
        bench.step(1, true);
        bench.run(2..=i32::from(n));
        sums[0] += bench.error() * bench.error();
        bench.run(i32::from(n) + 1..=i32::from(n) + 3);
        sums[1] += bench.error() * bench.error();
    }
    sums.map(|sum| libm::sqrt(sum / f64::from(phases)) / ARCSEC)
}

fn assert_near(got: f64, expected: f64, what: &str) {
    assert!((got / expected - 1.0).abs() < 0.01, "{what}: {got} for {expected}");
}

#[test]
fn the_reference_table_is_reproduced() {
    // models.md §5: 1° amplitude, 5 ms, n = 3; rms over phase (″).
    for (frequency_hz, degrees, after) in [
        (1.0, [26.35, 1.380, 0.053], 0.000_27),
        (5.0, [642.9, 169.7, 32.68], 0.842),
        (10.0, [2381.0, 1288.0, 503.8], 25.96),
    ] {
        for (degree, expected) in (0..).zip(degrees) {
            let [during, restored] = rms_errors(frequency_hz, 3, degree);
            assert_near(during, expected, "step 2 alone");
            assert_near(restored, after, "after step 4");
        }
    }
}

#[test]
fn a_cubic_fit_through_the_default_readings_gives_the_same_sum() {
    let angle = |t: f64| libm::sin(31.0 * t + 0.3);
    let run = |fit_degree| {
        let parts = ReversalParts { fit_degree, ..ReversalParts::default() };
        let mut bench = Bench::new(reversal(parts), angle);
        bench.run(-9..=0);
        bench.step(1, true);
        bench.run(2..=6);
        bench.error()
    };
    assert!((run(2) - run(3)).abs() < 1e-14);
}

#[test]
fn shorter_transitions_leave_smaller_errors() {
    for degree in 0..=2 {
        let [three, two, one] = [3, 2, 1].map(|n| rms_errors(5.0, n, degree));
        assert!(one[0] < two[0] && two[0] < three[0]);
        assert!(one[1] < two[1] && two[1] < three[1]);
    }
    // n = 1 by hand: quadratic least squares through j = −1, 0, 2, 3 about j = 1 is
    // (−y₋₁ + 4y₀ + 4y₂ − y₃)/6.
    let angle = |t: f64| libm::sin(40.0 * t + 1.0);
    let y = |k: f64| angle(k * TICK_S) - angle((k - 1.0) * TICK_S);
    let fitted = (-y(-1.0) + 4.0 * y(0.0) + 4.0 * y(2.0) - y(3.0)) / 6.0;
    let mut bench = Bench::new(paper(1, 1), angle);
    bench.run(-9..=0);
    bench.step(1, true);
    bench.run(2..=4);
    assert!((bench.error() - (fitted - y(1.0))).abs() < 1e-14);
}

#[test]
fn the_flags_come_in_the_papers_order() {
    let mut bench = Bench::new(paper(3, 1), |t| 0.3 * t);
    bench.run(-5..=0);
    bench.step(1, true);
    bench.run(2..=8);
    let none = TickFlags::empty();
    let (during, restored) = (TickFlags::INTERPOLATED, TickFlags::ANGLE_RESTORED);
    let expected = [during, during, during, none, none, restored, none, none];
    assert_eq!(bench.flags[6..], expected);
    assert!(bench.substitution.is_settled());
}

#[test]
fn the_prediction_is_the_least_squares_line_of_the_last_four() {
    let angle = |t: f64| libm::sin(20.0 * t);
    let y = |k: i32| angle(f64::from(k) * TICK_S) - angle(f64::from(k - 1) * TICK_S);
    let mut bench = Bench::new(paper(3, 1), angle);
    bench.run(-9..=0);
    let mean = (y(-3) + y(-2) + y(-1) + y(0)) / 4.0;
    let slope = (-1.5 * y(-3) - 0.5 * y(-2) + 0.5 * y(-1) + 1.5 * y(0)) / 5.0;
    for j in 1..=3 {
        let (_, increment) = bench.step(j, j == 1);
        assert!((increment - (mean + slope * (f64::from(j) + 1.5))).abs() < 1e-15);
    }
}

#[test]
fn a_change_of_mode_without_a_command_begins_a_transition() {
    let mut bench = Bench::new(paper(3, 1), |t| t);
    bench.run(-5..=0);
    bench.mode = bench.mode.reversed();
    bench.run(1..=7);
    let lost = bench.flags.iter().filter(|f| f.contains(TickFlags::INTERPOLATED)).count();
    assert_eq!(lost, 3);
    assert!(bench.flags[11].contains(TickFlags::ANGLE_RESTORED));
}

#[test]
fn a_command_lost_in_a_gap_counts_the_whole_transition_from_there() {
    let mut bench = Bench::new(paper(3, 1), libm::sin);
    bench.run(-9..=0);
    bench.mode = bench.mode.reversed();
    bench.missed = 4;
    bench.run(5..=12);
    let lost = bench.flags.iter().filter(|f| f.contains(TickFlags::INTERPOLATED)).count();
    assert_eq!(lost, 3);
    assert!(bench.flags[10].contains(TickFlags::INTERPOLATED));
    assert!(bench.error().abs() < 1e-7);
    assert!(bench.substitution.is_settled());
}

#[test]
fn ticks_missing_inside_the_transition_count_as_ticks_of_it() {
    // The angle of the missing tick is announced as a gap: only ticks 1 and 3 are restored.
    let angle = |t: f64| 0.2 * t + 3.0 * t * t - 40.0 * t * t * t;
    let mut bench = Bench::new(paper(3, 1), angle);
    bench.run(-9..=0);
    bench.step(1, true);
    bench.missed = 1;
    assert!(bench.step(3, false).0.contains(TickFlags::INTERPOLATED));
    assert!(bench.error().abs() > 1e-6);
    bench.run(4..=5);
    assert!(bench.step(6, false).0.contains(TickFlags::ANGLE_RESTORED));
    assert!(bench.error().abs() < 1e-15);

    // The gap reaches past the end of the transition.
    let mut bench = Bench::new(paper(3, 1), angle);
    bench.run(-9..=0);
    bench.step(1, true);
    bench.missed = 3;
    assert_eq!(bench.step(5, false).0, TickFlags::empty());
    bench.run(6..=7);
    assert!(bench.flags[13].contains(TickFlags::ANGLE_RESTORED));
    assert!(bench.error().abs() < 1e-15);
}

#[test]
fn gaps_beside_the_transition_do_not_shift_the_fit() {
    let angle = |t: f64| 0.2 * t + 3.0 * t * t - 40.0 * t * t * t;
    let mut bench = Bench::new(paper(3, 2), angle);
    bench.run(-9..=-3);
    bench.missed = 2;
    bench.run(0..=0);
    bench.step(1, true);
    bench.run(2..=4);
    // Three coefficients through four readings: the prediction of a parabola is exact across the gap.
    assert!(bench.error().abs() < 1e-13);
    bench.missed = 3;
    bench.run(8..=8);
    bench.missed = 2;
    assert!(bench.step(11, false).0.contains(TickFlags::ANGLE_RESTORED));
    assert!(bench.error().abs() < 1e-14);
}

#[test]
fn two_switches_ten_ticks_apart_are_each_restored() {
    let angle = |t: f64| PI / 180.0 * libm::sin(TAU * t + 0.4);
    let mut bench = Bench::new(paper(3, 1), angle);
    bench.run(-9..=0);
    bench.step(1, true);
    bench.run(2..=10);
    bench.step(11, true);
    bench.run(12..=16);
    let restored: Vec<_> = (0_i32..)
        .zip(&bench.flags)
        .filter(|(_, flags)| flags.contains(TickFlags::ANGLE_RESTORED))
        .map(|(index, _)| index - 9)
        .collect();
    assert_eq!(restored, [6, 16]);
    assert!(bench.error().abs() < 0.002 * ARCSEC);
}

#[test]
fn close_switches_lose_no_angle() {
    // The second command comes `apart` ticks after the first, down to inside the first transition.
    for apart in 1..=9 {
        let angle = |t: f64| 0.2 * t + 3.0 * t * t - 40.0 * t * t * t;
        let mut bench = Bench::new(paper(3, 0), angle);
        bench.run(-9..=0);
        for k in 1..=apart + 12 {
            bench.step(k, k == 1 || k == 1 + apart);
        }
        assert!(bench.substitution.is_settled());
        assert!(bench.flags.iter().all(|f| !f.contains(TickFlags::SWITCH_UNRESOLVED)));
        assert!(bench.error().abs() < 1e-14, "{apart} ticks apart: {}", bench.error());
    }
}

#[test]
fn a_pending_angle_waits_for_the_good_tick_after_the_second_transition() {
    let mut bench = Bench::new(paper(3, 0), |t| t * t);
    bench.run(-9..=0);
    bench.step(1, true);
    bench.run(2..=5);
    assert!(!bench.step(6, true).0.contains(TickFlags::ANGLE_RESTORED));
    bench.run(7..=8);
    assert!(bench.step(9, false).0.contains(TickFlags::ANGLE_RESTORED));
}

#[test]
fn without_history_the_readings_after_restore_the_angle() {
    let mut bench = Bench::new(paper(3, 1), |t| 0.5 * t + 2.0 * t * t);
    let (flags, increment) = bench.step(1, true);
    assert_eq!((flags, increment), (TickFlags::INTERPOLATED, 0.0));
    bench.run(2..=6);
    assert!(bench.flags[5].contains(TickFlags::ANGLE_RESTORED));
    assert!(bench.error().abs() < 1e-16);
}

#[test]
fn a_long_gap_after_the_transition_is_unresolved_and_says_so() {
    let mut bench = Bench::new(paper(3, 1), |t| t * t);
    bench.run(-9..=0);
    bench.step(1, true);
    bench.missed = 1_000_000;
    assert_eq!(bench.step(1_000_002, false).0, TickFlags::SWITCH_UNRESOLVED);
    assert!(bench.substitution.is_settled());
    bench.run(1_000_003..=1_000_009);
    assert!(bench.flags[12..].iter().all(TickFlags::is_empty));

    // With one reading after the transition the fit is made of what there is.
    let mut bench = Bench::new(paper(3, 1), |t| t * t);
    bench.run(-9..=0);
    bench.step(1, true);
    bench.run(2..=4);
    bench.missed = 1_000_000;
    assert_eq!(bench.step(1_000_005, false).0, TickFlags::ANGLE_RESTORED);
    assert!(bench.error().abs() < 1e-9);
}

#[test]
fn a_switch_after_a_long_gap_does_not_predict_from_before_it() {
    let mut bench = Bench::new(paper(3, 1), |t| t);
    bench.run(-9..=0);
    bench.missed = 49;
    let (flags, increment) = bench.step(50, true);
    assert_eq!((flags, increment), (TickFlags::INTERPOLATED, 0.0));
    bench.run(51..=55);
    assert!(bench.error().abs() < 1e-15);
}

#[test]
fn a_restart_gives_up_what_was_pending_and_says_so() {
    let reversal = paper(3, 1);
    let mut bench = Bench::new(reversal, |t| t);
    bench.run(-9..=0);
    bench.step(1, true);
    let input = TickInput {
        duration: Span::from_ns(TICK_NS),
        mode: Some(LasingMode::Plus),
        restart: true,
        ..TickInput::default()
    };
    let mut increments: Sensors<f64> = [0.1].into_iter().collect();
    let flags = bench.substitution.tick(&reversal, input, &mut increments, ALL);
    assert_eq!((flags, increments[0]), (TickFlags::SWITCH_UNRESOLVED, 0.1));
    assert!(bench.substitution.is_settled());
}

#[test]
fn commands_without_end_are_bounded_and_reported() {
    let mut bench = Bench::new(paper(3, 1), |t| t);
    bench.run(-9..=0);
    for k in 1..=100 {
        bench.step(k, true);
    }
    let unresolved = |flags: &&TickFlags| flags.contains(TickFlags::SWITCH_UNRESOLVED);
    assert_eq!(bench.flags.iter().filter(unresolved).count(), 100 - 16);
    bench.run(101..=110);
    assert!(bench.substitution.is_settled());
}

#[test]
fn a_producer_that_reports_the_mode_as_it_is_switches_once() {
    let reversal = paper(3, 1);
    let mut substitution = Substitution::default();
    let mut interpolated = 0;
    for k in -5..=12_i32 {
        let input = TickInput {
            end_time: Timestamp::from_ns(i64::from(k) * TICK_NS),
            duration: Span::from_ns(TICK_NS),
            mode: Some(if k < 4 { LasingMode::Plus } else { LasingMode::Minus }),
            switch_command: k == 1,
            ..TickInput::default()
        };
        let mut increments: Sensors<f64> = [1.0].into_iter().collect();
        let flags = substitution.tick(&reversal, input, &mut increments, ALL);
        interpolated += i32::from(flags.contains(TickFlags::INTERPOLATED));
    }
    assert_eq!(interpolated, 3);
}

#[test]
fn a_sensor_without_a_number_after_the_switch_keeps_its_prediction_and_stands_apart() {
    let reversal = paper(1, 1);
    let mut substitution = Substitution::default();
    for k in -5..=4_i32 {
        let input = TickInput {
            end_time: Timestamp::from_ns(i64::from(k) * TICK_NS),
            duration: Span::from_ns(TICK_NS),
            switch_command: k == 1,
            ..TickInput::default()
        };
        let second = if k > 1 { f64::NAN } else { 2.0 };
        let mut increments: Sensors<f64> = [1.0, second].into_iter().collect();
        let flags = substitution.tick(&reversal, input, &mut increments, ALL);
        assert!((increments[0] - 1.0).abs() < 1e-12);
        assert!(!flags.contains(TickFlags::SWITCH_UNRESOLVED));
        assert_eq!(substitution.apart().contains(1), k > 2);
    }
}

#[test]
fn every_error_is_reported_at_once() {
    let parts = ReversalParts {
        transition: Transition::Ticks(33),
        predict_readings: 2,
        predict_degree: 2,
        fit_readings_before: 1,
        fit_readings_after: 0,
        fit_degree: 3,
        fit_window: FitWindow::Adaptive,
    };
    let errors = Reversal::new(&parts).unwrap_err();
    let out = |path: &str, value, low, high| (path.into(), DefectKind::OutOfRange { value, low, high });
    let degree = |path: &str, got, readings| (path.into(), DefectKind::DegreeNeedsReadings { got, readings });
    let found: Vec<_> = errors.into_iter().map(|Defect { path, kind }| (path, kind)).collect();
    assert_eq!(
        found,
        [
            out("transition_ticks", 33.0, 1.0, 32.0),
            out("fit_readings_after", 0.0, 1.0, 8.0),
            degree("predict_degree", 2, 2),
            degree("fit_degree", 3, 1),
            ("fit_window".into(), DefectKind::AdaptiveNeedsReadings { readings: 1 }),
        ]
    );
    for time_s in [0.0, 1.1, f64::NAN] {
        let parts = ReversalParts { transition: Transition::Time(time_s), ..ReversalParts::default() };
        let errors = Reversal::new(&parts).unwrap_err();
        assert!(errors.iter().map(|defect| &*defect.path).eq(["transition_s"]), "{errors:?}");
    }
}

fn any_parts() -> impl Strategy<Value = ReversalParts> {
    let transition =
        prop_oneof![(1..=32_u8).prop_map(Transition::Ticks), (1e-4..=1.0_f64).prop_map(Transition::Time),];
    let counts = (transition, 1..=8_u8, 1..=8_u8, 1..=8_u8);
    let degrees = (0..=2_u8, 0..=3_u8, any::<bool>());
    (counts, degrees).prop_map(|((transition, predict, before, after), (degree, fit, adaptive))| {
        ReversalParts {
            transition,
            predict_readings: predict,
            predict_degree: degree.min(predict - 1),
            fit_readings_before: before,
            fit_readings_after: after,
            fit_degree: fit.min(before + after - 1),
            fit_window: if adaptive && before + after >= 12 { FitWindow::Adaptive } else { FitWindow::Fixed },
        }
    })
}

proptest! {
    /// I5: whatever the commands and gaps, the angle published over the ticks that arrive is the true one.
    #[test]
    fn no_pattern_of_commands_and_gaps_loses_angle(
        parts in any_parts(),
        steps in -1000..1000_i32,
        events in prop::collection::vec((0..20_i32, 0..20_u8), 1..60),
    ) {
        // Each tick turns by the same whole number of 2⁻¹⁶ rad: a line exactly. Rounding of the angle would be a motion of
        // its own, and a cubic that rests on four readings after 32 lost ones multiplies it by 10⁵.
        let tick_angle = f64::from(steps) / 65_536.0;
        let mut bench = Bench::new(reversal(parts), |t| tick_angle * libm::round(t / TICK_S));
        let mut k = 1;
        for (gap, command) in events {
            // Mostly no gap; never one that is too long to bridge.
            if gap > 16 {
                k += gap - 16;
                bench.missed = u64::try_from(gap - 16).unwrap();
            }
            bench.step(k, command == 0);
            k += 1;
        }
        bench.run(k..=k + 60);
        prop_assert!(bench.substitution.is_settled());
        if bench.flags.iter().all(|flags| !flags.contains(TickFlags::SWITCH_UNRESOLVED)) {
            prop_assert!(bench.error().abs() < 1e-11, "error {}", bench.error());
        }
    }

    #[test]
    fn a_motion_of_the_fits_degree_is_restored_exactly(
        parts in any_parts(),
        c in prop::array::uniform4(-1.0..1.0_f64),
        phase in 0..5_i32,
    ) {
        let degree = usize::from(parts.fit_degree);
        let angle = move |t: f64| {
            let x = t / (20.0 * TICK_S);
            let rate = c.iter().take(degree + 1).enumerate();
            // ∫ Σ c_m·x^m dt
            rate.fold((0.0, x), |(sum, power), (m, c)| {
                (sum + c * power / f64::from(u8::try_from(m + 1).unwrap()), power * x)
            })
            .0
        };
        let mut bench = Bench::new(reversal(parts), angle);
        bench.run(-20..=phase);
        bench.step(phase + 1, true);
        bench.run(phase + 2..=phase + 60);
        prop_assert!(bench.error().abs() < 1e-9, "error {}", bench.error());
    }

    #[test]
    fn the_output_is_linear_in_the_readings(
        parts in any_parts(),
        a in prop::collection::vec(-1.0..1.0_f64, 40),
        b in prop::collection::vec(-1.0..1.0_f64, 40),
        command in 0..40_usize,
    ) {
        // A window that adapts looks at the readings.
        let reversal = reversal(ReversalParts { fit_window: FitWindow::Fixed, ..parts });
        let mut substitution = Substitution::default();
        for (k, (a, b)) in a.iter().zip(&b).enumerate() {
            let input = TickInput {
                end_time: Timestamp::from_ns(i64::try_from(k).unwrap() * TICK_NS),
                duration: Span::from_ns(TICK_NS),
                switch_command: k == command,
                ..TickInput::default()
            };
            let mut all: Sensors<f64> = [*a, *b, 2.0 * a - b].into_iter().collect();
            substitution.tick(&reversal, input, &mut all, ALL);
            let scale = all[0].abs() + all[1].abs() + 1.0;
            prop_assert!((2.0 * all[0] - all[1] - all[2]).abs() < 1e-9 * scale);
        }
    }

    #[test]
    fn no_input_panics_and_no_lost_tick_is_anything_but_finite(
        parts in any_parts(),
        ticks in prop::collection::vec(
            (any::<i64>(), any::<i64>(), prop::option::of(any::<bool>()), any::<[u8; 3]>()),
            0..40,
        ),
        values in prop::collection::vec(prop::num::f64::ANY, 40),
    ) {
        let reversal = reversal(parts);
        let mut substitution = Substitution::default();
        for ((end, duration, mode, [command, missed, restart]), value) in ticks.iter().zip(values) {
            let plus = |plus| if plus { LasingMode::Plus } else { LasingMode::Minus };
            let input = TickInput {
                end_time: Timestamp::from_ns(*end),
                duration: Span::from_ns(*duration),
                mode: mode.map(plus),
                switch_command: command % 4 == 0,
                missed: u64::from(missed % 8),
                restart: restart % 32 == 0,
            };
            let mut increments: Sensors<f64> = [value, 1.0, -value].into_iter().collect();
            let flags = substitution.tick(&reversal, input, &mut increments, ALL);
            if flags.contains(TickFlags::INTERPOLATED) {
                prop_assert!(increments.iter().all(|increment| increment.is_finite()));
            }
        }
    }
}

#[test]
fn a_transition_stated_as_a_time_is_that_many_ticks_at_any_tick() {
    let ticks = |time_s: f64, tick_ns: i64| {
        let parts = ReversalParts { transition: Transition::Time(time_s), ..ReversalParts::default() };
        reversal(parts).parts.transition.ticks(Span::from_ns(tick_ns))
    };
    assert_eq!([1_000_000, 5_000_000, 20_000_000].map(|tick_ns| ticks(0.015, tick_ns)), [15, 3, 1]);
    // A clock that is a little off brings no tick in.
    assert_eq!(
        [4_999_000, 5_001_000, 4_700_000, 4_690_000].map(|tick_ns| ticks(0.015, tick_ns)),
        [3, 3, 4, 4]
    );
    assert_eq!([ticks(0.0151, 5_000_000), ticks(0.0155, 5_000_000)], [3, 4]);
    assert_eq!([ticks(1.0, 1_000_000), ticks(1.0, 0), ticks(1e-4, i64::MAX)], [32, 32, 1]);
    let stated = reversal(ReversalParts { transition: Transition::Ticks(7), ..ReversalParts::default() });
    assert_eq!(stated.parts.transition.ticks(Span::from_ns(1)), 7);
}

#[test]
fn a_transition_that_is_cut_is_flagged_at_its_last_bridged_tick() {
    for (time_s, cut) in [(0.032, false), (0.0335, true)] {
        let parts = ReversalParts { transition: Transition::Time(time_s), ..ReversalParts::default() };
        let (reversal, mut substitution) = (reversal(parts), Substitution::default());
        let unresolved: Vec<i64> = (-20..60)
            .filter(|k| {
                let input = TickInput {
                    end_time: Timestamp::from_ns(k * 1_000_000),
                    duration: Span::from_ns(1_000_000),
                    mode: Some(if *k < 1 { LasingMode::Plus } else { LasingMode::Minus }),
                    switch_command: *k == 1,
                    missed: 0,
                    restart: false,
                };
                substitution.tick(&reversal, input, &mut [1e-5], ALL).contains(TickFlags::SWITCH_UNRESOLVED)
            })
            .collect();
        assert_eq!(unresolved, if cut { &[32][..] } else { &[] }, "{time_s} s");
    }
}

/// A millisecond's ticks of one gyro with a transition of 15 ms; angle error (rad) of the ticks up to the restoring one.
fn fast_ticks(transition: Transition, angle: impl Fn(f64) -> f64) -> (f64, usize) {
    let parts = ReversalParts {
        transition,
        predict_readings: 8,
        fit_readings_before: 8,
        fit_readings_after: 8,
        ..ReversalParts::default()
    };
    let reversal = reversal(parts);
    let (mut substitution, mut error, mut lost) = (Substitution::default(), 0.0, 0);
    for k in -20..=60_i32 {
        let (end, begin) = (f64::from(k) * 1e-3, f64::from(k - 1) * 1e-3);
        let input = TickInput {
            end_time: Timestamp::from_ns(i64::from(k) * 1_000_000),
            duration: Span::from_ns(1_000_000),
            mode: Some(if k < 1 { LasingMode::Plus } else { LasingMode::Minus }),
            switch_command: k == 1,
            missed: 0,
            restart: false,
        };
        // What the instrument loses: the ticks 1 to 15.
        let mut increments = [if (1..=15).contains(&k) { 1e3 } else { angle(end) - angle(begin) }];
        let flags = substitution.tick(&reversal, input, &mut increments, ALL);
        lost += usize::from(flags.contains(TickFlags::INTERPOLATED));
        error += increments[0] - (angle(end) - angle(begin));
    }
    (error, lost)
}

#[test]
fn a_transition_of_fifteen_milliseconds_is_bridged_at_ticks_of_one() {
    let angle = |t: f64| PI / 180.0 * libm::sin(TAU * t + 0.4);
    for transition in [Transition::Time(0.015), Transition::Ticks(15)] {
        let (error, lost) = fast_ticks(transition, angle);
        assert_eq!(lost, 15);
        assert!(error.abs() < 0.01 * ARCSEC, "{transition:?}: {}″", error / ARCSEC);
    }
    // The longest: none of its ticks is too far from the readings on either side.
    let (error, lost) = fast_ticks(Transition::Ticks(32), |t| 0.2 * t + 3.0 * t * t - 2.0 * t * t * t);
    assert_eq!(lost, 32);
    assert!(error.abs() < 1e-7, "{error}");
    // As many ticks as 003 has leave rubbish.
    assert!(fast_ticks(Transition::Ticks(3), angle).0.abs() > 1.0);
}

#[test]
fn a_window_that_adapts_follows_noise_at_rest_and_motion_when_there_is_any() {
    const SIGMA: f64 = ARCSEC;
    let window = |fit_window, readings| {
        reversal(ReversalParts {
            fit_readings_before: readings,
            fit_readings_after: readings,
            fit_window,
            ..ReversalParts::default()
        })
    };
    let (two, eight) = (window(FitWindow::Fixed, 2), window(FitWindow::Fixed, 8));
    let adaptive = window(FitWindow::Adaptive, 8);
    // Angle error after the restoring tick, ″ rms over 300 switches, of 1° at a frequency with noise of an arcsecond per tick.
    let rms = |reversal: Reversal, frequency_hz: f64, sigma: f64| {
        let mut dice = 1_u64;
        let mut noise = || {
            let mut sum = -6.0;
            for _ in 0..12 {
                dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                #[expect(clippy::cast_precision_loss, reason = "53 bits")]
                let share = (dice >> 11) as f64 / (1_u64 << 53) as f64;
                sum += share;
            }
            sigma * sum
        };
        let mut sum = 0.0;
        for phase in 0..300 {
            let phase = TAU * 0.618 * f64::from(phase);
            let angle = |t: f64| PI / 180.0 * libm::sin(TAU * frequency_hz * t + phase);
            let (mut substitution, mut error) = (Substitution::default(), 0.0);
            for k in -9..=14_i32 {
                let truth = angle(f64::from(k) * TICK_S) - angle(f64::from(k - 1) * TICK_S);
                let (noise, lost) = (noise(), (1..=3).contains(&k));
                let input = TickInput {
                    end_time: Timestamp::from_ns(i64::from(k) * TICK_NS),
                    duration: Span::from_ns(TICK_NS),
                    mode: Some(if k < 1 { LasingMode::Plus } else { LasingMode::Minus }),
                    switch_command: k == 1,
                    missed: 0,
                    restart: false,
                };
                let mut increments = [truth + if lost { 1e3 } else { noise }];
                substitution.tick(&reversal, input, &mut increments, ALL);
                // The noise of the good ticks is no error of the substitution.
                error += increments[0] - truth - if lost { 0.0 } else { noise };
            }
            sum += error * error;
        }
        libm::sqrt(sum / 300.0) / ARCSEC
    };
    for (frequency_hz, sigma, best, worst) in [
        // At rest nearly what eight readings give, 1.27 of the noise, where two give 3.81.
        (0.0, SIGMA, rms(eight, 0.0, SIGMA), 1.35),
        (1.0, SIGMA, rms(eight, 1.0, SIGMA), 1.4),
        // Motion too fast for eight.
        (5.0, SIGMA, rms(two, 5.0, SIGMA), 0.9),
        (10.0, SIGMA, rms(two, 10.0, SIGMA), 1.05),
        (5.0, 1e-4 * SIGMA, rms(two, 5.0, 1e-4 * SIGMA), 1.05),
    ] {
        let got = rms(adaptive, frequency_hz, sigma);
        assert!(got < worst * best, "{frequency_hz} Hz, noise {sigma}: {got}″, {best}″ at best");
    }
    assert!(rms(eight, 5.0, SIGMA) > 20.0, "a wide window cuts the motion off");
}
