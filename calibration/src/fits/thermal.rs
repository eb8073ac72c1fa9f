//! Bias and scale factor over temperature from runs at rest, in several attitudes, or on a rate table (models §8).
//!
//! One linear model serves all methods; they differ in which terms they offer and in how they find the numbers. The
//! columns of the model are what the service itself subtracts for a coefficient of one, and what is reported is what
//! the service makes of the whole log with the written document.
//!
//! | module | holds |
//! |---|---|
//! | [`settings`] | what may be asked for |
//! | [`stand`] | how the unit stands or turns in a run, and what it would read without error |
//! | [`bare`] | the unit without the terms that are fitted; a nominal document for a log without one |
//! | [`samples`], [`checks`] | a run as windows, and what must hold of it |
//! | [`thermometer`] | the noise of thermometers, taken out of what a fit is made with |
//! | [`columns`] | what one unit of each term subtracts, from the corrector |
//! | [`branches`] | plateaus, ramps, and the pieces that cross-validation leaves out |
//! | [`model`] | which terms a sensor has, and their place in the document |
//! | [`scale`] | what gravity or a rate table tells of the scale factors |
//! | `compare` | a document beside a mean and cubics, on judging runs |
//! | [`sequential`], `joint` | 000's procedure; all terms at once |
//! | [`ladder`], [`select`] | which models there are; cross-validation |
//! | [`noise`] | what the noise of a thermometer adds to the output |
//! | [`mod@fit`] | from runs to a document and its report |

pub mod bare;
pub mod branches;
pub mod checks;
pub mod columns;
mod compare;
mod filter;
pub mod fit;
mod joint;
mod known;
pub mod ladder;
pub mod model;
pub mod noise;
mod outcome;
pub mod samples;
pub mod scale;
pub mod select;
pub mod sequential;
pub mod settings;
pub mod stand;
pub(crate) mod target;
pub mod thermometer;
mod told;

pub use crate::document::Fitted;
pub use fit::fit;
pub use settings::{Method, Settings, Terms};
pub use stand::{Site, Stand, Turning};
