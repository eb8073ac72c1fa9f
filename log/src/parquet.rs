//! Streams as Parquet files: one file per unit and stream, plain columns named with their units of measure.
//!
//! | stream | one row per |
//! |---|---|
//! | `raw_gyro`, `raw_accel` | tick |
//! | `raw_temperature`, `raw_health` | reading |
//! | `reference` | rate reference |
//! | `corrected` | corrected tick or navigation step |
//! | `applied_temperature` | channel and corrected batch |
//! | `status` | status message |
//!
//! Messages are written as they came: in their order, doubled where they were. Where ticks of one stream have different
//! numbers or kinds of readings, the columns are there for all of them and empty where a tick has none.

mod columns;
mod rows;
mod streams;
mod table;
#[cfg(test)]
mod tests;

pub use streams::UnitTables;
