//! Ready-made scenarios. The parameters are fixed; the seed moves noise, misses and lost times only.

mod fibre_optic;
mod mems;
mod shared;
mod zeeman;

pub use fibre_optic::{fibre_optic_chamber, judging_profile, paper_profile, training_profile};
pub use mems::{mems_chamber, skewed_six};
pub use zeeman::{zeeman_rest, zeeman_sine};

#[cfg(test)]
mod tests;
