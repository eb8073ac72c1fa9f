//! The MATLAB reader, by GNU Octave where it is installed.

use std::process::Command;

use super::common::{check, replay, root};

/// Prints what a file holds, and what is said of one that is cut short and of one with a changed byte.
const SCRIPT: &str = r"
units = isotherm('own.mcap');
printf('%s %d\n', units(1).unit, rows(units(1).delta_angle_rad));
wire = isotherm('own.wire');
printf('%d\n', isequal(wire(1).delta_angle_rad, units(1).delta_angle_rad));
function change(from, to, made)
  file = fopen(from); bytes = fread(file, Inf, '*uint8'); fclose(file);
  file = fopen(to, 'w'); fwrite(file, made(bytes)); fclose(file);
end
change('own.mcap', 'cut.mcap', @(bytes) bytes(1:floor(end / 2)));
try, isotherm('cut.mcap'); catch problem, disp(problem.message), end
change('own.wire', 'bad.wire', @(bytes) [bytes(1:59); bitxor(bytes(60), 1); bytes(61:end)]);
wire = isotherm('bad.wire');
printf('%d\n', rows(wire(1).delta_angle_rad) < rows(units(1).delta_angle_rad));
";

#[test]
fn octave_reads_recordings_and_frames() {
    if Command::new("octave-cli").arg("--version").output().is_err() {
        eprintln!("skipped: octave-cli not found (Debian: apt install octave)");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| check(&replay(folder.path(), args), 0);
    run(&["simulate", "--preset", "mems-chamber", "--duration", "20", "--out", "own.csv"]);
    let document = root().join("config/calibration/MEMS-0001.toml");
    for out in ["own.mcap", "own.wire"] {
        let document = document.to_str().unwrap();
        let format: &[&str] = if out == "own.wire" { &["--format", "wire"] } else { &[] };
        let correct =
            ["correct", "own.csv", "--mapping", "own.mapping.toml", "--calibration", document, "--out", out];
        run(&[&correct, format].concat());
    }
    std::fs::write(folder.path().join("look.m"), SCRIPT).unwrap();
    let octave = Command::new("octave-cli")
        .args(["--quiet", "--norc", "--path"])
        .arg(root().join("clients/matlab"))
        .arg("look.m")
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&octave.stdout);
    let [ticks, equal, cut, fewer] = said.lines().collect::<Vec<_>>()[..] else {
        panic!("{octave:?}");
    };
    assert_eq!((ticks, equal, fewer), ("MEMS-0001 2000", "1", "1"), "{octave:?}");
    // Where it is cut depends on how well it was compressed.
    let cut: String = cut.chars().filter(|sign| !sign.is_ascii_digit()).collect();
    let warnings = String::from_utf8_lossy(&octave.stderr);
    insta::assert_snapshot!(cut + "\n" + warnings.lines().find(|line| line.contains("bad.wire")).unwrap());
}
