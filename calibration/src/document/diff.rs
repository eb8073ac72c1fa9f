//! What has changed between two documents of a unit, such as before and after shock or vibration.
//!
//! Axes are compared as 004 does in its third table: by how many seconds of arc each input axis has turned, towards each of
//! the case axes, beside the uncertainty of the two calibrations. Biases and scale factors are compared over the range of
//! temperature that both were fitted over; then comes every entry that differs.

pub mod series;
mod sheet;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use isotherm_correction::calibration::Steady;
use isotherm_correction::thermal::Feature;
use isotherm_correction::units::{Angle, AngularRate, SpecificForce};
use isotherm_protocol::control::DocumentChange;
use isotherm_protocol::document::{Document, OrientationThermal, difference, turn_rad};
use serde::Serialize;
use toml::Table;

use crate::document::merge::sections::sections;
use crate::document::show::terms::{terms, tree};
use crate::document::show::{range_of, settled, steady};
use crate::document::{Written, about, accelerometers};
use crate::error::Error;
use crate::numbers::{norm, places};
use crate::report::Sigmas;

/// Standard errors beyond which an axis has turned.
pub const BEYOND: f64 = 3.0;
/// Temperatures that changes are taken at.
const POINTS: usize = 101;
/// Difference of two temperatures over which axes hardly turn (°C).
const SAME_DEG_C: f64 = 1.0;

/// How an input axis has turned.
#[derive(Debug, Clone, Serialize)]
pub struct AxisChange {
    /// "gyro x".
    pub of: String,
    /// Change of its direction cosines at the reference temperature (″).
    pub change_arcsec: [f64; 3],
    /// Their standard errors, of both documents together (″); 0 where not known.
    pub sigma_arcsec: [f64; 3],
    /// Angle that it has turned by at the reference temperature (″).
    pub turned_arcsec: f64,
    /// Standard error of the angle (″); `None` where not known.
    pub turned_sigma_arcsec: Option<f64>,
    /// The largest change of a cosine in standard errors; `None` where not known.
    pub significance: Option<f64>,
    /// Largest angle over the range of temperature (″).
    pub largest_arcsec: f64,
}

/// How a bias, an increment weight or a scale factor has changed.
#[derive(Debug, Clone, Serialize)]
pub struct ValueChange {
    /// "gyro x bias".
    pub of: String,
    /// Symbol of the unit.
    pub unit: &'static str,
    /// Change at each temperature of the comparison.
    pub change: Vec<f64>,
    /// Change at the reference temperature.
    pub at_reference: f64,
    /// Its standard error, of both documents together; `None` where not known.
    pub sigma: Option<f64>,
}

/// All changes.
#[derive(Debug, Clone, Serialize)]
pub struct Changes {
    /// Names of both documents.
    pub names: [String; 2],
    /// Units that they are for.
    pub units: [String; 2],
    /// Temperature that axes are compared at (°C).
    pub reference_deg_c: f64,
    /// Temperatures of the comparison (°C).
    pub temperature_deg_c: Vec<f64>,
    /// Axes.
    pub axes: Vec<AxisChange>,
    /// Biases, increment weights, scale factors; only those that differ somewhere.
    pub values: Vec<ValueChange>,
    /// Sections that differ, by "gyro x", "accelerometer x" and so on; all that is of no sensor by "document".
    pub sections: BTreeMap<String, Vec<String>>,
    /// Entries that differ.
    pub entries: Vec<DocumentChange>,
    /// What biases are taken at.
    #[serde(skip)]
    pub settled: String,
}

/// Compares two documents; `axis_sigma` is the standard error of a direction cosine (″) where a document states none.
///
/// # Errors
/// [`Error::Document`] where a document cannot be written as a tree.
pub fn changes([before, after]: [&Written; 2], axis_sigma: Option<f64>) -> Result<Changes, Error> {
    let (before_tree, after_tree) = (tree(&before.document)?, tree(&after.document)?);
    let [[a, b], [c, d]] = [&before_tree, &after_tree].map(|tree| range_of(&terms(tree)));
    let range = if a.max(c) < b.min(d) { [a.max(c), b.min(d)] } else { [a.min(c), b.max(d)] };
    let reference = own_reference(&after.document).clamp(range[0], range[1]);
    let at = places(range, POINTS);
    let pair = |x: f64| [steady(before, x, 0.0), steady(after, x, 0.0)];
    let compared = Compared {
        documents: [&before.document, &after.document],
        reference_deg_c: reference,
        reference: pair(reference),
        over: at.iter().map(|x| pair(*x)).collect(),
        sigmas: [Sigmas::of(&before.document), Sigmas::of(&after.document)],
        axis_sigma,
    };
    let (mut axes, mut values) = (Vec::new(), Vec::new());
    let gyros = compared.documents.map(|document| document.gyro.sensor.iter().map(|sensor| &sensor.name));
    for (name, places) in matched(gyros) {
        axes.push(compared.axis(("gyro", "gyro", name), places, |s| &s.gyro_axes));
        compared.gyro(name, places, &mut values);
    }
    let accels =
        compared.documents.map(|document| accelerometers(document).iter().map(|sensor| &sensor.name));
    for (name, places) in matched(accels) {
        axes.push(compared.axis(("accelerometer", "accel", name), places, |s| &s.accel_axes));
        compared.accel(name, places, &mut values);
    }
    values.retain(|value| value.change.iter().chain([&value.at_reference]).any(|change| *change != 0.0));
    Ok(Changes {
        names: [before, after].map(|written| written.name.clone()),
        units: [before, after].map(|written| written.document.unit.clone()),
        reference_deg_c: reference,
        temperature_deg_c: at,
        axes,
        values,
        sections: differing([before_tree, after_tree]),
        entries: difference(&before.document, &after.document),
        settled: settled(compared.documents),
    })
}

/// Sections that differ, by what they are of.
fn differing(trees: [Table; 2]) -> BTreeMap<String, Vec<String>> {
    let [before, after] = trees.map(sections);
    let mut differing: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for key in before.keys().chain(after.keys().filter(|key| !before.contains_key(*key))) {
        if before.get(key) == after.get(key) {
            continue;
        }
        let of_sensor = [("gyro.sensor.", "gyro"), ("accel.sensor.", "accelerometer")];
        let of_sensor = of_sensor.into_iter().find_map(|(list, kind)| {
            let (name, section) = key.strip_prefix(list)?.rsplit_once('.')?;
            Some((format!("{kind} {name}"), section))
        });
        let (of, section) = of_sensor.unwrap_or_else(|| ("document".to_owned(), key));
        differing.entry(of).or_default().push(section.to_owned());
    }
    differing
}

/// Names that both have, with their places in either.
fn matched<'a>(
    [before, after]: [impl Iterator<Item = &'a String> + Clone; 2],
) -> impl Iterator<Item = (&'a str, [usize; 2])> {
    let place = move |(j, name): (usize, &'a String)| {
        before.clone().position(|other| other == name).map(|i| (name.as_str(), [i, j]))
    };
    after.enumerate().filter_map(place)
}

/// Temperature that a document's curves are given about (°C), where its standard errors are known best.
fn own_reference(document: &Document) -> f64 {
    let axes =
        ["accel", "gyro"].into_iter().filter_map(|kind| Some(axes_over(document, kind)?.reference_deg_c));
    let scales = accelerometers(document).iter().map(|sensor| Some(&sensor.scale_factor));
    let biases = document.gyro.sensor.iter().map(|sensor| sensor.terms.curve(Feature::One));
    axes.chain(scales.chain(biases).filter_map(about)).next().unwrap_or(document.temperature.assumed_deg_c)
}

/// How the axes of a kind follow temperature.
fn axes_over<'a>(document: &'a Document, kind: &str) -> Option<&'a OrientationThermal> {
    if kind == "gyro" {
        return document.gyro.orientation.thermal.as_ref();
    }
    document.accel.as_ref()?.orientation.thermal.as_ref()
}

struct Compared<'a> {
    documents: [&'a Document; 2],
    reference_deg_c: f64,
    reference: [Steady; 2],
    over: Vec<[Steady; 2]>,
    sigmas: [Sigmas; 2],
    axis_sigma: Option<f64>,
}

impl Compared<'_> {
    fn axis(
        &self,
        (called, kind, sensor): (&str, &str, &str),
        [first, second]: [usize; 2],
        rows: impl Fn(&Steady) -> &[[f64; 3]],
    ) -> AxisChange {
        let both = |[before, after]: &[Steady; 2]| {
            let row =
                |steady: &Steady, place: usize| rows(steady).get(place).copied().unwrap_or([f64::NAN; 3]);
            (row(before, first), row(after, second))
        };
        let (old, new) = both(&self.reference);
        let change = [0, 1, 2].map(|i| Angle::from_rad(new[i] - old[i]).as_arcsec());
        let stated = [0, 1].map(|side| self.row_sigma(side, kind, sensor));
        let sigma = match stated {
            [Some(a), Some(b)] => [0, 1, 2].map(|i| libm::hypot(a[i], b[i])),
            _ => [0.0; 3],
        };
        let known = stated.iter().all(Option::is_some) && sigma.iter().any(|sigma| *sigma > 0.0);
        let turned = angle(old, new);
        let significance = change
            .iter()
            .zip(sigma)
            .filter(|(_, sigma)| *sigma > 0.0)
            .map(|(change, sigma)| change.abs() / sigma)
            .fold(0.0, f64::max);
        let length = norm(change);
        let turned_sigma = if length > 0.0 {
            change.iter().zip(sigma).map(|(x, s)| (x * s / length) * (x * s / length)).sum::<f64>().sqrt()
        } else {
            sigma.iter().copied().fold(0.0, f64::max)
        };
        let over = self.over.iter().map(|pair| {
            let (old, new) = both(pair);
            angle(old, new)
        });
        AxisChange {
            of: format!("{called} {sensor}"),
            change_arcsec: change,
            sigma_arcsec: sigma,
            turned_arcsec: turned,
            turned_sigma_arcsec: known.then_some(turned_sigma),
            significance: known.then_some(significance),
            largest_arcsec: over.fold(turned, f64::max),
        }
    }

    /// Standard errors of the direction cosines of one document. Those that it states hold at the reference of its axes, for those of the
    /// slopes are not known.
    fn row_sigma(&self, side: usize, kind: &str, sensor: &str) -> Option<[f64; 3]> {
        let (document, sigmas) = (self.documents[side], &self.sigmas[side]);
        let away = |axes: &OrientationThermal| (axes.reference_deg_c - self.reference_deg_c).abs();
        let there = axes_over(document, kind).is_none_or(|axes| away(axes) < SAME_DEG_C);
        let stated = sigmas.get(kind, sensor, "axis_arcsec").filter(|_| there);
        let stated = stated.and_then(|row| <[f64; 3]>::try_from(row).ok());
        stated.or_else(|| self.axis_sigma.map(|sigma| [sigma; 3]))
    }

    fn gyro(&self, name: &str, places: [usize; 2], values: &mut Vec<ValueChange>) {
        let deg_per_h = |[a, b]: [f64; 2]| AngularRate::from_rad_per_s(b - a).as_deg_per_h();
        let gyro = |side: usize| self.documents[side].gyro.sensor.get(places[side]);
        let biases = [0, 1].map(|side| about(gyro(side)?.terms.curve(Feature::One)));
        let sigma = self.value_sigma(("gyro", name, "static_bias"), biases, [1.0; 2]);
        let of = format!("gyro {name} bias");
        values.extend(self.value(of, "°/h", places, |s| &s.gyro_bias, deg_per_h, sigma));
        let [before, after] = self.documents;
        if before.gyro.output == after.gyro.output {
            let of = format!("gyro {name} increment weight");
            let sigma = self.value_sigma(("gyro", name, "increment_weight_ppm"), [None; 2], [1.0; 2]);
            values.extend(self.value(of, "ppm", places, |s| &s.gyro_weight, ppm, sigma));
        }
    }

    fn accel(&self, name: &str, places: [usize; 2], values: &mut Vec<ValueChange>) {
        let milli_g = |force: f64| SpecificForce::from_m_per_s2(force).as_g() * 1e3;
        let scale = [0, 1].map(|side| {
            let scales = &self.reference[side].accel_scale;
            scales.get(places[side]).copied().unwrap_or(f64::NAN)
        });
        // A standard error of the output is one of the specific force by the scale factor.
        let accel = |side: usize| accelerometers(self.documents[side]).get(places[side]);
        let biases = [0, 1].map(|side| about(accel(side)?.terms.curve(Feature::One)));
        let per_scale = scale.map(|scale| milli_g(1.0 / scale));
        let sigma = self.value_sigma(("accel", name, "bias"), biases, per_scale);
        let change = |[a, b]: [f64; 2]| milli_g(b - a);
        let of = format!("accelerometer {name} bias");
        values.extend(self.value(of, "mg", places, |s| &s.accel_bias, change, sigma));
        let [before, after] =
            self.documents.map(|document| document.accel.as_ref().map(|accel| accel.output));
        if before == after {
            let of = format!("accelerometer {name} scale factor");
            let scales = [0, 1].map(|side| about(Some(&accel(side)?.scale_factor)));
            let sigma =
                self.value_sigma(("accel", name, "scale_factor"), scales, scale.map(|scale| 1e6 / scale));
            values.extend(self.value(of, "ppm", places, |s| &s.accel_scale, ppm, sigma));
        }
    }

    /// Standard error of the difference of two curves at the reference, each by its factor: of polynomials about some temperature that
    /// of all their coefficients, as if they were found apart from each other; else of the first.
    fn value_sigma(
        &self,
        (kind, sensor, term): (&str, &str, &str),
        about: [Option<f64>; 2],
        factors: [f64; 2],
    ) -> Option<f64> {
        let of = |side: usize| {
            let away = about[side].map_or(0.0, |about| self.reference_deg_c - about);
            let mut power = factors[side];
            let sigmas = self.sigmas[side].get(kind, sensor, term)?;
            let parts = sigmas.iter().map(|sigma| {
                let part = sigma * power;
                power *= away;
                part * part
            });
            Some(parts.sum::<f64>().sqrt())
        };
        let sigma = libm::hypot(of(0)?, of(1)?);
        (sigma > 0.0).then_some(sigma)
    }

    fn value(
        &self,
        of: String,
        unit: &'static str,
        [i, j]: [usize; 2],
        column: impl Fn(&Steady) -> &[f64],
        change: impl Fn([f64; 2]) -> f64,
        sigma: Option<f64>,
    ) -> Option<ValueChange> {
        let at =
            |[before, after]: &[Steady; 2]| Some(change([*column(before).get(i)?, *column(after).get(j)?]));
        let change = self.over.iter().map(at).collect::<Option<Vec<f64>>>()?;
        Some(ValueChange { of, unit, change, at_reference: at(&self.reference)?, sigma })
    }
}

fn ppm([before, after]: [f64; 2]) -> f64 {
    (after - before) / before * 1e6
}

/// Angle between two axes (″).
fn angle(old: [f64; 3], new: [f64; 3]) -> f64 {
    Angle::from_rad(turn_rad(old, new)).as_arcsec()
}
