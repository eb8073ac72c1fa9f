//! Checks that every part holds before it is compiled.

use alloc::vec::Vec;

use thiserror::Error;

use super::Calibration;
use super::parts::{AccelParts, CalibrationParts, GyroParts, LagParts, TrendParts};
use crate::channel::{Channel, ChannelParts, MAX_GRID_POINTS, ThermalFilter, ThermalFilterParts};
use crate::curve::{Curve, CurveError};
use crate::orientation::{Orientation, OrientationError, OrientationParts};
use crate::reversal::{Reversal, ReversalError};
use crate::sample::{MAX_SENSORS, MIN_SENSORS, OutputKind};
use crate::servo::ServoError;
use crate::thermal::{AccelModel, GyroModel, MAX_LAGS, TermError};

/// Part of the calibration in which a defect lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Section {
    /// Filter of all channels.
    Filter,
    /// The channel of this index.
    Channel(usize),
    /// The gyros as a set.
    Gyros,
    /// The gyro of this index.
    Gyro(usize),
    /// The gyros' orientation.
    GyroOrientation,
    /// The accelerometers as a set.
    Accels,
    /// The accelerometer of this index.
    Accel(usize),
    /// The accelerometers' orientation.
    AccelOrientation,
    /// The substitution over a mode switch.
    Reversal,
}

/// One thing that is wrong with a set of parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Defect {
    /// Where.
    pub section: Section,
    /// Which field of the part.
    pub field: &'static str,
    /// What.
    pub kind: DefectKind,
}

/// Kinds of wrongness.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DefectKind {
    /// Not a finite number, or outside its limits.
    #[error("is {value}, must be {low} to {high}")]
    OutOfRange {
        /// The value.
        value: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// Too few or too many.
    #[error("has {count} entries, must have {low} to {high}")]
    Count {
        /// How many there are.
        count: usize,
        /// Fewest allowed.
        low: usize,
        /// Most allowed.
        high: usize,
    },
    /// Lower limit at or above the upper one.
    #[error("runs from {low} to {high}: the first must be below the second")]
    InvertedRange {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// An index that names no channel.
    #[error("names channel {index}, but there are {channels}")]
    NoSuchChannel {
        /// The index.
        index: usize,
        /// How many channels there are.
        channels: usize,
    },
    /// Two channels of one name.
    #[error("is the name of channel {other} too: names must differ")]
    DuplicateName {
        /// Index of the earlier channel.
        other: usize,
    },
    /// Zero where a divisor or a weight is needed.
    #[error("is zero at {at} °C, must not be zero anywhere in its range")]
    Zero {
        /// Argument at which it is zero.
        at: f64,
    },
    /// A term that works on counts, for gyros with another output.
    #[error("needs gyros whose output is counts")]
    NeedsCounts,
    /// Needed because another part is there.
    #[error("is missing: {needed_by} needs it")]
    Missing {
        /// What needs it.
        needed_by: &'static str,
    },
    /// A curve is wrong.
    #[error(transparent)]
    Curve(CurveError),
    /// The orientation is wrong.
    #[error(transparent)]
    Orientation(OrientationError),
    /// The substitution is wrong.
    #[error(transparent)]
    Reversal(ReversalError),
    /// The servo transient is wrong.
    #[error(transparent)]
    Servo(ServoError),
}

/// Collects defects.
struct Checker {
    defects: Vec<Defect>,
}

impl Checker {
    fn push(&mut self, section: Section, field: &'static str, kind: DefectKind) {
        self.defects.push(Defect { section, field, kind });
    }

    fn within(&mut self, section: Section, field: &'static str, value: f64, low: f64, high: f64) {
        if !(low..=high).contains(&value) {
            self.push(section, field, DefectKind::OutOfRange { value, low, high });
        }
    }

    fn count(&mut self, section: Section, field: &'static str, count: usize, low: usize, high: usize) {
        if !(low..=high).contains(&count) {
            self.push(section, field, DefectKind::Count { count, low, high });
        }
    }

    /// A range that runs upwards and lies within limits.
    fn range(&mut self, section: Section, field: &'static str, [from, to]: [f64; 2], low: f64, high: f64) {
        if from >= to {
            self.push(section, field, DefectKind::InvertedRange { low: from, high: to });
        }
        for end in [from, to] {
            self.within(section, field, end, low, high);
        }
    }

    fn channel(&mut self, section: Section, field: &'static str, index: Option<usize>, channels: usize) {
        if let Some(index) = index
            && index >= channels
        {
            self.push(section, field, DefectKind::NoSuchChannel { index, channels });
        }
    }
}

/// Largest finite magnitude that a coefficient may have: far beyond any instrument, safe to multiply.
const HUGE: f64 = 1e100;

/// Validates and compiles.
pub(super) fn compile(parts: &CalibrationParts) -> Result<Calibration, Vec<Defect>> {
    let mut checker = Checker { defects: Vec::new() };
    check_filter(&mut checker, &parts.filter);
    let filter = ThermalFilter::new(&parts.filter);
    check_channels(&mut checker, &parts.channels);
    let channels = parts.channels.len();

    checker.count(Section::Gyros, "sensors", parts.gyros.len(), MIN_SENSORS, MAX_SENSORS);
    let gyros = parts
        .gyros
        .iter()
        .enumerate()
        .filter_map(|(i, gyro)| gyro_model(&mut checker, i, gyro, &filter, parts));
    let gyros: Vec<_> = gyros.collect();
    let gyro_orientation = orientation(
        &mut checker,
        Section::GyroOrientation,
        &parts.gyro_orientation,
        &parts.gyro_orientation_channels,
        parts.gyros.len(),
        channels,
    );

    let mut accels = Vec::new();
    if !parts.accels.is_empty() {
        checker.count(Section::Accels, "sensors", parts.accels.len(), MIN_SENSORS, MAX_SENSORS);
        accels = parts
            .accels
            .iter()
            .enumerate()
            .filter_map(|(i, accel)| accel_model(&mut checker, i, accel, channels))
            .collect();
        if parts.accel_orientation.is_none() {
            checker.push(Section::AccelOrientation, "rows", DefectKind::Missing { needed_by: "accel" });
        }
    }
    let accel_orientation = parts.accel_orientation.as_ref().and_then(|orientation_parts| {
        orientation(
            &mut checker,
            Section::AccelOrientation,
            orientation_parts,
            &parts.accel_orientation_channels,
            parts.accels.len(),
            channels,
        )
    });
    let reversal = match parts.reversal.as_ref().map(Reversal::new) {
        None => None,
        Some(Ok(reversal)) => Some(reversal),
        Some(Err(errors)) => {
            for error in errors {
                checker.push(Section::Reversal, reversal_field(&error), DefectKind::Reversal(error));
            }
            None
        }
    };
    match gyro_orientation {
        Some(gyro_orientation) if checker.defects.is_empty() => Ok(Calibration {
            filter,
            channels: parts.channels.iter().cloned().map(Channel).collect(),
            gyro_output: parts.gyro_output,
            gyros,
            gyro_orientation,
            gyro_orientation_channels: parts.gyro_orientation_channels.clone(),
            accel_output: parts.accel_output,
            accels,
            accel_orientation,
            accel_orientation_channels: parts.accel_orientation_channels.clone(),
            reversal,
        }),
        _ => Err(checker.defects),
    }
}

fn check_filter(checker: &mut Checker, filter: &ThermalFilterParts) {
    let section = Section::Filter;
    checker.within(section, "grid_step_s", filter.grid_step_s, 1e-3, 3600.0);
    #[expect(clippy::cast_precision_loss, reason = "a small constant")]
    let longest = filter.grid_step_s * MAX_GRID_POINTS as f64;
    checker.within(section, "smoothing_s", filter.smoothing_s, 0.0, longest);
    checker.within(section, "derivative_step_s", filter.derivative_step_s, 0.0, longest);
    // Bounded in grid steps too: a reading after a silence walks over all of them at once.
    checker.within(
        section,
        "stale_after_s",
        filter.stale_after_s,
        filter.grid_step_s,
        1e4 * filter.grid_step_s,
    );
    checker.within(section, "assumed_deg_c", filter.assumed_deg_c, -273.15, 1000.0);
    checker.within(section, "branch_dead_band", filter.branch_dead_band, f64::MIN_POSITIVE, HUGE);
}

fn check_channels(checker: &mut Checker, channels: &[ChannelParts]) {
    for (i, channel) in channels.iter().enumerate() {
        let section = Section::Channel(i);
        if let Some(other) = channels.iter().take(i).position(|earlier| earlier.name == channel.name) {
            checker.push(section, "name", DefectKind::DuplicateName { other });
        }
        checker.count(section, "conversion", channel.conversion.len(), 1, 8);
        for &a in &channel.conversion {
            checker.within(section, "conversion", a, -HUGE, HUGE);
        }
        checker.range(section, "range", channel.range_deg_c, -HUGE, HUGE);
        checker.within(section, "spike_limit", channel.spike_limit_deg_c, f64::MIN_POSITIVE, HUGE);
    }
}

fn gyro_model(
    checker: &mut Checker,
    index: usize,
    gyro: &GyroParts,
    filter: &ThermalFilter,
    parts: &CalibrationParts,
) -> Option<GyroModel> {
    let section = Section::Gyro(index);
    checker.channel(section, "channel", gyro.channel, parts.channels.len());
    checker.within(section, "increment_weight", gyro.increment_weight.abs(), f64::MIN_POSITIVE, HUGE);
    checker.within(section, "input_limit", gyro.input_limit, f64::MIN_POSITIVE, HUGE);
    checker.count(section, "lags", gyro.lags.len(), 0, MAX_LAGS);
    for LagParts { time_constant_s, .. } in &gyro.lags {
        checker.within(section, "lags.time_constant_s", *time_constant_s, parts.filter.grid_step_s, 1e7);
    }
    if let Some(TrendParts { coefficients, interval_s }) = &gyro.trend {
        checker.count(section, "trend.coefficients", coefficients.len(), 1, 3);
        for &c in coefficients {
            checker.within(section, "trend.coefficients", c, -HUGE, HUGE);
        }
        checker.range(section, "trend.interval_s", *interval_s, 0.0, 1e9);
    }
    if gyro.servo.is_some() && parts.reversal.is_none() {
        checker.push(
            Section::Reversal,
            "transition_ticks",
            DefectKind::Missing { needed_by: "the gyros' servo term" },
        );
    }
    if gyro.servo.is_some() && parts.gyro_output != OutputKind::Counts {
        checker.push(section, "servo", DefectKind::NeedsCounts);
    }
    GyroModel::new(gyro, filter, &mut |field, error| {
        checker.push(
            section,
            field,
            match error {
                TermError::Curve(error) => DefectKind::Curve(error),
                TermError::Servo(error) => DefectKind::Servo(error),
            },
        );
    })
}

fn accel_model(
    checker: &mut Checker,
    index: usize,
    accel: &AccelParts,
    channels: usize,
) -> Option<AccelModel> {
    let section = Section::Accel(index);
    checker.channel(section, "channel", accel.channel, channels);
    checker.channel(section, "board_channel", accel.board_channel, channels);
    if accel.board_channel.is_none() && accel.board_ratio.is_some() {
        checker.push(section, "board_channel", DefectKind::Missing { needed_by: "board_ratio" });
    }
    checker.within(section, "input_limit", accel.input_limit, f64::MIN_POSITIVE, HUGE);
    let model =
        AccelModel::new(accel, &mut |field, error| checker.push(section, field, DefectKind::Curve(error)))?;
    if let Some(at) = sign_change(&model.scale_factor) {
        checker.push(section, "scale_factor", DefectKind::Zero { at });
    }
    Some(model)
}

/// First place on a grid over the curve's range where it is zero or has changed its sign.
fn sign_change(curve: &Curve) -> Option<f64> {
    let [low, high] = curve.range();
    let first = curve.at(low).value;
    (0..=256).map(|i| low + (high - low) * f64::from(i) / 256.0).find(|&x| {
        let same_sign = curve.at(x).value * first;
        same_sign.is_nan() || same_sign <= 0.0
    })
}

fn orientation(
    checker: &mut Checker,
    section: Section,
    parts: &OrientationParts,
    following: &[usize],
    sensors: usize,
    channels: usize,
) -> Option<Orientation> {
    checker.count(section, "rows", parts.rows.len(), sensors, sensors);
    for &index in following {
        checker.channel(section, "channels", Some(index), channels);
    }
    match Orientation::new(parts) {
        Ok(orientation) => Some(orientation),
        Err(errors) => {
            for error in errors {
                checker.push(section, orientation_field(&error), DefectKind::Orientation(error));
            }
            None
        }
    }
}

/// Field of the parts that an orientation error speaks of.
fn orientation_field(error: &OrientationError) -> &'static str {
    match error {
        OrientationError::ListCount { name, .. } | OrientationError::NotFinite { name, .. } => name,
        OrientationError::WeightNotPositive { .. } | OrientationError::WeightRatio { .. } => "weights",
        OrientationError::EmptyRange { .. } => "range_deg_c",
        OrientationError::ParityLimit { .. } => "parity_limit",
        OrientationError::ParityConfirm => "parity_confirm_ticks",
        _ => "rows",
    }
}

/// Field of the parts that a substitution error speaks of.
fn reversal_field(error: &ReversalError) -> &'static str {
    match error {
        ReversalError::OutOfRange { name, .. } | ReversalError::DegreeNeedsReadings { name, .. } => name,
    }
}
