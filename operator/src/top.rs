//! `top`: how units and services are, live.

mod draw;
mod feed;
mod fleet;
mod help;
mod order;
mod screen;
#[cfg(test)]
mod tests;
mod view;

use std::time::{Duration, Instant};

use clap::Args;
use tokio::signal::unix::{SignalKind, signal};
use tokio::time::{MissedTickBehavior, interval};

use isotherm_cli::{Exit, duration};

use super::ConsoleError;
use super::client::{Client, ClientArgs};
use super::status::{is_terminal, unix_ms};
pub use feed::Feed;
pub use fleet::Fleet;
pub use order::worst_first;
use screen::{Keys, Screen};
use view::{Act, View};

/// Arguments of `top`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm top
  isotherm top --connect tcp/10.0.0.7:7447 --interval 0.5

One line per unit, as in `isotherm status`; `isotherm status --help` explains the columns. Keys: arrows select, Enter
shows everything about a unit, s sorts, / filters, ? helps, q quits.")]
pub struct TopArgs {
    /// Time between two updates (s)
    #[arg(long, value_name = "SECONDS", default_value = "1", value_parser = duration(0.1..=60.0))]
    pub interval: Duration,
    /// How to reach the service
    #[command(flatten)]
    pub client: ClientArgs,
}

/// Shows units and services until the operator has seen enough.
pub(super) async fn run(args: &TopArgs) -> Result<Exit, ConsoleError> {
    if !is_terminal() {
        return Err(ConsoleError::NoTerminal);
    }
    let client = Client::open(&args.client).await?;
    let mut feed = Feed::start(&client).await?;
    let shown = show(&mut feed, args.interval).await;
    drop(feed);
    client.close().await;
    shown.map(|()| Exit::Ok).map_err(ConsoleError::Terminal)
}

/// The loop: what comes changes the fleet, keys change the view, both are drawn.
async fn show(feed: &mut Feed, every: Duration) -> std::io::Result<()> {
    let [mut interrupt, mut terminate, mut hang_up] =
        [signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?, signal(SignalKind::hangup())?];
    let mut screen = Screen::open()?;
    let mut keys = Keys::read();
    let (mut fleet, mut view) = (Fleet::default(), View::default());
    let mut ticks = interval(every);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            biased;
            _ = interrupt.recv() => return Ok(()),
            _ = terminate.recv() => return Ok(()),
            _ = hang_up.recv() => return Ok(()),
            event = keys.next() => {
                match view.take(&event?) {
                    Act::Quit => return Ok(()),
                    Act::Clear => screen.terminal.clear()?,
                    Act::Draw => {}
                    Act::Nothing => continue,
                }
            }
            _ = ticks.tick() => {}
            news = feed.next() => {
                // Drawn with the next tick: the screen changes as often as was asked for, however much comes.
                match news {
                    Some(news) => fleet.take(news, Instant::now(), unix_ms()),
                    None => return Ok(()),
                }
                continue;
            }
        }
        // What has come already is seen now: the first screen would be empty otherwise.
        while let Some(news) = feed.next_now() {
            fleet.take(news, Instant::now(), unix_ms());
        }
        let (now, now_unix_ms) = (Instant::now(), unix_ms());
        fleet.forget(now);
        screen.terminal.draw(|frame| draw::draw(frame, &fleet, &mut view, now, now_unix_ms))?;
    }
}
