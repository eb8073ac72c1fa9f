//! `clients/c/isotherm.h` with the compilers of this machine: no warning, the frozen vectors, the cases of continuity, and a short fuzz.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use isotherm_protocol::codec::CodecError;
use serde_json::Value;

use super::super::decode_as;
use super::super::page::{Vector, all_vectors};
use super::c_printer::printer;
use super::file::Layout;
use super::path;

const STRICT: &[&str] = &["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1", "-g"];
const SANITIZERS: &[&str] = &["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];

/// A folder of the test's own, with the printers.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("print.h"), printer(&Layout::load())).expect("it can be written");
    folder
}

/// Whether a program is on the PATH.
fn is_there(program: &str) -> bool {
    let version = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    version.is_ok_and(|status| status.success())
}

/// Compilers on the PATH: both, or whatever `cc` is.
fn compilers() -> Vec<&'static str> {
    assert!(is_there("cc"), "no C compiler: install gcc or clang");
    let named: Vec<_> = ["gcc", "clang"].into_iter().filter(|compiler| is_there(compiler)).collect();
    if named.is_empty() { vec!["cc"] } else { named }
}

/// Compiles a program of `clients/c`; the compiler's complaint where it does not.
fn compile(compiler: &str, source: &str, to: &Path, options: &[&str]) -> Result<(), String> {
    let folder = to.parent().expect("in a folder");
    let mut command = Command::new(compiler);
    command
        .args(STRICT)
        .args(options)
        .arg("-I")
        .arg(folder)
        .arg("-o")
        .arg(to)
        .arg(path("clients/c").join(source));
    let output = command.output().expect("the compiler runs");
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

/// What a program says to what it is told.
fn run(program: &Path, arguments: &[&str], input: &[u8]) -> String {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().expect("it runs");
    let mut stdin = child.stdin.take().expect("piped");
    std::thread::scope(|scope| {
        scope.spawn(move || stdin.write_all(input).expect("it reads"));
        let output = child.wait_with_output().expect("it ends");
        assert!(output.status.success(), "{}: {}", program.display(), output.status);
        String::from_utf8(output.stdout).expect("text")
    })
}

/// Sanitizers, where this compiler has their libraries.
fn sanitizers(compiler: &str, folder: &Path) -> &'static [&'static str] {
    let probe = compile(compiler, "tests/accounts.c", &folder.join("probe"), SANITIZERS);
    if probe.is_err() {
        println!("skipped: {compiler} has no address and undefined-behaviour sanitizers here");
    }
    if probe.is_ok() { SANITIZERS } else { &[] }
}

fn hex(frame: &[u8]) -> String {
    frame.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

/// Whether two messages are equal; the header's program gives the bits of numbers, rounded to those of a `float` where `float`.
fn equal(got: &Value, expected: &Value, float: bool) -> bool {
    match (got, expected) {
        (Value::Object(got), Value::Object(expected)) => {
            let alike = |(name, value)| expected.get(name).is_some_and(|other| equal(value, other, float));
            got.len() == expected.len() && got.iter().all(alike)
        }
        (Value::Array(got), Value::Array(expected)) => {
            got.len() == expected.len()
                && got.iter().zip(expected).all(|(got, expected)| equal(got, expected, float))
        }
        (Value::String(bits), Value::Number(number)) => {
            let exact = number.as_f64().expect("a number");
            #[expect(clippy::cast_possible_truncation, reason = "this is what the header does")]
            let rounded = if float { f64::from(exact as f32) } else { exact };
            *bits == format!("{:016x}", rounded.to_bits())
        }
        // Beyond the largest `float`.
        (Value::Null, Value::Number(number)) => {
            float && number.as_f64().is_some_and(|exact| exact.abs() > f64::from(f32::MAX))
        }
        _ => got == expected,
    }
}

/// What the header's result says of the codec's.
fn result_of(error: &CodecError) -> i32 {
    match error {
        CodecError::Length { .. } => 1,
        CodecError::Kind { .. } => 2,
        CodecError::Version { .. } => 3,
        CodecError::Checksum { .. } => 4,
        CodecError::Trailing { .. } => 6,
        // The header counts a number of ticks beyond the limit as a body that does not decode.
        CodecError::Malformed | CodecError::Ticks { .. } => 5,
        _ => 7,
    }
}

/// Judges the header by the frozen frames; `emulator` runs what a compiler for another machine makes.
fn check_vectors(compiler: &str, float: bool, emulator: Option<&str>) {
    let folder = folder(&format!("c-vectors-{compiler}-{float}"));
    let mut options =
        if emulator.is_some() { vec!["-static"] } else { sanitizers(compiler, &folder).to_vec() };
    if float {
        options.push("-DISOTHERM_FLOAT");
    }
    let program = folder.join("vectors");
    compile(compiler, "tests/vectors.c", &program, &options)
        .unwrap_or_else(|complaint| panic!("{compiler}: {complaint}"));
    let vectors = all_vectors();
    let mut input = String::new();
    for Vector { refused_as, frame, .. } in &vectors {
        let kind = refused_as.unwrap_or(frame[0]);
        writeln!(input, "{kind} {}", hex(frame)).expect("memory");
    }
    let said = match emulator {
        None => run(&program, &[], input.as_bytes()),
        Some(emulator) => run(emulator.as_ref(), &[program.to_str().expect("text")], input.as_bytes()),
    };
    let mut lines = said.lines();
    for Vector { name, refused_as, frame, .. } in &vectors {
        let line = lines.next().expect("an answer");
        if let Some(kind) = refused_as {
            let code: i32 = line
                .strip_prefix("refused ")
                .and_then(|code| code.parse().ok())
                .unwrap_or_else(|| panic!("{name}: {line}"));
            let error = decode_as(*kind, frame).expect_err("refused");
            let same = code == result_of(&error) || (code == 5 && matches!(error, CodecError::Value { .. }));
            assert!(same, "{compiler}: {name}: {code} for {error}");
            continue;
        }
        // A reference's rate must be finite, also as a `float`.
        if float && *name == "reference-edges" {
            assert_eq!(line, "refused 7");
            continue;
        }
        let got: Value =
            serde_json::from_str(line).unwrap_or_else(|error| panic!("{compiler}: {name}: {error}: {line}"));
        let expected = decode_as(frame[0], frame).expect("it decodes");
        assert!(equal(&got, &expected, float), "{compiler}, float {float}: {name}: {got}");
        let written = lines.next().expect("what is written");
        if !written.is_empty() && !float {
            assert_eq!(written, hex(frame), "{compiler}: {name}");
        }
        assert_eq!(
            written.is_empty(),
            ![1, 2, 3, 6, 8].contains(&frame[0]),
            "{name}: raw messages are written"
        );
    }
    assert_eq!(lines.next(), None);
}

#[test]
fn the_header_reads_and_writes_the_frozen_frames_and_refuses_the_others() {
    for compiler in compilers() {
        check_vectors(compiler, false, None);
        check_vectors(compiler, true, None);
    }
}

/// Machines of the other order of bytes, of 32 and 64 bits, emulated; one of them is enough.
#[test]
fn the_header_reads_and_writes_the_same_where_the_high_byte_comes_first() {
    let machines = [
        ("powerpc-linux-gnu-gcc", ["qemu-ppc-static", "qemu-ppc"]),
        ("s390x-linux-gnu-gcc", ["qemu-s390x-static", "qemu-s390x"]),
    ];
    let mut judged = 0;
    for (compiler, emulators) in machines {
        let Some(emulator) = emulators.into_iter().find(|emulator| is_there(emulator)) else { continue };
        if is_there(compiler) {
            println!("{compiler}, {emulator}");
            check_vectors(compiler, false, Some(emulator));
            check_vectors(compiler, true, Some(emulator));
            judged += 1;
        }
    }
    if judged == 0 {
        println!(
            "skipped: Debian: apt install gcc-powerpc-linux-gnu libc6-dev-powerpc-cross qemu-user-static"
        );
    }
}

#[test]
fn the_header_accounts_for_ticks_as_the_cases_say() {
    let cases = std::fs::read_to_string(path("clients/cases.txt")).expect("the cases");
    let names = cases.lines().filter_map(|line| line.strip_prefix("= ")?.split(' ').next());
    let verdicts = cases.lines().filter_map(|line| line.strip_prefix("> "));
    let expected: Vec<_> = names.zip(verdicts).map(|(name, verdict)| format!("{name} {verdict}")).collect();
    for compiler in compilers() {
        for real in ["-UISOTHERM_FLOAT", "-DISOTHERM_FLOAT"] {
            let folder = folder(&format!("c-accounts-{compiler}"));
            let program = folder.join("accounts");
            let options = [sanitizers(compiler, &folder), &[real]].concat();
            compile(compiler, "tests/accounts.c", &program, &options)
                .unwrap_or_else(|complaint| panic!("{compiler}: {complaint}"));
            let said = run(&program, &[], cases.as_bytes());
            assert_eq!(said.lines().collect::<Vec<_>>(), expected, "{compiler} {real}");
        }
    }
    assert!(expected.len() > 10);
}

/// The long run, with each compiler: `just fuzz-c`.
#[test]
fn no_frame_leads_the_header_beyond_its_end() {
    let seeds = all_vectors().into_iter().fold(String::new(), |text, Vector { refused_as, frame, .. }| {
        text + &format!("{} {}\n", refused_as.unwrap_or(frame[0]), hex(&frame))
    });
    let frames = std::env::var("ISOTHERM_FUZZ").unwrap_or_else(|_| "200000".to_owned());
    for compiler in compilers() {
        let folder = folder(&format!("c-fuzz-{compiler}"));
        let options = sanitizers(compiler, &folder);
        let program = folder.join("fuzz");
        compile(compiler, "tests/fuzz.c", &program, options)
            .unwrap_or_else(|complaint| panic!("{compiler}: {complaint}"));
        std::fs::write(folder.join("seeds"), &seeds).expect("it can be written");
        let said = run(&program, &[&frames, "1"], seeds.as_bytes());
        println!("{compiler}: {said}");
        let count = |index: usize| {
            said.split(' ').nth(index).and_then(|count| count.parse::<u64>().ok()).unwrap_or_default()
        };
        assert!(count(0) > 1000 && count(2) > 1000, "{compiler}: {said}");
        assert!(count(4) > 100, "{compiler}: frames with standard errors are walked: {said}");
    }
}

/// The corrected batches that are broken, by name.
const BROKEN: [&str; 6] = [
    "corrected-half",
    "corrected-bit",
    "corrected-truncated",
    "corrected-kind",
    "corrected-version-9",
    "corrected-claim",
];

/// What of the examples needs no Zenoh is compiled, and reads a file of frames, of which broken ones are refused with their reason and
/// the rest is read; what needs Zenoh stands behind `ISOTHERM_ZENOH`.
#[test]
fn the_examples_read_a_file_of_frames_and_the_bench_compiles() {
    let folder = folder("c-examples");
    let entry = |frame: &[u8]| [&u32::try_from(frame.len()).expect("short").to_le_bytes(), frame].concat();
    let vectors = all_vectors();
    let good = |vector: &&Vector| vector.refused_as.is_none() && vector.frame.first() == Some(&4);
    let frames: Vec<_> = vectors.iter().filter(good).map(|vector| vector.frame.clone()).collect();
    assert!(frames.iter().any(|frame| frame[1] == 2), "one with standard errors");
    let named = |name| vectors.iter().find(|vector| vector.name == name).expect("a frozen frame");
    let broken = BROKEN.map(|name| &named(name).frame);
    let file: Vec<u8> = broken.into_iter().chain(&frames).flat_map(|frame| entry(frame)).collect();
    let mut told = BTreeSet::new();
    for compiler in compilers() {
        for source in ["examples/zenoh_c.c", "examples/zenoh_pico.c", "bench.c"] {
            let to = folder.join("program");
            compile(compiler, source, &to, &["-O2"])
                .unwrap_or_else(|complaint| panic!("{compiler}: {complaint}"));
            if source.starts_with("examples") {
                let (said, reasons) = receive(&to, &file);
                assert!(said.contains("1000 3.5e-07 -1.25e-05 2e-06 rad\n"), "{compiler}: {source}: {said}");
                told.insert(reasons);
            }
        }
    }
    // All of them refuse the same frames for the same reasons, and say the same of the others.
    assert_eq!(told.len(), 1, "{told:#?}");
    insta::assert_snapshot!(told.into_iter().collect::<String>());
}

/// What an example prints of a file, and what it complains of; ticks of the frozen frames do not follow on one another.
fn receive(program: &Path, file: &[u8]) -> (String, String) {
    let input = program.with_extension("wire");
    std::fs::write(&input, file).expect("it can be written");
    let input = std::fs::File::open(&input).expect("it is there");
    let output = Command::new(program).stdin(input).output().expect("it runs");
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", output.status);
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (text(output.stdout), text(output.stderr))
}
