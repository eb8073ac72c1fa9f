//! Figures of corrected ticks: how many, what was flagged, mean rates and specific forces.

pub use isotherm_log::offline::sums::{Summary, Sums};
