//! How fast Isotherm is: ratios to named references, each measured in one run.
//!
//! | module | holds |
//! |---|---|
//! | `kernel` | the state machine per tick, beside what an autopilot does per sample |
//! | `instructions` | the same counted in instructions, for a machine that is never quiet |
//! | `chain` | source, service or relay, and sink over TCP loopback: latency, throughput, loss |
//! | `offline` | a recording corrected on one core |
//! | `part` | the processes of a chain |
//! | `rounds` | interleaved rounds and their medians |
//! | `clock`, `machine`, `process` | what the benches stand on |
//!
//! What a bench refuses to do: report the speed of a wrong result. Each case is checked before it is timed.

mod chain;
mod cli;
mod clock;
mod error;
mod instructions;
mod kernel;
mod machine;
mod offline;
mod part;
mod process;
mod rounds;

pub use cli::main;
pub use error::Error;
pub use kernel::{Kernel, kernels};
