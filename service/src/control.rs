//! Which calibration a unit has, and in which state it is: the one way of every change, whoever asks, and what is remembered of it.
//!
//! | module | holds, in the order of a swap over the bus |
//! |---|---|
//! | `queue` | how to ask without waiting, and what waits, unit by unit |
//! | `manager` | the thread |
//! | `request` | the request: what is asked for beside a document; queries and their replies |
//! | [`document`] | the document: a text that was read and holds |
//! | `decision` | the decision: problems, warnings, difference |
//! | [`change`] | the change: written to disk, written down, handed to the unit |
//! | [`revision`] | the revision: a document under its number; what each unit has and is to follow |
//! | [`store`] | the audit entry: the state folder with audit file and documents |
//!
//! | module | other ways of asking, and what becomes of it |
//! |---|---|
//! | `watch`, `folder`, `file` | the calibration folder as it changes, and its documents |
//! | `start` | what holds when the service starts |
//! | `command`, `pre_launch` | commands, rollback among them; the result of a pre-launch calibration |
//! | `carry` | what another instance has written down, written down here too |
//! | `jump`, `unlikely` | what a document changes too much, by configuration and in any case |
//! | `refusals` | refused documents, written down once |
//! | `control_status` | what the service's own status shows |
//! | [`compressed`] | texts that are kept for long and read seldom |

mod carry;
pub mod change;
mod command;
pub mod compressed;
mod control_status;
mod decision;
pub mod document;
mod file;
#[cfg(test)]
mod fixture;
mod folder;
mod jump;
mod manager;
mod pre_launch;
mod queue;
mod refusals;
mod request;
pub mod revision;
mod start;
pub mod store;
mod unlikely;
pub(crate) mod watch;

pub(crate) use carry::Carried;
pub(crate) use control_status::{ControlStatus, OLDER, STATE_FOLDER, UNWRITTEN};
pub(crate) use folder::NO_OVERLAYS;
pub(crate) use manager::{SwapManager, Worker};
pub(crate) use queue::{Asked, Inbox, Message, Notice, Origin, PreLaunchEnd};
pub(crate) use request::is_asked;
