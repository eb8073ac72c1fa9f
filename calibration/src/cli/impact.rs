//! `isotherm-calibrate impact`.

use std::path::{Path, PathBuf};
use std::slice;

use clap::{Args, ValueEnum};
use isotherm_correction::drift::DriftParts;
use isotherm_correction::units::AngularRate;
use isotherm_log::diff::is_csv;
use isotherm_log::file::read_small_text;
use isotherm_log::offline::load_calibration;
use isotherm_protocol::document::Document;

use super::bar::Bar;
use super::page::PageArgs;
use super::print;
use super::runs::{LogArgs, Reading};
use crate::drift::HOUR_S;
use crate::drift::columns::{Columns, Kind};
use crate::drift::figures::short;
use crate::error::Error;
use crate::impact::ins::{GREATEST_LATITUDE_DEG, TURN_RATIO};
use crate::impact::logged;
use crate::impact::monte_carlo::{Voyages, sail_all};
use crate::impact::over_starts;
use crate::impact::report::{Report, Row};
use crate::impact::scenario::{CARES, Drift, Voyage};
use crate::runs::Watch;
use crate::runs::cut::Cut;

/// Seeds where nobody says.
const SEEDS: u32 = 50;
/// Most hours of either part.
const MOST_HOURS: f64 = 1000.0;
/// Sizes of the gyros in tables 1 and 2 of 002, for a drift without a document: σ, τ, σ1, τ1, constant part, N.
const SIZES_DEG_H: [f64; 6] = [0.0034, 9.5, 0.000_08, 140.0, 0.05, 0.0002];

/// What a drift means for navigation: heading and position of a platform system over two days on its own
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate impact --trend 0.00008 --html impact.html\n  \
    isotherm-calibrate impact --calibration unit-drift.toml --seeds 100\n  \
    isotherm-calibrate impact corrected.mcap --calibration-hours 21\n  \
    isotherm-calibrate impact --calibration unit-drift.toml --start-log monday.mcap --start-log tuesday.mcap --start-log friday.mcap\n\n\
    The system is calibrated, then goes on alone; its level platform turns about the vertical at four times the Earth's rate. \
    Each drift is sailed three times: held at its last value, and with the service's own drift estimator without and with \
    the state of the trend.")]
pub(super) struct ImpactArgs {
    /// A log at rest: corrected ticks (CSV, .mcap), or raw ones with --calibration
    #[arg(value_name = "LOG")]
    log: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Calibration document (TOML) that says what the estimator is to expect; a raw log is corrected with it
    #[arg(long = "calibration", short = 'c', alias = "document", short_alias = 'd', value_name = "FILE")]
    document: Option<PathBuf>,
    /// Straight trend from the calibration's beginning (°/h²)
    #[arg(
        long,
        value_name = "DEG_PER_H2",
        alias = "trend-deg-per-h2",
        allow_hyphen_values = true,
        conflicts_with = "log"
    )]
    trend: Option<f64>,
    /// Constant that appears at departure, as after a shock (°/h)
    #[arg(long, value_name = "DEG_PER_H", alias = "constant-deg-per-h", allow_hyphen_values = true, conflicts_with_all = ["log", "seeds"])]
    constant: Option<f64>,
    /// Gyro that has the trend or the constant; without it each by itself, with --seeds all at once
    #[arg(long, value_enum)]
    gyro: Option<Gyro>,
    /// Sail many times with drifts from as many seeds, of the size that the document states; --trend comes on top
    #[arg(long, value_name = "NUMBER", conflicts_with = "log", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: Option<u32>,
    /// Log at rest of one start, read as LOG is; with two or more, their means give the sigma of the constant over starts; repeatable
    #[arg(long, value_name = "LOG")]
    start_log: Vec<PathBuf>,
    /// The first seed
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Latitude (°)
    #[arg(long, value_name = "DEG", default_value_t = 60.0, allow_hyphen_values = true)]
    latitude: f64,
    /// Hours on its own
    #[arg(long, value_name = "HOURS", default_value_t = 48.0)]
    hours: f64,
    /// Hours of calibration before
    #[arg(long, value_name = "HOURS", default_value_t = 21.0)]
    calibration_hours: f64,
    /// Rate of the platform about the vertical, over the Earth's
    #[arg(long, value_name = "RATIO", default_value_t = TURN_RATIO, allow_hyphen_values = true)]
    turn_ratio: f64,
    /// Standard error of the rate that the calibration knows, per minute (°/h)
    #[arg(long, value_name = "DEG_PER_H", default_value_t = 0.001)]
    reference_sigma: f64,
    /// The velocity log does not keep the level gyros observable
    #[arg(long)]
    no_log_aid: bool,
    #[command(flatten)]
    page: PageArgs,
    /// Print everything as one JSON object, with the curves
    #[arg(long)]
    json: bool,
}

/// A gyro of the platform.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Gyro {
    /// Level
    X,
    /// Level
    Y,
    /// Azimuth
    Z,
    /// Each by itself
    Each,
    /// All at once
    All,
}

/// A case: which gyros have the drift, in words.
struct Case {
    name: String,
    share: [f64; 3],
}

impl ImpactArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut voyage = self.voyage()?;
        let mut parts = self.parts()?;
        let cut = Cut::default();
        let starts = self.starts(&mut parts, &cut)?;
        let mut report = if !self.log.is_empty() {
            self.sail_log(&mut voyage, &parts, &cut)?
        } else if self.seeds.is_some()
            || (self.trend.is_none()
                && self.constant.is_none()
                && (self.document.is_some() || !self.start_log.is_empty()))
        {
            self.sail_seeds(&voyage, &parts)?
        } else if self.trend.is_some() || self.constant.is_some() {
            self.sail_stated(&voyage, &parts)?
        } else {
            let words =
                "say which drift: a LOG, --calibration DOC, --trend DEG_PER_H2 or --constant DEG_PER_H";
            return Err(Error::Usage(words.to_owned()));
        };
        report.notes.extend(starts);
        self.page.write(|| report.to_html())?;
        if self.json {
            print(format!("{}\n", report.to_json()).as_bytes())?;
        } else {
            print(report.to_text().as_bytes())?;
        }
        Error::end(Vec::new(), cut.words().map(str::to_owned).into_iter().collect())
    }

    /// Checks the numbers.
    fn voyage(&self) -> Result<Voyage, Error> {
        let limits = [
            ("--latitude", self.latitude, [-GREATEST_LATITUDE_DEG, GREATEST_LATITUDE_DEG]),
            ("--hours", self.hours, [0.5, MOST_HOURS]),
            ("--calibration-hours", self.calibration_hours, [0.5, MOST_HOURS]),
            ("--turn-ratio", self.turn_ratio, [-1000.0, 1000.0]),
            ("--reference-sigma", self.reference_sigma, [0.0, 1000.0]),
            ("--trend", self.trend.unwrap_or(0.0), [-100.0, 100.0]),
            ("--constant", self.constant.unwrap_or(0.0), [-1000.0, 1000.0]),
        ];
        for (name, value, [low, high]) in limits {
            // False for NaN too.
            if !(low..=high).contains(&value) {
                return Err(Error::Usage(format!("{name} is {value}, must be from {low} to {high}")));
            }
        }
        if self.gyro.is_some() && self.trend.is_none() && self.constant.is_none() {
            let words = "--gyro says which gyro has the trend or the constant: give --trend or --constant, or leave it out";
            return Err(Error::Usage(words.to_owned()));
        }
        if self.gyro == Some(Gyro::Each) && self.seeds.is_some() {
            let words = "--gyro each sails each gyro by itself, the drifts of --seeds are of all: give x, y, z or all";
            return Err(Error::Usage(words.to_owned()));
        }
        let inputs: Vec<&Path> =
            self.log.iter().chain(&self.start_log).chain(&self.document).map(PathBuf::as_path).collect();
        self.page.check(&inputs)?;
        Ok(Voyage {
            latitude_deg: self.latitude,
            turn_ratio: self.turn_ratio,
            calibration_h: self.calibration_hours,
            hours: self.hours,
            log_aids_level: !self.no_log_aid,
            reference_sigma_rad_per_s: AngularRate::from_deg_per_h(self.reference_sigma).as_rad_per_s(),
        })
    }

    /// What the estimator is to expect: the document's, or gyros of the size of 002's, where there is none or where it only corrects
    /// the log.
    fn parts(&self) -> Result<[DriftParts; 3], Error> {
        let Some(path) = &self.document else { return Ok([sizes(); 3]) };
        let text = read_small_text(path, "read the calibration document")?;
        let parsed = Document::parse(&text, Some(&path.display().to_string())).map_err(|problems| {
            isotherm_log::error::Error::Calibration(problems.iter().map(ToString::to_string).collect())
        })?;
        let parts = parsed.document.to_parts();
        let stated: Vec<DriftParts> = parts.gyros.iter().filter_map(|gyro| gyro.drift).collect();
        if stated.is_empty() && !self.log.is_empty() {
            return Ok([sizes(); 3]);
        }
        <[DriftParts; 3]>::try_from(stated).map_err(|stated| {
            let advice = if stated.len() < 3 {
                "isotherm-calibrate drift --calibration puts them in"
            } else {
                "leave the document out, or give one that states it for the gyros along x, y and z only"
            };
            let (path, count) = (path.display(), stated.len());
            Error::Refused(vec![format!(
                "{path} states a drift for {count} gyros, the platform has three: {advice}"
            )])
        })
    }

    /// Takes the sigma of the constant over starts from the logs that were given of them; what was found is said in a sentence.
    fn starts(&self, parts: &mut [DriftParts; 3], cut: &Cut) -> Result<Option<String>, Error> {
        if self.start_log.is_empty() {
            return Ok(None);
        }
        let means = |path: &PathBuf| Ok(over_starts::means(&self.columns(slice::from_ref(path), cut)?));
        let means: Vec<[f64; 3]> = self.start_log.iter().map(means).collect::<Result<_, Error>>()?;
        let found = over_starts::sigmas(&means).ok_or_else(|| {
            Error::Usage(
                "--start-log: the sigma over starts needs two logs at least: give it once for each start"
                    .to_owned(),
            )
        })?;
        for (parts, found) in parts.iter_mut().zip(&found) {
            parts.initial_sigma_rad_per_s = AngularRate::from_deg_per_h(found.sigma).as_rad_per_s();
        }
        let of = |found: &over_starts::Found| {
            let [low, high] = found.interval;
            format!("{} ({}…{})", short(found.sigma), short(low), short(high))
        };
        Ok(Some(format!(
            "Sigma of the constant over {} starts, with its 95 % interval, gyros x, y, z: {} °/h. It stands in place of initial_sigma.",
            means.len(),
            found.iter().map(of).collect::<Vec<_>>().join(", ")
        )))
    }

    fn cases(&self) -> Vec<Case> {
        let of = |name: &str, share| Case { name: name.to_owned(), share };
        let (x, y) = (of("level gyro x", [1.0, 0.0, 0.0]), of("level gyro y", [0.0, 1.0, 0.0]));
        let z = of("azimuth gyro z", [0.0, 0.0, 1.0]);
        match self.gyro.unwrap_or(Gyro::Each) {
            Gyro::X => vec![x],
            Gyro::Y => vec![y],
            Gyro::Z => vec![z],
            Gyro::Each => vec![x, y, z],
            Gyro::All => vec![of("all gyros", [1.0; 3])],
        }
    }

    /// A drift without noise: what comes out is what the drift adds to all other errors.
    fn sail_stated(&self, voyage: &Voyage, parts: &[DriftParts; 3]) -> Result<Report, Error> {
        let (trend, constant) = (self.trend.unwrap_or(0.0), self.constant.unwrap_or(0.0));
        let rate = |tick: usize| {
            #[expect(clippy::cast_precision_loss, reason = "ticks of some weeks")]
            let hours = (tick as f64 + 0.5) * crate::impact::estimate::TICK_S / HOUR_S;
            let after = if tick < voyage.calibration_ticks() { 0.0 } else { constant };
            AngularRate::from_deg_per_h(trend * hours + after).as_rad_per_s()
        };
        let ramp: Vec<f64> = (0..voyage.ticks()).map(rate).collect();
        let mut rows = Vec::new();
        for case in self.cases() {
            let truth: Vec<[f64; 3]> = ramp.iter().map(|rate| case.share.map(|share| share * rate)).collect();
            let held = truth.get(voyage.calibration_ticks().saturating_sub(1)).copied().unwrap_or_default();
            let drift = Drift { measured: truth.clone(), truth, held };
            for care in CARES {
                let course = voyage.sail(care, &drift, parts)?;
                rows.push(Row { case: case.name.clone(), course, spread: None });
            }
        }
        let source = match (self.trend, self.constant) {
            (Some(trend), None) => format!("A trend of {trend} °/h² and nothing else"),
            (None, Some(constant)) => format!("A constant of {constant} °/h from departure on"),
            _ => format!("A trend of {trend} °/h² and a constant of {constant} °/h from departure on"),
        };
        let notes = vec![
            "Without noise: what the drift adds to every other error. 002 has 1460 m, 2850 m and 0.14′, 0.28′ for trends of 0.00008 \
             and 0.00016 °/h² of the azimuth gyro, and less than 20 m for a level one, whose drift its filter follows through the \
             velocity log; it does not say at what latitude."
                .to_owned(),
        ];
        Ok(Report { voyage: *voyage, source, seeds: 0, rows, notes })
    }

    fn sail_seeds(&self, voyage: &Voyage, parts: &[DriftParts; 3]) -> Result<Report, Error> {
        let count = self.seeds.unwrap_or(SEEDS);
        let seeds: Vec<u64> = (0..count).map(|index| self.seed.wrapping_add(u64::from(index))).collect();
        let slope = AngularRate::from_deg_per_h(self.trend.unwrap_or(0.0)).as_rad_per_s() / HOUR_S;
        let on_top = match self.gyro.unwrap_or(Gyro::All) {
            Gyro::X => [slope, 0.0, 0.0],
            Gyro::Y => [0.0, slope, 0.0],
            Gyro::Z => [0.0, 0.0, slope],
            Gyro::Each | Gyro::All => [slope; 3],
        };
        let bar = Bar::at_work("sailing");
        let sailed = sail_all(voyage, parts, on_top, &seeds);
        bar.finish();
        let Voyages { first, spread } = sailed?;
        let rows = first.into_iter().zip(spread);
        let rows =
            rows.map(|(course, spread)| Row { case: "all gyros".to_owned(), course, spread: Some(spread) });
        let trend =
            self.trend.map(|trend| format!(", with a trend of {trend} °/h² on top")).unwrap_or_default();
        let from = self.document.as_ref().map_or_else(
            || "gyros of the size of tables 1 and 2 of 002".to_owned(),
            |path| format!("gyros as {} states them", path.display()),
        );
        let source = format!("Drifts of {count} seeds from {}, {from}{trend}", self.seed);
        let mut notes =
            vec!["Figures are the middle of all seeds, and what 95 % of them stay below.".to_owned()];
        notes.push(
            "A drift that is held at its last value is held at what it truly is at departure, which no measurement gives: the row is a \
             bound. The estimators see the drift through the angle random walk of the gyros and the noise of the references."
                .to_owned(),
        );
        if parts.iter().all(|gyro| gyro.sigma_rad_per_s == 0.0 && gyro.trend_sigma_rad_per_s2 == 0.0) {
            notes.push(
                "These gyros have a constant part only, neither a slow drift nor a trend: held, it leaves nothing, and the trend state \
                 has nothing to do."
                    .to_owned(),
            );
        }
        Ok(Report { voyage: *voyage, source, seeds: seeds.len(), rows: rows.collect(), notes })
    }

    fn sail_log(&self, voyage: &mut Voyage, parts: &[DriftParts; 3], cut: &Cut) -> Result<Report, Error> {
        let mut columns = self.columns(&self.log, cut)?;
        let words: Vec<String> = cut.words().map(str::to_owned).into_iter().collect();
        let (drift, mut notes) = logged::drift(&mut columns, voyage, &self.otherwise(parts))
            .map_err(|error| error.beside(&words))?;
        notes.extend(words);
        if *parts == [sizes(); 3] {
            notes.push(
                "The estimators expect gyros of the size of tables 1 and 2 of 002: no document states what the drift of these is."
                    .to_owned(),
            );
        }
        notes.push(
            "Taken as a platform's gyros x and y level, z up or down. The mean over the calibration, Earth's rate included, is taken \
             out; what is held is the mean of its last hour."
                .to_owned(),
        );
        let mut rows = Vec::new();
        for care in CARES {
            rows.push(Row {
                case: "as logged".to_owned(),
                course: voyage.sail(care, &drift, parts)?,
                spread: None,
            });
        }
        let source = format!("The log of unit {}", columns.unit);
        Ok(Report { voyage: *voyage, source, seeds: 0, rows, notes })
    }

    /// What can be done where the log is shorter than the calibration.
    fn otherwise(&self, parts: &[DriftParts; 3]) -> String {
        match &self.document {
            None => "say how large the drift is with --calibration or --trend instead of the log".to_owned(),
            Some(path) if *parts == [sizes(); 3] => format!(
                "say how large the drift is with --trend instead of the log: {} has no [gyro.sensor.drift], which isotherm-calibrate \
                 drift --calibration puts in",
                path.display()
            ),
            Some(path) => format!("leave the log out: {} says how large the drift is", path.display()),
        }
    }

    fn columns(&self, logs: &[PathBuf], cut: &Cut) -> Result<Columns, Error> {
        let args = LogArgs { log: logs.to_vec(), reading: self.reading.clone() };
        let unit = self.reading.serial()?;
        let raw = self.reading.mapping.is_some();
        if !raw && (logs.iter().all(|path| is_csv(path)) || self.document.is_none()) {
            let mut bar = Bar::at_work("reading");
            let columns = Columns::of_corrected(logs, unit.as_ref(), Kind::Rate, cut, || bar.step());
            bar.finish();
            return columns;
        }
        let Some(document) = &self.document else {
            return Err(Error::Usage("a raw log needs --calibration, to be corrected with".to_owned()));
        };
        let loaded = load_calibration(document)?;
        let run = args.run(Some(&loaded.unit))?;
        let columns = Columns::corrected_by(&run, &loaded, Kind::Rate, [Bar::reading(), Bar::reading()]);
        run.hand_on(cut);
        columns
    }
}

/// Gyros of the size of 002's.
fn sizes() -> DriftParts {
    let [sigma, time_h, trend, trend_time_h, initial, walk] = SIZES_DEG_H;
    let rate = |deg_per_h: f64| AngularRate::from_deg_per_h(deg_per_h).as_rad_per_s();
    DriftParts {
        sigma_rad_per_s: rate(sigma),
        correlation_time_s: time_h * HOUR_S,
        trend_sigma_rad_per_s2: rate(trend) / HOUR_S,
        trend_correlation_time_s: trend_time_h * HOUR_S,
        initial_sigma_rad_per_s: rate(initial),
        // 1 °/√h is 1 °/h over √(1/h).
        angle_random_walk_rad_per_sqrt_s: rate(walk) * HOUR_S.sqrt(),
    }
}
