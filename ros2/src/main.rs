//! isotherm-ros: see [`isotherm_ros`].

use std::process::ExitCode;

fn main() -> ExitCode {
    isotherm_ros::cli::run().into()
}
