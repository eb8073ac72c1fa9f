//! Axes of gyros and accelerometers over temperature side by side, as 004 has them: what both do is the case's, what differs a sensor's.

use isotherm_pages::{Axis, Chart, Ink, Panel, Series, Table};
use isotherm_protocol::document::Document;

use super::over_temperature::{Level, OverTemperature};
use crate::axes::{AXES, main_axis};
use crate::document::{accel_name, gyro_name};
use crate::numbers::ARCSEC_PER_RAD;
use crate::report::{Sigmas, bars, fixed};

/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 150;

/// An element of C over temperature, of a gyro and of the accelerometer along the same case axis.
struct Element<'a> {
    over: &'a OverTemperature,
    gyro: usize,
    /// Case axis that the element is along.
    along: usize,
    accel: Option<Accel>,
}

/// An element of an accelerometer's axis (″, ″/°C, °C), and its standard error (″).
#[derive(Clone, Copy)]
struct Accel {
    index: usize,
    value: f64,
    slope: f64,
    reference_deg_c: f64,
    sigma: Option<f64>,
}

impl Accel {
    fn at(&self, deg_c: f64) -> f64 {
        self.value + self.slope * (deg_c - self.reference_deg_c)
    }
}

/// The elements of all gyros that say where they point.
fn elements<'a>(over: &'a OverTemperature, document: &Document) -> Vec<Element<'a>> {
    let sigmas = Sigmas::of(document);
    let of_accel = |main: usize, along: usize| {
        let accel = document.accel.as_ref()?;
        let index = accel.orientation.rows.iter().position(|row| main_axis(row) == main)?;
        let thermal = accel.orientation.thermal.as_ref();
        let slope = thermal.and_then(|thermal| thermal.slopes_arcsec_per_deg_c.get(index));
        let name = &accel.sensor.get(index)?.name;
        Some(Accel {
            index,
            value: accel.orientation.rows[index][along] * ARCSEC_PER_RAD,
            slope: slope.map_or(0.0, |slope| slope[along]),
            reference_deg_c: thermal.map_or(0.0, |thermal| thermal.reference_deg_c),
            sigma: sigmas.get("accel", name, "axis_arcsec").and_then(|sigma| sigma.get(along).copied()),
        })
    };
    let gyros = over.lines.iter().enumerate();
    gyros
        .flat_map(|(gyro, line)| {
            let main = main_axis(&line.axis);
            (0..3).filter(move |along| *along != main).map(move |along| (gyro, main, along))
        })
        .map(|(gyro, main, along)| Element { over, gyro, along, accel: of_accel(main, along) })
        .collect()
}

impl Element<'_> {
    /// The gyro's element at a temperature with its standard error (″).
    fn measured(&self, level: &Level) -> [f64; 2] {
        let found = &level.gyros[self.gyro];
        let value = found.axis.map_or(f64::NAN, |axis| axis[self.along]);
        [value * ARCSEC_PER_RAD, found.axis_sigma[self.along] * ARCSEC_PER_RAD]
    }

    fn line_at(&self, deg_c: f64) -> f64 {
        let line = &self.over.lines[self.gyro];
        let away = deg_c - self.over.reference_deg_c;
        (line.axis[self.along] + line.slope[self.along] * away) * ARCSEC_PER_RAD
    }
}

/// The figure.
pub(super) fn chart(over: &OverTemperature, document: &Document) -> Chart {
    let panel = |element: Element<'_>| {
        let all: Vec<(f64, [f64; 2])> =
            over.levels.iter().map(|level| (level.deg_c, element.measured(level))).collect();
        let ends = || all.iter().map(|(deg_c, _)| *deg_c);
        let dots = all.iter().map(|(deg_c, [value, _])| (*deg_c, *value));
        let mut content = vec![
            Series::dots("gyro, each temperature", Ink::Raw, dots),
            bars("95 %", Ink::Faint, all.iter().copied()),
            Series::line("gyro", Ink::First, ends().map(|t| (t, element.line_at(t)))),
        ];
        if let Some(accel) = element.accel {
            content.push(Series::line("accelerometer", Ink::Second, ends().map(|t| (t, accel.at(t)))));
            if let Some(sigma) = accel.sigma {
                content.push(bars("95 % of it", Ink::Faint, ends().map(|t| (t, [accel.at(t), sigma]))));
            }
            let apart = ends().map(|t| (t, element.line_at(t) - accel.at(t)));
            content.push(Series::line("gyro less accelerometer", Ink::Third, apart));
        }
        let title = format!("gyro {} along {}", gyro_name(document, element.gyro), AXES[element.along]);
        Panel::of(title, "″", HEIGHT, content)
    };
    let caption = "Elements of C over temperature: gyros, the document's accelerometers, and the difference.";
    let panels = elements(over, document).into_iter().map(panel).collect();
    Chart::of(caption, Axis::of("temperature", "°C"), panels)
}

/// The figure's numbers.
pub(super) fn table(over: &OverTemperature, document: &Document) -> Table {
    let elements = elements(over, document);
    let heads = elements.iter().map(|element| {
        let less = element.accel.map_or_else(String::new, |own| {
            format!(" (less accelerometer {})", accel_name(document, own.index))
        });
        format!("gyro {} along {}{less}", gyro_name(document, element.gyro), AXES[element.along])
    });
    let head = std::iter::once("°C".to_owned()).chain(heads);
    let row = |level: &Level| {
        let cell = |element: &Element<'_>| {
            let [value, sigma] = element.measured(level);
            let apart = element.accel.map(|own| format!(" ({})", fixed(value - own.at(level.deg_c), 1)));
            format!("{} ± {sigma:.1}{}", fixed(value, 1), apart.unwrap_or_default())
        };
        std::iter::once(fixed(level.deg_c, 1)).chain(elements.iter().map(cell)).collect()
    };
    Table::of(head, over.levels.iter().map(row))
}
