//! The whole procedure: look at the switches, gather, fit, write, judge.

use isotherm_correction::earth::Place;
use isotherm_protocol::document::Document;

use super::cells::{Cell, Cut, gather, groups};
use super::checks;
use super::dither;
use super::document::{self, reference_of};
use super::model::{Asked, Given, GyroFit, fit};
use super::prepare::{check, earth_rate, gaps, provisional, transition_ticks, window_s};
use super::servo::{self, Transient};
use super::switches::Switches;
use super::{temperatures, units};
use crate::axes::{main_axis, output_name};
use crate::document::Written;
use crate::error::Error;
use crate::numbers::{median, real};
use crate::report::{Curve as Residual, Rest, judge};
use crate::runs::Run;
use crate::runs::table::{Rows, Takes};

/// About so many cells are made of a fit's runs, none shorter than [`SHORTEST_S`].
const CELLS: f64 = 400.0;
const SHORTEST_S: f64 = 15.0;
/// Time behind a switch that is left out where the servo is not known (s).
const SETTLE_S: f64 = 0.5;
/// Share of a window that must count: whole reversal periods, but for rounding.
const WHOLE: f64 = 1.0 - 1e-9;

/// What the fit starts from.
#[derive(Debug, Clone)]
pub struct Wanted<'a> {
    /// Runs that the constants are fitted to.
    pub runs: &'a [Run],
    /// Runs that they are judged on.
    pub judge: &'a [Run],
    /// Document that gives scale, axes, channels and filter.
    pub base: &'a Document,
    /// Where the unit stands; `None` where that is not known: then the static constant stays as it is.
    pub place: Option<Place>,
    /// What is not to be found.
    pub asked: Asked,
}

/// Servo of one gyro.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoFit {
    /// Behind the switches.
    pub transient: Transient,
    /// f0 over temperature.
    pub rest: dither::Rest,
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Made {
    /// The document.
    pub written: Written,
    /// What "before" means: the same without the fitted terms.
    pub before: Written,
    /// What was found of each gyro; why not, where nothing was.
    pub gyros: Vec<Result<GyroFit, String>>,
    /// Servo of each gyro; why none.
    pub servos: Vec<Result<ServoFit, String>>,
    /// The switches.
    pub switches: Switches,
    /// Ticks that a switch loses, as the document states them.
    pub transition_ticks: u8,
    /// `T_ref` (°C).
    pub reference_deg_c: f64,
    /// Window of the residuals: whole reversal periods (s).
    pub window_s: f64,
    /// Whether the static biases keep the constants of the base, the attitude not being known.
    pub keeps_constants: bool,
    /// Residuals of the runs.
    pub residuals: Vec<Residual>,
    /// What is to be said.
    pub warnings: Vec<String>,
}

/// Makes the constants of a mode-reversed unit.
///
/// # Errors
/// [`Error::Refused`] with every reason why the log does not allow it; [`Error::Log`], [`Error::Document`].
pub fn make(wanted: &Wanted<'_>) -> Result<Made, Error> {
    let switches = Switches::of(wanted.runs)?;
    let reasons = checks::before(&switches, wanted.base, wanted.asked.transition_ticks);
    if !reasons.is_empty() {
        return Err(Error::Refused(reasons));
    }
    let mut warnings = Vec::new();
    let transition_ticks = transition_ticks(wanted, &switches, &mut warnings);
    let transients: Vec<Result<Transient, String>> = (0..switches.sensors)
        .map(|sensor| servo::fit(&switches.behind, sensor, usize::from(transition_ticks)))
        .collect();
    let provisional = transients.iter().map(|found| found.as_ref().ok().map(provisional)).collect::<Vec<_>>();
    let bare = document::bare(wanted.base, transition_ticks, &provisional);
    let known = bare.gyro.sensor.iter().all(|sensor| sensor.servo.is_some());
    let reference_deg_c = wanted.asked.reference_deg_c.unwrap_or_else(|| reference_of(wanted.base));
    let length_s = real(switches.ticks) * switches.tick_s;
    // A switch loses its ticks, and the transient is over one tick later at the least.
    let settle_s = SETTLE_S.max((f64::from(transition_ticks) + 1.5) * switches.tick_s);
    let cut = Cut {
        cell_s: (length_s / CELLS).max(SHORTEST_S),
        settle_s: wanted.asked.settle_s.unwrap_or(if known { 0.0 } else { settle_s }),
        reference_deg_c,
    };
    let mut gyros: Vec<Result<GyroFit, String>> = vec![Err(String::new()); switches.sensors];
    let mut servos: Vec<Result<ServoFit, String>> = vec![Err(String::new()); switches.sensors];
    let mut earth_case = None;
    for group in groups(switches.sensors) {
        let gathered = gather(wanted.runs, &bare, group, cut)?;
        let earth = earth_rate(wanted, &gathered)?;
        earth_case = earth;
        let doubts = check(wanted, &gathered, (&bare, group), earth)?;
        // Gaps, gravity and temperatures are the same for every group of gyros.
        if group[0] == 0 {
            gaps(&gathered, &mut warnings);
            warnings.extend(doubts);
            warnings.extend(temperatures::freezing(wanted.runs, &bare)?);
            let deg_c: Vec<f64> =
                gathered.cells.iter().map(|cell| cell.powers[0][0] + reference_deg_c).collect();
            warnings.extend(units::other_dither(&switches, wanted.base, median(&deg_c)));
        }
        for (place, sensor) in group.into_iter().enumerate() {
            let of_cell = |cell: &Cell| {
                let row = document::row(&bare, sensor, cell.axes_deg_c);
                earth.map_or(0.0, |earth| checks::earth_along(row, earth))
            };
            let along: Vec<f64> = gathered.cells.iter().map(of_cell).collect();
            let given = Given {
                cells: &gathered.cells,
                place,
                earth: &along,
                count_arcsec: if switches.whole { document::count_arcsec(&bare, sensor) } else { 0.0 },
                reference_deg_c,
                has_meander: switches.has_meander(),
            };
            gyros[sensor] = fit(given, wanted.asked);
            servos[sensor] = transients[sensor].clone().and_then(|transient| {
                let rest = dither::found(&gathered.cells, place, reference_deg_c)?;
                Ok(ServoFit { transient, rest })
            });
        }
    }
    if gyros.iter().all(Result::is_err) {
        let sensors = wanted.base.gyro.sensor.iter().zip(gyros);
        let reasons = sensors.filter_map(|(of, fit)| Some(format!("gyro {}: {}", of.name, fit.err()?)));
        return Err(Error::Refused(reasons.collect()));
    }
    warnings.extend(document::inverted(wanted.base, &gyros, reference_deg_c));
    if wanted.place.is_none() {
        warnings.push(
            "the Earth's rate is unknown: the static bias keeps its constant, only its shape is fitted. Give \
             --latitude and --heading to fit it"
                .to_owned(),
        );
    }
    if !switches.has_meander() {
        warnings.push(
            "the log does not state the phase of the slow meander: its effect is in the static bias, and no term is \
             written"
                .to_owned(),
        );
    }
    let window_s = window_s(&switches, length_s);
    let mut made = Made {
        before: Written::of(&document::stripped(&bare, &servos, wanted.base, reference_deg_c))?,
        written: Written::of(&bare)?,
        gyros,
        servos,
        switches,
        transition_ticks,
        reference_deg_c,
        window_s,
        keeps_constants: wanted.place.is_none(),
        residuals: Vec::new(),
        warnings,
    };
    made.settle(wanted, earth_case)?;
    Ok(made)
}

impl Made {
    /// Writes and judges; gyros whose terms make an axis worse keep the old ones, and all is judged once more.
    fn settle(&mut self, wanted: &Wanted<'_>, earth: Option<[f64; 3]>) -> Result<(), Error> {
        self.write(wanted, earth)?;
        let verdicts = Residual::verdicts(&self.residuals);
        if verdicts.is_empty() {
            return Err(Error::refused(format!(
                "no window of {:.0} s, of whole reversal periods, is without lost ticks: the fit cannot be judged. \
                 Record without gaps; isotherm-replay info shows them",
                self.window_s
            )));
        }
        let mut any_worse = false;
        for (fit, row) in self.gyros.iter_mut().zip(&wanted.base.gyro.orientation.rows) {
            let axis = output_name(true, main_axis(row));
            if fit.is_ok() && verdicts.iter().any(|verdict| !verdict.accepted && verdict.of == axis) {
                *fit = Err(format!("its terms make {axis} worse: it keeps the old ones"));
                any_worse = true;
            }
        }
        if any_worse { self.write(wanted, earth) } else { Ok(()) }
    }

    /// Writes the document, and judges what is written.
    fn write(&mut self, wanted: &Wanted<'_>, earth: Option<[f64; 3]>) -> Result<(), Error> {
        self.written = Written::of(&document::fitted(wanted.base, self))?;
        let rate_deg_per_h = earth.map(|rate| rate.map(super::model::deg_per_h));
        let rest = Rest { rate_deg_per_h, ..Rest::default() };
        let rows = Rows { length_s: self.window_s, takes: Takes::Bridged, whole: Some(WHOLE) };
        let documents = [&self.before, &self.written];
        let of_run = |_, _: &Run| Ok((rest, rows, "gyro"));
        self.residuals = judge((wanted.runs, wanted.judge), documents, of_run)?.curves;
        Ok(())
    }
}
