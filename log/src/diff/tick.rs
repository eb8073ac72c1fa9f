//! Two corrected ticks side by side.

use isotherm_correction::sample::{CorrectedTick, LasingMode, SensorFlags};
use isotherm_correction::units::{AngularRate, SpecificForce};
use isotherm_protocol::corrected::SigmaRun;
use serde::Serialize;

use crate::offline::rows::mode_cell;

/// A corrected tick of a log, and what the log says of the calibration that made it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LogTick {
    /// The tick.
    pub tick: CorrectedTick,
    /// Head of the SHA-256 of the calibration document; `None` where the log does not have it. It says who made the tick and
    /// is no part of it: the same increments by two documents are the same tick.
    pub digest: Option<[u8; 8]>,
    /// What the journal says happened right before it, in words.
    pub event: Option<Box<str>>,
}

/// How much two numbers may differ and still count as equal; nothing by default.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Tolerance {
    /// Of an angle increment (rad); parity residuals of the gyros, over the tick, likewise.
    pub angle_rad: f64,
    /// Of a velocity increment (m/s); parity residuals of the accelerometers likewise.
    pub velocity_m_per_s: f64,
    /// Of the larger of the two, for every number that is not whole.
    pub relative: f64,
}

impl Tolerance {
    fn allows(&self, a: f64, b: f64, absolute: f64) -> bool {
        // Also where both are the same infinity, or the same not-a-number to the bit.
        if a.to_bits() == b.to_bits() {
            return true;
        }
        let limit = absolute.max(self.relative * a.abs().max(b.abs()));
        limit > 0.0 && (a - b).abs() <= limit
    }
}

/// One field in which two ticks differ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldDifference {
    /// Name, as the column of the CSV; of several sensors with the number from 1.
    pub field: String,
    /// In the first log, as the shortest number that reads back to the same bits.
    pub a: String,
    /// In the second.
    pub b: String,
    /// Bits of the number in the first log, where it is one that is not whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a_bits: Option<String>,
    /// Bits in the second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub b_bits: Option<String>,
    /// Second less first as a rate (°/h) or specific force (mg) over the tick.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equivalent: Option<Equivalent>,
}

/// A difference as people at a test bench think of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Equivalent {
    /// Angular rate (°/h).
    DegPerH(f64),
    /// Specific force (mg).
    MilliG(f64),
}

/// Names of the axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// Every field in which two ticks differ by more than is allowed.
#[must_use]
pub fn differences(a: &LogTick, b: &LogTick, tolerance: &Tolerance) -> Vec<FieldDifference> {
    let mut found = Found { fields: Vec::new(), tolerance };
    let (a, b) = (&a.tick, &b.tick);
    found.plain("sequence", a.sequence, b.sequence);
    found.plain("end_time_ns", a.end_time.as_ns(), b.end_time.as_ns());
    found.plain("duration_ns", a.duration.as_ns(), b.duration.as_ns());
    found.plain("ticks", a.ticks, b.ticks);
    found.plain("missed", a.missed, b.missed);
    let seconds = a.duration.as_s();
    let rate = |difference: f64| Equivalent::DegPerH(AngularRate::from_rad_per_s(difference).as_deg_per_h());
    let force = |difference: f64| Equivalent::MilliG(SpecificForce::from_m_per_s2(difference).as_g() * 1e3);
    for (axis, (a, b)) in AXES.iter().zip(a.delta_angle.iter().zip(b.delta_angle)) {
        let name = || format!("delta_angle_{axis}_rad");
        found.number(name, (*a, b), tolerance.angle_rad, &|d| rate(d / seconds));
    }
    for (axis, (a, b)) in AXES.iter().zip(a.delta_velocity.iter().zip(b.delta_velocity)) {
        let name = || format!("delta_velocity_{axis}_m_per_s");
        found.number(name, (*a, b), tolerance.velocity_m_per_s, &|d| force(d / seconds));
    }
    found.plain("mode", mode(a.mode), mode(b.mode));
    found.words("flags", a.flags, b.flags, |flags| words(flags.iter_names()));
    found.sensors("gyro_flags", &a.gyro_flags, &b.gyro_flags);
    found.sensors("accel_flags", &a.accel_flags, &b.accel_flags);
    found.numbers(
        "gyro_parity",
        "rad_per_s",
        (&a.gyro_parity, &b.gyro_parity),
        tolerance.angle_rad / seconds,
        &rate,
    );
    let limit = tolerance.velocity_m_per_s / seconds;
    found.numbers("accel_parity", "m_per_s2", (&a.accel_parity, &b.accel_parity), limit, &force);
    found.plain("revision", a.revision, b.revision);
    if a.sigma.is_some() || b.sigma.is_some() {
        found.words("sigma", SigmaRun::of([a]), SigmaRun::of([b]), |runs| match &*runs {
            [run] => format!("{:?} rad, {:?} m/s", run.sigma().angle.all(), run.sigma().velocity.all()),
            _ => "none".to_owned(),
        });
    }
    found.fields
}

/// Whether two ticks are the same, bit for bit, whichever document made them.
#[must_use]
pub fn identical(a: &LogTick, b: &LogTick) -> bool {
    differences(a, b, &Tolerance::default()).is_empty()
}

/// Differences being gathered.
struct Found<'t> {
    fields: Vec<FieldDifference>,
    tolerance: &'t Tolerance,
}

impl Found<'_> {
    fn plain<T: PartialEq + ToString>(&mut self, field: &str, a: T, b: T) {
        self.words(field, a, b, |value| value.to_string());
    }

    fn words<T: PartialEq>(&mut self, field: &str, a: T, b: T, words: impl Fn(T) -> String) {
        if a != b {
            let (a, b) = (words(a), words(b));
            let field = field.to_owned();
            self.fields.push(FieldDifference { field, a, b, a_bits: None, b_bits: None, equivalent: None });
        }
    }

    fn number(
        &mut self,
        field: impl Fn() -> String,
        (a, b): (f64, f64),
        absolute: f64,
        equivalent: &dyn Fn(f64) -> Equivalent,
    ) {
        if self.tolerance.allows(a, b, absolute) {
            return;
        }
        let bits = |value: f64| Some(format!("{:#018x}", value.to_bits()));
        let difference = b - a;
        self.fields.push(FieldDifference {
            field: field(),
            a: format!("{a:?}"),
            b: format!("{b:?}"),
            a_bits: bits(a),
            b_bits: bits(b),
            equivalent: difference.is_finite().then(|| equivalent(difference)),
        });
    }

    fn numbers(
        &mut self,
        field: &str,
        unit_of_measure: &str,
        (a, b): (&[f64], &[f64]),
        absolute: f64,
        equivalent: &dyn Fn(f64) -> Equivalent,
    ) {
        self.lengths(field, a.len(), b.len());
        for (number, pair) in (1..).zip(a.iter().copied().zip(b.iter().copied())) {
            self.number(|| format!("{field}_{number}_{unit_of_measure}"), pair, absolute, equivalent);
        }
    }

    /// Nothing is put into words where ticks are the same: most are.
    fn lengths(&mut self, field: &str, a: usize, b: usize) {
        if a != b {
            self.plain(&format!("{field} (number of)"), a, b);
        }
    }

    fn sensors(&mut self, field: &str, a: &[SensorFlags], b: &[SensorFlags]) {
        self.lengths(field, a.len(), b.len());
        for (number, (a, b)) in (1..).zip(a.iter().zip(b)) {
            if a != b {
                self.words(&format!("{field}_{number}"), *a, *b, |flags| words(flags.iter_names()));
            }
        }
    }
}

/// Names of flags; "none" without any.
pub(super) fn words<'n, F>(names: impl Iterator<Item = (&'n str, F)>) -> String {
    let names: Vec<_> = names.map(|(name, _)| name).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(" ") }
}

/// A lasing mode, for people.
#[must_use]
pub fn mode(mode: Option<LasingMode>) -> &'static str {
    if mode.is_none() { "none" } else { mode_cell(mode) }
}
