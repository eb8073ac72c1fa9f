//! Lines of the audit file.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| isotherm_fuzz::operators::audit(input));
