//! Curves as the document states them, in the units of its keys.

mod schema;

use std::marker::PhantomData;
use std::ops::Deref;

use isotherm_correction::curve::{Curve as CoreCurve, CurveParts};
use serde::de::{Deserialize, Deserializer, Error as _};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::measure::{Argument, Unit};

/// What a curve's values stand for: which units and arguments its keys may name.
pub trait Quantity: std::fmt::Debug + Clone + PartialEq + 'static {
    /// Name of the definition in the schema.
    const NAME: &'static str;
    /// Units of the values, the usual one first.
    const UNITS: &'static [Unit];
    /// Units of the argument, the usual one first.
    const ARGUMENTS: &'static [Argument];
}

/// Defines the quantities.
macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident: [$($unit:ident),+] over [$($argument:ident),+];)+) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $name {}
        impl Quantity for $name {
            const NAME: &'static str = concat!("CurveOf", stringify!($name));
            const UNITS: &'static [Unit] = &[$(Unit::$unit),+];
            const ARGUMENTS: &'static [Argument] = &[$(Argument::$argument),+];
        }
    )+};
}

quantities! {
    /// Relative deviation from one.
    Relative: [Ppm] over [DegC];
    /// Bias of a gyro.
    RateBias: [DegPerH] over [DegC];
    /// K1 of models §2.
    ThermalRate: [DegPerHPerDegCPerS] over [DegC, DegCPerS];
    /// K2 of models §2.
    ThermalAcceleration: [DegPerHPerDegCPerS2] over [DegC, DegCPerS2];
    /// Gain of a thermal lag.
    LagGain: [DegPerHPerDegCPerS] over [DegC];
    /// Gain of a hysteresis.
    HysteresisGain: [DegPerHPerDegC] over [DegC];
    /// Gain of a regressor, per unit of its channel.
    RegressorGain: [DegPerHPerUnit] over [DegC];
    /// Drift of a gyro by specific force.
    DriftByForce: [DegPerHPerG] over [DegC];
    /// Relative deviation from one over the rate of a gyro.
    RelativeOverRate: [Ppm] over [DegPerS];
    /// Second-order term of an accelerometer.
    SecondOrder: [MicroGPerG2] over [DegC];
    /// Rest frequency of the dither.
    Frequency: [Hz] over [DegC];
    /// Scale factor of an accelerometer.
    ScaleFactor: [CountsPerSPerMPerS2, VPerMPerS2, MPerS2PerMPerS2] over [DegC];
    /// Bias of an accelerometer, in units of its output.
    OutputBias: [CountsPerS, V, MPerS2] over [DegC];
    /// Gain of a thermal lag of an accelerometer, in units of its output per °C/s.
    OutputLagGain: [CountsPerSPerDegCPerS, VPerDegCPerS, MPerS2PerDegCPerS] over [DegC];
    /// Gain of a hysteresis of an accelerometer, in units of its output per °C.
    OutputHysteresisGain: [CountsPerSPerDegC, VPerDegC, MPerS2PerDegC] over [DegC];
    /// Gain of a regressor of an accelerometer, in units of its output per unit of the channel.
    OutputRegressorGain: [CountsPerSPerUnit, VPerUnit, MPerS2PerUnit] over [DegC];
}

/// A curve of one quantity, in the units of its keys.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve<Q> {
    form: CurveForm,
    quantity: PhantomData<Q>,
}

/// A curve of any quantity over temperature, one of its derivatives or the rate, in the units of its keys.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveForm {
    unit: Unit,
    argument: Argument,
    shape: Shape,
}

impl<Q> Deref for Curve<Q> {
    type Target = CurveForm;

    fn deref(&self) -> &CurveForm {
        &self.form
    }
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

impl<Q: Quantity> Curve<Q> {
    /// A curve over temperature in the quantity's usual unit.
    #[must_use]
    pub fn new(shape: Shape) -> Self {
        let (unit, argument) = match (Q::UNITS, Q::ARGUMENTS) {
            ([unit, ..], [argument, ..]) => (*unit, *argument),
            _ => (Unit::Ppm, Argument::DegC),
        };
        Self { form: CurveForm { unit, argument, shape }, quantity: PhantomData }
    }

    /// The same curve with its values in another unit; one that the quantity does not allow changes nothing.
    #[must_use]
    pub fn in_unit(mut self, unit: Unit) -> Self {
        if Q::UNITS.contains(&unit) {
            self.form.unit = unit;
        }
        self
    }

    /// The same curve over another argument; one that the quantity does not allow changes nothing, and so does
    /// any for a constant.
    #[must_use]
    pub fn over(mut self, argument: Argument) -> Self {
        if Q::ARGUMENTS.contains(&argument) && !matches!(self.shape, Shape::Constant { .. }) {
            self.form.argument = argument;
        }
        self
    }

    /// The same curve with a constant (in the unit of its values) added to all of it.
    #[must_use]
    pub fn plus(&self, change: f64) -> Self {
        let mut curve = self.clone();
        match &mut curve.form.shape {
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
}

impl CurveForm {
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

impl<Q: Quantity> Serialize for Curve<Q> {
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

impl<'de, Q: Quantity> Deserialize<'de> for Curve<Q> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = toml::Table::deserialize(deserializer)?;
        let form =
            |unit: &Unit| Q::ARGUMENTS.iter().find_map(|argument| Self::stated(&table, *unit, *argument));
        Q::UNITS.iter().find_map(form).ok_or_else(|| D::Error::custom("a curve must have one of its forms"))
    }
}

impl<Q: Quantity> Curve<Q> {
    /// The curve that a table states in one unit over one argument.
    fn stated(table: &toml::Table, unit: Unit, argument: Argument) -> Option<Self> {
        fn get<'de, T: Deserialize<'de>>(table: &toml::Table, key: &str) -> Option<T> {
            table.get(key)?.clone().try_into().ok()
        }
        let Keys { value, reference, coefficients, range, knots } = Keys::new(unit, argument);
        let shape = match table.get("kind")?.as_str()? {
            "constant" => Shape::Constant { value: get(table, &value)? },
            "polynomial" => Shape::Polynomial {
                reference: get(table, &reference)?,
                coefficients: get(table, &coefficients)?,
                range: get(table, &range)?,
            },
            "piecewise-linear" => Shape::PiecewiseLinear { knots: get(table, &knots)? },
            "spline" => Shape::Spline { knots: get(table, &knots)? },
            _ => return None,
        };
        Some(Self::new(shape).in_unit(unit).over(argument))
    }
}
