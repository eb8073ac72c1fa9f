//! Recording from the bus, and recovering what a recorder has left behind.

mod bus;
mod memory;
mod recover;

use std::path::PathBuf;
use std::process::Command;

use isotherm_correction::sample::{ChannelName, TemperatureReading};
use isotherm_correction::units::Timestamp;
use isotherm_log::message::{Message, Topic};
use isotherm_protocol::codec;
use isotherm_protocol::key::{RawStream, UnitId};
use isotherm_protocol::raw::TemperatureBatch;

use crate::common::replay;

/// A message that is told from others by its number.
fn temperature(serial: &str, number: u32) -> Message {
    let reading = TemperatureReading {
        channel: ChannelName::from("board").unwrap(),
        time: Timestamp::from_ns(i64::from(number) * 5_000_000),
        raw: f64::from(number) * 1.1,
    };
    let topic = Topic::Raw(UnitId::new(serial).unwrap(), RawStream::Temperature);
    let frame = codec::encode(&TemperatureBatch { readings: vec![reading] }).unwrap();
    Message { topic, received_ns: 1_000 + u64::from(number), frame }
}

/// Runs the lines of a command's example in an empty folder; each must succeed, and these commands must be among them.
fn shell_example(command: &str, expected: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let help = String::from_utf8(replay(folder.path(), &[command, "--help"]).stdout).unwrap();
    let example = help.split("Example").nth(1).unwrap().split("\n\n").next().unwrap();
    let lines: Vec<_> = example.lines().skip(1).map(str::trim).collect();
    assert_eq!(lines.len(), expected.len(), "{help}");
    let program = PathBuf::from(env!("CARGO_BIN_EXE_isotherm-replay"));
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    for (line, expected) in lines.iter().zip(expected) {
        assert!(line.contains(expected), "{line}");
        let run =
            Command::new("sh").args(["-c", line]).env("PATH", &path).current_dir(folder.path()).output();
        let output = run.unwrap();
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
}
