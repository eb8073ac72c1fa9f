//! One unit or several: what each has to work on, and how a command does the same to all of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use isotherm_cli::Bar;
use isotherm_protocol::key::UnitId;
use serde_json::json;

use super::bar;
use super::output::OutputArgs;
use super::print;
use super::runs::Reading;
use crate::error::Error;
use crate::report::{BatchTable, UnitReport, in_parallel, of_unit};
use crate::runs::Run;
use crate::runs::cut::Cut;
use crate::written::{Written, write_file};

/// What a command has to work on of one unit.
pub(super) struct Work {
    /// Document that it starts from.
    pub(super) base: Option<Written>,
    /// Runs that it sees.
    pub(super) runs: Vec<Run>,
    /// Runs that it is judged on.
    pub(super) judges: Vec<Run>,
    /// What is to be said of the logs.
    pub(super) warnings: Vec<String>,
    /// Where a log that is not read as runs was found to be cut short.
    pub(super) cut: Cut,
}

/// Logs and documents as a command line names them.
pub(super) struct Named<'a> {
    /// How logs are read.
    pub(super) reading: &'a Reading,
    /// Logs.
    pub(super) logs: &'a [PathBuf],
    /// Whether all files of a unit are one run; else each log is one.
    pub(super) together: bool,
    /// How logs to judge on are read.
    pub(super) judging: &'a Reading,
    /// Logs to judge on.
    pub(super) judge: &'a [PathBuf],
    /// A document, or the folder that has UNIT.toml of each unit.
    pub(super) document: Option<&'a Path>,
    /// What a text log's unit is called where nothing is written of it and nobody says.
    pub(super) unnamed: Option<UnitId>,
}

/// A unit with its work, or with why there is none.
pub(super) type Unit = (UnitId, Result<Work, Error>);

/// What came of a unit.
pub(super) type Outcome<R> = (String, Result<R, Error>);

type Runs = BTreeMap<UnitId, Vec<Run>>;

const NOTHING: &str = "the logs have no raw readings of any unit: give recordings of the bus (isotherm-replay \
                       record), or text logs with --mapping; a ROS 2 bag has other messages";

impl Work {
    /// A unit's work with nothing to be said of its logs yet.
    pub(super) fn new(base: Option<Written>, runs: Vec<Run>, judges: Vec<Run>) -> Self {
        Self { base, runs, judges, warnings: Vec::new(), cut: Cut::default() }
    }

    /// Where its logs are cut short, as far as they have been read.
    pub(super) fn cuts(&self) -> Vec<String> {
        let mut cuts: Vec<String> = Vec::new();
        let runs = self.runs.iter().chain(&self.judges).filter_map(Run::cut_short);
        for words in runs.chain(self.cut.words()) {
            if cuts.iter().all(|known| known != words) {
                cuts.push(words.to_owned());
            }
        }
        cuts
    }

    /// What is to be said of its logs once they have been read.
    pub(super) fn told(&self) -> Vec<String> {
        [self.warnings.clone(), self.cuts()].concat()
    }

    /// The logs of its runs as they were given, each once.
    pub(super) fn logs(&self) -> Vec<PathBuf> {
        let mut logs: Vec<PathBuf> = Vec::new();
        for log in self.runs.iter().flat_map(Run::logs) {
            if !logs.contains(log) {
                logs.push(log.clone());
            }
        }
        logs
    }

    /// Its only run, where all files of a unit are one.
    pub(super) fn run(&self) -> Result<&Run, Error> {
        self.runs.first().ok_or_else(|| Error::Refused(vec![NOTHING.to_owned()]))
    }
}

impl<'a> Named<'a> {
    /// Logs that are one run of each unit.
    pub(super) fn together(reading: &'a Reading, logs: &'a [PathBuf], document: Option<&'a PathBuf>) -> Self {
        let document = document.map(PathBuf::as_path);
        Self { reading, logs, together: true, judging: reading, judge: &[], document, unnamed: None }
    }

    /// Logs of which each is a run, and others to judge on.
    pub(super) fn apart(
        reading: &'a Reading,
        logs: &'a [PathBuf],
        judge: &'a [PathBuf],
        document: Option<&'a PathBuf>,
    ) -> Self {
        Self { together: false, judge, ..Self::together(reading, logs, document) }
    }

    /// The units that there is something to do of: that of the document, else all that the logs have.
    pub(super) fn units(&self) -> Result<Vec<Unit>, Error> {
        let folder = self.document.filter(|path| path.is_dir());
        if let Some(document) = self.document.filter(|_| folder.is_none()) {
            let base = Written::read(document)?;
            let unit = base.loaded.unit.clone();
            let (runs, others) = self.of_document(self.runs(Some(&unit))?, &unit)?;
            let judges = match self.judges(Some(&unit))? {
                Some(judges) => self.of_document(judges, &unit)?.0,
                None => Vec::new(),
            };
            let mut work = Work::new(Some(base), runs, judges);
            if !others.is_empty() {
                work.warnings.push(format!(
                    "the logs also have unit {}, which is left out: the document is of {unit}. For all units give \
                     --calibration a folder with UNIT.toml of each",
                    others.join(", ")
                ));
            }
            return Ok(vec![(unit, Ok(work))]);
        }
        let of_units = self.runs(self.unnamed.as_ref())?;
        if of_units.is_empty() {
            return Err(Error::Refused(vec![NOTHING.to_owned()]));
        }
        let mut judging = self.judges(of_units.keys().next())?.unwrap_or_default();
        let several = of_units.len() > 1;
        let mut work = |unit: &UnitId, runs| {
            let base = folder.map(|folder| of_folder(folder, unit)).transpose()?;
            let judges = judging.remove(unit).unwrap_or_default();
            let unjudged = judges.is_empty() && !self.judge.is_empty();
            if unjudged && !several {
                return Err(Error::Refused(vec![format!("--judge: the logs have nothing of unit {unit}")]));
            }
            let mut work = Work::new(base, runs, judges);
            if unjudged {
                work.warnings.push(format!(
                    "the logs of --judge have nothing of unit {unit}: it is fitted, but judged in sample only"
                ));
            }
            Ok(work)
        };
        let units = of_units.into_iter().map(|(unit, runs)| {
            let work = work(&unit, runs);
            (unit, work)
        });
        Ok(units.collect())
    }

    fn runs(&self, fallback: Option<&UnitId>) -> Result<Runs, Error> {
        if !self.together {
            return self.reading.runs(self.logs, fallback);
        }
        let one = self.reading.runs_in(self.logs, fallback)?.into_iter();
        Ok(one.map(|(unit, run)| (unit, vec![run])).collect())
    }

    /// What the judging logs have, where there are any.
    fn judges(&self, fallback: Option<&UnitId>) -> Result<Option<Runs>, Error> {
        let given = (!self.judge.is_empty()).then_some(self.judge);
        given.map(|logs| self.judging.runs(logs, fallback)).transpose()
    }

    /// The runs of the unit that a document is of, or that --unit names, and the other units that there are.
    fn of_document(&self, mut runs: Runs, unit: &UnitId) -> Result<(Vec<Run>, Vec<String>), Error> {
        let wanted = self.reading.serial()?.unwrap_or_else(|| unit.clone());
        let own = runs.remove(&wanted);
        let others: Vec<String> = runs.keys().map(ToString::to_string).collect();
        match own {
            Some(own) => Ok((own, others)),
            None if others.is_empty() => Err(Error::Refused(vec![NOTHING.to_owned()])),
            None => Err(Error::Refused(vec![format!(
                "the logs are of unit {}, the document is of {unit}: give the document of that unit, or --unit if \
                 the serial has changed",
                others.join(", ")
            )])),
        }
    }
}

/// The document of a unit in a folder, which must be of that unit.
fn of_folder(folder: &Path, unit: &UnitId) -> Result<Written, Error> {
    let path = folder.join(format!("{unit}.toml"));
    if !path.exists() {
        return Err(Error::Refused(vec![format!(
            "{} does not exist: the folder of --calibration needs a document of each unit; leave the unit out with \
             --unit",
            path.display()
        )]));
    }
    let written = Written::read(&path)?;
    if written.loaded.unit != *unit {
        return Err(Error::Refused(vec![format!(
            "{} is of unit {}: correct its name or its unit",
            path.display(),
            written.loaded.unit
        )]));
    }
    Ok(written)
}

/// What the files of a unit are called: as they were given, or with its serial where there are several units.
pub(super) struct Names<'a>(Option<&'a str>);

impl Names<'_> {
    /// The name of one of them.
    pub(super) fn of(&self, given: &Path) -> PathBuf {
        self.0.map_or_else(|| given.to_path_buf(), |unit| of_unit(given, unit))
    }

    /// A bar over what is done without an end in sight, where it is the only unit: bars of several would fall over each other.
    pub(super) fn at_work(&self, message: &'static str) -> Bar {
        if self.0.is_none() { Bar::at_work(message) } else { Bar::hidden() }
    }
}

/// How a command does the same to all units.
pub(super) struct Batch<'a> {
    /// Where what comes of it goes.
    pub(super) output: &'a OutputArgs,
    /// Heading of the page that has the table of several units.
    pub(super) title: &'a str,
    /// Whether a refused sensor is no failure.
    pub(super) accept_partial: bool,
}

impl Batch<'_> {
    /// Does `one` to all units, as many at a time as there are processors, and closes several with one table. `one` writes what
    /// comes of a unit under the names that it is told, with the bars that it is told; a unit that comes to nothing does not stop the
    /// others.
    pub(super) fn carry_out<R: UnitReport + Send>(
        &self,
        mut units: Vec<Unit>,
        one: impl Fn(&Work, &Names<'_>, fn() -> Bar) -> Result<R, Error> + Sync,
    ) -> Result<(), Error> {
        if units.len() == 1
            && let Some((_, work)) = units.pop()
        {
            let work = work?;
            let report =
                one(&work, &Names(None), bar::reading).map_err(|error| error.beside(&work.cuts()))?;
            let json = self.output.json;
            print(if json { format!("{}\n", report.to_json()) } else { report.to_text() }.as_bytes())?;
            return Error::end(refusals(&report, self.accept_partial), work.cuts());
        }
        units.iter().try_for_each(|(unit, _)| self.output.check_unit(unit.as_str()))?;
        let bar = Bar::counting("units done", units.len());
        let came = in_parallel(
            &units,
            |ready| bar.at(ready as u64),
            |(unit, work)| {
                let work = work.as_ref().map_err(|error| Error::Refused(vec![error.to_string()]))?;
                one(work, &Names(Some(unit.as_str())), Bar::hidden)
                    .map_err(|error| error.beside(&work.cuts()))
            },
        );
        bar.finish();
        let mut cuts: Vec<String> =
            units.iter().filter_map(|(_, work)| work.as_ref().ok()).flat_map(Work::cuts).collect();
        cuts.sort();
        cuts.dedup();
        let names = units.into_iter().map(|(unit, _)| unit.to_string());
        let came = names.zip(came).collect::<Vec<_>>();
        let page = self.output.page();
        Error::end(close(self.title, &came, (page, self.output.json), self.accept_partial)?, cuts)
    }
}

/// What was refused of a unit. A part of the sensors is no failure where that is accepted; all of them are.
fn refusals<R: UnitReport>(report: &R, accept_partial: bool) -> Vec<String> {
    let partial = accept_partial && report.rows().iter().any(|row| row.accepted);
    if partial { Vec::new() } else { report.refusals() }
}

/// Prints what came of several units, the table that closes them last; `html` is a page of that table, and whether it may replace
/// another. What was refused comes back, and after that the units that came to nothing.
pub(super) fn close<R: UnitReport>(
    title: &str,
    units: &[Outcome<R>],
    (html, as_json): ((Option<&Path>, bool), bool),
    accept_partial: bool,
) -> Result<Vec<String>, Error> {
    let mut batch = BatchTable::of::<R>();
    let (mut refused, mut failed, mut reports) = (Vec::new(), Vec::new(), Vec::new());
    for (unit, came) in units {
        match came {
            Ok(report) => {
                if as_json {
                    reports.push(report.to_json());
                } else {
                    print(format!("{}\n", report.to_text()).as_bytes())?;
                }
                batch.add(unit, Ok(report.rows()));
                refused.extend(refusals(report, accept_partial));
            }
            Err(error) => {
                batch.add(unit, Err(error.to_string()));
                failed.push(format!("{unit}: {error}"));
            }
        }
    }
    if let (Some(html), overwrite) = html {
        write_file(html, batch.to_html(title).as_bytes(), overwrite)?;
    }
    if as_json {
        print(format!("{}\n", json!({ "batch": batch.to_json(), "reports": reports })).as_bytes())?;
    } else {
        print(batch.to_text().as_bytes())?;
    }
    Ok([refused, failed].concat())
}
