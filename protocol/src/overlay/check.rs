//! What holds between the keys of an overlay.

use isotherm_document::{Reader, element, join};

use super::types::{GyroOverlay, Overlay, PreLaunchRecord};

pub(super) fn check(r: &mut Reader<'_>, overlay: &Overlay) {
    for (i, gyro) in overlay.gyro.iter().enumerate() {
        let path = element("gyro", i);
        if let Some(earlier) = overlay.gyro.iter().take(i).position(|earlier| earlier.name == gyro.name) {
            let name = &gyro.name;
            let message = format!("is {name:?}, also the name of gyro[{earlier}]: each gyro changes once");
            r.report(&join(&path, "name"), message);
        }
        change_with_sigma(r, &path, gyro);
    }
    if let Some(record) = &overlay.pre_launch {
        order(r, record);
    }
}

/// A change of the magnetic bias and its standard error come together.
fn change_with_sigma(r: &mut Reader<'_>, path: &str, gyro: &GyroOverlay) {
    let (change, sigma) = ("magnetic_bias_change_deg_per_h", "magnetic_bias_sigma_deg_per_h");
    let missing = match (gyro.magnetic_bias_change_deg_per_h, gyro.magnetic_bias_sigma_deg_per_h) {
        (Some(_), None) => Some((sigma, change)),
        (None, Some(_)) => Some((change, sigma)),
        _ => None,
    };
    if let Some((key, other)) = missing {
        r.report(&join(path, key), format!("is missing: {other} needs it, add `{key}`"));
    }
}

fn order(r: &mut Reader<'_>, PreLaunchRecord { start_ns, end_ns, .. }: &PreLaunchRecord) {
    if end_ns < start_ns {
        let message = format!("is {end_ns}, before start_ns, {start_ns}: the end follows the start");
        r.report("pre_launch.end_ns", message);
    }
}
