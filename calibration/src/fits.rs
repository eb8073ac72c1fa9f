//! The fits, one per command: from runs to a document and its report.
//!
//! | module | holds |
//! |---|---|
//! | [`board`] | ratio of the accelerometers' board from two-position cycles |
//! | [`drift`] | noise and drift of a static log |
//! | [`impact`] | what a drift that is left means for navigation |
//! | [`modes`] | drift polynomials and switch parameters of a mode-reversed laser gyro |
//! | [`positions`], [`tumble`] | accelerometers on a stand; a unit tumbled by hand |
//! | [`rates`] | scale factor, asymmetry, linearity and axes from a rate table |
//! | [`thermal`] | bias over temperature from runs at rest |
//!
//! Files have the same names in each: `model` has the equations and solves them, `fit` is the whole procedure, `document` puts what was
//! found into a document, `report` says it.

pub mod board;
pub mod drift;
pub mod impact;
pub mod modes;
pub mod positions;
pub mod rates;
pub mod thermal;
pub mod tumble;
