//! What can be wrong with logs, or is worth telling of them: a kind with its numbers and its sentence (what, the numbers, the limit, what
//! to do), and its place. Whoever decides, and whoever tests, looks at the kind.

mod accel;
#[cfg(test)]
mod tests;
mod thermal;

use std::fmt::{self, Display, Formatter};

use thiserror::Error;

use crate::axes::{AXES, main_axis};
use crate::fits::rates::plateaus::Plateau;
use crate::report::{counted, fixed, short};
use crate::runs::swapped::Looks;

pub use accel::AccelKind;
pub use thermal::ThermalKind;

/// Plateaus that are listed at most, and the share of the fastest one below which one is not worth telling.
const MOST: usize = 12;
const SEEN: f64 = 0.01;

/// Something that was found, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Where.
    pub place: Place,
    /// What.
    pub kind: Kind,
}

impl Display for Finding {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.place, self.kind)
    }
}

/// Where something was found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Place {
    /// The log, by number from 0.
    pub log: Option<usize>,
    /// Name of the gyro.
    pub gyro: Option<String>,
    /// Name of the accelerometer.
    pub accel: Option<String>,
}

impl Display for Place {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if let Some(log) = self.log {
            write!(f, "log {}: ", log + 1)?;
        }
        if let Some(name) = &self.accel {
            write!(f, "accelerometer {name}: ")?;
        }
        self.gyro.as_ref().map_or(Ok(()), |gyro| write!(f, "gyro {gyro}: "))
    }
}

/// What was found. Rates are in °/s, windows in s since the beginning of the log, shares of one.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the text of each kind says what its numbers are")]
pub enum Kind {
    /// Nothing is said of what the table did in a log of this name.
    #[error("{log} has no step: add one to --steps, or leave the log out")]
    NoStepStated { log: String },
    /// A gyro reads the same all the time in a log of this name.
    #[error(
        "its reading is constant in {log}: it is dead, or its column is wrong; check the mapping, or leave the log out"
    )]
    Dead { log: String },
    /// A step lies where the log has no ticks.
    #[error("there are no ticks from {} s to {} s", .window_s[0], .window_s[1])]
    NoTicks { window_s: [f64; 2] },
    /// Two steps share a time.
    #[error(
        "two steps overlap, {}…{} s and {}…{} s: each part of the log may count only once. Correct begin_s and end_s \
         in --steps",
        .windows_s[0][0], .windows_s[0][1], .windows_s[1][0], .windows_s[1][1]
    )]
    StepsOverlap { windows_s: [[f64; 2]; 2] },
    /// Some steps of a log state their times, others do not.
    #[error("either all steps of a log state begin_s and end_s, or none")]
    SomeTimes,
    /// Other plateaus than stated steps that turn: how many turn like the slowest of them or faster, and all of them.
    #[error(
        "{} of the table {} stated, {} like the slowest of them or faster; found: {}. State all steps in their order, or \
         their begin_s and end_s with --steps",
        counted(*.stated, "step", "steps"),
        if *.stated == 1 { "is" } else { "are" },
        counted(*.turning, "plateau turns", "plateaus turn"),
        turning_plateaus(.found)
    )]
    OtherPlateaus { stated: usize, turning: usize, found: Vec<Plateau> },
    /// A plateau is not in proportion to its step: its rate by the scale of the fastest one, and the difference that is allowed.
    #[error(
        "the plateau of {:.1}…{:.1} s turns at {} °/s by the scale of the fastest one, its step is stated as {stated} \
         °/s; {} °/s of difference are allowed. Check the order of the rates. Found: {}",
        .window_s[0], .window_s[1], short(*.shown), short(*.allowed), turning_plateaus(.found)
    )]
    OutOfProportion { window_s: [f64; 2], shown: f64, stated: f64, allowed: f64, found: Vec<Plateau> },
    /// A plateau turns that is no step; `allowed` is what a rest may show, and by how much rests may differ.
    #[error(
        "a steady plateau is none of the {}: {}. A rest shows at most {} °/s and differs from the others by at most {} \
         °/s. Found: {}. State all steps in their order, or their begin_s and end_s with --steps",
        counted(*.stated, "stated step", "stated steps"),
        plateaus(&[.turn]), short(.allowed[0]), short(.allowed[1]), turning_plateaus(.found)
    )]
    UnstatedTurn { stated: usize, turn: Plateau, allowed: [f64; 2], found: Vec<Plateau> },
    /// The same, where many (a share) of the half seconds lack ticks.
    #[error(
        "{kind}; in {:.0} % of the half seconds ticks are missing or unusable: the log has gaps, or the mapping has a \
         wrong tick length or unit of the time column",
        100.0 * .share
    )]
    BesideGaps { kind: Box<Kind>, share: f64 },
    /// The unit turned about another axis than stated (with its rate), or at another rate. `shown` is the gyro nearest to the axis and
    /// its rate, and the liveliest one where that is another.
    #[error(
        "in the step of {:.1}…{:.1} s, stated as {} °/s about {}, {}: {instead}",
        .window_s[0], .window_s[1], .stated.0, about(.stated.1),
        .shown.iter().map(|(name, rate)| format!("gyro {name} shows {} °/s", short(*rate))).collect::<Vec<_>>().join(" and ")
    )]
    TurnedOtherwise {
        window_s: [f64; 2],
        stated: (f64, [f64; 3]),
        shown: Vec<(String, f64)>,
        instead: Box<Instead>,
    },
    /// The rate of a step is not steady: lowest and highest rate.
    #[error(
        "the rate is not steady in the step of {:.1}…{:.1} s ({stated} °/s): it lies between {} and {} °/s. Check the \
         times of the steps, and leave out the table's acceleration",
        .window_s[0], .window_s[1], short(.range[0]), short(.range[1])
    )]
    Unsteady { window_s: [f64; 2], stated: f64, range: [f64; 2] },
    /// Too many ticks of a step cannot be used: share that cannot, and that may.
    #[error(
        "{:.1} % of the step of {:.1}…{:.1} s is unusable, at most {:.0} % may be: cut it with --steps",
        100.0 * .share[0], .window_s[0], .window_s[1], 100.0 * .share[1]
    )]
    Lost { window_s: [f64; 2], share: [f64; 2] },
    /// A gyro is at its input limit in a step.
    #[error(
        "a gyro is at its input limit in the step of {:.1}…{:.1} s ({stated} °/s): leave the step out, or turn slower",
        .window_s[0], .window_s[1]
    )]
    AtLimit { window_s: [f64; 2], stated: f64 },
    /// The unit cannot be levelled: by the first second of the log, or by all of it. The mean force (m/s²) is `None` without
    /// accelerometers; `troubles` is what the correction passed over.
    #[error("{}", not_level(*.at_beginning, *.force, .troubles))]
    NotLevel { at_beginning: bool, force: Option<[f64; 3]>, troubles: Vec<String> },
    /// All steps about some axes, 0…2, turn one way.
    #[error(
        "all steps about {} turn one way: an asymmetry of the scale factor enters scale and bias. Turn both ways, at equal \
         rates",
        .axes.iter().map(|axis| AXES[*axis]).collect::<Vec<_>>().join(", about ")
    )]
    OneWay { axes: Vec<usize> },
    /// The attitude is not known.
    #[error(
        "the Earth's rate is unknown: steps are cut to whole turns, and its share along the table's axis is in the bias. \
         Give --latitude, --heading, --pitch and --roll of the beginning of each log"
    )]
    NoAttitude,
    /// Steps that are shorter than a turn, by their rates.
    #[error(
        "{} of {} °/s {} than a turn: up to the Earth's 15 °/h remains; make steps of whole turns",
        counted(.rates.len(), "step", "steps"),
        distinct(.rates),
        if .rates.len() == 1 { "is shorter" } else { "are shorter" }
    )]
    ShortSteps { rates: Vec<f64> },
    /// The accelerometers do not show gravity where the attitude has it: in the rest to which the turns carried gravity, with the places
    /// where ticks are missing before, `None` at the beginning. Other logs, from 0, show the same.
    #[error("{looks}{}", in_rest(*.rest, .others))]
    Gravity { looks: Box<Looks>, rest: Option<([f64; 2], usize)>, others: Vec<usize> },
    /// No step turns.
    #[error("no step turns: scale needs rates of the table")]
    NothingTurns,
    /// A gyro's input axis is across all axes of the table.
    #[error("the input axis is across all axes of the table: turn about an axis nearer to it")]
    Across,
    /// Too few steps, or too much alike.
    #[error(
        "{} too few, or too much alike: use rates of both signs, at least two sizes, and a rest",
        counted(*.steps, "step is", "steps are")
    )]
    FewSteps { steps: usize },
    /// A scale factor, over the document's, that no gyro has, and the largest that is a result.
    #[error(
        "it shows {} times the rate by the document's weight, {} to {most} times are accepted: check the table's axis, the \
         sign and unit of its rates, and the document's weight",
        short(*.factor), 1.0 / .most
    )]
    OtherScale { factor: f64, most: f64 },
    /// A straight line does not describe the steps: what it leaves of one, that over the largest rate and what is a result, and χ² per
    /// degree of freedom.
    #[error(
        "the straight line leaves {} °/s of a step, {} % of the largest rate, at most {} % are accepted (χ² {} per degree \
         of freedom): check the stated rates",
        short(*.left), short(100.0 * .share[0]), 100.0 * .share[1], short(*.chi_square)
    )]
    NotStraight { left: f64, share: [f64; 2], chi_square: f64 },
    /// What was found makes the rate about an axis, 0…2, worse.
    #[error("its weight and axis make the rate about {} worse", AXES[*.axis])]
    Worse { axis: usize },
    /// The table was at several temperatures, and the steps of one of them (°C) do not tell weights and axes of all gyros.
    #[error(
        "the steps at {} °C do not turn about three axes: no change over temperature is fitted, and but for the bias all \
         temperatures count as one",
        fixed(*.deg_c, 1)
    )]
    NotEachTemperature { deg_c: f64 },
    /// Something of an accelerometer.
    #[error(transparent)]
    Accel(AccelKind),
    /// What the correction of some logs passed over, in its words.
    #[error("{words}")]
    Passed { words: String },
}

/// What a unit did instead of turning as stated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Instead {
    /// It turned about this axis, so many degrees off, where so many are allowed.
    #[error(
        "the unit turned about {}, {:.0}° off the stated axis, {}° are allowed. State the true axis and sign of the rates, \
         or correct the order of the columns in the mapping",
        about(*.0), .1[0], .1[1]
    )]
    Axis([f64; 3], [f64; 2]),
    /// It turned at so many times the rate, where at most so many are allowed.
    #[error(
        "that is {} times the stated rate by the document's weights, {} to {} times are allowed. State the true axis and \
         rates (°/s), or correct the columns of the mapping or the weights of the document",
        short(.0[0]), 1.0 / .0[1], .0[1]
    )]
    Factor([f64; 2]),
}

impl Kind {
    /// In a log.
    pub fn in_log(self, log: usize) -> Finding {
        Finding { place: Place { log: Some(log), ..Place::default() }, kind: self }
    }

    /// Of a gyro.
    pub fn of_gyro(self, name: &str) -> Finding {
        Finding { place: Place { gyro: Some(name.to_owned()), ..Place::default() }, kind: self }
    }
}

impl AccelKind {
    /// Of an accelerometer.
    pub fn of(self, name: &str) -> Finding {
        let place = Place { accel: Some(name.to_owned()), ..Place::default() };
        Finding { place, kind: Kind::Accel(self) }
    }
}

impl From<Kind> for Finding {
    fn from(kind: Kind) -> Self {
        Self { place: Place::default(), kind }
    }
}

fn not_level(at_beginning: bool, force: Option<[f64; 3]>, troubles: &[String]) -> String {
    let beginning = [" at its beginning", "of its first second ", " of that moment"];
    let all = ["", "", ", or leave --latitude out"];
    let [when, of, moment] = if at_beginning { beginning } else { all };
    let force = force.map_or_else(
        || "there are no valid accelerometer readings in m/s² in the log, or no accelerometers in the document".to_owned(),
        |force| {
            let parts = force.map(|part| fixed(part, 3)).join(", ");
            format!("the mean force {of}is ({parts}) m/s²; it must be within 2 % of one g, x not vertical")
        },
    );
    let what = format!(
        "the unit cannot be levelled{when}: {force}. Give --pitch and --roll{moment}, or correct the columns of the \
         accelerometers in the mapping"
    );
    [&[what], troubles].concat().join("; ")
}

fn in_rest(rest: Option<([f64; 2], usize)>, others: &[usize]) -> String {
    let rest = rest.map_or_else(String::new, |([begin_s, end_s], broken)| {
        let gaps = counted(broken, "place", "places");
        let gaps =
            format!("; ticks are missing at {gaps} before it, during which the table is assumed to turn on");
        let gaps = if broken > 0 { gaps.as_str() } else { "" };
        format!(
            " (in the rest of {begin_s:.1}…{end_s:.1} s, gravity carried there by the gyros' turns{gaps})"
        )
    });
    let logs: Vec<String> = others.iter().map(|log| (log + 1).to_string()).collect();
    match logs.as_slice() {
        [] => rest,
        [log] => format!("{rest} (log {log} shows the same)"),
        logs => format!("{rest} (logs {} show the same)", logs.join(", ")),
    }
}

/// Numbers, each once.
fn distinct(numbers: &[f64]) -> String {
    let mut named: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    named.sort();
    named.dedup();
    named.join(", ")
}

/// An axis by its name where it is near a case axis, else as three numbers.
fn about(axis: [f64; 3]) -> String {
    const NEAR: f64 = 0.985;
    let main = main_axis(&axis);
    if axis[main].abs() > NEAR {
        return format!("{}{}", if axis[main] < 0.0 { "-" } else { "" }, AXES[main]);
    }
    axis.map(|part| fixed(part, 2)).join(",")
}

/// The plateaus that turn.
fn turning_plateaus(found: &[Plateau]) -> String {
    let fastest = found.iter().map(Plateau::size).fold(0.0, f64::max);
    plateaus(&found.iter().filter(|plateau| plateau.size() > SEEN * fastest).collect::<Vec<_>>())
}

fn plateaus(found: &[&Plateau]) -> String {
    let one = |plateau: &&Plateau| {
        let rates: Vec<String> = plateau.rate.iter().map(|rate| fixed(rate / 3600.0, 3)).collect();
        format!("{:.1}…{:.1} s at ({}) °/s", plateau.window_s[0], plateau.window_s[1], rates.join(", "))
    };
    let mut list: Vec<String> = found.iter().take(MOST).map(one).collect();
    if found.len() > MOST {
        list.push(format!("and {} more", found.len() - MOST));
    }
    if list.is_empty() { "none".to_owned() } else { list.join("; ") }
}
