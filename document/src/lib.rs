//! TOML texts that people write: calibration documents, overlays, configurations, column mappings, plans.
//!
//! A text is read by the schema of its type: the type's fields, their attributes and their doc comments are the one
//! statement of its keys. From it come the check of every value, the schema that editors use, and the pages that list the
//! keys. Everything that is wrong is reported at once, each with file, line, column, key, value, limit and advice.
//!
//! ```
//! use std::sync::LazyLock;
//!
//! use isotherm_document::{Form, Reader};
//!
//! #[derive(serde::Deserialize, schemars::JsonSchema)]
//! #[schemars(deny_unknown_fields)]
//! struct Settings {
//!     #[schemars(range(min = 1, max = 10))]
//!     rounds: u8,
//! }
//!
//! static FORM: LazyLock<Form> = LazyLock::new(Form::of::<Settings>);
//!
//! let mut reader = Reader::new("rounds = 11\n", Some("settings.toml"));
//! let settings: Option<Settings> = reader.read(&FORM);
//! assert!(settings.is_some_and(|settings| settings.rounds == 1), "a stand-in within the limits");
//! let problems = reader.into_problems().unwrap();
//! assert_eq!(problems[0].to_string(), "settings.toml:1:10: rounds: is 11, must be a whole number from 1 to 10");
//! ```
//!
//! What a schema cannot say, the reader of a text checks afterwards, with [`Reader::report`]. A value that was wrong has been
//! replaced by a stand-in within its limits, and its path is marked: what later checks say of a marked path is dropped.
//!
//! Beside the keywords of JSON Schema, attributes of a field may have:
//!
//! | keyword | meaning |
//! |---|---|
//! | `x-must-be` | the words behind "must be" |
//! | `x-rising` | of two numbers, the first must be below the second |
//!
//! Lengths of texts count bytes; a text of the format `socket-address` is an address and a port.

pub mod escape;
pub mod file;
mod kind;
mod looks;
mod number;
mod problem;
mod reader;
mod schema;
mod slips;
mod stand_in;
mod suggest;
mod text;
mod walk;

pub use number::tidy;
pub use problem::{Problem, few, listed};
pub use reader::{Reader, element, join, parse};
pub use schema::{Form, published};
pub use text::{MAX_BYTES, parse_toml, unplaced};
pub use walk::is_complete;
