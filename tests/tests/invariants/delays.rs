//! Sensors that are held back to the one that lags most: nothing of what they read is lost or counted twice, whatever happens.

use std::collections::BTreeMap;

use isotherm_correction::calibration::CalibrationParts;
use isotherm_correction::orientation::OrientationParts;
use isotherm_correction::reversal::ReversalParts;
use isotherm_correction::sample::{CorrectedTick, GyroTick, LasingMode, SensorFlags, TickFlags};
use isotherm_correction::sigma::SigmaParts;
use isotherm_correction::unit::{At, Change, Unit};
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{compile, identity, mode_reversed, orientation, plain_accel, plain_gyro};
use isotherm_tests::dice::Dice;
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, gyro, temperature};

const TICKS: u64 = 400;
const TICK_S: f64 = 0.005;

/// Gyro y reads 0.8 of a tick late, accelerometer z 0.5.
fn late() -> CalibrationParts {
    let mut parts = identity();
    parts.gyros[1].delay_ticks = 0.8;
    parts.accels[2].delay_ticks = 0.5;
    parts
}

/// What gyros and accelerometers read in a tick.
fn readings(k: u64) -> ([f64; 3], [f64; 3]) {
    let t = f64::from(u32::try_from(k).unwrap()) * 0.05;
    ([0.3 * t.sin(), 0.2 * t.cos(), 0.1 + 0.05 * t.sin()], [t.cos(), -t.sin(), 9.8 + t.sin()])
}

/// A run in which `before` may do something before each tick; ticks that it refuses do not come.
fn run(parts: &CalibrationParts, mut before: impl FnMut(u64, &mut Unit) -> bool) -> Vec<CorrectedTick> {
    let (mut unit, mut out) = (drive::unit(&compile(parts)), Vec::new());
    drive::hand(&mut unit, &Owned::Temperature(vec![temperature(0, 20.0)]), &mut out);
    for k in 0..TICKS {
        if before(k, &mut unit) {
            let (rates, forces) = readings(k);
            drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &forces)]), &mut out);
            drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k, &rates)]), &mut out);
        }
    }
    out.extend(drive::run(&mut unit, &[]));
    out
}

/// Angle and velocity over all ticks.
fn sums(ticks: &[CorrectedTick]) -> [f64; 6] {
    let mut sums = [0.0; 6];
    for tick in ticks {
        let both = tick.delta_angle.iter().chain(&tick.delta_velocity);
        sums.iter_mut().zip(both).for_each(|(sum, part)| *sum += part);
    }
    sums
}

/// What of the last tick is still held back, by the parabola through the last ends of ticks.
fn owed(held: f64, [before, last]: [f64; 2]) -> f64 {
    (held * last + 0.5 * held * (1.0 - held) * (last - before)) * TICK_S
}

fn close(got: [f64; 6], expected: [f64; 6]) {
    for (got, expected) in got.iter().zip(expected) {
        assert!((got - expected).abs() < 1e-12, "{got} {expected}");
    }
}

/// A swap at a tick, made over a time.
fn swap(unit: &mut Unit, parts: &CalibrationParts, slew_s: f64) {
    let slew = Span::from_s(slew_s);
    unit.schedule(Change { calibration: compile(parts), revision: 2, at: At::NextTick, slew });
}

#[test]
fn sums_are_those_of_the_readings_but_for_what_the_last_tick_holds_back() {
    let plain = sums(&run(&identity(), |_, _| true));
    let [(rates_before, forces_before), (rates, forces)] = [TICKS - 2, TICKS - 1].map(readings);
    let held = [0.8, 0.0, 0.8, 0.8, 0.8, 0.8 - 0.5];
    let last =
        |i: usize| if i < 3 { [rates_before[i], rates[i]] } else { [forces_before[i - 3], forces[i - 3]] };
    let (rates, forces) = readings(0);
    // The first tick is taken to go on as what was before it: so much of that is in the sum.
    let first = [rates[0], rates[1], rates[2], forces[0], forces[1], forces[2]];
    let expected = std::array::from_fn(|i| plain[i] + owed(held[i], [first[i]; 2]) - owed(held[i], last(i)));
    close(sums(&run(&late(), |_, _| true)), expected);
}

#[test]
fn swaps_to_and_fro_lose_nothing_at_once_or_over_a_time() {
    let plain = sums(&run(&identity(), |_, _| true));
    for slew_s in [0.0, 0.3] {
        let swapped = run(&identity(), |k, unit| {
            match k {
                100 => swap(unit, &late(), slew_s),
                250 => swap(unit, &identity(), slew_s),
                _ => {}
            }
            true
        });
        close(sums(&swapped), plain);
        let largest = |ticks: &[CorrectedTick]| {
            let steps = ticks.windows(2).map(|pair| (pair[1].delta_angle[0] - pair[0].delta_angle[0]).abs());
            steps.fold(0.0, f64::max)
        };
        // Over 60 ticks, each is 0.8/60 of a tick longer or shorter.
        let smooth = largest(&run(&identity(), |_, _| true));
        assert!(slew_s == 0.0 || largest(&swapped) < 1.1 * smooth, "{} {smooth}", largest(&swapped));
    }
}

#[test]
fn a_gap_takes_what_is_lost_in_it_and_no_more() {
    let gap = |k: u64| !(200..203).contains(&k);
    let (plain, late) = (run(&identity(), |k, _| gap(k)), run(&late(), |k, _| gap(k)));
    let [plain, late] = [&plain, &late].map(|ticks| {
        let (from, to) = (150, 300);
        sums(&ticks.iter().filter(|tick| (from..to).contains(&tick.sequence)).cloned().collect::<Vec<_>>())
    });
    let ends = [149, 299].map(|k| [readings(k - 1), readings(k)]);
    let held = |[before, last]: [([f64; 3], [f64; 3]); 2]| owed(0.8, [before.0[0], last.0[0]]);
    assert!((late[0] - (plain[0] + held(ends[0]) - held(ends[1]))).abs() < 1e-12, "{} {}", late[0], plain[0]);
}

#[test]
fn a_reading_that_does_not_count_spoils_both_ticks_that_have_part_of_it() {
    let run = |read: Option<f64>| {
        let (mut unit, mut out) = (drive::unit(&compile(&late())), Vec::new());
        for k in 0..40 {
            let (mut rates, mut forces) = readings(k);
            if let Some(read) = read.filter(|_| k == 20) {
                (rates[0], forces[1]) = (read, read);
            }
            drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &forces)]), &mut out);
            drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k, &rates)]), &mut out);
        }
        out
    };
    let sound = run(None);
    for read in [f64::NAN, 1e9] {
        let out = run(Some(read));
        let ticks = |found: &dyn Fn(&CorrectedTick) -> bool| {
            let found = out.iter().filter(|tick| found(tick));
            found.map(|tick| tick.sequence).collect::<Vec<_>>()
        };
        for flag in [TickFlags::ANGLE_INVALID, TickFlags::VELOCITY_INVALID] {
            assert_eq!(ticks(&|tick| tick.flags.contains(flag)), [20, 21]);
        }
        assert_eq!(ticks(&|tick| !tick.gyro_flags[0].contains(SensorFlags::VALID)), [20, 21]);
        assert_eq!(ticks(&|tick| !tick.accel_flags[1].contains(SensorFlags::VALID)), [20, 21]);
        assert!(out.iter().all(|tick| tick.delta_angle.iter().all(|angle| angle.is_finite())));
        let off = |got: [f64; 3], right: [f64; 3]| (0..3).map(move |axis| (got[axis] - right[axis]).abs());
        for (got, right) in out.iter().zip(&sound).filter(|(got, _)| !(20..22).contains(&got.sequence)) {
            assert!(off(got.delta_angle, right.delta_angle).all(|off| off < 1e-5), "{got:?}");
            assert!(off(got.delta_velocity, right.delta_velocity).all(|off| off < 1e-4), "{got:?}");
        }
    }
}

#[test]
fn parity_compares_no_readings_of_different_times() {
    let turned = (5_f64.sqrt() * 0.1 + 0.5).sqrt();
    let (b, a) = (turned, (1.0 - turned * turned).sqrt());
    let rows = [[a, 0.0, b], [-a, 0.0, b], [b, a, 0.0], [b, -a, 0.0], [0.0, b, a]];
    let mut parts = identity();
    parts.reversal = Some(ReversalParts::default());
    (parts.gyros, parts.accels) = (vec![plain_gyro(); 5], vec![plain_accel(); 5]);
    (parts.gyros[1].delay_ticks, parts.accels[1].delay_ticks) = (0.5, 0.5);
    let stated =
        |limit| OrientationParts { parity_limit: Some(limit), parity_confirm_ticks: 2, ..orientation(&rows) };
    (parts.gyro_orientation, parts.accel_orientation) = (stated(1e-4), Some(stated(1e-4)));
    // Integral of a motion along each row, by ends of ticks.
    let integral = |row: [f64; 3], at: f64| {
        let swing = (std::f64::consts::TAU * at * TICK_S).sin();
        0.08 * (row[0] + 0.7 * row[1] - 0.4 * row[2]) * swing
    };
    let reads = |k: u64| -> Vec<f64> {
        let end = f64::from(u32::try_from(k).unwrap());
        let end_of = |sensor: usize| if sensor == 1 { end - 0.5 } else { end };
        let increment = |(i, row): (usize, &[f64; 3])| {
            (integral(*row, end_of(i)) - integral(*row, end_of(i) - 1.0)) / TICK_S
        };
        rows.iter().enumerate().map(increment).collect()
    };
    let (mut unit, mut out) = (drive::unit(&compile(&parts)), Vec::new());
    for k in (0..200).filter(|k| !(50..53).contains(k)) {
        let mode = Some(if k < 100 { LasingMode::Plus } else { LasingMode::Minus });
        let tick = GyroTick { mode, switch_command: k == 100, ..gyro(k, &reads(k)) };
        drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &reads(k))]), &mut out);
        drive::hand(&mut unit, &Owned::Gyro(vec![tick]), &mut out);
    }
    out.extend(drive::run(&mut unit, &[]));
    let exceeded = out.iter().filter(|tick| tick.flags.contains(TickFlags::PARITY_EXCEEDED));
    assert_eq!(exceeded.count(), 0);
    assert!(out.iter().all(|tick| !tick.gyro_flags[1].contains(SensorFlags::EXCLUDED)));
    let without = |parity: &dyn Fn(&CorrectedTick) -> bool| {
        out.iter().filter(|tick| parity(tick)).map(|tick| tick.sequence).collect::<Vec<_>>()
    };
    assert_eq!(without(&|tick| tick.accel_parity.is_empty()), [0, 1, 53, 54]);
    let switch = [101, 102, 100, 103, 104, 105, 106, 107];
    let mut none = without(&|tick| tick.gyro_parity.is_empty());
    none.retain(|k| !switch.contains(k));
    assert_eq!(none, [0, 1, 53, 54]);
}

#[test]
fn ticks_that_are_held_back_over_a_switch_scatter_within_sigma() {
    let mut parts = mode_reversed(ReversalParts::default());
    for gyro in &mut parts.gyros {
        gyro.terms.clear();
        let white = SigmaParts { random_walk: Some(1e-4), quantisation: Some(0.0), ..SigmaParts::default() };
        gyro.sigma = Some(white);
    }
    parts.gyros[1].delay_ticks = 0.5;
    let marks = TickFlags::INTERPOLATED | TickFlags::ANGLE_RESTORED;
    let (mut unit, mut dice, mut out) = (drive::unit(&compile(&parts)), Dice::new(5), Vec::new());
    let mut noise =
        || (0..12).map(|_| 0.5 * dice.between_minus_one_and_one()).sum::<f64>() * 1e-4 / TICK_S.sqrt();
    for k in 0..40_000 {
        let mode = Some(if k / 40 % 2 == 0 { LasingMode::Plus } else { LasingMode::Minus });
        let rates = [noise(), noise(), noise()];
        let tick = GyroTick { mode, switch_command: k > 0 && k % 40 == 0, ..gyro(k, &rates) };
        drive::hand(&mut unit, &Owned::Gyro(vec![tick]), &mut out);
    }
    // Sums of squares by their σ, of each tick of a switch.
    let mut kinds = BTreeMap::new();
    let mut place = (TickFlags::empty(), 0);
    for tick in &out[40..] {
        let found = tick.flags & marks;
        place = (found, if found == place.0 && !found.is_empty() { place.1 + 1 } else { 0 });
        let angle = tick.sigma.as_deref().unwrap().angle;
        let sum: &mut [f64; 2] = kinds.entry((place.0.bits(), place.1)).or_default();
        for axis in [0, 2] {
            let variance = angle.noise[axis].powi(2) + angle.restoration[axis].powi(2);
            *sum = [sum[0] + tick.delta_angle[axis].powi(2) / variance, sum[1] + 1.0];
        }
    }
    assert_eq!(kinds.len(), 1 + 5 + 3);
    for (kind, [sum, count]) in kinds {
        assert!(count > 1900.0 && (0.6..1.15).contains(&(sum / count)), "{kind:?}: {}", sum / count);
    }
}
