//! Status frames of services.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(
    |input: &[u8]| isotherm_fuzz::frames::frame::<isotherm_protocol::service_status::ServiceStatus>(input)
);
