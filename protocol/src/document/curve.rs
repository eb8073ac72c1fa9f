//! Curves as the document states them, in the units of its keys.

mod schema;

pub(super) use schema::{definition, frequency, relative, relative_over_rate, scale_factor};

use isotherm_correction::curve::{Curve as CoreCurve, CurveParts};
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

/// Form of a curve.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// The same value everywhere.
    Constant {
        /// The value.
        value: f64,
    },
    /// Σ cⱼ·(x − reference)ʲ.
    Polynomial {
        /// Point about which the powers are taken.
        reference: f64,
        /// c₀, c₁, …
        coefficients: Vec<f64>,
        /// Fitted range; outside it the argument is clamped.
        range: [f64; 2],
    },
    /// Straight lines between knots.
    PiecewiseLinear {
        /// [argument, value] pairs.
        knots: Vec<[f64; 2]>,
    },
    /// Natural cubic spline through the knots.
    Spline {
        /// [argument, value] pairs.
        knots: Vec<[f64; 2]>,
    },
}

impl Shape {
    /// Value of the `kind` key.
    const fn kind(&self) -> &'static str {
        match self {
            Self::Constant { .. } => "constant",
            Self::Polynomial { .. } => "polynomial",
            Self::PiecewiseLinear { .. } => "piecewise-linear",
            Self::Spline { .. } => "spline",
        }
    }

    /// The value at an argument, as the core evaluates it: outside its range the curve is held. `None` where the numbers make no
    /// curve.
    #[must_use]
    pub fn at(&self, argument: f64) -> Option<f64> {
        match self {
            Self::Constant { value } => Some(*value),
            _ => CoreCurve::new(&self.to_parts(1.0, 1.0, 0.0)).ok().map(|curve| curve.at(argument).value),
        }
    }

    /// The core's parts, arguments times `over`, values times `factor`, `plus` a constant.
    fn to_parts(&self, over: f64, factor: f64, plus: f64) -> CurveParts {
        let convert =
            |knots: &[[f64; 2]]| knots.iter().map(|[x, value]| [x * over, value * factor + plus]).collect();
        match self {
            Self::Constant { value } => CurveParts::Polynomial {
                reference: 0.0,
                coefficients: vec![value * factor + plus],
                range: EVERYWHERE,
            },
            Self::Polynomial { reference, coefficients, range } => {
                let factors = std::iter::successors(Some(factor), |factor| Some(factor / over));
                let mut coefficients: Vec<f64> =
                    coefficients.iter().zip(factors).map(|(c, f)| c * f).collect();
                if let Some(first) = coefficients.first_mut() {
                    *first += plus;
                }
                CurveParts::Polynomial {
                    reference: *reference * over,
                    coefficients,
                    range: range.map(|end| end * over),
                }
            }
            Self::PiecewiseLinear { knots } => CurveParts::PiecewiseLinear { knots: convert(knots) },
            Self::Spline { knots } => CurveParts::Spline { knots: convert(knots) },
        }
    }
}

/// Argument range of a constant in the core, which has no form for it: wider than any temperature or rate.
const EVERYWHERE: [f64; 2] = [-1e9, 1e9];

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
        let mut curve = self.clone();
        match &mut curve.shape {
            Shape::Constant { value } => *value += change,
            Shape::Polynomial { coefficients, .. } => match coefficients.first_mut() {
                Some(first) => *first += change,
                None => coefficients.push(change),
            },
            Shape::PiecewiseLinear { knots } | Shape::Spline { knots } => {
                for [_, value] in knots {
                    *value += change;
                }
            }
        }
        curve
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
    pub(super) fn to_parts(&self, plus: f64) -> CurveParts {
        self.shape.to_parts(self.argument.in_core_units(), self.unit.in_core_units(), plus)
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
        map.serialize_entry("kind", self.shape.kind())?;
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
