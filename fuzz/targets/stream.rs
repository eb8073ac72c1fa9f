//! Frames in, frames out.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| isotherm_fuzz::stream::stream(input));
