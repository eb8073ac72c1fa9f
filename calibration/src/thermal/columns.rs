//! What one unit of each term subtracts, taken from the corrector itself.
//!
//! A term is put with the coefficient one into a document that has nothing else, and the run's own temperature readings, without
//! their noise, are driven through the service's stream with it, together with ticks that read zero. What comes out is the term's
//! column, with filter, grid, derivative step and the ramps between readings as the service has them. Three terms go in
//! at a time, one per axis.

use std::collections::BTreeMap;

use isotherm_correction::sample::{
    CorrectedTick, GyroTick, OutputKind, SensorFlags, Sensors, TemperatureReading,
};
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::{AngularRate, Span, Timestamp};
use isotherm_log::offline::Offline;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{
    Argument, Branches, Channel, Curve, Document, Filter, Gyro, GyroOutput, GyroSensor, Lag, Orientation,
    Quantity, Shape, Temperature,
};

use super::samples::Samples;
use crate::error::Error;
use crate::written::Written;

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

/// A term with one coefficient, in powers of the distance from a reference temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Term {
    /// (T − reference)ʲ.
    Static(usize),
    /// (T − reference)ʲ·Ṫ.
    Rate(Branch, usize),
    /// (T − reference)ʲ·T̈.
    Acceleration(Branch, usize),
    /// `(T − reference)ʲ·(T − L_τ)/τ`, τ in milliseconds.
    Lag(u64, usize),
    /// (T − reference)ʲ times what the sensor feels, in ppm of its scale factor: a column of each sensor's own.
    Scale(usize),
}

/// Time constant in the form that terms are told apart by.
#[must_use]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0.001 to 1e7 s")]
pub fn millis(tau_s: f64) -> u64 {
    libm::round(tau_s * 1e3).clamp(1.0, 1e10) as u64
}

/// Time constant (s) of a lag term.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "at most 1e10")]
pub fn seconds(millis: u64) -> f64 {
    millis as f64 / 1e3
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
}

/// Columns of one channel over the windows of several runs, one after the other, made when they are asked for.
#[derive(Debug)]
pub struct Columns<'a> {
    basis: Basis,
    runs: &'a [Samples],
    known: BTreeMap<Term, Vec<f64>>,
}

impl Basis {
    /// A polynomial with one coefficient of one.
    pub(super) fn power<Q: Quantity>(&self, power: usize, value: f64) -> Curve<Q> {
        let mut coefficients = vec![0.0; power + 1];
        coefficients[power] = value;
        Curve::new(Shape::Polynomial {
            reference: self.reference_deg_c,
            coefficients,
            range: self.range_deg_c,
        })
        .over(Argument::DegC)
    }

    /// A document with three gyros on this channel, each with the terms that it is given.
    fn document(&self, terms: &[Option<Term>; 3]) -> Document {
        let sensor = |(index, term): (usize, &Option<Term>)| {
            let mut gyro = GyroSensor {
                channel: Some(self.channel.name.clone()),
                increment_weight_rad_per_rad: Some(1.0),
                ..GyroSensor::bare(&index.to_string())
            };
            match *term {
                None | Some(Term::Scale(_)) => {}
                Some(Term::Static(power)) => gyro.static_bias = Some(self.power(power, 1.0)),
                Some(Term::Rate(branch, power)) => gyro.thermal_rate = Some(self.branches(branch, power)),
                Some(Term::Acceleration(branch, power)) => {
                    gyro.thermal_acceleration = Some(self.branches(branch, power));
                }
                Some(Term::Lag(tau, power)) => {
                    gyro.lag.push(Lag { time_constant_s: seconds(tau), gain: self.power(power, 1.0) });
                }
            }
            gyro
        };
        let dead_band = self.filter.branch_dead_band_deg_c2_per_s3.or(Some(1e-9));
        Document {
            schema: isotherm_protocol::document::CURRENT_SCHEMA,
            unit: "COLUMNS".to_owned(),
            created: None,
            note: None,
            origin: None,
            temperature: Temperature {
                assumed_deg_c: self.reference_deg_c,
                filter: Some(Filter { branch_dead_band_deg_c2_per_s3: dead_band, ..self.filter.clone() }),
                channel: vec![self.channel.clone()],
            },
            gyro: Gyro {
                output: GyroOutput::Mean,
                sensor: terms.iter().enumerate().map(sensor).collect(),
                orientation: Orientation::along_case_axes(),
            },
            accel: None,
            mode_reversal: None,
            self_test: None,
        }
    }

    fn branches<Q: Quantity>(&self, branch: Branch, power: usize) -> Branches<Curve<Q>> {
        let on = |on: bool| self.power(power, f64::from(u8::from(on)));
        Branches { run_up: on(branch != Branch::Braking), braking: on(branch != Branch::RunUp) }
    }

    /// What up to three terms subtract over the windows of a run, and Ṫ there.
    fn drive(&self, run: &Samples, terms: &[Option<Term>; 3]) -> Result<[Vec<f64>; 3], Error> {
        let written = Written::of(&self.document(terms))?;
        let mut unit = Offline::new(&written.loaded, UnitSettings::default());
        let readings: &[TemperatureReading] =
            run.temperatures.get(&self.channel.name).map_or(&[], Vec::as_slice);
        let step = Span::from_s(0.2 * run.window_s);
        let mut sums = Windows::new(run);
        let mut readings = readings.iter().peekable();
        let (mut sequence, mut end) = (0_u64, run.start_ns);
        let last = run.time_s.last().map_or(0.0, |middle| middle + run.window_s);
        let last = run.start_ns.saturating_add(Span::from_s(last).as_ns());
        while end < last {
            end += step.as_ns();
            while let Some(reading) = readings.next_if(|reading| reading.time.as_ns() <= end) {
                unit.handle(&LogEvent::Temperature(*reading));
            }
            let tick = GyroTick {
                sequence,
                end_time: Timestamp::from_ns(end),
                duration: step,
                readings: [0.0; 3].into_iter().collect(),
                mode: None,
                switch_command: false,
                meander: None,
                half_periods: Sensors::default(),
                series: 0,
            };
            sequence += 1;
            unit.handle(&LogEvent::Gyro { output: OutputKind::Mean, tick });
            unit.take().iter().for_each(|tick| sums.take(tick, step.as_s()));
        }
        unit.finish();
        unit.take().iter().for_each(|tick| sums.take(tick, step.as_s()));
        Ok(sums.means())
    }
}

/// Sums over the windows of a run; windows before the first temperature reading have no number.
struct Windows<'a> {
    run: &'a Samples,
    sums: Vec<([f64; 3], f64)>,
    at: usize,
    /// The temperature is known: until then the corrector assumes one.
    known: bool,
}

impl<'a> Windows<'a> {
    fn new(run: &'a Samples) -> Self {
        Self { run, sums: vec![([0.0; 3], 0.0); run.time_s.len()], at: 0, known: false }
    }

    fn take(&mut self, tick: &CorrectedTick, length_s: f64) {
        #[expect(clippy::cast_precision_loss, reason = "a run is far below 2⁵³ ns")]
        let middle = tick.end_time.as_ns().saturating_sub(self.run.start_ns) as f64 * 1e-9 - 0.5 * length_s;
        self.known |= tick.gyro_flags.iter().all(|flags| !flags.contains(SensorFlags::STALE_TEMPERATURE));
        let half = 0.5 * self.run.window_s;
        while self.run.time_s.get(self.at).is_some_and(|window| window + half < middle) {
            self.at += 1;
        }
        if let (Some(window), Some((sums, length))) =
            (self.run.time_s.get(self.at), self.sums.get_mut(self.at))
            && (window - middle).abs() <= half
        {
            sums.iter_mut().zip(tick.delta_angle).for_each(|(sum, angle)| *sum -= angle);
            *length += if self.known { length_s } else { f64::NAN };
        }
    }

    fn means(self) -> [Vec<f64>; 3] {
        let mean = |axis: usize| {
            let mean = |(sums, length): &([f64; 3], f64)| {
                if *length > 0.0 {
                    AngularRate::from_rad_per_s(sums[axis] / length).as_deg_per_h()
                } else {
                    f64::NAN
                }
            };
            self.sums.iter().map(mean).collect()
        };
        [mean(0), mean(1), mean(2)]
    }
}

impl<'a> Columns<'a> {
    /// Columns over the windows of runs.
    #[must_use]
    pub fn new(basis: Basis, runs: &'a [Samples]) -> Self {
        Self { basis, runs, known: BTreeMap::new() }
    }

    /// What they are made with.
    #[must_use]
    pub fn basis(&self) -> &Basis {
        &self.basis
    }

    /// Makes the columns of terms that are not there yet.
    ///
    /// # Errors
    /// [`Error::Document`].
    pub fn make(&mut self, terms: &[Term]) -> Result<(), Error> {
        let of_all = |term: &&Term| !self.known.contains_key(*term) && !matches!(term, Term::Scale(_));
        let mut wanted: Vec<Term> = terms.iter().filter(of_all).copied().collect();
        wanted.sort_unstable();
        wanted.dedup();
        for group in wanted.chunks(3) {
            let slots = [group.first().copied(), group.get(1).copied(), group.get(2).copied()];
            let mut whole: [Vec<f64>; 3] = Default::default();
            for run in self.runs {
                let columns = self.basis.drive(run, &slots)?;
                whole.iter_mut().zip(columns).for_each(|(whole, column)| whole.extend(column));
            }
            for (term, column) in group.iter().zip(whole) {
                self.known.insert(*term, column);
            }
        }
        Ok(())
    }

    /// The column of a term that was made.
    #[must_use]
    pub fn get(&self, term: Term) -> &[f64] {
        self.known.get(&term).map_or(&[], Vec::as_slice)
    }

    /// Smoothed temperature (°C) and Ṫ (°C/s) over the windows.
    ///
    /// # Errors
    /// As [`Columns::make`].
    pub fn temperature(&mut self) -> Result<(Vec<f64>, Vec<f64>), Error> {
        let (level, rate) = (Term::Static(1), Term::Rate(Branch::Both, 0));
        self.make(&[level, rate])?;
        let level = self.get(level).iter().map(|away| away + self.basis.reference_deg_c).collect();
        Ok((level, self.get(rate).to_vec()))
    }
}
