//! Which calibration a unit has, and in which state it is: the one path of every change, and what is remembered of it.
//!
//! | module | holds |
//! |---|---|
//! | [`watch`] | the calibration folder as it changes |
//! | `swap_manager` | the thread that takes, judges and carries out every swap and command |
//! | [`store`] | the state folder: audit file, documents |
//! | [`calibrations`] | what each unit is to correct with |
//! | [`compressed`] | texts that are kept for long and read seldom |

pub mod calibrations;
pub mod compressed;
pub mod store;
pub(crate) mod swap_manager;
pub mod watch;
