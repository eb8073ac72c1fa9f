//! Scale factor, asymmetry, linearity, input axes and bias of gyros from runs on a rate table [IEEE 952, IEEE 647].
//!
//! | module | holds |
//! |---|---|
//! | [`steps`] | what the table was told to do |
//! | [`bins`] | what the gyros gave, in short means along their own input axes |
//! | [`plateaus`] | where the table turned steadily |
//! | [`matching`], `checks`, `attitude` | which plateau is which step; whether the unit turned and stood as stated |
//! | [`earth`] | Earth rate in a case that turns |
//! | [`model`] | least squares over the steps, one gyro at a time |
//! | [`over_temperature`], `figure` | axes and scale factors over several temperatures, beside the accelerometers' |
//! | [`mod@fit`], [`document`] | the whole procedure; the document |

mod attitude;
pub mod bins;
mod checks;
pub mod document;
pub mod earth;
mod figure;
pub mod fit;
pub mod matching;
mod measure;
pub mod model;
pub mod over_temperature;
pub mod plateaus;
mod read;
mod report;
pub mod steps;
#[cfg(test)]
mod tests;
