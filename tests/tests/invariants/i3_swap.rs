//! I3: a calibration takes effect at a tick boundary; every output names the revision that made it; no tick is lost,
//! doubled or delayed by a swap.

use isotherm_correction::calibration::{CalibrationParts, GyroParts};
use isotherm_correction::drift::Reference;
use isotherm_correction::sample::{ChannelName, CorrectedTick, OutputKind, TemperatureReading};
use isotherm_correction::unit::Unit;
use isotherm_tests::calibrations::{
    ALONG_CASE_AXES, Feature, PutTerms, channel, compile, constant, identity, lively_drift, polynomial,
};
use isotherm_tests::drive::{self, Owned};
use isotherm_tests::streams::{accel, end_of, gyro, temperature};

const TICKS: u64 = 4000;

fn thermal(bias: f64) -> CalibrationParts {
    let mut parts = identity();
    for gyro in &mut parts.gyros {
        gyro.terms.curve(Feature::One, polynomial(&[bias, 1e-5]));
        gyro.terms.lags([(20.0, constant(1e-4))]);
    }
    parts
}

/// A run in which `swap` may install something before each tick.
fn run(mut swap: impl FnMut(u64, &mut Unit)) -> Vec<CorrectedTick> {
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

#[test]
fn i3_a_swapped_orientation_is_that_of_the_present_temperature() {
    let with = |slope: f64| {
        let mut parts = identity();
        parts.gyro_orientation.rows = ALONG_CASE_AXES.to_vec();
        parts.gyro_orientation.slopes_per_deg_c = vec![[0.0, slope, 0.0], [0.0; 3], [0.0; 3]];
        compile(&parts)
    };
    // One reading of 60 °C, 40 °C from the assumed temperature, long before the swap.
    let run = |first, swap: bool| {
        let mut unit = drive::unit(&with(first));
        let mut out = Vec::new();
        drive::hand(&mut unit, &Owned::Temperature(vec![temperature(0, 60.0)]), &mut out);
        for k in 0..1000 {
            if swap && k == 900 {
                unit.install(with(2e-4), 2);
            }
            drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[0.0; 3])]), &mut out);
            drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k, &[0.1, 0.2, 0.3])]), &mut out);
        }
        out
    };
    let (swapped, new) = (run(1e-4, true), run(2e-4, false));
    for (swapped, new) in swapped.iter().zip(&new).skip(900) {
        let bits = |tick: &CorrectedTick| tick.delta_angle.map(f64::to_bits);
        assert_eq!(bits(swapped), bits(new), "tick {}", new.sequence);
    }
}

#[test]
fn i3_lags_go_on_with_their_channel_wherever_it_stands() {
    let with = |names: [&str; 2], follows: usize| {
        let mut parts = thermal(0.0);
        parts.channels = names.map(channel).to_vec();
        for gyro in &mut parts.gyros {
            gyro.channel = Some(follows);
        }
        compile(&parts)
    };
    // Channel t stands at 20 °C, channel u moves. The swap turns their places round, and the gyros follow u from then on.
    let run = |first, swap: bool| {
        let mut unit = drive::unit(&first);
        let mut out = Vec::new();
        for k in 0..TICKS {
            if swap && k == 2345 {
                unit.install(with(["u", "t"], 0), 2);
            }
            if k % 100 == 0 {
                let still = temperature(k, 20.0);
                let raw = 20.0 + 0.002 * f64::from(u32::try_from(k).unwrap());
                let moving = TemperatureReading { channel: ChannelName::from("u").unwrap(), raw, ..still };
                drive::hand(&mut unit, &Owned::Temperature(vec![still, moving]), &mut out);
            }
            drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[0.0; 3])]), &mut out);
            drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k, &[0.0; 3])]), &mut out);
        }
        out
    };
    // Before, the gyros followed t, also at place 0: its lags say nothing of u, which is taken to have stood for ever.
    let swapped = run(with(["t", "u"], 0), true);
    let at = |tick: &CorrectedTick| tick.delta_angle[0] / 0.005;
    // The last grid point lies at tick 2200.
    let static_bias = -1e-5 * (0.002 * 2200.0);
    assert!((at(&swapped[2345]) - static_bias).abs() < 1e-7, "{} and {static_bias}", at(&swapped[2345]));
    // Where they followed u all along, at whatever place, nothing happens but the jump to where the ramp was heading.
    let (swapped, plain) = (run(with(["t", "u"], 1), true), run(with(["t", "u"], 1), false));
    for (swapped, plain) in swapped.iter().zip(&plain).skip(2700) {
        assert!((at(swapped) - at(plain)).abs() < 1e-15);
    }
}

#[test]
fn i3_what_a_swap_leaves_of_the_terms_that_follow_motion_stays_on_its_way() {
    let with = |drift: f64| {
        let mut parts = thermal(0.0);
        for (gyro, drift) in parts.gyros.iter_mut().zip([drift, 1e-5]) {
            gyro.terms.curve(Feature::ForceZ, polynomial(&[drift, 1e-5]));
        }
        compile(&parts)
    };
    let run = |swap: bool| {
        run(|k, unit| match k {
            0 => unit.install(with(2e-5), 1),
            2345 if swap => unit.install(with(3e-5), 2),
            _ => {}
        })
    };
    for (swapped, plain) in run(true).iter().zip(&run(false)) {
        let [changed, same] =
            [0, 1].map(|axis| swapped.delta_angle[axis].to_bits() == plain.delta_angle[axis].to_bits());
        assert_eq!((changed, same), (plain.sequence < 2345, true), "tick {}", plain.sequence);
    }
}

#[test]
fn i3_the_drift_of_a_gyro_goes_on_unless_a_swap_changes_its_biases() {
    type Change<'a> = &'a dyn Fn(&mut GyroParts);
    let with = |change: Change<'_>| {
        let mut parts = identity();
        parts.gyros.iter_mut().for_each(|gyro| gyro.drift = Some(lively_drift()));
        change(&mut parts.gyros[1]);
        compile(&parts)
    };
    let curve = |feature| move |gyro: &mut GyroParts| gyro.terms.curve(feature, constant(1e-6));
    let changes: [(Change<'_>, u64); 5] = [
        (&|gyro| gyro.input_limit *= 1.0, 1),
        (&curve(Feature::One), 0),
        (&curve(Feature::ForceX), 0),
        (&curve(Feature::RateMagnitude), 0),
        (&|gyro| gyro.increment_weight_over_rate = Some(constant(1e-6)), 0),
    ];
    for (index, (change, kept)) in changes.into_iter().enumerate() {
        let mut unit = drive::unit(&with(&|_| {}));
        let mut out = Vec::new();
        for k in 0..1000 {
            if k == 700 {
                let [start, end] = [200, 600].map(end_of);
                let reference = Reference { start, end, angular_rate: [0.0; 3], sigma: 1e-6 };
                drive::hand(&mut unit, &Owned::Reference(reference), &mut out);
            }
            drive::hand(&mut unit, &Owned::Accel(vec![accel(k, &[0.0, 0.0, 9.8])]), &mut out);
            drive::hand(&mut unit, &Owned::Gyro(vec![gyro(k, &[0.01, 0.02, 0.03])]), &mut out);
        }
        let updates =
            |unit: &Unit| unit.drift().iter().map(|drift| drift.unwrap().updates).collect::<Vec<_>>();
        assert_eq!(updates(&unit), [1, 1, 1]);
        unit.install(with(change), 2);
        assert_eq!(updates(&unit), [1, kept, 1], "change {index}");
    }
}

#[test]
fn i3_ticks_that_waited_for_a_swap_and_do_not_fit_it_are_announced() {
    let mut counts = identity();
    counts.gyro_output = OutputKind::Counts;
    let mut unit = drive::unit(&compile(&identity()));
    let mut out = Vec::new();
    // Without accelerometer ticks they wait.
    let ticks: Vec<_> = (0..5).map(|k| gyro(k, &[0.1; 3])).collect();
    drive::hand(&mut unit, &Owned::Gyro(ticks), &mut out);
    unit.install(compile(&counts), 2);
    let ticks: Vec<_> = (5..30).map(|k| gyro(k, &[7.0; 3])).collect();
    let gyros = isotherm_correction::unit::Event::Gyro { output: OutputKind::Counts, ticks: &ticks };
    unit.handle(gyros, &mut |tick| out.push(tick.clone()));
    unit.handle(isotherm_correction::unit::Event::Flush, &mut |tick| out.push(tick.clone()));
    assert_eq!((out[0].sequence, out[0].missed), (5, 5), "{:?}", out[0]);
    assert_eq!(out.len(), 25);
    assert_eq!(unit.counters().wrong_output_kind, 5);
}
