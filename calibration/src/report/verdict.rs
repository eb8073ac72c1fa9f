//! What came of one sensor, and its sentence.

use isotherm_pages::Table;
use isotherm_protocol::document::{Measure, Residual, Sample};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::numbers::{Size, real};
use crate::report::short;

/// What came of one sensor.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Verdict {
    /// Of what, such as "gyro x".
    pub of: String,
    /// Symbol of the unit of measure, such as "°/h".
    pub measure: String,
    /// Before and after over what the fit saw. Both are zero where the fit saw nothing of it.
    pub in_sample: [Size; 2],
    /// Before and after over what it did not see.
    pub out_of_sample: Option<[Size; 2]>,
    /// Whether the new terms stand.
    pub accepted: bool,
    /// Why not, or what is to be known; may be empty where accepted.
    pub reason: String,
    /// What its sentence says where it has no sizes.
    pub said: String,
}

impl Verdict {
    /// An accepted sensor.
    pub fn new(of: impl Into<String>, measure: impl Into<String>, in_sample: [Size; 2]) -> Self {
        Self { of: of.into(), measure: measure.into(), in_sample, accepted: true, ..Self::default() }
    }

    /// Something that is said instead of sizes.
    pub fn said(of: impl Into<String>, words: impl Into<String>) -> Self {
        Self { said: words.into(), ..Self::new(of, "", <[Size; 2]>::default()) }
    }

    /// Of the values before and after, in and out of sample: refused where what is left in the deciding sample has grown by more
    /// than noise. This is how all commands judge.
    pub fn of_values(
        of: impl Into<String>,
        measure: impl Into<String>,
        inside: [Vec<f64>; 2],
        outside: Option<[Vec<f64>; 2]>,
    ) -> Self {
        let sizes = |values: &[Vec<f64>; 2]| values.each_ref().map(|values| Size::of(values));
        let verdict = Self::new(of, measure, sizes(&inside)).out_of_sample(outside.as_ref().map(sizes));
        let [old, new] = verdict.deciding();
        let [before, after] = outside.unwrap_or(inside);
        // Where few windows are whole, the others may say something else.
        if let Some(why) = few([old.count, before.len()]) {
            return verdict.refused(why);
        }
        match grows(&before, &after) {
            None => verdict,
            Some(Growth::ByNoise) => verdict.remark("its rms grows by no more than noise"),
            Some(Growth::Beyond) => {
                let words =
                    format!("rms grows from {} to {} {}", short(old.rms), short(new.rms), verdict.measure);
                verdict.refused(words)
            }
        }
    }

    /// With sizes out of sample.
    pub fn out_of_sample(mut self, sizes: Option<[Size; 2]>) -> Self {
        self.out_of_sample = sizes;
        self
    }

    /// With a remark.
    pub fn remark(mut self, reason: impl Into<String>) -> Self {
        self.reason = reason.into();
        self
    }

    /// Refused.
    pub fn refused(mut self, reason: impl Into<String>) -> Self {
        self.accepted = false;
        self.reason = reason.into();
        self
    }

    /// "accepted" or "refused".
    pub(super) const fn state(&self) -> &'static str {
        if self.accepted { "accepted" } else { "refused" }
    }

    /// Before and after in each sample that has anything.
    fn samples(&self) -> impl Iterator<Item = (Sample, [Size; 2])> {
        let samples = [(Sample::In, Some(self.in_sample)), (Sample::Out, self.out_of_sample)];
        let counts = |sizes: &[Size; 2]| sizes.iter().any(|size| size.count > 0);
        samples.into_iter().filter_map(move |(sample, sizes)| Some((sample, sizes.filter(counts)?)))
    }

    /// Whether it rests on anything.
    pub(super) fn has_samples(&self) -> bool {
        self.samples().next().is_some()
    }

    /// The sizes that decide: out of sample where they are known.
    pub fn deciding(&self) -> [Size; 2] {
        self.out_of_sample.unwrap_or(self.in_sample)
    }

    /// How many times smaller the rms has become in the deciding sample; `None` where nothing is known or left.
    pub fn factor(&self) -> Option<f64> {
        let [before, after] = self.deciding();
        (after.count > 0 && after.rms > 0.0).then(|| before.rms / after.rms)
    }

    /// Its sentence with the reason, without a full stop.
    pub fn words(&self) -> String {
        match (self.accepted, self.reason.is_empty()) {
            (_, true) => self.sentence(),
            (true, false) => format!("{}, {}", self.sentence(), self.reason),
            (false, false) => format!("{}: {}", self.sentence(), self.reason),
        }
    }

    /// Its sentence without the reason and without a full stop: "gyro x: 1.68 → 0.170 °/h rms out of sample; accepted".
    pub fn sentence(&self) -> String {
        let [before, after] = self.deciding();
        let state = self.state();
        if before.count == 0 && after.count == 0 {
            return match (self.said.as_str(), self.accepted) {
                ("", _) => format!("{}: {state}", self.of),
                (said, true) => format!("{}: {said}", self.of),
                (said, false) => format!("{}: {said}; {state}", self.of),
            };
        }
        let sample = if self.out_of_sample.is_some() { "out of sample" } else { "in sample" };
        let [before, after] = [before, after].map(|size| short(size.rms));
        format!("{}: {before} → {after} {} rms {sample}; {state}", self.of, self.measure)
    }
}

/// What is said of an axis that temperature does nothing to.
pub const FLAT: &str = "no temperature dependence above noise";
/// Share of the windows that a verdict must rest on.
const LEAST_SHARE: f64 = 0.5;
/// Share by which a figure may change and still be the same: less than its digits tell.
pub const SAME_SHARE: f64 = 0.01;
/// Probability below which it is no accident that what is left follows the change.
const ACCIDENT: f64 = 1e-3;
/// Times by which an rms grows at most by noise.
const LARGEST_GROWTH: f64 = 2.0;

/// That few windows are complete, of all.
pub fn few([complete, all]: [usize; 2]) -> Option<String> {
    (real(complete) < LEAST_SHARE * real(all)).then(|| {
        format!(
            "{complete} of {all} windows are complete, at least {:.0} % must be: look for gaps and flags with \
             isotherm-replay correct, and choose another --window if the log has gaps",
            100.0 * LEAST_SHARE
        )
    })
}

/// By how much what is left has grown: by no more than noise, or beyond it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Growth {
    ByNoise,
    Beyond,
}

/// Whether a change made something worse: what is left grows by more than [`SAME_SHARE`], and follows the change itself. The one rule
/// of all commands.
///
/// Were the change right, what is left after it would be noise, and its part along the change no larger than that of any other
/// direction (Student's law). An rms alone grows or falls by chance where nothing has changed but its last digits.
fn grows(before: &[f64], after: &[f64]) -> Option<Growth> {
    let both = || before.iter().zip(after).filter(|(a, b)| a.is_finite() && b.is_finite());
    let sum = |of: fn(f64, f64) -> f64| both().map(|(before, after)| of(*before, *after)).sum::<f64>();
    let (squares, left) = (sum(|before, _| before * before), sum(|_, after| after * after));
    if left <= squares * (1.0 + SAME_SHARE).powi(2) {
        return None;
    }
    let change = sum(|before, after| (after - before).powi(2)).sqrt();
    let along = sum(|before, after| after * (after - before)) / change;
    let others = real(both().count().saturating_sub(1));
    let noise = ((left - along * along).max(0.0) / others).sqrt();
    let by_chance = StudentsT::new(0.0, 1.0, others).map_or(0.0, |law| law.sf(along / noise));
    let doubled = left > LARGEST_GROWTH * LARGEST_GROWTH * squares;
    Some(if by_chance >= ACCIDENT && !doubled { Growth::ByNoise } else { Growth::Beyond })
}

/// Whether a change made something worse by more than noise.
pub fn is_worse(before: &[f64], after: &[f64]) -> bool {
    grows(before, after) == Some(Growth::Beyond)
}

/// Verdicts of a second judgement, without what was refused in the first, whose own verdicts stay.
pub fn beside(first: &[Verdict], second: Vec<Verdict>) -> Vec<Verdict> {
    let refused =
        |verdict: &Verdict| first.iter().find(|other| other.of == verdict.of && !other.accepted).cloned();
    second.into_iter().map(|verdict| refused(&verdict).unwrap_or(verdict)).collect()
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

/// All sizes as a table; `counted` is what they are over.
pub(super) fn rows(verdicts: &[Verdict], counted: &str, only_deciding: bool) -> Table {
    let head = ["", "rms", "", "times smaller", "peak to peak", "", counted, ""];
    let mut rows = Vec::new();
    for verdict in verdicts {
        let samples = verdict.samples().collect::<Vec<_>>();
        if samples.is_empty() {
            let none = vec!["–".to_owned(); head.len() - 2];
            rows.push([vec![verdict.of.clone()], none, vec![verdict.state().to_owned()]].concat());
        }
        let first = if only_deciding { samples.len().saturating_sub(1) } else { 0 };
        for (sample, [before, after]) in samples.into_iter().skip(first) {
            let sample = if sample == Sample::In { "in sample" } else { "out of sample" };
            let factor = if after.rms > 0.0 { short(before.rms / after.rms) } else { "–".to_owned() };
            rows.push(vec![
                format!("{}, {} {sample}", verdict.of, verdict.measure),
                short(before.rms),
                format!("→ {}", short(after.rms)),
                factor,
                short(before.peak_to_peak),
                format!("→ {}", short(after.peak_to_peak)),
                after.count.to_string(),
                verdict.state().to_owned(),
            ]);
        }
    }
    Table::of(head, rows)
}

/// What the document states of its residuals: the sizes of all verdicts in °/h or m/s²; others have no entry in a document.
pub fn residuals(verdicts: &[Verdict]) -> Vec<Residual> {
    let mut residuals = Vec::new();
    for verdict in verdicts {
        let measure = match verdict.measure.as_str() {
            "°/h" => Measure::DegPerH,
            "m/s²" => Measure::MetresPerSecondSquared,
            _ => continue,
        };
        for (sample, [before, after]) in verdict.samples() {
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

    fn judged(before: &[f64], after: &[f64]) -> Verdict {
        Verdict::of_values("gyro x", "°/h", [before.to_vec(), after.to_vec()], None)
    }

    #[test]
    fn noise_is_told_from_what_a_change_made_worse() {
        // Steps on a rate table: a part in a million of 72 °/s, beside noise of some °/h.
        let before = [-6.46, -0.5, -0.33, 0.75, -3.77];
        let after = [-6.46, -0.75, -0.33, 1.0, -3.77];
        let verdict = judged(&before, &after);
        assert!(verdict.accepted && verdict.reason.is_empty(), "{}", verdict.words());
        // The same of 25 times as much, a tenth of the rms: still of steps that few.
        let verdict = judged(&before, &[-6.46, -1.9, -0.33, 2.15, -3.77]);
        let mut told = verdict.words();
        // A scale factor that is as wrong as the old one was right.
        let verdict = judged(&before, &[-6.46, -80.5, -0.33, 80.75, -3.77]);
        told += &("\n".to_owned() + &verdict.words());
        insta::assert_snapshot!(told);
        // A constant error thirty times the noise.
        let noise: Vec<f64> = (0..12).map(|k| libm::sin(f64::from(k * k))).collect();
        let shifted: Vec<f64> = noise.iter().map(|x| x + 30.0).collect();
        assert!(!judged(&noise, &shifted).accepted);
        assert!(judged(&shifted, &noise).reason.is_empty());
        // Few values leave much open, but no doubling.
        assert!(judged(&[1.0, -1.0, 1.0], &[1.5, -1.1, 1.2]).accepted);
        assert!(!judged(&[1.0, -1.0, 1.0], &[4.0, -1.0, 1.0]).accepted);
        assert!(!judged(&[0.0; 3], &[1e-3; 3]).accepted, "there was nothing left before");
        assert!(!judged(&[1.0], &[2.0]).accepted, "one value tells no noise");
        // Windows of an hour: what differs by less than the digits tell, and by a twentieth.
        let windows: Vec<f64> = (0..360).map(|k| libm::sin(f64::from(k * k))).collect();
        let with = |share: f64| -> Vec<f64> {
            let added = (0..360).map(|k| share * libm::cos(f64::from(k)));
            windows.iter().zip(added).map(|(window, added)| window + added).collect()
        };
        assert!(judged(&windows, &with(0.05)).accepted);
        assert!(!judged(&windows, &with(0.32)).accepted);
    }

    #[test]
    fn a_question_ends_without_a_full_stop() {
        let verdict = judged(&[1.0], &[1.0]).refused("is it right?");
        assert!(sentences(&[verdict])[0].ends_with("is it right?"));
    }
}
