//! What of the fitted range of temperature the logs cover, and how often it was left.

use isotherm_correction::sample::{CorrectedTick, SensorFlags};
use isotherm_correction::unit::Unit;
use isotherm_pages::Table;

use crate::document::{Written, accelerometers};
use crate::numbers::real;
use crate::report::{or_dash, short};

/// Share of the fitted range that a judgement should cover.
const ENOUGH: f64 = 0.5;
/// Share of ticks outside the fitted range that is worth a warning.
const CLAMPED: f64 = 0.001;

/// One channel.
#[derive(Debug)]
struct ChannelRange {
    name: String,
    fitted: Option<[f64; 2]>,
    seen: Option<[f64; 2]>,
    rate: Option<[f64; 2]>,
}

/// What is wrong with ticks of which each sensor's are counted.
const FAULTS: [&str; 3] = [
    "are outside the fitted range of temperature, where terms are clamped",
    "are without a fresh temperature",
    "are without a valid reading",
];

/// One sensor.
#[derive(Debug)]
struct Sensor {
    name: String,
    ticks: u64,
    /// Ticks with each of [`FAULTS`].
    faults: [u64; 3],
}

/// What the runs cover.
#[derive(Debug)]
pub(super) struct Coverage {
    channels: Vec<ChannelRange>,
    /// Gyros first.
    sensors: Vec<Sensor>,
}

impl Coverage {
    /// Of a document, nothing seen yet.
    pub(super) fn of(written: &Written) -> Self {
        let calibration = &written.loaded.calibration;
        let channel = |(index, channel): (usize, &isotherm_correction::channel::Channel)| ChannelRange {
            name: channel.name().to_string(),
            fitted: calibration.range_of(index),
            seen: None,
            rate: None,
        };
        let document = &written.document;
        let gyros = document.gyro.sensor.iter().map(|gyro| format!("gyro {}", gyro.name));
        let accels = accelerometers(document).iter().map(|accel| format!("accelerometer {}", accel.name));
        let sensor = |name: String| Sensor { name, ticks: 0, faults: [0; 3] };
        Self {
            channels: calibration.channels().iter().enumerate().map(channel).collect(),
            sensors: gyros.chain(accels).map(sensor).collect(),
        }
    }

    /// Counts a tick, with the unit as it stands behind it.
    pub(super) fn count(&mut self, tick: &CorrectedTick, unit: &Unit) {
        for (sensor, flags) in self.sensors.iter_mut().zip(tick.gyro_flags.iter().chain(&tick.accel_flags)) {
            let found = [
                flags.contains(SensorFlags::CLAMPED_TEMPERATURE),
                flags.contains(SensorFlags::STALE_TEMPERATURE),
                !flags.contains(SensorFlags::VALID),
            ];
            sensor.ticks += 1;
            sensor.faults.iter_mut().zip(found).for_each(|(count, found)| *count += u64::from(found));
        }
        for (channel, report) in self.channels.iter_mut().zip(unit.channels()) {
            if let Some(state) = report.state.filter(|_| !report.stale) {
                widen(&mut channel.seen, state.temperature);
                if !report.warming_up {
                    widen(&mut channel.rate, state.rate);
                }
            }
        }
    }

    /// Names of the channels that there was no reading of.
    fn unseen(&self) -> Vec<&str> {
        let unseen = self.channels.iter().filter(|channel| channel.seen.is_none());
        unseen.map(|channel| channel.name.as_str()).collect()
    }

    /// Names of the channels, where there was no reading of any of them.
    pub(super) fn silent(&self) -> Option<String> {
        let unseen = self.unseen();
        (!unseen.is_empty() && unseen.len() == self.channels.len()).then(|| unseen.join(", "))
    }

    /// What is to be looked at: one sentence of each kind, however many channels or sensors it is about.
    pub(super) fn warnings(&self) -> Vec<String> {
        let silent = self.unseen();
        let mut warnings = Vec::new();
        if !silent.is_empty() {
            warnings.push(format!(
                "no readings of temperature channel {}: its sensors were at the assumed temperature throughout; is \
                 it in the log, under this name?",
                silent.join(", ")
            ));
        }
        let little: Vec<String> = self.channels.iter().filter_map(ChannelRange::covers_little).collect();
        if !little.is_empty() {
            warnings.push(format!(
                "of the fitted range of temperature the logs cover {}: the rest is not judged",
                little.join(", ")
            ));
        }
        for (fault, what) in FAULTS.iter().enumerate() {
            let shares = self.sensors.iter().map(|sensor| (sensor.shares()[fault], &sensor.name));
            let many: Vec<String> = shares
                .filter(|(share, _)| *share > CLAMPED)
                .map(|(share, name)| format!("{:.1} % of {name}", share * 100.0))
                .collect();
            if !many.is_empty() {
                warnings.push(format!("of the ticks, {} {what}", many.join(", ")));
            }
        }
        warnings
    }

    /// Ranges, and shares of flagged ticks.
    pub(super) fn tables(&self) -> Vec<(String, Table)> {
        let range = |range: Option<[f64; 2]>, digits: usize| {
            or_dash(range.map(|[low, high]| format!("{low:.digits$}…{high:.digits$}")))
        };
        let channel = |channel: &ChannelRange| {
            let rate = channel.rate.map(|rate| rate.map(|rate| rate * 60.0));
            vec![
                channel.name.clone(),
                range(channel.seen, 1),
                range(channel.fitted, 1),
                or_dash(channel.covered().map(|share| format!("{:.0} %", share * 100.0))),
                range(rate, 2),
            ]
        };
        let sensor = |sensor: &Sensor| {
            let shares = sensor.shares().map(|share| format!("{} %", short(share * 100.0)));
            [sensor.name.clone(), sensor.ticks.to_string()].into_iter().chain(shares).collect()
        };
        let head = ["channel", "seen, °C", "fitted, °C", "covered", "rate, °C/min"];
        let channels = Table::of(head, self.channels.iter().map(channel));
        let head = ["sensor", "ticks", "clamped", "temperature stale", "not valid"];
        let sensors = Table::of(head, self.sensors.iter().map(sensor));
        vec![("Temperature".to_owned(), channels), ("Flags".to_owned(), sensors)]
    }
}

impl ChannelRange {
    /// Share of the fitted range that was seen; `None` where nothing was fitted over its temperature.
    fn covered(&self) -> Option<f64> {
        let [low, high] = self.fitted.filter(|[low, high]| high > low)?;
        let Some([from, to]) = self.seen else { return Some(0.0) };
        Some(((to.min(high) - from.max(low)) / (high - low)).clamp(0.0, 1.0))
    }

    /// How little of it was seen, in words; `None` where it is enough.
    fn covers_little(&self) -> Option<String> {
        let share = self.covered().filter(|share| *share < ENOUGH)?;
        let ([from, to], [low, high]) = (self.seen?, self.fitted?);
        let name = &self.name;
        Some(format!("{:.0} % of {name} ({from:.1}…{to:.1} of {low:.1}…{high:.1} °C)", share * 100.0))
    }
}

impl Sensor {
    /// Shares of its ticks with each of [`FAULTS`].
    fn shares(&self) -> [f64; 3] {
        self.faults.map(|count| if self.ticks == 0 { 0.0 } else { real(count) / real(self.ticks) })
    }
}

fn widen(range: &mut Option<[f64; 2]>, value: f64) {
    let [low, high] = range.unwrap_or([value; 2]);
    *range = Some([low.min(value), high.max(value)]);
}
