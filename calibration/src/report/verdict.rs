//! What came of one sensor, and its sentence.

use isotherm_log::plot::page::Table;
use isotherm_protocol::document::{Measure, Residual, Sample};

use crate::drift::figures::short;
use crate::means::Size;

/// Which figure of a [`Size`] the sentence states.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Figure {
    /// Largest less smallest, as the papers state it.
    #[default]
    PeakToPeak,
    /// Root mean square.
    Rms,
    /// Standard deviation about the mean.
    Deviation,
}

impl Figure {
    /// The figure of a size.
    #[must_use]
    pub fn of(self, size: &Size) -> f64 {
        match self {
            Self::PeakToPeak => size.peak_to_peak,
            Self::Rms => size.rms,
            Self::Deviation => size.deviation,
        }
    }

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PeakToPeak => "peak to peak",
            Self::Rms => "rms",
            Self::Deviation => "standard deviation",
        }
    }
}

/// What came of one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Of what, such as "gyro x".
    pub of: String,
    /// Symbol of the unit of measure, such as "°/h".
    pub measure: String,
    /// Which figure the sentence states.
    pub figure: Figure,
    /// Before and after over what the fit saw. Both are zero where the fit saw nothing of it.
    pub in_sample: [Size; 2],
    /// Before and after over what it did not see.
    pub out_of_sample: Option<[Size; 2]>,
    /// Whether the new terms stand.
    pub accepted: bool,
    /// Why not, or what is to be known; may be empty where accepted.
    pub reason: String,
}

impl Verdict {
    /// An accepted sensor, its sentence in peak to peak.
    #[must_use]
    pub fn new(of: impl Into<String>, measure: impl Into<String>, in_sample: [Size; 2]) -> Self {
        Self {
            of: of.into(),
            measure: measure.into(),
            figure: Figure::default(),
            in_sample,
            out_of_sample: None,
            accepted: true,
            reason: String::new(),
        }
    }

    /// With sizes out of sample.
    #[must_use]
    pub fn out_of_sample(mut self, sizes: Option<[Size; 2]>) -> Self {
        self.out_of_sample = sizes;
        self
    }

    /// With another figure in its sentence.
    #[must_use]
    pub fn stated_as(mut self, figure: Figure) -> Self {
        self.figure = figure;
        self
    }

    /// With a remark.
    #[must_use]
    pub fn remark(mut self, reason: impl Into<String>) -> Self {
        self.reason = reason.into();
        self
    }

    /// Refused.
    #[must_use]
    pub fn refused(mut self, reason: impl Into<String>) -> Self {
        self.accepted = false;
        self.reason = reason.into();
        self
    }

    /// The sizes that decide: out of sample where they are known.
    #[must_use]
    pub fn deciding(&self) -> [Size; 2] {
        self.out_of_sample.unwrap_or(self.in_sample)
    }

    /// How many times smaller the rms has become in the deciding sample; `None` where nothing is known or left.
    #[must_use]
    pub fn factor(&self) -> Option<f64> {
        let [before, after] = self.deciding();
        (after.count > 0 && after.rms > 0.0).then(|| before.rms / after.rms)
    }

    /// Its sentence with the reason, without a full stop.
    #[must_use]
    pub fn words(&self) -> String {
        match (self.accepted, self.reason.is_empty()) {
            (_, true) => self.sentence(),
            (true, false) => format!("{}, {}", self.sentence(), self.reason),
            (false, false) => format!("{}: {}", self.sentence(), self.reason),
        }
    }

    /// Its sentence without the reason and without a full stop: "gyro x: 1.68 → 0.170 °/h peak to peak out of sample; accepted".
    #[must_use]
    pub fn sentence(&self) -> String {
        let [before, after] = self.deciding();
        let state = if self.accepted { "accepted" } else { "refused" };
        if before.count == 0 && after.count == 0 {
            return format!("{}: {state}", self.of);
        }
        let sample = if self.out_of_sample.is_some() { "out of sample" } else { "in sample" };
        let of = |size: &Size| short(self.figure.of(size));
        let (before, after) = (of(&before), of(&after));
        let (measure, figure) = (&self.measure, self.figure.name());
        format!("{}: {before} → {after} {measure} {figure} {sample}; {state}", self.of)
    }
}

/// All verdicts, one sentence each.
pub(super) fn sentences(verdicts: &[Verdict]) -> Vec<String> {
    if verdicts.is_empty() {
        return vec!["No verdict.".to_owned()];
    }
    verdicts.iter().map(|verdict| format!("{}.", verdict.words())).collect()
}

/// All sizes as a table.
pub(super) fn rows(verdicts: &[Verdict]) -> Table {
    let head = ["", "rms", "", "times smaller", "peak to peak", "", "windows", ""].map(str::to_owned);
    let mut rows = Vec::new();
    for verdict in verdicts {
        let samples = [("in sample", Some(verdict.in_sample)), ("out of sample", verdict.out_of_sample)];
        for (sample, sizes) in samples {
            let Some([before, after]) = sizes.filter(|sizes| sizes.iter().any(|size| size.count > 0)) else {
                continue;
            };
            let factor = if after.rms > 0.0 { short(before.rms / after.rms) } else { "–".to_owned() };
            let state = if verdict.accepted { "accepted" } else { "refused" };
            rows.push(vec![
                format!("{}, {} {sample}", verdict.of, verdict.measure),
                short(before.rms),
                format!("→ {}", short(after.rms)),
                factor,
                short(before.peak_to_peak),
                format!("→ {}", short(after.peak_to_peak)),
                after.count.to_string(),
                state.to_owned(),
            ]);
        }
    }
    Table { head: head.to_vec(), rows }
}

/// What the document states of its residuals: the sizes of all verdicts in °/h or m/s²; others have no entry in a document.
#[must_use]
pub fn residuals(verdicts: &[Verdict]) -> Vec<Residual> {
    let mut residuals = Vec::new();
    for verdict in verdicts {
        let measure = match verdict.measure.as_str() {
            "°/h" => Measure::DegPerH,
            "m/s²" => Measure::MetresPerSecondSquared,
            _ => continue,
        };
        for (sample, sizes) in [(Sample::In, Some(verdict.in_sample)), (Sample::Out, verdict.out_of_sample)] {
            let Some([before, after]) = sizes.filter(|sizes| sizes.iter().any(|size| size.count > 0)) else {
                continue;
            };
            residuals.push(Residual {
                of: verdict.of.replace(' ', "."),
                sample,
                measure,
                rms_before: before.rms,
                rms_after: after.rms,
                peak_to_peak_before: Some(before.peak_to_peak),
                peak_to_peak_after: Some(after.peak_to_peak),
            });
        }
    }
    residuals
}
