//! Limits of numbers among the arguments, each beside its option.

/// Reads a number from one limit to another, both included.
pub(crate) fn within(low: f64, high: f64) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync {
    isotherm_cli::number("", low..=high)
}

/// Reads a number above 0.
pub(crate) fn above_0(text: &str) -> Result<f64, String> {
    number(text, |value| value > 0.0, "above 0")
}

/// Reads a number that is not below 0.
pub(crate) fn from_0(text: &str) -> Result<f64, String> {
    number(text, |value| value >= 0.0, "0 or above")
}

/// Reads a number that is not 0.
pub(crate) fn not_0(text: &str) -> Result<f64, String> {
    number(text, |value| value != 0.0, "other than 0")
}

fn number(text: &str, is_good: impl Fn(f64) -> bool, what: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && is_good(*value));
    value.ok_or_else(|| format!("must be a number {what}"))
}
