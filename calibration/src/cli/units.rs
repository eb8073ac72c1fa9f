//! The units of a command's logs, and what each has to work on.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use isotherm_log::part::Part;
use isotherm_protocol::key::UnitId;

use super::runs::{BaseArgs, LogArgs, Reading};
use crate::document::{Written, are_copies, files_of, name_of};
use crate::error::Error;
use crate::numbers::once_each;
use crate::runs::Run;
use crate::runs::cut::Cut;

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
pub(super) struct Logs<'a> {
    /// How logs are read.
    pub(super) reading: &'a Reading,
    /// Logs.
    pub(super) files: &'a [PathBuf],
    /// Whether all files of a unit are one run; else each log is one.
    pub(super) together: bool,
    /// How logs to judge on are read.
    pub(super) judging: &'a Reading,
    /// Logs to judge on.
    pub(super) judge: &'a [PathBuf],
    /// A document, or the folder that has one of each unit.
    pub(super) document: Option<&'a Path>,
    /// What a text log's unit is called where nothing is written of it and nobody says.
    pub(super) unnamed: Option<UnitId>,
}

/// A unit with its work, or with why there is none.
pub(super) type Unit = (UnitId, Result<Work, Error>);

type Runs = BTreeMap<UnitId, Vec<Run>>;

const NOTHING: &str = "the logs have no raw readings of any unit: give recordings of the bus (isotherm-replay \
                       record), or text logs with --mapping; a ROS 2 bag has other messages";

impl Work {
    /// A unit's work with nothing to be said of its logs yet.
    pub(super) fn new(base: Option<Written>, runs: Vec<Run>, judges: Vec<Run>) -> Self {
        Self { base, runs, judges, warnings: Vec::new(), cut: Cut::default() }
    }

    /// Has bars show how far its logs are read.
    pub(super) fn show(&mut self) {
        self.runs.iter_mut().chain(&mut self.judges).for_each(Run::show);
    }

    /// Where its logs are cut short, as far as they have been read.
    pub(super) fn cuts(&self) -> Vec<String> {
        let runs = self.runs.iter().chain(&self.judges).filter_map(Run::cut_short);
        once_each(runs.chain(self.cut.words()).map(str::to_owned))
    }

    /// What is to be said of its logs once they have been read.
    pub(super) fn told(&self) -> Vec<String> {
        [self.warnings.clone(), self.cuts()].concat()
    }

    /// The logs of its runs as they were given, each once.
    pub(super) fn logs(&self) -> Vec<PathBuf> {
        once_each(self.runs.iter().flat_map(Run::logs).cloned())
    }

    /// The document that it starts from, where none is fitted without.
    pub(super) fn base(&self) -> Result<&Written, Error> {
        self.base.as_ref().ok_or_else(|| Error::Usage("--calibration is needed".to_owned()))
    }

    /// The document that accelerometers are fitted into, or a first one where none is given; `add` says what to do about one
    /// without accelerometers.
    pub(super) fn base_with_accelerometers(
        &self,
        add: &str,
        first: impl FnOnce() -> Result<Written, Error>,
    ) -> Result<Cow<'_, Written>, Error> {
        match &self.base {
            Some(base) if base.document.accel.is_some() => Ok(Cow::Borrowed(base)),
            Some(_) => Err(Error::refused(format!("the document has no accelerometers: {add}"))),
            None => first().map(Cow::Owned),
        }
    }

    /// Its only run, where all files of a unit are one.
    pub(super) fn run(&self) -> Result<&Run, Error> {
        self.runs.first().ok_or_else(|| Error::refused(NOTHING))
    }
}

impl<'a> Logs<'a> {
    /// Logs that are one run of each unit.
    pub(super) fn together(log: &'a LogArgs, base: &'a BaseArgs) -> Self {
        Self { together: true, document: base.document.as_deref(), ..Self::of(log) }
    }

    /// Logs to judge a document on, or the documents of a folder.
    pub(super) fn judging(log: &'a LogArgs, document: &'a Path) -> Self {
        Self { document: Some(document), ..Self::of(log) }
    }

    /// Logs of which each is a run.
    pub(super) fn of(log: &'a LogArgs) -> Self {
        let LogArgs { log, reading } = log;
        Self {
            reading,
            files: log,
            together: false,
            judging: reading,
            judge: &[],
            document: None,
            unnamed: None,
        }
    }

    /// All that is read.
    pub(super) fn inputs(&self) -> Vec<&'a Path> {
        self.files.iter().chain(self.judge).map(PathBuf::as_path).chain(self.document).collect()
    }

    /// The documents of units, where each of a folder has its own.
    pub(super) fn documents(&self, units: &[Unit]) -> Vec<PathBuf> {
        let base = |(_, work): &Unit| Some(work.as_ref().ok()?.base.as_ref()?.name.clone());
        let folder = self.document.into_iter();
        folder.flat_map(|folder| units.iter().filter_map(base).map(|name| folder.join(name))).collect()
    }

    /// A log counts once, and judges nothing that was fitted to it.
    fn each_once(&self) -> Result<(), Error> {
        let logs = self.files;
        once_each_log(logs)?;
        let [fitted, judged] = [self.reading.part()?, self.judging.part()?];
        let is_before = |one: &Part, other: &Part| one.end.is_some_and(|end| end <= other.start);
        if is_before(&fitted, &judged) || is_before(&judged, &fitted) {
            return Ok(());
        }
        match self.judge.iter().find(|judge| logs.iter().any(|log| are_one_log(log, judge))) {
            None => Ok(()),
            Some(judge) => {
                // Where judging logs are read like the others, there is no other part of them.
                let part = if std::ptr::eq(self.reading, self.judging) {
                    ""
                } else {
                    ", or another part (--duration, --judge-start)"
                };
                Err(Error::Usage(format!(
                    "--judge {}: the document is fitted to the same part of it: give another log{part}",
                    judge.display()
                )))
            }
        }
    }

    /// The units that there is something to do of: that of the document, else all that the logs have.
    pub(super) fn units(&self) -> Result<Vec<Unit>, Error> {
        self.each_once()?;
        let folder = self.document.filter(|path| path.is_dir());
        if let Some(document) = self.document.filter(|_| folder.is_none()) {
            let base = Written::read(document)?;
            let unit = base.loaded.unit.clone();
            let (runs, others) = self.of_document(self.runs(Some(&unit))?, &unit)?;
            let judges = match self.judges(Some(&unit))? {
                Some(judges) => self.of_document(judges, &unit)?.0,
                None => Vec::new(),
            };
            let mut work = self.warned(&unit, Work::new(Some(base), runs, judges))?;
            if !others.is_empty() {
                work.warnings.push(format!(
                    "the logs also have unit {}, which is left out: the document is of {unit}. For all units give a folder \
                     with the document of each",
                    others.join(", ")
                ));
            }
            return Ok(vec![(unit, Ok(work))]);
        }
        let of_units = self.runs(self.unnamed.as_ref())?;
        if of_units.is_empty() {
            return Err(self.nothing()?);
        }
        let mut documents = folder.map(of_folder).transpose()?;
        let mut judging = self.judges(of_units.keys().next())?.unwrap_or_default();
        let several = of_units.len() > 1;
        let mut work = |unit: &UnitId, runs| {
            let own = documents.as_mut().map(|documents| {
                documents.remove(unit).ok_or_else(|| {
                    Error::refused(format!(
                        "no document of the folder is for unit {unit}: put one there, or leave the unit out with --unit"
                    ))
                })
            });
            let base = own.transpose()?;
            let judges = judging.remove(unit).unwrap_or_default();
            let unjudged = judges.is_empty() && !self.judge.is_empty();
            if unjudged && !several {
                return Err(Error::refused(format!("--judge: the logs have nothing of unit {unit}")));
            }
            let mut work = self.warned(unit, Work::new(base, runs, judges))?;
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

    /// That there is nothing to do, and why.
    fn nothing(&self) -> Result<Error, Error> {
        let words = |unit| format!("the logs have no raw readings of unit {unit} (--unit)");
        Ok(Error::refused(self.reading.serial()?.map_or_else(|| NOTHING.to_owned(), words)))
    }

    /// The work, with a warning that logs have nothing of the unit that was asked for.
    fn warned(&self, unit: &UnitId, mut work: Work) -> Result<Work, Error> {
        let used: Vec<&PathBuf> = work.runs.iter().chain(&work.judges).flat_map(Run::logs).collect();
        let without: Vec<String> = self
            .files
            .iter()
            .chain(self.judge)
            .filter(|log| !used.contains(log))
            .map(|log| log.display().to_string())
            .collect();
        if self.reading.serial()?.is_some() && !without.is_empty() {
            work.warnings
                .push(format!("left out, with nothing of unit {unit} (--unit): {}", without.join(", ")));
        }
        Ok(work)
    }

    fn runs(&self, fallback: Option<&UnitId>) -> Result<Runs, Error> {
        if !self.together {
            return self.reading.runs(self.files, fallback);
        }
        let one = self.reading.runs_in(self.files, fallback)?.into_iter();
        Ok(one.map(|(unit, run)| (unit, vec![run])).collect())
    }

    /// What the judging logs have, where there are any.
    fn judges(&self, fallback: Option<&UnitId>) -> Result<Option<Runs>, Error> {
        let given = (!self.judge.is_empty()).then_some(self.judge);
        given.map(|logs| self.judging.runs(logs, fallback)).transpose()
    }

    /// The runs of the unit that a document is of, and the other units that there are.
    fn of_document(&self, mut runs: Runs, unit: &UnitId) -> Result<(Vec<Run>, Vec<String>), Error> {
        let own = runs.remove(unit);
        let others: Vec<String> = runs.keys().map(ToString::to_string).collect();
        match own {
            Some(own) => Ok((own, others)),
            None if others.is_empty() => Err(self.nothing()?),
            None => Err(Error::refused(format!(
                "the logs are of unit {}, the document is of {unit}: give the document of that unit; if the serial has \
                 changed, change unit in the document",
                others.join(", ")
            ))),
        }
    }
}

/// The documents of a folder, by the unit that each is of; column mappings may stand beside them. Of two of one unit the one that is
/// named after it counts.
fn of_folder(folder: &Path) -> Result<BTreeMap<UnitId, Written>, Error> {
    let mut paths = files_of(folder)?;
    paths.retain(|path| {
        path.extension().is_some_and(|extension| extension == "toml")
            && !name_of(path).ends_with(".mapping.toml")
    });
    paths.sort();
    let mut documents: BTreeMap<UnitId, Written> = BTreeMap::new();
    for path in &paths {
        let written = Written::read(path)?;
        let unit = written.loaded.unit.clone();
        let own = format!("{unit}.toml");
        let other = documents.get(&unit).map(|other| name_of(Path::new(&other.name)));
        match other {
            Some(other) if other == own => {}
            Some(other) if name_of(path) != own => {
                return Err(Error::refused(format!(
                    "{other} and {} are both for unit {unit}: name the one to take {own}",
                    name_of(path)
                )));
            }
            _ => drop(documents.insert(unit, written)),
        }
    }
    Ok(documents)
}

/// Refuses a log that is given twice, even as a copy.
pub(super) fn once_each_log(logs: &[PathBuf]) -> Result<(), Error> {
    let earlier = |at: usize, log: &Path| logs.iter().take(at).find(|other| are_one_log(log, other));
    let again =
        logs.iter().enumerate().find_map(|(at, log)| Some((log.display(), earlier(at, log)?.display())));
    let Some((log, other)) = again else { return Ok(()) };
    Err(Error::Usage(if log.to_string() == other.to_string() {
        format!("{log} is given twice: each log counts once")
    } else {
        format!("{log} is {other} once more: each log counts once")
    }))
}

/// Whether two logs are the same file, or copies of each other.
fn are_one_log(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b || are_copies(&a, &b),
        _ => a == b,
    }
}
