//! `isotherm-calibrate impact`.

mod sail;

use std::path::{Path, PathBuf};
use std::slice;

use clap::{Args, ValueEnum};
use isotherm_correction::drift::DriftParts;
use isotherm_correction::units::AngularRate;
use isotherm_log::diff::is_csv;

use super::driver::emit;
use super::files::PageArgs;
use super::runs::{LogArgs, Reading};
use super::units::{Logs, once_each_log};
use crate::document::{Written, name_of};
use crate::error::Error;
use crate::fits::drift::HOUR_S;
use crate::fits::drift::columns::{Columns, Kind};
use crate::fits::impact::scenario::Voyage;
use crate::fits::impact::{logged, over_starts};
use crate::limits::within;
use crate::report::short;
use crate::runs::cut::Cut;

/// Sizes of the gyros in tables 1 and 2 of 002, for a drift without a document: σ, τ, σ1, τ1, constant part, N.
const SIZES_DEG_H: [f64; 6] = [0.0034, 9.5, 0.000_08, 140.0, 0.05, 0.0002];

/// What a drift means for navigation: heading and position of a platform system over two days without a position fix
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate impact --trend 0.00008 --html impact.html\n  \
    isotherm-calibrate impact --calibration unit-drift.toml --seeds 100\n  \
    isotherm-calibrate impact corrected.mcap --calibration-hours 21\n  \
    isotherm-calibrate impact --calibration unit-drift.toml --start-log monday.mcap --start-log tuesday.mcap --start-log friday.mcap\n\n\
    The system is calibrated, then navigates alone; its level platform turns about the vertical at four times the Earth's rate. Each drift is run four times: held at its last value, and with the service's own drift estimator with a Markov part (002's model 1), with Markov part and trend, with the trend alone (002's new model).")]
pub(super) struct ImpactArgs {
    /// Log at rest: corrected ticks (CSV, .mcap), or raw ones with --calibration
    #[arg(value_name = "LOG")]
    log: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Calibration document (TOML) with the drift; corrects a raw log
    #[arg(long = "calibration", short = 'c', alias = "document", short_alias = 'd', value_name = "FILE")]
    document: Option<PathBuf>,
    /// Straight trend from the calibration's beginning (°/h²)
    #[arg(
        long,
        value_name = "DEG_PER_H2",
        alias = "trend-deg-per-h2",
        allow_hyphen_values = true,
        conflicts_with = "log", value_parser = within(-100.0, 100.0))]
    trend: Option<f64>,
    /// Constant that appears at departure, as after a shock (°/h)
    #[arg(long, value_name = "DEG_PER_H", alias = "constant-deg-per-h", allow_hyphen_values = true, conflicts_with_all = ["log", "seeds"], value_parser = within(-1000.0, 1000.0))]
    constant: Option<f64>,
    /// Gyro with the trend or the constant (default: each alone, with --seeds all at once)
    #[arg(long, value_enum)]
    gyro: Option<Gyro>,
    /// Number of random drifts of the size in the document; --trend is added
    #[arg(long, value_name = "NUMBER", conflicts_with = "log", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: Option<u32>,
    /// Log at rest of one start; the means of two or more give the sigma of the constant; repeatable
    #[arg(long, value_name = "LOG")]
    start_log: Vec<PathBuf>,
    /// The first seed
    #[arg(long, hide_short_help = true, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    voyage: Voyage,
    #[command(flatten)]
    page: PageArgs,
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

impl Gyro {
    /// What a drift of it is called, and how much of it each gyro has.
    const fn case(self) -> (&'static str, [f64; 3]) {
        match self {
            Self::X => ("level gyro x", [1.0, 0.0, 0.0]),
            Self::Y => ("level gyro y", [0.0, 1.0, 0.0]),
            Self::Z => ("azimuth gyro z", [0.0, 0.0, 1.0]),
            Self::Each | Self::All => ("all gyros", [1.0; 3]),
        }
    }
}

impl ImpactArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        self.check()?;
        let mut voyage = self.voyage;
        let mut parts = self.parts()?;
        let cut = Cut::default();
        let starts = self.starts(&mut parts, &cut)?;
        let mut sailed = if !self.log.is_empty() {
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
            let words = "give a drift: a LOG, --calibration DOC, --trend DEG_PER_H2 or --constant DEG_PER_H";
            return Err(Error::Usage(words.to_owned()));
        };
        sailed.notes.extend(starts);
        let report = sailed.report();
        let files = self.page.files();
        files.page(Path::to_path_buf, || report.to_html())?;
        emit(files.json, || report.to_json(), || report.summary_text())?;
        Error::end(Vec::new(), cut.words().map(str::to_owned).into_iter().collect())
    }

    /// Checks what goes together, and the files.
    fn check(&self) -> Result<(), Error> {
        if self.gyro.is_some() && self.trend.is_none() && self.constant.is_none() {
            let words = "--gyro needs --trend or --constant: it names the gyro that has them";
            return Err(Error::Usage(words.to_owned()));
        }
        if self.gyro == Some(Gyro::Each) && self.seeds.is_some() {
            let words =
                "--gyro each runs each gyro alone, but --seeds makes drifts of all: give x, y, z or all";
            return Err(Error::Usage(words.to_owned()));
        }
        let inputs: Vec<&Path> =
            self.log.iter().chain(&self.start_log).chain(&self.document).map(PathBuf::as_path).collect();
        self.page.files().check(&inputs)
    }

    /// What the estimator is to expect: the document's, or gyros of the size of 002's, where there is none or where it only corrects
    /// the log.
    fn parts(&self) -> Result<[DriftParts; 3], Error> {
        let Some(path) = &self.document else { return Ok([sizes(); 3]) };
        let parts = Written::read(path)?.document.to_parts();
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
            Error::refused(format!(
                "{path} states a drift for {count} gyros, the platform has three: {advice}"
            ))
        })
    }

    /// Takes the sigma of the constant over starts from the logs that were given of them; gives what is to be said of the logs, and
    /// what was found.
    fn starts(&self, parts: &mut [DriftParts; 3], cut: &Cut) -> Result<Vec<String>, Error> {
        let mut notes = Vec::new();
        if self.start_log.is_empty() {
            return Ok(notes);
        }
        once_each_log(&self.start_log)?;
        let mut means = Vec::new();
        for path in &self.start_log {
            let mut columns = self.columns(slice::from_ref(path), cut)?;
            let name = name_of(path);
            let said = logged::sound(&mut columns).map_err(|error| error.of(&name))?;
            notes.extend(said.into_iter().map(|words| match words.strip_prefix("warning: ") {
                Some(words) => format!("warning: {name}: {words}"),
                None => format!("{name}: {words}"),
            }));
            means.push(over_starts::means(&columns));
        }
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
        notes.push(format!(
            "Sigma of the constant over {} starts, with its 95 % interval, gyros x, y, z: {} °/h. It replaces \
             initial_sigma.",
            means.len(),
            found.iter().map(of).collect::<Vec<_>>().join(", ")
        ));
        Ok(notes)
    }

    fn columns(&self, logs: &[PathBuf], cut: &Cut) -> Result<Columns, Error> {
        let args = LogArgs { log: logs.to_vec(), reading: self.reading.clone() };
        let raw = self.reading.mapping.is_some();
        if !raw && (logs.iter().all(|path| is_csv(path)) || self.document.is_none()) {
            let part = self.reading.part()?;
            return Columns::of_corrected(logs, &part, Kind::Rate, cut);
        }
        let Some(document) = &self.document else {
            return Err(Error::Usage("a raw log needs --calibration, to correct it".to_owned()));
        };
        // A document is of one unit.
        let (_, work) = Logs { together: true, ..Logs::judging(&args, document) }.units()?.swap_remove(0);
        let mut work = work?;
        work.show();
        let run = work.run()?;
        let columns = Columns::corrected_by(run, &work.base()?.loaded, Kind::Rate);
        run.hand_on(cut);
        let mut columns = columns?;
        columns.notes.extend(work.warnings);
        Ok(columns)
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
