//! How programs and services meet: defaults, environment, the user's file, and what is said where they do not.

use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use super::serve_command::Served;

/// Runs `isotherm` without what this machine's user has set.
fn isotherm(arguments: &[&str], set: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm"));
    command.args(arguments).env_remove("ISOTHERM_CONNECT").env_remove("ISOTHERM_LOG").stdin(Stdio::null());
    command.env("XDG_CONFIG_HOME", "/nonexistent").envs(set.iter().copied()).output().unwrap()
}

/// One sentence on stderr that holds the parts, and the exit code.
fn refused(arguments: &[&str], set: &[(&str, &str)], code: i32, parts: &[&str]) {
    let output = isotherm(arguments, set);
    let stderr = String::from_utf8(output.stderr).unwrap();
    let own: Vec<_> = stderr.lines().filter(|line| !line.contains("no state folder is configured")).collect();
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    assert_eq!(own.len(), 1, "{stderr}");
    for part in parts {
        assert!(own[0].contains(part), "{part} in {stderr}");
    }
    for foreign in ["Json5Err", ".rs:", "Location", "Single("] {
        assert!(!stderr.contains(foreign), "{foreign} in {stderr}");
    }
}

#[test]
fn environment_and_the_users_file_say_where_the_service_is() {
    let served = Served::start(&[]);
    let bare = served.locators[0].strip_prefix("tcp/").unwrap();
    let status = ["status", "--json"];
    assert_eq!(isotherm(&status, &[("ISOTHERM_CONNECT", bare)]).status.code(), Some(0));
    assert_eq!(isotherm(&["status", "--connect", bare], &[]).status.code(), Some(0));
    let folder = tempfile::tempdir().unwrap();
    let user = folder.path().join("isotherm");
    std::fs::create_dir(&user).unwrap();
    let home = folder.path().to_str().unwrap();
    std::fs::write(user.join("client.toml"), format!("connect = [\"{bare}\"]\n")).unwrap();
    assert_eq!(isotherm(&status, &[("XDG_CONFIG_HOME", home)]).status.code(), Some(0));
    // What stands in the variable counts before the file.
    let nobody = free();
    let both = [("XDG_CONFIG_HOME", home), ("ISOTHERM_CONNECT", nobody.as_str())];
    refused(&status, &both, 1, &[&format!("tcp/{nobody} (from ISOTHERM_CONNECT): nothing listens there")]);
    std::fs::write(user.join("client.toml"), format!("connect = [\"{nobody}\"]\n")).unwrap();
    let file = user.join("client.toml").display().to_string();
    let parts = [&*format!("tcp/{nobody} (from {file}): nothing listens there")];
    refused(&status, &[("XDG_CONFIG_HOME", home)], 1, &parts);
    std::fs::write(user.join("client.toml"), "conect = [\"a:1\"]\n").unwrap();
    refused(
        &status,
        &[("XDG_CONFIG_HOME", home)],
        78,
        &["client.toml:1:1: conect", "did you mean `connect`?"],
    );
    assert_eq!(served.stop("-INT").0, Some(0));
}

#[test]
fn of_two_addresses_one_that_answers_is_enough() {
    let served = Served::start(&[]);
    let there = served.locators[0].strip_prefix("tcp/").unwrap();
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    for other in [free(), silent.local_addr().unwrap().to_string()] {
        for pair in [format!("{there},{other}"), format!("{other},{there}")] {
            let output = isotherm(&["status", "--json"], &[("ISOTHERM_CONNECT", &pair)]);
            assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
            assert!(!output.stdout.is_empty() && output.stderr.is_empty(), "{output:?}");
        }
    }
    assert_eq!(served.stop("-INT").0, Some(0));
}

/// An address at which nobody listens.
fn free() -> String {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string()
}

#[test]
fn what_cannot_be_reached_is_said_with_its_address_and_the_next_step() {
    let nobody = free();
    let begun = Instant::now();
    let parts = [
        &*format!("tcp/{nobody}: nothing listens there"),
        "isotherm serve",
        "--connect HOST:PORT or ISOTHERM_CONNECT",
    ];
    refused(&["status", "--connect", &nobody], &[], 1, &parts);
    assert!(
        begun.elapsed() < Duration::from_secs(4),
        "at once, not after the time-out: {:?}",
        begun.elapsed()
    );

    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = silent.local_addr().unwrap().to_string();
    let parts = [&*format!("tcp/{address}: something listens there but does not answer within 500 ms")];
    refused(&["status", "--connect", &address, "--timeout", "0.5"], &[], 1, &parts);

    let parts = ["tcp/no.such.host.invalid:7447: the host name is not known"];
    refused(&["status", "--connect", "no.such.host.invalid:7447", "--timeout", "2"], &[], 1, &parts);

    // Of several addresses each has its reason, and what to do comes once.
    let both = format!("{nobody},no.such.host.invalid:7447");
    let parts = [&*format!(
        "tcp/{nobody} (from ISOTHERM_CONNECT): nothing listens there; tcp/no.such.host.invalid:7447"
    )];
    refused(&["status", "--timeout", "2"], &[("ISOTHERM_CONNECT", &both)], 1, &parts);
    let output = isotherm(&["status", "--timeout", "2"], &[("ISOTHERM_CONNECT", &both)]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(stderr.matches("--connect HOST:PORT").count(), 1, "{stderr}");

    let parts =
        ["cannot listen on tcp/no.such.host.invalid:7447: the host name is not known", "--listen HOST:PORT"];
    refused(&["serve", "--listen", "no.such.host.invalid:7447"], &[], 1, &parts);
    let parts =
        [&*format!("cannot listen on tcp/{address}: another program listens there"), "--listen HOST:PORT"];
    refused(&["serve", "--listen", &address], &[], 1, &parts);
}

#[test]
fn wrong_addresses_are_a_wrong_call() {
    for (option, value, says) in [
        ("--connect", "nonsense", "must be HOST:PORT"),
        ("--connect", "127.0.0.1:99999", "has the port \"99999\", must be 0 to 65535"),
        ("--connect", "udp/127.0.0.1:1", "must have one of tcp, tls, unixsock-stream"),
    ] {
        let output = isotherm(&["status", option, value], &[]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(2) && stderr.contains(says) && stderr.contains(value),
            "{stderr}"
        );
    }
    refused(
        &["status"],
        &[("ISOTHERM_CONNECT", "nonsense")],
        2,
        &["ISOTHERM_CONNECT is \"nonsense\", must be HOST:PORT"],
    );
    refused(&["status", "--namespace", "a//b"], &[], 2, &["namespace = \"a//b\"", "Invalid Key Expr"]);
    let folder = tempfile::tempdir().unwrap();
    let zenoh = folder.path().join("z.json5");
    std::fs::write(&zenoh, "{ mode: \"peerx\" }").unwrap();
    let zenoh = path(&zenoh);
    let missing = folder.path().join("none.json5");
    let parts = ["cannot read the Zenoh configuration", "none.json5"];
    refused(&["status", "--zenoh-config", path(&missing)], &[], 1, &parts);
    refused(
        &["status", "--zenoh-config", zenoh],
        &[],
        78,
        &["unknown variant `peerx`", &format!("isotherm check {zenoh}")],
    );
}

#[test]
fn log_and_calibrate_are_the_programs_beside() {
    for (command, program) in [("log", "isotherm-replay"), ("calibrate", "isotherm-calibrate")] {
        let folder = tempfile::tempdir().unwrap();
        let own = folder.path().join("isotherm");
        std::fs::copy(env!("CARGO_BIN_EXE_isotherm"), &own).unwrap();
        let run = || {
            Command::new(&own).args([command, "diff", "a", "--help", "-x"]).env("PATH", "").output().unwrap()
        };
        let missing = run();
        let stderr = String::from_utf8_lossy(&missing.stderr).into_owned();
        assert!(
            missing.status.code() == Some(1) && stderr.contains(&format!("cannot run {program}")),
            "{stderr}"
        );
        let beside = folder.path().join(program);
        std::fs::write(&beside, "#!/bin/sh\necho \"$@\"\nexit 3\n").unwrap();
        std::fs::set_permissions(&beside, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
        let output = run();
        assert_eq!(output.status.code(), Some(3), "{output:?}");
        assert_eq!(String::from_utf8_lossy(&output.stdout), "diff a --help -x\n");
    }
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}
