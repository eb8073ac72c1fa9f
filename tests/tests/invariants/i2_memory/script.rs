//! What happens to a stream, written down step by step.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::operation::Command;
use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, HalfPeriodCounts, LasingMode, OutputKind, TemperatureReading,
};
use isotherm_correction::unit::{At, Change, UnitSettings};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::encode;
use isotherm_protocol::journal::JournalEvent;
use isotherm_protocol::key::{Input, RawStream, UnitId};
use isotherm_protocol::raw::{
    AccelBatch, GyroBatch, HealthBatch, HealthReading, HealthTick, TemperatureBatch,
};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::stream::UnitStream;
use isotherm_tests::dice::Dice;

/// One thing that happens.
pub(super) enum Step {
    Frame(Input, Vec<u8>),
    Event(JournalEvent),
    Give(Change),
}

/// Whether a stream is in the midst of something, and what that is.
pub(super) type Meets = (&'static str, fn(&UnitStream) -> bool);

/// What happens, and what of it a cut must meet.
pub(super) struct Scenario {
    pub(super) name: &'static str,
    pub(super) settings: UnitSettings,
    pub(super) steps: Vec<Step>,
    pub(super) meets: Vec<Meets>,
}

impl Scenario {
    pub(super) fn stream(&self) -> UnitStream {
        UnitStream::new(UnitId::new("U-1").unwrap(), self.settings)
    }
}

/// Writes the steps of a producer's life.
pub(super) struct Script {
    pub(super) dice: Dice,
    pub(super) steps: Vec<Step>,
    calibration: Arc<Calibration>,
    channels: Vec<(ChannelName, f64)>,
    /// Next tick, its end, the producer's run.
    next: u64,
    now_ns: i64,
    series: u64,
    revision: u64,
    pub(super) tick: Span,
    pub(super) batch: u64,
    /// How many of a hundred messages are lost, doubled, late, broken: each.
    pub(super) mishaps: u64,
    /// Ticks between two switches of the lasing mode; 0 for an instrument without.
    pub(super) switches: u64,
    /// A gyro that fails, and from which tick on.
    pub(super) fails: Option<(usize, u64)>,
    /// How much the readings scatter (counts, or a millionth of their unit of measure).
    pub(super) scatter: f64,
    mode: LasingMode,
}

impl Script {
    pub(super) fn new(seed: u64, calibration: &Arc<Calibration>, channels: &[(&str, f64)]) -> Self {
        let channels = channels.iter().map(|(name, raw)| (ChannelName::from(name).unwrap(), *raw));
        let mut script = Self {
            dice: Dice::new(seed),
            steps: Vec::new(),
            calibration: Arc::clone(calibration),
            channels: channels.collect(),
            next: 1000,
            now_ns: 1_000_000_000_000,
            series: 7,
            revision: 0,
            tick: Span::from_ms(5),
            batch: 4,
            mishaps: 0,
            switches: 0,
            fails: None,
            scatter: 2.0,
            mode: LasingMode::Plus,
        };
        let calibration = Arc::clone(calibration);
        script.give(calibration, At::NextTick, Span::ZERO);
        script
    }

    /// A change of calibration.
    pub(super) fn give(&mut self, calibration: Arc<Calibration>, at: At, slew: Span) {
        self.revision += 1;
        self.steps.push(Step::Give(Change { calibration, revision: self.revision, at, slew }));
    }

    /// The same at a tick that is still to come.
    pub(super) fn give_later(&mut self, calibration: &Arc<Calibration>, ticks: u64, slew: Span) {
        let at = if self.dice.below(2) == 0 {
            At::Sequence(self.next + ticks)
        } else {
            let span_ns = self.tick.as_ns() * i64::try_from(ticks).unwrap();
            At::Time(Timestamp::from_ns(self.now_ns + span_ns))
        };
        self.give(Arc::clone(calibration), at, slew);
    }

    /// A command, whatever becomes of it.
    pub(super) fn command(&mut self, command: Command, accepted: bool) {
        self.steps.push(Step::Event(JournalEvent::Commanded { command, accepted, words: String::new() }));
    }

    pub(super) fn event(&mut self, event: JournalEvent) {
        self.steps.push(Step::Event(event));
    }

    /// The producer is switched off and on.
    pub(super) fn restart(&mut self) {
        self.series += 1;
        self.next = self.dice.below(100);
        self.now_ns = i64::try_from(self.dice.below(1_000_000_000)).unwrap();
    }

    /// A rate reference over the last second.
    pub(super) fn reference(&mut self) {
        let angular_rate_rad_per_s = [(); 3].map(|()| 1e-6 * self.dice.between_minus_one_and_one());
        let reference = Reference {
            start_ns: self.now_ns - 1_500_000_000,
            end_ns: self.now_ns - 500_000_000,
            angular_rate_rad_per_s,
            sigma_rad_per_s: 1e-6,
        };
        self.steps.push(Step::Frame(Input::Reference, encode(&reference).unwrap()));
    }

    /// So many ticks, with temperatures, health and mishaps.
    pub(super) fn ticks(&mut self, ticks: u64) {
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
    }

    /// Something goes wrong with a batch's messages.
    fn mishap(&mut self, mut sent: Vec<Step>, late: &mut Option<Vec<Step>>) -> Vec<Step> {
        match self.dice.below(4) {
            0 => {
                let lost = usize::try_from(self.dice.below(sent.len() as u64)).unwrap();
                sent.remove(lost);
            }
            1 => {
                let again = sent.iter().filter_map(|step| match step {
                    Step::Frame(input, frame) => Some(Step::Frame(*input, frame.clone())),
                    _ => None,
                });
                let again: Vec<_> = again.collect();
                sent.extend(again);
            }
            2 => {
                let before = late.replace(std::mem::take(&mut sent));
                sent.extend(before.into_iter().flatten());
            }
            _ => {
                if let Some(Step::Frame(_, frame)) = sent.last_mut() {
                    let place = usize::try_from(self.dice.below(frame.len() as u64)).unwrap();
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
        if self.next.is_multiple_of(20) || self.dice.below(4) == 0 {
            sent.push(frame(RawStream::Temperature, self.temperatures()));
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
        if self.calibration.accel_count() > 0 {
            let batch = AccelBatch { output: self.calibration.accel_output(), ticks: accels };
            sent.push(frame(RawStream::Accel, encode(&batch).unwrap()));
        }
        let batch = GyroBatch { output: self.calibration.gyro_output(), ticks: gyros };
        sent.push(frame(RawStream::Gyro, encode(&batch).unwrap()));
        sent
    }

    fn reading(&mut self, output: OutputKind, mean: f64) -> f64 {
        let scatter = self.scatter * self.dice.between_minus_one_and_one();
        match output {
            OutputKind::Counts => (mean + scatter).round(),
            OutputKind::Mean => mean * 1e-3 + scatter * 1e-6,
        }
    }

    fn next_tick(&mut self) -> (AccelTick, GyroTick) {
        let (sequence, end_time, duration) = (self.next, Timestamp::from_ns(self.now_ns), self.tick);
        self.next += 1;
        self.now_ns += self.tick.as_ns();
        let switch_command = self.switches > 0 && sequence.is_multiple_of(self.switches);
        if switch_command {
            self.mode = self.mode.reversed();
        }
        let calibration = Arc::clone(&self.calibration);
        let count = calibration.gyro_count();
        let mut readings: isotherm_correction::sample::Sensors<f64> =
            (0..count).map(|_| self.reading(calibration.gyro_output(), 0.0)).collect();
        if let Some((gyro, from)) = self.fails
            && sequence >= from
        {
            readings[gyro] = 40.0;
        }
        let half = |reading: &f64| {
            #[expect(clippy::cast_possible_truncation, reason = "a few thousand counts")]
            let counts = *reading as i32;
            HalfPeriodCounts { positive: 300 + counts, negative: -300 }
        };
        let halves = self.switches > 0 && calibration.gyro_output() == OutputKind::Counts;
        let gyro = GyroTick {
            sequence,
            end_time,
            duration,
            half_periods: if halves { readings.iter().map(half).collect() } else { [].into_iter().collect() },
            readings,
            mode: (self.switches > 0).then_some(self.mode),
            switch_command,
            meander: (self.switches > 0).then_some(LasingMode::Minus),
            series: self.series,
        };
        let readings = (0..calibration.accel_count()).map(|i| {
            let mean = if i == 2 { -9800.0 } else { 40.0 };
            let mean = if calibration.accel_output() == OutputKind::Counts { mean * 5e-3 } else { mean };
            self.reading(calibration.accel_output(), mean)
        });
        let readings = readings.collect();
        (AccelTick { sequence, end_time, duration, readings }, gyro)
    }

    fn temperatures(&mut self) -> Vec<u8> {
        let warming = 2e-4 * f64::from(u32::try_from(self.next % 50_000).unwrap());
        let noise = 0.01 * self.dice.between_minus_one_and_one();
        let time = Timestamp::from_ns(self.now_ns - self.tick.as_ns());
        let reading = |&(channel, raw): &(ChannelName, f64)| TemperatureReading {
            channel,
            time,
            raw: raw * (1.0 + 1e-3 * (warming + noise)),
        };
        encode(&TemperatureBatch { readings: self.channels.iter().map(reading).collect() }).unwrap()
    }

    fn health(&mut self) -> Vec<u8> {
        let reading = |name: &str, value| HealthReading { name: ChannelName::from(name).unwrap(), value };
        let readings = vec![
            reading("half-wave x", 44.0 + self.dice.between_minus_one_and_one()),
            reading("half-wave y", 43.0),
            reading("frame errors", 17.0),
        ];
        encode(&HealthBatch { ticks: vec![HealthTick { time_ns: self.now_ns, readings }] }).unwrap()
    }
}
