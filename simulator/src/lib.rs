//! Physics of inertial units in a thermal chamber, apart from the corrector's formulas.
//!
//! A [`Scenario`] says what the chamber, the vehicle and the unit do; a [`Simulation`] is the stream of raw ticks
//! that follows from it, with the exact [`Truth`] beside each. The way is always from input to output: rates are
//! turned into counts, temperatures into voltages, heat into drift. What a corrector should find lies in the
//! public parameters of the instruments, whose documentation states each one's direction.
//!
//! What this crate refuses to do: read a clock, do I/O, use the corrector's models, draw a random number that does
//! not follow from the seed, or use a transcendental function from anywhere but `libm`. The same scenario gives the
//! same bits.
//!
//! ```
//! let scenario = isotherm_simulator::presets::zeeman_rest(7);
//! let simulation = isotherm_simulator::Simulation::new(&scenario)?;
//! let counts: f64 = simulation.take(200).map(|step| step.gyro.readings[0]).sum();
//! assert!(counts.abs() < 1000.0, "one second of the Earth's rate and a small bias");
//! # Ok::<(), isotherm_simulator::ScenarioErrors>(())
//! ```
//!
//! # Map
//!
//! | module | holds |
//! |---|---|
//! | [`chamber`] | programmes of ramps and holds |
//! | [`thermal`] | lumped parts that follow the chamber with a lag |
//! | [`motion`], [`trajectory`] | what the case does, and exact integrals of its rate and specific force |
//! | [`orientation`] | input axes over temperature |
//! | [`zeeman`], [`reversal`] | dithered laser gyro; mode switches, perimeter servo, slow meander |
//! | [`fibre_optic`], [`coil`], [`winding`] | fibre gyro; heat conduction in its coil; Shupe integral |
//! | [`mems`] | micromechanical gyro |
//! | [`accelerometer`] | quartz and micromechanical accelerometers |
//! | [`effects`] | what sensors do beyond that: drift with acceleration, bent scales, lever arms, squares, friction |
//! | [`temperature`] | temperature channels |
//! | [`failure`] | sensors that fail |
//! | [`instrument`], [`scenario`] | a unit; a unit in its surroundings |
//! | [`error`] | what can be wrong with a scenario |
//! | [`simulation`], [`truth`] | the stream of ticks; what was really there |
//! | [`presets`] | ready-made scenarios |

pub mod accelerometer;
pub mod chamber;
mod check;
pub mod coil;
mod counter;
pub mod effects;
pub mod error;
pub mod failure;
pub mod fibre_optic;
mod gyros;
pub mod instrument;
pub mod mems;
pub mod motion;
pub mod noise;
pub mod orientation;
mod polynomial;
pub mod presets;
pub mod reversal;
pub mod scenario;
pub mod simulation;
mod surroundings;
pub mod temperature;
pub mod thermal;
pub mod trajectory;
pub mod truth;
mod vector;
pub mod winding;
pub mod zeeman;

pub use error::{ScenarioError, ScenarioErrors};
pub use scenario::Scenario;
pub use simulation::Simulation;
pub use truth::{Step, Truth};
