//! Allan variances of a log, and the noise coefficients that they show.
//!
//! | file | holds |
//! |---|---|
//! | [`deviation`] | plain, overlapping and modified Allan variance over contiguous pieces of a log |
//! | [`confidence`] | degrees of freedom of each, and how the overlapping ones hang together |
//! | [`fit`] | N, B, K, R, Q out of the overlapping variances |
//!
//! Words and symbols are those of IEEE 952: angle random walk N, bias instability B, rate random walk K, rate ramp R,
//! quantization Q.

pub mod confidence;
pub mod deviation;
pub mod fit;

pub use confidence::PowerLaw;
pub use deviation::{Estimator, Phase, Variance};
pub use fit::{Coefficient, NoiseFit, Term};
