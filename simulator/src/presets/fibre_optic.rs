//! Fibre-optic unit at rest in a chamber: three gyros with quadrupole coils, three quartz accelerometers, 100 Hz.

use crate::chamber::Profile;
use crate::coil::Slab;
use crate::fibre_optic::{FibreOpticGyro, OpticsBias};
use crate::instrument::Gyros;
use crate::orientation::Orientation;
use crate::presets::shared::{DEG_PER_H, at_rest, instrument, quartz, walk};
use crate::scenario::Scenario;
use crate::winding::{Fibre, Winding};

fn gyro(
    midpoint_offset_m: f64,
    inner_contact: f64,
    offset: f64,
    ripple: f64,
    phase_rad: f64,
) -> FibreOpticGyro {
    FibreOpticGyro {
        coil: Slab {
            layers: 32,
            cells_per_layer: 2,
            layer_thickness_m: 2.5e-4,
            conductivity_w_per_m_k: 0.20,
            heat_capacity_j_per_m3_k: 1.9e6,
            outer_contact_w_per_m2_k: 120.0,
            inner_contact_w_per_m2_k: inner_contact,
        },
        fibre: Fibre {
            winding: Winding::Quadrupole,
            turns_per_layer: 130,
            inner_radius_m: 0.036,
            midpoint_offset_m,
            refractive_index: 1.457,
            thermo_optic_per_k: [1.07e-5, 2.4e-8],
        },
        reference_deg_c: 20.0,
        scale: 1.000_12,
        scale_per_k: [7.0e-6, 3.0e-8],
        bias: OpticsBias {
            offset_rad_per_s: offset * DEG_PER_H,
            ripple_rad_per_s: ripple * DEG_PER_H,
            ripple_period_k: 190.0,
            ripple_phase_rad: phase_rad,
        },
        noise: walk(0.004),
    }
}

/// Chamber programme to fit a thermal model on: +20 → −40 → +60 → +20 °C at 1 °C/min, with holds (6 h 20 min).
#[must_use]
pub fn training_profile() -> Profile {
    Profile::constant(20.0)
        .hold(30.0)
        .ramp(-40.0, 1.0)
        .hold(60.0)
        .ramp(60.0, 1.0)
        .hold(60.0)
        .ramp(20.0, 1.0)
        .hold(30.0)
}

/// Chamber programme to judge a thermal model on: other rates, other turning points, a reversal without a hold (5 h 28 min).
#[must_use]
pub fn judging_profile() -> Profile {
    Profile::constant(20.0)
        .hold(20.0)
        .ramp(50.0, 0.6)
        .hold(25.0)
        .ramp(-10.0, 1.2)
        .ramp(10.0, 0.8)
        .hold(15.0)
        .ramp(-30.0, 1.0)
        .hold(35.0)
        .ramp(20.0, 1.3)
        .hold(30.0)
}

/// Chamber programme of paper 000: −50 to +60 °C at 1 °C/min, with plateaus at 60, 20 and −50 °C, twice (18 h 20 min).
#[must_use]
pub fn paper_profile() -> Profile {
    let cycle = |before: Profile| {
        let up = before.ramp(60.0, 1.0).hold(80.0).ramp(20.0, 1.0).hold(80.0);
        up.ramp(-50.0, 1.0).hold(80.0).ramp(20.0, 1.0).hold(60.0)
    };
    cycle(cycle(Profile::constant(20.0).hold(60.0)))
}

/// Fibre-optic unit at rest through a chamber programme, from its start to its end.
#[must_use]
pub fn fibre_optic_chamber(seed: u64, chamber: Profile) -> Scenario {
    let gyros = vec![
        gyro(0.60, 6.0, 0.12, 0.10, 0.4),
        gyro(-0.55, 0.0, -0.08, 0.07, 1.9),
        gyro(0.40, 12.0, 0.05, 0.13, -0.8),
    ];
    let unit = instrument(
        [(60.0, 4.0), (120.0, 7.0)],
        Gyros::FibreOptic(gyros),
        Orientation::orthogonal(),
        quartz(),
    );
    at_rest("FOG-0001", seed, 10_000_000, chamber, unit)
}
