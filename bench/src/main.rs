//! How fast Isotherm is: ratios to named references, each measured in one run.
//!
//! | module | holds |
//! |---|---|
//! | [`kernel`] | the state machine per tick, beside what an autopilot does per sample |
//! | [`instructions`] | the same counted in instructions, for a machine that is never quiet |
//! | [`rounds`] | interleaved rounds and their medians |
//!
//! What a bench refuses to do: report the speed of a wrong result. Each case is checked before it is timed.

mod cli;
mod error;
mod instructions;
mod kernel;
mod rounds;

fn main() -> std::process::ExitCode {
    cli::main()
}
