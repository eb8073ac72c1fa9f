//! The processes of a chain: each is this program, started with a hidden command and a plan.
//!
//! A part says `{"ready":…}` on stdout when it is ready, does its work when it reads a line, and reports in one line of JSON. It
//! ends where its stdin does, so that nothing is left over when the one who started it has gone.

pub(crate) mod frames;
pub(crate) mod head;
mod plan;
mod relay;
mod sink;
mod source;

use std::fs;
use std::io::{self, BufRead, Write};
use std::path::Path;
use std::time::Duration;

use isotherm_bus::{DeclaredKeys, SessionOptions};
use isotherm_protocol::key::UnitId;
use serde::Serialize;
use tokio::runtime::Runtime;
use zenoh::{Session, Wait};

pub(crate) use plan::{Plan, unit_name};
pub(crate) use sink::{Kept, Received};
pub(crate) use source::Sent;

use crate::error::Error;

/// Which part a process plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Role {
    /// Publishes raw ticks at their times.
    Source,
    /// Puts what comes in on the output key, as it is.
    Relay,
    /// Writes down what came when.
    Sink,
}

/// What a part says when it is ready.
#[derive(Debug, Clone, Default, PartialEq, Serialize, serde::Deserialize)]
pub(crate) struct Ready {
    /// Where it listens.
    pub(crate) locators: Vec<String>,
    /// Where it answers over HTTP, if it does.
    #[serde(default)]
    pub(crate) metrics: Option<String>,
}

/// How long a part waits for the others.
const LONGEST_WAIT: Duration = Duration::from_secs(60);

/// Plays a part to its end.
pub(crate) fn run(role: Role, plan: &Path) -> Result<(), Error> {
    let text = fs::read_to_string(plan).map_err(|source| Error::file(plan, source))?;
    let plan: Plan = serde_json::from_str(&text).map_err(|error| Error::invalid(plan, error))?;
    match role {
        Role::Source => source::run(&plan),
        Role::Relay => relay::run(&plan),
        Role::Sink => sink::run(&plan),
    }
}

/// Opens a session as the project's programs do, and connects it where the plan says so.
pub(crate) fn open(plan: &Plan) -> Result<Session, Error> {
    let options = SessionOptions { connect: plan.connect.clone(), ..SessionOptions::default() };
    let session = zenoh::open(options.to_config()?).wait();
    session.map_err(|source| Error::Bus(isotherm_bus::BusError::Open(source)))
}

/// Declares keys of every unit, those that `of` names.
fn declare_keys<K: IntoIterator<Item = String>>(
    session: &Session,
    plan: &Plan,
    of: impl Fn(&UnitId) -> K,
) -> Result<DeclaredKeys, Error> {
    let units = (0..plan.case.units).map(unit_name).collect::<Result<Vec<_>, _>>()?;
    DeclaredKeys::declare(session, units.iter().flat_map(of)).map_err(Error::zenoh("keys"))
}

/// Waits until the one in the middle answers: then it knows every subscription made before.
fn wait_for_middle(session: &Session) -> Result<(), Error> {
    Ok(runtime()?.block_on(isotherm_bus::presence::wait_for_service(session, LONGEST_WAIT))?)
}

/// For what is asked over the bus.
pub(crate) fn runtime() -> Result<Runtime, Error> {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    runtime.map_err(|source| Error::file(Path::new("runtime"), source))
}

/// Says something to the one who started this process.
fn say(message: &impl Serialize) -> Result<(), Error> {
    let line = serde_json::to_string(message).map_err(Error::of("stdout"))?;
    let mut out = io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).map_err(Error::of("stdout"))
}

/// Waits for a line; `None` where none will come.
fn hear() -> Option<String> {
    let mut line = String::new();
    match io::stdin().lock().read_line(&mut line) {
        Ok(0) | Err(_) => None,
        Ok(_) => Some(line.trim().to_owned()),
    }
}
