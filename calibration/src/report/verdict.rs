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

    /// Of the values before and after, in and out of sample; refused where they were made worse.
    #[must_use]
    pub fn of_values(
        of: impl Into<String>,
        measure: impl Into<String>,
        inside: [Vec<f64>; 2],
        outside: Option<[Vec<f64>; 2]>,
    ) -> Self {
        let sizes = |values: [Vec<f64>; 2]| values.map(|values| Size::of(&values));
        Self::new(of, measure, sizes(inside)).out_of_sample(outside.map(sizes)).unless_worse()
    }

    /// Refused where the rms of the sample that decides is made worse. This is how all commands judge.
    fn unless_worse(self) -> Self {
        let [before, after] = self.deciding().map(|size| size.rms);
        if !made_worse(before, after) {
            return self;
        }
        let grown = format!("rms grows from {} to {} {}", short(before), short(after), self.measure);
        self.refused(grown)
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

/// Share by which a figure may change and still be the same: what noise does to it, and less than its digits tell.
pub const SAME_SHARE: f64 = 0.01;

/// Whether what is left has grown, by more than [`SAME_SHARE`]: no sentence says that 2.87 grows to 2.87. The one rule for "made
/// worse", of every figure.
fn made_worse(before: f64, after: f64) -> bool {
    after > before * (1.0 + SAME_SHARE)
}

/// All verdicts, one sentence each.
pub(super) fn sentences(verdicts: &[Verdict]) -> Vec<String> {
    if verdicts.is_empty() {
        return vec!["No verdict.".to_owned()];
    }
    let sentence = |verdict: &Verdict| {
        let words = verdict.words();
        if words.ends_with(['.', '?']) { words } else { format!("{words}.") }
    };
    verdicts.iter().map(sentence).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(before: f64, after: f64) -> Verdict {
        let size = |rms: f64| Size::of(&[rms, -rms]);
        Verdict::new("gyro x", "°/h", [size(before), size(after)]).unless_worse()
    }

    #[test]
    fn what_differs_by_less_than_noise_makes_it_is_not_worse() {
        for (before, after) in [(2.868, 2.871), (6.94, 6.99), (2.0, 1.0), (0.0, 0.0)] {
            assert!(judged(before, after).accepted, "{before} {after}");
        }
        for (before, after) in [(2.80, 2.88), (0.0, 1.0)] {
            let verdict = judged(before, after);
            let words = format!("rms grows from {} to {} °/h", short(before), short(after));
            assert!(!verdict.accepted && verdict.reason == words, "{}", verdict.words());
        }
        let in_sample = judged(1.0, 2.0).in_sample;
        let better =
            Verdict::new("gyro x", "°/h", in_sample).out_of_sample(Some([in_sample[1], in_sample[0]]));
        assert!(better.unless_worse().accepted, "out of sample decides");
    }

    #[test]
    fn a_question_ends_without_a_full_stop() {
        let verdict = judged(1.0, 1.0).refused("is it right?");
        assert!(sentences(&[verdict])[0].ends_with("is it right?"));
    }
}
