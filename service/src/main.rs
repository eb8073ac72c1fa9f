//! isotherm: see [`isotherm_service`].

use std::process::ExitCode;

fn main() -> ExitCode {
    isotherm_service::cli::run().into()
}
