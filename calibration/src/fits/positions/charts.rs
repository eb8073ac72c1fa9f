//! Diagrams of a calibration on a stand.

use isotherm_pages::{Axis, Chart, Ink, Panel, Series};

use super::fit::{Analysis, Settings};
use super::judged::Judgement;
use super::solve::Fit;
use crate::axes::{AXES, across};
use crate::numbers::{ARCSEC_PER_RAD, norm, places};
use crate::report::bars;

/// Points of a curve over temperature.
const POINTS: usize = 61;

/// Largest distance between the quadratic and the linear C over the range (rad).
pub fn bend(analysis: &Analysis) -> f64 {
    let Some((quadratic, ..)) = &analysis.quadratic else { return 0.0 };
    let mut largest: f64 = 0.0;
    for deg_c in places(analysis.range_deg_c, POINTS) {
        let x = (deg_c - analysis.reference_deg_c) / analysis.half_deg_c;
        for (bent, straight) in quadratic.sensors.iter().zip(&analysis.fit.sensors) {
            let (a, b) = (at(&bent.axis, x), at(&straight.axis, x));
            largest = largest.max(norm([0, 1, 2].map(|i| a[i] - b[i])));
        }
    }
    largest
}

/// A row of C at a scaled temperature.
fn at(axis: &[[f64; 3]], x: f64) -> [f64; 3] {
    axis.iter().rev().fold([0.0; 3], |sum, row| [0, 1, 2].map(|i| sum[i] * x + row[i]))
}

/// What is left by itself: beside what was there before, it is a line at zero.
pub(super) fn left_chart(settings: &Settings, judged: &[Judgement]) -> Chart {
    let panel = |axis: usize| {
        let error = |(number, judgement): (u32, &Judgement)| {
            (f64::from(number), judgement.error[1][axis] / settings.gravity * 1e3)
        };
        let after = Series::dots("after", Ink::Corrected, (1..).zip(judged).map(error));
        Panel::of(format!("accelerometer {}", AXES[axis]), "mg", 120, vec![after])
    };
    let caption = "Error of the specific force, by position in the order of the table.";
    Chart::of(caption, Axis::of("number of the position", ""), (0..3).map(panel).collect())
}

/// Elements that are shown over temperature: sensor, element.
pub(super) fn shown(analysis: &Analysis) -> Vec<(usize, usize)> {
    let sensors = analysis.fit.sensors.iter().enumerate();
    sensors.flat_map(|(index, sensor)| across(&sensor.axis[0]).map(move |i| (index, i))).collect()
}

/// An element of C at each temperature by itself with its standard error (″); `None` where the positions of one do not tell.
pub(super) fn by_level(analysis: &Analysis, (index, i): (usize, usize)) -> Vec<(f64, Option<[f64; 2]>)> {
    let found = |fit: &Fit| {
        let value = fit.sensors[index].axis[0][i] * ARCSEC_PER_RAD;
        [value, fit.axis_sigma(index, 0)[i] * ARCSEC_PER_RAD * analysis.widened]
    };
    let levels = analysis.levels_deg_c.iter().zip(&analysis.of_level);
    levels.map(|(deg_c, fit)| (*deg_c, fit.as_ref().map(found))).collect()
}

/// Elements of C over temperature.
pub(super) fn axes_chart(analysis: &Analysis, names: &[String]) -> Chart {
    let panel = |(index, i): (usize, usize)| {
        let curve = |fit: &Fit| -> Vec<(f64, f64)> {
            let value = |deg_c: f64| {
                let x = (deg_c - analysis.reference_deg_c) / analysis.half_deg_c;
                (deg_c, at(&fit.sensors[index].axis, x)[i] * ARCSEC_PER_RAD)
            };
            places(analysis.range_deg_c, POINTS).into_iter().map(value).collect()
        };
        let known = by_level(analysis, (index, i)).into_iter();
        let known: Vec<(f64, [f64; 2])> = known.filter_map(|(deg_c, found)| Some((deg_c, found?))).collect();
        let dots = known.iter().map(|(deg_c, [value, _])| (*deg_c, *value));
        let mut content = vec![
            Series::dots("each temperature", Ink::Raw, dots),
            bars("95 %", Ink::Faint, known.iter().copied()),
            Series::line("linear", Ink::Second, curve(&analysis.fit)),
        ];
        if let Some((quadratic, ..)) = &analysis.quadratic {
            content.push(Series::line("quadratic", Ink::Third, curve(quadratic)));
        }
        Panel::of(format!("accelerometer {} along {}", names[index], AXES[i]), "″", 150, content)
    };
    let caption = "Elements of C over temperature: each temperature alone, and the line of the document.";
    Chart::of(caption, Axis::of("temperature", "°C"), shown(analysis).into_iter().map(panel).collect())
}
