//! What the programs' command lines share.
//!
//! What this crate refuses to do: know what a command does.
//!
//! | module | holds |
//! |---|---|
//! | [`advanced`] | the command line, with a short and a long help |
//! | [`program`] | completions and manual pages |
//! | [`mod@number`] | numbers of a command line |
//! | [`mod@print`] | results on stdout |
//! | [`stderr`] | words on stderr, through a queue where a blocked reader must not hold the program up |
//! | [`bar`] | progress |
//! | [`exit`] | exit codes |
//! | [`mod@table`] | tables |
//! | [`window`] | the part of a log's time |

pub mod advanced;
pub mod bar;
pub mod exit;
pub mod number;
pub mod print;
pub mod program;
mod queue;
pub mod stderr;
pub mod table;
pub mod window;

pub use advanced::parse;
pub use bar::Bar;
pub use exit::Exit;
pub use number::{duration, number, seconds};
pub use print::{coloured, grouped, json, print, print_within, to_stdout};
pub use program::Common;
pub use stderr::{failed, failed_lines, say, say_lines, say_warning};
pub use table::table;
pub use window::Window;
