//! The terms of a document as curves.

use isotherm_pages::{Axis, Chart, Ink, Panel, Series};

use super::terms::Term;
use super::{ARGUMENTS, Sum, ramp_words, settled, spoken, steady, sums};
use crate::document::Written;
use crate::numbers::{ARCSEC_PER_RAD, Size, once_each, places};
use crate::report::Report;

/// Points of a curve.
const POINTS: usize = 201;
/// Height of a panel (CSS pixels).
pub(crate) const HEIGHT: u32 = 150;

/// Adds them all.
pub(super) fn charts(sheet: &mut Report, written: &Written, terms: &[Term], range: [f64; 2]) {
    let sums = sum_panels(written, range);
    let caption =
        format!("All terms together, {}, all channels at one temperature.", settled([&written.document]));
    let temperature = || Axis::of("temperature", "°C");
    sheet.chart("Bias in all", Chart::of(caption, temperature(), sums));
    for [argument, label, words, _] in ARGUMENTS {
        for (kind, sensors) in [("gyro", "Gyros"), ("accel", "Accelerometers")] {
            // A sensor has its colour wherever it has a curve: a term need not be in all of them.
            let all = once_each(terms.iter().filter(|term| term.kind == kind).map(|term| &*term.sensor));
            let mine: Vec<&Term> =
                terms.iter().filter(|term| term.kind == kind && term.argument == argument).collect();
            // A constant is in the tables; curves of one kind of term that are all constant show nothing.
            let varying = |name: &str| mine.iter().any(|term| term.name == name && term.range.is_some());
            let names = once_each(mine.iter().map(|term| term.name.as_str()).filter(|name| varying(name)));
            let panels = names.into_iter().map(|name| {
                let of_name: Vec<&&Term> = mine.iter().filter(|term| term.name == name).collect();
                let coloured = all.iter().zip(Ink::several()).filter_map(|(sensor, ink)| {
                    Some((of_name.iter().find(|term| term.sensor == **sensor)?, ink))
                });
                let curves = coloured.map(|(term, ink)| {
                    let over = term.range.unwrap_or(range);
                    let points = places(over, POINTS).into_iter().map(|x| (x, term.at(x).0));
                    Series::line(&term.sensor, ink, points)
                });
                let unit = of_name.first().map_or("", |term| term.unit.as_str());
                Panel::of(spoken(name), unit, HEIGHT, curves.collect())
            });
            let heading = format!("{sensors} over {words}");
            let axis = Axis::of(label, argument);
            sheet.chart(&heading, Chart::of("Each term over its fitted range.", axis, panels.collect()));
        }
    }
    let caption = "Turn of each input axis from the middle of the range.";
    sheet.chart("Input axes", Chart::of(caption, temperature(), axes(written, range)));
}

/// Biases in all; those that are constant stand in the table.
fn sum_panels(written: &Written, range: [f64; 2]) -> Vec<Panel> {
    let at = places(range, POINTS);
    let varies = |sum: &Sum| sum.ramps.iter().any(|(_, values)| Size::of(values).peak_to_peak > 0.0);
    let panel = |sum: Sum| {
        let curves =
            sum.ramps.into_iter().zip(Ink::several()).map(|((ramp, values), ink)| {
                Series::line(ramp_words(ramp), ink, at.iter().copied().zip(values))
            });
        Panel::of(sum.name, sum.unit, HEIGHT, curves.collect())
    };
    sums(written, &at).into_iter().filter(varies).map(panel).collect()
}

fn axes(written: &Written, range: [f64; 2]) -> Vec<Panel> {
    let document = &written.document;
    let middle = 0.5 * (range[0] + range[1]);
    let at = places(range, POINTS);
    let of = |what: &str, names: Vec<&str>, rows: &dyn Fn(f64) -> Vec<[f64; 3]>| {
        let centre = rows(middle);
        let curves = names.into_iter().enumerate().zip(Ink::several()).map(|((index, name), ink)| {
            let turned = |x: &f64| {
                let row = rows(*x).get(index).copied().unwrap_or([f64::NAN; 3]);
                let from = centre.get(index).copied().unwrap_or([f64::NAN; 3]);
                let squares = row.iter().zip(from).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
                (*x, libm::sqrt(squares) * ARCSEC_PER_RAD)
            };
            Series::line(name, ink, at.iter().map(turned))
        });
        Panel::of(what, "″", HEIGHT, curves.collect())
    };
    let mut panels = Vec::new();
    if document.gyro.orientation.thermal.is_some() {
        let names = document.gyro.sensor.iter().map(|sensor| sensor.name.as_str()).collect();
        panels.push(of("gyros", names, &|x| steady(written, x, 0.0).gyro_axes.to_vec()));
    }
    if let Some(accel) = document.accel.as_ref().filter(|accel| accel.orientation.thermal.is_some()) {
        let names = accel.sensor.iter().map(|sensor| sensor.name.as_str()).collect();
        panels.push(of("accelerometers", names, &|x| steady(written, x, 0.0).accel_axes.to_vec()));
    }
    panels
}
