//! 002's two models of a gyro's drift, and which of them a log bears out.
//!
//! ```text
//! model 1:     ε = ε0 + ε1 + white       ε0 constant, ε1 first-order Markov
//! with trend:  ε = ε0 + γ·t + white      γ so slow (140 h) that it is a straight line over a calibration
//! ```
//!
//! Neither is a part of the other, so that no likelihood ratio test compares them: the one with the lower −2·ln L + k·ln n is chosen,
//! k parameters and n bins (Schwarz).

use isotherm_pages::Table;
use serde::Serialize;
use serde_json::{Value, json};

use super::estimate::TICK_S;
use super::scenario::{Drift, Voyage};
use crate::axes::AXES;
use crate::fits::drift::DEG_PER_H_IN_RAD_PER_S;
use crate::fits::drift::markov::{Beside, Fit, WHITE};
use crate::fits::drift::slow::Slow;
use crate::numbers::real;
use crate::report::short;

/// A difference of the criterion from which on a log is said to bear a model out: odds of 20 to 1.
const BORNE_OUT: f64 = 6.0;

/// A model of a drift.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Model {
    /// Constant and Markov part, 002's equation 1.
    Markov,
    /// Constant with a trend, 002's equations 5 to 7.
    Trend,
}

/// How well both models describe one gyro.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Choice {
    /// Name of the gyro.
    pub gyro: &'static str,
    /// The more likely one.
    pub model: Model,
    /// By how much its criterion is lower than that of the other.
    pub difference: f64,
    /// Slope of the model with trend (°/h²).
    pub trend_deg_per_h2: f64,
    /// σ (°/h) and τ (h) of the Markov part; `None` where the log shows none.
    pub markov: Option<[f64; 2]>,
}

impl Choice {
    /// Of slow means in °/h; `None` where they are too few.
    pub fn of_slow(gyro: &'static str, slow: &Slow) -> Option<Self> {
        let per_parameter = libm::log(real(slow.mean.len()));
        let beside = |degree| Beside { degree, periods_h: Vec::new() };
        let level = Fit::of(slow, &beside(0))?;
        let trend = Fit::with_noise(slow, &beside(1), WHITE)?;
        let markov = level.sigma.zip(level.correlation_time_h).map(|(sigma, time)| [sigma.value, time.value]);
        // Constant and white noise; σ and τ, or the slope.
        let parameters = if markov.is_some() { 4.0 } else { 2.0 };
        let of_level = level.minus_two_log_of_readings + parameters * per_parameter;
        let of_trend = trend.minus_two_log_of_readings + 3.0 * per_parameter;
        Some(Self {
            gyro,
            model: if of_trend < of_level { Model::Trend } else { Model::Markov },
            difference: (of_trend - of_level).abs(),
            trend_deg_per_h2: trend.power(1)?.0,
            markov,
        })
    }

    /// Of each gyro over the calibration, which is all that is known at departure.
    pub fn of(drift: &Drift, voyage: &Voyage) -> Vec<Self> {
        let ticks = voyage.calibration_ticks();
        let of = |(axis, gyro): (usize, &'static str)| {
            let rates = drift.measured.iter().take(ticks).map(|rates| rates[axis] * DEG_PER_H_IN_RAD_PER_S);
            let rates: Vec<f64> = rates.collect();
            Self::of_slow(gyro, &Slow::of(&[(0, &rates)], rates.len(), TICK_S))
        };
        AXES.into_iter().enumerate().filter_map(of).collect()
    }

    /// In words.
    pub fn words(&self) -> String {
        let sure = if self.difference < BORNE_OUT { "rather than" } else { "and not" };
        let trend = format!("a trend of {} °/h²", short(self.trend_deg_per_h2));
        let other = self.markov.map_or_else(
            || "a constant".to_owned(),
            |[sigma, time]| format!("a Markov part of {} °/h and {} h", short(sigma), short(time)),
        );
        let [chosen, other] = if self.model == Model::Trend { [trend, other] } else { [other, trend] };
        format!(
            "Gyro {}: the calibration's likelihood favours {chosen} {sure} {other} (difference {}).",
            self.gyro,
            short(self.difference)
        )
    }
}

/// 002's table 3: position errors (km) of three voyages with the drift of each of six real gyros, with model 1 and with trend.
const TABLE_3: [(&str, [[f64; 2]; 3]); 6] = [
    ("06011", [[0.81, 0.31], [0.4, 0.2], [0.28, 0.01]]),
    ("07612", [[0.52, 0.10], [17.2, 2.6], [1.10, 0.08]]),
    ("08112", [[0.41, 0.03], [1.21, 0.1], [1.11, 0.07]]),
    ("08212", [[0.21, 0.03], [0.13, 0.01], [0.10, 0.01]]),
    ("08612", [[0.07, 0.01], [0.11, 0.02], [0.22, 0.01]]),
    ("08712", [[0.85, 0.05], [0.95, 0.06], [1.10, 0.06]]),
];

/// Its rows: gyro, number of the start, both errors.
fn voyages() -> impl Iterator<Item = (&'static str, u32, [f64; 2])> {
    TABLE_3.into_iter().flat_map(|(gyro, starts)| (1..).zip(starts).map(move |(start, km)| (gyro, start, km)))
}

/// Least, middle and largest factor by which the model with trend is better in table 3.
pub fn table_3_gains() -> [f64; 3] {
    let mut gains: Vec<f64> = voyages().map(|(.., [existing, trend])| existing / trend).collect();
    gains.sort_unstable_by(f64::total_cmp);
    [gains[0], 0.5 * (gains[8] + gains[9]), gains[17]]
}

/// Table 3 for the page.
pub fn table_3() -> Table {
    let head = ["gyro", "start", "model 1, km", "with trend, km", "better by"];
    let row = |(gyro, start, [existing, trend]): (&str, u32, [f64; 2])| {
        let better = format!("{:.1}×", existing / trend);
        vec![gyro.to_owned(), start.to_string(), existing.to_string(), trend.to_string(), better]
    };
    Table::of(head, voyages().map(row))
}

/// Table 3 for the JSON.
pub fn table_3_json() -> Value {
    let row = |(gyro, start, [existing, trend]): (&str, u32, [f64; 2])| json!({ "gyro": gyro, "start": start, "existing_km": existing, "trend_km": trend });
    voyages().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::noise;

    /// Means of 21 h in bins of three minutes, °/h: white noise of 0.0005, a slope, a Markov part of 9.5 h.
    fn slow(slope: f64, sigma: f64, noise: &mut impl FnMut() -> f64) -> Slow {
        let width_h = 0.05;
        let decay = libm::exp(-width_h / 9.5);
        let drive = sigma * (1.0 - decay * decay).sqrt();
        let mut markov = sigma * noise();
        let time_h: Vec<f64> = (0..420).map(|k| (f64::from(k) + 0.5) * width_h).collect();
        let mean = time_h.iter().map(|time| {
            markov = decay * markov + drive * noise();
            0.01 + slope * time + markov + 0.0005 * noise()
        });
        let mean = mean.collect();
        Slow { width_h, time_h, mean }
    }

    #[test]
    fn the_likelihood_tells_a_trend_from_a_markov_part() {
        let mut noise = noise();
        let (mut trends, mut markovs, mut constants) = (0, 0, 0);
        for _ in 0..20 {
            let trend = Choice::of_slow("z", &slow(0.00016, 0.0, &mut noise)).unwrap();
            trends += u32::from(trend.model == Model::Trend);
            assert!((trend.trend_deg_per_h2 / 0.00016 - 1.0).abs() < 0.15, "{trend:?}");
            let markov = Choice::of_slow("z", &slow(0.0, 0.0034, &mut noise)).unwrap();
            markovs += u32::from(markov.model == Model::Markov && markov.markov.is_some());
            let constant = Choice::of_slow("z", &slow(0.0, 0.0, &mut noise)).unwrap();
            constants += u32::from(constant.model == Model::Markov && constant.markov.is_none());
        }
        assert!(trends == 20 && markovs == 20 && constants >= 18, "{trends} {markovs} {constants} of 20");
    }

    #[test]
    fn table_3_is_as_much_better_as_its_rows_say() {
        let [least, median, most] = table_3_gains();
        assert!((least - 2.0).abs() < 1e-12 && (median - 12.55).abs() < 0.01 && (most - 28.0).abs() < 1e-12);
        assert_eq!(table_3().rows.len(), 18);
    }
}
