//! The replay tool as a whole: its command line, its ready mappings, its simulated logs.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of tests end the test where something is not as it must be"
)]
#![expect(clippy::float_cmp, reason = "logs are read to the bit")]

mod command_line;
mod common;
mod conversions;
mod correct_diff_step;
mod examples;
mod info_plot;
mod python_recordings;
mod real_logs;
mod simulated_logs;
mod text_logs;
