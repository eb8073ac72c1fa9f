//! The demo's report.

use isotherm_correction::units::Angle;

use crate::report::{Curve, Figure, Ink, Mark, Page, Panel, ReportError, Table, time_unit};

use super::fleet::{Kind, Member};
use super::score::minus;
use super::summary::{AXES, Summary, UnitSummary, arrow};
use super::switch::{Switch, Tick};
use super::watch::Watched;
use super::windows::{Mean, Spread, Stage, deg_per_h};

/// How much larger the raw error must be for the corrected one to get a diagram of its own.
const ENLARGE_FROM: f64 = 4.0;

/// The whole report as HTML.
pub(super) fn page(summary: &Summary, fleet: &[Member], watched: &[Watched]) -> Result<String, ReportError> {
    let mut page = Page::new("Isotherm demo: raw and corrected against the truth");
    for unit in &summary.units {
        page.headline(&headline(unit));
    }
    page.paragraph(
        "Three simulated units sent gyro, accelerometer and temperature ticks over Zenoh; the service corrected \
         each with its own calibration; a subscriber received the result. Raw is what the readings give with \
         nominal scale factor and input axes alone. The errors are differences from the simulation's exact rate, \
         averaged as the table says; rms is over all three axes, peak to peak that of the worst axis.",
    );
    let (head, rows) = summary.rows();
    page.table(&Table { head, rows });
    for ((unit, member), watched) in summary.units.iter().zip(fleet).zip(watched) {
        page.heading(&format!("{} unit {}", capitalised(member.kind.name()), member.id));
        page.paragraph(&member.story());
        page.figure(&rate_errors(unit, member, watched))?;
        if let Some(switch) = &watched.scored.switch {
            page.figure(&mode_switch(switch))?;
        }
    }
    Ok(page.to_html())
}

fn headline(unit: &UnitSummary) -> String {
    let errors = arrow(unit.raw_peak_to_peak_deg_per_h, unit.corrected_peak_to_peak_deg_per_h);
    format!("{} unit: {errors} °/h peak to peak (mean over {} s)", capitalised(unit.kind), unit.averaging_s)
}

/// Rate errors about the worst axis over time, and the temperature below.
fn rate_errors(unit: &UnitSummary, member: &Member, watched: &Watched) -> Figure {
    let means: &[Mean] = &watched.scored.means;
    let size = |stage, axis| Spread::about(means, stage, axis).peak_to_peak_deg_per_h;
    let axis = (0..3).max_by(|&a, &b| size(Stage::Raw, a).total_cmp(&size(Stage::Raw, b))).unwrap_or(0);
    let (divisor, symbol) = time_unit(member.scenario.duration_s);

    let error = |stage, name: &str, ink, mark| {
        let point = |mean: &Mean| [mean.time_s / divisor, deg_per_h(mean.error(stage)[axis])];
        curve(name, ink, mark, means.iter().map(point))
    };
    let panel = |title: &str, y_range, aspect, raw| Panel {
        title: title.to_owned(),
        y_label: "rate error, °/h".to_owned(),
        y_range,
        aspect,
        bands: Vec::new(),
        curves: vec![
            error(Stage::Raw, "raw", Ink::Raw, raw),
            error(Stage::Corrected, "corrected", Ink::Corrected, Mark::Line),
            curve(
                "truth",
                Ink::Truth,
                Mark::ThinLine,
                [0.0, member.scenario.duration_s / divisor].map(|x| [x, 0.0]).into_iter(),
            ),
        ],
    };

    let mut panels = vec![panel("", None, 0.22, Mark::Line)];
    if size(Stage::Raw, axis) > ENLARGE_FROM * size(Stage::Corrected, axis) {
        let corrected = means.iter().map(|mean| deg_per_h(mean.corrected[axis]));
        let [low, high] =
            corrected.fold([0.0_f64; 2], |[low, high], error| [low.min(error), high.max(error)]);
        let room = 0.25 * (high - low);
        panels.push(panel("the same, enlarged", Some([low - room, high + room]), 0.16, Mark::ThinLine));
    }
    panels.push(temperatures(member, watched, divisor));
    Figure {
        caption: format!(
            "Rate error of {} about the {} axis, the worst of the three: means over {} s of event time. \
             Below: temperature.",
            member.id, AXES[axis], unit.averaging_s
        ),
        x_label: format!("event time, {symbol}"),
        panels,
    }
}

fn temperatures(member: &Member, watched: &Watched, divisor: f64) -> Panel {
    let gyros = if member.kind == Kind::FibreOptic { "gyro coils, outermost layer" } else { "gyros" };
    let readings = &watched.scored.temperatures;
    Panel {
        title: String::new(),
        y_label: "temperature, °C".to_owned(),
        y_range: None,
        aspect: 0.14,
        bands: Vec::new(),
        curves: vec![
            curve(
                "chamber",
                Ink::Second,
                Mark::Line,
                readings.iter().map(|t| [t.time_s / divisor, t.chamber]),
            ),
            curve(gyros, Ink::First, Mark::Line, readings.iter().map(|t| [t.time_s / divisor, t.gyros])),
            curve("board", Ink::Third, Mark::Line, readings.iter().map(|t| [t.time_s / divisor, t.board])),
        ],
    }
}

/// Increments around one mode switch, and the angle error that they add up to.
fn mode_switch(switch: &Switch) -> Figure {
    // The axis about which the lost counts do most harm.
    let harm = |axis: usize| {
        switch.ticks.iter().map(|tick| (tick.raw[axis] - tick.truth[axis]).abs()).fold(0.0, f64::max)
    };
    let axis = (0..3).max_by(|&a, &b| harm(a).total_cmp(&harm(b))).unwrap_or(0);
    let time_ms = |end_s: f64| (end_s - switch.command_s) * 1e3;
    let increments = |name: &str, ink, mark, of: fn(&Tick) -> [f64; 3]| {
        curve(name, ink, mark, switch.ticks.iter().map(|tick| [time_ms(tick.end_s), arcsec(of(tick)[axis])]))
    };
    let interpolated = switch.ticks.iter().filter(|tick| tick.interpolated);
    let marked = interpolated.clone().map(|tick| [time_ms(tick.end_s), arcsec(tick.corrected[axis])]);
    let accumulated = |name: &str, ink, of: fn(&Tick) -> [f64; 3]| {
        let sums = switch.ticks.iter().scan(0.0, |sum, tick| {
            *sum += arcsec(minus(of(tick), tick.truth)[axis]);
            Some([time_ms(tick.end_s), *sum])
        });
        curve(name, ink, Mark::DottedLine, sums)
    };
    let until_ms = interpolated.map(|tick| time_ms(tick.end_s)).fold(0.0, f64::max);
    let bands = vec![[0.0, until_ms]];
    let panel = |title: &str, y_label: &str, aspect, curves| Panel {
        title: title.to_owned(),
        y_label: y_label.to_owned(),
        y_range: None,
        aspect,
        bands: bands.clone(),
        curves,
    };
    let total = |of: fn(&Tick) -> [f64; 3]| {
        switch.ticks.iter().map(|tick| arcsec(minus(of(tick), tick.truth)[axis])).sum::<f64>()
    };
    Figure {
        caption: format!(
            "One mode switch, {} axis. Shaded: the ticks whose counts carry nothing and are predicted instead; the \
             two-sided fit then restores their angle. Angle error at the right edge: raw {}″, corrected {}″ (the \
             quantisation of the counts, about 2″ each, is what remains).",
            AXES[axis],
            signed(total(|tick| tick.raw)),
            signed(total(|tick| tick.corrected)),
        ),
        x_label: "event time from the switch command, ms".to_owned(),
        panels: vec![
            panel(
                "angle increments",
                "arcsec per tick",
                0.2,
                vec![
                    increments("raw", Ink::Raw, Mark::DottedLine, |tick| tick.raw),
                    increments("corrected", Ink::Corrected, Mark::DottedLine, |tick| tick.corrected),
                    curve("interpolated", Ink::Corrected, Mark::Rings, marked),
                    increments("truth", Ink::Truth, Mark::ThinLine, |tick| tick.truth),
                ],
            ),
            panel(
                "angle error added up",
                "arcsec",
                0.14,
                vec![
                    accumulated("raw", Ink::Raw, |tick| tick.raw),
                    accumulated("corrected", Ink::Corrected, |tick| tick.corrected),
                ],
            ),
        ],
    }
}

fn curve(name: &str, ink: Ink, mark: Mark, points: impl Iterator<Item = [f64; 2]>) -> Curve {
    Curve { name: name.to_owned(), ink, mark, points: points.collect() }
}

fn arcsec(rad: f64) -> f64 {
    Angle::from_rad(rad).as_arcsec()
}

/// One decimal, with a real minus sign.
fn signed(value: f64) -> String {
    format!("{value:.1}").replace('-', "−")
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
