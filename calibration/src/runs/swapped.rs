//! Columns that look swapped: at rest, in a stated attitude, gravity and the Earth's rate tell the axes.

use std::fmt::{self, Display, Formatter};

use isotherm_correction::earth::{Place, Tilt};
use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;

use crate::axes::AXES;
use crate::numbers::{Size, dot, norm, unit};
use crate::report::fixed;

/// Orders of three axes: the swaps of two first, which need the fewest mistakes.
pub const ORDERS: [[usize; 3]; 5] = [[1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]];
/// The order of the log's columns.
pub const AS_LOGGED: [usize; 3] = [0, 1, 2];
/// How far from what is stated the means must be, as a share of it: 20° of gravity.
const AWAY: f64 = 0.35;
/// And in standard deviations of the means themselves, which a bias that moves has.
const AWAY_DEVIATIONS: f64 = 5.0;
/// What another order may leave of that.
const LEFT: f64 = 0.25;

/// What three sensors show in the mean beside what they must.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Of what kind they are, as in "gyros".
    pub kind: &'static str,
    /// Symbol of the unit of measure.
    pub measure: &'static str,
    /// Means of the sensors.
    pub mean: [f64; 3],
    /// What each would show without error, in the stated attitude.
    pub stated: [f64; 3],
    /// The same of gyros at the opposite latitude, where the vertical is known.
    pub opposite: Option<[f64; 3]>,
    /// How far the means move over the run.
    pub deviation: f64,
}

impl Shown {
    /// Of sensors of a kind, with the symbol of their unit of measure.
    pub fn of([kind, measure]: [&'static str; 2], sizes: [Size; 3], stated: [f64; 3]) -> Self {
        let deviation = sizes.iter().map(|size| size.deviation).fold(0.0, f64::hypot);
        Self { kind, measure, mean: sizes.map(|size| size.mean), stated, opposite: None, deviation }
    }

    /// The same, with what it would be at the opposite latitude.
    pub fn or_opposite(self, opposite: Option<[f64; 3]>) -> Self {
        Self { opposite, ..self }
    }

    /// What looks mistaken: the sign of the latitude, or the order of the axes, with which it fits by far better than as stated; `None`
    /// where none does.
    pub fn swapped(&self) -> Option<Looks> {
        let off = |order| self.off(order, self.stated);
        let (as_logged, size) = (off(AS_LOGGED), norm(self.stated));
        let south = |stated| self.is_away() && self.off(AS_LOGGED, stated) < LEFT * as_logged;
        if self.opposite.is_some_and(south) {
            return Some(Looks { shown: *self, fits: Fits::OppositeLatitude });
        }
        let fits = |order: &[usize; 3]| off(*order) < LEFT * as_logged;
        let best =
            ORDERS.into_iter().filter(|order| self.is_away() && fits(order)).reduce(|best, order| {
                if off(order) < 0.5 * off(best) && off(best) > 0.05 * size { order } else { best }
            })?;
        Some(Looks { shown: *self, fits: Fits::Order(best) })
    }

    /// That the means are far from what they must be though no order looks right; `None` where they are near.
    pub fn far(&self) -> Option<Looks> {
        (self.is_away() && self.swapped().is_none()).then_some(Looks { shown: *self, fits: Fits::Nothing })
    }

    /// How far the means, in an order, are from what they would be.
    fn off(&self, order: [usize; 3], stated: [f64; 3]) -> f64 {
        norm([0, 1, 2].map(|axis| self.mean[order[axis]] - stated[axis]))
    }

    /// Whether that is too far; false for NaN too.
    fn is_away(&self) -> bool {
        let off = self.off(AS_LOGGED, self.stated);
        off > AWAY * norm(self.stated) && off > AWAY_DEVIATIONS * self.deviation
    }
}

/// The Earth's rate at the opposite latitude, where the specific force at rest shows the vertical, both in case axes.
pub fn at_opposite_latitude(earth: [f64; 3], force: [f64; 3]) -> [f64; 3] {
    let up = unit(force);
    let along = dot(earth, up);
    [0, 1, 2].map(|axis| earth[axis] - 2.0 * along * up[axis])
}

/// With what sensors show what they must.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fits {
    /// In this order.
    Order([usize; 3]),
    /// With the other sign of the latitude.
    OppositeLatitude,
    /// With nothing that is known.
    Nothing,
}

/// Sensors that do not show what they must in the stated attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Looks {
    /// What they show.
    pub shown: Shown,
    /// With what they would.
    pub fits: Fits,
}

impl Display for Looks {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { shown: Shown { kind, measure, mean, stated, .. }, fits } = self;
        // As many places as the largest of them needs for three digits: what is next to nothing is zero.
        let largest = mean.iter().chain(stated).map(|part| part.abs()).fold(0.0, f64::max);
        let places =
            (0..6_u8).find(|places| largest * libm::pow(10.0, f64::from(*places)) >= 100.0).unwrap_or(6);
        let list = |v: [f64; 3]| v.map(|part| fixed(part, usize::from(places))).join(", ");
        let means = format!(
            "their means are {} {measure}, in the stated attitude they would be {}",
            list(*mean),
            list(*stated)
        );
        match fits {
            Fits::Order(order) => write!(
                f,
                "{kind} {} look swapped: {means}; check the columns in the mapping, and the attitude",
                moved(*order)
            ),
            Fits::OppositeLatitude => {
                write!(f, "the {kind} fit the opposite latitude: {means}; check the sign of --latitude")
            }
            Fits::Nothing => write!(
                f,
                "the {kind} do not fit the attitude: {means}; check attitude, signs and unit of measure"
            ),
        }
    }
}

/// The order in which axes fit each other's curves far better than their own, and what both leave of those out of place (rms about the
/// mean): by axis, what there is before and after a document took its curve off.
pub fn by_curves(axes: [[&[f64]; 2]; 3]) -> Option<([usize; 3], [f64; 2])> {
    let left = |column: usize, curve: usize| {
        let [[column, _], [before, after]] = [axes[column], axes[curve]];
        let taken_off = before.iter().zip(after).map(|(before, after)| before - after);
        Size::of(&column.iter().zip(taken_off).map(|(value, off)| value - off).collect::<Vec<f64>>())
            .deviation
    };
    let of = |order: [usize; 3]| {
        let out_of_place = || (0..3).filter(move |axis| order[*axis] != *axis);
        let all_fit = out_of_place().all(|axis| left(order[axis], axis) < LEFT * left(axis, axis));
        let largest = |of: &dyn Fn(usize) -> f64| out_of_place().map(of).fold(0.0, f64::max);
        all_fit
            .then(|| (order, [largest(&|axis| left(axis, axis)), largest(&|axis| left(order[axis], axis))]))
    };
    ORDERS.into_iter().find_map(of)
}

/// The axes that are not in their places, in words.
pub fn moved(order: [usize; 3]) -> String {
    let names = AXES.into_iter().zip(order).enumerate();
    let moved: Vec<&str> = names.filter(|(axis, (_, of))| axis != of).map(|(_, (name, _))| name).collect();
    moved.join(" and ")
}

/// Specific force at rest in case axes (m/s²), where pitch and roll were stated.
pub fn force_at_rest(place: &Place) -> Option<[f64; 3]> {
    let Tilt::Given { pitch_rad, roll_rad } = place.tilt() else { return None };
    // At the pole the Earth turns about the vertical: where that axis is in the case, there gravity is.
    let tilt_deg = [pitch_rad.to_degrees(), roll_rad.to_degrees()];
    let rate = Place::new(90.0, 0.0, Some(tilt_deg)).ok()?.earth_rate_in_case(None)?;
    Some(unit(rate).map(|part| part * STANDARD_GRAVITY_M_PER_S2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(kind: &'static str, mean: [f64; 3], stated: [f64; 3], deviation: f64) -> String {
        Shown { kind, measure: "m/s²", mean, stated, opposite: None, deviation }
            .swapped()
            .map(|looks| looks.to_string())
            .unwrap_or_default()
    }

    #[test]
    fn another_order_that_fits_is_named() {
        let level = [0.1, -0.2, -9.8];
        let earth = [7.3, -4.2, -12.4];
        let told = [
            words("accelerometers", [-9.79, -0.2, 0.1], level, 0.01),
            words("gyros", [-12.6, 7.1, -4.3], earth, 0.3),
            words("gyros", [-4.0, 7.5, -12.0], earth, 0.3),
        ];
        insta::assert_snapshot!(told.join("\n"));
    }

    #[test]
    fn the_other_sign_of_the_latitude_comes_before_an_order_of_columns() {
        let (earth, force) = ([7.3, -4.2, -12.4], [0.0, 0.0, 9.8]);
        let of = |mean: [f64; 3]| Shown {
            kind: "gyros",
            measure: "°/h",
            mean,
            stated: earth,
            opposite: Some(at_opposite_latitude(earth, force)),
            deviation: 0.3,
        };
        insta::assert_snapshot!(of([7.2, -4.4, 12.3]).swapped().unwrap());
        assert_eq!(of([-12.6, -4.3, 7.1]).swapped().map(|looks| looks.fits), Some(Fits::Order([2, 1, 0])));
        assert_eq!(of([7.2, -4.4, -12.3]).swapped(), None);
    }

    #[test]
    fn curves_that_fit_each_others_axes_are_a_swap() {
        let curve = |axis: u32| -> Vec<f64> {
            (0..60).map(|k| libm::sin(f64::from(k * (axis + 1)) * 0.05)).collect()
        };
        let curves = [0, 1, 2].map(curve);
        let noise = |k: u32| 0.05 * libm::sin(f64::from(k * k));
        let found = |order: [usize; 3]| {
            let before =
                order.map(|of| (0..).zip(&curves[of]).map(|(k, x)| x + noise(k)).collect::<Vec<f64>>());
            let after = [0, 1, 2].map(|axis: usize| {
                before[axis]
                    .iter()
                    .zip(&curves[axis])
                    .map(|(value, curve)| value - curve)
                    .collect::<Vec<f64>>()
            });
            by_curves([0, 1, 2].map(|axis| [&*before[axis], &*after[axis]])).map(|(order, _)| order)
        };
        assert_eq!(found([0, 1, 2]), None);
        assert_eq!((found([2, 1, 0]), found([1, 2, 0])), (Some([2, 1, 0]), Some([2, 0, 1])));
    }

    #[test]
    fn what_fits_in_no_order_is_told_as_far() {
        let of = |mean: [f64; 3]| Shown {
            kind: "accelerometers",
            measure: "m/s²",
            mean,
            stated: [0.1, -0.2, -9.8],
            opposite: None,
            deviation: 0.01,
        };
        insta::assert_snapshot!(of([0.1, -0.2, 9.8]).far().unwrap());
        assert_eq!(of([-9.8, -0.2, 0.1]).far(), None, "swapped, which is told otherwise");
        assert_eq!(of([0.3, 0.1, -9.7]).far(), None);
    }

    #[test]
    fn biases_and_motion_of_the_means_are_no_swap() {
        let (level, earth) = ([0.1, -0.2, -9.8], [7.3, -4.2, -12.4]);
        assert_eq!(words("accelerometers", [0.3, 0.1, -9.7], level, 0.01), "");
        // A bias of many times the Earth's rate, and one that moves as much as it.
        assert_eq!(words("gyros", [190.0, -80.0, 30.0], earth, 1.0), "");
        assert_eq!(words("gyros", [-12.6, -4.0, 7.1], earth, 10.0), "");
        assert_eq!(words("gyros", [f64::NAN, -4.0, 7.1], earth, 0.1), "");
    }
}
