//! Keys, at a terminal that Python opens.

use std::process::Command;

use isotherm_tests::bench::LIMIT;
use isotherm_tests::data::root;
use isotherm_tests::process::program;

use super::{in_time, service, simulated};

#[tokio::test(flavor = "multi_thread")]
async fn keys_pause_step_seek_and_end_and_the_terminal_is_given_back() {
    let python = std::env::var("ISOTHERM_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    if Command::new(&python).arg("--version").output().is_err() {
        println!("skipped: no {python}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 60);
    let service = service();
    let mut keys = Command::new(python);
    keys.arg("-B").arg(root().join("tests/python/keys.py")).arg(program("isotherm-replay"));
    keys.args([&log, &mapping, &service.locator]);
    let output = in_time(LIMIT, move || keys.output().unwrap()).await;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}{errors}", String::from_utf8_lossy(&output.stdout));
}
