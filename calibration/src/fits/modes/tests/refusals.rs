//! Logs that cannot be used are refused, with every reason and what to do.

use isotherm_cli::Exit;
use isotherm_correction::earth::Place;
use isotherm_correction::sample::{GyroTick, LasingMode};
use isotherm_correction::thermal::Feature;
use isotherm_log::offline::unit_id;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{Document, GyroOutput, Shape};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;

use super::fixture::{base, cycle, fitted, scenario, wanted, zeeman};
use crate::document::Written;
use crate::error::Error;
use crate::fits::modes::document;
use crate::fits::modes::fit::{Made, Wanted, make};
use crate::fixture::events;
use crate::runs::Run;

/// Twenty switches, twenty seconds apart.
fn short() -> Scenario {
    let mut scenario = scenario(1, Profile::constant(20.0), 0.5, 20.0);
    scenario.duration_s = 410.0;
    zeeman(&mut scenario).reversal.miss_rms_wavelengths = 0.0;
    scenario
}

/// A run whose gyro ticks were changed; those that are none any more are left out.
fn changed(scenario: &Scenario, mut change: impl FnMut(&mut GyroTick) -> bool) -> Run {
    let kept = events(scenario).into_iter().filter_map(|event| match event {
        LogEvent::Gyro { output, mut tick } => change(&mut tick).then_some(LogEvent::Gyro { output, tick }),
        other => Some(other),
    });
    Run::of_events("changed".into(), unit_id("ZLG-0001").unwrap(), kept.collect())
}

fn made(run: Run, base: &Document) -> Result<Made, Error> {
    let runs = [run];
    make(&wanted(&runs, base))
}

/// Why nothing can be made of a run.
#[track_caller]
fn refused(run: Run, base: &Document) -> String {
    let error = made(run, base).map(|made| made.report().to_text()).unwrap_err();
    assert_eq!(error.exit(), Exit::Failed);
    error.to_string() + "\n"
}

#[test]
fn logs_without_what_a_mode_reversed_gyro_needs_are_refused() {
    let (scenario, base) = (short(), base());
    let seconds = |tick: &GyroTick| tick.end_time.as_ns() / 1_000_000_000;
    let with_mode = |mode: fn(&GyroTick) -> Option<LasingMode>| {
        changed(&scenario, move |tick| {
            tick.mode = mode(tick);
            tick.switch_command = false;
            true
        })
    };
    let mut told = refused(with_mode(|_| None), &base);
    told += &refused(with_mode(|_| Some(LasingMode::Minus)), &base);
    let unbalanced = |tick: &GyroTick| {
        let minus = (tick.end_time.as_ns() / 1_000_000_000) % 40 >= 30;
        Some(if minus { LasingMode::Minus } else { LasingMode::Plus })
    };
    told += &refused(with_mode(unbalanced), &base);
    let few = changed(&scenario, |tick| seconds(tick) < 70);
    told += &refused(few, &base);
    let dead = changed(&scenario, |tick| {
        tick.readings[1] = 0.0;
        true
    });
    told += &refused(dead, &base);
    let nan = changed(&scenario, |tick| {
        if tick.sequence % 3 == 0 {
            tick.readings[2] = f64::NAN;
        }
        true
    });
    told += &refused(nan, &base);
    let gaps = changed(&scenario, |tick| tick.sequence % 10 != 3);
    told += &refused(gaps, &base);
    let nudged = changed(&scenario, |tick| {
        tick.readings[0] += if tick.sequence == 333 { 60.0 } else { 0.0 };
        true
    });
    told += &refused(nudged, &base);
    let turning = changed(&scenario, |tick| {
        tick.readings.iter_mut().for_each(|reading| *reading += 500.0);
        true
    });
    told += &refused(turning, &base);
    insta::assert_snapshot!(told);
}

#[test]
fn readings_that_change_their_scale_or_die_are_refused() {
    let (scenario, base) = (short(), base());
    let late = |tick: &GyroTick| tick.end_time.as_ns() > 205_000_000_000;
    let twice = changed(&scenario, |tick| {
        let factor = if late(tick) { 2.0 } else { 1.0 };
        tick.readings.iter_mut().for_each(|reading| *reading *= factor);
        true
    });
    let mut told = refused(twice, &base);
    let dies = changed(&scenario, |tick| {
        tick.readings[1] *= if late(tick) { 0.0 } else { 1.0 };
        true
    });
    told += &refused(dies, &base);
    let degrees = changed(&scenario, |tick| {
        tick.readings.iter_mut().for_each(|reading| *reading = (*reading * 57.3).round());
        true
    });
    told += &refused(degrees, &base);
    let halves = |change: fn(i32) -> i32| {
        changed(&scenario, move |tick| {
            for counts in tick.half_periods.iter_mut().take(1) {
                (counts.positive, counts.negative) = (change(counts.positive), change(counts.negative));
            }
            true
        })
    };
    told += &refused(halves(|_| 0), &base);
    told += &refused(halves(|counts| 1000 * counts), &base);
    told += &refused(halves(|counts| -counts), &base);
    insta::assert_snapshot!(told);
}

#[test]
fn a_mode_that_comes_late_is_refused_and_one_the_other_way_round_told() {
    let scenario = short();
    let mut held = std::collections::VecDeque::new();
    let late = changed(&scenario, |tick| {
        held.push_back(tick.mode);
        tick.mode = if held.len() > 10 { held.pop_front().flatten() } else { tick.mode };
        true
    });
    let told = refused(late, &base());
    insta::assert_snapshot!(told);
    let made = fitted(&scenario, &base());
    let turned = changed(&scenario, |tick| {
        tick.mode =
            tick.mode.map(|mode| if mode == LasingMode::Plus { LasingMode::Minus } else { LasingMode::Plus });
        true
    });
    let again = make(&wanted(&[turned], &made.written.document)).unwrap();
    insta::assert_snapshot!(format!(
        "as it is\n{}\nturned\n{}",
        made.warnings.join("\n"),
        again.warnings.join("\n")
    ));
}

#[test]
fn thermometers_are_told_with_what_they_read() {
    let (scenario, base) = (short(), base());
    let with = |change: fn(f64, i64) -> f64| {
        let events = events(&scenario).into_iter().map(|event| match event {
            LogEvent::Temperature(mut reading) => {
                reading.raw = change(reading.raw, reading.time.as_ns() / 1_000_000_000);
                LogEvent::Temperature(reading)
            }
            other => other,
        });
        Run::of_events("changed".into(), unit_id("ZLG-0001").unwrap(), events.collect())
    };
    let mut told = refused(with(|raw, _| 100.0 * raw - 150.0 + 273.15), &base);
    told += &refused(with(|_, _| f64::NAN), &base);
    insta::assert_snapshot!(told);
    let made = made(with(|raw, time_s| if time_s < 205 { raw } else { 1.75 }), &base).unwrap();
    insta::assert_snapshot!(made.warnings.join("\n"));
}

#[test]
fn documents_that_do_not_fit_the_log_are_refused() {
    let scenario = short();
    let mut mean = base();
    mean.gyro.output = GyroOutput::Mean;
    for sensor in &mut mean.gyro.sensor {
        sensor.increment_weight_rad_per_rad = sensor.increment_weight_arcsec_per_count.take();
    }
    let mut told = refused(changed(&scenario, |_| true), &mean);
    let mut other = base();
    other.temperature.channel[0].name = "elsewhere".into();
    other.gyro.sensor[0].channel = Some("elsewhere".into());
    told += &refused(changed(&scenario, |_| true), &other);
    insta::assert_snapshot!(told);
    // A document of counts without their weights is refused by its own reader.
    let mut weightless = base();
    weightless.gyro.sensor[0].increment_weight_arcsec_per_count = None;
    let error = Written::of(&weightless).unwrap_err();
    assert!(error.to_string().contains("increment_weight"), "{error}");
}

#[test]
fn a_constant_temperature_leaves_the_constants() {
    let made = fitted(&short(), &base());
    insta::assert_snapshot!(made.report().notes.join("\n"));
    for fit in made.gyros.iter().flatten() {
        assert_eq!(
            (fit.model.static_order, fit.model.magnetic_order, fit.model.meander_order),
            (0, 0, Some(0))
        );
    }
}

#[test]
fn without_an_attitude_the_constant_stays_and_the_rest_is_fitted() {
    let mut scenario = scenario(3, cycle(4.0), 0.5, 60.0);
    zeeman(&mut scenario).reversal.miss_rms_wavelengths = 0.0;
    zeeman(&mut scenario).reversal.meander_half_period_s = 0.0;
    let base = base();
    let runs = [changed(&scenario, |_| true)];
    let made = make(&Wanted { place: None, ..wanted(&runs, &base) }).unwrap();
    insta::assert_snapshot!(made.warnings.join("\n"));
    for (sensor, fit) in made.written.document.gyro.sensor.iter().zip(&made.gyros) {
        let fit = fit.as_ref().unwrap();
        assert!(!sensor.terms.has(Feature::Meander));
        let bias = sensor.terms.curve(Feature::One).unwrap().shape();
        assert!(
            matches!(bias, Shape::Polynomial { coefficients, .. } if coefficients[0].abs() <= 0.0),
            "{bias:?}"
        );
        let [got, sigma] = fit.coefficient(Feature::LasingMode, 0).unwrap();
        assert!(got.abs() > 100.0 * sigma);
    }
    let names: Vec<String> = made.report().coefficients.into_iter().map(|one| one.name).collect();
    let sigmas = document::sigmas(&made);
    assert!(
        sigmas.get("gyro", "x", "static_bias").unwrap()[0] <= 0.0,
        "of what was not fitted nothing is known"
    );
    // Orders that the run cannot tell are not invented.
    let asked = crate::fits::modes::model::Asked { meander_order: Some(1), ..Default::default() };
    let made = make(&Wanted { asked, ..wanted(&runs, &base) }).unwrap();
    insta::assert_snapshot!([names, made.report().warnings].concat().join("\n"));
}

#[test]
fn a_gyro_without_a_fit_keeps_the_terms_of_the_document_though_no_axis_is_worse() {
    let old = fitted(&short(), &base()).written.document;
    let mut made = fitted(&short(), &old);
    assert!(made.report().accepted());
    made.gyros[1] = Err("its means are far off".to_owned());
    let new = document::fitted(&old, &made);
    for feature in [Feature::One, Feature::LasingMode, Feature::Meander] {
        let [kept, old, without] = [&new, &old, &made.before.document]
            .map(|document| document.gyro.sensor[1].terms.curve(feature).cloned());
        assert!(old.is_some() && without.is_none(), "{feature:?}");
        assert_eq!(kept, old);
    }
}

#[test]
fn a_latitude_that_the_gyros_contradict_is_told() {
    let base = base();
    let runs = [changed(&short(), |_| true)];
    let told = |latitude_deg: f64| {
        let place = Place::new(latitude_deg, 30.0, Some([0.0, 0.0])).unwrap();
        let made = make(&Wanted { place: Some(place), ..wanted(&runs, &base) }).unwrap();
        made.warnings.join("\n")
    };
    insta::assert_snapshot!([55.75, 15.75].map(told).join("\n\n"));
}
