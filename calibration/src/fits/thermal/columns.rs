//! What one unit of each term subtracts, taken from the corrector itself.
//!
//! A gyro gets the term with the coefficient one and nothing else, and the run's own temperature readings, without their noise, are
//! driven through the service's stream with it. The bias that the corrector then subtracts is the term's column, with filter, grid,
//! derivative step and the ramps between readings as the service has them. As many terms go in at a time as a unit has gyros.

use std::collections::BTreeMap;
use std::iter;
use std::ops::RangeInclusive;
use std::slice;
use std::sync::Arc;

use isotherm_correction::calibration::{
    BranchArgument, BranchedParts, Calibration, CalibrationParts, Defect, TermParts,
};
use isotherm_correction::observation::Observation;
use isotherm_correction::sample::{
    GyroTick, MAX_SENSORS, MIN_SENSORS, OutputKind, SensorFlags, Sensors, TemperatureReading,
};
use isotherm_correction::thermal::Feature;
use isotherm_correction::unit::{Event, MAX_TICK_DURATION, UnitSettings};
use isotherm_correction::units::{AngularRate, Span, Timestamp};
use isotherm_log::offline::{Loaded, unit_id};
use isotherm_protocol::document::{Argument, Channel, Curve, Filter, Shape};

use super::samples::Samples;
use crate::document::tidy;
use crate::error::Error;
use crate::numbers::{ends, real, seconds};

/// Which thermal branches a term acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Branch {
    /// Both.
    Both,
    /// Run-up, Ṫ·T̈ > 0.
    RunUp,
    /// Braking, Ṫ·T̈ < 0.
    Braking,
}

/// What a term follows beside the temperature's level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// Nothing.
    Static,
    /// Ṫ.
    Rate(Branch),
    /// T̈.
    Acceleration(Branch),
    /// `(T − L_τ)/τ`, τ in milliseconds.
    Lag(u64),
    /// What the sensor feels, in ppm of its scale factor: a column of each sensor's own.
    Scale,
}

/// What the coefficient of an effect is a curve over, and which.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Form {
    /// A polynomial in temperature.
    OverTemperature,
    /// A parabola over the derivative that the coefficient multiplies.
    Parabola,
    /// Straight lines over it.
    Lines,
    /// A spline over it.
    Spline,
}

impl Form {
    /// All of them, the plainest first.
    pub const ALL: [Self; 4] = [Self::OverTemperature, Self::Parabola, Self::Lines, Self::Spline];

    /// Number of the knots that a curve over a derivative has its values at.
    pub const fn knots(self) -> usize {
        [0, 3, 5, 5][self as usize]
    }
}

/// A term with one coefficient: its effect times (T − reference)ʲ, or its effect where its curve is one at a knot, and zero at others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Term {
    /// What it follows.
    pub effect: Effect,
    /// The curve that it is a part of.
    pub form: Form,
    /// j, or the knot's number from 0.
    pub power: usize,
}

impl Effect {
    /// Its term with a power of temperature.
    pub const fn power(self, power: usize) -> Term {
        Term { effect: self, form: Form::OverTemperature, power }
    }

    /// Its terms with a curve over the derivative.
    pub fn knots(self, form: Form) -> impl Iterator<Item = Term> {
        (0..form.knots()).map(move |power| Term { effect: self, form, power })
    }

    /// Its terms with some powers of temperature.
    pub fn powers(self, powers: RangeInclusive<usize>) -> impl Iterator<Item = Term> {
        powers.map(move |power| self.power(power))
    }
}

/// Time constant in the form that terms are told apart by.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0.001 to 1e7 s")]
pub fn millis(tau_s: f64) -> u64 {
    libm::round(tau_s * 1e3).clamp(1.0, 1e10) as u64
}

/// Time constant (s) of a lag term.
pub fn tau_s(millis: u64) -> f64 {
    real(millis) / 1e3
}

/// Channel, filter and the range of what follows them: what columns are made with.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    /// The channel.
    pub channel: Channel,
    /// The filter, with its dead band.
    pub filter: Filter,
    /// Point about which powers are taken (°C).
    pub reference_deg_c: f64,
    /// Fitted range (°C).
    pub range_deg_c: [f64; 2],
    /// Fitted ranges of Ṫ (°C/s) and of T̈ (°C/s²), where curves are over them.
    pub derivatives: [[f64; 2]; 2],
}

/// Columns of one channel over the windows of several runs, one after the other, made when they are asked for.
#[derive(Debug)]
pub struct Columns<'a> {
    basis: Basis,
    runs: &'a [Samples],
    known: BTreeMap<Term, Vec<f64>>,
}

impl Basis {
    /// Where the curve of a term over a derivative has its values (°C/s or °C/s²).
    pub(super) fn knots(&self, term: Term) -> Vec<f64> {
        let [low, high] = self.derivatives[usize::from(matches!(term.effect, Effect::Acceleration(_)))];
        let last = real(term.form.knots().saturating_sub(1));
        (0..term.form.knots()).map(|knot| tidy(low + (high - low) * real(knot) / last)).collect()
    }

    /// The curve that a term is a part of, from the coefficients of all its parts.
    fn shape(&self, term: Term, coefficients: Vec<f64>) -> Shape {
        let places = self.knots(term);
        let knots = || places.iter().zip(&coefficients).map(|(place, value)| [*place, *value]).collect();
        match (term.form, &places[..], &coefficients[..]) {
            (Form::Lines, ..) => Shape::PiecewiseLinear { knots: knots() },
            (Form::Spline, ..) => Shape::Spline { knots: knots() },
            (Form::Parabola, &[low, middle, high], &[first, value, last]) => {
                let half = 0.5 * (high - low);
                let bend = 0.5 * (first + last) - value;
                let coefficients =
                    [value, 0.5 * (last - first) / half, bend / (half * half)].map(tidy).into();
                Shape::Polynomial { reference: middle, coefficients, range: [low, high] }
            }
            _ => {
                let (reference, range) = (self.reference_deg_c, self.range_deg_c);
                Shape::Polynomial { reference, coefficients, range }
            }
        }
    }

    /// The same as a document has it.
    pub(super) fn curve(&self, term: Term, coefficients: Vec<f64>) -> Curve {
        let argument = match (term.form, term.effect) {
            (Form::OverTemperature, _) => Argument::DegC,
            (_, Effect::Acceleration(_)) => Argument::DegCPerS2,
            _ => Argument::DegCPerS,
        };
        Curve::new(self.shape(term, coefficients)).over(argument)
    }

    /// A term with the coefficient one (°/h and so on).
    fn parts(&self, term: Term) -> Vec<TermParts> {
        let power = |value: f64| {
            let mut coefficients = vec![0.0; term.form.knots().max(term.power + 1)];
            coefficients[term.power] = AngularRate::from_deg_per_h(value).as_rad_per_s();
            self.shape(term, coefficients)
        };
        let branched = |feature, branch| {
            let [run_up, braking] =
                [Branch::Braking, Branch::RunUp].map(|other| power(f64::from(u8::from(branch != other))));
            let argument = match term.form {
                Form::OverTemperature => BranchArgument::Temperature,
                _ => BranchArgument::Derivative,
            };
            TermParts::branched(feature, BranchedParts { argument, run_up, braking })
        };
        vec![match term.effect {
            Effect::Scale => return Vec::new(),
            Effect::Static => TermParts::new(Feature::One, power(1.0)),
            Effect::Rate(branch) => branched(Feature::ThermalRate, branch),
            Effect::Acceleration(branch) => branched(Feature::ThermalAcceleration, branch),
            Effect::Lag(tau) => TermParts::lag(tau_s(tau), power(1.0)),
        }]
    }

    /// Gyros on this channel, each with a term and nothing else.
    fn unit(&self, terms: &[Term]) -> Result<Loaded, Error> {
        let filter = Filter {
            branch_dead_band_deg_c2_per_s3: self.filter.branch_dead_band_deg_c2_per_s3.or(Some(1e-9)),
            ..self.filter.clone()
        };
        let parts = CalibrationParts::columns(
            filter.to_parts(self.reference_deg_c),
            self.channel.to_parts(),
            terms.iter().map(|term| self.parts(*term)),
        );
        let defects = |found: Vec<Defect>| Error::Document(found.iter().map(Defect::to_string).collect());
        let calibration = Arc::new(Calibration::new(&parts).map_err(defects)?);
        Ok(Loaded { calibration, digest: [0; 8], unit: unit_id("COLUMNS")?, warnings: Vec::new() })
    }

    /// What up to eight terms subtract over the windows of a run (°/h).
    pub(super) fn drive(&self, run: &Samples, terms: &[Term]) -> Result<Vec<Vec<f64>>, Error> {
        // A unit has three gyros at least.
        let padding = iter::repeat_n(Effect::Static.power(0), MIN_SENSORS.saturating_sub(terms.len()));
        let padded: Vec<Term> = terms.iter().copied().chain(padding).collect();
        let loaded = self.unit(&padded)?;
        let mut unit = loaded.stream(UnitSettings::default());
        let readings: &[TemperatureReading] =
            run.temperatures.get(&self.channel.name).map_or(&[], Vec::as_slice);
        // Some to a window, each no longer than the corrector takes.
        let step = Span::from_s(run.window_s / libm::ceil(run.window_s / MAX_TICK_DURATION.as_s()).max(5.0));
        let mut sums = Windows::new(run, terms.len());
        let mut readings = readings.iter().peekable();
        // A unit keeps its first tick until it has seen the next one: it gets one from before the run.
        let (mut sequence, mut end) = (0_u64, run.start_ns.saturating_sub(step.as_ns()));
        let last = run.time_s.last().map_or(0.0, |middle| middle + run.window_s);
        let last = run.start_ns.saturating_add(Span::from_s(last).as_ns());
        while end < last {
            end += step.as_ns();
            while let Some(reading) = readings.next_if(|reading| reading.time.as_ns() <= end) {
                unit.handle(Event::Temperature(slice::from_ref(reading)));
            }
            let tick = GyroTick {
                sequence,
                end_time: Timestamp::from_ns(end),
                duration: step,
                readings: padded.iter().map(|_| 0.0).collect(),
                mode: None,
                switch_command: false,
                meander: None,
                half_periods: Sensors::default(),
                series: 0,
            };
            sequence += 1;
            // Without accelerometers every other tick goes through at once.
            unit.handle(Event::Gyro { output: OutputKind::Mean, ticks: &[tick] });
            unit.drop_ready();
            if let Some(seen) = unit.unit().observation() {
                sums.take(seen, step.as_s());
            }
        }
        Ok(sums.means())
    }
}

/// Sums over the windows of a run; windows before the first temperature reading have no number.
struct Windows<'a> {
    run: &'a Samples,
    /// By window: sums of rate times time (rad) by term, and the time (s).
    sums: Vec<(Vec<f64>, f64)>,
    at: usize,
    /// The temperature is known: until then the corrector assumes one.
    known: bool,
}

impl<'a> Windows<'a> {
    fn new(run: &'a Samples, terms: usize) -> Self {
        Self { run, sums: vec![(vec![0.0; terms], 0.0); run.time_s.len()], at: 0, known: false }
    }

    fn take(&mut self, seen: &Observation, length_s: f64) {
        let middle = seconds(seen.end_time.as_ns().saturating_sub(self.run.start_ns)) - 0.5 * length_s;
        self.known |= seen.gyros.iter().all(|gyro| !gyro.flags.contains(SensorFlags::STALE_TEMPERATURE));
        let half = 0.5 * self.run.window_s;
        while self.run.time_s.get(self.at).is_some_and(|window| window + half < middle) {
            self.at += 1;
        }
        if let (Some(window), Some((sums, length))) =
            (self.run.time_s.get(self.at), self.sums.get_mut(self.at))
            && (window - middle).abs() <= half
        {
            sums.iter_mut().zip(seen.gyros.bias).for_each(|(sum, bias)| *sum += bias * length_s);
            *length += if self.known { length_s } else { f64::NAN };
        }
    }

    fn means(self) -> Vec<Vec<f64>> {
        let terms = self.sums.first().map_or(0, |(sums, _)| sums.len());
        let mean = |term: usize| {
            let mean = |(sums, length): &(Vec<f64>, f64)| {
                if *length > 0.0 {
                    AngularRate::from_rad_per_s(sums[term] / length).as_deg_per_h()
                } else {
                    f64::NAN
                }
            };
            self.sums.iter().map(mean).collect()
        };
        (0..terms).map(mean).collect()
    }
}

impl<'a> Columns<'a> {
    /// Columns over the windows of runs.
    pub fn new(basis: Basis, runs: &'a [Samples]) -> Self {
        Self { basis, runs, known: BTreeMap::new() }
    }

    /// What they are made with.
    pub fn basis(&self) -> &Basis {
        &self.basis
    }

    /// Takes the ranges of Ṫ and T̈ from the windows, for curves over them.
    ///
    /// # Errors
    /// As [`Columns::make`].
    pub fn span_derivatives(&mut self) -> Result<(), Error> {
        let terms = [Effect::Rate, Effect::Acceleration].map(|of| of(Branch::Both).power(0));
        self.make(&terms)?;
        let found = terms.map(|term| ends(self.get(term).iter().copied().filter(|x| x.is_finite())));
        self.basis.derivatives = found.map(|range| range.map(tidy));
        Ok(())
    }

    /// Makes the columns of terms that are not there yet.
    ///
    /// # Errors
    /// [`Error::Document`].
    pub fn make(&mut self, terms: &[Term]) -> Result<(), Error> {
        let of_all = |term: &&Term| !self.known.contains_key(*term) && term.effect != Effect::Scale;
        let mut wanted: Vec<Term> = terms.iter().filter(of_all).copied().collect();
        wanted.sort_unstable();
        wanted.dedup();
        for group in wanted.chunks(MAX_SENSORS) {
            let mut whole = vec![Vec::new(); group.len()];
            for run in self.runs {
                let columns = self.basis.drive(run, group)?;
                whole
                    .iter_mut()
                    .zip(columns)
                    .for_each(|(whole, column): (&mut Vec<f64>, _)| whole.extend(column));
            }
            for (term, column) in group.iter().zip(whole) {
                self.known.insert(*term, column);
            }
        }
        Ok(())
    }

    /// The column of a term that was made.
    pub fn get(&self, term: Term) -> &[f64] {
        self.known.get(&term).map_or(&[], Vec::as_slice)
    }

    /// Smoothed temperature over the windows (°C).
    ///
    /// # Errors
    /// As [`Columns::make`].
    pub fn temperature(&mut self) -> Result<Vec<f64>, Error> {
        let level = Effect::Static.power(1);
        self.make(&[level])?;
        Ok(self.get(level).iter().map(|away| away + self.basis.reference_deg_c).collect())
    }
}
