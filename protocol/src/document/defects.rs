//! The core's defects, told in the document's keys.

use std::collections::BTreeSet;

use isotherm_correction::calibration::{Defect, DefectKind, Section};
use isotherm_correction::reversal::ReversalError;

use super::types::{Document, GyroOutput};
use isotherm_document::{Reader, element};

/// Reports what the core found, but for what follows from a value that was replaced.
pub(super) fn report(r: &mut Reader<'_>, document: &Document, defects: &[Defect]) {
    let mut told = BTreeSet::new();
    for defect in defects {
        let path = path(document, defect);
        // The core knows channels by index only: `check` has reported the name.
        if matches!(defect.kind, DefectKind::NoSuchChannel { .. }) {
            continue;
        }
        if rests_on(defect, &path).iter().any(|path| r.is_damaged(path)) {
            continue;
        }
        let message = defect.kind.to_string();
        if told.insert((path.clone(), message.clone())) {
            r.report(&path, message);
        }
    }
}

/// Key that a defect lies in.
fn path(document: &Document, defect: &Defect) -> String {
    let table = match defect.section {
        Section::Filter if defect.field == "assumed_deg_c" => "temperature".into(),
        Section::Filter => "temperature.filter".into(),
        Section::Channel(i) => element("temperature.channel", i),
        Section::Auxiliary(i) => element("auxiliary", i),
        Section::Gyros => "gyro".into(),
        Section::Gyro(i) => element("gyro.sensor", i),
        Section::GyroOrientation => "gyro.orientation".into(),
        Section::Accels => "accel".into(),
        Section::Accel(i) => element("accel.sensor", i),
        Section::AccelOrientation => "accel.orientation".into(),
        Section::Reversal => "mode_reversal".to_owned(),
        Section::SelfTest => "self_test".to_owned(),
        Section::SelfTestVoltage(i) => element("self_test.voltage", i),
        Section::SelfTestCounter(i) => element("self_test.counter", i),
    };
    match key(document, defect) {
        "" => table,
        key => format!("{table}.{key}"),
    }
}

/// Spelling of the core's fields in the document, where the two differ.
fn key(document: &Document, defect: &Defect) -> &'static str {
    let counts = document.gyro.output == GyroOutput::Counts;
    match (defect.section, defect.field) {
        (Section::Filter, "branch_dead_band") => "branch_dead_band_deg_c2_per_s3",
        (Section::Channel(_), "conversion") => "conversion_deg_c",
        (Section::Channel(_), "range") => "range_deg_c",
        (Section::Channel(_), "spike_limit") => "spike_limit_deg_c",
        (Section::Gyros | Section::Accels, "sensors") => "sensor",
        (Section::Gyro(_), "increment_weight") if counts => "increment_weight_arcsec_per_count",
        (Section::Gyro(_), "increment_weight") => "increment_weight_rad_per_rad",
        (Section::Gyro(_), "input_limit") if counts => "input_limit_counts_per_tick",
        (Section::Gyro(_), "input_limit") => "input_limit_deg_per_s",
        (Section::GyroOrientation | Section::AccelOrientation, "plays") => "thermal.hysteresis",
        (Section::GyroOrientation | Section::AccelOrientation, "row") => "rows",
        (Section::GyroOrientation | Section::AccelOrientation, "weight") => "weights",
        (Section::Gyro(_) | Section::Accel(_), "sigma.bias.correlation") => "sigma.bias.correlation_ratio",
        (Section::Gyro(_), "trend.coefficients") => "trend.coefficients_deg_per_h",
        (Section::Gyro(_), "trend.interval_s") => "trend.interval_h",
        (Section::Gyro(_), "sigma_rad_per_s") => "drift.sigma_deg_per_h",
        (Section::Gyro(_), "correlation_time_s") => "drift.correlation_time_h",
        (Section::Gyro(_), "trend_sigma_rad_per_s2") => "drift.trend_sigma_deg_per_h2",
        (Section::Gyro(_), "trend_correlation_time_s") => "drift.trend_correlation_time_h",
        (Section::Gyro(_), "initial_sigma_rad_per_s") => "drift.initial_sigma_deg_per_h",
        (Section::Gyro(_), "angle_random_walk_rad_per_sqrt_s") => "drift.angle_random_walk_deg_per_sqrt_h",
        (Section::SelfTest, "voltages") => "voltage",
        (Section::SelfTest, "counters") => "counter",
        (Section::Accel(_), "board_ratio") => "board_ratio_error",
        (Section::Accel(_), "input_limit") => "",
        (Section::GyroOrientation | Section::AccelOrientation, "slopes_per_deg_c" | "slopes" | "slope") => {
            "thermal.slopes_arcsec_per_deg_c"
        }
        (Section::GyroOrientation | Section::AccelOrientation, "reference_deg_c") => {
            "thermal.reference_deg_c"
        }
        (Section::GyroOrientation | Section::AccelOrientation, "range_deg_c") => "thermal.range_deg_c",
        (Section::GyroOrientation | Section::AccelOrientation, "channels") => "thermal.channels",
        (Section::GyroOrientation, "parity_limit") => "parity.limit_deg_per_h",
        (Section::AccelOrientation, "parity_limit") => "parity.limit_m_per_s2",
        (Section::GyroOrientation | Section::AccelOrientation, "parity_confirm_ticks") => {
            "parity.confirm_ticks"
        }
        // The table as a whole is missing.
        (Section::Reversal, _) if matches!(defect.kind, DefectKind::Missing { .. }) => "",
        (_, field) => field,
    }
}

/// Paths whose values a defect is worked out from: where one of them is a stand-in, the defect says nothing.
fn rests_on(defect: &Defect, path: &str) -> Vec<String> {
    let mut paths = vec![path.to_owned()];
    match (&defect.section, &defect.kind) {
        (Section::Filter, _) if defect.field != "assumed_deg_c" => {
            paths.push("temperature.filter.grid_step_s".into());
        }
        (Section::GyroOrientation, _) => paths.push("gyro.orientation".into()),
        (Section::AccelOrientation, _) => paths.push("accel.orientation".into()),
        (Section::Gyro(_), _) if matches!(defect.field, "increment_weight" | "input_limit") => {
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
