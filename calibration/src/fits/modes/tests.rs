//! Simulated Zeeman units through the whole procedure.

mod fixture;
mod recovery;
mod refusals;
