//! Axes of gyros and accelerometers over temperature side by side, as 004 has them: what both do is the case's, what differs a sensor's.

use isotherm_pages::{Axis, Chart, Ink, Panel, Series, Table};
use isotherm_protocol::document::Document;

use super::over_temperature::{Level, Line, OverTemperature};
use crate::axes::{AXES, across, main_axis};
use crate::document::gyro_name;
use crate::numbers::ARCSEC_PER_RAD;
use crate::report::{Sigmas, bars, fixed};

/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 150;

/// An element of C of a gyro, and that of the accelerometer along the same case axis (″).
struct Element {
    title: String,
    /// Value and standard error at each temperature by itself.
    measured: Vec<[f64; 2]>,
    /// The line through them at each temperature.
    line: Vec<f64>,
    accel: Option<Accel>,
}

/// An element of C of an accelerometer, from the document.
struct Accel {
    name: String,
    /// At each temperature.
    line: Vec<f64>,
    /// Standard error, where the document states it.
    sigma: Option<f64>,
}

/// Two elements per gyro.
fn elements(over: &OverTemperature, document: &Document) -> Vec<Element> {
    let sigmas = Sigmas::of(document);
    let line = |reference_deg_c: f64, at: &dyn Fn(f64) -> f64| -> Vec<f64> {
        over.levels.iter().map(|level| at(level.deg_c - reference_deg_c)).collect()
    };
    let of_accel = |main: usize, along: usize| {
        let accel = document.accel.as_ref()?;
        let index = accel.orientation.rows.iter().position(|row| main_axis(row) == main)?;
        let value = accel.orientation.rows[index][along] * ARCSEC_PER_RAD;
        let thermal = accel.orientation.thermal.as_ref();
        let slope = thermal.and_then(|thermal| thermal.slopes_arcsec_per_deg_c.get(index));
        let slope = slope.map_or(0.0, |slope| slope[along]);
        let name = accel.sensor.get(index)?.name.clone();
        let sigma = sigmas.get("accel", &name, "axis_arcsec");
        Some(Accel {
            sigma: sigma.and_then(|sigma| sigma.get(along).copied()),
            line: line(thermal.map_or(0.0, |thermal| thermal.reference_deg_c), &|away| value + slope * away),
            name,
        })
    };
    let element = |gyro: usize, along: usize| {
        let own = &over.lines[gyro];
        let measured = |level: &Level| {
            let found = &level.gyros[gyro];
            let value = found.axis.map_or(f64::NAN, |axis| axis[along]);
            [value, found.axis_sigma[along]].map(|rad| rad * ARCSEC_PER_RAD)
        };
        let at = |away: f64| (own.axis[along] + own.slope[along] * away) * ARCSEC_PER_RAD;
        Element {
            title: format!("gyro {} along {}", gyro_name(document, gyro), AXES[along]),
            measured: over.levels.iter().map(measured).collect(),
            line: line(over.reference_deg_c, &at),
            accel: of_accel(main_axis(&own.axis), along),
        }
    };
    let both = |(gyro, own): (usize, &Line)| across(&own.axis).map(|along| element(gyro, along));
    over.lines.iter().enumerate().flat_map(both).collect()
}

/// Each element over temperature.
pub(super) fn chart(over: &OverTemperature, document: &Document) -> Chart {
    let panel = |Element { title, measured, line, accel }: Element| {
        let ends = || over.levels.iter().map(|level| level.deg_c);
        let dots = ends().zip(measured.iter().map(|[value, _]| *value));
        let mut content = vec![
            Series::dots("gyro, each temperature", Ink::Raw, dots),
            bars("95 %", Ink::Faint, ends().zip(measured.iter().copied())),
            Series::line("gyro", Ink::First, ends().zip(line.iter().copied())),
        ];
        if let Some(accel) = accel {
            let own = || accel.line.iter().copied();
            content.push(Series::line("accelerometer", Ink::Second, ends().zip(own())));
            if let Some(sigma) = accel.sigma {
                content.push(bars("95 % of it", Ink::Faint, ends().zip(own().map(|at| [at, sigma]))));
            }
            let apart = line.iter().zip(own()).map(|(line, accel)| line - accel);
            content.push(Series::line("gyro less accelerometer", Ink::Third, ends().zip(apart)));
        }
        Panel::of(title, "″", HEIGHT, content)
    };
    let caption = "Elements of C over temperature: gyros, the document's accelerometers, and the difference.";
    let panels = elements(over, document).into_iter().map(panel).collect();
    Chart::of(caption, Axis::of("temperature", "°C"), panels)
}

/// The elements at each temperature by itself.
pub(super) fn table(over: &OverTemperature, document: &Document) -> Table {
    let elements = elements(over, document);
    let heads = elements.iter().map(|Element { title, accel, .. }| match accel {
        Some(accel) => format!("{title} (less accelerometer {})", accel.name),
        None => title.clone(),
    });
    let head = std::iter::once("°C".to_owned()).chain(heads);
    let row = |(at, level): (usize, &Level)| {
        let cell = |element: &Element| {
            let [value, sigma] = element.measured[at];
            let apart = element.accel.as_ref().map(|own| format!(" ({})", fixed(value - own.line[at], 1)));
            format!("{} ± {sigma:.1}{}", fixed(value, 1), apart.unwrap_or_default())
        };
        std::iter::once(fixed(level.deg_c, 1)).chain(elements.iter().map(cell)).collect()
    };
    Table::of(head, over.levels.iter().enumerate().map(row))
}
