//! Frames and journal put back in the order in which a service had them: of a recording, or while they come.
//!
//! | type | holds |
//! |---|---|
//! | [`Outline`] | where the entries of a recorded journal stand |
//! | [`Sequencer`] | frames and entries in the order in which the service had them |
//! | [`Notice`] | where recorder and service did not have the same |
//! | [`Follower`] | a stream that stays, to the bit, what another service's is |

mod follower;
mod notice;
mod outline;
mod sequencer;

pub use follower::{Follower, MAX_WAITING, Rebuilt};
pub use notice::Notice;
pub use outline::{Mark, MarkKind, Outline, Outlines, UnitOutline};
pub use sequencer::{Deed, NEAR_NS, Sequencer};
