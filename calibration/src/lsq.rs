//! Least squares: the one place where coefficients, their covariance and the choice of a model are computed.
//!
//! | module | holds |
//! |---|---|
//! | [`linear`] | X·β ≈ y with its covariance, ridge, whitening by a covariance |
//! | [`weighted`] | rows with weights, outliers without; standard errors under correlated residuals |
//! | [`correlated`] | rows under white noise, a Markov drift and rounding to counts, made independent by a Kalman filter |
//! | [`nonlinear`] | Levenberg and Marquardt's method, with the covariance of what was found |
//! | [`folds`] | cross-validation: fits without one block after the other, shrunk |
//! | [`local`] | a parabola over a stretch, for smoothing |
//! | [`search`] | the smallest value of a function of one to three numbers |

pub mod correlated;
pub mod folds;
pub mod linear;
pub mod local;
pub mod nonlinear;
pub mod search;
pub mod weighted;
