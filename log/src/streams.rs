//! The streams of a log by unit: what there is, decoded, in order of time, as rows of text.
//!
//! | module | holds |
//! |---|---|
//! | [`contents`] | what a log holds, by unit |
//! | [`decoded`] | a message of a log, decoded |
//! | [`rows`] | the raw streams of a unit, put in order of time |
//! | [`raw_text`] | these rows as a text log, with the mapping that reads it back |

pub mod contents;
pub mod decoded;
pub mod raw_text;
pub mod rows;
