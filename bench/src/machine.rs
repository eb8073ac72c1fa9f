//! What the figures were measured on, and what else it was doing.

use std::fs;
use std::thread::available_parallelism;
use std::time::Duration;

use serde::Serialize;

/// A machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Machine {
    /// Name of the processor.
    pub(crate) processor: String,
    /// Cores that may be used.
    pub(crate) cores: usize,
    /// Release of the kernel.
    pub(crate) kernel: String,
    /// Mean number of processes that ran or wanted to in the last minute, before and after the measurement.
    pub(crate) load: [f64; 2],
}

impl Machine {
    /// This machine, before a measurement.
    pub(crate) fn look() -> Self {
        let processors = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let named = processors.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
        let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
        Self {
            processor: named
                .map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned()),
            cores: available_parallelism().map_or(1, usize::from),
            kernel: kernel.trim().to_owned(),
            load: [load(); 2],
        }
    }

    /// After it.
    pub(crate) fn measured(mut self) -> Self {
        self.load[1] = load();
        self
    }

    /// In words.
    pub(crate) fn words(&self) -> String {
        let [before, after] = self.load;
        format!(
            "{}, {} cores, Linux {}, load {before:.2} before and {after:.2} after",
            self.processor, self.cores, self.kernel
        )
    }
}

fn load() -> f64 {
    let text = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().and_then(|first| first.parse().ok()).unwrap_or(f64::NAN)
}

/// What a process has used.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(crate) struct Usage {
    /// Processor time, of the system's part too (s).
    pub(crate) cpu_s: f64,
    /// Resident memory (KiB).
    pub(crate) resident_kib: u64,
}

impl Usage {
    /// That of a process which is there.
    pub(crate) fn of(process: u32) -> Option<Self> {
        let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
        let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        let resident_kib = resident.trim().trim_end_matches(" kB").parse().ok()?;
        // To the nanosecond, where `stat` counts hundredths of a second; of the threads that are there.
        let threads = fs::read_dir(format!("/proc/{process}/task")).ok()?;
        let times = threads.filter_map(|thread| {
            let schedule = fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
            schedule.split(' ').next()?.parse::<u64>().ok()
        });
        let cpu_s = Duration::from_nanos(times.sum()).as_secs_f64();
        Some(Self { cpu_s, resident_kib })
    }
}

/// Length of the kernel's unit of processor time in `stat` files (s): the same on all of Linux.
const JIFFY_S: f64 = 0.01;

/// Processor time of the children of this process that have ended (s), in hundredths.
pub(crate) fn children_s() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // The name is in parentheses and may hold anything.
    let (_, behind) = stat.rsplit_once(") ")?;
    let field = |index: usize| behind.split(' ').nth(index)?.parse::<f64>().ok();
    Some((field(13)? + field(14)?) * JIFFY_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_has_used_something() {
        let before = Usage::of(std::process::id()).expect("the process is there");
        assert!(before.resident_kib > 500, "{before:?}");
        let mut sum = 0_u64;
        while Usage::of(std::process::id()).expect("the process is there").cpu_s < before.cpu_s + 0.03 {
            sum = std::hint::black_box(sum).wrapping_add(1);
        }
    }

    #[test]
    fn a_child_that_has_ended_counts() {
        let before = children_s().expect("the account is there");
        let mut spun = std::process::Command::new("bash");
        let status =
            spun.args(["-c", "for ((i = 0; i < 100000; i++)); do :; done"]).status().expect("bash runs");
        assert!(status.success() && children_s().expect("the account is there") > before);
    }
}
