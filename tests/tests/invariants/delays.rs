//! Sensors that are held back to the one that lags most: nothing of what they read is lost or counted twice, whatever happens.

use isotherm_correction::calibration::CalibrationParts;
use isotherm_correction::sample::{CorrectedTick, TickFlags};
use isotherm_correction::unit::{At, Change, Unit};
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{compile, identity};
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
    let (mut unit, mut out) = (drive::unit(&compile(&late())), Vec::new());
    for k in 0..40 {
        let (mut rates, forces) = readings(k);
        if k == 20 {
            rates[0] = f64::NAN;
        }
        drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &forces)]), &mut out);
        drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k, &rates)]), &mut out);
    }
    let invalid: Vec<u64> = out
        .iter()
        .filter(|tick| tick.flags.contains(TickFlags::ANGLE_INVALID))
        .map(|tick| tick.sequence)
        .collect();
    assert_eq!(invalid, [20, 21]);
    assert!(out.iter().all(|tick| tick.delta_angle.iter().all(|angle| angle.is_finite())));
}
