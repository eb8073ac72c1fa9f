//! The core's defects, told in the document's keys.

use std::collections::BTreeSet;

use isotherm_correction::calibration::{Defect, DefectKind, Section};
use isotherm_correction::orientation::OrientationError;
use isotherm_correction::reversal::ReversalError;
use isotherm_document::Reader;

/// Reports what the core found, but for what follows from a value that was replaced.
pub(super) fn report(r: &mut Reader<'_>, defects: &[Defect]) {
    let mut told = BTreeSet::new();
    for defect in defects {
        let path = r.spelled(&defect.path());
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
    match (&defect.kind, defect.section) {
        (DefectKind::Orientation(OrientationError::ListCount { .. }), Section::GyroOrientation) => {
            Some("gyro.sensor")
        }
        (DefectKind::Orientation(OrientationError::ListCount { .. }), _) => Some("accel.sensor"),
        _ => None,
    }
}

/// Paths whose values a defect is worked out from: where one of them is a stand-in, the defect says nothing.
fn rests_on(defect: &Defect, path: &str) -> Vec<String> {
    let mut paths = vec![path.to_owned()];
    match (&defect.section, &defect.kind) {
        (Section::Filter, _) if defect.field != "assumed_deg_c" => {
            paths.push("temperature.filter.grid_step_s".into());
        }
        (_, DefectKind::BelowGridStep { .. }) => paths.push("temperature.filter.grid_step_s".into()),
        (
            _,
            DefectKind::Orientation(OrientationError::RowNorm { .. } | OrientationError::ListCount { .. }),
        ) => {}
        (Section::GyroOrientation, _) => paths.push("gyro.orientation".into()),
        (Section::AccelOrientation, _) => paths.push("accel.orientation".into()),
        (Section::Gyro(_), _)
            if defect.field.starts_with("increment_weight_") || defect.field == "input_limit" =>
        {
            paths.push("gyro.output".into());
        }
        (Section::Accel(_), _) if defect.field == "input_limit" => paths.push("accel.output".into()),
        (_, DefectKind::Reversal(ReversalError::DegreeNeedsReadings { name: "predict_degree", .. })) => {
            paths.push("mode_reversal.predict_readings".into());
        }
        (_, DefectKind::Reversal(_)) => {
            paths.extend(["before", "after"].map(|side| format!("mode_reversal.fit_readings_{side}")));
        }
        _ => {}
    }
    paths
}
