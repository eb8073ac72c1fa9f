//! The messages of a script.

use std::collections::VecDeque;

use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, OutputKind, Readings, Sensors, TemperatureReading,
};
use isotherm_correction::units::Timestamp;
use isotherm_protocol::codec::encode;
use isotherm_protocol::key::{Input, RawStream};
use isotherm_protocol::raw::{
    AccelBatch, GyroBatch, HealthBatch, HealthReading, HealthTick, TemperatureBatch,
};
use isotherm_simulator::Simulation;

use super::{Accels, Script, Step, channel};

impl Script {
    /// So many ticks, with temperatures, health and mishaps.
    ///
    /// # Panics
    /// Where the script is not sound.
    pub fn ticks(&mut self, ticks: u64) {
        let mut late: Option<Vec<Step>> = None;
        for _ in 0..ticks.div_ceil(self.batch) {
            let mut sent = self.messages();
            if self.dice.below(100) < 4 * self.mishaps {
                sent = self.mishap(sent, &mut late);
            } else if let Some(late) = late.take() {
                sent.extend(late);
            }
            self.steps.extend(sent);
        }
        self.steps.extend(late.into_iter().flatten());
        self.steps.append(&mut self.late_accels);
    }

    /// What a simulated producer sends.
    ///
    /// # Panics
    /// Where the scenario is not sound.
    pub fn simulated(&mut self, scenario: &isotherm_simulator::Scenario) {
        let output = scenario.instrument.gyros.output_kind();
        let accel_output = scenario.instrument.accel_output_kind();
        let batch = usize::try_from(self.batch).expect("a short batch");
        let mut steps: VecDeque<_> = Simulation::new(scenario).expect("a sound scenario").collect();
        while !steps.is_empty() {
            let some: Vec<_> = steps.drain(..batch.min(steps.len())).collect();
            for readings in some.iter().flat_map(|step| step.temperatures.chunk_by(|a, b| a.time == b.time)) {
                self.temperature_frame(readings);
            }
            let accels: Vec<_> = some.iter().filter_map(|step| step.accel.clone()).collect();
            if let Some(output) = accel_output {
                self.steps.push(accel_frame(output, &accels));
            }
            let gyros: Vec<_> = some.into_iter().map(|step| step.gyro).collect();
            self.steps.push(gyro_frame(output, &gyros));
        }
    }

    /// Ticks of another kind, or of another number of sensors, than the calibration is for.
    ///
    /// # Panics
    /// Where there are too many sensors.
    pub fn foreign(&mut self, output: OutputKind, sensors: usize) {
        let (accel, gyro) = self.next_tick();
        let readings: Readings = std::iter::repeat_n(3.0, sensors).collect();
        let half_periods = Sensors::new();
        self.steps.push(accel_frame(output, &[AccelTick { readings, ..accel }]));
        self.steps.push(gyro_frame(output, &[GyroTick { readings, half_periods, ..gyro }]));
    }

    /// One reading of a channel, so many nanoseconds from now.
    ///
    /// # Panics
    /// Where the name is too long.
    pub fn temperature(&mut self, name: &str, raw: f64, from_now_ns: i64) {
        let time = Timestamp::from_ns(self.now_ns.saturating_add(from_now_ns));
        self.temperature_frame(&[TemperatureReading { channel: channel(name), time, raw }]);
    }

    /// Messages from a step on change places with others that come within so many.
    ///
    /// # Panics
    /// Where `reach` is 0.
    pub fn shuffle(&mut self, from: usize, reach: usize) {
        for index in from..self.steps.len() {
            let reach = reach.min(self.steps.len() - index);
            let other = usize::try_from(self.dice.below(reach as u64)).expect("a small number");
            self.steps.swap(index, index + other);
        }
    }

    fn temperature_frame(&mut self, readings: &[TemperatureReading]) {
        let batch = TemperatureBatch { readings: readings.to_vec() };
        let frame = encode(&batch).expect("it can be encoded");
        self.steps.push(Step::Frame(Input::Raw(RawStream::Temperature), frame));
    }

    /// Something goes wrong with a batch's messages.
    fn mishap(&mut self, mut sent: Vec<Step>, late: &mut Option<Vec<Step>>) -> Vec<Step> {
        match self.dice.below(4) {
            0 => {
                let lost = usize::try_from(self.dice.below(sent.len() as u64)).expect("a short list");
                sent.remove(lost);
            }
            1 => {
                let again: Vec<_> =
                    sent.iter().filter(|step| matches!(step, Step::Frame(..))).cloned().collect();
                sent.extend(again);
            }
            2 => {
                let before = late.replace(std::mem::take(&mut sent));
                sent.extend(before.into_iter().flatten());
            }
            _ => {
                if let Some(Step::Frame(_, frame)) = sent.last_mut() {
                    let place = usize::try_from(self.dice.below(frame.len() as u64)).expect("a short frame");
                    frame[place] ^= 0x10;
                }
            }
        }
        sent
    }

    /// The messages of one batch.
    fn messages(&mut self) -> Vec<Step> {
        let mut sent = Vec::new();
        let frame = |stream, frame| Step::Frame(Input::Raw(stream), frame);
        if (self.next.is_multiple_of(20) || self.dice.below(4) == 0) && self.thermometers {
            sent.extend(self.temperatures().map(|temperatures| frame(RawStream::Temperature, temperatures)));
        }
        if self.dice.below(10) == 0 {
            sent.push(frame(RawStream::Health, self.health()));
        }
        let (mut accels, mut gyros) = (Vec::new(), Vec::new());
        for _ in 0..self.batch {
            let (accel, gyro) = self.next_tick();
            accels.push(accel);
            gyros.push(gyro);
        }
        let gyros = gyro_frame(self.calibration.gyro_output(), &gyros);
        if self.calibration.accel_count() == 0 {
            sent.push(gyros);
            return sent;
        }
        let accels = accel_frame(self.calibration.accel_output(), &accels);
        match self.accels {
            Accels::Before => sent.extend([accels, gyros]),
            Accels::After => sent.extend([gyros, accels]),
            Accels::Late(messages) => {
                sent.push(gyros);
                self.late_accels.push(accels);
                if self.late_accels.len() > messages {
                    sent.push(self.late_accels.remove(0));
                }
            }
            Accels::Lost(percent) => {
                if self.dice.below(100) >= percent {
                    sent.push(accels);
                }
                sent.push(gyros);
            }
        }
        sent
    }

    /// `None` for a unit without channels.
    fn temperatures(&mut self) -> Option<Vec<u8>> {
        let warming = self.warming * f64::from(u32::try_from(self.next % 50_000).expect("a small number"));
        let noise = 0.01 * self.dice.between_minus_one_and_one();
        let time = Timestamp::from_ns(self.now_ns.saturating_sub(self.tick.as_ns()));
        let reading = |&(channel, raw): &(ChannelName, f64)| TemperatureReading {
            channel,
            time,
            raw: raw * (1.0 + 1e-3 * (warming + noise)),
        };
        let readings = self.channels.iter().map(reading).collect();
        let any = !self.channels.is_empty();
        any.then(|| encode(&TemperatureBatch { readings }).expect("it can be encoded"))
    }

    fn health(&mut self) -> Vec<u8> {
        let reading = |name: &str, value| HealthReading { name: channel(name), value };
        let readings = vec![
            reading("half-wave x", 44.0 + self.dice.between_minus_one_and_one()),
            reading("half-wave y", 43.0),
            reading("frame errors", 17.0),
        ];
        encode(&HealthBatch { ticks: vec![HealthTick { time_ns: self.now_ns, readings }] })
            .expect("it can be encoded")
    }
}

fn gyro_frame(output: OutputKind, ticks: &[GyroTick]) -> Step {
    let batch = GyroBatch { output, ticks: ticks.to_vec() };
    Step::Frame(Input::Raw(RawStream::Gyro), encode(&batch).expect("it can be encoded"))
}

fn accel_frame(output: OutputKind, ticks: &[AccelTick]) -> Step {
    let batch = AccelBatch { output, ticks: ticks.to_vec() };
    Step::Frame(Input::Raw(RawStream::Accel), encode(&batch).expect("it can be encoded"))
}
