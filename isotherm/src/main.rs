//! isotherm: the service, its operators' commands, its files, its demo.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run().into()
}
