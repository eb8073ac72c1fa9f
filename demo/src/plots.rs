//! The demo's report.

use isotherm_correction::units::Angle;
use isotherm_pages::{Axis, Chart, Content, Ink, Lane, Page, Panel, Series, Stretch, Table};

use super::fleet::Member;
use super::score::{Temperatures, minus};
use super::summary::{AXES, Summary, UnitSummary, arrow};
use super::switch::{Switch, Tick};
use super::watch::Watched;
use super::windows::{CORRECTED, Mean, RAW, Spread, Stage, deg_per_h};

/// How much larger the raw error must be for the corrected one to get a diagram of its own.
const ENLARGE_FROM: f64 = 4.0;

/// The whole report as HTML.
pub(crate) fn page(summary: &Summary, fleet: &[Member], watched: &[Watched]) -> String {
    let mut page = Page::new("Isotherm demo: raw and corrected against the truth");
    for unit in &summary.units {
        page.headline(&headline(unit));
    }
    page.paragraph(
        "Three simulated units sent gyro, accelerometer and temperature ticks over Zenoh; the service corrected each \
         with its own calibration; a subscriber received the result. Raw: readings with nominal scale factor and \
         input axes only. Errors are differences from the simulated rate, averaged as in the table; rms is over all \
         three axes, peak to peak of the worst axis.",
    );
    let (head, rows) = summary.rows();
    page.table(&Table { head, rows });
    for ((unit, member), watched) in summary.units.iter().zip(fleet).zip(watched) {
        page.heading(&format!("{} unit {}", capitalised(member.kind.name), member.id));
        page.paragraph(&member.story());
        page.chart(&rate_errors(unit, member, watched));
        if let Some(switch) = &watched.scored.switch {
            page.chart(&mode_switch(switch));
        }
    }
    page.to_html()
}

fn headline(unit: &UnitSummary) -> String {
    let errors = arrow(unit.raw_peak_to_peak_deg_per_h, unit.corrected_peak_to_peak_deg_per_h);
    format!("{} unit: {errors} °/h peak to peak (mean over {} s)", capitalised(unit.kind), unit.averaging_s)
}

/// Rate errors about the worst axis over time, and the temperature below.
fn rate_errors(unit: &UnitSummary, member: &Member, watched: &Watched) -> Chart {
    let means: &[Mean] = &watched.scored.means;
    let size = |stage, axis| Spread::about(means, stage, axis).peak_to_peak_deg_per_h;
    let axis = (0..3).max_by(|&a, &b| size(RAW, a).total_cmp(&size(RAW, b))).unwrap_or(0);

    let error = |stage: Stage, name, ink| {
        Series::line(name, ink, means.iter().map(|mean| (mean.time_s, deg_per_h(stage(mean)[axis]))))
    };
    let raw = || error(RAW, "raw", Ink::Raw);
    let corrected = || error(CORRECTED, "corrected", Ink::Corrected);
    let truth = || Series::line("truth", Ink::Truth, [(0.0, 0.0), (member.scenario.duration_s, 0.0)]);

    let mut panels = vec![Panel::of("rate error", "°/h", 210, vec![raw(), corrected(), truth()])];
    if size(RAW, axis) > ENLARGE_FROM * size(CORRECTED, axis) {
        panels.push(Panel::of("rate error, corrected alone", "°/h", 140, vec![corrected(), truth()]));
    }
    panels.push(temperatures(member, watched));
    Chart::of(
        format!(
            "Rate error of {} about the {} axis, the worst of the three: means over {} s of event time. \
             Below: temperature.",
            member.id, AXES[axis], unit.averaging_s
        ),
        Axis::of("event time", "s"),
        panels,
    )
}

fn temperatures(member: &Member, watched: &Watched) -> Panel {
    let readings = &watched.scored.temperatures;
    let of = |name, ink, value: fn(&Temperatures) -> f64| {
        Series::line(name, ink, readings.iter().map(|reading| (reading.time_s, value(reading))))
    };
    let curves = vec![
        of("chamber", Ink::Second, |reading| reading.chamber),
        of(member.kind.gyros, Ink::First, |reading| reading.gyros),
        of("board", Ink::Third, |reading| reading.board),
    ];
    Panel::of("temperature", "°C", 120, curves)
}

/// Increments around one mode switch, and the angle error that they add up to.
fn mode_switch(switch: &Switch) -> Chart {
    // The axis about which the lost counts do most harm.
    let harm = |axis: usize| {
        let off = |tick: &Tick| (tick.sent.raw[axis] - tick.sent.truth[axis]).abs();
        switch.ticks.iter().map(off).fold(0.0, f64::max)
    };
    let axis = (0..3).max_by(|&a, &b| harm(a).total_cmp(&harm(b))).unwrap_or(0);
    let time_ms = |end_s: f64| (end_s - switch.command_s) * 1e3;
    let increments = |name, ink, of: fn(&Tick) -> [f64; 3]| {
        let points = switch.ticks.iter().map(|tick| (time_ms(tick.sent.end_s), arcsec(of(tick)[axis])));
        Series::line(name, ink, points)
    };
    let interpolated = switch.ticks.iter().filter(|tick| tick.interpolated);
    let accumulated = |name, ink, of: fn(&Tick) -> [f64; 3]| {
        let sums = switch.ticks.iter().scan(0.0, |sum, tick| {
            *sum += arcsec(minus(of(tick), tick.sent.truth)[axis]);
            Some((time_ms(tick.sent.end_s), *sum))
        });
        Series::line(name, ink, sums)
    };
    let to = interpolated.map(|tick| time_ms(tick.sent.end_s)).fold(0.0, f64::max);
    let predicted = Stretch { from: 0.0, to, label: "predicted".to_owned(), ink: Ink::Third };
    let lanes = vec![Lane::Stretches { name: "counts".to_owned(), stretches: vec![predicted] }];
    let total = |of: fn(&Tick) -> [f64; 3]| {
        switch.ticks.iter().map(|tick| arcsec(minus(of(tick), tick.sent.truth)[axis])).sum::<f64>()
    };
    Chart::of(
        format!(
            "One mode switch, {} axis. The counts of the ticks in the bar are meaningless and are predicted; the \
             two-sided fit then restores their angle. Angle error at the right edge: raw {}″, corrected {}″ (what \
             remains is quantisation, about 2″ per count).",
            AXES[axis],
            signed(total(|tick| tick.sent.raw)),
            signed(total(|tick| tick.corrected)),
        ),
        Axis::of("event time from the switch command", "ms"),
        vec![
            Panel::of(
                "angle increments",
                "″ per tick",
                190,
                vec![
                    increments("raw", Ink::Raw, |tick| tick.sent.raw),
                    increments("corrected", Ink::Corrected, |tick| tick.corrected),
                    increments("truth", Ink::Truth, |tick| tick.sent.truth),
                ],
            ),
            Panel { content: Content::Lanes(lanes), ..Panel::of("", "", 0, Vec::new()) },
            Panel::of(
                "accumulated angle error",
                "″",
                130,
                vec![
                    accumulated("raw", Ink::Raw, |tick| tick.sent.raw),
                    accumulated("corrected", Ink::Corrected, |tick| tick.corrected),
                ],
            ),
        ],
    )
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
