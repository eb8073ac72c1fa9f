//! Drift polynomials and switch parameters of a mode-reversed laser gyro, from a temperature run at rest [003; models §2, §5–§7].
//!
//! | module | holds |
//! |---|---|
//! | [`switches`] | the raw ticks about the mode switches: lost ticks, dither |
//! | [`servo`], [`dither`] | time constant of the perimeter servo; rest frequency over temperature |
//! | [`cells`] | means between the switches beside the corrector's own columns |
//! | [`orders`], [`model`] | orders by cross-validation; one gyro's coefficients |
//! | `seen`, `units`, `steps`, `temperatures` | what a log shows of dead gyros, other units of measure, motion, thermometers |
//! | [`checks`] | what a log must have |
//! | [`mod@fit`], [`document`] | the whole procedure; the document |

pub mod cells;
pub mod checks;
pub mod dither;
pub mod document;
pub mod fit;
pub mod model;
pub mod orders;
mod prepare;
mod report;
mod seen;
pub mod servo;
mod steps;
pub mod switches;
mod temperatures;
#[cfg(test)]
mod tests;
mod units;
