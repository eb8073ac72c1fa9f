//! Validation of a unit's parameters.

use crate::accelerometer::{AccelerometerOutput, Accelerometers};
use crate::check::{ANY, DEG_C, NOT_NEGATIVE, POSITIVE, Report, at, nth};
use crate::effects::{AxesPlay, Effects, Play, Supply};
use crate::error::{Key, ScenarioError};
use crate::fibre_optic::FibreOpticGyro;
use crate::instrument::{Gyros, Instrument};
use crate::mems::MemsGyro;
use crate::noise::GyroNoise;
use crate::reversal::Reversal;
use crate::thermal::Node;
use crate::zeeman::ZeemanGyro;

/// Beyond these a scale could come near zero over temperature.
fn scale_per_k(report: &mut Report, key: Key, [first, second]: [f64; 2]) {
    report.number(key, first, (-2e-3, 2e-3));
    report.number(key, second, (-5e-6, 5e-6));
}

pub(crate) fn instrument(report: &mut Report, instrument: &Instrument, tick_s: f64) {
    report.number(at("instrument.thermal_step_s"), instrument.thermal_step_s, (1e-3, 10.0));
    node(report, at("instrument.housing"), &instrument.housing);
    node(report, at("instrument.board"), &instrument.board);
    let count = instrument.gyros.count();
    report.sensors(at("instrument.gyros"), count);
    report.orientation("instrument.gyro_orientation", &instrument.gyro_orientation, count);
    match &instrument.gyros {
        Gyros::Zeeman(unit) => {
            reversal(report, &unit.reversal, tick_s);
            for (index, gyro) in unit.gyros.iter().enumerate() {
                zeeman(report, index, gyro);
            }
        }
        Gyros::FibreOptic(gyros) => {
            for (index, gyro) in gyros.iter().enumerate() {
                fibre(report, index, gyro);
            }
        }
        Gyros::Mems(gyros) => {
            for (index, gyro) in gyros.iter().enumerate() {
                mems(report, index, gyro);
            }
        }
    }
    if let Some(block) = &instrument.accelerometers {
        accelerometers(report, block);
    }
    effects(report, instrument);
}

fn effects(report: &mut Report, instrument: &Instrument) {
    let Effects { gyros, accelerometers, supply, gyro_axes, accelerometer_axes } = &instrument.effects;
    let accels = instrument.accelerometers.as_ref().map_or(0, |block| block.sensors.len());
    for (path, got, expected) in [
        ("instrument.effects.gyros", gyros.len(), instrument.gyros.count()),
        ("instrument.effects.accelerometers", accelerometers.len(), accels),
    ] {
        if got != 0 && got != expected {
            report.0.push(ScenarioError::Length { key: at(path), got, expected });
        }
    }
    let play = |report: &mut Report, key, play: Option<Play>| {
        if let Some(Play { half_width_k, per_k }) = play {
            report.number(key, half_width_k, POSITIVE);
            report.number(key, per_k, ANY);
        }
    };
    if let Some(Supply { channel, nominal_v, swing_v, period_s }) = supply {
        let key = at("instrument.effects.supply");
        report.channel_name(key, channel);
        if instrument.thermometers.channels.iter().any(|other| other.name == *channel) {
            report.0.push(ScenarioError::ChannelTwice { key });
        }
        report.numbers(key, &[*nominal_v, *swing_v], ANY);
        report.number(key, *period_s, POSITIVE);
    }
    for (path, axes) in [
        ("instrument.effects.gyro_axes", gyro_axes),
        ("instrument.effects.accelerometer_axes", accelerometer_axes),
    ] {
        if let Some(AxesPlay { half_width_k, share }) = axes {
            report.number(at(path), *half_width_k, POSITIVE);
            report.number(at(path), *share, (-10.0, 10.0));
        }
    }
    for (index, gyro) in gyros.iter().enumerate() {
        let key = nth("instrument.effects.gyros", index);
        report.numbers(key, &gyro.acceleration_rad_per_s_per_m_per_s2, (-1.0, 1.0));
        report.numbers(key, &gyro.acceleration_per_k, (-1.0, 1.0));
        report.number(key, gyro.reference_deg_c, DEG_C);
        report.numbers(key, &[gyro.gradient_rad_per_s_per_k, gyro.supply_rad_per_s_per_v], ANY);
        report.number(key, gyro.scale_asymmetry, (-0.1, 0.1));
        report.number(key, gyro.scale_curvature_s2_per_rad2, (-1.0, 1.0));
        report.number(key, gyro.delay_ticks, (0.0, 1.0));
        play(report, key, gyro.play);
    }
    for (index, accel) in accelerometers.iter().enumerate() {
        let key = nth("instrument.effects.accelerometers", index);
        report.numbers(key, &accel.position_m, (-10.0, 10.0));
        report.numbers(key, &[accel.gradient_m_per_s2_per_k, accel.supply_m_per_s2_per_v], ANY);
        report.number(key, accel.second_order_s2_per_m, (-1.0, 1.0));
        report.number(key, accel.delay_ticks, (0.0, 1.0));
        play(report, key, accel.play);
    }
}

fn node(report: &mut Report, key: Key, node: &Node) {
    report.number(key, node.time_constant_s, (0.0, 1e6));
    report.number(key, node.heating_deg_c, (-100.0, 100.0));
}

fn noise(report: &mut Report, key: Key, noise: &GyroNoise) {
    report.number(key, noise.angle_random_walk_rad_per_sqrt_s, NOT_NEGATIVE);
    report.number(key, noise.markov_drift_rad_per_s, NOT_NEGATIVE);
    if noise.markov_drift_rad_per_s > 0.0 {
        report.number(key, noise.markov_correlation_s, POSITIVE);
    }
}

fn reversal(report: &mut Report, reversal: &Reversal, tick_s: f64) {
    let of = |path| at(path);
    report.number(of("instrument.gyros.zeeman.reversal.lost_min_s"), reversal.lost_min_s, (1e-6, 1.0));
    let lost = (reversal.lost_min_s, 1.0);
    report.number(of("instrument.gyros.zeeman.reversal.lost_max_s"), reversal.lost_max_s, lost);
    if reversal.period_s.total_cmp(&0.0).is_ne() {
        let shortest_s = reversal.lost_max_s + 8.0 * tick_s;
        report.number(of("instrument.gyros.zeeman.reversal.period_s"), reversal.period_s, (shortest_s, 1e6));
    }
    let tau = reversal.servo_time_constant_s;
    report.number(of("instrument.gyros.zeeman.reversal.servo_time_constant_s"), tau, (1e-4, 1e3));
    let miss = reversal.miss_rms_wavelengths;
    report.number(of("instrument.gyros.zeeman.reversal.miss_rms_wavelengths"), miss, (0.0, 1.0));
    let curvature = reversal.dither_curvature;
    report.number(of("instrument.gyros.zeeman.reversal.dither_curvature"), curvature, (0.0, 1e4));
    let meander = reversal.meander_half_period_s;
    report.number(of("instrument.gyros.zeeman.reversal.meander_half_period_s"), meander, (0.0, 1e6));
}

fn zeeman(report: &mut Report, index: usize, gyro: &ZeemanGyro) {
    let key = nth("instrument.gyros.zeeman.gyros", index);
    node(report, key, &gyro.node);
    noise(report, key, &gyro.noise);
    report.number(key, gyro.reference_deg_c, DEG_C);
    report.number(key, gyro.scale_rad_per_count, (1e-9, 1.0));
    scale_per_k(report, key, gyro.scale_per_k);
    report.numbers(key, &gyro.bias_nonmagnetic_rad_per_s, ANY);
    report.numbers(key, &gyro.bias_magnetic_rad_per_s, ANY);
    report.numbers(key, &gyro.meander_rad_per_s, ANY);
    report.numbers(key, &gyro.dither_hz, (-1e7, 1e7));
    report.number(key, gyro.lock_in_rad_per_s, (0.0, 10.0));
}

fn fibre(report: &mut Report, index: usize, gyro: &FibreOpticGyro) {
    let key = nth("instrument.gyros.fibre_optic", index);
    let (coil, fibre) = (&gyro.coil, &gyro.fibre);
    report.number(key, f64::from(coil.layers), (4.0, 400.0));
    report.number(key, f64::from(coil.cells_per_layer), (1.0, 16.0));
    let lengths = [coil.layer_thickness_m, fibre.inner_radius_m];
    report.numbers(key, &lengths, (1e-6, 10.0));
    report.numbers(key, &[coil.conductivity_w_per_m_k, coil.heat_capacity_j_per_m3_k], POSITIVE);
    report.numbers(key, &[coil.outer_contact_w_per_m2_k, coil.inner_contact_w_per_m2_k], NOT_NEGATIVE);
    report.number(key, f64::from(fibre.turns_per_layer), (1.0, 1e5));
    report.number(key, fibre.midpoint_offset_m, (-1e3, 1e3));
    report.number(key, fibre.refractive_index, (1.0, 4.0));
    report.numbers(key, &fibre.thermo_optic_per_k, (-1.0, 1.0));
    rate_gyro(report, key, gyro.reference_deg_c, gyro.scale, gyro.scale_per_k);
    report.numbers(
        key,
        &[gyro.bias.offset_rad_per_s, gyro.bias.ripple_rad_per_s, gyro.bias.ripple_phase_rad],
        ANY,
    );
    report.number(key, gyro.bias.ripple_period_k, (1e-3, 1e6));
    noise(report, key, &gyro.noise);
}

fn mems(report: &mut Report, index: usize, gyro: &MemsGyro) {
    let key = nth("instrument.gyros.mems", index);
    node(report, key, &gyro.node);
    rate_gyro(report, key, gyro.reference_deg_c, gyro.scale, gyro.scale_per_k);
    report.numbers(key, &gyro.bias_rad_per_s, ANY);
    report.number(key, gyro.resolution_rad_per_s, NOT_NEGATIVE);
    noise(report, key, &gyro.noise);
}

fn rate_gyro(report: &mut Report, key: Key, reference_deg_c: f64, scale: f64, per_k: [f64; 2]) {
    report.number(key, reference_deg_c, DEG_C);
    report.number(key, scale, (1e-6, 1e6));
    scale_per_k(report, key, per_k);
}

fn accelerometers(report: &mut Report, block: &Accelerometers) {
    report.sensors(at("instrument.accelerometers.sensors"), block.sensors.len());
    report.orientation("instrument.accelerometers.orientation", &block.orientation, block.sensors.len());
    if let AccelerometerOutput::Counts { hz_per_v, .. } = block.output {
        report.number(at("instrument.accelerometers.output.counts.hz_per_v"), hz_per_v, POSITIVE);
    }
    for (index, sensor) in block.sensors.iter().enumerate() {
        let key = nth("instrument.accelerometers.sensors", index);
        node(report, key, &sensor.node);
        report.number(key, sensor.reference_deg_c, DEG_C);
        report.numbers(key, &sensor.scale_v_per_m_per_s2, ANY);
        report.number(key, sensor.scale_v_per_m_per_s2[0].abs(), POSITIVE);
        report.numbers(key, &sensor.bias_v, ANY);
        report.number(key, sensor.board_ratio[0], (1e-3, 1e3));
        report.numbers(key, &sensor.board_ratio[1..], (-1e-3, 1e-3));
        report.number(key, sensor.velocity_random_walk_m_per_s_per_sqrt_s, NOT_NEGATIVE);
    }
}
