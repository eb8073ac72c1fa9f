//! The curves of a document, wherever they stand in it.
//!
//! They are found by their form, not by a list of keys: a term that is new to the document is shown like all others.

use std::fmt::Write;

use isotherm_correction::curve::Curve;
use isotherm_protocol::document::{Argument, Curve as StatedCurve, Document, Shape, Trend};
use toml::{Table, Value};

use crate::error::Error;
use crate::numbers::real;
use crate::report::{six, superscript};

/// What a trend is over.
pub const HOURS: &str = "h";

/// One curve of one sensor, in the document's units.
#[derive(Debug, Clone)]
pub struct Term {
    /// "gyro" or "accel".
    pub kind: &'static str,
    /// Name of the sensor.
    pub sensor: String,
    /// Its key, with the branch or the time constant: "`thermal_rate` run-up", "lag of 300 s".
    pub name: String,
    /// Symbol of the unit of its values.
    pub unit: String,
    /// What it is over: "°C", "°C/s", "°C/s²", "°/s", or hours since turn-on.
    pub argument: &'static str,
    /// Fitted range; `None` for a constant.
    pub range: Option<[f64; 2]>,
    /// The formula.
    pub words: String,
    curve: Curve,
}

impl Term {
    /// Its value, held outside the fitted range; and whether it is held.
    pub fn at(&self, x: f64) -> (f64, bool) {
        let at = self.curve.at(x);
        (at.value, at.clamped && self.range.is_some())
    }
}

/// A document as a tree, defaults filled in.
///
/// # Errors
/// [`Error::Document`] where it cannot be written.
pub fn tree(document: &Document) -> Result<Table, Error> {
    let words = |error: &dyn std::fmt::Display| Error::document(&error);
    let text = document.to_toml().map_err(|error| words(&error))?;
    text.parse::<Table>().map_err(|error| words(&error))
}

/// All curves of the sensors, in the order of the document.
pub fn terms(tree: &Table) -> Vec<Term> {
    let mut terms = Vec::new();
    for kind in ["gyro", "accel"] {
        let sensors = tree.get(kind).and_then(|kind| kind.get("sensor")?.as_array());
        for sensor in sensors.into_iter().flatten().filter_map(Value::as_table) {
            let name = sensor.get("name").and_then(Value::as_str).unwrap_or_default();
            for (key, value) in sensor {
                gather((kind, name), key, value, &mut terms);
            }
        }
    }
    terms
}

fn gather(of: (&'static str, &str), path: &str, value: &Value, terms: &mut Vec<Term>) {
    match value {
        Value::Table(table) => match term(of, path, table) {
            Some(term) => terms.push(term),
            None => table.iter().for_each(|(key, value)| {
                let path = match key.as_str() {
                    "gain" => path.to_owned(),
                    key => format!("{path} {}", key.replace("run_up", "run-up")),
                };
                gather(of, &path, value, terms);
            }),
        },
        Value::Array(values) => {
            for (index, value) in values.iter().enumerate() {
                let stated = |key, unit| Some((number(value.get(key)?)?, unit));
                let parameter = stated("time_constant_s", "s").or(stated("half_width_deg_c", "°C"));
                let name = |key| value.get(key).and_then(Value::as_str);
                let path = match (parameter, name("channel"), name("minus")) {
                    (Some((number, unit)), ..) => format!("{path} of {number} {unit}"),
                    (None, Some(channel), None) => format!("{path} {channel}"),
                    (None, Some(channel), Some(minus)) => format!("{path} {channel} − {minus}"),
                    (None, None, _) => format!("{path} {}", index + 1),
                };
                gather(of, &path, value, terms);
            }
        }
        _ => {}
    }
}

/// A curve or a trend, where the table is one.
fn term((kind, sensor): (&'static str, &str), name: &str, table: &Table) -> Option<Term> {
    let value = Value::Table(table.clone());
    let (unit, (argument, symbol), range, shape) = if table.contains_key("kind") {
        let stated: StatedCurve = value.try_into().ok()?;
        let argument = stated.argument().unwrap_or(Argument::DegC);
        let of = (argument.symbol(), letter(argument));
        (stated.unit().symbol(), of, stated.range(), stated.shape().clone())
    } else {
        let Trend { coefficients_deg_per_h: coefficients, interval_h: range } = value.try_into().ok()?;
        let shape = Shape::Polynomial { reference: 0.0, coefficients, range };
        ("°/h".to_owned(), (HOURS, "t"), Some(range), shape)
    };
    let words = match &shape {
        Shape::Constant { value } => six(*value),
        Shape::Polynomial { reference, coefficients, .. } => polynomial(coefficients, *reference, symbol),
        Shape::PiecewiseLinear { knots } => format!("piecewise-linear, {} knots", knots.len()),
        Shape::Spline { knots } => format!("spline, {} knots", knots.len()),
    };
    Some(Term {
        kind,
        sensor: sensor.to_owned(),
        name: name.to_owned(),
        unit,
        argument,
        range,
        words,
        curve: Curve::new(&shape).ok()?,
    })
}

/// The letter of an argument in formulas.
fn letter(argument: Argument) -> &'static str {
    match argument {
        Argument::DegC => "T",
        Argument::DegCPerS => "Ṫ",
        Argument::DegCPerS2 => "T̈",
        Argument::DegPerS => "ω",
    }
}

/// Any number of a tree.
pub(crate) fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(real))
}

fn polynomial(coefficients: &[f64], reference: f64, symbol: &str) -> String {
    let of = if reference == 0.0 {
        symbol.to_owned()
    } else if reference < 0.0 {
        format!("({symbol} + {})", six(-reference))
    } else {
        format!("({symbol} − {})", six(reference))
    };
    let mut words = String::new();
    for (power, coefficient) in
        coefficients.iter().enumerate().filter(|(_, coefficient)| **coefficient != 0.0)
    {
        let sign = match (words.is_empty(), *coefficient < 0.0) {
            (true, false) => "",
            (true, true) => "−",
            (false, false) => " + ",
            (false, true) => " − ",
        };
        let _ = write!(words, "{sign}{}", six(coefficient.abs()));
        let power = match power {
            0 => String::new(),
            power => format!("·{of}{}", superscript(power)),
        };
        words.push_str(&power);
    }
    if words.is_empty() { "0".to_owned() } else { words }
}
