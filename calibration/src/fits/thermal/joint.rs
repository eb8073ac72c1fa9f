//! All terms at once: what the sensors of a channel are explained best by together, and each by itself; what came of a sensor by any
//! method.

use super::branches::History;
use super::columns::{Branch, Columns, Effect, Term};
use super::compare::Rivals;
use super::fit::Sensor;
use super::known::Known;
use super::ladder::{Plan, lags, statics};
use super::model::{Dynamics, Spec};
use super::noise::Noise;
use super::samples::Samples;
use super::select::{Choice, Target, Trials, WORTH_IT, together};
use super::settings::Terms;
use crate::error::Error;
use crate::lsq::weighted::Solution;

/// Highest power of temperature in any model.
const HIGHEST: usize = 5;
/// Power of the static bias that a document is compared with.
pub(super) const CUBIC: usize = 3;
/// Share of the mean's beyond which passes through the same temperatures disagree.
const DISAGREE: f64 = 0.7;

/// The sensors of one channel with every model that is tried.
pub(super) struct Joint<'a> {
    columns: Columns<'a>,
    known: &'a Known,
    plans: Vec<Plan>,
    trials: Vec<(&'a Sensor, &'a Target, Trials<'a>)>,
    /// The plan that is best for all, how much it is shrunk, and the sum of the logarithms of the scores.
    best: Option<(usize, f64, f64)>,
}

impl<'a> Joint<'a> {
    /// Of the live sensors of a channel.
    pub(super) fn of(
        mut columns: Columns<'a>,
        samples: &'a [Samples],
        (known, longest_s): (&'a Known, f64),
        sensors: &[(&'a Sensor, &'a Target)],
    ) -> Result<Self, Error> {
        let history = &known.history;
        let plans = Plan::all(history, columns.basis().filter.grid_step_s, longest_s);
        let any_gyro = sensors.iter().any(|(sensor, _)| sensor.gyro);
        let mut terms: Vec<Term> = Effect::Static.powers(0..=HIGHEST).collect();
        terms.extend(plans.iter().flat_map(|plan| plan.spec(any_gyro, None, 0.0).dynamics.terms));
        columns.make(&terms)?;
        let noise = Noise::of(columns.basis(), samples, &terms)?;
        let trials: Vec<_> = sensors
            .iter()
            .map(|&(sensor, target)| {
                let pieces = (&history.piece[..], &known.temperature[..]);
                (sensor, target, Trials::of(target, &columns, &terms, &noise, pieces))
            })
            .collect();
        // One of which nothing can be judged has no say.
        let judged = trials.iter().filter(|(_, _, trials)| trials.score(&Spec::default()).is_some());
        let both: Vec<(bool, &Trials<'_>)> =
            judged.map(|(sensor, _, trials)| (sensor.gyro, trials)).collect();
        let best = together(&plans, &both);
        Ok(Self { columns, known, plans, trials, best })
    }

    /// What is left over all sensors, as the sum of the logarithms of their scores.
    pub(super) fn cost(&self) -> f64 {
        let alone = |(_, target, trials): &(&Sensor, &Target, Trials<'_>)| {
            let scores = statics(&self.known.history, target.widest_scale());
            let least = scores.iter().filter_map(|spec| trials.score(spec)).fold(f64::INFINITY, f64::min);
            if least.is_finite() { libm::log(least) } else { 0.0 }
        };
        self.best.map_or_else(|| self.trials.iter().map(alone).sum(), |(.., cost)| cost)
    }

    /// Finds the terms of one sensor.
    pub(super) fn find(&mut self, sensor: &Sensor, terms: Terms) -> Result<Found, Error> {
        let place = self.trials.iter().position(|(other, ..)| *other == sensor);
        let Some((_, target, trials)) = place.and_then(|place| self.trials.get(place)) else {
            return Ok(Found::refused("it has no windows"));
        };
        let (history, widest) = (&self.known.history, target.widest_scale());
        let spec_of = |plan: &Plan, shrink: f64| plan.spec(sensor.gyro, widest, shrink);
        let plan = self.best.and_then(|(index, shrink, _)| Some((self.plans.get(index)?, shrink)));
        let shrink = self.best.map_or(0.0, |(_, shrink, _)| shrink);
        let tried = self.plans.iter().filter_map(|plan| trials.tried(spec_of(plan, shrink))).collect();
        let plan = plan.map(|(plan, shrink)| spec_of(plan, shrink));
        let choice = trials.choose(tried, plan, history, terms == Terms::All);
        let Some(best) = choice.best().cloned() else {
            return Ok(Found::refused(
                "cross-validation is not possible: the log has only one temperature ramp; run the chamber both ways",
            ));
        };
        if terms == Terms::Auto
            && let Some(found) = Found::unless_better(&choice, target, &self.columns)
        {
            return Ok(Found { choice: Some(choice), ..found });
        }
        let doubt = doubt_of_passes(target, &self.columns, (history, &self.known.temperature))
            .filter(|_| !best.spec.dynamics.terms.is_empty());
        let Some(solution) = trials.solve(&self.columns, &best.spec) else {
            return Ok(Found {
                choice: Some(choice),
                ..Found::refused("the model has no solution on this log")
            });
        };
        let mut found = Found::chosen(choice, &best.spec, &solution, target.level);
        let pairs: Vec<(Term, f64)> = found.terms.iter().map(|(term, value, _)| (*term, *value)).collect();
        found.passed_on = Some(trials.passed_on(&pairs));
        found.remarks.extend(doubt);
        found.rivals = Some(rivals(&mut self.columns, sensor, target, best.spec.scale)?);
        Ok(found)
    }
}

/// A mean, and cubics over temperature, by plain least squares, without and with what follows Ṫ: a lag of the shortest time constant where a sensor
/// has no such term.
pub(super) fn rivals(
    columns: &mut Columns<'_>,
    sensor: &Sensor,
    target: &Target,
    scale: Option<usize>,
) -> Result<Rivals, Error> {
    let rate = if sensor.gyro {
        vec![Effect::Rate(Branch::Both).power(0)]
    } else {
        lags(&[(3.0 * columns.basis().filter.grid_step_s).max(2.0)], 0).terms
    };
    columns.make(&rate)?;
    let weights = target.weights.iter().map(|weight| f64::from(u8::from(*weight > 0.0))).collect();
    let plain = Target { weights, ..target.clone() };
    let solved = |degree: usize, terms: Vec<Term>| {
        let spec =
            Spec { degree, dynamics: Dynamics { terms, ..Dynamics::default() }, scale, ..Spec::default() };
        let solution = plain.solve(columns, &spec, true);
        solution.map_or_else(Vec::new, |solution| spec.found(&solution, target.level))
    };
    Ok([solved(0, Vec::new()), solved(CUBIC, Vec::new()), solved(CUBIC, rate)])
}

/// What is to be known of a sensor whose passes through the same temperatures disagree; `None` where the log tells lags from
/// hysteresis anyway, or nothing can be judged.
///
/// A log of one cooling and one heating can have any difference between the two explained by a lag: cross-validation on pieces of
/// the same two passes finds nothing wrong with it, and the next run may. What the log can say is how much of a sensor's output the
/// passes have in common: what a static bias, fitted to the other passes, leaves of a pass, as a share of what their mean leaves.
fn doubt_of_passes(
    target: &Target,
    columns: &Columns<'_>,
    (history, temperature): (&History, &[f64]),
) -> Option<String> {
    if history.tells_dynamics() || !history.both_directions() {
        return None;
    }
    let terms: Vec<Term> = Effect::Static.powers(0..=CUBIC).collect();
    let trials = Trials::of(target, columns, &terms, &Noise::default(), (&history.ramp, temperature));
    let left =
        |degree: usize| trials.score(&Spec { degree, scale: target.widest_scale(), ..Spec::default() });
    let share = left(CUBIC)? / left(0)?;
    (share > DISAGREE).then(|| {
        format!(
            "its passes through the same temperatures disagree: a static bias of one leaves {:.0} % of what its mean \
             leaves on the other. A lag can explain any such difference, right or wrong: judge on another run \
             (--judge), or add a third pass",
            100.0 * share
        )
    })
}

/// What came of one sensor.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Found {
    /// Coefficients and their standard errors.
    pub(super) terms: Vec<(Term, f64, f64)>,
    /// The model in words.
    pub(super) words: String,
    /// Cross-validation, where it was asked.
    pub(super) choice: Option<Choice>,
    /// Why there are no terms.
    pub(super) refused: Option<String>,
    /// What is to be known.
    pub(super) remarks: Vec<String>,
    /// What they are compared with.
    pub(super) rivals: Option<Rivals>,
    /// Root mean square of the thermometer's noise that they pass on.
    pub(super) passed_on: Option<f64>,
    /// Whether temperature does nothing to it.
    pub(super) flat: bool,
}

impl Found {
    pub(super) fn refused(why: &str) -> Self {
        Self { refused: Some(why.to_owned()), ..Self::default() }
    }

    /// A sensor that temperature does nothing to; where its level is known, that is its bias.
    pub(super) fn flat(level: &Solution, known: bool) -> Self {
        let constant = level.coefficients.first().zip(level.sigmas.first()).filter(|_| known);
        Self {
            terms: constant
                .map(|(value, sigma)| (Effect::Static.power(0), *value, *sigma))
                .into_iter()
                .collect(),
            words: "constant".to_owned(),
            flat: true,
            ..Self::default()
        }
    }

    /// A sensor whose best model is no better than its mean on parts that it did not see: temperature does nothing to it, or something
    /// else does more.
    pub(super) fn unless_better(choice: &Choice, target: &Target, columns: &Columns<'_>) -> Option<Self> {
        let best = choice.best()?;
        if best.score <= WORTH_IT * choice.mean {
            return None;
        }
        Some(target.flat(columns).map_or_else(
            || {
                Self::refused(&format!(
                    "no model beats its mean: the best one, {}, leaves {:.1} % of what the mean leaves on unseen parts; \
                     the axis does not follow temperature",
                    best.spec.words(),
                    100.0 * best.score / choice.mean
                ))
            },
            |level| Self::flat(&level, target.level),
        ))
    }

    pub(super) fn chosen(choice: Choice, spec: &Spec, solution: &Solution, level: bool) -> Self {
        let mut remarks = Vec::new();
        // A few are the fit's own business; more are somebody's.
        if 10 * solution.outliers > solution.residual.len() {
            remarks.push(format!(
                "{} of {} windows were left out as spikes: something disturbs the sensor, check the log",
                solution.outliers,
                solution.residual.len()
            ));
        }
        Self {
            terms: spec.found(solution, level),
            words: spec.words(),
            choice: Some(choice),
            remarks,
            ..Self::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use isotherm_correction::sample::{ChannelName, TemperatureReading};
    use isotherm_correction::units::{Span, Timestamp};
    use isotherm_protocol::document::{Channel, Filter};

    use super::super::bare;
    use super::super::noise::Thermometer;
    use super::*;
    use crate::fixture::noise;

    const WINDOW_S: f64 = 10.0;

    /// A chamber's cycle with holds at both ends (°C), by window.
    fn cycle() -> Vec<f64> {
        let mut t = vec![20.0];
        for (to, windows) in [(20.0, 60), (-40.0, 360), (-40.0, 120), (60.0, 600), (60.0, 120), (20.0, 240)] {
            let from = t[t.len() - 1];
            t.extend((1..=windows).map(|i| from + (to - from) * f64::from(i) / f64::from(windows)));
        }
        t
    }

    /// Whether T̈ is chosen for a gyro that has a little of it, by the noise of a thermometer (°C) that the columns are without.
    fn leads(sigma: f64) -> bool {
        let name = "gyro0".to_owned();
        let cycle = cycle();
        let middles = |first: f64| (0_u32..).map(move |i| (f64::from(i) + first) * WINDOW_S);
        let readings = cycle.iter().zip(middles(0.0)).map(|(t, time_s)| TemperatureReading {
            channel: ChannelName::from(&name).unwrap(),
            time: Timestamp::from_ns(Span::from_s(time_s).as_ns()),
            raw: *t,
        });
        let samples = [Samples {
            window_s: WINDOW_S,
            time_s: middles(0.5).take(cycle.len() - 1).collect(),
            temperatures: [(name.clone(), readings.collect())].into(),
            thermometers: [(name.clone(), Thermometer { usual: 20.0, sigma, step_s: WINDOW_S })].into(),
            ..Samples::default()
        }];
        let filter = Filter { smoothing_s: 20.0, derivative_step_s: 20.0, ..bare::filter(WINDOW_S) };
        let channel = Channel {
            name: name.clone(),
            conversion_deg_c: vec![0.0, 1.0],
            range_deg_c: [-80.0, 130.0],
            spike_limit_deg_c: 100.0,
        };
        let known =
            Known { history: History::of(&[(&cycle[1..], WINDOW_S)]), temperature: cycle[1..].to_vec() };
        let mut columns = Columns::new(known.basis(channel, &filter), &samples);
        let (lag, led) = (Effect::Lag(30_000).power(0), Effect::Acceleration(Branch::Both).power(0));
        columns.make(&[lag, led]).unwrap();
        let mut noise = noise();
        let parts = columns.get(lag).iter().zip(columns.get(led));
        let values: Vec<f64> = parts.map(|(lag, led)| 20.0 * lag + 300.0 * led + 0.02 * noise()).collect();
        let target = Target {
            weights: vec![1.0; values.len()],
            run: vec![0; values.len()],
            values,
            ..Target::default()
        };
        let sensor = Sensor { gyro: true, index: 0, name: name.clone(), channel: name, dead: None };
        let joint = Joint::of(columns, &samples, (&known, 15000.0), &[(&sensor, &target)]).unwrap();
        joint.plans[joint.best.unwrap().0].leads
    }

    #[test]
    fn what_fits_hardly_better_is_not_chosen_where_it_passes_on_a_thermometers_noise() {
        assert!(leads(0.0) && !leads(0.003));
    }
}
