//! `command`: from state to state, self-test, pre-launch calibration.

mod pre_launch;
mod self_test;

use clap::{Args, Subcommand};
use isotherm_cli::{Exit, failed, number, print, say};
use isotherm_protocol::control::{CommandOrder, CommandReply, Order, PlaceOrder, PreLaunchOrder};
use isotherm_protocol::key::{self, UnitId};

use super::ConsoleError;
use super::client::{self, Client, ClientArgs};
use super::follow::Follow;

/// Arguments of `command`.
#[derive(Debug, Clone, Args)]
// Options may stand behind the action too.
#[command(mut_args(|arg| if arg.is_positional() { arg } else { arg.global(true) }))]
#[command(after_help = "\
Examples:
  isotherm command ZLG-0001 standby
  isotherm command ZLG-0001 self-test
  isotherm command ZLG-0001 pre-launch --latitude 55.75 --heading 30
  isotherm command ZLG-0001 run --reversal

A command that the unit's state does not allow is refused with a list of those allowed, exit code 1.")]
pub struct CommandArgs {
    /// Serial of the unit
    #[arg(value_parser = UnitId::new)]
    pub unit: UnitId,
    /// Command
    #[command(subcommand)]
    pub action: Action,
    /// Your name for the audit file (default: user name)
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
    /// Print the answer as JSON on stdout
    #[arg(long)]
    pub json: bool,
    /// Return as soon as the unit has begun
    #[arg(long)]
    pub detach: bool,
    /// How to reach the service
    #[command(flatten)]
    pub client: ClientArgs,
}

/// What a unit can be told.
#[derive(Debug, Clone, Subcommand)]
pub enum Action {
    /// Publish nothing until further notice
    Standby,
    /// Publish corrected increments, by default with mode reversal if the calibration has it
    Run {
        /// The producer reverses the lasing mode
        #[arg(long, conflicts_with = "no_reversal")]
        reversal: bool,
        /// The producer keeps the lasing mode
        #[arg(long)]
        no_reversal: bool,
    },
    /// Test the instrument (10 s, from standby) and print the report
    SelfTest,
    /// Determine C0 and B0 of each gyro at rest (from standby)
    PreLaunch {
        /// Place and attitude of the unit
        #[command(flatten)]
        place: PlaceArgs,
        /// Time to accumulate (s, 60…7200; default: as configured)
        #[arg(long, value_name = "SECONDS", value_parser = number(" of seconds", 60.0..=7200.0))]
        duration: Option<f64>,
        /// Store and print the result, but do not put it in force
        #[arg(long)]
        store_only: bool,
    },
    /// End self-test or pre-launch calibration; nothing changes
    Abort,
    /// The unit is at rest: feed the drift estimator
    Rest {
        /// Where the unit stands and how
        #[command(flatten)]
        place: PlaceArgs,
    },
    /// The unit is no longer at rest
    EndRest,
    /// Forget a silent unit: calibration, status and place; its revision numbers are not reused
    Forget,
}

/// Where a unit stands and how.
#[derive(Debug, Clone, Args)]
pub struct PlaceArgs {
    /// Geodetic latitude (°, −90…90)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = degrees())]
    pub latitude: f64,
    /// Heading of the case's x axis from north (°)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = degrees())]
    pub heading: f64,
    /// Pitch of the case (°) (default: levelled by the accelerometers)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = degrees(), requires = "roll")]
    pub pitch: Option<f64>,
    /// Roll of the case (°) (default: levelled by the accelerometers)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = degrees(), requires = "pitch")]
    pub roll: Option<f64>,
}

/// For `value_parser`: an angle.
fn degrees() -> impl Fn(&str) -> Result<f64, String> + Clone {
    number(" of degrees", -360.0..=360.0)
}

impl PlaceArgs {
    fn order(&self) -> PlaceOrder {
        PlaceOrder {
            latitude_deg: self.latitude,
            heading_deg: self.heading,
            pitch_roll_deg: self.pitch.zip(self.roll).map(Into::into),
        }
    }
}

impl Action {
    fn order(&self) -> Order {
        match self {
            Self::Standby => Order::Standby,
            Self::Run { reversal, no_reversal } => {
                Order::Run { reversal: (*reversal || *no_reversal).then_some(*reversal) }
            }
            Self::SelfTest => Order::SelfTest,
            Self::PreLaunch { place, duration, store_only } => Order::PreLaunch(PreLaunchOrder {
                place: place.order(),
                duration_s: *duration,
                install: !store_only,
            }),
            Self::Abort => Order::Abort,
            Self::Rest { place } => Order::Rest(place.order()),
            Self::EndRest => Order::EndRest,
            Self::Forget => Order::Forget,
        }
    }
}

/// Gives the command and follows what it begins.
pub(super) async fn run(args: &CommandArgs) -> Result<Exit, ConsoleError> {
    let unit = &args.unit;
    let client = Client::open(&args.client).await?;
    let order = args.action.order();
    // Before the command is given, so that what it begins cannot end before the watch does begin.
    let follow = match order {
        Order::SelfTest | Order::PreLaunch(_) if !args.detach => Some(Follow::start(&client, unit).await?),
        _ => None,
    };
    let by = client::by(args.by.as_deref());
    let reply = give(&client, unit, &CommandOrder { by: by.clone(), order: order.clone() }).await?;
    let follow = follow.filter(|_| reply.accepted);
    let exit = match (follow, order) {
        (Some(follow), Order::SelfTest) => {
            say(in_words(&reply));
            self_test::follow(follow, &client, unit, &reply, args.json).await?
        }
        (Some(follow), Order::PreLaunch(_)) => {
            say(in_words(&reply));
            let abort = CommandOrder { by, order: Order::Abort };
            pre_launch::follow(follow, &client, unit, &abort, args.json).await?
        }
        _ => answer(&reply, args.json),
    };
    client.close().await;
    Ok(exit)
}

/// Prints an answer that nothing follows.
fn answer(reply: &CommandReply, json: bool) -> Exit {
    let exit = if reply.accepted { Exit::Ok } else { Exit::Failed };
    if json {
        return print(&isotherm_cli::json(reply), exit);
    }
    if reply.accepted {
        return print(&(in_words(reply) + "\n"), exit);
    }
    failed(in_words(reply), exit)
}

/// What a self-test and a pre-launch calibration leave behind, and what to do next.
fn in_standby(unit: &UnitId) -> String {
    format!("{unit} is in standby and publishes nothing; to run it: isotherm command {unit} run")
}

/// An answer in words.
fn in_words(reply: &CommandReply) -> String {
    let CommandReply { unit, state, reason, .. } = reply;
    match reason {
        None => format!("{unit}: {state}"),
        Some(reason) if reply.accepted => format!("{unit}: {state}; {reason}"),
        Some(reason) => format!("{unit}: {reason}"),
    }
}

/// Gives one command.
pub(super) async fn give(
    client: &Client,
    unit: &UnitId,
    order: &CommandOrder,
) -> Result<CommandReply, ConsoleError> {
    let order = serde_json::to_vec(order).unwrap_or_default();
    client.json(&client.order(key::command(unit)), "", Some(&order)).await
}
