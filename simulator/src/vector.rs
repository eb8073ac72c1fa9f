//! Vectors of three as plain arrays.

pub(crate) use isotherm_correction::vector::{cross, dot, minus, plus};

pub(crate) type Vector = [f64; 3];

pub(crate) fn scale(a: Vector, factor: f64) -> Vector {
    a.map(|component| component * factor)
}

pub(crate) fn norm(a: Vector) -> f64 {
    libm::sqrt(dot(a, a))
}

/// `a` with unit length, or as it stands where it has none.
pub(crate) fn unit(a: Vector) -> Vector {
    let length = norm(a);
    if length > 0.0 { scale(a, 1.0 / length) } else { a }
}
