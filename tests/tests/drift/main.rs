//! The drift estimator on simulated drift, through the whole unit: consistency, prediction, wrong references.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(
    clippy::cast_precision_loss,
    reason = "numbers of ticks and 53 bits of noise, which a double holds exactly"
)]

mod bench;
mod consistency;
mod prediction;
mod references;
