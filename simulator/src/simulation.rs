//! The simulation: a stream of ticks from a scenario.

use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, HalfPeriodCounts, Readings, Sensors, TemperatureReading,
};
use isotherm_correction::units::{Span, Timestamp};

use crate::accelerometer::AccelerometersState;
use crate::chamber::Chamber;
use crate::effects::EffectsState;
use crate::error::ScenarioErrors;
use crate::failure::{FailingSensor, Failures};
use crate::gyros::{GyroOutput, GyrosState, TickTime};
use crate::noise::{Noise, Purpose};
use crate::orientation::Orientation;
use crate::scenario::Scenario;
use crate::surroundings::Surroundings;
use crate::temperature::{Place, ThermometersState};
use crate::trajectory::{Increments, Trajectory};
use crate::truth::{Step, Truth};
use crate::vector::dot;

/// A running simulation: an iterator over the ticks of a scenario.
///
/// It holds no buffer that grows with the run; a step allocates only where temperatures are read in it.
#[derive(Debug, Clone)]
pub struct Simulation {
    start: Timestamp,
    tick_ns: i64,
    jitter_ns: f64,
    ticks: u64,
    sequence: u64,
    /// End of the last tick after the start (ns).
    elapsed_ns: i64,
    jitter: Noise,
    trajectory: Trajectory,
    surroundings: Surroundings,
    gyros: GyrosState,
    gyro_orientation: Orientation,
    accelerometers: Option<AccelerometersState>,
    thermometers: ThermometersState,
    failures: Failures,
    effects: EffectsState,
    /// Of the tick before.
    last_gyro: Readings,
    last_halves: Sensors<HalfPeriodCounts>,
    last_accel: Readings,
}

impl Simulation {
    /// Prepares a scenario.
    ///
    /// # Errors
    ///
    /// All that is wrong with the scenario.
    pub fn new(scenario: &Scenario) -> Result<Self, ScenarioErrors> {
        let errors = scenario.check();
        if !errors.is_empty() {
            return Err(ScenarioErrors(errors));
        }
        let (instrument, seed) = (&scenario.instrument, scenario.seed);
        let chamber = Chamber::new(&scenario.chamber);
        let surroundings = Surroundings::new(chamber, instrument);
        let (step_s, housing_deg_c) = (instrument.thermal_step_s, surroundings.housing.deg_c.at(0.0));
        let initial = |node| surroundings.initial_deg_c(node);
        let gyros = GyrosState::new(&instrument.gyros, seed, step_s, housing_deg_c, initial);
        let block = instrument.accelerometers.as_ref();
        Ok(Self {
            start: Timestamp::from_ns(scenario.start_ns),
            tick_ns: scenario.tick_ns,
            jitter_ns: whole_to_real(scenario.tick_jitter_ns),
            ticks: real_to_whole(scenario.duration_s * 1e9 / whole_to_real(scenario.tick_ns) + 1e-6)
                .unsigned_abs(),
            sequence: 0,
            elapsed_ns: 0,
            jitter: Noise::new(seed, Purpose::TickLength),
            trajectory: Trajectory::new(&scenario.motion),
            gyros,
            gyro_orientation: instrument.gyro_orientation.clone(),
            accelerometers: block.map(|block| AccelerometersState::new(block, seed, step_s, initial)),
            thermometers: ThermometersState::new(&instrument.thermometers, seed),
            failures: Failures(scenario.failures.clone()),
            effects: EffectsState::new(&instrument.effects),
            surroundings,
            last_gyro: Readings::default(),
            last_halves: Sensors::new(),
            last_accel: Readings::default(),
        })
    }

    /// Ticks that are still to come.
    #[must_use]
    pub fn remaining(&self) -> u64 {
        self.ticks - self.sequence
    }

    /// End of the present tick after the start (ns).
    fn next_end_ns(&mut self) -> i64 {
        let nominal_ns = self.tick_ns.saturating_mul(i64::try_from(self.sequence + 1).unwrap_or(i64::MAX));
        if self.jitter_ns > 0.0 {
            nominal_ns + real_to_whole(self.jitter.between(-self.jitter_ns, self.jitter_ns))
        } else {
            nominal_ns
        }
    }

    fn advance_to(&mut self, time_s: f64) {
        while let Some((from_deg_c, to_deg_c)) = self.surroundings.step_towards(time_s) {
            self.gyros.thermal_step(from_deg_c, to_deg_c);
            if let Some(accelerometers) = &mut self.accelerometers {
                accelerometers.thermal_step(from_deg_c, to_deg_c);
            }
            let (gyros, accels) = (self.gyros.sensor_deg_c(1.0), self.accel_deg_c(1.0));
            self.effects.thermal_step(&gyros, &accels, self.surroundings.housing.deg_c.at(1.0));
        }
    }

    fn accel_deg_c(&self, share: f64) -> Sensors<f64> {
        self.accelerometers.as_ref().map(|block| block.deg_c(share)).unwrap_or_default()
    }

    /// Input angles of the two halves of the tick for each gyro, and the increments of either; without dither the whole is the first.
    fn inputs(&self, time: TickTime, axes: &Sensors<[f64; 3]>) -> (Sensors<[f64; 2]>, [Increments; 2]) {
        let TickTime { middle_s, length_s, .. } = time;
        let parts = |middle_s: f64| {
            if self.gyros.is_dithered() {
                let half_s = 0.5 * length_s;
                [-1.0, 1.0].map(|sign| self.trajectory.increments(middle_s + sign * 0.5 * half_s, half_s))
            } else {
                [self.trajectory.increments(middle_s, length_s), Increments::default()]
            }
        };
        let on_time = parts(middle_s);
        let halves = axes.iter().enumerate().map(|(index, &axis)| {
            let delay_ticks = self.effects.gyro_delay_ticks(index);
            let sensed = if delay_ticks == 0.0 { on_time } else { parts(middle_s - delay_ticks * length_s) };
            sensed.map(|part| dot(axis, part.angle))
        });
        (halves.collect(), on_time)
    }

    fn read_accelerometers(&mut self, velocity: [f64; 3], time: TickTime) -> Option<Readings> {
        let TickTime { middle_s, share, housing_deg_c, .. } = time;
        let axes_deg_c = self.effects.accel_axes.deg_c(housing_deg_c, share);
        let failures = &self.failures;
        let block = self.accelerometers.as_mut()?;
        let axes = block.orientation.axes(axes_deg_c);
        let felt = self.effects.feel(&self.trajectory, time, &block.deg_c(share), &axes);
        let extra = |index| {
            let felt = felt.get(index).copied().unwrap_or_default();
            failures.extra(FailingSensor::Accelerometer(index), middle_s) + felt
        };
        let mut readings = block.tick(velocity, time, &axes, self.surroundings.board.deg_c.at(share), extra);
        failures.change(FailingSensor::Accelerometer, middle_s, &mut readings, &mut self.last_accel);
        Some(readings)
    }

    fn read_thermometers(&mut self, until_s: f64) -> Vec<TemperatureReading> {
        let mut readings = Vec::new();
        while let Some(time_s) = self.thermometers.due(until_s) {
            let share = self.surroundings.share(time_s);
            let (gyros, surroundings) = (self.gyros.sensor_deg_c(share), &self.surroundings);
            let accels = self.accel_deg_c(share);
            let time = self.start + Span::from_s(time_s);
            readings.extend(self.thermometers.read(time, |place| match place {
                Place::Chamber => surroundings.chamber_deg_c.at(share),
                Place::Housing => surroundings.housing.deg_c.at(share),
                Place::Board => surroundings.board.deg_c.at(share),
                Place::Gyro(index) => gyros.get(index).copied().unwrap_or(f64::NAN),
                Place::Accelerometer(index) => accels.get(index).copied().unwrap_or(f64::NAN),
            }));
            readings.extend(self.effects.supply.as_ref().map(|supply| TemperatureReading {
                channel: ChannelName::from(&supply.channel).unwrap_or_default(),
                time,
                raw: supply.nominal_v + supply.beyond_v(time_s),
            }));
        }
        readings
    }

    fn step(&mut self) -> Step {
        let (start_ns, end_ns) = (self.elapsed_ns, self.next_end_ns());
        let duration = Span::from_ns(end_ns - start_ns);
        let length_s = duration.as_s();
        let middle_s = whole_to_real(start_ns + end_ns) * 0.5e-9;
        self.advance_to(middle_s);
        let share = self.surroundings.share(middle_s);
        let time = TickTime {
            start_s: whole_to_real(start_ns) * 1e-9,
            middle_s,
            length_s,
            nominal_s: whole_to_real(self.tick_ns) * 1e-9,
            share,
            housing_deg_c: self.surroundings.housing.deg_c.at(share),
        };
        let axes = self.gyro_orientation.axes(self.effects.gyro_axes.deg_c(time.housing_deg_c, share));
        let (mut halves, parts) = self.inputs(time, &axes);
        let whole = parts[0].plus(parts[1]);
        let drifts = self.effects.sense(&mut halves, &parts, time, &self.gyros.sensor_deg_c(share));
        for (index, halves) in halves.iter_mut().enumerate() {
            let extra = self.failures.extra(FailingSensor::Gyro(index), middle_s) * 0.5 * length_s;
            *halves = halves.map(|half| half + extra);
        }
        let mut output = self.gyros.tick(&halves, time);
        output.drift_rad_per_s.iter_mut().zip(drifts).for_each(|(drift, more)| *drift += more);
        self.failures.repeat(FailingSensor::Gyro, middle_s, &mut output.halves, &self.last_halves);
        self.failures.change(FailingSensor::Gyro, middle_s, &mut output.readings, &mut self.last_gyro);
        self.last_halves.clone_from(&output.halves);
        let end_time = Timestamp::from_ns(self.start.as_ns().saturating_add(end_ns));
        let sequence = self.sequence;
        let accel = self.read_accelerometers(whole.velocity, time);
        let truth = self.truth(whole, time, &output);
        let temperatures = self.read_thermometers(whole_to_real(end_ns) * 1e-9);
        self.sequence += 1;
        self.elapsed_ns = end_ns;
        Step {
            gyro: GyroTick {
                sequence,
                end_time,
                duration,
                readings: output.readings,
                mode: output.mode,
                switch_command: output.commanded,
                meander: output.meander,
                half_periods: output.halves,
                series: 0,
            },
            accel: accel.map(|readings| AccelTick { sequence, end_time, duration, readings }),
            temperatures,
            truth,
        }
    }

    fn truth(&self, whole: Increments, time: TickTime, output: &GyroOutput) -> Truth {
        let TickTime { share, housing_deg_c, .. } = time;
        Truth {
            delta_angle: whole.angle,
            delta_velocity: whole.velocity,
            chamber_deg_c: self.surroundings.chamber_deg_c.at(share),
            housing_deg_c,
            board_deg_c: self.surroundings.board.deg_c.at(share),
            gyro_deg_c: self.gyros.sensor_deg_c(share),
            accel_deg_c: self.accel_deg_c(share),
            gyro_drift_rad_per_s: output.drift_rad_per_s.clone(),
            gyro_transient_rad_per_s: output.transient_rad_per_s.clone(),
            lost: output.lost,
        }
    }
}

impl Iterator for Simulation {
    type Item = Step;

    fn next(&mut self) -> Option<Step> {
        (self.sequence < self.ticks).then(|| self.step())
    }
}

#[expect(
    clippy::cast_precision_loss,
    reason = "sums of two run times stay below 2⁶¹ ns; half a µs is lost at most there"
)]
fn whole_to_real(ns: i64) -> f64 {
    ns as f64
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "float-to-int `as` saturates; a run has at most 10¹³ ticks"
)]
fn real_to_whole(value: f64) -> i64 {
    libm::floor(value) as i64
}

#[cfg(test)]
mod tests;
