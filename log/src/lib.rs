//! Logs of inertial units, and their correction offline.
//!
//! What this crate refuses to do: open a session, correct by any other state machine than the service's, or lose a row or
//! a message of a log without counting it.
//!
//! | module | holds |
//! |---|---|
//! | [`mapping`] | which column of a text log is what |
//! | [`text`] | text logs as events in time order |
//! | [`import`] | a mapping proposed for a text log of any maker |
//! | [`recording`] | MCAP files with every message as it was on the bus |
//! | [`message`] | one message and its topic |
//! | [`source`] | a log of either kind as messages |
//! | [`streams`] | its streams by unit, as rows |
//! | [`ros2`] | messages of ROS 2 |
//! | [`part`] | some of its units, some of its time |
//! | [`schedule`] | when its messages are to go out again |
//! | [`faults`] | delay, loss, duplication and reordering on purpose, from a seed |
//! | [`date`] | times of a producer's clock as dates |
//! | [`progress`] | how far a log has been read |
//! | [`replica`] | a unit's stream, made again from frames and journal |
//! | [`offline`] | a log through the service's state machine |
//! | [`diff`] | two corrected logs compared |
//! | [`info`] | what a log holds, in figures |
//! | [`plot`] | a log, or two, as a page to look at |
//! | [`mod@file`] | small files read whole, outputs that must not fall on inputs |
//! | [`error`] | what can go wrong |

pub mod date;
pub mod diff;
pub mod error;
pub mod faults;
pub mod file;
pub mod import;
pub mod info;
pub mod mapping;
pub mod message;
pub mod offline;
pub mod part;
pub mod plot;
pub mod progress;
pub mod recording;
pub mod replica;
pub mod ros2;
pub mod schedule;
pub mod source;
pub mod streams;
pub mod text;
