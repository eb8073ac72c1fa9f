//! From corrected ticks to messages of ROS 2.

use isotherm_correction::sample::{CorrectedTick, TickFlags};
use isotherm_correction::sigma::{Causes, Sigma};
use isotherm_log::mapping::Marks;
use isotherm_log::ros2::{Header, Imu, NOT_MEASURED, time};

use crate::mapping::UnitMapping;
use crate::noise::{Noise, stated};

/// Why a tick makes no message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unstated {
    /// No calibration: its numbers have no unit of measure.
    Uncalibrated,
    /// Its time or duration is none that ROS can state.
    Time,
}

/// The message of a tick: mean rate and specific force over it, in case axes, under the stamp that the raw message had.
///
/// # Errors
/// [`Unstated`].
pub fn message(
    tick: &CorrectedTick,
    mapping: &UnitMapping,
    frame_id: String,
    noise: &Noise,
) -> Result<Imu, Unstated> {
    if tick.flags.contains(TickFlags::UNCALIBRATED) {
        return Err(Unstated::Uncalibrated);
    }
    if tick.duration.as_ns() <= 0 {
        return Err(Unstated::Time);
    }
    let marked = match mapping.time.stamp {
        Marks::End => tick.end_time,
        Marks::Start => tick.end_time - tick.duration,
    };
    let stamp = time(marked.as_ns()).ok_or(Unstated::Time)?;
    let mut imu = Imu::of_tick(Header { stamp, frame_id }, tick);
    if tick.accel_flags.is_empty() {
        // No calibrated accelerometers: the velocity is zero because there is none.
        imu.linear_acceleration = [0.0; 3].into();
        imu.linear_acceleration_covariance = NOT_MEASURED;
    }
    let duration_s = tick.duration.as_s();
    let said = |of: fn(&Sigma) -> Causes| stated(&of(tick.sigma.as_deref()?), duration_s);
    for (covariance, known) in [
        (
            &mut imu.angular_velocity_covariance,
            said(|sigma| sigma.angle).unwrap_or_else(|| noise.rate(duration_s)),
        ),
        (
            &mut imu.linear_acceleration_covariance,
            said(|sigma| sigma.velocity).unwrap_or_else(|| noise.force(duration_s)),
        ),
    ] {
        if *covariance != NOT_MEASURED {
            *covariance = known;
        }
    }
    Ok(imu)
}
