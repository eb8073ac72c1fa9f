//! Curves as the document states them, in the units of its keys.

mod schema;

pub(super) use schema::{definition, frequency, relative, relative_over_rate, scale_factor};

pub use isotherm_correction::curve::CurveParts as Shape;
use serde::de::{Deserialize, Deserializer, Error as _};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::measure::{Argument, Unit};

/// A curve over temperature, one of its derivatives or the rate, in the units of its keys.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    unit: Unit,
    argument: Argument,
    shape: Shape,
}

/// Value of the `kind` key.
const fn kind(shape: &Shape) -> &'static str {
    match shape {
        Shape::Constant { .. } => "constant",
        Shape::Polynomial { .. } => "polynomial",
        Shape::PiecewiseLinear { .. } => "piecewise-linear",
        Shape::Spline { .. } => "spline",
    }
}

impl Default for Curve {
    fn default() -> Self {
        Self::new(Shape::Constant { value: 0.0 })
    }
}

impl Curve {
    /// A curve over temperature in ppm, or in the unit of the term that it is put into.
    #[must_use]
    pub fn new(shape: Shape) -> Self {
        Self { unit: Unit::PPM, argument: Argument::DegC, shape }
    }

    /// The same curve with its values in another unit.
    #[must_use]
    pub fn in_unit(self, unit: Unit) -> Self {
        Self { unit, ..self }
    }

    /// The same curve over another argument.
    #[must_use]
    pub fn over(self, argument: Argument) -> Self {
        Self { argument, ..self }
    }

    /// Takes the unit of a term, and an argument that it may have.
    pub(super) fn fit(&mut self, unit: Unit, arguments: &[Argument]) {
        self.unit = unit;
        if !arguments.contains(&self.argument) {
            self.argument = Argument::DegC;
        }
    }

    /// The same curve with a constant (in the unit of its values) added to all of it.
    #[must_use]
    pub fn plus(&self, change: f64) -> Self {
        Self { shape: self.shape.scaled(1.0, 1.0, change), ..*self }
    }

    /// The same curve held at its value at one argument; one that does not hold stays as it is.
    #[must_use]
    pub fn held_at(&self, argument: f64) -> Self {
        match self.shape.at(argument) {
            Some(value) => Self::new(Shape::Constant { value }).in_unit(self.unit),
            None => self.clone(),
        }
    }

    /// Unit of the values.
    #[must_use]
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// Unit of the argument; `None` for a constant.
    #[must_use]
    pub fn argument(&self) -> Option<Argument> {
        (!matches!(self.shape, Shape::Constant { .. })).then_some(self.argument)
    }

    /// Form and numbers.
    #[must_use]
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// First and last argument of the fitted range; `None` for a constant.
    #[must_use]
    pub fn range(&self) -> Option<[f64; 2]> {
        match &self.shape {
            Shape::Constant { .. } => None,
            Shape::Polynomial { range, .. } => Some(*range),
            Shape::PiecewiseLinear { knots } | Shape::Spline { knots } => {
                Some([knots.first()?[0], knots.last()?[0]])
            }
        }
    }

    /// The core's parts, `plus` a constant in its units.
    pub(super) fn to_parts(&self, plus: f64) -> Shape {
        self.shape.scaled(self.argument.in_core_units(), self.unit.in_core_units(), plus)
    }

    /// Keys of the numbers of this curve.
    pub(super) fn keys(&self) -> Keys {
        Keys::new(self.unit, self.argument)
    }
}

/// Keys of a curve's numbers.
#[derive(Debug)]
pub(super) struct Keys {
    pub(super) value: String,
    pub(super) reference: String,
    pub(super) coefficients: String,
    pub(super) range: String,
    pub(super) knots: String,
}

impl Keys {
    pub(super) fn new(unit: Unit, argument: Argument) -> Self {
        let (unit, over) = (unit.suffix(), argument.suffix());
        Self {
            value: format!("value_{unit}"),
            reference: format!("reference_{over}"),
            coefficients: format!("coefficients_{unit}"),
            range: format!("range_{over}"),
            knots: match argument {
                Argument::DegC => format!("knots_{unit}"),
                _ => format!("knots_{unit}_over_{over}"),
            },
        }
    }

    /// The keys whose spelling tells the unit of the values.
    pub(super) fn of_values(&self) -> [&str; 3] {
        [&self.value, &self.coefficients, &self.knots]
    }
}

impl Serialize for Curve {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let keys = self.keys();
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("kind", kind(&self.shape))?;
        match &self.shape {
            Shape::Constant { value } => map.serialize_entry(&keys.value, value)?,
            Shape::Polynomial { reference, coefficients, range } => {
                map.serialize_entry(&keys.reference, reference)?;
                map.serialize_entry(&keys.coefficients, coefficients)?;
                map.serialize_entry(&keys.range, range)?;
            }
            Shape::PiecewiseLinear { knots } | Shape::Spline { knots } => {
                map.serialize_entry(&keys.knots, knots)?;
            }
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Curve {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = toml::Table::deserialize(deserializer)?;
        Self::stated(&table).ok_or_else(|| D::Error::custom("a curve must have one of its forms"))
    }
}

impl Curve {
    /// The curve that a table states, whatever its unit and argument.
    fn stated(table: &toml::Table) -> Option<Self> {
        let find = |stem: &str| table.iter().find_map(|(key, value)| Some((key.strip_prefix(stem)?, value)));
        let number = |stem| find(stem)?.1.as_float();
        let knots = || -> Option<Vec<[f64; 2]>> { find("knots_")?.1.clone().try_into().ok() };
        let shape = match table.get("kind")?.as_str()? {
            "constant" => Shape::Constant { value: number("value_")? },
            "polynomial" => Shape::Polynomial {
                reference: number("reference_")?,
                coefficients: find("coefficients_")?.1.clone().try_into().ok()?,
                range: find("range_")?.1.clone().try_into().ok()?,
            },
            "piecewise-linear" => Shape::PiecewiseLinear { knots: knots()? },
            "spline" => Shape::Spline { knots: knots()? },
            _ => return None,
        };
        let (values, _) = ["value_", "coefficients_", "knots_"].into_iter().find_map(find)?;
        let (unit, over) = values.split_once("_over_").unwrap_or((values, "deg_c"));
        let over = find("reference_").map_or(over, |(over, _)| over);
        Some(Self::new(shape).in_unit(Unit::of_suffix(unit)?).over(Argument::of_suffix(over)?))
    }
}
