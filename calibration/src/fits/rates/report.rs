//! The report of the rates.

use isotherm_correction::units::Angle;
use isotherm_pages::{Axis, Chart, Ink, Panel, Series, Table};

use super::figure;
use super::fit::Made;
use super::matching::Matched;
use super::model::GyroRates;
use super::over_temperature::OverTemperature;
use crate::axes::{AXES, across};
use crate::finding::Kind;
use crate::numbers::dot;
use crate::report::{Report, counted, fixed, gyros, per_deg_c, short, together};

/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 220;
/// Share by which a weight changes at most without a word: what micromechanical gyros differ by from their data sheet.
const OTHER_WEIGHT: f64 = 0.1;

impl Made {
    /// The report.
    pub fn report(&self) -> Report {
        let made = self;
        let document = &made.written.document;
        let title = "Rate table: scale factor, asymmetry, linearity, input axes";
        let mut report = Report { counted: Some("steps"), ..Report::new(title, &document.unit) };
        report.verdicts.clone_from(&made.verdicts);
        report.warnings.extend(made.warnings.iter().map(ToString::to_string));
        let turning = made.steps.iter().filter(|one| one.step.rate_deg_per_s != 0.0).count();
        let temperature = made
            .temperature_deg_c()
            .map_or_else(String::new, |deg_c| format!(", mean temperature {deg_c:.1} °C"));
        report.notes.push(format!(
            "{} of the table and {}{temperature}.",
            counted(turning, "step", "steps"),
            counted(made.steps.len() - turning, "rest", "rests")
        ));
        report.notes.push(
        "Before and after are the errors of the corrected rate over the steps, less Earth's rate and mean error \
         (bias). The increment weight is the mean for positive and negative input; nonlinearity is in \
         origin.details."
            .to_owned(),
    );
        let mut told: Vec<(&str, String)> = Vec::new();
        for (index, sensor) in document.gyro.sensor.iter().enumerate() {
            match made.gyros.get(index) {
                Some(Ok(found)) => {
                    if found.axis.is_none() {
                        let stays = "the steps turn about fewer than three directions: the input axis is kept from the \
                                 document";
                        told.push((&sensor.name, stays.to_owned()));
                    }
                    let weight = sensor
                        .increment_weight_arcsec_per_count
                        .map(|weight| (weight, "″/count"))
                        .or(sensor.increment_weight_rad_per_rad.map(|weight| (weight, "rad/rad")));
                    coefficients(&sensor.name, found, weight, &mut report);
                    linearity(made, index, &sensor.name, found, &mut report);
                }
                Some(Err(reason)) => told.push((&sensor.name, format!("{reason}; weight and axis are kept"))),
                None => {}
            }
        }
        report.warnings.extend(together(&told));
        report.warnings.extend(widened(made));
        report.warnings.extend(other_weights(made));
        if let Some(over) = &made.over_temperature {
            over_temperature(made, over, &mut report);
        }
        if !made.judged.is_empty() {
            let steps = counted(made.judged.len(), "step", "steps");
            report.notes.push(format!("Out of sample: {steps} of the judging logs."));
            report.tables.push(("Errors of the judging steps".to_owned(), judged(made)));
        }
        report.charts.push(("Linearity".to_owned(), chart(made)));
        report
    }
}

/// Slopes of axes and scale factors, with the figure beside the accelerometers.
fn over_temperature(made: &Made, over: &OverTemperature, report: &mut Report) {
    let document = &made.written.document;
    report.notes.push(format!(
        "Axes and scale factors at {} temperatures; weights, axes and linearity are those at {} °C.",
        over.levels.len(),
        short(over.reference_deg_c)
    ));
    for (sensor, line) in document.gyro.sensor.iter().zip(&over.lines) {
        let mut add = |what: String, unit: String, value: f64, sigma: f64| {
            report.coefficient(format!("gyro {} {what}", sensor.name), unit, value, sigma);
        };
        for (power, (value, sigma)) in line.scale_ppm.iter().zip(&line.scale_sigma_ppm).enumerate() {
            add(
                format!("increment weight error, power {}", power + 1),
                per_deg_c("ppm", power + 1),
                *value,
                *sigma,
            );
        }
        for along in across(&line.axis) {
            let arcsec = |rad: f64| Angle::from_rad(rad).as_arcsec();
            let name = format!("C1 along {}", AXES[along]);
            add(name, per_deg_c("″", 1), arcsec(line.slope[along]), arcsec(line.slope_sigma[along]));
        }
    }
    report.tables.push(("Axes by temperature, ″".to_owned(), figure::table(over, document)));
    report.charts.push(("Axes over temperature".to_owned(), figure::chart(over, document)));
}

/// Errors of the steps that the fit has not seen, by case axis.
fn judged(made: &Made) -> Table {
    let head = [
        "log",
        "window, s",
        "table, °/s",
        "before: x, °/h",
        "y, °/h",
        "z, °/h",
        "after: x, °/h",
        "y, °/h",
        "z, °/h",
    ];
    let row = |one: &Matched| {
        let [from, to] = one.plateau.window_s;
        let mut row = vec![
            (one.step.run + 1).to_string(),
            format!("{from:.1}…{to:.1}"),
            short(one.step.rate_deg_per_s),
        ];
        row.extend(one.error.iter().flatten().map(|error| short(*error)));
        row
    };
    Table::of(head, made.judged.iter().map(row))
}

fn coefficients(name: &str, found: &GyroRates, weight: Option<(f64, &str)>, report: &mut Report) {
    let [gain, sigma] = found.gain;
    let relative = sigma / gain.abs();
    let mut add = |what: &str, unit: &str, value: f64, sigma: f64| {
        report.coefficient(format!("gyro {name} {what}"), unit, value, sigma);
    };
    if let Some((weight, unit)) = weight {
        add("increment weight", unit, weight, relative * weight.abs());
    }
    add("change of its weight", "ppm", 1e6 * (1.0 / gain.abs() - 1.0), 1e6 * relative);
    if let Some([value, sigma]) = found.asymmetry {
        add("scale factor asymmetry", "ppm", 1e6 * value, 1e6 * sigma);
    }
    add("bias left", "°/h", found.bias[0], found.bias[1]);
    if let Some(axis) = found.axis {
        for (element, (of, sigma)) in AXES.iter().zip(axis.iter().zip(found.axis_sigma)) {
            // Near one the element itself says nothing about the angle.
            if of.abs() < 0.99 {
                let arcsec = |rad: f64| Angle::from_rad(rad).as_arcsec();
                add(&format!("input axis along {element}"), "″", arcsec(*of), arcsec(sigma));
            }
        }
    }
}

/// The gyros that something is told of, by their names, and what, each in a list; `None` without any.
fn listed(made: &Made, told: impl Fn(&GyroRates) -> Option<String>) -> Option<(String, String)> {
    let sensors = made.written.document.gyro.sensor.iter().zip(&made.gyros);
    let all = sensors.filter_map(|(sensor, found)| Some((sensor.name.as_str(), told(found.as_ref().ok()?)?)));
    let (names, told): (Vec<&str>, Vec<String>) = all.unzip();
    (!names.is_empty()).then(|| (gyros(&names), told.join(", ")))
}

/// Gyros whose weight is far from what it was, in one sentence: the rates, or the unit of measure, may be others than stated.
fn other_weights(made: &Made) -> Option<String> {
    let (gyros, changes) = listed(made, |found| {
        let change = 1.0 / found.gain[0].abs() - 1.0;
        (made.scale_known && change.abs() > OTHER_WEIGHT).then(|| format!("{} %", short(100.0 * change)))
    })?;
    Some(format!(
        "{gyros}: the weight changes by {changes}, more than {:.0} %: check the stated rates, the unit of measure in the \
         mapping, and that the document is of this unit",
        100.0 * OTHER_WEIGHT
    ))
}

/// Gyros whose steps scatter by more than noise, in one sentence.
fn widened(made: &Made) -> Option<String> {
    let (gyros, times) =
        listed(made, |found| found.widened.then(|| format!("{:.1}", found.chi_square.sqrt())))?;
    let place = if made.earth_known {
        ", or latitude and attitude other than at the beginning of each log"
    } else {
        ", or the Earth's rate, which is not removed"
    };
    Some(format!(
        "{gyros}: steps scatter by {times} times what noise explains; standard errors are widened. Nonlinearity, a table less steady \
         than stated (--table-ppm){place}"
    ))
}

fn linearity(made: &Made, index: usize, name: &str, found: &GyroRates, report: &mut Report) {
    let axis =
        found.axis.or(made.written.document.gyro.orientation.rows.get(index).copied()).unwrap_or_default();
    let input = |step: usize| -> f64 { made.steps.get(step).map_or(0.0, |step| dot(step.rate, axis)) };
    let full = (0..made.steps.len()).map(|step| input(step).abs()).fold(0.0, f64::max);
    let mut rows = Vec::new();
    let mut worst = 0.0_f64;
    for (step, left) in found.left.iter().enumerate() {
        let Some(one) = made.steps.get(step) else { continue };
        let [from, to] = one.plateau.window_s;
        let own = input(step);
        worst = worst.max(left.abs());
        let of_input =
            if own.abs() > 0.01 * full { fixed(1e6 * left / own.abs(), 2) } else { "–".to_owned() };
        rows.push(vec![
            (one.step.run + 1).to_string(),
            format!("{from:.1}…{to:.1}"),
            short(one.step.rate_deg_per_s),
            short(own / 3600.0),
            short(*left),
            of_input,
            fixed(1e6 * left / full, 3),
        ]);
    }
    let head =
        ["log", "window, s", "table, °/s", "input, °/s", "left, °/h", "ppm of input", "ppm of full scale"];
    report.tables.push((format!("Linearity of gyro {name}"), Table::of(head, rows)));
    let chi = if found.chi_square.is_finite() {
        format!("χ² {:.2} per degree of freedom", found.chi_square)
    } else {
        "no degree of freedom left".to_owned()
    };
    report.notes.push(format!(
        "gyro {name}: linearity error at most {} ppm of full scale ({} °/s), {chi}.",
        short(1e6 * worst / full),
        short(full / 3600.0)
    ));
    if let Some([value, sigma]) = found.weight_asymmetry_ppm() {
        report.notes.push(format!(
            "gyro {name}: positive and negative scale factor differ: increment_weight_asymmetry changes by {} ± {} ppm.",
            short(value),
            short(sigma)
        ));
    }
}

fn chart(made: &Made) -> Chart {
    let panel = |(index, found): (usize, &Result<GyroRates, Kind>)| {
        let found = found.as_ref().ok()?;
        let sensor = made.written.document.gyro.sensor.get(index)?;
        let axis = made.written.document.gyro.orientation.rows.get(index)?;
        let input = |rate: &[f64; 3]| dot(*rate, *axis) / 3600.0;
        let mut points: Vec<(f64, f64)> =
            made.steps.iter().zip(&found.left).map(|(step, left)| (input(&step.rate), *left)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let series = Series::dots("left", Ink::First, points);
        Some(Panel::of(format!("gyro {}", sensor.name), "°/h", HEIGHT, vec![series]))
    };
    let caption = "Residual of each step from the straight line, over the input rate.";
    let panels = made.gyros.iter().enumerate().filter_map(panel).collect();
    Chart::of(caption, Axis::of("input rate", "°/s"), panels)
}
