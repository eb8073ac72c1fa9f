//! How the drifts are sailed: stated ones, seeded ones, that of a log.

use isotherm_cli::Bar;
use isotherm_correction::drift::DriftParts;
use isotherm_correction::units::AngularRate;

use super::{Gyro, ImpactArgs, sizes};
use crate::error::Error;
use crate::fits::drift::HOUR_S;
use crate::fits::impact::estimate::TICK_S;
use crate::fits::impact::logged;
use crate::fits::impact::models::Choice;
use crate::fits::impact::monte_carlo::sail_all;
use crate::fits::impact::report::{Row, Sailed};
use crate::fits::impact::scenario::{Drift, Voyage};
use crate::numbers::real;
use crate::runs::cut::Cut;

/// Seeds where nobody says.
const SEEDS: u32 = 50;

impl ImpactArgs {
    /// A drift without noise: what comes out is what the drift adds to all other errors.
    pub(super) fn sail_stated(&self, voyage: &Voyage, parts: &[DriftParts; 3]) -> Result<Sailed, Error> {
        let (trend, constant) = (self.trend.unwrap_or(0.0), self.constant.unwrap_or(0.0));
        let rate = |tick: usize| {
            let hours = (real(tick) + 0.5) * TICK_S / HOUR_S;
            let after = if tick < voyage.calibration_ticks() { 0.0 } else { constant };
            AngularRate::from_deg_per_h(trend * hours + after).as_rad_per_s()
        };
        let ramp: Vec<f64> = (0..voyage.ticks()).map(rate).collect();
        let mut rows = Vec::new();
        let gyros = match self.gyro.unwrap_or(Gyro::Each) {
            Gyro::Each => vec![Gyro::X, Gyro::Y, Gyro::Z],
            one => vec![one],
        };
        for (name, share) in gyros.into_iter().map(Gyro::case) {
            let truth: Vec<[f64; 3]> = ramp.iter().map(|rate| share.map(|share| share * rate)).collect();
            let held = truth.get(voyage.calibration_ticks().saturating_sub(1)).copied().unwrap_or_default();
            let drift = Drift { measured: truth.clone(), truth, held };
            rows.extend(Row::of_cares(name, voyage, &drift, parts)?);
        }
        let source = match (self.trend, self.constant) {
            (Some(trend), None) => format!("A trend of {trend} °/h² alone"),
            (None, Some(constant)) => format!("A constant of {constant} °/h from departure on"),
            _ => format!("A trend of {trend} °/h² and a constant of {constant} °/h from departure on"),
        };
        let notes = vec![
            "Without noise: what the drift adds to every other error. 002 has 1460 m, 2850 m and 0.14′, 0.28′ for \
             trends of 0.00008 and 0.00016 °/h² of the azimuth gyro, and less than 20 m for a level one, because \
             its filter follows that drift through the velocity log; the latitude is not stated."
                .to_owned(),
        ];
        Ok(Sailed { voyage: *voyage, source, seeds: 0, rows, notes, choices: Vec::new() })
    }

    pub(super) fn sail_seeds(&self, voyage: &Voyage, parts: &[DriftParts; 3]) -> Result<Sailed, Error> {
        let count = self.seeds.unwrap_or(SEEDS);
        let seeds: Vec<u64> = (0..count).map(|index| self.seed.wrapping_add(u64::from(index))).collect();
        let slope = AngularRate::from_deg_per_h(self.trend.unwrap_or(0.0)).as_rad_per_s() / HOUR_S;
        let (_, share) = self.gyro.unwrap_or(Gyro::All).case();
        let on_top = share.map(|share| share * slope);
        let bar = Bar::at_work("sailing");
        let sailed = sail_all(voyage, parts, on_top, &seeds);
        bar.finish();
        let row = |(course, spread)| Row { case: "all gyros".to_owned(), course, spread: Some(spread) };
        let rows = sailed?.into_iter().map(row).collect();
        let trend =
            self.trend.map(|trend| format!(", with a trend of {trend} °/h² on top")).unwrap_or_default();
        let from = self.document.as_ref().map_or_else(
            || "gyros of the size of tables 1 and 2 of 002".to_owned(),
            |path| format!("gyros as {} states them", path.display()),
        );
        let source = format!("Drifts of {count} seeds from {}, {from}{trend}", self.seed);
        let mut notes = vec![
            "Figures are the median of all seeds, and the bound of 95 % of them.".to_owned(),
            "A drift held at its last value is held at its true value at departure, which no measurement gives: the \
             row is a bound. The estimators see the drift through the angle random walk of the gyros and the noise \
             of the references."
                .to_owned(),
        ];
        if parts.iter().all(|gyro| gyro.sigma_rad_per_s == 0.0 && gyro.trend_sigma_rad_per_s2 == 0.0) {
            notes.push(
                "These gyros have a constant part only, neither a slow drift nor a trend: held, it leaves no error, \
                 and the trend state has no effect."
                    .to_owned(),
            );
        }
        Ok(Sailed { voyage: *voyage, source, seeds: seeds.len(), rows, notes, choices: Vec::new() })
    }

    pub(super) fn sail_log(
        &self,
        voyage: &mut Voyage,
        parts: &[DriftParts; 3],
        cut: &Cut,
    ) -> Result<Sailed, Error> {
        let mut columns = self.columns(&self.log, cut)?;
        let words: Vec<String> = cut.words().map(str::to_owned).into_iter().collect();
        let (drift, mut notes) = logged::drift(&mut columns, voyage, &self.otherwise(parts))
            .map_err(|error| error.beside(&words))?;
        notes.extend(words);
        if *parts == [sizes(); 3] {
            notes.push(
                "The estimators expect gyros as in tables 1 and 2 of 002, because no document states the drift of \
                 these."
                    .to_owned(),
            );
        }
        notes.push(
            "Taken as a platform's gyros x and y level, z up or down. The mean over the calibration, Earth's rate \
             included, is removed; the mean of its last hour is held."
                .to_owned(),
        );
        let rows = Row::of_cares("as logged", voyage, &drift, parts)?;
        let source = format!("The log of unit {}", columns.unit);
        let choices = Choice::of(&drift, voyage);
        Ok(Sailed { voyage: *voyage, source, seeds: 0, rows, notes, choices })
    }

    /// What can be done where the log is shorter than the calibration.
    fn otherwise(&self, parts: &[DriftParts; 3]) -> String {
        match &self.document {
            None => "state the drift with --calibration or --trend instead of the log".to_owned(),
            Some(path) if *parts == [sizes(); 3] => format!(
                "state the drift with --trend instead of the log: {} has no [gyro.sensor.drift] (isotherm-calibrate \
                 drift --calibration adds it)",
                path.display()
            ),
            Some(path) => format!("leave the log out: {} states the drift", path.display()),
        }
    }
}
