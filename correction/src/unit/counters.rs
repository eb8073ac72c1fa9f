//! What a unit has counted since it appeared.

use crate::counting::counters;

counters! {
    /// Counters of one unit; they only ever grow.
    Counters {
        /// Raw gyro ticks received, whatever became of them.
        gyro_ticks_in,
        /// Raw accelerometer ticks received, whatever became of them.
        accel_ticks_in,
        /// Temperature readings received, whatever became of them.
        temperature_readings_in,
        /// Corrected ticks given out (raw ticks, where they are summed to navigation steps).
        ticks_out,
        /// Gaps announced.
        gaps,
        /// Raw gyro ticks announced as missing in those gaps.
        ticks_missed,
        /// Gyro ticks that had been taken before.
        gyro_duplicates,
        /// Gyro ticks that came after their gap had been announced.
        gyro_late,
        /// Gyro ticks refused: sequence and time contradict what came before.
        gyro_implausible,
        /// Restarts of the producer's sequence or clock that were followed.
        restarts,
        /// Ticks refused: another number of sensors than the calibration has.
        wrong_sensor_count,
        /// Ticks refused: counts where the calibration says means, or the reverse.
        wrong_output_kind,
        /// Ticks refused: duration zero or beyond ten seconds.
        bad_duration,
        /// Gyro ticks released without waiting because too many were pending.
        pending_overflow,
        /// Accelerometer ticks that had been taken before.
        accel_duplicates,
        /// Accelerometer ticks that came after their gyro tick had gone.
        accel_late,
        /// Accelerometer ticks dropped because no gyro tick ended with them.
        accel_unpaired,
        /// Corrected ticks without an accelerometer tick.
        accel_missing,
        /// Temperature readings that came after ticks which should have felt them; applied from the next tick on.
        temperature_late,
        /// Temperature readings not newer than the channel's last one.
        temperature_out_of_order,
        /// Temperature readings rejected: not finite, out of range, or a spike.
        temperature_rejected,
        /// Temperature readings of a channel that the calibration does not have.
        temperature_unknown_channel,
        /// Temperature readings dropped because too many were waiting to take effect.
        temperature_overflow,
        /// Sensor readings that were not finite.
        not_finite_readings,
        /// Sensor readings at or beyond the input range.
        overrange_readings,
        /// Sensors excluded by the parity check.
        sensors_excluded,
        /// Ticks predicted over a mode switch.
        ticks_interpolated,
        /// Mode switches whose angle was restored.
        switches_restored,
        /// Mode switches that could not be bridged from both sides.
        switches_unresolved,
        /// Ticks after a mode switch without the half-period counts that the servo's transient is taken from.
        servo_unmeasured,
        /// Ticks withheld: no running state, or no calibration where the unit holds back without one.
        ticks_held,
    }
}
