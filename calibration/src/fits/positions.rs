//! Orientation, scale factor and bias of accelerometers from positions of a stand (models §9, 004).
//!
//! | module | holds |
//! |---|---|
//! | [`track`], [`still`], [`pose`] | a run tick by tick; where it stands still; means over that |
//! | [`bare`] | a document of a unit that has none yet |
//! | [`gravity`] | what everything is relative to |
//! | [`plan`], [`times`], [`matching`], [`faults`] | positions of a stand; when which was held; which pose is which; sensors that are no use |
//! | [`model`], [`solve`] | the outputs as a function of what is to be found; finding it |
//! | [`temperature`], [`doubts`], [`measure`] | levels and channels; what is doubtful about a result, and about its unit of measure |
//! | [`mod@fit`], [`document`], [`provenance`], [`judged`], [`report`], [`charts`] | from runs to a result; as a document, with where it comes from; what it leaves; in words and diagrams |
//! | [`hysteresis`] | axes that do not come back after a thermal cycle |
//! | [`budget`] | what a planned calibration will come to |
//! | `sense` | which way sensors point beside what is stated |

pub mod bare;
pub mod budget;
pub mod charts;
pub mod document;
pub mod doubts;
pub mod faults;
pub mod fit;
pub mod gravity;
pub mod hysteresis;
pub mod judged;
pub mod matching;
pub mod measure;
pub mod model;
pub mod plan;
pub mod pose;
pub mod provenance;
pub mod report;
pub(crate) mod sense;
pub mod solve;
pub mod still;
pub mod temperature;
pub mod times;
pub mod track;
