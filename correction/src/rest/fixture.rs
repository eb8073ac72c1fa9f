//! A unit at rest as the corrector would see it, for tests: noise of any size, counts, modes, and what a test adds.

use alloc::vec;
use alloc::vec::Vec;

use crate::calibration::{AccelParts, Calibration, CalibrationParts, GyroParts};
use crate::channel::ThermalFilterParts;
use crate::curve::CurveParts;
use crate::observation::{GyroSeen, Observation};
use crate::operation::SelfTestParts;
use crate::orientation::OrientationParts;
use crate::sample::{LasingMode, OutputKind, SensorFlags};
use crate::units::{Span, Timestamp};

/// Rate (rad/s) and specific force (m/s²) at rest.
pub(crate) const RATE_RAD_PER_S: [f64; 3] = [4.0e-5, -1.3e-5, -6.0e-5];
pub(crate) const FORCE_M_PER_S2: [f64; 3] = [0.3, -0.2, -9.809];

/// Three gyros and, where `accels`, three accelerometers along the case axes.
pub(crate) fn calibration(output: OutputKind, count: f64, accels: bool) -> Calibration {
    let axes = || OrientationParts {
        reference_deg_c: 20.0,
        rows: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        slopes_per_deg_c: Vec::new(),
        plays: Vec::new(),
        weights: Vec::new(),
        range_deg_c: [-40.0, 80.0],
        parity_limit: None,
        parity_confirm_ticks: 1,
    };
    let gyro = GyroParts {
        channel: None,
        increment_weight: count,
        input_limit: 1e6,
        terms: Vec::new(),
        increment_weight_over_rate: None,
        trend: None,
        servo: None,
        drift: None,
        delay_ticks: 0.0,
        sigma: None,
    };
    let accel = AccelParts {
        channel: None,
        board_channel: None,
        scale_factor: CurveParts::Polynomial {
            reference: 20.0,
            coefficients: vec![1.0 / count],
            range: [-40.0, 80.0],
        },
        terms: Vec::new(),
        board_ratio: None,
        position_m: [0.0; 3],
        input_limit: 1e9,
        delay_ticks: 0.0,
        sigma: None,
    };
    let parts = CalibrationParts {
        filter: ThermalFilterParts {
            grid_step_s: 1.0,
            smoothing_s: 1.0,
            derivative_step_s: 1.0,
            stale_after_s: 60.0,
            branch_dead_band: 1e-6,
            assumed_deg_c: 20.0,
        },
        channels: Vec::new(),
        auxiliaries: Vec::new(),
        gyro_output: output,
        gyros: vec![gyro; 3],
        gyro_orientation: axes(),
        gyro_orientation_channels: Vec::new(),
        accel_output: output,
        accels: if accels { vec![accel; 3] } else { Vec::new() },
        accel_orientation: accels.then(axes),
        accel_orientation_channels: Vec::new(),
        reversal: None,
        self_test: SelfTestParts::default(),
    };
    Calibration::new(&parts).unwrap()
}

/// A unit at rest, tick by tick.
#[derive(Debug, Clone)]
pub(crate) struct Still {
    /// Duration of a tick (s).
    pub(crate) tick_s: f64,
    /// White noise of the rate (rad/√s) and of the force (m/s/√s).
    pub(crate) walk: [f64; 2],
    /// Time between mode switches (s); none: an instrument without modes.
    pub(crate) period_s: Option<f64>,
    /// ΔC0 and ΔB0 (rad/s).
    pub(crate) change: [f64; 2],
    /// Ticks so far.
    pub(crate) ticks: u32,
    /// State of the noise.
    pub(crate) random: u64,
}

impl Still {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            tick_s: 0.02,
            walk: [6e-7, 3e-5],
            period_s: None,
            change: [0.0; 2],
            ticks: 0,
            random: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1,
        }
    }

    /// Seconds since the start, at the end of the last tick.
    pub(crate) fn now_s(&self) -> f64 {
        f64::from(self.ticks) * self.tick_s
    }

    /// About normal: twelve uniform deviates.
    fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.random ^= self.random << 13;
            self.random ^= self.random >> 7;
            self.random ^= self.random << 17;
            f64::from(u32::try_from(self.random >> 32).unwrap()) / 4_294_967_296.0
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    /// The next tick.
    pub(crate) fn tick(&mut self) -> Observation {
        self.ticks += 1;
        let (middle_s, root) = (self.now_s() - 0.5 * self.tick_s, self.tick_s.sqrt());
        let mode = self.period_s.map(|period_s| {
            if (middle_s / period_s) % 2.0 < 1.0 { LasingMode::Plus } else { LasingMode::Minus }
        });
        let excess = self.change[0] + mode.map_or(0.0, LasingMode::sign) * self.change[1];
        let [walk, force_walk] = self.walk;
        let rate = RATE_RAD_PER_S.map(|rate| rate + excess + walk * self.normal() / root);
        let force = FORCE_M_PER_S2.map(|force| force + force_walk * self.normal() / root);
        // Any bias will do: it is in the rate and subtracted again.
        let bias = 1e-5 * middle_s;
        let gyro = |rate: f64| GyroSeen {
            rate: rate + bias,
            bias,
            temperature_deg_c: 20.0 + middle_s / 300.0,
            flags: SensorFlags::VALID,
            ..GyroSeen::default()
        };
        Observation {
            sequence: u64::from(self.ticks),
            end_time: Timestamp::default() + Span::from_s(self.now_s()),
            duration: Span::from_s(self.tick_s),
            mode,
            settled: true,
            gyros: rate.into_iter().map(gyro).collect(),
            angular_rate: rate,
            specific_force: Some(force),
            ..Observation::default()
        }
    }
}
