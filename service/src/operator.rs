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

pub(crate) mod client;
mod command;
mod error;
mod follow;
mod history;
pub(crate) mod page;
mod show;
pub(crate) mod status;
mod swap;
mod top;

pub use client::ClientArgs;
pub use command::CommandArgs;
pub use error::ConsoleError;
pub use history::HistoryArgs;
pub use status::StatusArgs;
pub use swap::{RollbackArgs, SwapArgs};
pub use top::TopArgs;

pub(crate) use top::{Feed, Fleet, worst_first};

use crate::exit::Exit;
use crate::words::say;

/// A command of the operator's side.
#[derive(Debug, Clone)]
pub(crate) enum Console {
    Swap(SwapArgs),
    Rollback(RollbackArgs),
    History(HistoryArgs),
    Command(CommandArgs),
    Status(StatusArgs),
    Top(TopArgs),
}

/// Runs it; SIGINT ends it at any point, where it does not say otherwise.
pub(crate) async fn run(console: Console) -> Exit {
    let done = match console {
        Console::Swap(args) => swap::run(&args).await,
        Console::Rollback(args) => swap::rollback(&args).await,
        Console::History(args) => history::run(&args).await,
        Console::Command(args) => command::run(&args).await,
        Console::Status(args) => status::run(&args).await,
        Console::Top(args) => top::run(&args).await,
    };
    done.unwrap_or_else(|error| {
        say(format_args!("isotherm: {error}"));
        error.exit()
    })
}
