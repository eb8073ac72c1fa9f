//! What is to be noticed of a unit, and how grave it is.

use std::time::Duration;

use isotherm_correction::sample::SensorFlags;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::status::{
    ChannelStatus, Output, Place, PreLaunchVerdict, Rest, SensorStatus, State, Status,
};
use ratatui::style::Style;
use serde::Serialize;

use super::{Unit, figure, tone};

/// How long ago a fault may lie to count as one that is there now.
const RECENT: Duration = Duration::from_secs(60);
/// A status older than this is told of; services publish one a second unless configured otherwise.
const OLD: Duration = Duration::from_secs(10);

/// How grave something is, in rising order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// All is well.
    Fine,
    /// Worth knowing.
    Note,
    /// Outside the calibrated range, stale, without calibration: what comes out is worse than it could be.
    Warning,
    /// Nobody answers for the unit any more.
    Gone,
    /// A fault that is there now.
    Fault,
}

impl Level {
    /// Its colour.
    #[must_use]
    pub fn style(self) -> Style {
        match self {
            Self::Fine | Self::Note => tone::PLAIN,
            Self::Warning => tone::WARNING,
            Self::Gone => tone::DIM,
            Self::Fault => tone::FAULT,
        }
    }

    /// Its mark: what the colour says, without colour.
    #[must_use]
    pub fn mark(self, state: State) -> (&'static str, Style) {
        match self {
            Self::Fault => ("!", self.style()),
            Self::Gone => ("×", self.style()),
            Self::Warning => ("▲", self.style()),
            _ if state.is_running() => ("●", tone::GOOD),
            _ => ("○", tone::DIM),
        }
    }
}

/// Something to be noticed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Remark {
    /// How grave it is.
    pub level: Level,
    /// It in words, the important ones first: a narrow table cuts them off.
    pub words: String,
}

/// What a unit is doing, in one or two words: `±` stands for the reversal of the lasing mode.
#[must_use]
pub fn state_word(state: State) -> &'static str {
    match state {
        State::Standby => "standby",
        State::SelfTest => "self-test",
        State::PreLaunchCalibration => "pre-launch",
        State::RunningWithReversal => "running ±",
        State::RunningWithoutReversal => "running",
    }
}

/// Rates are not measured by services before 0.1.0, which do not name themselves either.
#[must_use]
pub fn knows_rates(status: &Status) -> bool {
    !status.instance.is_empty()
}

impl Unit<'_> {
    /// How it is, taken all together: a unit that is gone is that before all else.
    #[must_use]
    pub fn level(&self) -> Level {
        let gone = self.gone.map(|_| Level::Gone);
        gone.or(self.remarks().first().map(|remark| remark.level)).unwrap_or(Level::Fine)
    }

    /// What is to be noticed, the gravest first.
    #[must_use]
    pub fn remarks(&self) -> Vec<Remark> {
        let mut remarks = Vec::new();
        let mut add = |level, words: String| remarks.push(Remark { level, words });
        presence(self, &mut add);
        faults(self, &mut add);
        flow(self, &mut add);
        self.status.channels.iter().for_each(|channel| self::channel(channel, &mut add));
        self.status.sensors.iter().for_each(|sensor| self::sensor(sensor, &mut add));
        work(self.status, &mut add);
        // Stable: within a level the order above stays.
        remarks.sort_by_key(|remark| std::cmp::Reverse((remark.level == Level::Gone, remark.level)));
        remarks
    }
}

fn presence(unit: &Unit<'_>, add: &mut impl FnMut(Level, String)) {
    if let Some(gone) = unit.gone {
        add(Level::Gone, format!("gone for {}", figure::since(gone)));
    } else if unit.age > OLD {
        add(Level::Note, format!("last status {} ago", figure::since(unit.age)));
    }
}

fn faults(unit: &Unit<'_>, add: &mut impl FnMut(Level, String)) {
    let mut latest: Vec<_> = unit.status.faults.iter().collect();
    latest.sort_by_key(|fault| std::cmp::Reverse(fault.last_unix_ms));
    for fault in latest {
        let ago = figure::ago(fault.last_unix_ms, unit.now_unix_ms);
        let level = if ago <= RECENT { Level::Fault } else { Level::Note };
        let (count, ago) = (figure::count(fault.count), figure::since(ago));
        let kind = fault.kind.replace('_', " ");
        add(level, format!("{kind} {count}×, last {ago} ago: {}", fault.first));
    }
    // A service before 0.1.0 tells no more than this.
    if unit.status.faults.is_empty()
        && let Some(words) = &unit.status.last_fault
    {
        add(Level::Note, format!("last fault: {words}"));
    }
}

/// What comes in and goes out.
fn flow(unit: &Unit<'_>, add: &mut impl FnMut(Level, String)) {
    let Unit { status, lately, .. } = unit;
    if lately.stuck {
        add(Level::Fault, "nothing is published although raw ticks arrive".to_owned());
    }
    match status.output {
        Output::Calibrated => {}
        Output::PassThrough => add(Level::Warning, "no calibration: raw readings pass through".to_owned()),
        Output::Held => add(Level::Warning, "no calibration: nothing is published".to_owned()),
    }
    if knows_rates(status) && status.input_rates.gyro_ticks_per_s == 0.0 && unit.gone.is_none() {
        let level = if status.state.is_running() { Level::Warning } else { Level::Note };
        add(level, "no raw ticks arrive".to_owned());
    }
    let grown = [
        (lately.bad, "bad frame"),
        (lately.gaps, "gap"),
        (lately.late, "late message"),
        (lately.duplicates, "duplicate"),
    ];
    for (count, what) in grown.into_iter().filter(|(count, _)| *count > 0) {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        add(Level::Warning, format!("{} in the last minute", figure::of(count, what)));
    }
}

fn channel(channel: &ChannelStatus, add: &mut impl FnMut(Level, String)) {
    let (name, now) = (&channel.name, figure::temperature(channel.temperature_deg_c));
    let [low, high] = channel.calibrated_range_deg_c.unwrap_or_default();
    match channel.place {
        Some(Place::Above) => add(Level::Warning, format!("{name} {now} °C, calibrated to {high} °C")),
        Some(Place::Below) => add(Level::Warning, format!("{name} {now} °C, calibrated from {low} °C")),
        Some(Place::Inside) | None => {}
    }
    if channel.stale {
        add(Level::Warning, format!("{name} is stale"));
    } else if channel.warming_up {
        add(Level::Note, format!("{name} is warming up"));
    }
}

fn sensor(sensor: &SensorStatus, add: &mut impl FnMut(Level, String)) {
    let flags = sensor_words(sensor.flags);
    if !flags.is_empty() {
        add(Level::Fault, format!("{} is {}", super::sheet::sensor_name(sensor), flags.join(", ")));
    }
}

/// What is wrong with a sensor's own readings, by its flags.
///
/// The flag VALID is not among it: over a mode switch no gyro is valid, and all is well.
pub(super) fn sensor_words(flags: u8) -> Vec<&'static str> {
    let flags = SensorFlags::from_bits_truncate(flags);
    let words = [
        (SensorFlags::EXCLUDED, "excluded"),
        (SensorFlags::NOT_FINITE, "not finite"),
        (SensorFlags::OVERRANGE, "overrange"),
    ];
    words.into_iter().filter(|(flag, _)| flags.contains(*flag)).map(|(_, word)| word).collect()
}

/// What operators have set going.
fn work(status: &Status, add: &mut impl FnMut(Level, String)) {
    if let Some(report) = status.self_test.as_ref().filter(|report| !report.passed) {
        let failed: Vec<_> =
            report.items.iter().filter(|item| !item.passed).map(|item| item.name.as_str()).collect();
        add(Level::Fault, format!("self-test failed: {}; repeat it to clear this", failed.join(", ")));
    }
    if let Some(progress) = &status.pre_launch {
        let (share, left) = figure::progress(progress);
        add(Level::Note, format!("{:.0} % done, {left} left", share * 100.0));
    }
    if let Some(PreLaunchVerdict::Refused(reasons)) =
        status.pre_launch_outcome.as_ref().map(|outcome| &outcome.verdict)
    {
        add(Level::Warning, format!("pre-launch calibration refused: {}", reasons.join("; ")));
    }
    if let Some(pending) = &status.pending {
        let counter = pending.revision.counter;
        add(Level::Note, format!("revision {counter} waits: {}", schedule(pending.schedule, 0.0)));
    }
    match &status.rest {
        Some(Rest::Moved(words)) => add(Level::Note, format!("not at rest: {words}")),
        Some(Rest::Learning | Rest::Still) | None => {}
    }
}

/// When a change takes effect, and how long it takes.
pub(crate) fn schedule(schedule: Schedule, slew_s: f64) -> String {
    let slew =
        if slew_s > 0.0 { format!(", over {} s", (slew_s * 1e3).round() / 1e3) } else { String::new() };
    match schedule {
        Schedule::NextTick => format!("from the next tick on{slew}"),
        Schedule::Sequence(sequence) => format!("from tick {sequence} on{slew}"),
        Schedule::TimeNs(time_ns) => format!("from the first tick that ends at {time_ns} ns or later{slew}"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::samples;
    use super::*;

    fn seen(status: &Status) -> (Level, String) {
        let unit = Unit::now(status, samples::NOW_UNIX_MS);
        let words = unit.remarks().first().map_or_else(String::new, |remark| remark.words.clone());
        (unit.level(), words)
    }

    #[test]
    fn a_unit_that_runs_well_has_nothing_to_be_noticed() {
        assert_eq!(seen(&samples::running("U")), (Level::Fine, String::new()));
    }

    #[test]
    fn each_trouble_has_its_level_and_its_words() {
        let told = samples::troubles().into_iter().map(|(name, status, level)| {
            let (seen, first) = seen(&status);
            assert_eq!(seen, level, "{name}: {first}");
            format!("{name}: {first}\n")
        });
        insta::assert_snapshot!(told.collect::<String>());
    }

    #[test]
    fn a_fault_fades_with_time_and_the_gravest_comes_first() {
        let status = samples::faulty("U");
        let at = |seconds: i64| Unit::now(&status, samples::NOW_UNIX_MS + 1000 * seconds).level();
        assert_eq!((at(0), at(120)), (Level::Fault, Level::Note));
        // A clock that lies behind makes no fault older than it is.
        assert_eq!(at(-7200), Level::Fault);
    }

    #[test]
    fn a_unit_that_is_gone_is_that_before_all_else() {
        let status = samples::faulty("U");
        let unit = Unit { gone: Some(Duration::from_secs(75)), ..Unit::now(&status, samples::NOW_UNIX_MS) };
        assert_eq!(unit.level(), Level::Gone);
        assert_eq!(unit.remarks()[0].words, "gone for 75 s");
    }

    #[test]
    fn what_grows_is_a_warning_and_silence_in_spite_of_ticks_a_fault() {
        let status = samples::running("U");
        let lately = super::super::Lately { gaps: 1, ..Default::default() };
        let mut unit = Unit { lately, ..Unit::now(&status, samples::NOW_UNIX_MS) };
        assert_eq!(
            (unit.level(), unit.remarks()[0].words.as_str()),
            (Level::Warning, "1 gap in the last minute")
        );
        unit.lately.stuck = true;
        assert_eq!(unit.level(), Level::Fault);
    }
}
