//! How far a document would move the output of a unit at rest, and which of its entries does most of that.

use isotherm_correction::calibration::Steady;
use isotherm_correction::earth::EARTH_RATE;
use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2, SpecificForce};
use isotherm_document::{element, join, tidy};
use isotherm_protocol::control::DocumentChange;
use isotherm_protocol::document::turn_rad;

use crate::config::SwapSettings;

/// Names of the case axes.
const AXES: [char; 3] = ['x', 'y', 'z'];
/// What the keys of a sensor's scale have in them.
const SCALES: [&str; 3] = ["weight", "scale", "ratio"];
/// Parts of a sensor.
const BIAS: &str = "bias";
const SCALE: &str = "scale";
const AXIS: &str = "input axis";

/// Bias, scale and input axis of each sensor.
type Sensors<'a> = (&'a [f64], &'a [f64], &'a [[f64; 3]]);

/// Sensors of one kind: what is said of them, in which unit, and how far their output steps.
struct Kind {
    section: &'static str,
    what: &'static str,
    unit: &'static str,
    /// From SI units.
    shown: fn(f64) -> f64,
    limit: Option<f64>,
    steps: [f64; 3],
    /// Most that they sense at rest.
    input: f64,
    sensors: fn(&Steady) -> Sensors<'_>,
}

/// Each axis along which the output would jump by more than is allowed, `at` being where or when: the entry that does most of it,
/// and words.
pub(super) fn jump(
    settings: &SwapSettings,
    both: &[Steady; 2],
    changes: &[DocumentChange],
    at: &str,
) -> Vec<(String, String)> {
    let [rate_limit, force_limit] = [settings.max_jump_rad_per_s, settings.max_jump_m_per_s2];
    let Some(jump) = both[0].jump(&both[1]) else {
        let words = "has other sensors or another kind of output than the document in force: the jump of the output is \
                     unknown";
        return vec![(String::new(), words.to_owned())];
    };
    let gyros = Kind {
        section: "gyro",
        what: "the corrected angular rate about",
        unit: "°/h",
        shown: |rate| AngularRate::from_rad_per_s(rate).as_deg_per_h(),
        limit: rate_limit,
        steps: jump.angular_rate,
        input: EARTH_RATE.as_rad_per_s(),
        sensors: |of| (&of.gyro_bias, &of.gyro_weight, &of.gyro_axes),
    };
    let accels = Kind {
        section: "accel",
        what: "the corrected specific force along",
        unit: "mg",
        shown: |force| SpecificForce::from_m_per_s2(force).as_g() * 1e3,
        limit: force_limit,
        steps: jump.specific_force,
        input: STANDARD_GRAVITY_M_PER_S2,
        sensors: |of| (&of.accel_bias, &of.accel_scale, &of.accel_axes),
    };
    [gyros, accels].iter().flat_map(|kind| kind.too_far(both, changes, at)).collect()
}

impl Kind {
    fn too_far(&self, both: &[Steady; 2], changes: &[DocumentChange], at: &str) -> Vec<(String, String)> {
        let Self { section, what, unit, shown, .. } = self;
        let steps = AXES.into_iter().zip(self.steps).enumerate();
        let too_far = steps.filter(|(_, (_, step))| self.limit.is_some_and(|limit| step.abs() > limit));
        let words = too_far.map(|(axis, (name, step))| {
            let (key, most) = match self.most(both, axis).filter(|(.., share)| share.abs() > step.abs() / 2.0)
            {
                Some((sensor, part, share)) => (
                    self.entry(changes, sensor, part),
                    format!(", most of it by the {part} of {section}[{sensor}]: {:+.4} {unit}", shown(share)),
                ),
                None => Default::default(),
            };
            let (step, limit) = (shown(step), tidy(self.limit.map_or(0.0, shown)));
            (
                key,
                format!("{what} {name} would jump by {step:+.4} {unit}{at}, more than {limit} {unit}{most}"),
            )
        });
        words.collect()
    }

    /// Of which sensor which part does most along a case axis, and how much: a bias as it is, of the others the most that they can do.
    fn most(&self, both: &[Steady; 2], case_axis: usize) -> Option<(usize, &'static str, f64)> {
        let [(old_bias, old_scale, old_axes), (bias, scale, axes)] = both.each_ref().map(self.sensors);
        let parts = (0..bias.len()).filter_map(|i| {
            let along = *axes.get(i)?.get(case_axis)?;
            let scaled = (scale.get(i)? / old_scale.get(i)? - 1.0) * self.input;
            let turned = turn_rad(*old_axes.get(i)?, *axes.get(i)?) * self.input;
            // It is subtracted.
            let biased = old_bias.get(i)? - bias.get(i)?;
            Some(
                [(BIAS, biased), (SCALE, scaled), (AXIS, turned)].map(|(part, size)| (i, part, size * along)),
            )
        });
        parts.flatten().max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
    }

    /// The first entry that changes of those that a part of a sensor stands in; where none is known, the table around them.
    fn entry(&self, changes: &[DocumentChange], sensor: usize, part: &str) -> String {
        let within = match part {
            AXIS => join(self.section, "orientation"),
            _ => element(&join(self.section, "sensor"), sensor),
        };
        let is_of = |key: &str| SCALES.iter().any(|scale| key.contains(scale)) == (part == SCALE);
        let mut entries =
            changes.iter().filter(|change| change.key.starts_with(&within) && is_of(&change.key));
        entries.next().map_or(within, |change| change.key.clone())
    }
}
