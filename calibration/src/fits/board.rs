//! The ratio r of the accelerometers' board over its own temperature, from two-position cycles [001 §2.1].
//!
//! The unit stands in one position while the chamber takes the board through its range, then in the opposite one. With r = 1 an
//! accelerometer shows U' = f/r, so that in a run of input f
//!
//! ```text
//! U' − f = level of the run + f·x(T_board) + s·T_board + ΔS(T) + f·ΔK(T),      r = 1/(1 + x)
//! ```
//!
//! Levels, the slope s, ΔS and ΔK stand beside x and are not written: on a thermostat ΔS and ΔK are nothing, and where the accelerometer's own
//! temperature moves by itself `thermal` fits them with r known.
//!
//! | module | holds |
//! |---|---|
//! | [`model`] | one accelerometer: its rows, what they must hold, the fit |
//! | [`mod@fit`] | from runs to a document and its report |

pub mod fit;
pub mod model;

pub use fit::{Wanted, fit};
