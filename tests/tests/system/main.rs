//! System tests, one binary: linking Zenoh once is enough.

mod i1_each_tick_once;
mod i2_timing_does_not_matter;
mod i5_mode_switch;
mod i7_broken_input;
