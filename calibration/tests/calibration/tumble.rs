//! `tumble`: the real log of a unit tumbled by hand, and a simulated one whose constants are known.

use std::path::{Path, PathBuf};

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::bare::{bare, of_run};
use isotherm_calibration::fits::positions::still::StillLimits;
use isotherm_calibration::fits::positions::track::Track;
use isotherm_calibration::fits::tumble::acceleration;
use isotherm_calibration::fits::tumble::document::{self, complete};
use isotherm_calibration::fits::tumble::fit::{Settings, Tumble, analyse};
use isotherm_calibration::fits::tumble::report::Left;
use isotherm_calibration::numbers::Size;
use isotherm_calibration::runs::Run;
use isotherm_correction::thermal::Feature;
use isotherm_correction::unit::UnitSettings;
use isotherm_log::mapping::Mapping;
use isotherm_log::message::Topic;
use isotherm_log::offline::unit_id;
use isotherm_log::part::{LogFiles, Part};
use isotherm_protocol::document::{
    AccelOutput, Argument, Curve, Document, GyroSensor, OrientationThermal, Shape, Trend,
};
use isotherm_simulator::instrument::{Gyros, Instrument};
use isotherm_simulator::presets::mems_chamber;
use nalgebra::Matrix3;
use serde_json::Value;

use crate::command::{data, program, root};
use crate::simulated_logs::write_text;
use crate::stand::{self, Dice, GRAVITY, Stand};

fn constant(shape: &Shape) -> f64 {
    let Shape::Constant { value } = shape else { unreachable!() };
    *value
}

#[test]
fn the_real_tumble_log_gives_the_known_answers() {
    let Some(data) = data("tumble-mems") else { return };
    let files = ["gyro.txt.gz", "acc.txt.gz"].map(|name| data.join(name));
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tumble.toml");
    let mapping = root().join("config/mappings/tumble-mems.toml");
    let done = program(&["tumble"])
        .args(&files)
        .args(["--unit", "TUMBLE-0001", "--gravity", "9.81744", "--json", "--mapping"])
        .arg(&mapping)
        .arg("--out")
        .arg(&out)
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    let written = Written::read(&out).unwrap();
    let accel = written.document.accel.as_ref().unwrap();
    let known = [(2.4130e-3, 33123.8), (2.4270e-3, 33275.1), (2.4119e-3, 32364.5)];
    for (sensor, (scale, bias)) in accel.sensor.iter().zip(known) {
        let per_count = 1.0 / constant(sensor.scale_factor.shape());
        assert!((per_count / scale - 1.0).abs() < 0.01, "{}: {per_count}", sensor.name);
        let found = constant(sensor.terms.curve(Feature::One).unwrap().shape());
        assert!((found - bias).abs() < 1.0, "{}: {found}", sensor.name);
    }
    let residual = written.document.origin.as_ref().unwrap().residual.clone();
    let stated = residual.iter().find(|residual| residual.of == "|f|−g").unwrap().rms_after;
    assert!((stated / 9.8e-4 - 1.0).abs() < 0.05, "{stated}");
    // The same poses through the corrector once more: what the document states is what the service leaves.
    let poses = report["tables"]["Poses"].clone();
    let lengths = through_the_service(&written, &files, &mapping, &poses);
    let rms = Size::of(&lengths).rms;
    assert!((rms / stated - 1.0).abs() < 1e-6, "{rms} {stated}");
    // 1/6258 rad/s per count, which the mapping has, is the first guess of the program that the log came with, not its result: with
    // it the gyros miss the direction of gravity by 44° after a turn, with what is found here by half a degree.
    for sensor in &written.document.gyro.sensor {
        let per_count = sensor.increment_weight_rad_per_rad.unwrap() / 6258.0;
        assert!((per_count * 4775.0 - 1.0).abs() < 0.01, "{}: 1/{}", sensor.name, 1.0 / per_count);
    }
    for sensor in &written.document.gyro.sensor {
        let axes = [Feature::ForceX, Feature::ForceY, Feature::ForceZ];
        let [x, y, z] = axes.map(|axis| constant(sensor.terms.curve(axis).unwrap().shape()));
        let size = libm::sqrt(x * x + y * y + z * z);
        assert!((50.0..1000.0).contains(&size), "{}: {size} (°/h)/g", sensor.name);
    }
    // "Before" is explained: readings in counts are no specific force.
    insta::assert_snapshot!(format!("{:#}", report["notes"]));
}

/// The real log, fitted as the command does.
fn real(files: &[PathBuf; 2]) -> Tumble {
    let mapping = Mapping::load(&root().join("config/mappings/tumble-mems.toml")).unwrap();
    let unit = unit_id("TUMBLE-0001").unwrap();
    let files = LogFiles::Text {
        paths: files.to_vec(),
        mapping: Box::new(mapping),
        unit: unit.clone(),
        batch_ticks: 100,
    };
    let run = Run::new("tumbled".to_owned(), unit, files, &Part::default());
    let document = bare(&run.series().unwrap(), AccelOutput::Volts).unwrap();
    let track = Track::of(&run, &Written::of(&document).unwrap().loaded).unwrap();
    analyse(&track, &Settings { gravity: 9.81744, latitude_deg: None, ..settings() }).unwrap()
}

/// What half of the poses say of drift with acceleration holds in the other half.
#[test]
fn drift_with_acceleration_of_half_of_the_real_poses_holds_in_the_others() {
    let Some(data) = data("tumble-mems") else { return };
    let paths = ["gyro.txt.gz", "acc.txt.gz"].map(|name| data.join(name));
    let tumble = real(&paths);
    let force = tumble.force();
    let mut dice = Dice::new(11);
    for (gyro, most) in [0.45, 0.25, 0.25].into_iter().enumerate() {
        let readings: Vec<f64> = tumble.poses.iter().map(|pose| pose.gyros[gyro]).collect();
        let reading = |pose: usize| readings[pose];
        let share = |order: &[usize]| {
            let (seen, unseen) = order.split_at(order.len() / 2);
            let fit = acceleration::fit(&tumble.poses, &force, &readings, seen).unwrap();
            let mean = seen.iter().map(|pose| reading(*pose)).sum::<f64>() / seen.len() as f64;
            let rms = |of: &dyn Fn(usize) -> f64| {
                Size::of(&unseen.iter().map(|pose| reading(*pose) - of(*pose)).collect::<Vec<_>>()).rms
            };
            rms(&|pose| fit.reading(force[pose])) / rms(&|_| mean)
        };
        let mut shares: Vec<f64> = (0..200)
            .map(|_| {
                let mut order: Vec<(f64, usize)> =
                    (0..force.len()).map(|pose| (dice.normal(), pose)).collect();
                order.sort_by(|a, b| a.0.total_cmp(&b.0));
                share(&order.iter().map(|(_, pose)| *pose).collect::<Vec<_>>())
            })
            .collect();
        shares.sort_by(f64::total_cmp);
        let median = 0.5 * (shares[99] + shares[100]);
        println!("gyro {gyro}: {median:.3} of {} poses", force.len());
        assert!(median <= most, "gyro {gyro}: {median}");
    }
}

/// |f| − g of the poses of a report, from corrected ticks.
fn through_the_service(written: &Written, files: &[PathBuf; 2], mapping: &Path, poses: &Value) -> Vec<f64> {
    let unit = unit_id("TUMBLE-0001").unwrap();
    let mapping = Box::new(Mapping::load(mapping).unwrap());
    let files = LogFiles::Text { paths: files.to_vec(), mapping, unit, batch_ticks: 100 };
    let mut messages = files.open(&Part::default()).unwrap();
    let mut offline = written.loaded.stream(UnitSettings::default());
    let mut ticks = Vec::new();
    while let Some(message) = messages.next_message().unwrap() {
        if let Topic::Raw(_, input) = &message.topic {
            offline.receive(*input, &message.frame).unwrap();
            ticks.extend(offline.take_ready());
        }
    }
    offline.flush();
    ticks.extend(offline.take_ready());
    let first_ns = ticks[0].end_time.as_ns() - ticks[0].duration.as_ns();
    let rows = poses["rows"].as_array().unwrap();
    let number = |cell: &Value| -> f64 { cell.as_str().unwrap().parse().unwrap() };
    let of = |row: &Value| {
        let (from, to) = (number(&row[1]) - 5e-3, number(&row[2]) + 5e-3);
        let (mut sum, mut seconds) = ([0.0; 3], 0.0);
        for tick in &ticks {
            let end = (tick.end_time.as_ns() - first_ns) as f64 * 1e-9;
            let length = tick.duration.as_s();
            if end - length >= from && end <= to {
                sum.iter_mut().zip(tick.delta_velocity).for_each(|(sum, delta)| *sum += delta);
                seconds += length;
            }
        }
        libm::sqrt(sum.iter().map(|v| v * v / (seconds * seconds)).sum()) - 9.81744
    };
    rows.iter().map(of).collect()
}

/// A micromechanical unit put down in random ways, ten ticks a second.
pub(crate) fn tumbled(count: usize, how: &Stand) -> (Instrument, Track, Vec<[f64; 2]>) {
    let instrument = mems_chamber(0).instrument;
    let mut dice = Dice::new(how.seed + 77);
    let attitudes: Vec<Matrix3<f64>> = (0..count).map(|_| stand::any_attitude(&mut dice)).collect();
    let (track, held) = track(&instrument, &attitudes, how);
    (instrument, track, held)
}

/// What a unit that is tumbled reads, without temperatures.
pub(crate) fn tumbled_log(count: usize, seed: u64) -> Vec<isotherm_log::text::LogEvent> {
    let mut dice = Dice::new(seed + 77);
    let attitudes: Vec<Matrix3<f64>> = (0..count).map(|_| stand::any_attitude(&mut dice)).collect();
    let (mut events, _) = stand::through(&mems_chamber(0).instrument, 25.0, &attitudes, &how(seed));
    events.retain(|event| !matches!(event, isotherm_log::text::LogEvent::Temperature(_)));
    events
}

fn track(instrument: &Instrument, attitudes: &[Matrix3<f64>], how: &Stand) -> (Track, Vec<[f64; 2]>) {
    let (mut events, held) = stand::through(instrument, 25.0, attitudes, how);
    // No channels: the log has one temperature.
    events.retain(|event| !matches!(event, isotherm_log::text::LogEvent::Temperature(_)));
    let run = stand::run("tumbled", events);
    let document = bare(&run.series().unwrap(), AccelOutput::MetresPerSecondSquared).unwrap();
    (Track::of(&run, &Written::of(&document).unwrap().loaded).unwrap(), held)
}

pub(crate) fn how(seed: u64) -> Stand {
    Stand {
        errors: [0.0; 3],
        positioning: 0.0,
        tick_ns: 20_000_000,
        hold_s: 4.0,
        start_s: 30.0,
        turn_deg_per_s: Some(60.0),
        seed,
    }
}

pub(crate) fn settings() -> Settings {
    let limits = StillLimits { window_s: 1.0, factor: 4.0, rate_deg_per_s: 1.0, least_s: 1.0, settle_s: 0.0 };
    Settings { gravity: GRAVITY, latitude_deg: Some(55.75), limits, search: true, start_s: 30.0 }
}

#[test]
fn a_simulated_unit_gives_its_own_constants() {
    let (instrument, track, held) = tumbled(36, &how(4));
    let found = analyse(&track, &settings()).unwrap();
    assert_eq!(found.poses.len(), held.len());
    // All parts are 4 °C warmer than the housing, which is 2 °C warmer than the chamber.
    let away = 6.0;
    let block = instrument.accelerometers.as_ref().unwrap();
    let at = |c: [f64; 3]| c[0] + c[1] * away + c[2] * away * away;
    for (index, sensor) in block.sensors.iter().enumerate() {
        let (k, s) = (at(sensor.scale_v_per_m_per_s2), at(sensor.bias_v));
        let sigma = found.accel.sigma;
        assert!((found.accel.scale[index] / k - 1.0).abs() < 4.0 * sigma[index].max(1e-6), "{index}");
        assert!((found.accel.bias[index] - s).abs() < 4.0 * sigma[3 + index].max(1e-5), "{index}");
        assert!(sigma[index] < 2e-4, "{index}: {}", sigma[index]);
    }
    // The case axes are the sensors' own: what does not depend on them are the angles between the axes.
    let true_rows = stand::true_rows(&instrument, 27.0);
    let cosine = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let error = cosine(found.accel.rows[a], found.accel.rows[b]) - cosine(true_rows[a], true_rows[b]);
        assert!(error.abs() < 5e-4, "{a} {b}: {error}");
    }
    let gyro = found.gyro.as_ref().unwrap();
    let Gyros::Mems(gyros) = &instrument.gyros else { unreachable!() };
    for (index, truth) in gyros.iter().enumerate() {
        let k = truth.scale * (1.0 + truth.scale_per_k[0] * away + truth.scale_per_k[1] * away * away);
        let error = gyro.weight[index] / k - 1.0;
        assert!(
            error.abs() < 4.0 * gyro.sigma[index] && gyro.sigma[index] < 2e-3,
            "{index}: {error} {}",
            gyro.sigma[index]
        );
    }
}

#[test]
fn what_cannot_be_fitted_is_refused_with_what_to_do() {
    let refused = |track: &Track| analyse(track, &settings()).unwrap_err().join("\n");
    let (_, few, _) = tumbled(8, &how(5));
    let (_, restless, _) = tumbled(20, &Stand { start_s: 0.0, ..how(6) });
    // Turned about one level axis only.
    let instrument = mems_chamber(0).instrument;
    let wheel: Vec<Matrix3<f64>> = (0..24)
        .map(|k| {
            *nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::x_axis(), 0.7 * f64::from(k)).matrix()
        })
        .collect();
    let (flat, _) = track(&instrument, &wheel, &how(7));
    let (_, good, _) = tumbled(20, &how(8));
    let changed = |change: &dyn Fn(&mut Track)| {
        let mut track = good.clone();
        change(&mut track);
        refused(&track)
    };
    let told = [
        refused(&few),
        refused(&restless),
        refused(&flat),
        changed(&|track| track.gyros[2].fill(0.0)),
        changed(&|track| track.outputs[1].iter_mut().for_each(|x| *x = x.min(5.0))),
        changed(&|track| track.outputs[0].iter_mut().step_by(30).for_each(|x| *x = f64::NAN)),
        changed(&|track| track.outputs.push(track.outputs[0].clone())),
    ];
    insta::assert_snapshot!(told.join("\n\n"));
}

#[test]
fn gyros_that_do_not_follow_the_turns_are_refused_and_the_accelerometers_stand() {
    let (_, good, _) = tumbled(24, &how(9));
    let sound = analyse(&good, &settings()).unwrap();
    let refused = |change: &dyn Fn(&mut Track)| {
        let mut track = good.clone();
        change(&mut track);
        let found = analyse(&track, &settings()).unwrap();
        assert_eq!(found.accel, sound.accel);
        found.gyro.unwrap_err()
    };
    // At their limit in the turns: the fit is far better than before, and still none.
    let clipped =
        refused(&|track| track.gyros.iter_mut().flatten().for_each(|rate| *rate = rate.clamp(-0.5, 0.5)));
    // Rates of another moment.
    let late = refused(&|track| track.gyros.iter_mut().for_each(|column| column.rotate_right(40)));
    insta::assert_snapshot!(format!("{clipped}\n{late}"));
}

#[test]
fn signs_columns_and_units_of_measure_that_a_good_fit_hides_are_pointed_out() {
    let (_, track, _) = tumbled(24, &how(13));
    let series = stand::run("t", tumbled_log(12, 13)).series().unwrap();
    let plain = bare(&series, AccelOutput::MetresPerSecondSquared).unwrap();
    let good = analyse(&track, &settings()).unwrap();
    assert_eq!(complete(&plain, &good).unwrap().1, Vec::<String>::new());
    // A mirrored case: the signs of the first accelerometer and of two gyros. The fit follows them all the same.
    let mut mirrored = track.clone();
    mirrored.outputs[0].iter_mut().for_each(|reading| *reading = -*reading);
    mirrored.gyros.iter_mut().flatten().for_each(|rate| *rate = -*rate);
    let mut told = complete(&plain, &analyse(&mirrored, &settings()).unwrap()).unwrap().1;
    // What fits of other logs come to.
    let of = |base: &Document, change: &dyn Fn(&mut Tumble)| {
        let mut tumble = good.clone();
        change(&mut tumble);
        complete(base, &tumble).unwrap().1
    };
    told.extend(of(&plain, &|tumble| tumble.gyro.as_mut().unwrap().rows.swap(0, 1)));
    let degrees = |tumble: &mut Tumble| tumble.gyro.as_mut().unwrap().weight[1] *= 57.3;
    told.extend(of(&plain, &degrees));
    // A document that states it is believed.
    let mut stated = plain.clone();
    stated.gyro.sensor[1].increment_weight_rad_per_rad = Some(57.1);
    assert!(of(&stated, &degrees).is_empty(), "{:?}", of(&stated, &degrees));
    stated.gyro.sensor[1].increment_weight_rad_per_rad = Some(-57.1);
    told.extend(of(&stated, &degrees));
    told.extend(of(&plain, &|tumble| tumble.accel.scale[0] *= 9.8));
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn what_stays_in_the_document_is_not_found_once_more() {
    let run = stand::run("t", tumbled_log(24, 14));
    let plain = bare(&run.series().unwrap(), AccelOutput::MetresPerSecondSquared).unwrap();
    let fitted = |base: &Document| {
        let base = Written::of(base).unwrap();
        let tumble = analyse(&document::track(&run, &base).unwrap(), &settings()).unwrap();
        let (document, warnings) = complete(&base.document, &tumble).unwrap();
        let written = Written::of(&document).unwrap();
        let left = Left::of(&Track::of(&run, &written.loaded).unwrap(), &tumble, GRAVITY);
        (tumble, warnings.join("\n"), Size::of(&left.angle_deg).rms)
    };
    let (tumble, said, without) = fitted(&plain);
    assert_eq!(said, "");
    let flat = |value: f64| Curve::new(Shape::Constant { value });
    let with = |change: &dyn Fn(&mut GyroSensor)| {
        let mut base = plain.clone();
        base.gyro.sensor.iter_mut().for_each(change);
        let (_, said, left) = fitted(&base);
        assert!((left / without - 1.0).abs() < 0.02, "{left} {without}: {base:?}");
        said
    };
    let knots = vec![[-500.0, 20_000.0], [500.0, 20_000.0]];
    let over_rate = Curve::new(Shape::PiecewiseLinear { knots }).over(Argument::DegPerS);
    let trend = Trend { coefficients_deg_per_h: vec![200.0], interval_h: [0.0, 1.0] };
    assert_eq!(with(&|gyro| gyro.set(Feature::LasingMode, flat(200.0))), "");
    assert_eq!(with(&|gyro| gyro.increment_weight_over_rate = Some(over_rate.clone())), "");
    assert_eq!(with(&|gyro| gyro.trend = Some(trend.clone())), "");
    // What stays holds with the weight that was stated: it goes with the one that is found.
    let mut heavy = plain.clone();
    for gyro in &mut heavy.gyro.sensor {
        gyro.increment_weight_rad_per_rad = Some(2.0);
        gyro.set(Feature::LasingMode, flat(400.0));
    }
    let (weighed, _) = complete(&heavy, &tumble).unwrap();
    for (gyro, weight) in weighed.gyro.sensor.iter().zip(tumble.gyro.as_ref().unwrap().weight) {
        let term = gyro.terms.curve(Feature::LasingMode).unwrap().shape().at(25.0).unwrap();
        assert!((term / (200.0 * weight) - 1.0).abs() < 1e-9, "{term} {weight}");
    }
    // A drift that the poses do not show.
    let mut told = vec![with(&|gyro| gyro.set(Feature::ForceZ, flat(2000.0)))];
    let mut base = plain.clone();
    let slopes_arcsec_per_deg_c = vec![[0.0, 5.0, 0.0]; 3];
    base.gyro.orientation.thermal = Some(OrientationThermal {
        channels: Vec::new(),
        reference_deg_c: 25.0,
        range_deg_c: [0.0, 50.0],
        slopes_arcsec_per_deg_c,
        hysteresis: Vec::new(),
    });
    base.accel.as_mut().unwrap().sensor[1].board_ratio_error = Some(flat(1000.0));
    let (document, warnings) = complete(&base, &tumble).unwrap();
    let scale = constant(document.accel.unwrap().sensor[1].scale_factor.shape());
    assert!((scale / tumble.accel.scale[1] - 1.001).abs() < 1e-9, "{scale}");
    told.extend(warnings);
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn a_unit_on_its_six_faces_only_does_not_state_angles() {
    let instrument = mems_chamber(0).instrument;
    let axis = |k: usize| nalgebra::Vector3::ith_axis(k % 3);
    let quarter = |k: usize, turns: f64| {
        nalgebra::Rotation3::from_axis_angle(&axis(k), turns * 0.5 * std::f64::consts::PI)
    };
    let faces = [
        quarter(0, 0.0),
        quarter(0, 1.0),
        quarter(1, 1.0),
        quarter(0, 2.0),
        quarter(0, -1.0),
        quarter(1, -1.0),
    ];
    let mut dice = Dice::new(11);
    // A table is level to a fraction of a degree: the angles are found from that, and known to as much as nothing.
    let mut on_faces = |edges: f64| -> Track {
        let put = |k: usize| {
            let slant = nalgebra::Vector3::from(dice.vector(0.001)) + axis((k / 6) % 3).into_inner() * edges;
            *(nalgebra::Rotation3::new(slant) * faces[k % 6]).matrix()
        };
        track(&instrument, &(0..18).map(put).collect::<Vec<_>>(), &how(11)).0
    };
    let refused = analyse(&on_faces(0.0), &settings()).unwrap_err().join("\n");
    insta::assert_snapshot!(refused);
    let slanting = analyse(&on_faces(0.6), &settings()).unwrap();
    assert!(
        slanting.accel.sigma[6..].iter().all(|sigma| sigma.to_degrees() < 0.1),
        "{:?}",
        slanting.accel.sigma
    );
}

#[test]
fn poses_that_are_put_down_alike_do_not_vouch_for_each_other() {
    let instrument = mems_chamber(0).instrument;
    let bent = |attitudes: &[Matrix3<f64>], seed: u64| -> Track {
        // Accelerometers that are not straight, beyond what nine parameters hold.
        let mut track = track(&instrument, attitudes, &how(seed)).0;
        for (column, share) in track.outputs.iter_mut().zip([2e-4, -3e-4, 2.5e-4]) {
            for reading in column {
                *reading += share * *reading * *reading;
            }
        }
        track
    };
    for seed in 0..3 {
        let mut dice = Dice::new(500 + seed);
        let ways: Vec<Matrix3<f64>> = (0..16).map(|_| stand::any_attitude(&mut dice)).collect();
        let alike = (0..48).map(|k| {
            *nalgebra::Rotation3::new(nalgebra::Vector3::from(dice.vector(0.05))).matrix() * ways[k % 16]
        });
        let alike: Vec<Matrix3<f64>> = alike.collect();
        let others: Vec<Matrix3<f64>> = (0..36).map(|_| stand::any_attitude(&mut dice)).collect();
        let found = analyse(&bent(&alike, 20 + seed), &settings()).unwrap();
        let new = analyse(&bent(&others, 30 + seed), &settings()).unwrap().poses;
        let left =
            |outputs: &[f64]| libm::sqrt(found.accel.force(outputs).iter().map(|f| f * f).sum()) - GRAVITY;
        let on_others = Size::of(&new.iter().map(|pose| left(&pose.outputs)).collect::<Vec<_>>()).rms;
        let said = Size::of(&found.held_out).rms;
        println!(
            "{seed}: said {said:.5}, on other poses {on_others:.5}, in sample {:.5}",
            Size::of(&found.accel.residual).rms
        );
        assert!(said > 0.5 * on_others, "{said} {on_others}");
    }
}

#[test]
fn poses_that_end_long_before_the_log_are_pointed_out() {
    let (_, good, held) = tumbled(30, &how(12));
    assert_eq!(analyse(&good, &settings()).unwrap().warnings, [""; 0]);
    // From the sixteenth pose on everything is ten times as large: noise too.
    let mut changed = good.clone();
    let first = (0..good.len()).find(|tick| good.start_s(*tick) > held[15][1]).unwrap();
    changed.outputs.iter_mut().flat_map(|column| &mut column[first..]).for_each(|reading| *reading *= 10.0);
    let found = analyse(&changed, &settings()).unwrap();
    assert_eq!(found.poses.len(), 16);
    insta::assert_snapshot!(found.warnings.join("\n"));
}

#[test]
fn accelerometers_are_in_what_the_mapping_states() {
    let folder = tempfile::tempdir().unwrap();
    let (log, path) = (folder.path().join("log.csv"), folder.path().join("mapping.toml"));
    write_text(&log, &path, &isotherm_simulator::Scenario { duration_s: 10.0, ..mems_chamber(4) });
    let text = std::fs::read_to_string(&path).unwrap();
    let (sensors, _) = text.split_once("[[file.temperature]]").unwrap();
    let output = |unit: &str, given: Option<&str>| {
        let states = |column: usize| format!("column = {column}, unit = \"raw\"");
        let in_unit =
            |text: String, column| text.replace(&states(column), &states(column).replace("raw", unit));
        let mapping = Mapping::parse(&(5..8).fold(sensors.to_owned(), in_unit), "mapping.toml").unwrap();
        let unit = unit_id("MEMS-0001").unwrap();
        let (paths, mapping) = (vec![log.clone()], Box::new(mapping));
        let files = LogFiles::Text { paths, mapping, unit: unit.clone(), batch_ticks: 64 };
        let run = Run::new("log.csv".to_owned(), unit, files, &Part::default());
        Ok::<_, String>(of_run(&run, given).map_err(|error| error.to_string())?.accel.unwrap().output)
    };
    let (force, volts) = (AccelOutput::MetresPerSecondSquared, AccelOutput::Volts);
    assert_eq!(["m_per_s2", "volt", "raw"].map(|unit| output(unit, None).unwrap()), [force, volts, volts]);
    assert_eq!(output("raw", Some("m/s2")), Ok(force));
    insta::assert_snapshot!(output("m_per_s2", Some("V")).unwrap_err());
}
