//! I6: no heap allocation per tick in the core in steady state.

use isotherm_correction::calibration::{BranchArgument, BranchedParts, LagParts};
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::reversal::ReversalParts;
use isotherm_correction::sample::{GyroTick, LasingMode, OutputKind};
use isotherm_correction::unit::{Event, Unit, UnitSettings};
use isotherm_tests::calibrations::{channel, compile, constant, identity, polynomial};
use isotherm_tests::streams::{accel, gyro, temperature};

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

#[test]
fn i6_a_hundred_thousand_ticks_allocate_nothing() {
    let mut parts = identity();
    parts.channels.push(channel("board"));
    parts.reversal = Some(ReversalParts::default());
    parts.gyro_orientation.rows.push([0.6, 0.0, 0.8]);
    parts.gyro_orientation.rows.push([0.0, 0.6, 0.8]);
    parts.gyro_orientation.parity_limit = Some(1e-3);
    parts.gyros.resize(5, parts.gyros[0].clone());
    for gyro in &mut parts.gyros {
        let branched = BranchedParts {
            argument: BranchArgument::Temperature,
            run_up: constant(1e-4),
            braking: constant(2e-4),
        };
        gyro.static_bias = Some(polynomial(&[1e-4, 1e-5]));
        gyro.magnetic_bias = Some(constant(1e-5));
        gyro.thermal_rate = Some(branched.clone());
        gyro.thermal_acceleration = Some(branched);
        gyro.lags = vec![LagParts { time_constant_s: 30.0, gain: constant(1e-5) }];
    }
    let settings = UnitSettings {
        navigation: NavigationStep::new(4, true).expect("a valid step"),
        ..UnitSettings::default()
    };
    let mut unit = Unit::new(settings);
    unit.install(compile(&parts), 1);

    // Every event is made beforehand: what is counted is the core's alone. A gap, a duplicate, a switch and a broken
    // reading come round again and again.
    let ticks: Vec<GyroTick> = (0..110_000_u64)
        .map(|k| GyroTick {
            mode: Some(if (k / 1000) % 2 == 0 { LasingMode::Plus } else { LasingMode::Minus }),
            switch_command: k % 1000 == 0 && k > 0,
            ..gyro(
                k,
                &[
                    0.1,
                    0.2,
                    if k % 777 == 0 { f64::NAN } else { 0.3 },
                    0.1 * 0.6 + 0.3 * 0.8,
                    0.2 * 0.6 + 0.3 * 0.8,
                ],
            )
        })
        .collect();
    let accels: Vec<_> = (0..110_000).map(|k| accel(k, &[0.0, 0.0, 9.8])).collect();

    let mut out = 0_u64;
    let mut feed = |unit: &mut Unit, range: std::ops::Range<usize>| {
        for k in range {
            if k % 200 == 0 {
                let reading = temperature(k as u64, [20.0, 21.0, 22.0, 23.0][k % 4]);
                unit.handle(Event::Temperature(&[reading]), &mut |_| {});
            }
            if k % 5000 != 0 {
                unit.handle(Event::Accel { output: OutputKind::Mean, ticks: &accels[k..=k] }, &mut |_| {
                    out += 1;
                });
            }
            let repeated = if k % 3000 == 0 { 2 } else { usize::from(k % 4000 != 1) };
            for _ in 0..repeated {
                unit.handle(Event::Gyro { output: OutputKind::Mean, ticks: &ticks[k..=k] }, &mut |_| {
                    out += 1;
                });
            }
        }
    };
    feed(&mut unit, 0..10_000);
    let profiler = dhat::Profiler::builder().testing().build();
    let before = dhat::HeapStats::get();
    feed(&mut unit, 10_000..110_000);
    let after = dhat::HeapStats::get();
    drop(profiler);
    assert!(out > 25_000, "navigation steps came out: {out}");
    assert_eq!(after.total_blocks - before.total_blocks, 0, "blocks allocated over 100 000 ticks");
}
