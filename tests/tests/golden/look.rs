//! What a stream knows, in words that depend on values alone: names of types and fields may change.

use isotherm_correction::operation::{CheckItem, SelfTestReport};
use isotherm_correction::prelaunch::{ByMode, ModeTotals, Outcome};
use isotherm_correction::rest::Rest;
use isotherm_correction::sample::LasingMode;
use isotherm_correction::unit::{At, PreLaunchView, SensorHealth, Unit};
use isotherm_correction::units::Timestamp;
use isotherm_protocol::stream::{Edge, UnitStream};

use crate::recording::Recording;

/// Numbers by their bits. One NaN is like another: which one an operation gives is not said anywhere.
pub(crate) fn bits<const N: usize>(values: [f64; N]) -> String {
    values
        .map(|value| if value.is_nan() { "NaN".to_owned() } else { format!("{:x}", value.to_bits()) })
        .join(" ")
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "none".to_owned(), |value| bits([value]))
}

fn sign(mode: Option<LasingMode>) -> i8 {
    match mode {
        None => 0,
        Some(LasingMode::Plus) => 1,
        Some(LasingMode::Minus) => -1,
    }
}

/// Looks at a stream behind so many steps.
pub(crate) fn at(stream: &UnitStream, step: usize, recording: &mut Recording) {
    let unit = stream.unit();
    let mut say = |what: &str, words: String| recording.entry(format!("behind step {step}: {what}: {words}"));
    let pending = unit.pending().map(|(revision, at)| match at {
        At::NextTick => format!("{revision} next"),
        At::Sequence(sequence) => format!("{revision} at {sequence}"),
        At::TimeNs(time_ns) => format!("{revision} from {time_ns}"),
    });
    let heard = stream.heard().map(|heard| format!("{} {:x}", heard.frames, heard.crc)).join(" ");
    say("unit", format!("{} {pending:?} {} {heard}", unit.state(), stream.is_waiting()));
    say("waiting", format!("{} {}", unit.waiting_ticks(), stream.revision().counter));
    say("counters", counters(stream).join(" "));
    observation(unit, &mut say);
    for (kind, healths) in [("gyro", unit.gyro_health()), ("accelerometer", unit.accel_health())] {
        for (index, health) in healths.iter().enumerate() {
            say(&format!("health of {kind} {index}"), words_of(health));
        }
    }
    for channel in unit.channels() {
        let state = channel.state.map(|state| bits([state.temperature, state.rate, state.acceleration]));
        say(
            &format!("channel {}", channel.name),
            format!("{state:?} {} {}", channel.stale, channel.warming_up),
        );
    }
    if let Some(applied) = unit.applied() {
        say("applied", format!("{} {}", bits(applied.angular_rate), bits(applied.specific_force)));
    }
    drift(unit, &mut say);
    if let Some(report) = unit.self_test() {
        say("self-test", report_words(report));
    }
    if let Some(view) = unit.pre_launch() {
        say("pre-launch", pre_launch(&view));
    }
}

/// What can be said of a stream only in full.
pub(crate) fn at_the_end(stream: &UnitStream, recording: &mut Recording) {
    for counter in counters(stream) {
        recording.entry(format!("at the end: {counter}"));
    }
    let status = serde_json::to_value(stream.status(Edge::default())).unwrap();
    for (key, value) in status.as_object().unwrap() {
        recording.entry(format!("at the end: status: {key}={value}"));
    }
}

fn counters(stream: &UnitStream) -> Vec<String> {
    stream.counters().iter().map(|counter| format!("{}={}", counter.name, counter.value)).collect()
}

fn observation(unit: &Unit, say: &mut impl FnMut(&str, String)) {
    let Some(seen) = unit.observation() else { return };
    let (mode, flags) = (sign(seen.mode), seen.flags.bits());
    let (end_ns, duration_ns) = (seen.end_time.as_ns(), seen.duration.as_ns());
    let tick =
        format!("{} {end_ns} {duration_ns} {} {mode} {} {flags:x}", seen.sequence, seen.missed, seen.settled);
    say("observation", tick);
    for (index, gyro) in seen.gyros.iter().enumerate() {
        let values = [gyro.reading, gyro.rate, gyro.bias, gyro.drift, gyro.temperature_deg_c];
        say(&format!("gyro {index}"), format!("{} {:x}", bits(values), gyro.flags.bits()));
    }
    for (index, (reading, flags)) in seen.accels.iter().enumerate() {
        say(&format!("accelerometer {index}"), format!("{} {:x}", bits([reading]), flags.bits()));
    }
    say("seen in case axes", format!("{} {:?}", bits(seen.angular_rate), seen.specific_force.map(bits)));
}

fn words_of(health: &SensorHealth) -> String {
    let SensorHealth { flags, ticks, invalid, overrange, not_finite, clamped, stale, excluded } = health;
    format!("{:x} {ticks} {invalid} {overrange} {not_finite} {clamped} {stale} {excluded}", flags.bits())
}

fn drift(unit: &Unit, say: &mut impl FnMut(&str, String)) {
    for (index, estimate) in unit.drift().iter().enumerate() {
        let words = estimate.as_ref().map(|drift| {
            let values = bits([drift.rate, drift.sigma, drift.trend, drift.trend_sigma]);
            let last = drift.last_update.map(Timestamp::as_ns);
            format!("{values} {} {} {} {last:?}", drift.updates, drift.refused, drift.believed)
        });
        say(&format!("drift of gyro {index}"), format!("{words:?}"));
    }
    if let Some(at_rest) = unit.at_rest() {
        let words = match at_rest.rest() {
            Rest::Learning => "learning".to_owned(),
            Rest::Still => "still".to_owned(),
            Rest::Moved(moved) => {
                format!("{moved} {} {} {}", moved.axis, bits([moved.value, moved.limit]), moved.at.as_ns())
            }
        };
        say("rest", words);
    }
}

fn report_words(report: &SelfTestReport) -> String {
    let checks = report.checks.iter().map(|check| {
        let item = match check.item {
            CheckItem::Calibration => "calibration".to_owned(),
            CheckItem::Gyro(index) => format!("gyro {index}"),
            CheckItem::Accel(index) => format!("accelerometer {index}"),
            CheckItem::Temperature(name) => format!("temperature {name}"),
            CheckItem::Voltage(name) => format!("voltage {name}"),
            CheckItem::Counter(name) => format!("counter {name}"),
        };
        format!("{item} {} {} {}", optional(check.value), bits(check.limits), check.passed)
    });
    let ended = report.ended.map(Timestamp::as_ns);
    format!("{ended:?} {} {}", report.length.as_ns(), checks.collect::<Vec<_>>().join(", "))
}

fn modes(modes: &ByMode<ModeTotals>) -> String {
    let each = [modes.without, modes.plus, modes.minus];
    each.map(|mode| {
        format!("{} {} {}", mode.ticks, bits([mode.time_s]), optional(mode.mean_temperature_deg_c))
    })
    .join(", ")
}

fn mean_temperature(modes: &ByMode<ModeTotals>) -> Option<f64> {
    let each = [&modes.without, &modes.plus, &modes.minus];
    let time_s: f64 = each.iter().map(|mode| mode.time_s).sum();
    let sum: f64 = each.iter().filter_map(|mode| Some(mode.mean_temperature_deg_c? * mode.time_s)).sum();
    (time_s > 0.0).then(|| sum / time_s)
}

fn pre_launch(view: &PreLaunchView<'_>) -> String {
    match view {
        PreLaunchView::Aborted => "aborted".to_owned(),
        PreLaunchView::Running(progress) => {
            let gyros = progress.gyros.iter().map(|gyro| {
                let error = optional(gyro.standard_error_rad_per_s);
                format!("{} {} {error}", modes(&gyro.modes), optional(mean_temperature(&gyro.modes)))
            });
            let gyros: Vec<_> = gyros.collect();
            format!("{} of {}: {}", progress.elapsed.as_ns(), progress.duration.as_ns(), gyros.join("; "))
        }
        PreLaunchView::Ended(Outcome::Accepted(constants)) => {
            let gyros = constants.iter().map(|gyro| {
                let statics = bits([gyro.static_bias_change_rad_per_s, gyro.static_bias_sigma_rad_per_s]);
                let magnetic = [gyro.magnetic_bias_change_rad_per_s, gyro.magnetic_bias_sigma_rad_per_s];
                let magnetic = magnetic.map(optional).join(" ");
                format!("{statics} {magnetic} {} {}", bits([gyro.earth_rate_rad_per_s]), modes(&gyro.modes))
            });
            format!("accepted: {}", gyros.collect::<Vec<_>>().join("; "))
        }
        PreLaunchView::Ended(Outcome::Refused(refusals)) => {
            let words: Vec<_> = refusals.iter().map(ToString::to_string).collect();
            format!("refused: {}", words.join("; "))
        }
    }
}
