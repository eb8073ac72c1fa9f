//! Findings in words: what, the numbers, the limit, what to do.

use std::fmt::{self, Display, Formatter};

use super::{Finding, Instead, Kind, Place};
use crate::axes::{AXES, main_axis};
use crate::fits::rates::plateaus::Plateau;
use crate::report::{counted, fixed, short};

/// Plateaus that are listed at most, and the share of the fastest one below which one is not worth telling.
const MOST: usize = 12;
const SEEN: f64 = 0.01;

impl Display for Finding {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.place, self.kind)
    }
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

impl Display for Kind {
    #[expect(clippy::too_many_lines, reason = "one sentence for each kind")]
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Accel(kind) => kind.fmt(f),
            Self::NotEachTemperature { deg_c } => write!(
                f,
                "the steps at {} °C do not turn about three axes: no change over temperature is fitted, and all temperatures count as one",
                fixed(*deg_c, 1)
            ),
            Self::NoStepStated { log } => {
                write!(f, "{log} has no step: add one to --steps, or leave the log out")
            }
            Self::Dead { log } => write!(
                f,
                "its reading is constant in {log}: it is dead, or its column is wrong; check the mapping, or leave \
                 the log out"
            ),
            Self::NoTicks { window_s: [from, to] } => write!(f, "there are no ticks from {from} s to {to} s"),
            Self::StepsOverlap { windows_s: [[from, to], [other, end]] } => write!(
                f,
                "two steps overlap, {from}…{to} s and {other}…{end} s: each part of the log may count only once. \
                 Correct begin_s and end_s in --steps"
            ),
            Self::SomeTimes => f.write_str("either all steps of a log state begin_s and end_s, or none"),
            Self::OtherPlateaus { stated, turning, found } => write!(
                f,
                "{} of the table {} stated, {} like the slowest of them or faster; found: {}. State all steps in \
                 their order, or their begin_s and end_s with --steps",
                counted(*stated, "step", "steps"),
                if *stated == 1 { "is" } else { "are" },
                counted(*turning, "plateau turns", "plateaus turn"),
                turning_plateaus(found)
            ),
            Self::OutOfProportion { window_s: [from, to], shown, stated, allowed, found } => write!(
                f,
                "the plateau of {from:.1}…{to:.1} s turns at {} °/s by the scale of the fastest one, its step is \
                 stated as {stated} °/s; {} °/s of difference are allowed. Check the order of the rates. Found: {}",
                short(*shown),
                short(*allowed),
                turning_plateaus(found)
            ),
            Self::UnstatedTurn { stated, turn, allowed: [most, alike], found } => write!(
                f,
                "a steady plateau is none of the {}: {}. A rest shows at most {} °/s and differs from the others by \
                 at most {} °/s. Found: {}. State all steps in their order, or their begin_s and end_s with --steps",
                counted(*stated, "stated step", "stated steps"),
                plateaus(&[turn]),
                short(*most),
                short(*alike),
                turning_plateaus(found)
            ),
            Self::BesideGaps { kind, share } => write!(
                f,
                "{kind}; in {:.0} % of the half seconds ticks are missing or unusable: the log has gaps, or the \
                 mapping has a wrong tick length or unit of the time column",
                100.0 * share
            ),
            Self::TurnedOtherwise { window_s: [from, to], stated: (rate, axis), shown, instead } => {
                write!(f, "in the step of {from:.1}…{to:.1} s, stated as {rate} °/s about {}", about(*axis))?;
                for (number, (name, rate)) in shown.iter().enumerate() {
                    let rate = short(*rate);
                    match number {
                        0 => write!(f, ", gyro {name} shows {rate} °/s")?,
                        _ => write!(f, " and gyro {name} {rate}")?,
                    }
                }
                f.write_str(": ")?;
                match instead.as_ref() {
                    Instead::Axis(turned, [angle_deg, most]) => write!(
                        f,
                        "the unit turned about {}, {angle_deg:.0}° off the stated axis, {most}° are allowed. State \
                         the true axis and sign of the rates, or correct the order of the columns in the mapping",
                        about(*turned)
                    ),
                    Instead::Factor([factor, most]) => write!(
                        f,
                        "that is {} times the stated rate by the document's weights, {} to {most} times are allowed. \
                         State the true axis and rates (°/s), or correct the columns of the mapping or the weights \
                         of the document",
                        short(*factor),
                        1.0 / most
                    ),
                }
            }
            Self::Unsteady { window_s: [from, to], stated, range: [low, high] } => write!(
                f,
                "the rate is not steady in the step of {from:.1}…{to:.1} s ({stated} °/s): it lies between {} and {} \
                 °/s. Check the times of the steps, and leave out the table's acceleration",
                short(*low),
                short(*high)
            ),
            Self::Lost { window_s: [from, to], share: [share, most] } => write!(
                f,
                "{:.1} % of the step of {from:.1}…{to:.1} s is unusable, at most {:.0} % may be: cut it with --steps",
                100.0 * share,
                100.0 * most
            ),
            Self::AtLimit { window_s: [from, to], stated } => write!(
                f,
                "a gyro is at its input limit in the step of {from:.1}…{to:.1} s ({stated} °/s): leave the step out, or turn slower"
            ),
            Self::NotLevel { at_beginning, force, troubles } => {
                let beginning = [" at its beginning", "of its first second ", " of that moment"];
                let all = ["", "", ", or --remove-mean instead of --latitude"];
                let [when, of, moment] = if *at_beginning { beginning } else { all };
                let force = force.map_or_else(
                    || "the document or the log has no accelerometers".to_owned(),
                    |force| {
                        format!(
                            "the mean force {of}is ({}) m/s²; it must be within 2 % of one g, x not vertical",
                            force.map(|part| fixed(part, 3)).join(", ")
                        )
                    },
                );
                write!(
                    f,
                    "the unit cannot be levelled{when}: {force}. Give --pitch and --roll{moment}, or correct the columns \
                     of the accelerometers in the mapping"
                )?;
                troubles.iter().try_for_each(|trouble| write!(f, "; {trouble}"))
            }
            Self::OneWay { axes } => {
                let names: Vec<&str> = axes.iter().filter_map(|axis| AXES.get(*axis).copied()).collect();
                write!(
                    f,
                    "all steps about {} turn one way: an asymmetry of the scale factor enters scale and bias. Turn \
                     both ways, at equal rates",
                    names.join(", about ")
                )
            }
            Self::NoAttitude => f.write_str(
                "the Earth's rate is unknown: steps are cut to whole turns, and its share along the table's axis is \
                 in the bias. Give --latitude, --heading, --pitch and --roll of the beginning of each log",
            ),
            Self::ShortSteps { rates } => {
                let mut named: Vec<String> = rates.iter().map(ToString::to_string).collect();
                named.sort();
                named.dedup();
                write!(
                    f,
                    "{} of {} °/s {} than a turn: up to the Earth's 15 °/h remains; make steps of whole turns",
                    counted(rates.len(), "step", "steps"),
                    named.join(", "),
                    if rates.len() == 1 { "is shorter" } else { "are shorter" }
                )
            }
            Self::Gravity { looks, rest, others } => {
                write!(f, "{looks}")?;
                if let Some(([begin_s, end_s], broken)) = rest {
                    write!(f, " (in the rest of {begin_s:.1}…{end_s:.1} s, gravity carried there by the gyros' turns")?;
                    if *broken > 0 {
                        write!(
                            f,
                            "; ticks are missing at {} before it, during which the table is assumed to turn on",
                            counted(*broken, "place", "places")
                        )?;
                    }
                    f.write_str(")")?;
                }
                let others: Vec<String> = others.iter().map(|log| (log + 1).to_string()).collect();
                match others.len() {
                    0 => Ok(()),
                    1 => write!(f, " (log {} shows the same)", others.join(", ")),
                    _ => write!(f, " (logs {} show the same)", others.join(", ")),
                }
            }
            Self::NothingTurns => f.write_str("no step turns: scale needs rates of the table"),
            Self::Across => f.write_str(
                "the input axis is across all axes of the table: turn about an axis nearer to it",
            ),
            Self::FewSteps { steps } => write!(
                f,
                "{} too few, or too much alike: use rates of both signs, at least two sizes, and a rest",
                counted(*steps, "step is", "steps are")
            ),
            Self::OtherScale { factor, most } => write!(
                f,
                "it shows {} times the rate by the document's weight, {} to {most} times are accepted: check the \
                 table's axis, the sign and unit of its rates, and the document's weight",
                short(*factor),
                1.0 / most
            ),
            Self::NotStraight { left, share: [share, most], chi_square } => write!(
                f,
                "the straight line leaves {} °/s of a step, {} % of the largest rate, at most {} % are accepted (χ² \
                 {} per degree of freedom): check the stated rates",
                short(*left),
                short(100.0 * share),
                100.0 * most,
                short(*chi_square)
            ),
            Self::Worse { axis } => write!(
                f,
                "its weight and axis make the rate about {} worse",
                AXES.get(*axis).copied().unwrap_or_default()
            ),
            Self::Passed { words } => f.write_str(words),
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runs::swapped::Looks;

    fn examples() -> Vec<Finding> {
        let plateau = |from: f64, rate: [f64; 3]| Plateau {
            bins: [0, 1],
            window_s: [from, from + 8.0],
            rate: rate.map(|rate| 3600.0 * rate).to_vec(),
        };
        let found = || vec![plateau(11.0, [36.0, 0.01, -0.02]), plateau(31.0, [-36.1, 0.0, 0.0])];
        let window_s = [11.0, 19.0];
        let looks = |order| {
            Box::new(Looks {
                kind: "accelerometers",
                measure: "m/s²",
                order,
                mean: [0.1, 9.8, 0.02],
                stated: [9.8, 0.1, 0.0],
            })
        };
        let stated = (36.0, [0.0, 1.0, 0.0]);
        let shown = || vec![("y".to_owned(), 0.02), ("x".to_owned(), 36.0)];
        let stray = Kind::OtherPlateaus { stated: 1, turning: 2, found: found() };
        vec![
            Kind::NoStepStated { log: "y.csv".into() }.in_log(1),
            Kind::Dead { log: "y.csv".into() }.of_gyro("z"),
            Kind::NoTicks { window_s }.in_log(0),
            Kind::StepsOverlap { windows_s: [window_s, [12.0, 20.0]] }.in_log(0),
            Kind::SomeTimes.in_log(0),
            stray.clone().in_log(0),
            Kind::OutOfProportion { window_s, shown: 35.0, stated: 72.0, allowed: 3.6, found: found() }
                .in_log(0),
            Kind::UnstatedTurn {
                stated: 2,
                turn: plateau(51.0, [5.0, 0.0, 0.0]),
                allowed: [7.2, 1.8],
                found: found(),
            }
            .in_log(0),
            Kind::BesideGaps { kind: Box::new(stray), share: 0.25 }.in_log(2),
            Kind::TurnedOtherwise {
                window_s,
                stated,
                shown: shown(),
                instead: Box::new(Instead::Axis([1.0, 0.0, 0.0], [90.0, 30.0])),
            }
            .in_log(0),
            Kind::TurnedOtherwise {
                window_s,
                stated,
                shown: shown(),
                instead: Box::new(Instead::Factor([10.0, 2.0])),
            }
            .in_log(0),
            Kind::Unsteady { window_s, stated: 36.0, range: [0.0, 36.2] }.in_log(0),
            Kind::Lost { window_s, share: [0.12, 0.05] }.in_log(0),
            Kind::AtLimit { window_s, stated: 400.0 }.in_log(0),
            Kind::NotLevel {
                at_beginning: true,
                force: Some([9.7, 0.1, 0.2]),
                troubles: vec!["2 ticks refused".into()],
            }
            .in_log(0),
            Kind::NotLevel { at_beginning: true, force: None, troubles: Vec::new() }.in_log(0),
            Kind::NotLevel { at_beginning: false, force: None, troubles: Vec::new() }.into(),
            Kind::OneWay { axes: vec![0, 2] }.into(),
            Kind::NoAttitude.into(),
            Kind::ShortSteps { rates: vec![1.0, -1.0, 1.0] }.into(),
            Kind::Gravity { looks: looks(Some([1, 0, 2])), rest: None, others: vec![1, 2] }.in_log(0),
            Kind::Gravity { looks: looks(None), rest: Some((window_s, 3)), others: vec![1] }.in_log(0),
            Kind::NothingTurns.of_gyro("x"),
            Kind::Across.of_gyro("x"),
            Kind::FewSteps { steps: 1 }.of_gyro("x"),
            Kind::OtherScale { factor: -2e-4, most: 2.0 }.of_gyro("x"),
            Kind::NotStraight { left: 10.0, share: [0.1, 0.01], chi_square: 1e9 }.of_gyro("x"),
            Kind::Worse { axis: 2 }.of_gyro("x"),
            Kind::Passed { words: "x.csv, y.csv, each: 2 ticks refused".into() }.into(),
        ]
    }

    /// Every sentence, so that a change of words is seen. `ISOTHERM_WORDS=1 cargo test -p isotherm-calibration words` writes the file anew.
    #[test]
    fn all_words() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/finding/words.txt");
        let words: String = examples().iter().map(|finding| finding.to_string() + "\n").collect();
        if std::env::var_os("ISOTHERM_WORDS").is_some() {
            std::fs::write(path, &words).unwrap();
        }
        assert_eq!(words, std::fs::read_to_string(path).unwrap());
    }
}
