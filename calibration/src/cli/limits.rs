//! Limits of numbers among the arguments.

use crate::error::Error;

/// Refuses a number that is not within its limits; one that is not given is.
pub(super) fn within(
    limits: impl IntoIterator<Item = (&'static str, Option<f64>, [f64; 2], &'static str)>,
) -> Result<(), Error> {
    for (name, value, [low, high], unit) in limits {
        // False for NaN too.
        if let Some(value) = value.filter(|value| !(low..=high).contains(value)) {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            return Err(Error::Usage(format!("{name} is {value}{unit}, must be from {low} to {high}{unit}")));
        }
    }
    Ok(())
}

/// Refuses a number that is not above 0; one that is not given is.
pub(super) fn above_0(limits: impl IntoIterator<Item = (&'static str, Option<f64>)>) -> Result<(), Error> {
    for (name, value) in limits {
        if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(Error::Usage(format!("{name} is {value}, must be a number above 0")));
        }
    }
    Ok(())
}
