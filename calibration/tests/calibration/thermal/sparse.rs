//! Thermometers that are read seldom, and loggers that write seldom: what is fitted then, and that nothing is made up in between.

use std::fmt::Write as _;

use isotherm_calibration::fits::thermal::{Fitted, Method, Settings, fit};
use isotherm_calibration::runs::Run;
use isotherm_correction::sample::OutputKind;
use isotherm_log::mapping::Mapping;
use isotherm_log::offline::unit_id;
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::text::LogEvent;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::presets::{fibre_optic_chamber, judging_profile, training_profile};
use isotherm_simulator::{Scenario, Simulation};

use super::{TICK_NS, base, fitted, settings, together};
use crate::simulated_logs::{self, events};

fn scenario((seed, profile): (u64, Profile)) -> Scenario {
    Scenario { tick_ns: TICK_NS, ..fibre_optic_chamber(seed, profile) }
}

/// A run whose thermometers are read every so many seconds.
fn seldom_read(scenario: &Scenario, every_s: i64) -> Run {
    let is_read = |event: &LogEvent| match event {
        LogEvent::Temperature(reading) => reading.time.as_ns() / 1_000_000_000 % every_s == 0,
        LogEvent::Gyro { .. } => true,
        LogEvent::Accel { .. } => false,
    };
    simulated_logs::run("simulated", &scenario.unit, events(scenario).filter(is_read))
}

#[test]
fn thermometers_that_are_read_every_ten_to_sixty_seconds_serve_a_fit() {
    let mut told = String::new();
    for (every_s, least) in [(10, 10.0), (30, 7.0), (60, 4.0)] {
        let runs = [(101, training_profile()), (202, judging_profile())]
            .map(|of| seldom_read(&scenario(of), every_s));
        let Fitted { written, report, .. } = fitted(Method::Joint, &runs);
        println!("every {every_s} s: {:.1?}\n{}", together(&report), report.headline());
        let filter = written.document.temperature.filter.unwrap();
        assert!(
            3.0 * filter.grid_step_s >= every_s as f64 && filter.stale_after_s > 2.0 * every_s as f64,
            "{filter:?}"
        );
        assert!(report.accepted() && together(&report)[0] > least, "{every_s} s: {:?}", report.headline());
        told += &(report.warnings.join("\n") + "\n");
    }
    insta::assert_snapshot!(told);
}

/// A log with a row a minute: date and time, a status word, mean rates of the minute, the thermometers as they read then. In every
/// hundredth row the status says that it does not hold, and its readings are nonsense.
fn minutes(scenario: &Scenario, folder: &tempfile::TempDir, name: &str) -> Run {
    const TICKS: usize = 120;
    let mut text = String::from("when,status,x,y,z,t0,t1,t2\n");
    let (mut rates, mut volts) = ([0.0; 3], [f64::NAN; 3]);
    for (number, step) in (1_usize..).zip(Simulation::new(scenario).unwrap()) {
        rates.iter_mut().zip(&step.gyro.readings).for_each(|(sum, rate)| *sum += rate / TICKS as f64);
        for reading in &step.temperatures {
            let gyro = ["gyro0", "gyro1", "gyro2"].iter().position(|name| *name == &*reading.channel);
            if let Some(gyro) = gyro {
                volts[gyro] = reading.raw;
            }
        }
        if number.is_multiple_of(TICKS) {
            let minute = number / TICKS;
            let stamp = format!(
                "2026-11-{:02}T{:02}:{:02}:00+02:00",
                1 + minute / 1440,
                minute / 60 % 24,
                minute % 60
            );
            let cells: Vec<String> = rates.iter().chain(&volts).map(f64::to_string).collect();
            let row = if minute.is_multiple_of(100) {
                "0x12,9,9,9,9,9,9".to_owned()
            } else {
                format!("0x2,{}", cells.join(","))
            };
            writeln!(text, "{stamp},{row}").unwrap();
            rates = [0.0; 3];
        }
    }
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let sensor = |column: &str| format!("{{ column = \"{column}\", unit = \"rad_per_s\" }}");
    let temperature = |gyro: usize| {
        format!("[[file.temperature]]\nchannel = \"gyro{gyro}\"\ncolumn = \"t{gyro}\"\nunit = \"volt\"\n")
    };
    let mapping = format!(
        "version = 1\n[[file]]\ndelimiter = \"comma\"\nheader = true\n[file.time]\ncolumn = \"when\"\nunit = \"iso\"\ntick_s = 60\n\
         gap_after_ticks = 1.5\n[file.status]\ncolumn = \"status\"\nbad_bits = 16\n[file.gyro]\noutput = \"mean\"\n\
         sensors = [{}, {}, {}]\n{}{}{}",
        sensor("x"),
        sensor("y"),
        sensor("z"),
        temperature(0),
        temperature(1),
        temperature(2)
    );
    let mapping = Box::new(Mapping::parse(&mapping, "minutes.toml").unwrap());
    let unit = unit_id(&scenario.unit).unwrap();
    let files = LogFiles::Text { paths: vec![path], mapping, unit: unit.clone(), batch_ticks: 64 };
    Run::new(name.to_owned(), unit, files, &Part::default())
}

#[test]
fn a_log_with_a_row_a_minute_serves_a_fit() {
    let folder = tempfile::tempdir().unwrap();
    let [train, judge] = [(101, training_profile(), "train.csv"), (202, judging_profile(), "judge.csv")]
        .map(|(seed, profile, name)| minutes(&scenario((seed, profile)), &folder, name));
    assert_eq!(train.series().unwrap().gyros.output, Some(OutputKind::Mean));
    let mut base = base();
    base.temperature.channel.retain(|channel| channel.name.starts_with("gyro"));
    base.gyro.orientation.thermal = None;
    let runs = (std::slice::from_ref(&train), std::slice::from_ref(&judge));
    let settings = Settings { window_s: None, ..settings(Method::Joint) };
    let Fitted { report, .. } = fit(Some(&base), runs, &settings).unwrap();
    println!("{:.1?}\n{}\n{:#?}", together(&report), report.headline(), report.warnings);
    assert!(report.accepted() && together(&report)[0] > 4.0, "{}", report.headline());
    // No window is shorter than a row.
    assert!(report.residuals.iter().all(|curve| curve.window_s >= 60.0));
}
