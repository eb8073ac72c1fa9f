//! The gyros of one unit with their memory, whatever their kind.

use isotherm_correction::sample::{HalfPeriodCounts, LasingMode, Readings, Sensors};

use crate::fibre_optic::FibreOpticState;
use crate::instrument::Gyros;
use crate::mems::MemsState;
use crate::reversal::{Clockwork, Phase};
use crate::thermal::Node;
use crate::zeeman::ZeemanState;

/// When and in which housing a tick takes place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TickTime {
    pub(crate) start_s: f64,
    pub(crate) middle_s: f64,
    pub(crate) length_s: f64,
    pub(crate) nominal_s: f64,
    /// Place of the tick's middle between two steps of the thermal clock.
    pub(crate) share: f64,
    /// Temperature of the housing in the middle.
    pub(crate) housing_deg_c: f64,
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
enum GyroState {
    Zeeman(ZeemanState),
    FibreOptic(Box<FibreOpticState>),
    Mems(MemsState),
}

/// All gyros of a unit with their memory.
#[derive(Debug, Clone)]
pub(crate) struct GyrosState {
    /// Of gyros that switch their mode; they are dithered.
    clockwork: Option<Clockwork>,
    gyros: Vec<GyroState>,
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
        let mut clockwork = None;
        let gyros = match gyros {
            Gyros::Zeeman(unit) => {
                clockwork = Some(Clockwork::new(unit.reversal, seed));
                let state =
                    |(gyro, index)| ZeemanState::new(unit, gyro, seed, index, step_s, initial(gyro.node));
                unit.gyros.iter().zip(0..).map(state).map(GyroState::Zeeman).collect()
            }
            Gyros::FibreOptic(gyros) => {
                let state = |(gyro, index)| FibreOpticState::new(gyro, seed, index, step_s, housing_deg_c);
                gyros.iter().zip(0..).map(state).map(Box::new).map(GyroState::FibreOptic).collect()
            }
            Gyros::Mems(gyros) => {
                let state = |(gyro, index)| MemsState::new(gyro, seed, index, step_s, initial(gyro.node));
                gyros.iter().zip(0..).map(state).map(GyroState::Mems).collect()
            }
        };
        Self { clockwork, gyros }
    }

    /// Whether the two halves of a tick have to be told apart.
    pub(crate) fn is_dithered(&self) -> bool {
        self.clockwork.is_some()
    }

    pub(crate) fn thermal_step(&mut self, from_deg_c: f64, to_deg_c: f64) {
        for gyro in &mut self.gyros {
            match gyro {
                GyroState::Zeeman(gyro) => gyro.thermal_step(from_deg_c, to_deg_c),
                GyroState::FibreOptic(gyro) => gyro.thermal_step(from_deg_c, to_deg_c),
                GyroState::Mems(gyro) => gyro.thermal_step(from_deg_c, to_deg_c),
            }
        }
    }

    pub(crate) fn sensor_deg_c(&self, share: f64) -> Sensors<f64> {
        let deg_c = self.gyros.iter().map(|gyro| match gyro {
            GyroState::Zeeman(gyro) => gyro.node.deg_c,
            GyroState::FibreOptic(gyro) => gyro.sensor_deg_c,
            GyroState::Mems(gyro) => gyro.node.deg_c,
        });
        deg_c.map(|deg_c| deg_c.at(share)).collect()
    }

    /// One tick from the input angles of its two halves (rad); gyros without dither take their sum.
    pub(crate) fn tick(&mut self, halves_rad: &Sensors<[f64; 2]>, time: TickTime) -> GyroOutput {
        let TickTime { length_s, share, .. } = time;
        let clockwork = self.clockwork.as_mut();
        let phase = clockwork.map_or(Phase::UNSWITCHED, |it| it.tick(time.start_s, time.nominal_s));
        let mut output = GyroOutput {
            mode: self.is_dithered().then_some(phase.mode),
            commanded: phase.commanded,
            lost: phase.lost,
            meander: phase.meander,
            ..GyroOutput::default()
        };
        for (gyro, &halves) in self.gyros.iter_mut().zip(halves_rad) {
            let whole_rad = halves[0] + halves[1];
            let (reading, drift, transient) = match gyro {
                GyroState::Zeeman(gyro) => {
                    let tick = gyro.tick(halves, length_s, share, phase);
                    output.halves.push(tick.halves);
                    (tick.counts, tick.drift_rad_per_s, tick.transient_rad_per_s)
                }
                GyroState::FibreOptic(gyro) => gyro.tick(whole_rad, length_s, share),
                GyroState::Mems(gyro) => gyro.tick(whole_rad, length_s, share),
            };
            output.readings.push(reading);
            output.drift_rad_per_s.push(drift);
            output.transient_rad_per_s.push(transient);
        }
        output
    }
}
