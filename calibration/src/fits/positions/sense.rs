//! Which way sensors point beside what the document at hand states of them: columns that are swapped, signs.

use isotherm_protocol::document::Accel;
use nalgebra::Vector3;

use super::doubts::LARGEST_TURN_DEG;
use super::measure;
use crate::axes::{sensor_name, several};
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

/// Accelerometers that are not as the document at hand has them: where they lie elsewhere, and what their scale factors tell of the unit of
/// measure. `scale` and `stated` are their scale factors, `rows` the axes that were found.
pub(crate) fn of_accelerometers(
    accel: &Accel,
    [scale, stated]: [&[f64]; 2],
    rows: &[[f64; 3]],
) -> (Option<String>, Vec<String>) {
    let axes = rows.iter().zip(&accel.orientation.rows);
    let beside = scale.iter().zip(stated).zip(axes);
    let beside = beside.map(|((scale, stated), (row, axis))| Beside::new([*scale, *stated], [*row, *axis]));
    let beside: Vec<Beside> = beside.collect();
    (elsewhere("accelerometer", &beside), measure::accelerometers(accel.output, scale, stated))
}

/// Where sensors lie elsewhere than the document at hand has them: what is wrong with columns or signs by the fewest mistakes, and where they
/// were found.
pub(crate) fn elsewhere(kind: &str, sensors: &[Beside]) -> Option<String> {
    let turned: Vec<usize> =
        (0..sensors.len()).filter(|index| sensors[*index].turned_deg() > LARGEST_TURN_DEG).collect();
    let who = several(kind, &turned, sensors.len());
    let one = ["is", "its sign", "it"];
    let [are, signs, them] = if turned.len() == 1 { one } else { ["are", "their signs", "them"] };
    let found = places(sensors).map(|(order, same_way)| (out_of_place(order).len(), same_way));
    let what = match found {
        Some((0, _)) => {
            format!("{who} {are} found with the other sign: {are} {signs} missing in the mapping?")
        }
        Some((2, [true, true, true])) => format!("{who} look swapped: check the columns in the mapping."),
        _ => format!(
            "{who} {are} far from where the document at hand has {them}: are columns of the mapping swapped, or is a sign \
             the other one?"
        ),
    };
    (!turned.is_empty()).then(|| format!("{what} {}", found_along(kind, sensors, &turned)))
}

/// Where positive outputs of some sensors point, in words.
fn found_along(kind: &str, sensors: &[Beside], which: &[usize]) -> String {
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
