//! Examples in the help of `isotherm-replay` that need a service, run as they are printed; the environment says where it is.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use isotherm_tests::bench::LIMIT;
use isotherm_tests::process::{Service, program, run_well, send_signal};

/// Whether a line needs a service.
fn needs_service(line: &str) -> bool {
    let records = line.starts_with("isotherm-replay record ") && !line.contains("--no-service");
    records || line.starts_with("isotherm-replay play ")
}

/// The lines of a help text that are to be typed: two places in, behind the word "Example".
fn examples(help: &str) -> Vec<&str> {
    let behind = help.lines().skip_while(|line| !line.starts_with("Example"));
    behind.filter_map(|line| line.strip_prefix("  ")).map(str::trim).collect()
}

/// Types a line into a shell that finds the program.
fn typed(folder: &Path, line: &str, service: &str) -> Child {
    let programs = program("isotherm-replay").parent().expect("it is in a folder").to_path_buf();
    let found = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(programs).chain(std::env::split_paths(&found)));
    Command::new("sh")
        .args(["-c", &format!("exec {line}")])
        .current_dir(folder)
        .env("PATH", path.expect("folders without colons"))
        .env("ISOTHERM_CONNECT", service)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("there is a shell")
}

/// Has a recorder that runs until Ctrl-C end in order, as soon as its file is there.
fn interrupt(recorder: &Child, file: &Path) {
    let began = Instant::now();
    while !file.exists() {
        assert!(began.elapsed() < LIMIT, "{} does not appear", file.display());
        std::thread::sleep(Duration::from_millis(20));
    }
    send_signal(recorder, "INT");
}

#[test]
fn examples_with_a_service_work_as_printed() {
    let mut found = Vec::new();
    for command in ["play", "record"] {
        let help = run_well("isotherm-replay", &[command, "--help"]);
        let lines = examples(&help);
        assert!(lines.iter().any(|line| needs_service(line)), "{command}:\n{help}");
        let folder = tempfile::tempdir().expect("a folder");
        // Each command has a service of its own: units of one would be there for the next.
        let service = Service::start(&[]);
        for line in lines {
            // What needs no service has been run by the tests of the program; what stands before needs to be there.
            let needs = needs_service(line);
            if command == "record" && !needs {
                continue;
            }
            let mut child = typed(folder.path(), line, &service.locator);
            if command == "record" {
                interrupt(&child, &folder.path().join("run.mcap"));
            }
            let status = child.wait().expect("it ends");
            assert!(status.success(), "{line}: {status}");
            found.extend(needs.then(|| line.to_owned()));
        }
        assert!(service.stop().0.success());
    }
    assert!(found.len() >= 2, "{found:?}");
}
