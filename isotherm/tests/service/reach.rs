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

/// The one sentence on stderr, where it ends with this exit code.
fn refused(arguments: &[&str], set: &[(&str, &str)], code: i32) -> String {
    let output = isotherm(arguments, set);
    let stderr = String::from_utf8(output.stderr).unwrap();
    let own: Vec<_> = stderr.lines().filter(|line| !line.contains("no state folder is configured")).collect();
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    assert_eq!(own.len(), 1, "{stderr}");
    for foreign in ["Json5Err", ".rs:", "Location", "Single("] {
        assert!(!stderr.contains(foreign), "{foreign} in {stderr}");
    }
    own[0].to_owned() + "\n"
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
    let mut told = refused(&status, &both, 1);
    std::fs::write(user.join("client.toml"), format!("connect = [\"{nobody}\"]\n")).unwrap();
    told += &refused(&status, &[("XDG_CONFIG_HOME", home)], 1);
    std::fs::write(user.join("client.toml"), "conect = [\"a:1\"]\n").unwrap();
    told += &refused(&status, &[("XDG_CONFIG_HOME", home)], 78);
    insta::assert_snapshot!(told.replace(home, "HOME").replace(&nobody, "NOBODY"));
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
    let mut told = refused(&["status", "--connect", &nobody], &[], 1);
    assert!(
        begun.elapsed() < Duration::from_secs(4),
        "at once, not after the time-out: {:?}",
        begun.elapsed()
    );

    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = silent.local_addr().unwrap().to_string();
    told += &refused(&["status", "--connect", &address, "--timeout", "0.5"], &[], 1);
    told += &refused(&["status", "--connect", "no.such.host.invalid:7447", "--timeout", "2"], &[], 1);

    // Of several addresses each has its reason, and what to do comes once.
    let both = format!("{nobody},no.such.host.invalid:7447");
    told += &refused(&["status", "--timeout", "2"], &[("ISOTHERM_CONNECT", &both)], 1);

    told += &refused(&["serve", "--listen", "no.such.host.invalid:7447"], &[], 1);
    told += &refused(&["serve", "--listen", &address], &[], 1);
    insta::assert_snapshot!(told.replace(&nobody, "NOBODY").replace(&address, "SILENT"));
}

#[test]
fn wrong_addresses_are_a_wrong_call() {
    let mut told = String::new();
    for value in ["nonsense", "127.0.0.1:99999", "udp/127.0.0.1:1"] {
        let output = isotherm(&["status", "--connect", value], &[]);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        told += &String::from_utf8(output.stderr).unwrap();
    }
    told += &refused(&["status"], &[("ISOTHERM_CONNECT", "nonsense")], 2);
    told += &refused(&["status", "--namespace", "a//b"], &[], 2);
    let folder = tempfile::tempdir().unwrap();
    let zenoh = folder.path().join("z.json5");
    std::fs::write(&zenoh, "{ mode: \"peerx\" }").unwrap();
    let zenoh = path(&zenoh);
    let missing = folder.path().join("none.json5");
    told += &refused(&["status", "--zenoh-config", path(&missing)], &[], 1);
    told += &refused(&["status", "--zenoh-config", zenoh], &[], 78);
    insta::assert_snapshot!(told.replace(path(folder.path()), "FOLDER"));
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
        assert!(missing.status.code() == Some(1) && stderr.contains(program), "{stderr}");
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
