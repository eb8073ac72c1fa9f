//! Correction models of inertial sensors and the per-unit state machine that applies them.
//!
//! Raw ticks of three to eight gyros and three to eight accelerometers go in together with temperature
//! readings; corrected angle and velocity increments in case axes come out. Everything is a function of the
//! events and their own timestamps.
//!
//! What this crate refuses to do: read a clock, do I/O, spawn anything, allocate per tick, or use a
//! transcendental function from anywhere but `libm`. It is `no_std`; `alloc` serves the calibration and the
//! buffers that a unit makes once.
//!
//! # Map
//!
//! | module | holds |
//! |---|---|
//! | [`units`] | one newtype per quantity, with named constructors |
//! | [`stated`] | a stated number outside its range |
//! | [`sample`] | what goes in (raw ticks, temperature readings) and what comes out (corrected ticks, flags) |
//! | [`calibration`] | the immutable, validated coefficient set |
//! | [`vector`] | vectors of three |
//! | [`curve`] | polynomial, piecewise-linear table and cubic spline, clamped to their fitted range |
//! | [`lanes`] | sensor beside sensor: one number of each |
//! | [`channel`] | temperature channel: gating, smoothing, three-point derivatives |
//! | [`thermal`] | the gyro's and accelerometer's thermal terms and their continuous update |
//! | [`orientation`] | input axes to case axes, parity residuals, exclusion of a failed sensor |
//! | [`reversal`] | the four-step substitution over a mode switch |
//! | [`servo`] | the perimeter-servo transient after a mode switch |
//! | [`sigma`] | standard errors of the outputs by cause |
//! | [`navigation`] | sums of ticks with coning and sculling terms |
//! | [`operation`] | the unit's states, commands and self-test (models §7) |
//! | [`observation`] | one tick after its correction, for those who watch the unit |
//! | [`rest`] | whether the unit stands still |
//! | [`earth`] | place of the unit and rate of the Earth in case axes |
//! | [`prelaunch`] | pre-launch calibration at rest: C0 and B0 of each gyro |
//! | [`drift`] | in-run drift estimator |
//! | [`mod@unit`] | the state machine that puts them together |
//!
//! A [`unit::Unit`] can be written down and read back with serde, all of its memory: it goes on as if nothing had been.
#![no_std]

extern crate alloc;

mod by_mode;
pub mod calibration;
pub mod channel;
mod counting;
pub mod curve;
mod defect;
pub mod drift;
pub mod earth;
pub mod lanes;
mod later;
pub mod navigation;
pub mod observation;
pub mod operation;
pub mod orientation;
pub mod prelaunch;
mod recent;
pub mod rest;
pub mod reversal;
pub mod sample;
pub mod servo;
pub mod sigma;
pub mod stated;
pub mod thermal;
pub mod unit;
pub mod units;
pub mod vector;
mod written;
