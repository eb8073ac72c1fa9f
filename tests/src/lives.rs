//! The richest lives of a stream that there are.

use std::sync::Arc;

use crate::calibrations::{
    Feature, PutTerms, compile, constant, every_term, identity, lively_drift, orientation, polynomial,
};
use isotherm_correction::calibration::{BranchArgument, BranchedParts, Calibration};
use isotherm_correction::earth::Place;
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::operation::{Command, State};
use isotherm_correction::orientation::OrientationParts;
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::rest::Rest;
use isotherm_correction::unit::{At, PreLaunchView, Uncalibrated, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::document::Document;
use isotherm_protocol::journal::JournalEvent;
use isotherm_protocol::stream::UnitStream;

use crate::script::{Meets, Scenario, Script};

/// Four gyros of which one is skewed, mode reversal, servo, lags, drift, parity, self-test.
///
/// # Panics
/// Never: the document is sound.
#[must_use]
pub fn full() -> Arc<Calibration> {
    let text = include_str!("inputs/example-0001.toml");
    Arc::new(Document::parse(text, None).expect("the fixture is sound").calibration)
}

/// Its channels, with a raw value each.
pub const FULL_CHANNELS: [(&str, f64); 4] =
    [("block", 1.8), ("coil", 25.0), ("accel", 4770.0), ("board", 72.5)];

/// Six gyros on a cone, every thermal term on, a drift so lively that it is followed; `tweak` is what differs.
#[must_use]
pub fn skewed(tweak: f64) -> Arc<Calibration> {
    let mut parts = identity();
    parts.filter.grid_step_s = 0.1;
    parts.filter.smoothing_s = 0.3;
    parts.filter.derivative_step_s = 0.2;
    // 60° apart. Roots are the same on every machine, sines need not be.
    let far = 0.75_f64.sqrt();
    let rows = [[1.0, 0.0], [0.5, far], [-0.5, far], [-1.0, 0.0], [-0.5, -far], [0.5, -far]]
        .map(|[x, y]| [0.8 * x, 0.8 * y, 0.6]);
    parts.gyro_orientation = OrientationParts {
        slopes_per_deg_c: vec![[1e-6, -2e-6, 3e-6]; 6],
        parity_limit: Some(5e-3),
        parity_confirm_ticks: 40,
        ..orientation(&rows)
    };
    parts.gyros = vec![parts.gyros[0].clone(); 6];
    for (i, gyro) in (0..6).zip(&mut parts.gyros) {
        gyro.terms.curve(Feature::One, polynomial(&[1e-4 * (1.0 + tweak), 1e-5 * f64::from(i)]));
        let branched = BranchedParts {
            argument: BranchArgument::Temperature,
            run_up: constant(1e-4),
            braking: constant(2e-4),
        };
        gyro.terms.branched(Feature::ThermalRate, branched.clone());
        gyro.terms.branched(Feature::ThermalAcceleration, branched);
        gyro.terms.lags([2.0, 7.0].map(|time_constant_s| (time_constant_s, constant(1e-4))));
        gyro.drift = Some(lively_drift());
    }
    compile(&parts)
}

/// Where it stands.
///
/// # Panics
/// Never: there is such a place.
#[must_use]
pub fn place() -> Place {
    Place::new(55.0, 30.0, Some([0.1, -0.2])).expect("the fixture is sound")
}

/// A pre-launch calibration that is content with half a minute of each mode.
#[must_use]
pub fn pre_launch(duration: Span) -> Command {
    let mut settings = PreLaunchSettings { duration, place: Some(place()), ..PreLaunchSettings::default() };
    settings.limits.time_per_mode = Span::from_ms(30_000);
    Command::PreLaunch(settings)
}

fn in_state<const STATE: u8>(stream: &UnitStream) -> bool {
    stream.unit().state() as u8 == STATE
}

const WAITING: Meets = ("with ticks that wait", |stream| stream.is_waiting());
const PENDING: Meets = ("with a change that waits", |stream| stream.unit().pending().is_some());
const READY: Meets = ("with outputs that were not taken", |stream| !stream.ready().is_empty());
const STANDBY: Meets = ("in standby", in_state::<{ State::Standby as u8 }>);
const SELF_TEST: Meets = ("in self-test", in_state::<{ State::SelfTest as u8 }>);
const PRE_LAUNCH: Meets = ("in pre-launch calibration", in_state::<{ State::PreLaunchCalibration as u8 }>);
const PRE_LAUNCH_ENDED: Meets = ("after a pre-launch calibration", |stream| {
    matches!(stream.unit().pre_launch(), Some(PreLaunchView::Ended(_)))
});
const SWITCHING: Meets =
    ("in a mode switch", |stream| stream.unit().observation().is_some_and(|seen| !seen.settled));
const AT_REST: Meets =
    ("at rest", |stream| stream.unit().at_rest().is_some_and(|rest| rest.rest() == Rest::Still));
const DRIFTING: Meets = ("with an estimate of the drift", |stream| {
    stream.unit().drift().iter().flatten().any(|estimate| estimate.updates > 0)
});
const EXCLUDED: Meets =
    ("with a gyro excluded", |stream| stream.unit().gyro_health().iter().any(|health| health.excluded > 0));

/// Every one, by what it is about.
///
/// # Panics
/// Never: they are sound.
#[must_use]
pub fn all() -> Vec<Scenario> {
    vec![mode_reversal(), excluded(), navigation(), states(), drift(), swaps(), uncalibrated(), terms()]
}

/// Switches of the lasing mode, with mishaps.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn mode_reversal() -> Scenario {
    let mut script = Script::new(11, &full(), &FULL_CHANNELS);
    (script.mishaps, script.switches, script.batch) = (3, 64, 3);
    script.ticks(3000);
    script.event(JournalEvent::Flushed);
    script.restart();
    script.ticks(1500);
    script.scenario("mode reversal with mishaps", UnitSettings::default(), vec![WAITING, SWITCHING, READY])
}

/// Six skewed gyros of which one fails.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn excluded() -> Scenario {
    let mut script = Script::new(12, &skewed(0.0), &[("t", 24.0)]);
    (script.fails, script.mishaps) = (Some((4, 2200)), 1);
    script.ticks(3000);
    script.scenario("six skewed gyros of which one fails", UnitSettings::default(), vec![WAITING, EXCLUDED])
}

/// Navigation steps over mode switches.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn navigation() -> Scenario {
    let mut script = Script::new(13, &full(), &FULL_CHANNELS);
    (script.switches, script.batch, script.mishaps) = (97, 1, 1);
    script.ticks(2000);
    let navigation = NavigationStep::new(7, true).expect("the fixture is sound");
    script.scenario("navigation steps", UnitSettings { navigation, ..UnitSettings::default() }, vec![WAITING])
}

/// Self-test and pre-launch calibration, in all their endings.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn states() -> Scenario {
    let mut script = Script::new(14, &full(), &FULL_CHANNELS);
    (script.tick, script.batch, script.switches) = (Span::from_ms(20), 5, 250);
    script.ticks(300);
    script.command(Command::Standby, true);
    script.ticks(200);
    script.command(Command::SelfTest, true);
    script.command(Command::Run { reversal: None }, false);
    script.ticks(900);
    script.command(pre_launch(Span::from_ms(65_000)), true);
    script.ticks(4000);
    script.command(Command::SelfTest, true);
    script.ticks(100);
    script.event(JournalEvent::SelfTestExpired);
    script.command(pre_launch(Span::from_ms(40_000)), true);
    script.ticks(400);
    script.event(JournalEvent::PreLaunchEnded);
    script.command(pre_launch(Span::from_ms(40_000)), true);
    script.ticks(100);
    script.command(Command::Abort, true);
    script.command(Command::Run { reversal: Some(true) }, true);
    script.ticks(600);
    let meets = vec![STANDBY, SELF_TEST, PRE_LAUNCH, PRE_LAUNCH_ENDED];
    script.scenario("self-test and pre-launch calibration", UnitSettings::default(), meets)
}

/// Drift from references, then at rest.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn drift() -> Scenario {
    let mut script = Script::new(15, &skewed(0.0), &[("t", 24.0)]);
    (script.tick, script.batch, script.scatter) = (Span::from_ms(20), 5, 0.5);
    for _ in 0..20 {
        script.ticks(50);
        script.reference();
    }
    script.command(Command::Rest(place()), true);
    script.ticks(7000);
    let calibration = skewed(1e-3);
    script.give(calibration, At::NextTick, Span::from_ms(3000));
    script.ticks(300);
    script.command(Command::EndRest, true);
    script.ticks(100);
    let settings = UnitSettings { subtract_drift: true, ..UnitSettings::default() };
    script.scenario("drift from references and at rest", settings, vec![DRIFTING, AT_REST])
}

/// Slews and changes that wait.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn swaps() -> Scenario {
    let sets = [skewed(0.0), skewed(0.5), skewed(-0.25)];
    let mut script = Script::new(16, &sets[0], &[("t", 24.0)]);
    script.mishaps = 2;
    for set in sets.iter().cycle().take(12) {
        script.ticks(120);
        script.give(Arc::clone(set), At::NextTick, Span::from_ms(900));
        script.ticks(60);
        script.give_later(&sets[1], 90, Span::from_ms(700));
        script.ticks(140);
    }
    script.scenario("slews and changes that wait", UnitSettings::default(), vec![PENDING, WAITING])
}

/// Held until a calibration comes.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn uncalibrated() -> Scenario {
    let mut script = Script::new(17, &full(), &FULL_CHANNELS);
    // Its calibration comes late.
    script.steps.clear();
    script.mishaps = 2;
    script.ticks(300);
    script.give_later(&full(), 100, Span::ZERO);
    script.ticks(700);
    let settings = UnitSettings { uncalibrated: Uncalibrated::Hold, ..UnitSettings::default() };
    script.scenario("held without a calibration", settings, vec![PENDING, WAITING])
}

/// Every term that there is, over a restart and a swap to what is there already.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn terms() -> Scenario {
    let calibration = compile(&every_term());
    let mut script = Script::new(18, &calibration, &[("t", 24.0), ("u", 5.0), ("v", 3.0)]);
    (script.mishaps, script.scatter) = (2, 3.0);
    script.ticks(2500);
    script.restart();
    script.ticks(1000);
    script.give(calibration, At::NextTick, Span::from_ms(900));
    script.ticks(500);
    script.scenario("every term", UnitSettings::default(), vec![WAITING])
}

/// Whatever chance brings, over so many rounds of a few ticks.
///
/// # Panics
/// Never: it is sound.
#[must_use]
pub fn anything(seed: u64, rounds: u64) -> Scenario {
    let sets = [full(), full()];
    let mut script = Script::new(seed, &sets[0], &FULL_CHANNELS);
    (script.mishaps, script.switches) = (script.dice.below(6), 40 + script.dice.below(100));
    script.batch = 1 + script.dice.below(6);
    for _ in 0..rounds {
        script.ticks(8);
        match script.dice.below(60) {
            0 => script.restart(),
            1 => script.event(JournalEvent::Flushed),
            2 => script.give(Arc::clone(&sets[1]), At::NextTick, Span::from_ms(200)),
            3 | 4 => script.give_later(&sets[1], 50, Span::from_ms(100)),
            5 | 6 => script.reference(),
            7 => script.event(JournalEvent::SelfTestExpired),
            _ => {}
        }
    }
    script.scenario("anything", UnitSettings::default(), Vec::new())
}
