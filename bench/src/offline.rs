//! A recording corrected offline: `isotherm-replay correct` on one core.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use isotherm_cli::Bar;
use serde::Serialize;

use crate::error::Error;
use crate::machine::children_s;
use crate::process::beside;
use crate::rounds::median;

/// Ticks per second of one core, medians over the rounds, from the start of the process to its end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Offline {
    /// Ticks of the recording.
    pub(crate) ticks: u64,
    /// From a recording as it is written by default.
    pub(crate) correct_per_s: f64,
    /// From one whose chunks are not compressed.
    pub(crate) uncompressed_per_s: f64,
}

/// The unit of the log, whose document is shipped.
const UNIT: &str = "MEMS-0001";
/// Length of the log (s): the whole chamber cycle, 1.14 million ticks.
const DURATION_S: u32 = 11_400;

/// Simulates a log and corrects it, once from each recording in each round.
pub(crate) fn measure(rounds: usize, quick: bool) -> Result<Offline, Error> {
    let folder = tempfile::tempdir().map_err(|source| Error::file(&std::env::temp_dir(), source))?;
    let (duration_s, rounds) = if quick { (DURATION_S / 20, 1) } else { (DURATION_S, rounds) };
    let (recordings, ticks) = recordings(folder.path(), duration_s)?;
    let bar = Bar::counting("", rounds);
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..rounds {
        for (recording, times) in recordings.iter().zip(&mut times) {
            times.push(correct(recording)?);
        }
        bar.done_one();
    }
    bar.finish();
    #[expect(clippy::cast_precision_loss, reason = "some million ticks")]
    let [correct_per_s, uncompressed_per_s] =
        times.map(|times| median(times.iter().map(|time| ticks as f64 / time)));
    Ok(Offline { ticks, correct_per_s, uncompressed_per_s })
}

/// The log as a recording, and as one that is not compressed; its ticks.
fn recordings(folder: &Path, duration_s: u32) -> Result<([PathBuf; 2], u64), Error> {
    let text = folder.join("log.csv");
    let mut simulate = Command::new(beside("isotherm-replay")?);
    simulate.args(["simulate", "--preset", "mems-chamber", "--seed", "1", "--json", "--duration"]);
    let said = run(simulate.arg(duration_s.to_string()).arg("--out").arg(&text))?;
    let said: serde_json::Value =
        serde_json::from_str(&said).map_err(|error| Error::of("simulate")(format!("{said:?}: {error}")))?;
    let recordings = ["zstd", "none"].map(|compression| folder.join(format!("{compression}.mcap")));
    for (out, compression) in recordings.iter().zip(["zstd", "none"]) {
        let mut convert = Command::new(beside("isotherm-replay")?);
        convert.arg("convert").arg(&text).args(["--unit", UNIT, "--compression", compression]);
        run(convert.args(["--no-json-channels", "--out"]).arg(out))?;
    }
    Ok((recordings, said["ticks"].as_u64().unwrap_or_default()))
}

/// Corrects a recording on one thread; the processor time of that (s).
fn correct(recording: &Path) -> Result<f64, Error> {
    let document = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../config/calibration/{UNIT}.toml"));
    let account = || children_s().ok_or_else(|| Error::of("account")("/proc has none"));
    let before = account()?;
    let mut correct = Command::new(beside("isotherm-replay")?);
    run(correct.arg("correct").arg(recording).args(["--threads", "1", "--calibration"]).arg(document))?;
    Ok(account()? - before)
}

/// Runs a program that must succeed; what it says.
fn run(command: &mut Command) -> Result<String, Error> {
    let program = PathBuf::from(command.get_program());
    let output = command.stdin(Stdio::null()).output().map_err(|source| Error::file(&program, source))?;
    if !output.status.success() {
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(Error::invalid(&program, format_args!("{}: {words}", output.status)));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
