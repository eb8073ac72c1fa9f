//! Swaps and commands on a running service: whichever way they come in, over real sessions and folders.

mod at_start;
mod bus;
mod command;
mod console;
mod folder;
mod instance;
mod losses;
mod policy;
mod pre_launch;
mod restart;
mod said;
mod schedule;
pub(crate) mod stand;
mod taken;
