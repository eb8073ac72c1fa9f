//! `isotherm-replay import`.

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::PossibleValuesParser;
use isotherm_cli::{Exit, Window, number, print};
use isotherm_log::file::write_whole;
use isotherm_log::import::{ACCEL_UNITS, GYRO_UNITS, Hints, Proposal, TIME_UNITS, propose};
use isotherm_log::info::LogInfo;
use isotherm_log::mapping::{Delimiter, Encoding, Mapping};
use serde::Serialize;

use super::log_args::LogArgs;
use super::{check_outputs, info, plot, show};
use crate::error::Error;

/// Propose a column mapping for a text log of any maker, then show what the log contains
#[derive(Debug, Args)]
#[command(after_help = "Example, in two steps:\n  \
    printf 't [s],gx [deg/s],gy,gz\\n0.00,1,2,3\\n0.01,1,2,3\\n0.02,1,2,3\\n' > own.csv\n  \
    isotherm-replay import own.csv\n\n\
    Counts without header: isotherm-replay import log.txt --columns 'gx [counts],gy,gz,ax [counts],ay,az' --rate-hz 100\n\n\
    Finds delimiter, decimal mark, encoding, header, units, period, gaps and counters. Asks for the rest on a terminal;\n\
    elsewhere it ends with code 2 and names the options. The mapping gives the reason of each guess.")]
pub(super) struct ImportArgs {
    /// Files of one log, plain or gzip
    #[arg(required = true, value_name = "FILE")]
    log: Vec<PathBuf>,
    /// Column mapping to write (default: FILE with .mapping.toml)
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Plot to write (default: FILE with .html)
    #[arg(long, value_name = "FILE", conflicts_with = "no_plot")]
    plot: Option<PathBuf>,
    /// Write no plot
    #[arg(long)]
    no_plot: bool,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Column names with units, - for others: 'time [s],gx [deg/s],gy,gz,-,temp [degC]' (default: the header)
    #[arg(long, value_name = "NAMES", value_delimiter = ',', allow_hyphen_values = true)]
    columns: Vec<String>,
    /// Unit of the gyros (default: from the header)
    #[arg(long, value_name = "UNIT", value_parser = PossibleValuesParser::new(GYRO_UNITS))]
    gyro_unit: Option<String>,
    /// Unit of the accelerometers (default: from the header, else from gravity)
    #[arg(long, value_name = "UNIT", value_parser = PossibleValuesParser::new(ACCEL_UNITS))]
    accel_unit: Option<String>,
    /// Unit of the time column, or the order of its dates (default: from the header, its cells and steps)
    #[arg(long, value_name = "UNIT", value_parser = PossibleValuesParser::new(TIME_UNITS))]
    time_unit: Option<String>,
    /// Serial of the unit to take, if rows are of several
    #[arg(long, value_name = "SERIAL")]
    serial: Option<String>,
    /// Ticks per second, for a log without usable time (Hz)
    #[arg(long, value_name = "HZ", value_parser = number("", 1e-3..=1e6))]
    rate_hz: Option<f64>,
    /// Delimiter (default: detected)
    #[arg(long, value_name = "WORD", value_parser = PossibleValuesParser::new(Delimiter::ALL.map(Delimiter::word)))]
    delimiter: Option<String>,
    /// Decimal mark (default: detected)
    #[arg(long, value_name = "MARK", value_parser = PossibleValuesParser::new([".", ","]))]
    decimal_mark: Option<String>,
    /// Encoding (default: detected)
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Encoding::ALL.map(Encoding::word)))]
    encoding: Option<String>,
    /// Print one JSON object: mapping, notes, info
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Report<'a> {
    mapping: String,
    plot: Option<String>,
    notes: &'a [String],
    info: &'a LogInfo,
}

impl ImportArgs {
    fn hints(&self) -> Hints {
        let delimiter = |word: &String| Delimiter::ALL.into_iter().find(|delimiter| delimiter.word() == word);
        let encoding = |word: &String| Encoding::ALL.into_iter().find(|encoding| encoding.word() == word);
        Hints {
            delimiter: self.delimiter.as_ref().and_then(delimiter),
            decimal_mark: self.decimal_mark.as_ref().and_then(|mark| mark.chars().next()),
            encoding: self.encoding.as_ref().and_then(encoding),
            columns: self.columns.clone(),
            gyro_unit: self.gyro_unit.clone(),
            accel_unit: self.accel_unit.clone(),
            time_unit: self.time_unit.clone(),
            rate_hz: self.rate_hz,
            serial: self.serial.clone(),
            skip_bad_rows: false,
        }
    }

    fn first(&self) -> &Path {
        self.log.first().map_or(Path::new(""), PathBuf::as_path)
    }

    /// The page of the first plot, beside the mapping of the log.
    fn page(&self) -> PathBuf {
        Mapping::path_beside(self.first()).with_extension("").with_extension("html")
    }

    /// The log as the other commands take it.
    fn as_log(&self, mapping: &Path) -> LogArgs {
        LogArgs {
            log: self.log.clone(),
            mapping: Some(mapping.to_owned()),
            unit: Vec::new(),
            window: Window::default(),
        }
    }
}

/// Runs the command.
pub(super) fn run(args: &ImportArgs) -> Result<Exit, Error> {
    let out = args.out.clone().unwrap_or_else(|| Mapping::path_beside(args.first()));
    let page = (!args.no_plot).then(|| args.plot.clone().unwrap_or_else(|| args.page()));
    let (outputs, inputs) = (std::iter::once(&out).chain(&page), &args.log);
    check_outputs(outputs.map(PathBuf::as_path), inputs.iter().map(PathBuf::as_path), args.overwrite)?;
    let mut hints = args.hints();
    let mut proposal = settled(args, &mut hints)?;
    write(&out, &proposal)?;
    let log = args.as_log(&out);
    let info = match info::survey(&log) {
        Ok(info) => info,
        // A row that does not fit the others is passed over and counted, as the mapping then says.
        Err(Error::Log(isotherm_log::error::Error::Log(_))) => {
            hints.skip_bad_rows = true;
            proposal = propose(&args.log, &hints)?;
            write(&out, &proposal)?;
            info::survey(&log)?
        }
        Err(error) => return Err(error),
    };
    if let Some(page) = &page {
        plot::first_plot(&log, page)?;
    }
    let page = page.map(|page| page.display().to_string());
    let text = if args.json {
        show::json(&Report {
            mapping: out.display().to_string(),
            plot: page,
            notes: &proposal.notes,
            info: &info,
        })
    } else {
        let notes: Vec<_> = proposal.notes.iter().map(|note| format!("  {note}\n")).collect();
        let notes = notes.concat();
        let drawn = page.map_or_else(String::new, |page| format!("{page}: a first plot\n"));
        format!("{}\n{}: the mapping\n{notes}{drawn}", info::tables::of(&info), out.display())
    };
    Ok(print(&text, info::outcome(&info)))
}

/// A proposal in which nothing is open: what is, is asked on a terminal.
fn settled(args: &ImportArgs, hints: &mut Hints) -> Result<Proposal, Error> {
    loop {
        let proposal = propose(&args.log, hints)?;
        let Some(question) = proposal.open.first() else { return Ok(proposal) };
        if !(io::stdin().is_terminal() && io::stderr().is_terminal()) {
            let open: Vec<_> =
                proposal.open.iter().map(|open| format!("{open}: give {}", open.option())).collect();
            return Err(Error::Usage(open.join("\n")));
        }
        let mut stderr = io::stderr();
        let mut answer = String::new();
        // A terminal that is gone answers with nothing.
        let _ = write!(stderr, "{question}\n{}> ", question.option()).and_then(|()| stderr.flush());
        if io::stdin().lock().read_line(&mut answer).unwrap_or(0) == 0 {
            return Err(Error::Stopped);
        }
        if let Err(must_be) = question.answer(&answer, hints) {
            let _ = writeln!(stderr, "{must_be}");
        }
    }
}

/// Writes the mapping, once it is sure that it can be read.
fn write(out: &Path, proposal: &Proposal) -> Result<(), Error> {
    Mapping::parse(&proposal.mapping, &out.display().to_string())
        .map_err(isotherm_log::error::Error::Mapping)?;
    write_whole(out, proposal.mapping.as_bytes(), true)
        .map_err(|source| Error::file(out, "write the mapping (--out gives another place)", source))
}
