//! What the service shows of itself and its units.
//!
//! | module | holds |
//! |---|---|
//! | `instance` | what it says of itself, for all of these |
//! | `status_publisher` | the thread for status, queries and the tail of a stream that has stopped |
//! | `subscribers` | who is behind with what was published |
//! | `metrics` | metrics and health over HTTP |
//! | [`web`] | the console in the browser, on the same server |
//! | [`totals`] | what is said at the end |

pub(crate) mod instance;
pub(crate) mod metrics;
pub(crate) mod status_publisher;
pub(crate) mod subscribers;
pub mod totals;
pub mod web;
