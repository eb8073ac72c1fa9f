//! Over which temperatures a calibration was fitted.

use super::Calibration;
use crate::curve::Curve;
use crate::thermal::AccelModel;

/// A range that reaches further on both sides is that of a constant, which was fitted to no temperature at all (°C).
const NO_TEMPERATURE_DEG_C: f64 = 1e6;

impl Calibration {
    /// Range of a channel's temperature (°C) over which everything that follows it was fitted: inside, the channel
    /// clamps no argument. The first end is above the second where the fitted ranges have nothing in common.
    ///
    /// `None` where nothing that follows the channel changes with temperature, or there is no such channel. An
    /// orientation that follows the mean of several channels counts for each of them.
    #[must_use]
    pub fn range_of(&self, channel: usize) -> Option<[f64; 2]> {
        let gyros = self.gyros.iter().filter(|gyro| gyro.channel == Some(channel));
        let accels = self.accels.iter().filter(|accel| accel.channel == Some(channel));
        let boards = self.accels.iter().filter(|accel| accel.board_channel == Some(channel));
        let in_motion = self.motion.iter().flat_map(|motion| motion.gyros.iter().chain(&motion.accels));
        let in_motion = in_motion.filter(|sensor| sensor.channel == Some(channel));
        let curves = (gyros.flat_map(|gyro| gyro.terms.curves_over_temperature()))
            .chain(accels.flat_map(AccelModel::curves_over_temperature))
            .chain(boards.map(|accel| &accel.board_ratio))
            .chain(in_motion.flat_map(|sensor| sensor.terms.curves_over_temperature()));
        let axes = [
            (Some(&self.gyro_orientation), &self.gyro_orientation_channels),
            (self.accel_orientation.as_ref(), &self.accel_orientation_channels),
        ];
        let axes = axes.into_iter().filter(|(_, following)| following.contains(&channel));
        let axes = axes.filter_map(|(orientation, _)| Some(orientation?.range_deg_c()));
        let fitted = curves.map(Curve::range).chain(axes);
        fitted
            .filter(|[low, high]| *low > -NO_TEMPERATURE_DEG_C || *high < NO_TEMPERATURE_DEG_C)
            .reduce(|[low, high], [from, to]| [low.max(from), high.min(to)])
    }
}
