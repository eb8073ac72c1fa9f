//! A change in words, with its size where it is one of a number.

use crate::control::DocumentChange;

/// Relative changes above this say nothing: the number is another one.
const PERCENT_BELOW: f64 = 10.0;
/// Longest value that is shown whole.
const LONGEST_VALUE: usize = 60;

impl DocumentChange {
    /// One line for readers: key, values and, between two numbers, by how much they differ.
    ///
    /// ```
    /// use isotherm_protocol::control::DocumentChange;
    ///
    /// let change = DocumentChange { key: "k_deg_per_h".into(), before: Some("1.25".into()), after: Some("1.26".into()) };
    /// assert_eq!(change.words(), "k_deg_per_h: 1.25 -> 1.26 (+0.01, +0.8 %)");
    /// ```
    #[must_use]
    pub fn words(&self) -> String {
        let key = &self.key;
        match (&self.before, &self.after) {
            (Some(before), Some(after)) => {
                let size = size(before, after).map(|size| format!(" ({size})")).unwrap_or_default();
                format!("{key}: {} -> {}{size}", shown(before), shown(after))
            }
            (None, Some(after)) => format!("{key}: new, {}", shown(after)),
            (Some(before), None) => format!("{key}: removed, was {}", shown(before)),
            (None, None) => key.clone(),
        }
    }
}

/// How much one number is above another; `None` for what are no numbers.
fn size(before: &str, after: &str) -> Option<String> {
    let (before, after) = (before.parse::<f64>().ok()?, after.parse::<f64>().ok()?);
    let change = after - before;
    let relative = change / before.abs();
    let absolute = short(change);
    let is_telling = relative.abs() < PERCENT_BELOW;
    Some(if is_telling { format!("{absolute}, {} %", short(relative * 100.0)) } else { absolute })
}

/// A number with its sign and four digits: differences of decimal numbers end in dust.
fn short(value: f64) -> String {
    let rounded = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-4..1e7).contains(&f64::abs(rounded)) {
        format!("{rounded:+}")
    } else {
        format!("{rounded:+e}")
    }
}

/// A value, cut where it is too long for a line.
fn shown(value: &str) -> String {
    let line = value.lines().next().unwrap_or_default();
    match line.char_indices().nth(LONGEST_VALUE) {
        Some((end, _)) => format!("{}…", line.get(..end).unwrap_or_default()),
        None if line.len() < value.len() => format!("{line}…"),
        None => line.to_owned(),
    }
}
