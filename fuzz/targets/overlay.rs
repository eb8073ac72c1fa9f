//! Overlays on a document.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| isotherm_fuzz::texts::overlay(input));
