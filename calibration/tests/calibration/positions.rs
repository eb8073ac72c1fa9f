//! `positions`: a simulated stand with its errors, from the log to the document.

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::document::complete;
use isotherm_calibration::fits::positions::fit::{Analysis, Settings, analyse};
use isotherm_calibration::fits::positions::judged::judge;
use isotherm_calibration::fits::positions::model::SMALL;
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_calibration::fits::positions::times::Times;
use isotherm_calibration::fits::positions::track::Track;
use isotherm_correction::thermal::Feature;
use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::document::{Curve, OrientationThermal, Shape};
use nalgebra::DVector;

use crate::stand::judging::{
    HOUSING_ABOVE_DEG_C, away, chi_square, found_in_room, plausible, quick, settings, times, tracks,
};
use crate::stand::{self, ARCSEC, GRAVITY, HZ_PER_V, Stand};

#[test]
fn twelve_positions_with_random_stand_errors_find_the_axes_within_their_covariance() {
    let (plan, document) = (Plan::twelve(), Written::of(&stand::document()).unwrap());
    let instrument = stand::instrument();
    let truth = stand::true_rows(&instrument, 20.0 + HOUSING_ABOVE_DEG_C);
    let (mut axes, mut stands, mut fits) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..200 {
        let how = quick(seed);
        let found = found_in_room(&instrument, &plan, &document, &how);
        let error = away(&found, &truth, 0, false);
        axes.push(chi_square(&error, found.fit.axes_covariance(0)));
        let from = found.fit.solution.parameters.len() - 3;
        let block = found.fit.solution.covariance.view((from, from), (3, 3)) * (SMALL * SMALL);
        let errors = DVector::from_fn(3, |i, _| found.fit.stand[i].0 - how.errors[i]);
        stands.push(chi_square(&errors, block.into_owned()));
        fits.push(found.fit.solution.chi_square);
        let sigma = found.fit.axis_sigma(0, 0)[1] / ARCSEC;
        assert!(sigma < 4.0, "{sigma}″: four positions for every element");
    }
    plausible("axes", &axes, 6.0);
    plausible("stand", &stands, 3.0);
    // 36 outputs and the prior of three errors, for fifteen parameters.
    plausible("residuals", &fits, 24.0);
}

/// One row per accelerometer.
type Rows = [[f64; 3]; 3];

/// A unit whose axes go with temperature as they are told to, at five temperatures; slopes and bends.
fn over_temperature(seed: u64, bend: f64) -> (Analysis, [Rows; 2]) {
    let plan = Plan::twelve();
    let document = Written::of(&stand::document()).unwrap();
    let level = stand::true_rows(&stand::instrument(), 20.0);
    // Some ″/°C of silicon; the quadratic part is 40″ at the ends.
    let slopes = [[0.0, 2.5e-5, -1.2e-5], [-0.9e-5, 0.0, 2.1e-5], [1.6e-5, -2.8e-5, 0.0]];
    let bends = [[0.0, 8e-8, -5e-8], [-6e-8, 0.0, 7e-8], [5e-8, -8e-8, 0.0]]
        .map(|row: [f64; 3]| row.map(|c| c * bend));
    let (mut runs, mut rows) = (Vec::new(), Vec::new());
    let errors = quick(seed).errors;
    for (index, deg_c) in [-40.0, -10.0, 20.0, 45.0, 70.0].into_iter().enumerate() {
        let away = deg_c + HOUSING_ABOVE_DEG_C - 20.0;
        let axes = [0, 1, 2]
            .map(|s| [0, 1, 2].map(|i| level[s][i] + slopes[s][i] * away + bends[s][i] * away * away));
        let how = Stand { errors, ..quick(seed * 10 + index as u64 + 7) };
        let order: Vec<usize> = (0..12).collect();
        let (events, held) = stand::log(&stand::with_axes(&axes), deg_c, &plan, &order, &how);
        let name = format!("at {deg_c}");
        rows.extend(times(&plan, &name, &held).rows);
        runs.push(stand::run(&name, events));
    }
    let settings = Settings { reference_deg_c: Some(20.0), ..settings(plan, Some(Times { rows })) };
    (analyse(&tracks(&runs, &document), &document.document, &settings).unwrap(), [slopes, bends])
}

#[test]
fn linear_and_quadratic_axes_over_temperature_are_recovered() {
    let (mut straight, mut bent, mut slopes_of, mut bends_of) = (0, 0, Vec::new(), Vec::new());
    for seed in 0..40 {
        let (found, [slopes, _]) = over_temperature(seed, 0.0);
        let scaled = slopes.map(|row| row.map(|c| c * found.half_deg_c));
        slopes_of.push(chi_square(&away(&found, &scaled, 1, false), found.fit.axes_covariance(1)));
        straight += usize::from(found.quadratic.as_ref().unwrap().3 > 1e-3);
        let (found, [_, bends]) = over_temperature(seed, 1.0);
        let quadratic = found.quadratic.as_ref().unwrap();
        bent += usize::from(quadratic.3 < 1e-3);
        let scaled = bends.map(|row| row.map(|c| c * found.half_deg_c * found.half_deg_c));
        bends_of.push(chi_square(&away(&found, &scaled, 2, true), quadratic.0.axes_covariance(2)));
    }
    assert!(straight >= 39, "{straight} of 40 straight ones are seen as straight");
    assert_eq!(bent, 40, "40″ at the ends are seen by every seed");
    plausible("slopes", &slopes_of, 6.0);
    plausible("quadratic terms", &bends_of, 6.0);
    let (found, ..) = over_temperature(1, 1.0);
    insta::assert_snapshot!(found.warnings.join("\n"));
    assert!((found.widened - 1.0).abs() < 1e-12, "the quadratic form describes it: {}", found.widened);
}

#[test]
fn axes_that_do_not_come_back_after_a_cycle_are_told_with_their_turn() {
    use isotherm_calibration::finding::AccelKind;
    let plan = Plan::twelve();
    let document = Written::of(&stand::document()).unwrap();
    let level = stand::true_rows(&stand::instrument(), 20.0);
    let (mut still, mut turns) = (0, Vec::new());
    for seed in 0..12 {
        for moved in [0.0, 30.0 * ARCSEC] {
            let errors = quick(seed).errors;
            let (mut runs, mut rows) = (Vec::new(), Vec::new());
            for (index, deg_c) in [20.0, 60.0, 20.0].into_iter().enumerate() {
                let mut axes = level;
                if index == 2 {
                    // The second accelerometer has turned towards z.
                    axes[1][2] += moved;
                }
                let how = Stand { errors, ..quick(seed * 10 + index as u64 + 3) };
                let order: Vec<usize> = (0..12).collect();
                let (events, held) = stand::log(&stand::with_axes(&axes), deg_c, &plan, &order, &how);
                let name = format!("run {index}");
                rows.extend(times(&plan, &name, &held).rows);
                runs.push(stand::run(&name, events));
            }
            let settings = settings(plan.clone(), Some(Times { rows }));
            let found = analyse(&tracks(&runs, &document), &document.document, &settings).unwrap();
            let [back] = found.returns.as_slice() else { panic!("{:?}", found.returns) };
            assert_eq!(back.runs, [0, 2]);
            let names = ["run 0", "run 1", "run 2"].map(str::to_owned);
            match back.finding(&names) {
                None => still += usize::from(moved == 0.0),
                Some((sensor, AccelKind::AxisMoved { deg_c, turn: [turn, sigma], logs })) => {
                    assert!(moved > 0.0 && sensor == 1, "{turn} ± {sigma}″");
                    assert!((deg_c - 22.0).abs() < 1.0 && logs == ["run 0", "run 2"], "{deg_c}");
                    turns.push((turn - 30.0) / sigma);
                }
                Some(other) => panic!("{other:?}"),
            }
        }
    }
    assert_eq!((still, turns.len()), (12, 12));
    let rms = (turns.iter().map(|x| x * x).sum::<f64>() / 12.0).sqrt();
    assert!((0.4..1.7).contains(&rms), "{turns:?}");
}

/// Turns between the positions, poses found in the log, at 10 Hz.
fn driven(seed: u64) -> Stand {
    Stand { tick_ns: 100_000_000, hold_s: 14.0, turn_deg_per_s: Some(15.0), ..quick(seed) }
}

#[test]
fn poses_are_found_and_known_though_some_are_missing_and_some_repeated() {
    let (plan, document) = (Plan::twelve(), Written::of(&stand::document()).unwrap());
    let instrument = stand::instrument();
    let truth = stand::true_rows(&instrument, 20.0 + HOUSING_ABOVE_DEG_C);
    let all: Vec<usize> = (0..12).collect();
    let cases = [
        ("all", all.clone(), 12, ""),
        ("two missing", vec![0, 1, 2, 4, 5, 6, 7, 8, 9, 11], 10, "missing positions: X up a, Z down b"),
        (
            "one repeated",
            vec![0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 2],
            13,
            "repeated positions, all of them used: Z down a",
        ),
        ("another order", vec![0, 4, 2, 3, 1, 7, 5, 6, 11, 9, 10, 8], 12, ""),
        ("six", vec![0, 2, 3, 4, 5, 6], 6, "do not separate the stand's level from the axes"),
    ];
    for (name, order, count, words) in cases {
        let (events, held) = stand::log(&instrument, 20.0, &plan, &order, &driven(5));
        let runs = [stand::run("room", events)];
        let found =
            analyse(&tracks(&runs, &document), &document.document, &settings(plan.clone(), None)).unwrap();
        assert_eq!(found.poses.len(), count, "{name}");
        for ((pose, position), (span, planned)) in found.poses.iter().zip(&held) {
            assert_eq!(position, planned, "{name}: {:?}", pose.span_s);
            assert!(
                pose.span_s[0] > span[0] && pose.span_s[1] < span[1] + 1e-6,
                "{name}: {:?} in {span:?}",
                pose.span_s
            );
        }
        assert!(
            words.is_empty() || found.warnings.iter().any(|w| w.contains(words)),
            "{name}: {:?}",
            found.warnings
        );
        let chi_square = chi_square(&away(&found, &truth, 0, false), found.fit.axes_covariance(0));
        assert!(chi_square < 22.5, "{name}: χ² {chi_square} with 6 degrees, 0.1 %");
    }
}

#[test]
fn logs_that_begin_elsewhere_in_the_plan_do_not_contradict_each_other() {
    let (plan, document) = (Plan::twelve(), Written::of(&stand::document()).unwrap());
    let all: Vec<usize> = (0..12).collect();
    let swapped = [&[1, 0][..], &all[2..]].concat();
    let short = vec![1, 0, 2, 3, 4, 5, 6, 8];
    // Half a turn away it is the plan's order: 0 to 5.
    let far = vec![1, 0, 10, 11, 8, 9];
    let mut told = Vec::new();
    for (orders, plan) in [
        (vec![all.clone(), swapped.clone()], plan.clone()),
        (vec![all.clone(), short], plan.clone()),
        (vec![all.clone(), far], plan.clone()),
        (vec![swapped], plan),
        (vec![all], Plan::six()),
    ] {
        let mut runs = Vec::new();
        let mut planned = Vec::new();
        for (index, order) in (0..).zip(&orders) {
            let how = Stand { errors: [30.0, -20.0, 15.0].map(|error| error * ARCSEC), ..driven(60 + index) };
            let (events, _) = stand::log(&stand::instrument(), 20.0, &Plan::twelve(), order, &how);
            runs.push(stand::run(&format!("log {index}"), events));
            let names = order.iter().map(|at| Plan::twelve().positions[*at].name.clone());
            planned.extend(names.filter(|name| plan.index_of(name).is_some()));
        }
        let found =
            analyse(&tracks(&runs, &document), &document.document, &settings(plan.clone(), None)).unwrap();
        let names = found.poses.iter().map(|(_, position)| plan.positions[*position].name.clone());
        assert_eq!(names.collect::<Vec<_>>(), planned);
        told.push(found.warnings.join("\n"));
    }
    insta::assert_snapshot!(told.join("\n\n"));
}

#[test]
fn the_document_gives_the_right_vectors_through_the_service_to_the_last_digit_that_is_stated() {
    let (plan, base) = (Plan::twelve(), Written::of(&stand::document()).unwrap());
    let instrument = stand::instrument();
    let order: Vec<usize> = (0..12).collect();
    let mut runs = Vec::new();
    let mut logs = Vec::new();
    for (index, deg_c) in [-30.0, 20.0, 60.0].into_iter().enumerate() {
        let how = Stand { positioning: 0.0, seed: 90 + index as u64, ..driven(9) };
        let (events, _) = stand::log(&instrument, deg_c, &plan, &order, &how);
        logs.push(events.clone());
        runs.push(stand::run(&format!("at {deg_c}"), events));
    }
    let exact = Settings { positioning_rad: 0.05 * ARCSEC, ..settings(plan.clone(), None) };
    let found = analyse(&tracks(&runs, &base), &base.document, &exact).unwrap();
    let document = complete(&base.document, &found, GRAVITY);
    let written = Written::of(&document).unwrap();
    let errors = found.fit.stand.map(|(error, _)| error);
    let (before, after) = (tracks(&runs, &base), tracks(&runs, &written));
    let judged = judge(&plan, errors, GRAVITY, &found.poses, [&before, &after], &found.channels);
    assert_eq!(judged.len(), 36);
    for judgement in &judged {
        // Noise of a mean over ten seconds is 1e-5 m/s², and what positions do not know of the stand is nothing.
        assert!(judgement.error[1].iter().all(|e| e.abs() < 1e-4), "{judgement:?}");
        assert!(judgement.error[0].iter().any(|e| e.abs() > 1e-2), "{judgement:?}");
        assert!(judgement.length[1].abs() < 1e-4, "{judgement:?}");
    }
    // The same through the corrector once more, tick by tick.
    for (judgement, (pose, position)) in judged.iter().zip(&found.poses) {
        let mut unit = written.loaded.stream(UnitSettings::default());
        let mut ticks = Vec::new();
        for event in &logs[pose.run] {
            unit.handle(event.into());
            ticks.extend(unit.take_ready());
        }
        unit.flush();
        ticks.extend(unit.take_ready());
        let own = &ticks[pose.ticks.clone()];
        let seconds: f64 = own.iter().map(|tick| tick.duration.as_s()).sum();
        let up = plan.up(*position, errors);
        for (axis, up) in up.iter().enumerate() {
            let mean = own.iter().map(|tick| tick.delta_velocity[axis]).sum::<f64>() / seconds;
            let difference = mean - GRAVITY * up - judgement.error[1][axis];
            assert!(difference.abs() < 1e-9 * GRAVITY, "axis {axis}: {difference}");
        }
    }
    // Scale factors and biases are those of the simulated instrument.
    for (sensor, truth) in found.fit.sensors.iter().zip(&instrument.accelerometers.unwrap().sensors) {
        let (k, s) = (sensor.scale[0] / GRAVITY / HZ_PER_V, sensor.bias[0] / HZ_PER_V);
        assert!((k / truth.scale_v_per_m_per_s2[0] - 1.0).abs() < 1e-5, "{k}");
        assert!((s - truth.bias_v[0]).abs() < 1e-5, "{s} {}", truth.bias_v[0]);
        let slope = sensor.scale[1] / sensor.scale[0] / found.half_deg_c;
        assert!((slope / 1.1e-4 - 1.0).abs() < 1e-2, "{slope}");
    }
}

#[test]
fn a_negative_scale_factor_keeps_its_sign_its_axis_and_its_slopes() {
    let (plan, mut document) = (Plan::twelve(), stand::document());
    let instrument = stand::instrument();
    let accel = document.accel.as_mut().unwrap();
    let scale = &mut accel.sensor[2].scale_factor;
    let value = -scale.shape().at(20.0).unwrap();
    *scale = Curve::new(Shape::Constant { value }).in_unit(accel.output.scale_unit());
    accel.orientation.rows[2] = accel.orientation.rows[2].map(|c| -c);
    accel.orientation.thermal = Some(OrientationThermal {
        channels: vec![document.temperature.channel[0].name.clone()],
        reference_deg_c: -60.0,
        range_deg_c: [-60.0, 80.0],
        slopes_arcsec_per_deg_c: vec![[0.0; 3], [0.0; 3], [0.0, 100.0, 0.0]],
        hysteresis: Vec::new(),
    });
    let written = Written::of(&document).unwrap();
    let found = found_in_room(&instrument, &plan, &written, &quick(1));
    let made = complete(&written.document, &found, GRAVITY).accel.unwrap();
    assert!((made.sensor[2].scale_factor.shape().at(20.0).unwrap() / value - 1.0).abs() < 0.1);
    let turned = 100.0 * ARCSEC * (found.slopes_deg_c + 60.0);
    let truth = stand::true_rows(&instrument, 20.0 + HOUSING_ABOVE_DEG_C)[2];
    let row = made.orientation.rows[2];
    assert!((row[2] + 1.0).abs() < 2e-3 && (row[1] - (-truth[1] - turned)).abs() < 2e-3, "{row:?} {truth:?}");
    assert_eq!(found.warnings, Vec::<String>::new());
}

#[test]
fn what_cannot_be_fitted_is_refused_with_what_to_do() {
    let (plan, document) = (Plan::twelve(), Written::of(&stand::document()).unwrap());
    let instrument = stand::instrument();
    let refused = |order: &[usize], how: &Stand, change: &dyn Fn(&mut Track)| {
        let (events, _) = stand::log(&instrument, 20.0, &plan, order, how);
        let mut tracks = tracks(&[stand::run("room", events)], &document);
        tracks.iter_mut().for_each(change);
        analyse(&tracks, &document.document, &settings(plan.clone(), None)).unwrap_err().join("\n")
    };
    let all: Vec<usize> = (0..12).collect();
    let none = |_: &mut Track| {};
    // Z is never up or down.
    let mut told = vec![
        refused(&[0, 1, 3, 5, 6, 7, 9, 11], &driven(3), &none),
        refused(&[0, 2, 3], &driven(3), &none),
        refused(&all, &Stand { hold_s: 3.0, ..driven(3) }, &none),
        refused(&all, &driven(3), &|track| track.outputs[1].fill(0.0)),
        refused(&all, &driven(3), &|track| {
            track.outputs[2].iter_mut().step_by(20).for_each(|x| *x = f64::NAN);
        }),
        refused(&all, &driven(3), &|track| {
            track.outputs[0].iter_mut().for_each(|x| *x = x.min(3e5));
        }),
    ];
    let (events, held) = stand::log(&instrument, 20.0, &plan, &all, &driven(3));
    let own = tracks(&[stand::run("room", events)], &document);
    // Terms that readings hold beside K and S, and rows of the same ticks.
    let mut squared = document.document.clone();
    let two = Curve::new(Shape::Constant { value: 300.0 });
    squared.accel.as_mut().unwrap().sensor[1].set(Feature::ForceSquared, two);
    told.push(analyse(&own, &squared, &settings(plan.clone(), None)).unwrap_err().join("\n"));
    let mut rows = times(&plan, "room", &held);
    let mut two = [own[0].clone(), own[0].clone()];
    "cold".clone_into(&mut two[1].run);
    let without_rows = settings(plan.clone(), Some(rows.clone()));
    told.push(analyse(&two, &document.document, &without_rows).unwrap_err().join("\n"));
    let [start, end] = rows.rows[0].0;
    rows.rows.push(([0.5 * (start + end), end], rows.rows[0].1.clone(), None));
    told.push(analyse(&own, &document.document, &settings(plan.clone(), Some(rows))).unwrap_err().join("\n"));
    // Times that are late: the unit turns, or where the turns are left out, it is elsewhere at the end.
    for how in [driven(3), Stand { turn_deg_per_s: None, ..driven(3) }] {
        let (events, held) = stand::log(&instrument, 20.0, &plan, &all, &how);
        let mut rows = times(&plan, "room", &held);
        rows.rows.iter_mut().for_each(|(span, ..)| *span = [span[0] + 5.0, span[1] + 4.0]);
        let own = tracks(&[stand::run("room", events)], &document);
        told.push(
            analyse(&own, &document.document, &settings(plan.clone(), Some(rows))).unwrap_err().join("\n"),
        );
    }
    // A log without the turns, and not in the plan's order.
    let jumps = Stand { turn_deg_per_s: None, ..driven(3) };
    told.push(refused(&[0, 1, 2, 4, 5, 6, 7, 8, 9, 11], &jumps, &none));
    // Without a document that knows 1 g, x is never up.
    told.push(refused(&[1, 0, 2, 4, 6, 7, 8, 9, 10], &driven(3), &|track| {
        track.force_m_per_s2.iter_mut().flatten().for_each(|force| *force *= 0.1);
    }));
    insta::assert_snapshot!(told.join("\n\n"));
}
