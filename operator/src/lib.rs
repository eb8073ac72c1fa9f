//! The operator's side: commands that talk to a running service over Zenoh, and nothing else.
//!
//! | module | command |
//! |---|---|
//! | `swap` | `swap`, `rollback` |
//! | `history` | `history` |
//! | `command` | `command`: states, self-test, pre-launch calibration |
//! | `status` | `status` |
//! | `top` | `top` |
//! | `page` | what `status` and `top` show, as lines |
//! | `client` | what they share: a session, questions, answers |
//!
//! They know the service by its keys alone, so that they work from any machine that reaches it.

pub mod client;
mod command;
mod error;
mod follow;
mod history;
pub mod page;
mod show;
pub mod status;
mod swap;
mod top;

pub use client::ClientArgs;
pub use command::CommandArgs;
pub use error::ConsoleError;
pub use history::HistoryArgs;
pub use status::StatusArgs;
pub use swap::{RollbackArgs, SwapArgs};
pub use top::TopArgs;

pub use top::{Feed, Fleet, worst_first};

use clap::Subcommand;
use isotherm_bus::BoxFuture;
use isotherm_cli::{Exit, failed};

/// A command of the operator's side.
#[derive(Debug, Clone, Subcommand)]
pub enum Operation {
    /// Show what units and services are doing, once
    Status(StatusArgs),
    /// Show what units are doing, live
    Top(TopArgs),
    /// Swap a unit's calibration: show the difference, ask, swap
    Swap(SwapArgs),
    /// Go back to an earlier calibration
    Rollback(RollbackArgs),
    /// Show a unit's calibrations and commands: what, when, by whom
    History(HistoryArgs),
    /// Command a unit: standby, run, self-test, pre-launch calibration, rest
    Command(CommandArgs),
}

impl Operation {
    /// Runs it; SIGINT ends it at any point, where it does not say otherwise.
    #[must_use]
    pub fn run(self) -> BoxFuture<'static, Exit> {
        Box::pin(async move {
            let done = match self {
                Self::Status(args) => status::run(&args).await,
                Self::Top(args) => top::run(&args).await,
                Self::Swap(args) => swap::run(&args).await,
                Self::Rollback(args) => swap::rollback(&args).await,
                Self::History(args) => history::run(&args).await,
                Self::Command(args) => command::run(&args).await,
            };
            done.unwrap_or_else(|error| failed(&error, error.exit()))
        })
    }
}
