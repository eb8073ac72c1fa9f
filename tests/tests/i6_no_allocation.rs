//! I6: no heap allocation per tick in the core in steady state.

#![expect(clippy::expect_used, reason = "what does not hold ends the test")]

use isotherm_correction::calibration::{BranchArgument, BranchedParts, RegressorParts, Source, TermParts};
use isotherm_correction::drift::Reference;
use isotherm_correction::earth::Place;
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::operation::{Command, State};
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::reversal::ReversalParts;
use isotherm_correction::sample::{GyroTick, LasingMode, OutputKind};
use isotherm_correction::unit::{Event, Unit, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_tests::calibrations::{
    Feature, PutTerms, channel, compile, constant, identity, lively_drift, polynomial,
};
use isotherm_tests::streams::{accel, end_of, gyro, temperature};

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

/// What watches the unit while its allocations are counted.
#[derive(Debug, Clone, Copy)]
enum Watched {
    /// Nobody.
    Plainly,
    /// The drift estimator, fed at rest and by references, subtracted from the output.
    AtRest,
    /// A pre-launch calibration.
    PreLaunch,
    /// A self-test, again and again.
    SelfTest,
}

#[test]
fn i6_a_hundred_thousand_ticks_allocate_nothing() {
    // One after the other: the profiler counts for the whole process.
    for watched in [Watched::Plainly, Watched::AtRest, Watched::PreLaunch, Watched::SelfTest] {
        let (out, blocks) = blocks_of_a_hundred_thousand_ticks(watched);
        // Each self-test makes its memory and its report: ten seconds, 2000 ticks.
        let allowed = if matches!(watched, Watched::SelfTest) { 50 * 40 } else { 0 };
        assert!(blocks <= allowed, "{watched:?}: {blocks} blocks allocated over 100 000 ticks");
        let runs = matches!(watched, Watched::Plainly | Watched::AtRest);
        assert!(if runs { out > 25_000 } else { out < 2600 }, "{watched:?}: {out} navigation steps came out");
    }
}

/// A unit of five gyros with terms of every kind.
fn unit(watched: Watched) -> Unit {
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
        gyro.terms.curve(Feature::One, polynomial(&[1e-4, 1e-5]));
        gyro.terms.curve(Feature::LasingMode, constant(1e-5));
        gyro.terms.branched(Feature::ThermalRate, branched.clone());
        gyro.terms.branched(Feature::ThermalAcceleration, branched);
        gyro.terms.lags([(30.0, constant(1e-5))]);
        gyro.terms.push(TermParts::play(0.5, constant(1e-5)));
        let gradient = RegressorParts {
            channel: Source::Temperature(0),
            minus: Some(Source::Temperature(1)),
            reference: 0.0,
        };
        gyro.terms.push(TermParts::regressor(gradient, constant(1e-5)));
        gyro.drift = matches!(watched, Watched::AtRest).then(lively_drift);
    }
    let settings = UnitSettings {
        subtract_drift: true,
        navigation: NavigationStep::new(4, true).expect("a valid step"),
        ..UnitSettings::default()
    };
    let mut unit = Unit::new(settings);
    unit.install(compile(&parts), 1);
    unit
}

fn blocks_of_a_hundred_thousand_ticks(watched: Watched) -> (u64, u64) {
    let mut unit = unit(watched);
    // Who is watched at rest turns by next to nothing.
    let rate = if matches!(watched, Watched::Plainly) { 1.0 } else { 1e-6 };
    // Every event is made beforehand: what is counted is the core's alone. A gap, a duplicate, a switch and a broken
    // reading come round again and again.
    let ticks: Vec<GyroTick> = (0..110_000_u64)
        .map(|k| GyroTick {
            mode: Some(if (k / 1000) % 2 == 0 { LasingMode::Plus } else { LasingMode::Minus }),
            switch_command: k % 1000 == 0 && k > 0,
            ..gyro(
                k,
                &[
                    0.1 * rate,
                    0.2 * rate,
                    if k % 777 == 0 { f64::NAN } else { 0.3 * rate },
                    (0.1 * 0.6 + 0.3 * 0.8) * rate,
                    (0.2 * 0.6 + 0.3 * 0.8) * rate,
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
    let place = Place::new(55.0, 30.0, Some([0.0; 2])).expect("a place");
    let hours = PreLaunchSettings {
        place: Some(place),
        duration: Span::from_ms(3_600_000),
        ..PreLaunchSettings::default()
    };
    let begin = |unit: &mut Unit, commands: &[Command]| {
        for command in commands {
            assert!(unit.command(command).is_ok(), "{command:?}");
        }
    };
    match watched {
        Watched::Plainly => {}
        Watched::AtRest => begin(&mut unit, &[Command::Rest(place)]),
        Watched::PreLaunch => begin(&mut unit, &[Command::Standby, Command::PreLaunch(hours)]),
        Watched::SelfTest => begin(&mut unit, &[Command::Standby]),
    }
    let profiler = dhat::Profiler::builder().testing().build();
    let before = dhat::HeapStats::get();
    for first in (10_000..110_000).step_by(1000) {
        if matches!(watched, Watched::AtRest) {
            let (start, end) = (end_of(first as u64 - 900), end_of(first as u64 - 100));
            let reference =
                Reference { start, end, angular_rate: [0.1 * rate, 0.2 * rate, 0.3 * rate], sigma: 1e-6 };
            unit.handle(Event::Reference(&reference), &mut |_| {});
        }
        if matches!(watched, Watched::SelfTest) && unit.state() == State::Standby {
            unit.command(&Command::SelfTest).expect("standby takes a self-test");
        }
        feed(&mut unit, first..first + 1000);
    }
    let after = dhat::HeapStats::get();
    drop(profiler);
    (out, after.total_blocks - before.total_blocks)
}
