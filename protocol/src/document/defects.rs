//! The core's defects, told in the document's keys.

use std::collections::BTreeSet;

use isotherm_correction::calibration::{Defect, DefectKind};
use isotherm_document::Reader;

/// Reports what the core found, but for what follows from a value that was replaced.
pub(super) fn report(r: &mut Reader<'_>, defects: &[Defect]) {
    let mut told = BTreeSet::new();
    for defect in defects {
        let path = r.spelled(&defect.path);
        let of_sensors = sensors(defect).is_some_and(|sensors| r.is_marked(sensors));
        if is_told(&defect.kind)
            || of_sensors
            || rests_on(defect, &path).iter().any(|path| r.is_damaged(path))
        {
            continue;
        }
        let message = defect.kind.to_string();
        if told.insert((path.clone(), message.clone())) {
            r.report(&path, message);
        }
    }
}

/// What was reported by its key: the core knows channels by index only, and gets what is no number for what is missing.
fn is_told(kind: &DefectKind) -> bool {
    match kind {
        DefectKind::NoSuchChannel { .. } => true,
        DefectKind::OutOfRange { value, .. } => value.is_nan(),
        _ => false,
    }
}

/// The list that a defect compares the length of another one with.
fn sensors(defect: &Defect) -> Option<&'static str> {
    let of_gyros = defect.path.starts_with("gyro.");
    matches!(defect.kind, DefectKind::ListCount { .. }).then_some(if of_gyros {
        "gyro.sensor"
    } else {
        "accel.sensor"
    })
}

/// Paths whose values a defect is worked out from: where one of them is a stand-in, the defect says nothing.
fn rests_on(defect: &Defect, path: &str) -> Vec<String> {
    const FIT_READINGS: [&str; 2] = ["mode_reversal.fit_readings_before", "mode_reversal.fit_readings_after"];
    let under = |table: &str| defect.path.starts_with(table);
    let field = defect.path.split_once("].").map_or("", |(_, field)| field);
    let others: &[&str] = match &defect.kind {
        DefectKind::BelowGridStep { .. } => &["temperature.filter.grid_step_s"],
        DefectKind::RowNorm { .. } | DefectKind::ListCount { .. } => &[],
        _ if under("temperature.filter.") => &["temperature.filter.grid_step_s"],
        _ if under("gyro.orientation") => &["gyro.orientation"],
        _ if under("accel.orientation") => &["accel.orientation"],
        _ if under("gyro.sensor[") && (field.starts_with("increment_weight_") || field == "input_limit") => {
            &["gyro.output"]
        }
        _ if under("accel.sensor[") && field == "input_limit" => &["accel.output"],
        DefectKind::DegreeNeedsReadings { .. } if defect.path == "mode_reversal.predict_degree" => {
            &["mode_reversal.predict_readings"]
        }
        _ if under("mode_reversal.") => &FIT_READINGS,
        _ => &[],
    };
    std::iter::once(path).chain(others.iter().copied()).map(str::to_owned).collect()
}
