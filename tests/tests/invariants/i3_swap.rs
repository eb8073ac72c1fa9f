//! I3: a calibration takes effect at a tick boundary; every output names the revision that made it; no tick is lost,
//! doubled or delayed by a swap.

use isotherm_correction::calibration::{CalibrationParts, LagParts};
use isotherm_correction::sample::CorrectedTick;
use isotherm_tests::calibrations::{compile, constant, identity, polynomial};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, gyro, temperature};

const TICKS: u64 = 4000;

fn thermal(bias: f64) -> CalibrationParts {
    let mut parts = identity();
    for gyro in &mut parts.gyros {
        gyro.static_bias = Some(polynomial(&[bias, 1e-5]));
        gyro.lags = vec![LagParts { time_constant_s: 20.0, gain: constant(1e-4) }];
    }
    parts
}

/// A run in which `swap` may install something before each tick.
fn run(mut swap: impl FnMut(u64, &mut isotherm_correction::unit::Unit)) -> Vec<CorrectedTick> {
    let mut unit = drive::unit(&compile(&thermal(1e-4)));
    let mut out = Vec::new();
    for k in 0..TICKS {
        swap(k, &mut unit);
        if k % 100 == 0 {
            let celsius = 20.0 + 0.002 * f64::from(u32::try_from(k).unwrap());
            drive::hand(&mut unit, &Owned::Temperature(vec![temperature(k, celsius)]), &mut out);
        }
        drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[0.0, 0.0, 9.8])]), &mut out);
        drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k, &[0.01, 0.02, 0.03])]), &mut out);
    }
    out
}

#[test]
fn i3_a_swap_to_the_same_coefficients_changes_the_revision_and_no_other_bit() {
    let plain = run(|_, _| {});
    let same = compile(&thermal(1e-4));
    let swapped = run(|k, unit| {
        if k == 2345 {
            unit.install(same.clone(), 2);
        }
    });
    assert_eq!(plain.len(), swapped.len());
    for (plain, swapped) in plain.iter().zip(&swapped) {
        assert_eq!(swapped.revision, if swapped.sequence < 2345 { 1 } else { 2 });
        assert_eq!(CorrectedTick { revision: plain.revision, ..swapped.clone() }, *plain);
    }
}

#[test]
fn i3_before_the_swap_the_old_coefficients_and_after_it_the_new_ones() {
    let [old, new] = [
        run(|_, _| {}),
        run(|k, unit| {
            if k == 0 {
                unit.install(compile(&thermal(3e-4)), 1);
            }
        }),
    ];
    let swapped = run(|k, unit| {
        if k == 2000 {
            unit.install(compile(&thermal(3e-4)), 2);
        }
    });
    assert!(swapped.iter().map(|tick| tick.sequence).eq(0..swapped.len() as u64), "none lost, none doubled");
    assert_eq!(swapped[..2000], old[..2000]);
    // Filters and lags go on: the swapped run meets the run that had the new coefficients all along.
    for (swapped, new) in swapped[2300..].iter().zip(&new[2300..]) {
        assert_eq!(swapped.delta_angle.map(f64::to_bits), new.delta_angle.map(f64::to_bits));
    }
}
