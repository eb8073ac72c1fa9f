//! Thermal terms of gyros and accelerometers, and their continuous update (models §2, §3).
//!
//! Temperature moves slowly, so every term is evaluated once per temperature sample and the value in use moves
//! on a straight line to the new one over the next sample interval: the corrected rate has no staircase.

mod accel;
mod bank;
mod declared;
mod gyro;
mod motion;
mod terms;
mod trail;

pub use accel::AccelModel;
pub(crate) use bank::{Bank, Follows, MotionBanks, Pace, Paces, Ramp, Shares};
pub use declared::{ACCEL_TERMS, Feature, GYRO_TERMS, Makes, Parameter, Per, Term, TermForm};
pub use gyro::GyroModel;
pub(crate) use gyro::Trends;
pub(crate) use motion::{Motion, MotionTerms};
pub use terms::MAX_REGRESSORS;
pub(crate) use terms::Others;
pub use trail::{MAX_LAGS, MAX_PLAYS};
pub(crate) use trail::{PLAY_WIDTHS_DEG_C, drag};
