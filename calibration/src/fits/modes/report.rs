//! The report of the modes.

use isotherm_correction::thermal::Feature;
use isotherm_pages::Table;

use super::fit::{Made, ServoFit};
use super::model::{GyroFit, key};
use crate::axes::{main_axis, output_name};
use crate::numbers::real;
use crate::report::{Curve, Report, counted, fixed, or_dash, per_deg_c, short, together};

/// Models of the cross-validation that the report lists for each gyro.
const MODELS: usize = 5;

impl Made {
    /// The report.
    pub fn report(&self) -> Report {
        let unit = self.written.document.unit.clone();
        let mut report =
            Report::new("Mode-reversed laser gyro: drift polynomials and switch parameters", unit);
        report.verdicts = Curve::verdicts(&self.residuals);
        report.residuals.clone_from(&self.residuals);
        report.warnings.clone_from(&self.warnings);
        notes(self, &mut report);
        let mut validation = Vec::new();
        let mut told: Vec<(&str, String)> = Vec::new();
        for (index, sensor) in self.before.document.gyro.sensor.iter().enumerate() {
            match self.gyros.get(index) {
                Some(Ok(fit)) => {
                    gyro(&sensor.name, fit, (self.keeps_constants, &mut report), &mut validation);
                    if fit.left_out > 0 {
                        let are = counted(fit.left_out, "mean is", "means are");
                        told.push((&sensor.name, format!("{are} far off and left out")));
                    }
                    told.extend(fit.remarks.iter().map(|remark| (sensor.name.as_str(), remark.clone())));
                }
                Some(Err(reason)) => refuse(self, index, reason, &mut report),
                None => {}
            }
            match self.servos.get(index) {
                Some(Ok(servo)) => transient(&sensor.name, servo, &mut report),
                Some(Err(reason)) => {
                    let old = if sensor.servo.is_some() {
                        "the document's servo stays"
                    } else {
                        "no servo is written"
                    };
                    told.push((&sensor.name, format!("{reason}; {old}")));
                }
                None => {}
            }
        }
        report.warnings.extend(together(&told));
        if !validation.is_empty() {
            let head = ["gyro", "static order", "magnetic order", "slow-meander order", "χ² per mean", ""];
            report.validation = Some(Table::of(head, validation));
        }
        report
    }
}

fn notes(made: &Made, report: &mut Report) {
    let switches = &made.switches;
    report.notes.push(format!(
        "{} ticks of {} s, {} mode switches, every {} s; a switch loses {}.",
        switches.ticks,
        short(switches.tick_s),
        switches.between_s.len() + 1,
        short(switches.period_s()),
        counted(made.transition_ticks.into(), "tick", "ticks"),
    ));
    report.notes.push(format!(
        "Drift is the mean rate in running mode over {} s, whole reversal periods, less the Earth's. Before: without static, \
         magnetic and slow-meander term, with the same bridging of the switches.",
        short(made.window_s)
    ));
    report.notes.push(format!(
        "Powers of temperature are taken about {} °C, those of the slow meander about 25 °C. Standard errors include \
         white noise, whole counts and a first-order Markov drift if the means show one, at their upper limits.",
        short(made.reference_deg_c)
    ));
}

fn gyro(
    name: &str,
    fit: &GyroFit,
    (keeps_constants, report): (bool, &mut Report),
    validation: &mut Vec<Vec<String>>,
) {
    for one in &fit.coefficients {
        let unit = per_deg_c("°/h", one.power);
        let kept = keeps_constants && one.term == Feature::One && one.power == 0;
        let what = if kept { ", with the Earth's rate: not written" } else { "" };
        let name = format!("gyro {name} {}, power {}{what}", key(one.term).replace('_', " "), one.power);
        report.coefficient(name, unit, one.value, one.sigma);
    }
    let markov = fit.noise.markov.map_or_else(String::new, |[variance, time_s]| {
        format!(", drift of {} °/h over {} s", short(variance.sqrt()), short(time_s))
    });
    report.notes.push(format!(
        "gyro {name}: {} over {}…{} °C, N {} °/√h{markov}, χ² {:.2} per degree of freedom.",
        counted(fit.cells, "mean", "means"),
        fixed(fit.range_deg_c[0], 1),
        fixed(fit.range_deg_c[1], 1),
        short(fit.noise.white.sqrt() / 60.0),
        fit.chi_square
    ));
    let chosen = fit.scores.iter().find(|score| score.model == fit.model);
    let first = fit.scores.iter().take(MODELS).filter(|score| score.model != fit.model);
    for score in chosen.into_iter().chain(first) {
        let each = score.chi_square / real(score.count.max(1));
        validation.push(vec![
            name.to_owned(),
            score.model.static_order.to_string(),
            score.model.magnetic_order.to_string(),
            or_dash(score.model.meander_order.map(|order| order.to_string())),
            format!("{each:.4}"),
            if score.model == fit.model { "taken" } else { "" }.to_owned(),
        ]);
    }
}

fn transient(name: &str, servo: &ServoFit, report: &mut Report) {
    let own = &servo.transient;
    report.coefficient(format!("gyro {name} servo time constant"), "s", own.time_constant_s, own.sigma_s);
    for (power, [value, sigma]) in servo.rest.coefficients.iter().enumerate() {
        let unit = per_deg_c("Hz", power);
        let name = format!("gyro {name} dither rest frequency, power {power}");
        report.coefficient(name, unit, *value, *sigma);
    }
    let delay = servo.rest.delay_s.map_or_else(String::new, |delay_s| {
        format!("; the filtered temperature lags the dither's by {} s", short(delay_s))
    });
    report.notes.push(format!(
        "gyro {name}: after {} switches the dither is low by {} Hz rms in the first tick{delay}.",
        own.switches,
        short(own.loss_hz)
    ));
}

/// A gyro that keeps its old terms.
fn refuse(made: &Made, sensor: usize, reason: &str, report: &mut Report) {
    let row = made.written.document.gyro.orientation.rows.get(sensor).copied().unwrap_or_default();
    let axis = output_name(true, main_axis(&row));
    for verdict in report.verdicts.iter_mut().filter(|verdict| verdict.of == axis) {
        *verdict = verdict.clone().refused(reason);
    }
}

impl GyroFit {
    /// Value and standard error of a coefficient.
    pub fn coefficient(&self, term: Feature, power: usize) -> Option<[f64; 2]> {
        let found = self.coefficients.iter().find(|one| one.term == term && one.power == power);
        found.map(|one| [one.value, one.sigma])
    }
}
