//! `isotherm-replay`: plays logs, corrects them offline, simulates new ones.

use std::process::ExitCode;

fn main() -> ExitCode {
    isotherm_replay_tool::cli::main().into()
}
