//! Zenoh sessions for producers, consumers and the service.
//!
//! What every program of the project needs of Zenoh stands here once: how a session is opened and closed in bounded
//! time, how a producer publishes raw batches in the right order without outrunning the service, how a consumer
//! receives corrected batches and proves that none was lost.
//!
//! What this crate refuses to do: correct anything, read a log, or sleep until something has probably happened.
//! Every wait is a wait for a state, and every wait has a limit.
//!
//! | module | holds |
//! |---|---|
//! | [`session`] | options, open, locators, close |
//! | [`endpoint`](mod@endpoint) | addresses as people write them |
//! | [`arbiter`] | of several services, the tick that comes first |
//! | [`client`] | the one way from a program to a service |
//! | [`producer`] | raw ticks of a unit out, in batches |
//! | [`outlet`] | raw frames of a unit out, bounded by what comes back; the account of it |
//! | [`consumer`] | corrected batches in |
//! | [`continuity`] | the rule by which a consumer notices a lost tick |
//! | [`presence`] | waiting until the service is there |
//! | [`inquiry`] | asking every service at once |
//! | [`receipt`] | proof that subscribers have taken what was sent |
//! | [`routes`] | keys whose routes Zenoh is to remember |
//! | [`threads`] | work for the threads that receive |

pub mod arbiter;
mod certificate;
pub mod client;
pub mod consumer;
pub mod continuity;
pub mod endpoint;
mod error;
pub mod inquiry;
mod obstacle;
pub mod outlet;
pub mod presence;
pub mod producer;
pub mod receipt;
pub mod routes;
pub mod session;
pub mod threads;

pub use arbiter::FirstWins;
pub use client::{ClientOptions, Role};
pub use consumer::Consumer;
pub use continuity::Continuity;
pub use endpoint::{DEFAULT_ENDPOINT, endpoint};
pub use error::{BusError, Json5Problem, without_places, words};
pub use outlet::{Outlet, OutletOptions};
pub use producer::{Producer, ProducerOptions};
pub use routes::DeclaredKeys;
pub use session::{SessionOptions, close, connected, locators, open, open_config};

use std::pin::Pin;

/// A future that is compiled where it is made. What an `async fn` awaits is compiled by each crate that awaits it: for Zenoh's opening
/// and closing that is half a minute for every program and test.
pub type BoxFuture<'a, T> = Pin<Box<dyn Future<Output = T> + Send + 'a>>;
