//! What stands in the middle of a chain.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::case::Beside;
use super::page::TOKEN;
use super::profile::Profile;
use super::python;
use crate::error::Error;
use crate::part::{Plan, Ready, unit_name};
use crate::process::{Process, beside, this};

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Subject {
    /// The reference: puts what comes in on the output key.
    Relay,
    /// The same, with the keys declared that it receives.
    Keyed,
    /// `isotherm serve`.
    Service,
    /// What a user would write: a Python subscriber with numpy.
    Python,
}

/// How long the middle may take to be ready, with thousands of documents to read.
const START_LIMIT: Duration = Duration::from_secs(120);

impl Subject {
    /// What it is called.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Relay => "relay",
            Self::Keyed => "relay, keys declared",
            Self::Service => "isotherm",
            Self::Python => "python",
        }
    }

    /// What it gives is not what it should.
    pub(crate) fn wrong(self, what: String) -> Error {
        Error::Output { subject: self.name(), what }
    }
}

/// Starts what stands in the middle; the process, where it listens, and where it answers over HTTP.
pub(crate) fn start(
    plan: &Plan,
    plan_file: &Path,
    profile: &Profile,
) -> Result<(Process, String, Option<String>), Error> {
    let mut command = match plan.subject {
        Subject::Relay | Subject::Keyed => {
            let mut command = Command::new(this()?);
            command.args(["part", "relay"]).arg(plan_file);
            command
        }
        Subject::Service => serve(plan)?,
        Subject::Python => python::relay(plan)?,
    };
    // A second one is started where the first is known.
    let name = if plan.connect.is_empty() { plan.subject.name() } else { "standby" };
    if let Some(runtime) = &profile.runtime {
        command.env("ZENOH_RUNTIME", runtime);
    }
    let process = Process::start(name, &mut command, &plan.folder)?;
    let Ready { locators, metrics, .. } = process.hear(START_LIMIT)?;
    let locator = locators.into_iter().next().ok_or_else(|| Error::of(name)("listens nowhere"))?;
    Ok((process, locator, metrics))
}

/// The service, with a document for each unit.
fn serve(plan: &Plan) -> Result<Command, Error> {
    let program = beside("isotherm")?;
    let write = |name: &str, text: String| {
        let path = plan.folder.join(name);
        fs::write(&path, text).map(|()| path.clone()).map_err(|source| Error::file(&path, source))
    };
    let documents = plan.folder.join("units");
    fs::create_dir_all(&documents).map_err(|source| Error::file(&documents, source))?;
    for unit in 0..plan.case.units {
        write(&format!("units/{unit}.toml"), document(unit, 0)?)?;
    }
    let name = if plan.connect.is_empty() { "first" } else { "second" };
    let congestion = if plan.case.is_saturated() { "block" } else { "drop" };
    let units = plan.case.units.max(1);
    let state = if plan.case.state { format!("state = \"{name}\"\n") } else { String::new() };
    let beside = match plan.case.beside {
        Some(Beside::Pages) => {
            write("token", TOKEN.to_owned())?;
            "[web]\nenabled = true\ntoken_file = \"token\"\n[metrics]\nlisten = \"127.0.0.1:0\"\n".to_owned()
        }
        Some(Beside::Standby) => format!("[pair]\nname = \"{name}\"\n"),
        Some(Beside::Swaps) | None => String::new(),
    };
    let text = format!(
        "calibrations = \"units\"\n{state}max_units = {units}\ncongestion = \"{congestion}\"\n{beside}"
    );
    let settings = write(&format!("{name}.toml"), text)?;
    let mut command = Command::new(program);
    command.args(["serve", "--announce", "--json", "--listen", "tcp/127.0.0.1:0", "--config"]).arg(settings);
    for address in &plan.connect {
        command.arg("--connect").arg(address);
    }
    Ok(command)
}

/// The calibration document that every unit has under its own name.
const DOCUMENT: &str = "MEMS-0001";
/// A figure of it that makes documents different from one another.
const FIGURE: &str = "coefficients_deg_per_h = [90.0,";

/// The document of a unit, in one of many editions.
pub(crate) fn document(unit: usize, edition: usize) -> Result<String, Error> {
    let path: PathBuf =
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../config/calibration/{DOCUMENT}.toml"));
    let text = fs::read_to_string(&path).map_err(|source| Error::file(&path, source))?;
    if !text.contains(FIGURE) {
        return Err(Error::invalid(&path, format_args!("has no {FIGURE:?}")));
    }
    let text = text.replace(&format!("unit = \"{DOCUMENT}\""), &format!("unit = \"{}\"", unit_name(unit)?));
    Ok(text.replace(FIGURE, &format!("coefficients_deg_per_h = [90.{edition},")))
}
