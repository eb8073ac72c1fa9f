//! The terms of a document as curves.

use isotherm_correction::units::{AngularRate, SpecificForce};
use isotherm_pages::{Axis, Chart, Content, Form, Ink, Panel, Samples, Series};

use super::about::ARCSEC;
use super::terms::Term;
use super::{RAMPS, lasing_mode, places, ramp_words, spoken, steady};
use crate::report::Sheet;
use crate::size::Size;
use crate::written::Written;

/// Points of a curve.
const POINTS: usize = 201;

/// Adds them all.
pub(super) fn charts(sheet: &mut Sheet, written: &Written, terms: &[Term], range: [f64; 2]) {
    let sums = sums(written, range);
    let caption =
        format!("All terms together, lags settled{}, all channels at one temperature.", lasing_mode(written));
    add(sheet, "Bias in all", &caption, "°C", sums);
    for (argument, label) in
        [("°C", "temperature"), ("°C/s", "rate of temperature"), ("°C/s²", "its acceleration")]
    {
        for (kind, sensors) in [("gyro", "Gyros"), ("accel", "Accelerometers")] {
            let mine: Vec<&Term> =
                terms.iter().filter(|term| term.kind == kind && term.argument == argument).collect();
            // A constant is in the tables; curves of one kind of term that are all constant show nothing.
            let varying = |name: &str| mine.iter().any(|term| term.name == name && term.range.is_some());
            let mut names: Vec<&str> = Vec::new();
            for term in mine.iter().filter(|term| varying(&term.name)) {
                if !names.contains(&term.name.as_str()) {
                    names.push(&term.name);
                }
            }
            let panels = names.into_iter().map(|name| {
                let of_name: Vec<&&Term> = mine.iter().filter(|term| term.name == name).collect();
                let curves = of_name.iter().zip(Ink::several()).map(|(term, ink)| {
                    let over = term.range.unwrap_or(range);
                    let points = places(over, POINTS).into_iter().map(|x| (x, term.at(x).0));
                    line(term.sensor.clone(), ink, points)
                });
                panel(&spoken(name), of_name.first().map_or("", |term| term.unit.as_str()), curves.collect())
            });
            let heading = format!("{sensors} over {label}");
            add(sheet, &heading, "Each term over its fitted range.", argument, panels.collect());
        }
    }
    add(
        sheet,
        "Input axes",
        "Turn of each input axis from the middle of the range.",
        "°C",
        axes(written, range),
    );
}

fn add(sheet: &mut Sheet, heading: &str, caption: &str, unit: &str, panels: Vec<Panel>) {
    if panels.is_empty() {
        return;
    }
    let label = match unit {
        "°C" => "temperature",
        "°C/s" => "rate of temperature",
        _ => "acceleration of temperature",
    };
    let x = Axis::of(label, unit);
    sheet
        .charts
        .push((heading.to_owned(), Chart { caption: caption.to_owned(), x, panels, marks: Vec::new() }));
}

pub(crate) fn panel(title: &str, unit: &str, curves: Vec<Series>) -> Panel {
    let content = Content::Series(curves);
    Panel { title: title.to_owned(), unit: unit.to_owned(), height: 150, logarithmic: false, content }
}

pub(crate) fn line(name: String, ink: Ink, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
    Series { name, ink, form: Form::Line, samples: Samples::points(points) }
}

fn sums(written: &Written, range: [f64; 2]) -> Vec<Panel> {
    let at = places(range, POINTS);
    let gyros = written.document.gyro.sensor.iter().enumerate().map(|(index, gyro)| {
        let curves = RAMPS.into_iter().zip(Ink::several()).map(|(ramp, ink)| {
            let bias = |x: &f64| {
                let bias = steady(written, *x, ramp).gyro_bias.get(index).copied().unwrap_or(f64::NAN);
                (*x, AngularRate::from_rad_per_s(bias).as_deg_per_h())
            };
            line(ramp_words(ramp), ink, at.iter().map(bias))
        });
        panel(&format!("gyro {}", gyro.name), "°/h", curves.collect())
    });
    let accels = written.document.accel.iter().flat_map(|accel| &accel.sensor).enumerate();
    let accels = accels.map(|(index, accel)| {
        let bias = |x: &f64| {
            let bias = steady(written, *x, 0.0).accel_bias.get(index).copied().unwrap_or(f64::NAN);
            (*x, SpecificForce::from_m_per_s2(bias).as_g() * 1e3)
        };
        let curve = line("steady".to_owned(), Ink::First, at.iter().map(bias));
        panel(&format!("accelerometer {}", accel.name), "mg", vec![curve])
    });
    // What is constant stands in the table.
    let varies = |panel: &Panel| match &panel.content {
        Content::Series(curves) => curves.iter().any(|curve| match &curve.samples {
            Samples::Points { y, .. } => Size::of(y).peak_to_peak > 0.0,
            Samples::Bins { .. } => true,
        }),
        Content::Lanes(_) => true,
    };
    gyros.chain(accels).filter(varies).collect()
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
                (*x, libm::sqrt(squares) * ARCSEC)
            };
            line(name.to_owned(), ink, at.iter().map(turned))
        });
        panel(what, "″", curves.collect())
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
