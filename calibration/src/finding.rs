//! What can be wrong with logs, or is worth telling of them: a kind with its numbers, and its place. Words for it are made in one place,
//! `finding/words.rs`; whoever decides, and whoever tests, looks at the kind.

mod accel;
mod words;

pub use accel::AccelKind;

use crate::fits::rates::plateaus::Plateau;
use crate::runs::swapped::Looks;

/// Something that was found, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Where.
    pub place: Place,
    /// What.
    pub kind: Kind,
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

/// What was found. Rates are in °/s, windows in s since the beginning of the log, shares of one.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// Nothing is said of what the table did in a log.
    NoStepStated {
        /// The log's name.
        log: String,
    },
    /// A gyro reads the same all the time.
    Dead {
        /// The log's name.
        log: String,
    },
    /// A step lies where the log has no ticks.
    NoTicks {
        /// The stated window.
        window_s: [f64; 2],
    },
    /// Two steps share a time.
    StepsOverlap {
        /// Their windows.
        windows_s: [[f64; 2]; 2],
    },
    /// Some steps of a log state their times, others do not.
    SomeTimes,
    /// Other plateaus than stated steps.
    OtherPlateaus {
        /// Stated steps that turn.
        stated: usize,
        /// Plateaus that turn like the slowest of them or faster.
        turning: usize,
        /// All plateaus.
        found: Vec<Plateau>,
    },
    /// A plateau is not in proportion to its step.
    OutOfProportion {
        /// The plateau's window.
        window_s: [f64; 2],
        /// Its rate by the scale of the fastest one.
        shown: f64,
        /// The stated rate.
        stated: f64,
        /// The difference that is allowed.
        allowed: f64,
        /// All plateaus.
        found: Vec<Plateau>,
    },
    /// A plateau turns that is no step.
    UnstatedTurn {
        /// Stated steps.
        stated: usize,
        /// The plateau.
        turn: Plateau,
        /// What a rest may show, and by how much rests may differ.
        allowed: [f64; 2],
        /// All plateaus.
        found: Vec<Plateau>,
    },
    /// The same, where many of the half seconds lack ticks.
    BesideGaps {
        /// What was found.
        kind: Box<Kind>,
        /// Share of the half seconds.
        share: f64,
    },
    /// The unit turned about another axis than stated, or at another rate.
    TurnedOtherwise {
        /// The step's window.
        window_s: [f64; 2],
        /// Stated rate and axis.
        stated: (f64, [f64; 3]),
        /// The gyro nearest to the axis and its rate; the liveliest one where that is another.
        shown: Vec<(String, f64)>,
        /// The axis and its angle to the stated one (°), or the rate over the stated one.
        instead: Box<Instead>,
    },
    /// The rate of a step is not steady.
    Unsteady {
        /// The step's window.
        window_s: [f64; 2],
        /// Its stated rate.
        stated: f64,
        /// Lowest and highest rate.
        range: [f64; 2],
    },
    /// Too many ticks of a step cannot be used.
    Lost {
        /// The step's window.
        window_s: [f64; 2],
        /// Share that cannot, and that may.
        share: [f64; 2],
    },
    /// A gyro is at its input limit.
    AtLimit {
        /// The step's window.
        window_s: [f64; 2],
        /// Its stated rate.
        stated: f64,
    },
    /// The unit cannot be levelled.
    NotLevel {
        /// Whether it would have to be by the first second of the log; else by all of it.
        at_beginning: bool,
        /// Mean force (m/s²); `None` without accelerometers.
        force: Option<[f64; 3]>,
        /// What the correction passed over.
        troubles: Vec<String>,
    },
    /// All steps about some axes turn one way.
    OneWay {
        /// The axes, 0…2.
        axes: Vec<usize>,
    },
    /// The attitude is not known.
    NoAttitude,
    /// Steps that are shorter than a turn.
    ShortSteps {
        /// Their rates.
        rates: Vec<f64>,
    },
    /// The accelerometers do not show gravity where the attitude has it.
    Gravity {
        /// What they show.
        looks: Box<Looks>,
        /// The rest to which the turns carried gravity, and places where ticks are missing before; `None` at the beginning.
        rest: Option<([f64; 2], usize)>,
        /// Other logs that show the same, from 0.
        others: Vec<usize>,
    },
    /// No step turns.
    NothingTurns,
    /// A gyro's input axis is across all axes of the table.
    Across,
    /// Too few steps, or too much alike.
    FewSteps {
        /// Their number.
        steps: usize,
    },
    /// A scale factor that no gyro has.
    OtherScale {
        /// Over the document's.
        factor: f64,
        /// Most that is a result.
        most: f64,
    },
    /// A straight line does not describe the steps.
    NotStraight {
        /// What it leaves of a step.
        left: f64,
        /// That over the largest rate, and what is a result.
        share: [f64; 2],
        /// χ² per degree of freedom.
        chi_square: f64,
    },
    /// What was found makes the rate about an axis worse.
    Worse {
        /// The axis, 0…2.
        axis: usize,
    },
    /// The table was at several temperatures, and the steps of one of them do not tell weights and axes of all gyros.
    NotEachTemperature {
        /// The temperature (°C).
        deg_c: f64,
    },
    /// Something of an accelerometer.
    Accel(AccelKind),
    /// What the correction of some logs passed over, in its words.
    Passed {
        /// The sentence.
        words: String,
    },
}

/// What a unit did instead of turning as stated.
#[derive(Debug, Clone, PartialEq)]
pub enum Instead {
    /// It turned about this axis, so many degrees off, where so many are allowed.
    Axis([f64; 3], [f64; 2]),
    /// It turned at so many times the rate, where at most so many are allowed.
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
