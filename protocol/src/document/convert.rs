//! Document → the core's parts: names become indices, the file's units become SI.

mod sigma;

use isotherm_correction::calibration::{
    AccelParts, CalibrationParts, EVERYWHERE_DEG_C, GyroParts, NO_LIMIT, Source, TermParts, TrendParts,
};
use isotherm_correction::channel::{ChannelParts, ThermalFilterParts};
use isotherm_correction::drift::DriftParts;
use isotherm_correction::operation::{SelfTestCounter, SelfTestParts, SelfTestVoltage};
use isotherm_correction::orientation::{AxesPlay, OrientationParts};
use isotherm_correction::reversal::{FitWindow as CoreFitWindow, ReversalParts};
use isotherm_correction::sample::{ChannelName, MAX_CHANNEL_NAME, OutputKind};
use isotherm_correction::servo::{ServoForm, ServoParts};

use super::measure::{ARCSEC, DEG_PER_H, DEG_PER_S, DEG_PER_SQRT_H, HOUR};
use super::terms::{SensorKind, Terms};
use super::types::{
    AccelOutput, AccelSensor, Auxiliary, AxesHysteresis, Channel, Document, Drift, Filter, FitWindow,
    GyroOutput, GyroSensor, ModeReversal, Orientation, SelfTest, Servo, ServoKind, Trend,
};

/// Half width of the blend where no term is branched (°C²/s³): any positive number.
const NO_BRANCHES: f64 = 1.0;
/// Filter of a unit without temperature channels: never run.
const NO_FILTER: Filter = Filter {
    grid_step_s: 1.0,
    smoothing_s: 0.0,
    derivative_step_s: 1.0,
    stale_after_s: 1.0,
    branch_dead_band_deg_c2_per_s3: None,
};

impl Document {
    /// The core's parts, in SI. A channel name that is not in the document becomes an index that the core refuses.
    #[must_use]
    pub fn to_parts(&self) -> CalibrationParts {
        let temperature = &self.temperature;
        let accel = self.accel.as_ref();
        let gyro_parity = self.gyro.orientation.parity.as_ref();
        let gyro_parity =
            gyro_parity.map(|parity| (parity.limit_deg_per_h * DEG_PER_H, parity.confirm_ticks));
        let (gyro_orientation, gyro_orientation_channels) =
            self.orientation(&self.gyro.orientation, gyro_parity);
        let accel_orientation = accel.map(|accel| {
            let parity = accel.orientation.parity.as_ref();
            let parity = parity.map(|parity| (parity.limit_m_per_s2, parity.confirm_ticks));
            self.orientation(&accel.orientation, parity)
        });
        let (accel_orientation, accel_orientation_channels) = accel_orientation.unzip();
        CalibrationParts {
            filter: temperature.filter.as_ref().unwrap_or(&NO_FILTER).to_parts(temperature.assumed_deg_c),
            channels: temperature.channel.iter().map(Channel::to_parts).collect(),
            auxiliaries: self.auxiliary.iter().map(auxiliary).collect(),
            gyro_output: match self.gyro.output {
                GyroOutput::Counts => OutputKind::Counts,
                GyroOutput::Mean => OutputKind::Mean,
            },
            gyros: self.gyro.sensor.iter().map(|sensor| self.gyro_parts(sensor)).collect(),
            gyro_orientation,
            gyro_orientation_channels,
            accel_output: match accel.map(|accel| accel.output) {
                Some(AccelOutput::Counts) => OutputKind::Counts,
                _ => OutputKind::Mean,
            },
            accels: accel
                .map_or_else(Vec::new, |accel| accel.sensor.iter().map(|s| self.accel_parts(s)).collect()),
            accel_orientation,
            accel_orientation_channels: accel_orientation_channels.unwrap_or_default(),
            reversal: self.mode_reversal.as_ref().map(reversal),
            self_test: self.self_test.as_ref().map(self_test).unwrap_or_default(),
        }
    }

    /// Index of a channel by its name; one that is too large where there is none of the name.
    fn channel_index(&self, name: &str) -> usize {
        self.temperature.channel.iter().position(|channel| channel.name == name).unwrap_or(usize::MAX)
    }

    /// The core's parts of an orientation with this limit and number of ticks for parity, and the channels that it follows.
    fn orientation<P>(
        &self,
        Orientation { rows, weights, thermal, .. }: &Orientation<P>,
        parity: Option<(f64, u32)>,
    ) -> (OrientationParts, Vec<usize>) {
        let thermal = thermal.as_ref();
        let each = || thermal.into_iter();
        let slopes = each().flat_map(|thermal| &thermal.slopes_arcsec_per_deg_c);
        let parts = OrientationParts {
            reference_deg_c: thermal.map_or(0.0, |thermal| thermal.reference_deg_c),
            rows: rows.clone(),
            slopes_per_deg_c: slopes.map(|row| row.map(|slope| slope * ARCSEC)).collect(),
            plays: each().flat_map(|thermal| &thermal.hysteresis).map(play).collect(),
            weights: weights.clone().unwrap_or_default(),
            range_deg_c: thermal.map_or(EVERYWHERE_DEG_C, |thermal| thermal.range_deg_c),
            parity_limit: parity.map(|(limit, _)| limit),
            parity_confirm_ticks: parity.map_or(1, |(_, ticks)| ticks),
        };
        (parts, each().flat_map(|thermal| &thermal.channels).map(|name| self.channel_index(name)).collect())
    }

    fn term_parts<K: SensorKind>(&self, terms: &Terms<K>) -> Vec<TermParts> {
        let auxiliary = |name: &str| self.auxiliary.iter().position(|channel| channel.name == name);
        let source = |name: &str| {
            auxiliary(name).map_or_else(|| Source::Temperature(self.channel_index(name)), Source::Auxiliary)
        };
        terms.iter().map(|term| term.to_parts(source)).collect()
    }

    fn gyro_parts(&self, sensor: &GyroSensor) -> GyroParts {
        let (increment_weight, input_limit) = match self.gyro.output {
            GyroOutput::Counts => (
                sensor.increment_weight_arcsec_per_count.map(|weight| weight * ARCSEC),
                sensor.input_limit_counts_per_tick,
            ),
            GyroOutput::Mean => (
                sensor.increment_weight_rad_per_rad,
                sensor.input_limit_deg_per_s.map(|limit| limit * DEG_PER_S),
            ),
        };
        GyroParts {
            channel: sensor.channel.as_ref().map(|name| self.channel_index(name)),
            increment_weight: increment_weight.unwrap_or(f64::NAN),
            input_limit: input_limit.unwrap_or(NO_LIMIT),
            terms: self.term_parts(&sensor.terms),
            increment_weight_over_rate: sensor
                .increment_weight_over_rate
                .as_ref()
                .map(|curve| curve.to_parts(0.0)),
            trend: sensor.trend.as_ref().map(trend),
            servo: sensor.servo.as_ref().map(servo),
            drift: sensor.drift.as_ref().map(drift),
            delay_ticks: sensor.delay_ticks.unwrap_or_default(),
            sigma: sigma::of_gyro(sensor),
        }
    }

    fn accel_parts(&self, sensor: &AccelSensor) -> AccelParts {
        let input_limit = match self.accel.as_ref().map(|accel| accel.output) {
            Some(AccelOutput::Counts) => sensor.input_limit_counts_per_tick,
            Some(AccelOutput::Volts) => sensor.input_limit_v,
            Some(AccelOutput::MetresPerSecondSquared) | None => sensor.input_limit_m_per_s2,
        };
        AccelParts {
            channel: sensor.channel.as_ref().map(|name| self.channel_index(name)),
            board_channel: sensor.board_channel.as_ref().map(|name| self.channel_index(name)),
            scale_factor: sensor.scale_factor.to_parts(0.0),
            terms: self.term_parts(&sensor.terms),
            position_m: sensor.position_m.unwrap_or_default(),
            delay_ticks: sensor.delay_ticks.unwrap_or_default(),
            board_ratio: sensor.board_ratio_error.as_ref().map(|curve| curve.to_parts(1.0)),
            input_limit: input_limit.unwrap_or(NO_LIMIT),
            sigma: sigma::of_accel(sensor),
        }
    }
}

impl Filter {
    /// The core's parts, with the temperature that is assumed before the first reading.
    #[must_use]
    pub fn to_parts(&self, assumed_deg_c: f64) -> ThermalFilterParts {
        ThermalFilterParts {
            grid_step_s: self.grid_step_s,
            smoothing_s: self.smoothing_s,
            derivative_step_s: self.derivative_step_s,
            stale_after_s: self.stale_after_s,
            branch_dead_band: self.branch_dead_band_deg_c2_per_s3.unwrap_or(NO_BRANCHES),
            assumed_deg_c,
        }
    }
}

/// A name that is too long was reported by the walk; here it is cut.
fn name(stated: &str) -> ChannelName {
    let mut name = ChannelName::new();
    for c in stated.chars().take(MAX_CHANNEL_NAME) {
        if name.try_push(c).is_err() {
            break;
        }
    }
    name
}

impl Channel {
    /// The core's parts.
    #[must_use]
    pub fn to_parts(&self) -> ChannelParts {
        ChannelParts {
            name: name(&self.name),
            conversion: self.conversion_deg_c.clone(),
            range_deg_c: self.range_deg_c,
            spike_limit_deg_c: self.spike_limit_deg_c,
        }
    }
}

fn auxiliary(channel: &Auxiliary) -> ChannelParts {
    ChannelParts {
        name: name(&channel.name),
        conversion: channel.conversion.clone(),
        range_deg_c: channel.range,
        spike_limit_deg_c: channel.spike_limit,
    }
}

fn play(stated: &AxesHysteresis) -> AxesPlay {
    AxesPlay { half_width_deg_c: stated.half_width_deg_c, share: stated.share_ratio }
}

fn trend(trend: &Trend) -> TrendParts {
    // °/h per hʲ → rad/s per sʲ.
    let per_hour = std::iter::successors(Some(1.0), |power| Some(power * HOUR));
    let coefficients = trend.coefficients_deg_per_h.iter().zip(per_hour);
    TrendParts {
        coefficients: coefficients.map(|(c, power)| c * DEG_PER_H / power).collect(),
        interval_s: trend.interval_h.map(|end| end * HOUR),
    }
}

fn servo(servo: &Servo) -> ServoParts {
    ServoParts {
        form: match servo.form {
            ServoKind::Measured => ServoForm::Measured,
            ServoKind::Modelled => ServoForm::Modelled,
            ServoKind::Fitted => ServoForm::Fitted,
        },
        time_constant_s: servo.time_constant_s,
        rest_frequency: servo.rest_frequency.to_parts(0.0),
        settle_time_constants: servo.settle_time_constants,
    }
}

fn drift(drift: &Drift) -> DriftParts {
    DriftParts {
        sigma_rad_per_s: drift.sigma_deg_per_h * DEG_PER_H,
        correlation_time_s: drift.correlation_time_h * HOUR,
        trend_sigma_rad_per_s2: drift.trend_sigma_deg_per_h2 * DEG_PER_H / HOUR,
        trend_correlation_time_s: drift.trend_correlation_time_h * HOUR,
        initial_sigma_rad_per_s: drift.initial_sigma_deg_per_h * DEG_PER_H,
        angle_random_walk_rad_per_sqrt_s: drift.angle_random_walk_deg_per_sqrt_h * DEG_PER_SQRT_H,
    }
}

fn self_test(self_test: &SelfTest) -> SelfTestParts {
    let voltages = self_test.voltage.iter();
    let counters = self_test.counter.iter();
    SelfTestParts {
        voltages: voltages
            .map(|voltage| SelfTestVoltage { name: name(&voltage.name), range_v: voltage.range_v })
            .collect(),
        counters: counters
            .map(|counter| SelfTestCounter {
                name: name(&counter.name),
                max_increase: f64::from(counter.max_increase),
            })
            .collect(),
    }
}

fn reversal(reversal: &ModeReversal) -> ReversalParts {
    ReversalParts {
        transition: reversal.transition(),
        predict_readings: reversal.predict_readings,
        predict_degree: reversal.predict_degree,
        fit_readings_before: reversal.fit_readings_before,
        fit_readings_after: reversal.fit_readings_after,
        fit_degree: reversal.fit_degree,
        fit_window: match reversal.fit_window {
            FitWindow::Fixed => CoreFitWindow::Fixed,
            FitWindow::Adaptive => CoreFitWindow::Adaptive,
        },
    }
}
