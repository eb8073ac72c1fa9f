//! The gyros of one unit with their memory, whatever their kind.

use isotherm_correction::sample::{HalfPeriodCounts, LasingMode, Readings, Sensors};

use crate::fibre_optic::FibreOpticState;
use crate::instrument::Gyros;
use crate::mems::MemsState;
use crate::reversal::Clockwork;
use crate::thermal::Node;
use crate::zeeman::ZeemanState;

/// When a tick takes place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TickTime {
    pub(crate) start_s: f64,
    pub(crate) length_s: f64,
    pub(crate) nominal_s: f64,
    /// Place of the tick's middle between two steps of the thermal clock.
    pub(crate) share: f64,
}

/// What a tick of all gyros gives.
#[derive(Debug, Clone, Default)]
pub(crate) struct GyroOutput {
    pub(crate) readings: Readings,
    pub(crate) halves: Sensors<HalfPeriodCounts>,
    pub(crate) drift_rad_per_s: Sensors<f64>,
    pub(crate) transient_rad_per_s: Sensors<f64>,
    pub(crate) mode: Option<LasingMode>,
    pub(crate) commanded: bool,
    pub(crate) lost: bool,
    pub(crate) meander: Option<LasingMode>,
}

#[derive(Debug, Clone)]
pub(crate) enum GyrosState {
    Zeeman { clockwork: Clockwork, gyros: Vec<ZeemanState> },
    FibreOptic(Vec<FibreOpticState>),
    Mems(Vec<MemsState>),
}

impl GyrosState {
    /// `initial` gives a node's temperature at the start, behind a housing of `housing_deg_c`.
    pub(crate) fn new(
        gyros: &Gyros,
        seed: u64,
        step_s: f64,
        housing_deg_c: f64,
        initial: impl Fn(Node) -> f64,
    ) -> Self {
        match gyros {
            Gyros::Zeeman(unit) => {
                let numbered = unit.gyros.iter().zip(0..);
                let state =
                    |(gyro, index)| ZeemanState::new(unit, gyro, seed, index, step_s, initial(gyro.node));
                Self::Zeeman {
                    clockwork: Clockwork::new(unit.reversal, seed),
                    gyros: numbered.map(state).collect(),
                }
            }
            Gyros::FibreOptic(gyros) => {
                let state = |(gyro, index)| FibreOpticState::new(gyro, seed, index, step_s, housing_deg_c);
                Self::FibreOptic(gyros.iter().zip(0..).map(state).collect())
            }
            Gyros::Mems(gyros) => {
                let numbered = gyros.iter().zip(0..);
                Self::Mems(
                    numbered
                        .map(|(gyro, n)| MemsState::new(gyro, seed, n, step_s, initial(gyro.node)))
                        .collect(),
                )
            }
        }
    }

    /// Whether the two halves of a tick have to be told apart.
    pub(crate) fn is_dithered(&self) -> bool {
        matches!(self, Self::Zeeman { .. })
    }

    pub(crate) fn thermal_step(&mut self, from_deg_c: f64, to_deg_c: f64) {
        match self {
            Self::Zeeman { gyros, .. } => {
                for gyro in gyros {
                    gyro.thermal_step(from_deg_c, to_deg_c);
                }
            }
            Self::FibreOptic(gyros) => {
                for gyro in gyros {
                    gyro.thermal_step(from_deg_c, to_deg_c);
                }
            }
            Self::Mems(gyros) => {
                for gyro in gyros {
                    gyro.thermal_step(from_deg_c, to_deg_c);
                }
            }
        }
    }

    pub(crate) fn sensor_deg_c(&self, share: f64) -> Sensors<f64> {
        match self {
            Self::Zeeman { gyros, .. } => gyros.iter().map(|gyro| gyro.sensor_deg_c(share)).collect(),
            Self::FibreOptic(gyros) => gyros.iter().map(|gyro| gyro.sensor_deg_c(share)).collect(),
            Self::Mems(gyros) => gyros.iter().map(|gyro| gyro.sensor_deg_c(share)).collect(),
        }
    }

    /// One tick from the input angles of its two halves (rad); gyros without dither take their sum.
    pub(crate) fn tick(&mut self, halves_rad: &Sensors<[f64; 2]>, time: TickTime) -> GyroOutput {
        match self {
            Self::Zeeman { clockwork, gyros } => {
                let phase = clockwork.tick(time.start_s, time.nominal_s);
                let mut output = GyroOutput {
                    mode: Some(phase.mode),
                    commanded: phase.commanded,
                    lost: phase.lost,
                    meander: phase.meander,
                    ..GyroOutput::default()
                };
                for (gyro, &halves) in gyros.iter_mut().zip(halves_rad) {
                    let tick = gyro.tick(halves, time.length_s, time.share, phase);
                    output.readings.push(tick.counts);
                    output.halves.push(tick.halves);
                    output.drift_rad_per_s.push(tick.drift_rad_per_s);
                    output.transient_rad_per_s.push(tick.transient_rad_per_s);
                }
                output
            }
            Self::FibreOptic(gyros) => {
                let ticks = gyros.iter_mut().zip(halves_rad);
                rates(ticks.map(|(gyro, halves)| gyro.tick(halves[0] + halves[1], time.length_s, time.share)))
            }
            Self::Mems(gyros) => {
                let ticks = gyros.iter_mut().zip(halves_rad);
                rates(ticks.map(|(gyro, halves)| gyro.tick(halves[0] + halves[1], time.length_s, time.share)))
            }
        }
    }
}

fn rates(ticks: impl Iterator<Item = (f64, f64)>) -> GyroOutput {
    let mut output = GyroOutput::default();
    for (reading, drift) in ticks {
        output.readings.push(reading);
        output.drift_rad_per_s.push(drift);
        output.transient_rad_per_s.push(0.0);
    }
    output
}
