//! Instructions per tick, counted by callgrind: the same on a busy machine as on a quiet one.
//!
//! This program runs itself under `valgrind --tool=callgrind`, once for each kernel; only what happens inside the kernel's pass
//! is counted. The committed figures hold for one compiler and one architecture, and say for which: with another they are
//! shown, not judged.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::kernel::KERNELS;
use crate::process::this;

/// More than so much above the committed figure is a fault.
const LARGEST_RISE: f64 = 0.05;

/// Counted figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Figures {
    /// Architecture that they hold for.
    pub(crate) architecture: String,
    /// Compiler that they hold for: what `rustc --version` says.
    pub(crate) compiler: String,
    /// Instructions per tick, by kernel.
    pub(crate) per_tick: BTreeMap<String, f64>,
}

/// Counts every kernel.
#[expect(clippy::cast_precision_loss, reason = "below 2⁵³ instructions")]
pub(crate) fn count() -> Result<Figures, Error> {
    let mut per_tick = BTreeMap::new();
    for (index, make) in KERNELS.iter().enumerate() {
        let mut kernel = make()?;
        kernel.check()?;
        let instructions = count_one(index)?;
        let figure = instructions as f64 / kernel.ticks() as f64;
        per_tick.insert(kernel.name().to_owned(), (figure * 10.0).round() / 10.0);
    }
    Ok(Figures { architecture: std::env::consts::ARCH.to_owned(), compiler: compiler()?, per_tick })
}

/// The compiler at hand: what has just built this program, where nobody has changed it since.
fn compiler() -> Result<String, Error> {
    let output = Command::new("rustc").arg("--version").output();
    let output = output.map_err(|error| counting(format!("rustc --version: {error}")))?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Instructions cannot be counted.
fn counting(what: String) -> Error {
    Error::of("cannot count instructions")(what)
}

/// Counts one kernel in a process of its own.
fn count_one(index: usize) -> Result<u64, Error> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg("--toggle-collect=*isotherm_bench::kernel*::pass*")
        .arg(this()?)
        .args(["pass", &index.to_string()])
        .output()
        .map_err(|error| {
            counting(format!("valgrind: {error}; install Debian's package valgrind or the like"))
        })?;
    let words = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(counting(format!("valgrind ended with {}:\n{words}", output.status)));
    }
    let collected = words.lines().find_map(|line| line.split_once("Collected : "));
    collected
        .and_then(|(_, number)| number.trim().parse().ok())
        .ok_or_else(|| counting(format!("no count in what valgrind says:\n{words}")))
}

/// Runs one kernel once: what the counted process does.
pub(crate) fn pass(index: usize) -> Result<(), Error> {
    if let Some(make) = KERNELS.get(index) {
        std::hint::black_box(make()?.pass());
    }
    Ok(())
}

impl Figures {
    /// Reads committed figures.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(|source| Error::file(path, source))?;
        serde_json::from_str(&text).map_err(|error| Error::invalid(path, error))
    }

    /// Writes figures to be committed.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Error> {
        std::fs::write(path, isotherm_cli::json(self)).map_err(|source| Error::file(path, source))
    }

    /// Whether figures of the other kind can be compared with these: one compiler, one architecture.
    pub(crate) fn is_comparable(&self, other: &Self) -> bool {
        (&self.architecture, &self.compiler) == (&other.architecture, &other.compiler)
    }

    /// Compares with committed figures.
    pub(crate) fn compare(&self, committed: &Self, path: &Path) -> Result<(), Error> {
        let mut slower = Vec::new();
        for (name, figure) in &self.per_tick {
            let Some(before) = committed.per_tick.get(name) else {
                slower.push(format!("{name}: {} has no figure of it: write it with --bless", path.display()));
                continue;
            };
            if *figure > before * (1.0 + LARGEST_RISE) {
                slower.push(format!(
                    "{name}: {figure} instructions per tick, {before} in {}: {:.1} % more, at most {:.0} % are allowed; make it \
                     cheaper, or write the new figures with --bless and say why",
                    path.display(),
                    (figure / before - 1.0) * 100.0,
                    LARGEST_RISE * 100.0
                ));
            }
        }
        if slower.is_empty() { Ok(()) } else { Err(Error::Failed(slower)) }
    }
}
