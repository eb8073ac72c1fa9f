//! The fit of one gyro: which orders, which coefficients, how sure.

use clap::Args;
use clap::builder::RangedU64ValueParser;
use isotherm_correction::reversal::MAX_TRANSITION_TICKS;
use isotherm_correction::thermal::{Feature, GYRO_TERMS};
use isotherm_correction::units::AngularRate;
use nalgebra::DMatrix;

use super::cells::{Cell, MAX_POWER};
use super::orders::{self, Folds, Model, Score};
use crate::limits::within;
use crate::lsq::correlated::{Data, Noise};
use crate::numbers::{ends, real};

/// Temperature that the slow meander's powers are taken about (°C) (003).
pub const MEANDER_REFERENCE_DEG_C: f64 = 25.0;
/// Largest order of the slow meander (003).
pub const MEANDER_ORDER: usize = 1;
/// Spans of temperature (°C) below which no power, and only the first, is fitted.
const SPANS_DEG_C: [f64; 2] = [2.0, 8.0];
/// A cell this many standard deviations off is left out.
const FAR_SIGMAS: f64 = 6.0;
/// Largest share of cells that may be left out.
const FAR_SHARE: f64 = 0.1;
/// Rounds of leaving out.
const ROUNDS: usize = 3;
/// What is wrong where there is no solution.
const SINGULAR: &str = "its terms cannot be separated: both modes are needed at every temperature";

/// Features whose terms are fitted, in the order of their columns: static bias, magnetic bias, slow meander.
pub const FITTED: [Feature; 3] = [Feature::One, Feature::LasingMode, Feature::Meander];

/// The key of a gyro's term in a document.
pub fn key(feature: Feature) -> &'static str {
    GYRO_TERMS.iter().find(|term| term.feature == feature).map_or("", |term| term.key)
}

/// What was asked for; what was not is found in the log or the document.
#[derive(Debug, Clone, Copy, PartialEq, Default, Args)]
pub struct Asked {
    /// Order of the static polynomial, 0…3 (default: by cross-validation)
    #[arg(long, hide_short_help = true, value_name = "ORDER", value_parser = RangedU64ValueParser::<usize>::new().range(0..=3))]
    pub static_order: Option<usize>,
    /// Order of the magnetic polynomial, 0…3 (default: by cross-validation)
    #[arg(long, hide_short_help = true, value_name = "ORDER", value_parser = RangedU64ValueParser::<usize>::new().range(0..=3))]
    pub magnetic_order: Option<usize>,
    /// Order of the slow meander, 0 or 1 (default: by cross-validation)
    #[arg(long, hide_short_help = true, value_name = "ORDER", value_parser = RangedU64ValueParser::<usize>::new().range(0..=1))]
    pub meander_order: Option<usize>,
    /// Ticks lost by a switch, 1…32 (default: found in the log)
    #[arg(long, hide_short_help = true, value_name = "TICKS", value_parser = clap::value_parser!(u8).range(1..=i64::from(MAX_TRANSITION_TICKS)))]
    pub transition_ticks: Option<u8>,
    /// Time to leave out after every switch (s) (default: the servo's transient)
    #[arg(long = "settle", hide_short_help = true, value_name = "SECONDS", value_parser = within(0.0, 3600.0))]
    pub settle_s: Option<f64>,
    /// Reference temperature of the polynomials (°C) (default: the document's, else 20)
    #[arg(long = "reference", hide_short_help = true, value_name = "DEG_C", allow_negative_numbers = true)]
    pub reference_deg_c: Option<f64>,
}

/// One coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// Of which term.
    pub term: Feature,
    /// Of which power of temperature.
    pub power: usize,
    /// Its value (°/h per °Cʲ).
    pub value: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// What was found of one gyro.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroFit {
    /// The orders.
    pub model: Model,
    /// The coefficients.
    pub coefficients: Vec<Fitted>,
    /// Their covariance, in the same order.
    pub covariance: DMatrix<f64>,
    /// The most likely noise.
    pub noise: Noise,
    /// Range of temperature (°C).
    pub range_deg_c: [f64; 2],
    /// Cells that it rests on.
    pub cells: usize,
    /// Cells that were left out for being far off.
    pub left_out: usize,
    /// Squared innovations per degree of freedom.
    pub chi_square: f64,
    /// The cross-validation; empty where all orders were given.
    pub scores: Vec<Score>,
    /// What is to be said of it.
    pub remarks: Vec<String>,
}

impl GyroFit {
    /// Coefficients of a term, lowest power first; empty where it is not in the model.
    pub fn of(&self, term: Feature) -> Vec<f64> {
        self.coefficients.iter().filter(|fitted| fitted.term == term).map(|fitted| fitted.value).collect()
    }
}

/// What a fit of one gyro starts from.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a> {
    /// The cells.
    pub cells: &'a [Cell],
    /// Its place among the three of the cells.
    pub place: usize,
    /// Earth rate along its input axis by cell (°/h).
    pub earth: &'a [f64],
    /// One count (″); 0 for readings without steps.
    pub count_arcsec: f64,
    /// `T_ref` (°C).
    pub reference_deg_c: f64,
    /// Whether the meander's phase is known.
    pub has_meander: bool,
}

/// Fits one gyro.
///
/// # Errors
/// Why it cannot be.
pub fn fit(given: Given<'_>, asked: Asked) -> Result<GyroFit, String> {
    let Given { cells, place, reference_deg_c, .. } = given;
    let temperature: Vec<f64> = cells.iter().map(|cell| cell.powers[0][place] + reference_deg_c).collect();
    let [low, high] = ends(temperature.iter().copied());
    let mut remarks = Vec::new();
    let largest = largest_order(high - low, &mut remarks);
    let (mut data, mut kept) = (data(given, &temperature), temperature);
    let mut stretch: Vec<usize> = cells.iter().map(|cell| cell.stretch).collect();
    let full = Model {
        static_order: largest,
        magnetic_order: largest,
        meander_order: given.has_meander.then_some(largest.min(MEANDER_ORDER)),
    };
    let before = data.len();
    let mut noise = Noise::default();
    for _ in 0..ROUNDS {
        let whole = data.with_columns(&full.columns());
        noise = whole.noise();
        let solution = whole.solve(noise).ok_or(SINGULAR)?;
        let white = whole.whitened(noise);
        let left = &white.value - &white.columns * &solution.coefficients;
        let far: Vec<bool> = left.iter().map(|x| x.abs() > FAR_SIGMAS).collect();
        if !far.contains(&true) {
            break;
        }
        drop_rows(&mut data, &mut kept, &mut stretch, &far);
    }
    let left_out = before - data.len();
    if real(left_out) > FAR_SHARE * real(before) {
        return Err(format!(
            "{left_out} of {before} means are more than {FAR_SIGMAS} standard deviations off, {:.0} % are allowed: was the unit at \
             rest? Cut the run with --start and --duration",
            FAR_SHARE * 100.0
        ));
    }
    let folds = Folds::of(&kept, &data.time_s, &stretch);
    let (model, scores) = orders::choose(&data, noise, full, asked, &folds, &mut remarks)?;
    let own = data.with_columns(&model.columns());
    let width = own.columns.len();
    if own.len() < 2 * width {
        return Err(format!("{} means are too few for {width} coefficients: take a longer run", own.len()));
    }
    let noise = own.noise();
    let solution = own.solve(noise).ok_or(SINGULAR)?;
    let covariance = own.covariance(noise).ok_or(SINGULAR)?;
    let coefficients = model.terms().into_iter().enumerate().map(|(index, (term, power))| Fitted {
        term,
        power,
        value: solution.coefficients[index],
        sigma: covariance[(index, index)].sqrt(),
    });
    let coefficients = coefficients.collect();
    Ok(GyroFit {
        coefficients,
        model,
        covariance,
        noise,
        range_deg_c: [low, high],
        cells: own.len(),
        left_out,
        chi_square: solution.chi_square / real(own.len() - width),
        scores,
        remarks,
    })
}

/// Largest order that a span of temperature allows.
pub(super) fn largest_order(span_deg_c: f64, remarks: &mut Vec<String>) -> usize {
    let [none, first] = SPANS_DEG_C;
    let order = if span_deg_c < none {
        0
    } else if span_deg_c < first {
        1
    } else {
        return MAX_POWER;
    };
    let what = if order == 0 { "only the constants are" } else { "nothing above the first order is" };
    remarks.push(format!(
        "temperature spans {span_deg_c:.1} °C only: {what} fitted ({none} °C are needed for the first order, {first} °C for \
         higher ones); take a run over the whole range"
    ));
    order
}

/// Means less Earth rate, beside all columns: static, magnetic, meander, by powers.
fn data(given: Given<'_>, temperature: &[f64]) -> Data {
    let Given { cells, place, earth, count_arcsec, .. } = given;
    let power = |cell: &Cell, power: usize| match power {
        0 => 1.0,
        _ => cell.powers.get(power - 1).map_or(0.0, |of| of[place]),
    };
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for j in 0..=MAX_POWER {
        columns.push(cells.iter().map(|cell| power(cell, j)).collect());
    }
    for j in 0..=MAX_POWER {
        columns.push(cells.iter().map(|cell| cell.mode * power(cell, j)).collect());
    }
    columns.push(cells.iter().map(|cell| cell.meander).collect());
    let away = |(cell, deg_c): (&Cell, &f64)| cell.meander * (deg_c - MEANDER_REFERENCE_DEG_C);
    columns.push(cells.iter().zip(temperature).map(away).collect());
    Data {
        value: cells.iter().zip(earth).map(|(cell, earth)| cell.rate[place] - earth).collect(),
        columns,
        time_s: cells.iter().map(|cell| cell.time_s).collect(),
        length_s: cells.iter().map(|cell| cell.good_s).collect(),
        joined: cells.iter().map(|cell| cell.joined).collect(),
        // 1 °/h is 1″/s.
        quantum: count_arcsec.abs(),
    }
}

/// Takes rows out; what comes behind one touches nothing any more.
fn drop_rows(data: &mut Data, kept: &mut Vec<f64>, stretch: &mut Vec<usize>, far: &[bool]) {
    for row in 1..data.len() {
        data.joined[row] &= !far[row - 1];
    }
    let numbers = [&mut data.value, &mut data.time_s, &mut data.length_s, kept];
    numbers.into_iter().chain(&mut data.columns).for_each(|column| keep(column, far));
    keep(&mut data.joined, far);
    keep(stretch, far);
}

/// Keeps what is not far off.
fn keep<T>(values: &mut Vec<T>, far: &[bool]) {
    let mut far = far.iter();
    values.retain(|_| far.next() == Some(&false));
}

/// °/h from rad/s.
pub(crate) fn deg_per_h(rad_per_s: f64) -> f64 {
    AngularRate::from_rad_per_s(rad_per_s).as_deg_per_h()
}
