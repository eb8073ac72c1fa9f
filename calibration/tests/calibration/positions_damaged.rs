//! `positions` on logs that are damaged: what is told, and what is refused.

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::fit::{Analysis, Settings, analyse};
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_calibration::fits::positions::track::Track;
use isotherm_calibration::runs::Run;
use isotherm_protocol::document::Document;

use crate::stand::judging::{quick, settings, times, tracks};
use crate::stand::{self, Stand};

/// What the twelve positions at some temperatures come to, with the turns told by times; `change` has the tracks of all runs.
fn found(
    deg_c: &[f64],
    document: &Document,
    channels: &[&str],
    change: &dyn Fn(&mut [Track]),
) -> Result<Analysis, Vec<String>> {
    let (plan, order) = (Plan::twelve(), (0..12).collect::<Vec<_>>());
    let written = Written::of(document).unwrap();
    let (mut runs, mut rows): (Vec<Run>, _) = (Vec::new(), times(&plan, "", &[]));
    for (index, deg_c) in deg_c.iter().enumerate() {
        let name = format!("log {index}");
        // One stand, and other noise in each log.
        let how = Stand { errors: quick(40).errors, ..quick(40 + index as u64) };
        let (events, held) = stand::log(&stand::instrument(), *deg_c, &plan, &order, &how);
        rows.rows.extend(times(&plan, &name, &held).rows);
        runs.push(stand::run(&name, events));
    }
    let mut tracks = tracks(&runs, &written);
    change(&mut tracks);
    let channels = channels.iter().map(|channel| (*channel).to_owned()).collect();
    analyse(&tracks, document, &Settings { channels, ..settings(plan, Some(rows)) })
}

/// Sets the readings of a channel, or takes it away.
fn channel(tracks: &mut [Track], name: &str, reading: Option<f64>) {
    for track in tracks {
        match reading {
            Some(reading) => track.temperature_deg_c.get_mut(name).unwrap().fill(reading),
            None => drop(track.temperature_deg_c.remove(name)),
        }
    }
}

#[test]
fn channels_that_say_nothing_are_told_and_others_stand_in_for_them() {
    let mut document = stand::document();
    let thermal = isotherm_protocol::document::OrientationThermal {
        channels: vec!["housing".to_owned()],
        reference_deg_c: 20.0,
        range_deg_c: [-40.0, 80.0],
        slopes_arcsec_per_deg_c: vec![[0.0; 3]; 3],
        hysteresis: Vec::new(),
    };
    document.accel.as_mut().unwrap().orientation.thermal = Some(thermal);
    let deg_c = [-20.0, 50.0];
    let good = found(&deg_c, &document, &[], &|_| {}).unwrap();
    assert_eq!((good.levels_deg_c.len(), good.channels.as_slice()), (2, &["housing".to_owned()][..]));
    assert_eq!(good.warnings, Vec::<String>::new());
    // The accelerometers' own channels tell both temperatures.
    let gone = found(&deg_c, &document, &[], &|tracks| channel(tracks, "housing", None)).unwrap();
    assert_eq!((gone.levels_deg_c.len(), gone.channels.len()), (2, 3));
    let stuck = found(&deg_c, &document, &[], &|tracks| channel(tracks, "housing", Some(25.0))).unwrap_err();
    let asked = found(&deg_c, &document, &["nothing"], &|_| {}).unwrap_err();
    // One channel for all: they are named in one sentence.
    let blind = found(&deg_c, &document, &[], &|tracks| {
        (0..3).for_each(|index| channel(tracks, &format!("accel{index}"), Some(25.0)));
    });
    let each = blind.unwrap_err();
    for sensor in &mut document.accel.as_mut().unwrap().sensor {
        sensor.channel = Some("board".to_owned());
    }
    let blind = found(&deg_c, &document, &[], &|tracks| channel(tracks, "board", Some(25.0))).unwrap_err();
    insta::assert_snapshot!(
        [gone.warnings, stuck, asked, each, blind].map(|words| words.join("\n")).join("\n\n")
    );
}

#[test]
fn units_of_measure_and_columns_are_named_once() {
    let document = stand::document();
    let of = |change: &dyn Fn(&mut [Track])| found(&[20.0], &document, &[], change);
    let good = of(&|_| {}).unwrap();
    assert_eq!(good.warnings, Vec::<String>::new());
    let grams =
        of(&|tracks| tracks[0].outputs.iter_mut().flatten().for_each(|output| *output *= 9.81)).unwrap();
    let swapped = of(&|tracks| tracks[0].outputs.swap(0, 2)).unwrap();
    let sign = of(&|tracks| tracks[0].outputs[1].iter_mut().for_each(|output| *output = -*output)).unwrap();
    let half = of(&|tracks| {
        let middle = tracks[0].len() / 2;
        tracks[0].outputs.iter_mut().for_each(|column| column[middle..].iter_mut().for_each(|x| *x /= 9.81));
    });
    let told = [grams.warnings, swapped.warnings, sign.warnings, half.unwrap_err()];
    insta::assert_snapshot!(told.map(|words| words.join("\n")).join("\n\n"));
}

#[test]
fn a_position_without_its_twin_asks_for_times() {
    let plan = Plan::twelve();
    let how = Stand { turn_deg_per_s: None, hold_s: 14.0, tick_ns: 100_000_000, ..quick(8) };
    // A log of one position.
    let (events, _) = stand::log(&stand::instrument(), 20.0, &plan, &[1], &how);
    let document = stand::document();
    let tracks = tracks(&[stand::run("room", events)], &Written::of(&document).unwrap());
    insta::assert_snapshot!(analyse(&tracks, &document, &settings(plan, None)).unwrap_err().join("\n"));
}
