//! Configurations of the service.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| isotherm_fuzz::configuration::configuration(input));
