//! What a drift that is left means for navigation (002).
//!
//! | file | holds |
//! |---|---|
//! | [`ins`] | error equations of a platform system whose platform turns about the vertical |
//! | [`estimate`] | what the service's own drift estimator leaves of a drift |
//! | [`logged`] | a drift out of a log |
//! | [`scenario`] | calibration, then hours on its own: a drift in, errors of heading and position out |
//! | [`models`] | 002's two models of a drift, and which of them a log bears out |
//! | [`monte_carlo`] | many seeded drifts of a stated size |
//! | [`over_starts`] | how the constant differs from start to start |
//! | [`report`] | table, JSON, page |

pub mod estimate;
pub mod ins;
pub mod logged;
pub mod models;
pub mod monte_carlo;
pub mod over_starts;
pub mod report;
pub mod scenario;
