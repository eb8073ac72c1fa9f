//! The walk through an overlay: every key is asked for here once, with its limits.

use isotherm_correction::sample::{MAX_SENSORS, MIN_SENSORS};

use super::types::{GyroOverlay, Overlay, PreLaunchRecord};
use super::{OVERLAY_OF, OVERLAY_SCHEMA};
use crate::document::common::{created, name, sha256, unit};
use crate::document::reader::{Reader, Table, element, join};
use crate::document::values::Limits;

/// Changes and standard errors of constants (°/h): beyond any gyro that is worth correcting.
const CHANGE_DEG_PER_H: Limits = Limits::Within(-100_000.0, 100_000.0);
const SIGMA_DEG_PER_H: Limits = Limits::Within(0.0, 100_000.0);
/// Any range of temperatures (°C).
const TEMPERATURES: Limits = Limits::Within(-273.15, 1000.0);

/// Reads the whole overlay.
pub(super) fn overlay(r: &mut Reader<'_>, mut root: Table<'_>) -> Overlay {
    let overlay = Overlay {
        schema: root.whole(r, "schema", OVERLAY_SCHEMA, OVERLAY_SCHEMA),
        overlay_of: sha256(r, &mut root, OVERLAY_OF),
        unit: unit(r, &mut root),
        created: created(r, &mut root),
        note: root.text_opt(r, "note", "a string", |_| true),
        gyro: {
            let gyros = root.tables(r, "gyro", (1, MAX_SENSORS));
            gyros.into_iter().map(|table| gyro(r, table)).collect()
        },
        pre_launch: root.table_opt(r, "pre_launch").map(|table| pre_launch(r, table)),
    };
    root.finish(r);
    for (i, gyro) in overlay.gyro.iter().enumerate() {
        if let Some(earlier) = overlay.gyro.iter().take(i).position(|earlier| earlier.name == gyro.name) {
            let name = &gyro.name;
            let message = format!("is {name:?}, the name of gyro[{earlier}] too: each gyro changes once");
            r.report(&join(&element("gyro", i), "name"), message);
        }
    }
    overlay
}

fn gyro(r: &mut Reader<'_>, mut table: Table<'_>) -> GyroOverlay {
    let gyro = GyroOverlay {
        name: name(r, &mut table, "name"),
        static_bias_change_deg_per_h: table.number(r, "static_bias_change_deg_per_h", CHANGE_DEG_PER_H),
        static_bias_sigma_deg_per_h: table.number(r, "static_bias_sigma_deg_per_h", SIGMA_DEG_PER_H),
        magnetic_bias_change_deg_per_h: table.number_opt(
            r,
            "magnetic_bias_change_deg_per_h",
            CHANGE_DEG_PER_H,
        ),
        magnetic_bias_sigma_deg_per_h: table.number_opt(r, "magnetic_bias_sigma_deg_per_h", SIGMA_DEG_PER_H),
    };
    let (change, sigma) = ("magnetic_bias_change_deg_per_h", "magnetic_bias_sigma_deg_per_h");
    let missing = match (gyro.magnetic_bias_change_deg_per_h, gyro.magnetic_bias_sigma_deg_per_h) {
        (Some(_), None) => Some((sigma, change)),
        (None, Some(_)) => Some((change, sigma)),
        _ => None,
    };
    if let Some((key, other)) = missing {
        table.missing(r, key, &format!("is missing: {other} needs it, add `{key}`"));
    }
    table.finish(r);
    gyro
}

fn pre_launch(r: &mut Reader<'_>, mut table: Table<'_>) -> PreLaunchRecord {
    let record = PreLaunchRecord {
        latitude_deg: table.number(r, "latitude_deg", Limits::Within(-90.0, 90.0)),
        heading_deg: table.number(r, "heading_deg", Limits::Within(-360.0, 360.0)),
        pitch_roll_deg: table.fixed_opt(r, "pitch_roll_deg", Limits::Within(-180.0, 180.0)),
        duration_s: table.number(r, "duration_s", Limits::Within(0.0, 1e6)),
        start_ns: table.time_ns(r, "start_ns"),
        end_ns: table.time_ns(r, "end_ns"),
        mean_temperature_deg_c: {
            let key = "mean_temperature_deg_c";
            let means = table.numbers_opt(r, key, (MIN_SENSORS, MAX_SENSORS), TEMPERATURES);
            table.need(r, key, means, Vec::new())
        },
    };
    if record.end_ns < record.start_ns {
        let (start, end) = (record.start_ns, record.end_ns);
        r.report(
            &table.path_of("end_ns"),
            format!("is {end}, before start_ns, {start}: the end follows the start"),
        );
    }
    table.finish(r);
    record
}
