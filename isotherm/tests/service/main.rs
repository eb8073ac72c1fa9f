//! The running service: one test program, because every one that opens sessions takes half a minute to build.
//!
//! | file | holds |
//! |---|---|
//! | `loopback` | raw in, corrected out, over real sessions |
//! | `swap_manager` | swaps and commands, whichever way they come in |
//! | `journal` | a log alone is enough for the same bits again |
//! | `metrics` | metrics and health over HTTP |
//! | `console_status` | what `isotherm status` and `top` show of it |
//! | `reach` | defaults, environment and file by which programs meet; what is said where they do not |
//! | `serve_command` | the program itself: start, stop, signals |
//! | `web` | the console in the browser: who is answered, and its page in a real browser |
//! | `shipped_configuration` | the Zenoh configurations that are shipped |

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test may panic, its helpers included"
)]

mod console_status;
mod control;
mod journal;
mod loopback;
mod metrics;
mod reach;
mod serve_command;
mod shipped_configuration;
mod web;
