//! Frames and events in, frames out.

use std::sync::{Arc, LazyLock};

use isotherm_correction::calibration::Calibration;
use isotherm_correction::operation::Command;
use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, LasingMode, OutputKind, TemperatureReading, TickFlags,
};
use isotherm_correction::unit::{At, Change, UnitSettings};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::{Message, decode, encode};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::document::Document;
use isotherm_protocol::key::{Input, RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, HealthBatch, TemperatureBatch};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::stream::{Label, UnitStream};

use crate::cursor::Cursor;
use crate::frames::sealed;
use crate::said::in_few_words;

/// Shipped documents of every kind of unit.
static CALIBRATIONS: LazyLock<Vec<Arc<Calibration>>> = LazyLock::new(|| {
    let texts = [
        include_str!("../../config/calibration/ZLG-0001.toml"),
        include_str!("../../config/calibration/chamber-mems.toml"),
        include_str!("../../config/calibration/FOG-0001.toml"),
        include_str!("../../config/calibration/example-full.toml"),
        include_str!("../../config/calibration/rlg-static.toml"),
    ];
    let parse = |text| Arc::new(Document::parse(text, None).expect("a shipped document").calibration);
    texts.into_iter().map(parse).collect()
});

/// Ticks are this far apart (ns).
const STEP_NS: i64 = 5_000_000;

/// What the outputs say of themselves.
#[derive(Debug, Default)]
struct Account {
    given: u64,
    announced: u64,
    last: Option<u64>,
}

impl Account {
    /// Takes what is ready: each tick goes on where the one before it ended, but for what it announces as missing.
    fn take(&mut self, stream: &mut UnitStream) {
        let mut frame = Vec::new();
        while stream.next_frame(&mut frame).is_some() {
            let batch: CorrectedBatch = decode(&frame).expect("a stream's own frame");
            for tick in batch.ticks {
                let ticks = u64::from(tick.ticks.max(1));
                let first = tick.sequence.checked_sub(ticks - 1).expect("as many ticks as there were");
                if let Some(last) = self.last.filter(|_| !tick.flags.contains(TickFlags::RESTART)) {
                    let said = last.checked_add(1).and_then(|next| next.checked_add(tick.missed));
                    assert_eq!(said, Some(first), "lost or doubled without a word: {tick:?}");
                }
                let numbers = tick.delta_angle.iter().chain(&tick.delta_velocity);
                assert!(numbers.clone().all(|number| number.is_finite()), "{tick:?}");
                self.given += ticks;
                self.announced = self.announced.saturating_add(tick.missed);
                self.last = Some(tick.sequence);
            }
        }
    }
}

/// Takes everything that is ready, and checks it.
pub fn outputs(stream: &mut UnitStream) {
    Account::default().take(stream);
}

/// Gives a stream a few ticks that nothing is wrong with.
pub fn good_ticks(stream: &mut UnitStream, first: u64, count: u64) {
    for sequence in first..first + count {
        let end_time = Timestamp::from_ns(STEP_NS * (1 + i64::try_from(sequence).unwrap_or(0)));
        let (duration, readings) = (Span::from_ns(STEP_NS), [0.1, 0.2, 0.3].into_iter().collect());
        let tick = GyroTick { sequence, end_time, duration, readings, ..GyroTick::default() };
        let batch = GyroBatch { output: OutputKind::Mean, ticks: vec![tick] };
        give(stream, RawStream::Gyro, &batch);
    }
}

fn give(stream: &mut UnitStream, to: RawStream, message: &impl Message) {
    let Ok(frame) = encode(message) else { return };
    stream.receive(to, &frame).expect("a frame of its kind");
}

/// A producer that stumbles.
struct Producer {
    sequence: u64,
    series: u64,
    time_ns: i64,
    output: OutputKind,
    sensors: usize,
}

/// Good ticks with now and then something wrong, frames of anything, swaps, commands, memory: nothing panics, every tick is given
/// once or announced, every number is one, and a stream goes on from its memory.
pub fn stream(input: &[u8]) {
    let mut from = Cursor(input);
    let Ok(unit) = UnitId::new("U-1") else { return };
    let first = from.some();
    let settings = UnitSettings {
        in_standby: first & 1 != 0,
        subtract_drift: first & 2 != 0,
        ..UnitSettings::default()
    };
    let mut stream = UnitStream::new(unit, settings);
    let output = if first & 4 != 0 { OutputKind::Counts } else { OutputKind::Mean };
    let mut producer = Producer { sequence: 0, series: 0, time_ns: 0, output, sensors: 3 };
    let mut account = Account::default();
    let mut is_simple = !settings.in_standby;
    while let Some(choice) = from.byte() {
        match choice % 16 {
            0..=5 => producer.ticks(&mut stream, &mut from),
            6 => temperatures(&mut stream, producer.time_ns, &mut from),
            7 => reference(&mut stream, producer.time_ns, &mut from),
            8 | 9 => anything(&mut stream, &mut from),
            10 => swap(&mut stream, &producer, &mut from),
            11 => {
                is_simple = false;
                command(&mut stream, &mut from);
            }
            12 => stream.flush(),
            13 => {
                let memory = stream.memory();
                let again = UnitStream::from_memory(&memory).expect("its own memory");
                assert!(again.memory() == memory, "another memory after one");
                stream = again;
            }
            14 => producer.stumble(&mut from),
            _ => account.take(&mut stream),
        }
    }
    stream.flush();
    account.take(&mut stream);
    let counters = stream.unit().counters();
    assert!(account.given <= counters.gyro_ticks_in, "{account:?} {counters:?}");
    if is_simple {
        // Where nobody held ticks back, whatever came in was given or counted by its reason.
        let passed_over = counters.gyro_duplicates + counters.gyro_late + counters.gyro_implausible;
        let refused = counters.wrong_sensor_count + counters.wrong_output_kind + counters.bad_duration;
        let accounted = account.given + passed_over + refused;
        assert!(accounted >= counters.gyro_ticks_in, "{account:?} {counters:?}");
    }
}

impl Producer {
    /// One to eight ticks of gyros, accelerometers or both.
    fn ticks(&mut self, stream: &mut UnitStream, from: &mut Cursor<'_>) {
        let shape = from.some();
        let count = shape % 8 + 1;
        let Self { sequence, series, time_ns, output, sensors } = *self;
        let (mut gyros, mut accels) = (Vec::new(), Vec::new());
        for index in 0..count {
            let end_time = Timestamp::from_ns(time_ns.saturating_add(STEP_NS * (1 + i64::from(index))));
            let (sequence, duration) = (sequence.saturating_add(index.into()), Span::from_ns(STEP_NS));
            let readings: Vec<f64> = (0..sensors).map(|_| reading(output, from)).collect();
            let readings = || readings.iter().copied().collect();
            let mode = [None, Some(LasingMode::Plus), Some(LasingMode::Minus)];
            let bits = if shape & 32 != 0 { from.some() } else { 0 };
            let gyro = GyroTick {
                mode: mode[usize::from(bits % 3)],
                switch_command: bits & 64 != 0,
                meander: mode[usize::from(bits / 4 % 3)],
                ..GyroTick {
                    sequence,
                    end_time,
                    duration,
                    readings: readings(),
                    series,
                    ..GyroTick::default()
                }
            };
            accels.push(AccelTick { sequence, end_time, duration, readings: readings() });
            gyros.push(gyro);
        }
        if shape & 64 != 0
            && let Some(tick) = gyros.last_mut()
        {
            match from.some() % 4 {
                0 => tick.sequence = from.number(),
                1 => tick.end_time = Timestamp::from_ns(from.number().cast_signed()),
                2 => tick.duration = Span::from_ns(from.number().cast_signed()),
                _ => tick.readings.resize(tick.readings.len().min(usize::from(from.some() % 8))),
            }
        }
        if shape & 8 == 0 {
            give(stream, RawStream::Accel, &AccelBatch { output, ticks: accels });
        }
        if shape & 16 == 0 {
            give(stream, RawStream::Gyro, &GyroBatch { output, ticks: gyros });
        }
        self.sequence = sequence.saturating_add(count.into());
        self.time_ns = time_ns.saturating_add(STEP_NS * i64::from(count));
    }

    /// Something is otherwise from here on.
    fn stumble(&mut self, from: &mut Cursor<'_>) {
        let step = from.some();
        match from.some() % 8 {
            0 => self.sequence = self.sequence.saturating_add(step.into()),
            1 => self.sequence = self.sequence.saturating_sub(step.into()),
            2 => self.series = from.number(),
            3 => self.time_ns = self.time_ns.saturating_add(i64::from(step) * STEP_NS),
            4 => self.time_ns = self.time_ns.saturating_sub(i64::from(step) * STEP_NS),
            5 => self.sensors = usize::from(step % 9),
            6 => (self.sequence, self.time_ns) = (from.number(), from.number().cast_signed()),
            _ => {
                // Ticks that never come.
                self.sequence = self.sequence.saturating_add(step.into());
                self.time_ns = self.time_ns.saturating_add(i64::from(step) * STEP_NS);
            }
        }
    }
}

/// A reading, mostly a small one.
fn reading(output: OutputKind, from: &mut Cursor<'_>) -> f64 {
    match (from.some(), output) {
        (250..=255, OutputKind::Mean) => f64::from_bits(from.number()),
        (byte, OutputKind::Mean) => f64::from(byte) * 1e-3,
        (250..=255, OutputKind::Counts) => f64::from(i32::MIN),
        (byte, OutputKind::Counts) => f64::from(byte),
    }
}

fn temperatures(stream: &mut UnitStream, time_ns: i64, from: &mut Cursor<'_>) {
    let names = ["gyro0", "gyro1", "gyro2", "accel0", "board", "housing", "imu"];
    let shape = from.some();
    let late_ns = i64::from(from.some()) * 1_000_000;
    let raw = if shape & 128 != 0 { f64::from_bits(from.number()) } else { f64::from(from.some()) - 100.0 };
    let name = names.get(usize::from(shape & 7)).copied().unwrap_or("temperature");
    let Ok(channel) = ChannelName::from(name) else { return };
    let time = Timestamp::from_ns(time_ns.saturating_sub(late_ns));
    let batch = TemperatureBatch { readings: vec![TemperatureReading { channel, time, raw }] };
    give(stream, RawStream::Temperature, &batch);
}

fn reference(stream: &mut UnitStream, end_ns: i64, from: &mut Cursor<'_>) {
    let span_ns = i64::from(from.some()) * 10_000_000;
    let rate = f64::from(from.some()) * 1e-6;
    let reference = Reference {
        start_ns: end_ns.saturating_sub(span_ns),
        end_ns,
        angular_rate_rad_per_s: [rate; 3],
        sigma_rad_per_s: f64::from(from.some()) * 1e-8,
    };
    let Ok(frame) = encode(&reference) else { return };
    stream.receive(Input::Reference, &frame).expect("a frame of its kind");
}

/// A frame of which nothing is known but its kind.
fn anything(stream: &mut UnitStream, from: &mut Cursor<'_>) {
    let input = Input::ALL[usize::from(from.some()) % Input::ALL.len()];
    let count = usize::from(from.some());
    let bytes = from.bytes(count);
    let frame = match input {
        Input::Raw(RawStream::Gyro) => sealed::<GyroBatch>(bytes),
        Input::Raw(RawStream::Accel) => sealed::<AccelBatch>(bytes),
        Input::Raw(RawStream::Temperature) => sealed::<TemperatureBatch>(bytes),
        Input::Raw(RawStream::Health) => sealed::<HealthBatch>(bytes),
        Input::Reference => sealed::<Reference>(bytes),
    };
    if let Err(error) = stream.receive(input, frame.as_deref().unwrap_or(bytes)) {
        in_few_words(&error);
    }
}

fn swap(stream: &mut UnitStream, producer: &Producer, from: &mut Cursor<'_>) {
    let shape = from.some();
    let Some(calibration) = CALIBRATIONS.get(usize::from(shape) % CALIBRATIONS.len()) else { return };
    let ahead = from.some();
    let at = match shape / 8 % 4 {
        0 => At::Sequence(producer.sequence.saturating_add(ahead.into())),
        1 => At::TimeNs(producer.time_ns.saturating_add(i64::from(ahead) * STEP_NS)),
        _ => At::NextTick,
    };
    let slew = Span::from_ms(u32::from(from.some() & 15));
    let change = Change { calibration: Arc::clone(calibration), revision: stream.next_counter(), at, slew };
    let _ = stream.schedule(change, Label::default());
}

fn command(stream: &mut UnitStream, from: &mut Cursor<'_>) {
    let command = match from.some() % 8 {
        0 => Command::Standby,
        1 => Command::SelfTest,
        2 => Command::PreLaunch(isotherm_correction::prelaunch::PreLaunchSettings::default()),
        3 => Command::Abort,
        4 => Command::EndRest,
        5 => return stream.expire_self_test(),
        6 => return stream.end_pre_launch(),
        _ => Command::Run { reversal: [None, Some(true), Some(false)][usize::from(from.some() % 3)] },
    };
    if let Err(refusal) = stream.command(&command) {
        in_few_words(&refusal);
    }
}
