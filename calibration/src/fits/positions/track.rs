//! A run tick by tick, for finding where the unit stood still: accelerometer outputs, rates along the case axes, temperatures.

use std::collections::BTreeMap;

use isotherm_correction::sample::OutputKind;
use isotherm_log::offline::Loaded;

use crate::error::Error;
use crate::numbers::{real, seconds};
use crate::report::{counted, six};
use crate::runs::Run;
use crate::runs::table::{Rows, Table};

/// Share of the ticks, or of the time, that gaps may take.
const MANY: f64 = 0.01;

/// °/h in one °/s.
const DEG_PER_H_IN_DEG_PER_S: f64 = 3600.0;

/// Ticks of a run, as columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Track {
    /// Name of the run.
    pub run: String,
    /// Ends of the accelerometer ticks (ns on the producer's clock).
    pub end_ns: Vec<i64>,
    /// Their durations (s).
    pub duration_s: Vec<f64>,
    /// Output of each accelerometer: counts/s, V, m/s², or whatever the log's unit is.
    pub outputs: Vec<Vec<f64>>,
    /// Output of each gyro: rad/s, or counts/s.
    pub gyros: Vec<Vec<f64>>,
    /// Whether the gyros put out counts.
    pub gyro_counts: bool,
    /// Rate about each case axis with the document at hand (°/s).
    pub rate_deg_per_s: [Vec<f64>; 3],
    /// Specific force along each case axis with the document at hand (m/s²).
    pub force_m_per_s2: [Vec<f64>; 3],
    /// Smoothed temperature by channel, as the correction applies it (°C).
    pub temperature_deg_c: BTreeMap<String, Vec<f64>>,
}

impl Track {
    /// Reads a run, once as it stands and once through the service's own code.
    ///
    /// # Errors
    /// As [`Run::series`] and [`Run::correct_together`]; [`Error::Refused`] without accelerometers.
    pub fn of(run: &Run, loaded: &Loaded) -> Result<Self, Error> {
        let series = run.series()?;
        let accels = &series.accels;
        if accels.is_empty() {
            return Err(Error::refused(format!(
                "{} has no accelerometer ticks: positions need an accelerometer in the log and its mapping",
                run.name
            )));
        }
        let table = Table::of_rows(run, loaded, Rows::TICKS)?;
        let taken = |column: &[f64], at: &[usize]| -> Vec<f64> {
            at.iter().map(|index| column.get(*index).copied().unwrap_or(f64::NAN)).collect()
        };
        let at = nearest(&accels.end_ns, &table.end_ns);
        let per_second = |columns: &[Vec<f64>], durations: &[f64], kind| -> Vec<Vec<f64>> {
            let rate = |column: &Vec<f64>| column.iter().zip(durations).map(|(count, s)| count / s).collect();
            columns
                .iter()
                .map(|column| if kind == Some(OutputKind::Counts) { rate(column) } else { column.clone() })
                .collect()
        };
        let gyros = per_second(&series.gyros.readings, &series.gyros.duration_s, series.gyros.output);
        let own = nearest(&accels.end_ns, &series.gyros.end_ns);
        Ok(Self {
            run: run.name.clone(),
            outputs: per_second(&accels.readings, &accels.duration_s, accels.output),
            gyros: gyros.iter().map(|column| taken(column, &own)).collect(),
            gyro_counts: series.gyros.output == Some(OutputKind::Counts),
            rate_deg_per_s: table
                .rate_deg_per_h
                .each_ref()
                .map(|column| taken(column, &at).iter().map(|rate| rate / DEG_PER_H_IN_DEG_PER_S).collect()),
            force_m_per_s2: table.force_m_per_s2.each_ref().map(|column| taken(column, &at)),
            temperature_deg_c: table
                .temperature_deg_c
                .iter()
                .map(|(name, column)| (name.clone(), taken(column, &at)))
                .collect(),
            end_ns: series.accels.end_ns,
            duration_s: series.accels.duration_s,
        })
    }

    /// Number of ticks.
    pub fn len(&self) -> usize {
        self.end_ns.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.end_ns.is_empty()
    }

    /// Median duration of a tick (s).
    pub fn tick_s(&self) -> f64 {
        quantile(&self.duration_s, 0.5)
    }

    /// Words where more than a hundredth of the ticks does not begin where the one before ends, or more than a hundredth of the time
    /// has none: gaps, or a tick length that is not the log's.
    pub fn gaps(&self) -> Option<String> {
        let tick_s = self.tick_s();
        let away_s: Vec<f64> =
            self.end_ns.windows(2).map(|pair| seconds(pair[1] - pair[0]) - tick_s).collect();
        let broken = away_s.iter().filter(|away_s| away_s.abs() > 0.5 * tick_s).count();
        let share = real(broken) / real(self.len().max(1));
        if share > MANY {
            return Some(format!(
                "{:.0} % of the accelerometer ticks do not begin at the end of the one before: the log has gaps, or \
                 the mapping has a wrong tick length ({} s) or unit of the time column",
                100.0 * share,
                six(tick_s)
            ));
        }
        let missing: Vec<f64> = away_s.into_iter().filter(|away_s| *away_s > 0.5 * tick_s).collect();
        let (missing_s, length_s) = (missing.iter().sum::<f64>(), self.start_s(self.len().saturating_sub(1)));
        (missing_s > MANY * length_s).then(|| {
            format!(
                "{missing_s:.0} s of {length_s:.0} s are missing, in {}: poses must have no gap; record without \
                 gaps, or cut the log with --start and --duration",
                counted(missing.len(), "gap", "gaps")
            )
        })
    }

    /// Start of a tick since the run's beginning (s).
    pub fn start_s(&self, tick: usize) -> f64 {
        let (Some(first), Some(end)) = (self.end_ns.first(), self.end_ns.get(tick)) else { return f64::NAN };
        let duration = |index: usize| self.duration_s.get(index).copied().unwrap_or(0.0);
        seconds(end - first) + duration(0) - duration(tick)
    }
}

/// Index of the nearest of increasing times for each of other increasing times.
fn nearest(of: &[i64], among: &[i64]) -> Vec<usize> {
    let mut place = 0;
    let distance = |index: usize, time: i64| among.get(index).map_or(i64::MAX, |at| (at - time).abs());
    let step = |time: &i64| {
        while place + 1 < among.len() && distance(place + 1, *time) <= distance(place, *time) {
            place += 1;
        }
        place
    };
    of.iter().map(step).collect()
}

/// The value below which a share of the finite values lies; NaN without any.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index within the values")]
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut good: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if good.is_empty() {
        return f64::NAN;
    }
    let index = (share * real(good.len() - 1)).round() as usize;
    let (_, value, _) = good.select_nth_unstable_by(index, f64::total_cmp);
    *value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_told_where_they_are_many() {
        let track = |step_ns: i64| Track {
            end_ns: (1..=500).map(|tick| tick * 10_000_000 + tick / 10 * step_ns).collect(),
            duration_s: vec![0.01; 500],
            ..Track::default()
        };
        assert_eq!(track(0).gaps(), None);
        // One that is long.
        let mut long = track(0);
        long.end_ns[250..].iter_mut().for_each(|end| *end += 2_000_000_000);
        insta::assert_snapshot!([track(40_000_000), long].map(|track| track.gaps().unwrap()).join("\n"));
    }
}
