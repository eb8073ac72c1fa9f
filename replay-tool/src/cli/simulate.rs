//! `isotherm-replay simulate`.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
use isotherm_cli::{Bar, Exit, print, seconds};
use isotherm_correction::units::Span;
use isotherm_simulator::{Scenario, Simulation, presets};
use serde::Serialize;

use super::{check_outputs, show};
use crate::error::Error;
use crate::simulated::{LogWriter, write_truth, write_truth_header};
use isotherm_log::file::{Sink, read_small_text, write_whole};
use isotherm_log::mapping::Mapping;

/// Simulate a log, with the mapping that reads it back
#[derive(Debug, Args)]
#[command(
    group = ArgGroup::new("what").required(true).args(["scenario", "preset", "list_presets", "print_preset"]),
    after_help = "Example:\n  isotherm-replay simulate --preset zeeman-sine --duration 60 --out zeeman.csv --truth truth.csv\n\n\
        Writes zeeman.csv and zeeman.mapping.toml; a name that ends in .gz is compressed.\n\n\
        To write your own scenario, start from a preset:\n  \
        isotherm-replay simulate --print-preset mems-chamber > mine.toml"
)]
pub(super) struct SimulateArgs {
    /// Scenario (TOML)
    #[arg(value_name = "SCENARIO")]
    scenario: Option<PathBuf>,
    /// Preset scenario
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// List the presets
    #[arg(long, conflicts_with_all = ["out", "truth", "json", "seed", "duration"])]
    list_presets: bool,
    /// Print a preset as TOML, with --seed and --duration applied
    #[arg(long, value_name = "NAME", conflicts_with_all = ["out", "truth", "json"])]
    print_preset: Option<String>,
    /// Log to write
    #[arg(long, short, value_name = "FILE", required_unless_present_any = ["list_presets", "print_preset"])]
    out: Option<PathBuf>,
    /// Truth to write: increments, temperatures and drifts
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Seed of all noise (default: the scenario's)
    #[arg(long, value_parser = clap::value_parser!(u64).range(..=LARGEST_SEED))]
    seed: Option<u64>,
    /// Duration (s) (default: the scenario's)
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Span>,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// Largest seed that a scenario can state: TOML has no larger whole numbers.
const LARGEST_SEED: u64 = i64::MAX.cast_unsigned();

/// A ready-made scenario.
struct Preset {
    name: &'static str,
    about: &'static str,
    make: fn(u64) -> Scenario,
}

/// All ready-made scenarios.
const PRESETS: [Preset; 7] = [
    Preset {
        name: "zeeman-rest",
        about: "laser unit at rest, +20 to +50 °C, mode reversal every two minutes, 1 h",
        make: presets::zeeman_rest,
    },
    Preset {
        name: "zeeman-sine",
        about: "laser unit swinging by 1° at 1 Hz, +20 to +50 °C, mode reversal every 12 s, 20 min",
        make: presets::zeeman_sine,
    },
    Preset {
        name: "fibre-optic-training",
        about: "fibre-optic unit at rest through the chamber programme to fit a model on, 6 h 20 min",
        make: |seed| presets::fibre_optic_chamber(seed, presets::training_profile()),
    },
    Preset {
        name: "fibre-optic-judging",
        about: "fibre-optic unit at rest through the chamber programme to judge a model on, 5 h 28 min",
        make: |seed| presets::fibre_optic_chamber(seed, presets::judging_profile()),
    },
    Preset {
        name: "fibre-optic-paper",
        about: "fibre-optic unit at rest through the chamber programme of Vahrameev 2017, 18 h 20 min",
        make: |seed| presets::fibre_optic_chamber(seed, presets::paper_profile()),
    },
    Preset {
        name: "mems-chamber",
        about: "micromechanical unit at rest through a chamber cycle, +25 to -40 to +80 to +25 °C, 100 Hz",
        make: presets::mems_chamber,
    },
    Preset {
        name: "skewed-six",
        about: "six gyros and six accelerometers along the axes of a dodecahedron, swinging, 10 min",
        make: |seed| presets::skewed_six(seed, None),
    },
];

/// What was written.
#[derive(Debug, Serialize)]
struct Report {
    unit: String,
    seed: u64,
    ticks: u64,
    temperature_readings: u64,
    log: String,
    mapping: String,
    truth: Option<String>,
}

impl SimulateArgs {
    /// The scenario that the arguments name.
    fn scenario(&self) -> Result<Scenario, Error> {
        let mut scenario = match (&self.scenario, self.preset.as_ref().or(self.print_preset.as_ref())) {
            (Some(path), _) => load(path)?,
            (None, Some(name)) => {
                let preset = PRESETS.iter().find(|preset| preset.name == name).ok_or_else(|| {
                    let names: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
                    Error::Usage(format!("there is no preset {name:?}; presets are {}", names.join(", ")))
                })?;
                (preset.make)(1)
            }
            (None, None) => return Err(Error::Usage("give a scenario or --preset".into())),
        };
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        scenario.duration_s = self.duration.map_or(scenario.duration_s, Span::as_s);
        Ok(scenario)
    }
}

/// Reads a scenario from a file.
fn load(path: &Path) -> Result<Scenario, Error> {
    let text = read_small_text(path, "read the scenario")?;
    isotherm_document::parse(&text, &path.display().to_string())
        .map_err(|problems| Error::Scenario(problems.iter().map(ToString::to_string).collect()))
}

/// Runs the command.
pub(super) fn run(args: &SimulateArgs) -> Result<Exit, Error> {
    if args.list_presets {
        let rows: Vec<_> =
            PRESETS.iter().map(|preset| format!("{:21} {}\n", preset.name, preset.about)).collect();
        return Ok(print(&rows.concat(), Exit::Ok));
    }
    if args.print_preset.is_some() {
        let text =
            toml::to_string(&args.scenario()?).map_err(|error| Error::Scenario(vec![error.to_string()]))?;
        return Ok(print(&text, Exit::Ok));
    }
    let Some(out) = &args.out else { return Err(Error::Usage("give --out".into())) };
    let scenario = args.scenario()?;
    let mut rows = LogWriter::of(&scenario)?;
    let name = args.scenario.as_ref().map_or_else(String::new, |path| format!("{}: ", path.display()));
    let simulation = Simulation::new(&scenario)
        .map_err(|errors| Error::Scenario(errors.0.iter().map(|error| format!("{name}{error}")).collect()))?;

    let mapping = Mapping::path_beside(out);
    let outputs = [Some(out.as_path()), Some(&mapping), args.truth.as_deref()];
    check_outputs(outputs.into_iter().flatten(), args.scenario.as_deref(), args.overwrite)?;
    let mut log = Sink::create(out)?;
    log.write(|writer| rows.write_header(writer))?;
    let mut truth = args.truth.as_deref().map(Sink::create).transpose()?;
    if let Some(truth) = &mut truth {
        truth.write(|writer| write_truth_header(scenario.instrument.gyros.count(), writer))?;
    }
    let mut report = Report {
        unit: scenario.unit.clone(),
        seed: scenario.seed,
        ticks: 0,
        temperature_readings: 0,
        log: out.display().to_string(),
        mapping: mapping.display().to_string(),
        truth: args.truth.as_ref().map(|path| path.display().to_string()),
    };
    let mut bar = Bar::over_ticks(simulation.remaining());
    for step in simulation {
        log.write(|writer| rows.write(&step, writer))?;
        if let Some(truth) = &mut truth {
            truth.write(|writer| write_truth(&step, writer))?;
        }
        report.ticks += 1;
        report.temperature_readings += step.temperatures.len() as u64;
        bar.step();
    }
    bar.finish();
    let log = log.finish()?;
    if let Some(truth) = truth {
        truth.finish()?.keep()?;
    }
    write_whole(&mapping, rows.mapping().as_bytes(), true)
        .map_err(|source| Error::file(&mapping, "write", source))?;
    log.keep()?;
    Ok(print(&if args.json { show::json(&report) } else { human(&report) }, Exit::Ok))
}

/// The summary as a table.
fn human(report: &Report) -> String {
    let mut rows = vec![
        ("unit", report.unit.clone()),
        ("ticks", report.ticks.to_string()),
        ("temperature readings", report.temperature_readings.to_string()),
        ("log", report.log.clone()),
        ("mapping", report.mapping.clone()),
    ];
    rows.extend(report.truth.iter().map(|truth| ("truth", truth.clone())));
    show::table(&rows)
}
