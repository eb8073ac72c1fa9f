//! Makes the calibration documents of the demo's units and of the real logs, in `config/calibration`.
//!
//! `cargo run --release -p isotherm-tests --example make_documents`; the documents of the real logs need
//! `ISOTHERM_DATA`, or `../shared/data` beside the checkout. The same sources give the same bytes.

mod chamber_mems;
mod fibre_optic;
mod instrument;
mod least_squares;
mod logs;
mod mems;
mod regressors;
mod rlg_static;
mod write;
mod zeeman;

use std::process::ExitCode;

use isotherm_simulator::presets::{mems_chamber, zeeman_rest};
use isotherm_tests::data;

use write::{Failure, write};

fn main() -> ExitCode {
    match make_all() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("make_documents: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// All documents. The seeds of the scenarios do not matter here: only their instruments are looked at.
fn make_all() -> Result<(), Failure> {
    let folder = data::root().join("config/calibration");
    write(zeeman::make(&zeeman_rest(0))?, &folder, "ZLG-0001.toml")?;
    write(mems::make(&mems_chamber(0))?, &folder, "MEMS-0001.toml")?;
    write(fibre_optic::make()?, &folder, "FOG-0001.toml")?;
    if let Some(data) = data::folder() {
        write(rlg_static::make(&data)?, &folder, "rlg-static.toml")?;
        write(chamber_mems::make(&data)?, &folder, "chamber-mems.toml")?;
    }
    Ok(())
}
