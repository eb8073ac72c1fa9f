//! `isotherm-calibrate`.

use std::process::ExitCode;

fn main() -> ExitCode {
    isotherm_calibration::cli::main().into()
}
