//! Plans of positions: where a stand puts a unit, and what its errors do to the specific force that the unit feels.
//!
//! The stand of 004: axis 2 lies level, axis 1 is carried by it at right angles and is the normal of the platform. At zero
//! angles axis 1 points up. A turn by β about axis 2 and then by α about axis 1 shows the unit the direction of "up" as
//!
//! ```text
//! u = R₁(α)ᵀ · R₃(δ3)ᵀ · R₂(β + δ1)ᵀ · R₃(δ2)ᵀ · (0, 1, 0)      along (axis 2, axis 1, axis 2 × axis 1)
//! ```
//!
//! | error | what it is |
//! |---|---|
//! | δ1 | level of the stand, and zero of its scale, about axis 2 |
//! | δ2 | axis 2 is not level |
//! | δ3 | axis 1 is not at right angles to axis 2 |
//!
//! (The paper's own definitions are lost with its formulas; these are the three small angles of such a stand that gravity
//! shows.) How the unit is mounted on the platform, and the zero of axis 1, cannot be told from where its axes are: they are part
//! of C, and what the precision of the mounting is for.

mod file;

use std::path::Path;

use nalgebra::Vector3;

use super::doubts::GOOD_POSITIONS;
use crate::error::Error;

/// Errors of a stand: δ1, δ2, δ3 (rad).
pub type StandErrors = [f64; 3];

/// What a position says of the attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Attitude {
    /// Angles of the stand's axes 1 and 2 (rad).
    Stand([f64; 2]),
    /// Direction of "up" in case axes, a unit vector; the stand's errors are not known to it.
    Up([f64; 3]),
}

/// One position.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// Its name, such as "Ya".
    pub name: String,
    /// How the unit stands in it.
    pub attitude: Attitude,
}

/// Positions in the order in which they are taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Case axes (axis 2, axis 1, their cross product) of the stand at zero angles, by rows.
    pub mounting: [[f64; 3]; 3],
    /// The positions.
    pub positions: Vec<Position>,
}

/// Axis 1 and axis 2 (°) of the twelve positions of 004: each case axis up and down, twice, half a turn about the vertical apart.
const TWELVE: [(&str, [f64; 2]); 12] = [
    ("Y up a", [0.0, 0.0]),
    ("Y up b", [180.0, 0.0]),
    ("Z down a", [0.0, 90.0]),
    ("X up a", [90.0, 90.0]),
    ("Z up a", [180.0, 90.0]),
    ("X down a", [270.0, 90.0]),
    ("Y down a", [0.0, 180.0]),
    ("Y down b", [180.0, 180.0]),
    ("Z up b", [0.0, 270.0]),
    ("X down b", [90.0, 270.0]),
    ("Z down b", [180.0, 270.0]),
    ("X up b", [270.0, 270.0]),
];

impl Plan {
    /// The twelve positions of 004.
    pub fn twelve() -> Self {
        Self::of_stand(&TWELVE)
    }

    /// Each case axis up and down once.
    pub fn six() -> Self {
        let once: Vec<_> = TWELVE.into_iter().filter(|(name, _)| name.ends_with('a')).collect();
        Self::of_stand(&once)
    }

    fn of_stand(positions: &[(&str, [f64; 2])]) -> Self {
        let position = |(name, angles): &(&str, [f64; 2])| Position {
            name: (*name).to_owned(),
            attitude: Attitude::Stand(angles.map(f64::to_radians)),
        };
        Self {
            mounting: mounting('y', 'x').unwrap_or_default(),
            positions: positions.iter().map(position).collect(),
        }
    }

    /// The built-in plan of a name, or the one in a file (TOML, or CSV where its name ends so).
    ///
    /// # Errors
    /// [`Error::Log`] where it cannot be read, [`Error::Usage`] with what is wrong in it.
    pub fn named(name: &str) -> Result<Self, Error> {
        match name {
            "twelve" => Ok(Self::twelve()),
            "six" => Ok(Self::six()),
            path => file::read(Path::new(path)),
        }
    }

    /// Direction of "up" in case axes in a position.
    pub fn up(&self, position: usize, errors: StandErrors) -> [f64; 3] {
        let [angle_1, angle_2] = match self.positions[position].attitude {
            Attitude::Up(up) => return up,
            Attitude::Stand(angles) => angles,
        };
        let [level, tilt, square] = errors;
        let turns = [(2, -tilt), (0, -(angle_2 + level)), (2, -square), (1, -angle_1)];
        let up = turns.into_iter().fold([0.0, 1.0, 0.0], |up, (axis, angle)| about(axis, up, angle));
        let mut along = [0.0; 3];
        for (component, axis) in up.iter().zip(&self.mounting) {
            along.iter_mut().zip(axis).for_each(|(sum, c)| *sum += component * c);
        }
        along
    }

    /// Whether a position knows the stand's errors.
    pub fn has_stand(&self) -> bool {
        self.positions.iter().any(|position| matches!(position.attitude, Attitude::Stand(_)))
    }

    /// Whether its positions tell the stand's level from the axes.
    pub fn tells_level(&self) -> bool {
        self.has_stand() && self.positions.len() >= GOOD_POSITIONS
    }

    /// The position of a name.
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.positions.iter().position(|position| position.name == name)
    }
}

/// A vector turned about one of its axes.
fn about(axis: usize, v: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = libm::sincos(angle);
    let [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
    let mut turned = v;
    (turned[i], turned[j]) = (cos * v[i] - sin * v[j], sin * v[i] + cos * v[j]);
    turned
}

/// Case axes of (axis 2, axis 1, their cross product); `None` where both are the same.
fn mounting(axis_1: char, axis_2: char) -> Option<[[f64; 3]; 3]> {
    let unit = |axis: char| Some(Vector3::ith(['x', 'y', 'z'].iter().position(|name| *name == axis)?, 1.0));
    let (second, first): (Vector3<f64>, Vector3<f64>) = (unit(axis_2)?, unit(axis_1)?);
    (axis_1 != axis_2).then(|| [second, first, second.cross(&first)].map(Into::into))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_twelve_positions_show_each_axis_up_and_down_twice_and_level_errors_cancel() {
        let plan = Plan::twelve();
        let errors = [2e-4, -3e-4, 1.5e-4];
        for (axis, letter) in ["X", "Y", "Z"].iter().enumerate() {
            for (way, sign) in [("up", 1.0), ("down", -1.0)] {
                let seen = ["a", "b"].map(|which| {
                    let name = format!("{letter} {way} {which}");
                    let position = plan.index_of(&name).unwrap();
                    let nominal = plan.up(position, [0.0; 3]);
                    for (other, c) in nominal.iter().enumerate() {
                        assert!(
                            (c - if other == axis { sign } else { 0.0 }).abs() < 1e-15,
                            "{name} {nominal:?}"
                        );
                    }
                    plan.up(position, errors)
                });
                for other in (0..3).filter(|other| *other != axis) {
                    let mean = 0.5 * (seen[0][other] + seen[1][other]);
                    assert!(mean.abs() < 2e-7 && seen[0][other].abs() > 1e-5, "{letter} {way}: {seen:?}");
                }
            }
        }
    }

    #[test]
    fn plans_are_read_from_toml_and_csv_and_say_what_is_wrong() {
        let folder = tempfile::tempdir().unwrap();
        let read = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            Plan::named(path.to_str().unwrap())
        };
        let csv = read("a.csv", "name,axis_1_deg,axis_2_deg\nYa,0,0\nZa,0,90\n").unwrap();
        let toml = "[[position]]\nname = \"Ya\"\naxis_1_deg = 0.0\naxis_2_deg = 0.0\n[[position]]\nname = \"Za\"\naxis_1_deg = 0.0\naxis_2_deg = 90.0\n";
        assert_eq!(csv, read("a.toml", toml).unwrap());
        let up = read(
            "up.toml",
            "axis_1 = \"z\"\naxis_2 = \"x\"\n[[position]]\nname = \"t\"\nup = [0.0, 3.0, 4.0]\n",
        )
        .unwrap();
        let slanting = up.up(0, [1e-3; 3]);
        assert!(slanting.iter().zip([0.0, 0.6, 0.8]).all(|(a, b)| (a - b).abs() < 1e-15), "{slanting:?}");
        for (name, text, word) in [
            ("b.csv", "a,b\n", "column \"a\""),
            ("c.csv", "name,axis_1_deg,axis_2_deg\nYa,0\n", "line 2"),
            ("f.csv", "name,axis_1_deg,name\nYa,0,Za\n", "column \"name\" is given twice"),
            ("d.toml", "[[position]]\nname = \"Ya\"\n", "needs axis_1_deg"),
            ("e.toml", "axis_1 = \"y\"\naxis_2 = \"y\"\nposition = []\n", "two of x, y, z"),
        ] {
            let error = read(name, text).unwrap_err().to_string();
            assert!(error.contains(word), "{name}: {error}");
        }
    }
}
