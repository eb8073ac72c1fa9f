//! How what was found on the stand is held against the truth.

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::fit::{Analysis, Settings, analyse};
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_calibration::fits::positions::still::StillLimits;
use isotherm_calibration::fits::positions::times::Times;
use isotherm_calibration::fits::positions::track::Track;
use isotherm_calibration::runs::Run;
use isotherm_simulator::instrument::Instrument;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::{ARCSEC, Dice, GRAVITY, Stand};

pub(crate) const POSITIONING: f64 = 5.385 * ARCSEC;
pub(crate) const LEVELLING: f64 = 60.0 * ARCSEC;
/// The housing is warmer than the chamber, and C follows it.
pub(crate) const HOUSING_ABOVE_DEG_C: f64 = 2.0;

pub(crate) fn settings(plan: Plan, times: Option<Times>) -> Settings {
    Settings {
        plan,
        gravity: GRAVITY,
        limits: StillLimits { window_s: 1.0, factor: 4.0, rate_deg_per_s: 0.2, least_s: 8.0, settle_s: 2.0 },
        times,
        positioning_rad: POSITIONING,
        levelling_rad: LEVELLING,
        channels: vec!["housing".to_owned()],
        reference_deg_c: None,
    }
}

/// Slow ticks and short holds, for many seeds: noise and errors of the stand are what they are at any tick rate.
pub(crate) fn quick(seed: u64) -> Stand {
    Stand {
        errors: Dice::new(seed ^ 0xabcd).vector(LEVELLING),
        positioning: POSITIONING,
        tick_ns: 1_000_000_000,
        hold_s: 20.0,
        start_s: 0.0,
        turn_deg_per_s: None,
        seed,
    }
}

pub(crate) fn times(plan: &Plan, log: &str, held: &[([f64; 2], usize)]) -> Times {
    let row = |(span, position): &([f64; 2], usize)| {
        (*span, plan.positions[*position].name.clone(), Some(log.to_owned()))
    };
    Times { rows: held.iter().map(row).collect() }
}

/// What is found of a unit that a stand with random errors held in all positions of a plan at 20 °C.
pub(crate) fn found_in_room(
    instrument: &Instrument,
    plan: &Plan,
    document: &Written,
    how: &Stand,
) -> Analysis {
    let all: Vec<usize> = (0..plan.positions.len()).collect();
    let (events, held) = super::log(instrument, 20.0, plan, &all, how);
    let runs = [super::run("room", events)];
    let settings = settings(plan.clone(), Some(times(plan, "room", &held)));
    analyse(&tracks(&runs, document), &document.document, &settings).unwrap()
}

pub(crate) fn tracks(runs: &[Run], written: &Written) -> Vec<Track> {
    runs.iter().map(|run| Track::of(run, &written.loaded).unwrap()).collect()
}

/// Difference from the true axes at one power, as two angles per accelerometer.
pub(crate) fn away(analysis: &Analysis, rows: &[[f64; 3]], power: usize, quadratic: bool) -> DVector<f64> {
    let fit = if quadratic { &analysis.quadratic.as_ref().unwrap().0 } else { &analysis.fit };
    let angles = fit.sensors.iter().zip(&fit.guess).zip(rows).flat_map(|((sensor, guess), truth)| {
        let error = [0, 1, 2].map(|i| sensor.axis[power][i] - truth[i]);
        guess.across.map(|across| (0..3).map(|i| error[i] * across[i]).sum::<f64>())
    });
    DVector::from_vec(angles.collect())
}

pub(crate) fn chi_square(away: &DVector<f64>, covariance: DMatrix<f64>) -> f64 {
    away.dot(&covariance.cholesky().unwrap().solve(away))
}

/// χ² of many seeds must be neither too large nor too small, in sum and in both tails.
#[track_caller]
pub(crate) fn plausible(what: &str, values: &[f64], degrees: f64) {
    let sum: f64 = values.iter().sum();
    let all = ChiSquared::new(degrees * values.len() as f64).unwrap();
    let one = ChiSquared::new(degrees).unwrap();
    let share = |low: f64, high: f64| values.iter().filter(|v| (low..high).contains(&one.cdf(**v))).count();
    let (lower, upper) = (share(0.0, 0.05), share(0.95, 2.0));
    let mean = sum / (degrees * values.len() as f64);
    println!(
        "{what}: χ² per degree {mean:.3}, p {:.4}; {lower} below 5 %, {upper} above 95 % of {}",
        all.cdf(sum),
        values.len()
    );
    assert!((0.001..0.999).contains(&all.cdf(sum)), "{what}: mean χ² per degree {mean}");
    // Five in a hundred in each tail, within three and a half standard deviations.
    let expected = 0.05 * values.len() as f64;
    let room = 3.5 * (0.95 * expected).sqrt();
    for count in [lower, upper] {
        assert!((count as f64 - expected).abs() < room, "{what}: {count} in a tail, {expected} ± {room}");
    }
}
