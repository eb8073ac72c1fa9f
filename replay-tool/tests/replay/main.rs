//! The replay tool as a whole: its command line, its ready mappings, its simulated logs, recording from a bus. One test program, because
//! every one that opens sessions takes half a minute to build.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "helpers of tests end the test where something is not as it must be"
)]
#![expect(clippy::float_cmp, reason = "logs are read to the bit")]

mod command_line;
mod common;
mod conversions;
mod correct_diff_step;
mod examples;
mod import_faults;
mod import_languages;
mod imports;
mod info_plot;
mod octave;
mod python_recordings;
mod real_logs;
mod record;
mod simulated_logs;
mod text_logs;
