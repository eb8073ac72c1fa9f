//! What is said of a tumbled unit.

use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2};
use isotherm_pages::{Axis, Chart, Ink, Panel, Series, Table};
use isotherm_protocol::document::{Document, Sample};
use serde_json::{Value, json};
use std::sync::Arc;

use super::accel::ANGLES;
use super::acceleration::{AtRest, mean_over};
use super::fit::{Settings, Tumble, transitions};
use super::gyro::angle_of;
use crate::axes::AXES;
use crate::document::{accelerometers, rows, scale_at, tidy};
use crate::fits::positions::doubts::LARGEST_LEFT_SHARE;
use crate::fits::positions::pose::Pose;
use crate::fits::positions::track::Track;
use crate::numbers::{ARCSEC_PER_RAD, Size, norm, unit};
use crate::report::{Curve, Report, SAME_SHARE, Sigmas, Verdict, counted, fixed, output_unit, short, six};

/// Times by which the rms may grow in poses that the fit has not seen.
const LARGEST_GROWTH: f64 = 2.0;

/// What a calibration leaves of the poses, by the service's own output.
#[derive(Debug, Clone, PartialEq)]
pub struct Left {
    /// |f| − g by pose (m/s²).
    pub length: Vec<f64>,
    /// Direction of f by pose.
    pub direction: Vec<[f64; 3]>,
    /// Angle between predicted and found direction by turn (°).
    pub angle_deg: Vec<f64>,
    /// Middle of each turn since the run's beginning (s).
    pub turn_s: Vec<f64>,
}

impl Left {
    /// Of the same ticks as the poses and the turns that were found.
    pub fn of(track: &Track, tumble: &Tumble, gravity: f64) -> Self {
        let over = |pose: &Pose| Pose::over(track, pose.run, pose.ticks.clone()).force_m_per_s2;
        let force: Vec<[f64; 3]> = tumble.poses.iter().map(over).collect();
        let [found, direction] =
            [&tumble.force(), &force].map(|force| force.iter().map(|force| unit(*force)).collect::<Vec<_>>());
        let turns = transitions(&tumble.poses, &found, &direction);
        Self {
            length: force.iter().map(|force| norm(*force) - gravity).collect(),
            direction,
            angle_deg: turns.iter().map(|turn| angle_of(track, turn).to_degrees()).collect(),
            turn_s: turns
                .iter()
                .map(|turn| track.start_s(usize::midpoint(turn.ticks[0], turn.ticks[1])))
                .collect(),
        }
    }
}

/// Everything that is said of a run.
pub fn report(
    document: &Document,
    tumble: &Tumble,
    settings: &Settings,
    run: &str,
    [before, after]: [&Left; 2],
) -> Report {
    let title = "Accelerometers and gyros from a tumbled unit";
    let mut report = Report { counted: Some("poses, turns"), ..Report::new(title, &document.unit) };
    let accel = of_accelerometers(tumble, [&before.length, &after.length], settings.gravity);
    let refused = |words: &str| Verdict::new("gyros", "°", [Size::default(); 2]).refused(words);
    let gyro = match &tumble.gyro {
        Err(words) => refused(words),
        Ok(_) if !accel.accepted => refused("they are relative to the accelerometers, which are refused"),
        Ok(_) => of_gyros([before, after]),
    };
    report.verdicts.extend([accel, gyro]);
    report.warnings.clone_from(&tumble.warnings);
    report.notes.push(format!(
        "{}, detected with {} times the variance of the still start; g = {} m/s². z is the input axis of the third \
         accelerometer, y lies in the plane of the second and third. Out of sample: each pose by a fit of all that \
         are more than 15° away from it.",
        counted(tumble.poses.len(), "pose", "poses"),
        tumble.factor,
        six(settings.gravity)
    ));
    report.notes.extend(at_rest(tumble));
    coefficients(document, tumble, &mut report);
    let time_s: Arc<[f64]> = tumble.poses.iter().map(Pose::middle_s).collect();
    report.residuals.push(Curve {
        of: "|f|−g".to_owned(),
        measure: "m/s²".to_owned(),
        run: run.to_owned(),
        sample: Sample::In,
        window_s: 0.0,
        time_s,
        temperature_deg_c: Vec::new(),
        before: before.length.clone(),
        after: after.length.clone(),
    });
    report.charts.push(("What is left".to_owned(), left_chart(tumble, after)));
    report.tables.push(("Poses".to_owned(), pose_rows(tumble, after)));
    report
}

/// What came of the gyros, by the rule of all commands.
pub fn of_gyros([before, after]: [&Left; 2]) -> Verdict {
    let angles = [before, after].map(|left| left.angle_deg.clone());
    let verdict = Verdict::of_values("gyros", "°", angles, None);
    let turns = counted(after.angle_deg.len(), "turn", "turns");
    match verdict.reason.as_str() {
        "" => verdict.remark(format!("{turns} between poses")),
        _ if verdict.accepted => verdict,
        why => {
            let words = format!(
                "{why} over {turns}: they keep the document's terms; turn the unit more often, about all axes"
            );
            verdict.refused(words)
        }
    }
}

/// What came of the accelerometers: held-out poses decide.
fn of_accelerometers(tumble: &Tumble, [before, after]: [&Vec<f64>; 2], gravity: f64) -> Verdict {
    let sizes = [before, after].map(|values| Size::of(values));
    let outside = Size::of(&tumble.held_out);
    let verdict = Verdict::new("|f|−g", "m/s²", sizes).out_of_sample(Some([sizes[0], outside]));
    let left = outside.rms;
    if left.is_nan() || outside.count == 0 || left > LARGEST_LEFT_SHARE * gravity {
        return verdict.refused(format!(
            "{} % of g remain in unseen poses, at most {} % is accepted: were unit of measure and temperature the \
             same throughout, and was the unit left alone in each pose?",
            short(100.0 * left / gravity),
            100.0 * LARGEST_LEFT_SHARE
        ));
    }
    if sizes[1].rms > LARGEST_GROWTH * left {
        return verdict.refused(format!(
            "through the document {} m/s² remain: what it states of board, temperature and time does not go with the log; \
             check the temperature channels of the mapping, or take these terms out, fit, and fit them again afterwards",
            short(sizes[1].rms)
        ));
    }
    let change: Vec<f64> = before.iter().zip(after).map(|(before, after)| after - before).collect();
    if Size::of(&change).rms <= SAME_SHARE * sizes[0].rms {
        return verdict.remark("it changes nothing");
    }
    // Nine coefficients cost something in poses that they were not found from; these may be what the document at hand was found from.
    match left / sizes[0].rms {
        grown if grown > LARGEST_GROWTH => verdict
            .refused("the given document fits these poses better than the new fit: more poses are needed"),
        grown if grown > 1.0 + SAME_SHARE => verdict.remark("no better than the given document"),
        _ => verdict,
    }
}

/// What is left by itself: beside what was there before, it is a line at zero.
fn left_chart(tumble: &Tumble, after: &Left) -> Chart {
    let times = tumble.poses.iter().map(Pose::middle_s);
    let own =
        Series::dots("after", Ink::Corrected, times.zip(after.length.iter().map(|length| length * 1e3)));
    let turns = after.turn_s.iter().copied().zip(after.angle_deg.iter().copied());
    let turns = Series::dots("after", Ink::Corrected, turns);
    Chart::of(
        "|f| − g of each pose, and the angle by which the gyros miss the direction of gravity after each turn.",
        Axis::of("time since the run's beginning", "s"),
        vec![Panel::of("|f|−g", "mm/s²", 170, vec![own]), Panel::of("gyros", "°", 170, vec![turns])],
    )
}

fn pose_rows(tumble: &Tumble, after: &Left) -> Table {
    let poses = tumble.poses.iter().zip(&after.direction).zip(&after.length).enumerate();
    let row = |(index, ((pose, direction), length)): (usize, ((&Pose, &[f64; 3]), &f64))| {
        let mut row = vec![(index + 1).to_string()];
        row.extend(pose.span_s.map(|time| format!("{time:.2}")));
        row.extend(direction.map(|c| fixed(c, 3)));
        row.push(fixed(length * 1e3, 3));
        row
    };
    Table::of(["pose", "from, s", "to, s", "x", "y", "z", "|f|−g, mm/s²"], poses.map(row))
}

/// Reading of a gyro at rest without specific force, or its mean over the poses where that is not known (rad/s of the log).
fn rest(tumble: &Tumble, axis: usize) -> f64 {
    let AtRest { readings, drift } = &tumble.at_rest[axis];
    let mean = |_: &String| mean_over(&tumble.poses, |pose| readings[pose]);
    drift.as_ref().map_or_else(mean, |drift| drift.response.bias)
}

/// Drift of a gyro by the specific force along a case axis and its standard error ((°/h)/g).
fn deg_per_h_per_g(tumble: &Tumble, gyro: usize, along: usize) -> Option<[f64; 2]> {
    let weight = tumble.gyro.as_ref().ok()?.weight[gyro];
    let drift = tumble.at_rest[gyro].drift.as_ref().ok()?;
    let per_g = |value: f64| AngularRate::from_rad_per_s(value * STANDARD_GRAVITY_M_PER_S2).as_deg_per_h();
    Some([
        per_g(weight * drift.response.by_force[along]),
        per_g((weight * drift.response.sigma[1 + along]).abs()),
    ])
}

/// What the gyros read at rest, about their mean and with what follows acceleration taken off.
fn at_rest(tumble: &Tumble) -> Option<String> {
    let gyro = tumble.gyro.as_ref().ok()?;
    let of = |(axis, at_rest): (usize, &AtRest)| match &at_rest.drift {
        Ok(drift) => {
            let [before, after] = drift.sizes.map(|size| {
                fixed(AngularRate::from_rad_per_s(gyro.weight[axis].abs() * size.rms).as_deg_per_h(), 1)
            });
            format!("{} {before} → {after} °/h", AXES[axis])
        }
        Err(why) => format!("{} has no acceleration-sensitive drift stated: {why}", AXES[axis]),
    };
    let gyros = tumble.at_rest.iter().enumerate().map(of).collect::<Vec<_>>();
    Some(format!("Gyros at rest, in unseen poses: {}.", gyros.join("; ")))
}

fn coefficients(document: &Document, tumble: &Tumble, report: &mut Report) {
    let accel = &tumble.accel;
    let sensors = accelerometers(document);
    let output = match output_unit(document) {
        "V" => "V or raw",
        other => other,
    };
    for (axis, name) in AXES.iter().enumerate() {
        let of = |what: &str| format!("accelerometer {name} {what}");
        // With the ratio of the board, as the document has it.
        let stated =
            sensors.get(axis).map(|sensor| scale_at(sensor, tumble.deg_c(document, sensor.channel.as_ref())));
        let per_output = 1.0 / stated.unwrap_or(accel.scale[axis]);
        let unit = format!("m/s² per {output}");
        report.coefficient(of("1/K"), unit, per_output, per_output.abs() * accel.sigma[axis]);
        report.coefficient(of("S"), output, accel.bias[axis], accel.sigma[3 + axis]);
    }
    let mut arcsec = |name: String, value: f64, sigma: f64| {
        report.coefficient(name, "″", value * ARCSEC_PER_RAD, sigma * ARCSEC_PER_RAD);
    };
    for (index, [row, column]) in ANGLES.into_iter().enumerate() {
        let name = format!("accelerometer {} along {}", AXES[row], AXES[column]);
        arcsec(name, accel.rows[row][column], accel.sigma[6 + index]);
    }
    let Ok(gyro) = &tumble.gyro else { return };
    for (axis, name) in AXES.iter().enumerate() {
        for (which, column) in gyro.across(axis).into_iter().enumerate() {
            let name = format!("gyro {name} along {}", AXES[column]);
            arcsec(name, gyro.rows[axis][column], gyro.sigma[3 + 2 * axis + which]);
        }
    }
    for (axis, name) in AXES.iter().enumerate() {
        let of_log = "rad/s per rad/s of the log";
        report.coefficient(format!("gyro {name} K"), of_log, gyro.weight[axis], gyro.sigma[axis]);
        let rest = (gyro.weight[axis] * rest(tumble, axis)).to_degrees();
        report.coefficient(format!("gyro {name} at rest"), "°/s", rest, None);
        for (along, name_of_axis) in AXES.iter().enumerate() {
            if let Some([value, sigma]) = deg_per_h_per_g(tumble, axis, along) {
                report.coefficient(
                    format!("gyro {name} by force along {name_of_axis}"),
                    "(°/h)/g",
                    value,
                    sigma,
                );
            }
        }
    }
}

/// What the document says of the fit beside its coefficients.
pub fn details(tumble: &Tumble, settings: &Settings) -> Value {
    json!({
        "gravity_m_per_s2": settings.gravity,
        "latitude_deg": settings.latitude_deg,
        "poses": tumble.poses.len(),
        "stillness_factor": tumble.factor,
        "window_s": settings.limits.window_s,
        "held_out_rms_m_per_s2": Size::of(&tumble.held_out).rms,
        "accelerometer_covariance": rows(&tumble.accel.covariance),
    })
}

/// Standard errors of scale factors, biases and axes, for what compares documents.
pub fn sigmas(document: &Document, tumble: &Tumble) -> Sigmas {
    let mut sigmas = Sigmas::default();
    let accel = &tumble.accel;
    let arcsec = |rad: f64| tidy(rad * ARCSEC_PER_RAD);
    let mut rows = [[0.0; 3]; 3];
    for ([row, column], sigma) in ANGLES.into_iter().zip(&accel.sigma[6..]) {
        rows[row][column] = arcsec(*sigma);
    }
    for (axis, sensor) in accelerometers(document).iter().enumerate().take(AXES.len()) {
        let scale = tidy(accel.scale[axis].abs() * accel.sigma[axis]);
        sigmas.put(("accel", &sensor.name, "scale_factor"), vec![scale]);
        sigmas.put(("accel", &sensor.name, "bias"), vec![tidy(accel.sigma[3 + axis])]);
        sigmas.put(("accel", &sensor.name, "axis_arcsec"), rows[axis].to_vec());
    }
    let Ok(gyro) = &tumble.gyro else { return sigmas };
    for (axis, sensor) in document.gyro.sensor.iter().enumerate().take(AXES.len()) {
        let ppm = tidy(1e6 * gyro.sigma[axis] / gyro.weight[axis].abs());
        sigmas.put(("gyro", &sensor.name, "increment_weight_ppm"), vec![ppm]);
        for (along, name) in AXES.iter().enumerate() {
            if let Some([_, sigma]) = deg_per_h_per_g(tumble, axis, along) {
                let key = format!("acceleration_sensitive_drift.{name}");
                sigmas.put(("gyro", &sensor.name, &key), vec![tidy(sigma)]);
            }
        }
        let mut row = [0.0; 3];
        for (which, column) in gyro.across(axis).into_iter().enumerate() {
            row[column] = arcsec(gyro.sigma[3 + 2 * axis + which]);
        }
        sigmas.put(("gyro", &sensor.name, "axis_arcsec"), row.to_vec());
    }
    sigmas
}
