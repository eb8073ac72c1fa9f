//! What a document says of itself and of what is no curve.

use isotherm_protocol::document::{Document, Orientation};

use super::parts;
use super::terms::Term;
use crate::document::accelerometers;
use crate::numbers::ARCSEC_PER_RAD;
use crate::report::{Report, or_dash, short};

/// Unit, sensors, and how good it is by its own account.
pub(super) fn words(document: &Document) -> String {
    let names = |names: Vec<&str>| names.join(", ");
    let gyros = document.gyro.sensor.iter().map(|sensor| sensor.name.as_str()).collect();
    let accels: Vec<&str> = accelerometers(document).iter().map(|sensor| sensor.name.as_str()).collect();
    let accels = if accels.is_empty() {
        "no accelerometers".to_owned()
    } else {
        format!("accelerometers {}", names(accels))
    };
    let created = document.created.map(|created| format!(", of {created}")).unwrap_or_default();
    format!("calibration of unit {}{created}; gyros {}; {accels}", document.unit, names(gyros))
}

/// Sentences.
pub(super) fn notes(document: &Document, terms: &[Term]) -> Vec<String> {
    let mut notes: Vec<String> = document.note.iter().cloned().collect();
    if let Some(origin) = &document.origin {
        let made = [("Made by", &origin.tool), ("with", &origin.command), ("method", &origin.method)];
        let made: Vec<String> = made
            .iter()
            .filter_map(|(word, value)| value.as_ref().map(|value| format!("{word} {value}")))
            .collect();
        if !made.is_empty() {
            notes.push(format!("{}.", made.join(", ")));
        }
        if let Some([low, high]) = origin.range_deg_c {
            notes.push(format!("The logs cover {} to {} °C.", short(low), short(high)));
        }
        if !origin.log.is_empty() {
            let names: Vec<&str> = origin.log.iter().map(|log| log.name.as_str()).collect();
            notes.push(format!("Logs: {}.", names.join(", ")));
        }
    }
    if let Some(filter) = &document.temperature.filter {
        notes.push(format!(
            "Temperatures: every {} s, averaged over {} s, differentiated over {} s, stale after {} s.",
            filter.grid_step_s, filter.smoothing_s, filter.derivative_step_s, filter.stale_after_s
        ));
    }
    if let Some(reversal) = &document.mode_reversal {
        let transition = match (reversal.transition_ticks, reversal.transition_s) {
            (Some(ticks), _) => format!("{ticks} ticks"),
            (None, transition_s) => format!("the ticks of {} s", short(transition_s.unwrap_or_default())),
        };
        notes.push(format!("At a switch of the lasing mode {transition} are substituted."));
    }
    if terms.is_empty() {
        notes.push("No term depends on temperature.".to_owned());
    }
    notes
}

/// Sensors, axes, channels, drift, residuals.
pub(super) fn tables(sheet: &mut Report, document: &Document) {
    let channels = document.temperature.channel.iter().map(|channel| {
        let [low, high] = channel.range_deg_c;
        let conversion: Vec<String> = channel.conversion_deg_c.iter().map(ToString::to_string).collect();
        vec![
            channel.name.clone(),
            format!("{low}…{high}"),
            channel.spike_limit_deg_c.to_string(),
            conversion.join(", "),
        ]
    });
    let head = ["channel", "range, °C", "spike limit, °C", "conversion a0, a1, …"];
    sheet.table("Temperature channels", head, channels);
    let gyros = document.gyro.sensor.iter().map(|gyro| {
        let weight = match (gyro.increment_weight_arcsec_per_count, gyro.increment_weight_rad_per_rad) {
            (Some(weight), _) => Some(format!("{weight} ″/count")),
            (None, weight) => weight.map(|weight| format!("{weight} rad/rad")),
        };
        let drift = gyro.drift.as_ref().map(|drift| {
            format!("{} °/h over {} h", short(drift.sigma_deg_per_h), short(drift.correlation_time_h))
        });
        vec![gyro.name.clone(), or_dash(gyro.channel.clone()), or_dash(weight), or_dash(drift)]
    });
    sheet.table("Gyros", ["gyro", "channel", "increment weight", "drift expected"], gyros);
    let accels = accelerometers(document).iter().map(|accel| {
        vec![accel.name.clone(), or_dash(accel.channel.clone()), or_dash(accel.board_channel.clone())]
    });
    sheet.table("Accelerometers", ["accelerometer", "channel", "board channel"], accels);
    let names = document.gyro.sensor.iter().map(|sensor| format!("gyro {}", sensor.name)).collect();
    let mut rows = axes(names, &document.gyro.orientation);
    if let Some(accel) = &document.accel {
        let names = accel.sensor.iter().map(|sensor| format!("accelerometer {}", sensor.name)).collect();
        rows.extend(axes(names, &accel.orientation));
    }
    let head = ["input axis", "x", "y", "z", "off its case axis, ″", "turns, ″/°C"];
    sheet.table("Input axes in case axes", head, rows);
    let residuals = document.origin.iter().flat_map(|origin| &origin.residual);
    sheet.table("Residuals as stated", parts::HEAD, residuals.map(parts::of_residual));
    parts::tables(sheet, document);
}

fn axes<P>(names: Vec<String>, orientation: &Orientation<P>) -> Vec<Vec<String>> {
    let row = |(index, (name, row)): (usize, (String, &[f64; 3]))| {
        let [x, y, z] = *row;
        let largest = row.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
        let norm = libm::sqrt(x * x + y * y + z * z);
        let rest = libm::sqrt((norm * norm - largest * largest).max(0.0));
        let slopes = orientation.thermal.as_ref().and_then(|t| t.slopes_arcsec_per_deg_c.get(index));
        let slope = or_dash(slopes.map(|slope| slope.map(short).join(", ")));
        // Off by more than 10° it stands askew on purpose.
        let angle = libm::atan2(rest, largest) * ARCSEC_PER_RAD;
        let off = if angle < 36_000.0 { format!("{angle:.1}") } else { format!("{:.2}°", angle / 3600.0) };
        let mut cells = vec![name];
        cells.extend(row.iter().map(|part| format!("{part:.7}")));
        cells.extend([off, slope]);
        cells
    };
    names.into_iter().zip(&orientation.rows).enumerate().map(row).collect()
}
