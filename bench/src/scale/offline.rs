//! A recording corrected offline: `isotherm-replay correct` beside numpy.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use isotherm_cli::Bar;
use serde::{Deserialize, Serialize};

use crate::chain::python;
use crate::error::Error;
use crate::machine::children_s;
use crate::process::beside;
use crate::rounds::median;

/// Ticks per second of one core, medians over the rounds; ratios are medians of those in one round.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Offline {
    /// Ticks of the recording.
    pub(crate) ticks: u64,
    /// `isotherm-replay correct`, from the start of the process to its end.
    pub(crate) correct_per_s: f64,
    /// The same of a recording whose chunks are not compressed.
    pub(crate) uncompressed_per_s: f64,
    /// numpy, where it could be run.
    pub(crate) numpy: Option<Numpy>,
}

/// What numpy does.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Numpy {
    /// Vectorised over the log, from the recording to increments.
    pub(crate) vectorised_per_s: f64,
    /// The same with all ticks in memory as arrays.
    pub(crate) vectorised_in_memory_per_s: f64,
    /// Tick by tick, from the recording to increments.
    pub(crate) tick_by_tick_per_s: f64,
    /// The same with all ticks in memory as arrays.
    pub(crate) tick_by_tick_in_memory_per_s: f64,
    /// How often `correct` does what the first of these does, and so on.
    pub(crate) ratios: [f64; 4],
    /// Largest difference of increments, as a share of the largest increment.
    pub(crate) largest_difference: f64,
}

/// What the script says.
#[derive(Debug, Clone, Copy, Deserialize)]
struct Timed {
    ticks: u64,
    read_s: f64,
    vectorised_s: f64,
    ticks_one_by_one: u64,
    tick_by_tick_s: f64,
    largest_difference: f64,
}

/// Largest difference that is the same result.
const LARGEST_DIFFERENCE: f64 = 1e-9;
/// The unit of the log, whose document is shipped.
const UNIT: &str = "MEMS-0001";
/// Length of the log (s): the whole chamber cycle, 1.14 million ticks.
const DURATION_S: u32 = 11_400;

/// Measures; what was left out.
pub(super) fn measure(rounds: usize, quick: bool) -> Result<(Offline, Vec<String>), Error> {
    let folder = tempfile::tempdir().map_err(|source| Error::file(&std::env::temp_dir(), source))?;
    let log = Log::make(folder.path(), if quick { DURATION_S / 20 } else { DURATION_S })?;
    let interpreter = python::interpreter();
    let bar = Bar::counting("", rounds);
    let (mut times, mut uncompressed) = (Vec::new(), Vec::new());
    let mut scripts = Vec::new();
    for _ in 0..rounds {
        bar.say("correct, numpy");
        times.push(log.correct(&log.recording, None)?);
        uncompressed.push(log.correct(&log.uncompressed, None)?);
        if interpreter.is_ok() {
            scripts.push(log.numpy()?);
        }
        bar.done_one();
    }
    bar.finish();
    let numpy = if scripts.is_empty() { None } else { Some(compare(log.ticks, &times, &scripts)?) };
    #[expect(clippy::cast_precision_loss, reason = "some million ticks")]
    let [correct_per_s, uncompressed_per_s] =
        [&times, &uncompressed].map(|times| median(times.iter().map(|time| log.ticks as f64 / time)));
    let skipped = interpreter.err().map(|error| error.to_string());
    let offline = Offline { ticks: log.ticks, correct_per_s, uncompressed_per_s, numpy };
    Ok((offline, skipped.into_iter().collect()))
}

/// Rates and ratios.
#[expect(clippy::cast_precision_loss, reason = "some million ticks")]
fn compare(ticks: u64, times: &[f64], scripts: &[Timed]) -> Result<Numpy, Error> {
    let largest_difference = scripts.iter().map(|script| script.largest_difference).fold(0.0, f64::max);
    let others = scripts.iter().any(|script| script.ticks != ticks || script.largest_difference.is_nan());
    if others || largest_difference > LARGEST_DIFFERENCE {
        return Err(Error::Output {
            subject: "numpy".to_owned(),
            what: format!(
                "increments differ by {largest_difference:e} of the largest, at most {LARGEST_DIFFERENCE:e} is the same result"
            ),
        });
    }
    // Seconds per tick.
    let reading = |script: &Timed| script.read_s / script.ticks as f64;
    let vectorised = |script: &Timed| script.vectorised_s / script.ticks as f64;
    let one_by_one = |script: &Timed| script.tick_by_tick_s / script.ticks_one_by_one as f64;
    let ways: [&dyn Fn(&Timed) -> f64; 4] = [
        &|script| reading(script) + vectorised(script),
        &vectorised,
        &|script| reading(script) + one_by_one(script),
        &one_by_one,
    ];
    let per_s = ways.map(|way| median(scripts.iter().map(|script| 1.0 / way(script))));
    let ratios = ways.map(|way| {
        median(times.iter().zip(scripts).map(|(time, script)| way(script) / (time / ticks as f64)))
    });
    let [vectorised_per_s, vectorised_in_memory_per_s, tick_by_tick_per_s, tick_by_tick_in_memory_per_s] =
        per_s;
    Ok(Numpy {
        vectorised_per_s,
        vectorised_in_memory_per_s,
        tick_by_tick_per_s,
        tick_by_tick_in_memory_per_s,
        ratios,
        largest_difference,
    })
}

/// A recording of one unit, and what is made of it.
struct Log {
    recording: PathBuf,
    uncompressed: PathBuf,
    document: PathBuf,
    corrected: PathBuf,
    ticks: u64,
}

impl Log {
    /// Simulates it, and corrects it once for the comparison.
    fn make(folder: &Path, duration_s: u32) -> Result<Self, Error> {
        let [text, mapping, recording, uncompressed, corrected] =
            ["log.csv", "log.mapping.toml", "log.mcap", "uncompressed.mcap", "corrected.csv"]
                .map(|name| folder.join(name));
        let document =
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../config/calibration/{UNIT}.toml"));
        let mut simulate = Command::new(beside("isotherm-replay")?);
        simulate.args(["simulate", "--preset", "mems-chamber", "--seed", "1", "--json", "--duration"]);
        run(simulate.arg(duration_s.to_string()).arg("--out").arg(&text))?;
        for (out, compression) in [(&recording, "zstd"), (&uncompressed, "none")] {
            let mut convert = Command::new(beside("isotherm-replay")?);
            convert.arg("convert").arg(&text).arg("--mapping").arg(&mapping);
            run(convert
                .args(["--unit", UNIT, "--compression", compression, "--no-json-channels", "--out"])
                .arg(out))?;
        }
        let mut log = Self { recording, uncompressed, document, corrected, ticks: 0 };
        let corrected = log.corrected.clone();
        log.correct(&log.recording, Some(&corrected))?;
        let written =
            std::fs::read_to_string(&corrected).map_err(|source| Error::file(&corrected, source))?;
        log.ticks = written.lines().skip(1).count() as u64;
        Ok(log)
    }

    /// Corrects a recording of it on one thread; the processor time of that (s).
    fn correct(&self, recording: &Path, out: Option<&Path>) -> Result<f64, Error> {
        let mut correct = Command::new(beside("isotherm-replay")?);
        correct.arg("correct").arg(recording).args(["--threads", "1", "--calibration"]).arg(&self.document);
        if let Some(out) = out {
            correct.arg("--out").arg(out);
        }
        let account =
            || children_s().ok_or_else(|| Error::Part { part: "account", what: "/proc has none".to_owned() });
        let before = account()?;
        run(&mut correct)?;
        Ok(account()? - before)
    }

    fn numpy(&self) -> Result<Timed, Error> {
        let mut script = python::script("offline.py")?;
        script.arg("--recording").arg(&self.recording).arg("--document").arg(&self.document);
        let text = run(script.arg("--corrected").arg(&self.corrected))?;
        serde_json::from_str(&text)
            .map_err(|error| Error::Part { part: "offline.py", what: format!("{text:?}: {error}") })
    }
}

/// Runs a program that must succeed; what it says.
fn run(command: &mut Command) -> Result<String, Error> {
    let program = PathBuf::from(command.get_program());
    let output = command.stdin(Stdio::null()).output().map_err(|source| Error::file(&program, source))?;
    if !output.status.success() {
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(Error::Invalid { path: program, what: format!("{}: {words}", output.status) });
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
