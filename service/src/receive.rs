//! Zenoh → unit → Zenoh: what happens to a raw message before the receive thread returns.
//!
//! | module | holds |
//! |---|---|
//! | [`intake`] | finds the unit of a message, has it corrected, survives whatever it is |
//! | [`mod@unit`] | one unit's part: its stream, calibration, faults and outlet |
//! | `pulse` | whether this path is alive |
//! | [`fault`], [`latency`] | what is counted on the way |

pub mod fault;
pub mod intake;
pub mod latency;
pub(crate) mod pulse;
pub mod unit;
