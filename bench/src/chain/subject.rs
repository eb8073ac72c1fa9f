//! What stands in the middle of a chain.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::page::TOKEN;
use super::profile::Profile;
use super::python;
use crate::error::Error;
use crate::part::{Format, Plan, Ready, unit_name};
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

    /// What it puts out.
    pub(crate) fn format(self) -> Format {
        match self {
            Self::Relay | Self::Keyed => Format::Raw,
            Self::Service => Format::Corrected,
            Self::Python => Format::Plain,
        }
    }

    /// Starts it; the process, where it listens, and where it answers over HTTP.
    pub(crate) fn start(
        self,
        plan: &Plan,
        plan_file: &Path,
        profile: &Profile,
    ) -> Result<(Process, String, Option<String>), Error> {
        let mut command = match self {
            Self::Relay | Self::Keyed => {
                let mut command = Command::new(this()?);
                command.args(["part", "relay"]).arg(plan_file);
                command
            }
            Self::Service => Self::serve(plan)?,
            Self::Python => python::relay(plan)?,
        };
        // A second one is started where the first is known.
        let name = if plan.connect.is_empty() { self.name() } else { "standby" };
        if let Some(runtime) = &profile.runtime {
            command.env("ZENOH_RUNTIME", runtime);
        }
        let process = Process::start(name, &mut command, &plan.folder)?;
        let Ready { locators, metrics, .. } = process.hear(START_LIMIT)?;
        let locator = locators.into_iter().next();
        let locator =
            locator.ok_or_else(|| Error::Part { part: name, what: "listens nowhere".to_owned() })?;
        Ok((process, locator, metrics))
    }

    /// The service, with a document for each unit.
    fn serve(plan: &Plan) -> Result<Command, Error> {
        let program = beside("isotherm")?;
        let documents = plan.folder.join("units");
        fs::create_dir_all(&documents).map_err(|source| Error::file(&documents, source))?;
        for unit in 0..plan.units {
            let path = documents.join(format!("{unit}.toml"));
            fs::write(&path, document(unit, 0)?).map_err(|source| Error::file(&path, source))?;
        }
        let name = if plan.connect.is_empty() { "first" } else { "second" };
        let settings = plan.folder.join(format!("{name}.toml"));
        let congestion = if plan.block { "block" } else { "drop" };
        let state = if plan.state { format!("state = \"{name}\"\n") } else { String::new() };
        let units = plan.units.max(1);
        let text =
            format!("calibrations = \"units\"\n{state}max_units = {units}\ncongestion = \"{congestion}\"\n");
        let text = if plan.web {
            let token = plan.folder.join("token");
            fs::write(&token, TOKEN).map_err(|source| Error::file(&token, source))?;
            let web = "[web]\nenabled = true\ntoken_file = \"token\"\n[metrics]\nlisten = \"127.0.0.1:0\"\n";
            text + web
        } else if plan.pair {
            format!("{text}[pair]\nname = \"{name}\"\n")
        } else {
            text
        };
        fs::write(&settings, text).map_err(|source| Error::file(&settings, source))?;
        let mut command = Command::new(program);
        command
            .args(["serve", "--announce", "--json", "--listen", "tcp/127.0.0.1:0", "--config"])
            .arg(settings);
        for address in &plan.connect {
            command.arg("--connect").arg(address);
        }
        Ok(command)
    }
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
        return Err(Error::Invalid { path, what: format!("has no {FIGURE:?}") });
    }
    let text = text.replace(&format!("unit = \"{DOCUMENT}\""), &format!("unit = \"{}\"", unit_name(unit)?));
    Ok(text.replace(FIGURE, &format!("coefficients_deg_per_h = [90.{edition},")))
}
