//! Readings in another unit of measure than the mapping or the document says: scale factors that are found tell.

use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2 as G;
use isotherm_protocol::document::AccelOutput;

use crate::axes::sensor_name;
use crate::numbers::real;
use crate::report::short;

/// Times that a scale factor may be away from what is stated, and one sensor's from another's: beyond it, it is another unit of
/// measure. Nominal scale factors are off by less.
const LARGEST_RATIO: f64 = 1.5;
/// How near the logarithm of a factor is to that of a unit of measure: scale factors are nominal.
const NEAR: f64 = 0.35;
/// How near one a scale factor is that is no more than an error (a share).
const NEAR_ONE: f64 = 0.25;
/// Degrees in a radian, which names those of gyros.
const DEG: f64 = 180.0 / std::f64::consts::PI;

/// How many times too large readings are by which mistake.
const OF_ACCELEROMETERS: [(f64, &str); 5] = [
    (1.0 / G, "as for readings in g taken as m/s²"),
    (G, "as for m/s² multiplied by g again"),
    (1000.0 / G, "as for readings in mg (or cm/s²) taken as m/s²"),
    (1.0 / 0.3048, "as for ft/s² taken as m/s²"),
    (1.0 / (1000.0 * G), "as for readings in thousands of g"),
];
const OF_GYROS: [(f64, &str); 5] = [
    (DEG, "as for °/s taken as rad/s"),
    (1.0 / DEG, "as for rad/s taken as °/s"),
    (3600.0, "as for °/h taken as °/s"),
    (3600.0 * DEG, "as for °/h taken as rad/s"),
    (1.0 / 3600.0, "as for °/s taken as °/h"),
];

/// What the scale factors of accelerometers (output per specific force), found and stated, tell of their unit of measure, in words.
pub fn accelerometers(output: AccelOutput, found: &[f64], stated: &[f64]) -> Vec<String> {
    let times: Vec<f64> = found.iter().zip(stated).map(|(found, stated)| (found / stated).abs()).collect();
    // Scale factors that are all one hold the place of what is to be found.
    let placeholder = stated.iter().all(|k| (k - 1.0).abs() <= 1e-9);
    let told = output == AccelOutput::MetresPerSecondSquared || !placeholder;
    let hint = "readings of a converter are neither V nor m/s²: map them as \"raw\" and leave --accelerometer-unit at V, or state \
                their scale in the mapping";
    let of_all = || all("accelerometer", &times, &OF_ACCELEROMETERS, hint).filter(|_| told);
    let other = apart("accelerometer", &times).or_else(of_all);
    let near = found.iter().all(|k| (k - 1.0).abs() < NEAR_ONE);
    let already = (output == AccelOutput::Volts && placeholder && near).then(|| {
        "accelerometers: 1 V of the log is about 1 m/s²: it is already in m/s²; state --accelerometer-unit m/s2, \
         otherwise the document has V"
            .to_owned()
    });
    other.into_iter().chain(already).collect()
}

/// The same of gyros (true rate per stated rate).
pub fn gyros(found: &[f64], stated: &[f64]) -> Option<String> {
    let times: Vec<f64> = found.iter().zip(stated).map(|(found, stated)| (stated / found).abs()).collect();
    let hint = "check their unit and scale in the mapping, and the range they were set to";
    apart("gyro", &times).or_else(|| all("gyro", &times, &OF_GYROS, hint))
}

/// Sensors that are far from the others of theirs: one column in another unit. `times` is how many times too large the readings of each
/// are by what is stated.
fn apart(kind: &str, times: &[f64]) -> Option<String> {
    let size = |sensor: &usize| times[*sensor];
    let most = (0..times.len()).max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let least = (0..times.len()).min_by(|a, b| size(a).total_cmp(&size(b)))?;
    let ratio = size(&most) / size(&least);
    (ratio > LARGEST_RATIO).then(|| {
        format!(
            "{kind} {} and {kind} {}: their readings are {} and {} times those of the document, or else the log, \
             {} times apart: check the unit of measure of each column in the mapping",
            sensor_name(most, times.len()),
            sensor_name(least, times.len()),
            short(size(&most)),
            short(size(&least)),
            short(ratio),
        )
    })
}

/// All sensors far from what is stated: by one of the mistakes that such sensors know, or else with what to do.
fn all(kind: &str, times: &[f64], mistakes: &[(f64, &str)], hint: &str) -> Option<String> {
    let logs: f64 = times.iter().map(|times| libm::log(*times)).sum();
    let mean = libm::exp(logs / real(times.len()));
    let away = |factor: f64| libm::log(mean / factor).abs();
    let (factor, mistake) = mistakes.iter().min_by(|a, b| away(a.0).total_cmp(&away(b.0)))?;
    let [mistake, hint] = if away(*factor) < NEAR {
        [*mistake, "correct the unit of measure in the mapping"]
    } else {
        ["as for no usual unit of measure", hint]
    };
    (mean.is_finite() && !(1.0 / LARGEST_RATIO..=LARGEST_RATIO).contains(&mean)).then(|| {
        format!(
            "{kind}s: their readings are {} times those of the document, or else the log, {mistake}: {hint}. The new document \
             has the fitted scale factors, for logs with this mapping",
            short(mean)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use isotherm_protocol::document::AccelOutput::{MetresPerSecondSquared, Volts};

    #[test]
    fn scale_factors_tell_the_unit_of_measure() {
        let accel = |output, found: f64, stated: f64| {
            let found = [found * 1.02, found * 0.97, found * 1.01];
            accelerometers(output, &found, &[stated; 3]).pop()
        };
        assert_eq!(accel(MetresPerSecondSquared, 1.2, 1.0), None);
        assert_eq!(accel(Volts, 414.0, 1.0), None, "nothing is stated");
        let gyros = |found: [f64; 3], stated| gyros(&found, &[stated; 3]);
        assert_eq!(gyros([1.309, -1.312, 1.311], 1.0), None);
        let told = [
            accel(MetresPerSecondSquared, 0.102, 1.0),
            accel(MetresPerSecondSquared, 9.8, 1.0),
            accel(MetresPerSecondSquared, 102.0, 1.0),
            accel(MetresPerSecondSquared, 2.2, 1.0),
            accel(MetresPerSecondSquared, 414.0, 1.0),
            accel(Volts, 4060.0, 414.0),
            accelerometers(Volts, &[414.0, 828.0, 412.0], &[1.0; 3]).pop(),
            gyros([0.0302; 3], 1.0),
            gyros([0.0229; 3], 1.0),
            gyros([6.5; 3], 1.3),
            gyros([1.3, 75.0, 1.3], 1.0),
        ];
        insta::assert_snapshot!(told.map(Option::unwrap).join("\n"));
    }

    #[test]
    fn a_log_in_metres_per_second_squared_is_not_called_v() {
        let told = |output, found: [f64; 3]| accelerometers(output, &found, &[1.0; 3]).len();
        assert_eq!(told(Volts, [1.02, 0.97, 1.01]), 1);
        assert_eq!(told(Volts, [0.102, 0.103, 0.101]), 0);
        assert_eq!(told(MetresPerSecondSquared, [1.0; 3]), 0);
    }
}
