//! Standard errors, in SI.

use isotherm_correction::sigma::{BiasSigma, MAX_BIAS_TERMS, SigmaParts};

use super::super::measure::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, HOUR, PPM};
use super::super::types::{AccelSensor, GyroSensor};

/// √s in √h.
const SQRT_HOUR: f64 = 60.0;
const _: () = assert!(SQRT_HOUR * SQRT_HOUR == HOUR);

/// Those of a gyro; what its table leaves out, its drift states.
pub(super) fn of_gyro(sensor: &GyroSensor) -> Option<SigmaParts> {
    let stated = sensor.sigma.as_ref()?;
    let drift = sensor.drift.as_ref();
    let walk =
        stated.angle_random_walk_deg_per_sqrt_h.or(drift.map(|drift| drift.angle_random_walk_deg_per_sqrt_h));
    let bias = stated
        .bias
        .as_ref()
        .map(|bias| (bias.reference_deg_c, &*bias.sigma_deg_per_h, &bias.correlation_ratio));
    let of_drift = drift.map(|drift| {
        let [constant, markov] = [drift.initial_sigma_deg_per_h, drift.sigma_deg_per_h];
        (constant * constant + markov * markov).sqrt() * DEG_PER_H
    });
    Some(SigmaParts {
        random_walk: walk.map(|walk| walk * DEG_PER_SQRT_H),
        quantisation: stated.quantisation_arcsec.map(|arcsec| arcsec * ARCSEC),
        instability: stated.bias_instability_deg_per_h.unwrap_or_default() * DEG_PER_H,
        rate_random_walk: stated.rate_random_walk_deg_per_h_per_sqrt_h.unwrap_or_default() * DEG_PER_H
            / SQRT_HOUR,
        bias: bias.map(|bias| to_bias(bias, DEG_PER_H)).or(of_drift.map(|sigma| BiasSigma {
            reference_deg_c: 0.0,
            sigma: [sigma].into_iter().collect(),
            correlation: [].into_iter().collect(),
        })),
        scale: stated.increment_weight_ppm.map(|ppm| ppm * PPM),
        misalignment: stated.misalignment_arcsec.map(|arcsec| arcsec * ARCSEC),
        clamping_per_deg_c: stated.clamping_deg_per_h_per_deg_c.map(|sigma| sigma * DEG_PER_H),
    })
}

/// Those of an accelerometer.
pub(super) fn of_accel(sensor: &AccelSensor) -> Option<SigmaParts> {
    let stated = sensor.sigma.as_ref()?;
    let bias = stated
        .bias
        .as_ref()
        .map(|bias| (bias.reference_deg_c, &*bias.sigma_m_per_s2, &bias.correlation_ratio));
    Some(SigmaParts {
        random_walk: stated.velocity_random_walk_m_per_s_per_sqrt_h.map(|walk| walk / SQRT_HOUR),
        quantisation: stated.quantisation_m_per_s,
        instability: stated.bias_instability_m_per_s2.unwrap_or_default(),
        rate_random_walk: stated.acceleration_random_walk_m_per_s2_per_sqrt_h.unwrap_or_default() / SQRT_HOUR,
        bias: bias.map(|bias| to_bias(bias, 1.0)),
        scale: stated.scale_factor_ppm.map(|ppm| ppm * PPM),
        misalignment: stated.misalignment_arcsec.map(|arcsec| arcsec * ARCSEC),
        clamping_per_deg_c: stated.clamping_m_per_s2_per_deg_c,
    })
}

/// A row that is not as long as there are σ becomes one that the core refuses.
fn to_bias((reference_deg_c, sigma, rows): (f64, &[f64], &Vec<Vec<f64>>), unit: f64) -> BiasSigma {
    let row = |row: &Vec<f64>| {
        let fits = row.len() == sigma.len();
        std::array::from_fn(|i| if fits { row.get(i).copied().unwrap_or_default() } else { f64::NAN })
    };
    BiasSigma {
        reference_deg_c,
        sigma: sigma.iter().take(MAX_BIAS_TERMS).map(|sigma| sigma * unit).collect(),
        correlation: rows.iter().take(MAX_BIAS_TERMS).map(row).collect(),
    }
}
