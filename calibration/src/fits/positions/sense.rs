//! Which way sensors point beside what the document at hand states of them: columns that are swapped, signs.

use nalgebra::Vector3;

use super::doubts::LARGEST_TURN_DEG;
use crate::axes::sensor_name;
use crate::report::{fixed, short};

/// One sensor beside what the document at hand states of it.
pub(crate) struct Beside {
    /// K.
    scale: f64,
    /// Where a positive output points, found and stated: a negative K along one axis is a positive one along its opposite.
    senses: [Vector3<f64>; 2],
}

impl Beside {
    pub(crate) fn new([found, stated]: [f64; 2], rows: [[f64; 3]; 2]) -> Self {
        let [row, stated_row] = rows.map(Vector3::from);
        Self { scale: found, senses: [row * found.signum(), stated_row * stated.signum()] }
    }

    /// Angle between both senses (°).
    fn turned_deg(&self) -> f64 {
        self.senses[0].angle(&self.senses[1]).to_degrees()
    }
}

/// Where positive outputs of some sensors point, in words.
pub(crate) fn found_along(kind: &str, sensors: &[Beside], which: &[usize]) -> String {
    let along = |index: &usize| {
        let [x, y, z]: [f64; 3] = sensors[*index].senses[0].into();
        let [x, y, z] = [x, y, z].map(|c| fixed(c, 2));
        format!(
            "of {kind} {} along ({x}, {y}, {z}), K = {}",
            sensor_name(*index, sensors.len()),
            short(sensors[*index].scale)
        )
    };
    format!("Positive output {}", which.iter().map(along).collect::<Vec<_>>().join("; "))
}

/// Places of three sensors among the stated ones: whose stated axis each lies along, and whether the same way round. `None` where
/// one lies along none of them.
pub(crate) fn places(sensors: &[Beside]) -> Option<([usize; 3], [bool; 3])> {
    let place = |sensor: &Beside| {
        let cosine = |other: usize| sensor.senses[0].dot(&sensors[other].senses[1]);
        let at = (0..sensors.len()).max_by(|a, b| cosine(*a).abs().total_cmp(&cosine(*b).abs()))?;
        let near = cosine(at).abs() > libm::cos(LARGEST_TURN_DEG.to_radians());
        near.then_some((at, cosine(at) > 0.0))
    };
    let found: Vec<(usize, bool)> = sensors.iter().map(place).collect::<Option<_>>()?;
    let [a, b, c] = found.as_slice() else { return None };
    let order = [a.0, b.0, c.0];
    let all = (0..3).all(|axis| order.contains(&axis));
    all.then_some((order, [a.1, b.1, c.1]))
}

/// Axes that are not in their places.
pub(crate) fn out_of_place(order: [usize; 3]) -> Vec<usize> {
    (0..3).filter(|axis| order[*axis] != *axis).collect()
}

/// Sensors that point elsewhere than stated.
pub(crate) fn turned(sensors: &[Beside]) -> Vec<usize> {
    (0..sensors.len()).filter(|index| sensors[*index].turned_deg() > LARGEST_TURN_DEG).collect()
}
