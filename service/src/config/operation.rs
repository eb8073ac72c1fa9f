//! What units do at their start, and the limits of a pre-launch calibration.

use isotherm_correction::prelaunch::{PreLaunchLimits, PreLaunchSettings};
use isotherm_correction::units::{AngularRate, Span};

use super::walk::{Table, Walk};

/// Reads `[pre_launch]`.
pub(super) fn read_pre_launch(walk: &mut Walk<'_>, root: &mut Table<'_>) -> PreLaunchSettings {
    let default = PreLaunchSettings::default();
    let limits = default.limits;
    let mut table = root.table(walk, "pre_launch");
    let rad_per_s = |deg_per_h: f64| AngularRate::from_deg_per_h(deg_per_h).as_rad_per_s();
    let settings = PreLaunchSettings {
        duration: table.number(walk, "duration_s", 60.0, 7200.0).map_or(default.duration, Span::from_s),
        place: None,
        limits: PreLaunchLimits {
            static_bias_change_rad_per_s: table
                .number(walk, "max_static_change_deg_per_h", 1e-6, 1e6)
                .map_or(limits.static_bias_change_rad_per_s, rad_per_s),
            magnetic_bias_change_rad_per_s: table
                .number(walk, "max_magnetic_change_deg_per_h", 1e-6, 1e6)
                .map_or(limits.magnetic_bias_change_rad_per_s, rad_per_s),
            mode_imbalance: table.number(walk, "max_imbalance", 0.0, 1.0).unwrap_or(limits.mode_imbalance),
            time_per_mode: table
                .number(walk, "min_time_per_mode_s", 30.0, 7200.0)
                .map_or(limits.time_per_mode, Span::from_s),
            good_share: table.number(walk, "min_good_share", 0.0, 1.0).unwrap_or(limits.good_share),
            rest: limits.rest,
        },
    };
    table.finish(walk);
    settings
}
