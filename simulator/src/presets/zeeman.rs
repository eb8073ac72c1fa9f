//! Zeeman laser unit: three dithered gyros at 200 Hz and three quartz accelerometers.

use crate::chamber::Profile;
use crate::instrument::{Gyros, Instrument};
use crate::motion::Path;
use crate::orientation::Orientation;
use crate::presets::shared::{DEG_PER_H, at_rest, instrument, quartz, walk};
use crate::reversal::Reversal;
use crate::scenario::Scenario;
use crate::thermal::Node;
use crate::zeeman::{Zeeman, ZeemanGyro};

const ARCSEC: f64 = core::f64::consts::PI / 180.0 / 3600.0;

fn gyro(scale_arcsec: f64, nonmagnetic: [f64; 3], magnetic: [f64; 3], dither_hz: f64) -> ZeemanGyro {
    ZeemanGyro {
        node: Node { time_constant_s: 540.0, heating_deg_c: 5.0 },
        reference_deg_c: 20.0,
        scale_rad_per_count: scale_arcsec * ARCSEC,
        scale_per_k: [3.2e-6, -1.1e-8],
        bias_nonmagnetic_rad_per_s: nonmagnetic.map(|c| c * DEG_PER_H),
        bias_magnetic_rad_per_s: magnetic.map(|b| b * DEG_PER_H),
        meander_rad_per_s: [0.06 * DEG_PER_H, 1.5e-3 * DEG_PER_H],
        dither_hz: [dither_hz, -28.0, 0.06],
        lock_in_rad_per_s: 0.0,
        noise: walk(0.002),
    }
}

fn unit(period_s: f64) -> Instrument {
    let reversal = Reversal {
        period_s,
        starts_in_minus: false,
        lost_min_s: 0.005,
        lost_max_s: 0.015,
        servo_time_constant_s: 0.040,
        miss_rms_wavelengths: 0.04,
        dither_curvature: 10.0,
        dither_turns_with_mode: false,
        meander_half_period_s: 0.0,
    };
    let gyros = vec![
        gyro(1.94, [0.41, 8.0e-3, -6.0e-5], [2.3, 2.1e-2, -1.6e-4], 61_300.0),
        gyro(1.97, [-0.28, 5.0e-3, 9.0e-5], [-1.7, 1.4e-2, 2.2e-4], 58_900.0),
        gyro(1.92, [0.15, -1.1e-2, 7.0e-5], [3.1, -2.6e-2, 1.2e-4], 63_700.0),
    ];
    let gyros = Gyros::Zeeman(Zeeman { quantised: true, reversal, gyros });
    instrument([(300.0, 6.0), (120.0, 8.0)], gyros, Orientation::orthogonal(), quartz())
}

/// Zeeman unit at rest in a chamber that goes from +20 to +50 °C, with mode reversal every two minutes (1 h).
#[must_use]
pub fn zeeman_rest(seed: u64) -> Scenario {
    let chamber = Profile::constant(20.0).hold(10.0).ramp(50.0, 1.0).hold(20.0);
    at_rest("ZLG-0001", seed, 5_000_000, chamber, unit(120.0))
}

/// Zeeman unit on a stand that swings by 1° at 1 Hz about an axis across the case, in a chamber that goes from
/// +20 to +50 °C at 2 °C/min, with mode reversal every 12 s (20 min).
#[must_use]
pub fn zeeman_sine(seed: u64) -> Scenario {
    let swing = Path::Sine { axis: [1.0, 1.0, 1.0], amplitude_deg: 1.0, frequency_hz: 1.0, phase_deg: 0.0 };
    let chamber = Profile::constant(20.0).hold(2.0).ramp(50.0, 2.0).hold(3.0);
    let rest = at_rest("ZLG-0001", seed, 5_000_000, chamber, unit(12.0));
    Scenario { motion: rest.motion.clone().along(swing), ..rest }
}
