//! Playing a log to the raw topics of its units.

mod player;
mod playlist;
mod report;
mod silence;
mod units;

use std::collections::BTreeMap;
use std::time::Duration;

use isotherm_bus::inquiry::pair_reports;
use isotherm_bus::presence::ServiceWatch;
use isotherm_bus::{BusError, ClientOptions, Role};
use isotherm_log::faults::FaultOptions;
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::schedule::Clock;
use isotherm_log::source::LogReport;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::HealthReading;
use tokio::signal::unix::SignalKind;
use tokio::sync::mpsc::UnboundedReceiver;
use zenoh::key_expr::OwnedKeyExpr;

use crate::error::Error;
use crate::pace::Speed;
use crate::stop::Stop;
use player::Player;
pub(crate) use playlist::wanted;

pub use report::{Counts, PlayReport, Position, Returned, UnitReport};

/// How long a session may take to close.
const CLOSE_LIMIT: Duration = Duration::from_secs(5);

/// What is played, and how.
#[derive(Debug, Clone)]
pub struct PlayOptions {
    /// The log.
    pub files: LogFiles,
    /// Which part of it.
    pub part: Part,
    /// Keys of the messages that are taken, any of them; all where there is none.
    pub topics: Vec<OwnedKeyExpr>,
    /// By which clock.
    pub clock: Clock,
    /// How fast.
    pub speed: Speed,
    /// How often the part is played; `None` is for ever.
    pub passes: Option<u64>,
    /// Units that are played as others: serial in the log, serial on the bus.
    pub names: BTreeMap<UnitId, UnitId>,
    /// Each unit is played as so many, `SERIAL-001` and so on; `None` is as itself.
    pub copies: Option<u32>,
    /// What happens to messages on their way.
    pub faults: FaultOptions,
    /// Where all chance comes from.
    pub seed: u64,
    /// Number of the first series; `None` is one that no player had before.
    pub series: Option<u64>,
    /// What the instruments of a text log are to report of themselves, once a second of event time.
    pub health: Vec<HealthReading>,
    /// How the session is opened.
    pub session: ClientOptions,
    /// How long to wait for service and subscribers, and for what comes back.
    pub wait: Duration,
    /// Whether and how far playing is bounded by what comes back.
    pub acknowledge: Acknowledge,
}

/// Whether and how far playing is bounded by what comes back corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acknowledge {
    /// Not at all: for listeners other than the service.
    No,
    /// At most so many gyro ticks of a unit are sent and not come back; `None` is by the number of units.
    Bounded(Option<u64>),
}

/// What somebody at the keyboard asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Pause, or go on.
    Pause,
    /// Pause, and play up to the next gyro batch.
    Step,
    /// Step where playing is paused, else go on 10 s further on.
    StepOrForward,
    /// Go on so many seconds further on, or back.
    Seek(f64),
    /// Twice as fast.
    Faster,
    /// Half as fast.
    Slower,
    /// Finish in order: wait for what is under way.
    Finish,
    /// Stop at once, as by a signal.
    Stop,
}

/// Whoever watches.
pub trait Watch {
    /// Where playing is; told now and then.
    fn at(&self, position: &Position);
    /// Something that must be said now.
    fn say(&self, words: &str);
}

/// What playing came to.
#[derive(Debug)]
pub struct Played {
    /// What was sent, and what became of it.
    pub report: PlayReport,
    /// What reading the log came to.
    pub log: LogReport,
    /// Why it ended before the log did: a signal, a log that cannot be read on, a service that has gone.
    pub ended: Result<(), Error>,
}

/// Plays a log.
///
/// # Errors
/// [`Error::Log`] for a log that cannot be opened, [`Error::Bus`] where no session can be, or the service is missing.
pub async fn play(
    options: &PlayOptions,
    commands: UnboundedReceiver<Command>,
    watch: &impl Watch,
) -> Result<Played, Error> {
    // From here on a signal ends in order.
    let mut stop = Stop::on(&[SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()])?;
    let way = options.session.way(Role::Peer)?;
    let opened = tokio::select! {
        biased;
        () = stop.asked() => return Err(Error::Stopped),
        session = way.open_patiently(options.wait, |words| watch.say(words)) => session?,
    };
    let played = {
        let mut player = Player::new(&opened, options, commands, watch)?;
        let tried = way.tried();
        let ended = tokio::select! {
            biased;
            () = stop.asked() => Err(Error::Stopped),
            ended = run(&opened, &tried, options, &mut player, watch) => ended,
        };
        let mut report = player.report(ended.is_err());
        if report.units.iter().any(UnitReport::is_doubled) {
            let reports = pair_reports(&opened, options.wait).await.unwrap_or_default();
            report.units.iter_mut().for_each(|unit| unit.note_services(&reports));
        }
        if ended.is_ok() && options.acknowledge != Acknowledge::No {
            silence::note_unknown_channels(&opened, &player.playlist.channels, &mut report).await;
        }
        Played { report, log: player.playlist.messages.report(), ended }
    };
    let closed = isotherm_bus::close(opened, CLOSE_LIMIT).await;
    // Where playing has failed, that is what counts.
    if played.ended.is_ok() {
        closed?;
    }
    Ok(played)
}

/// Plays while the service is there.
async fn run<W: Watch>(
    session: &zenoh::Session,
    tried: &str,
    options: &PlayOptions,
    player: &mut Player<'_, W>,
    watch: &W,
) -> Result<(), Error> {
    if options.acknowledge == Acknowledge::No {
        return player.run().await;
    }
    let service = ServiceWatch::declare(session).await?;
    let under_way = player.under_way();
    tokio::select! {
        biased;
        ended = player.run() => match ended {
            Err(Error::Bus(BusError::NoAcknowledgement { unit, in_flight, waited, .. })) => {
                Err(Error::Service(silence::explained(session, &unit, in_flight, waited).await))
            }
            ended => ended,
        },
        () = service.gone() => {
            Err(BusError::ServiceGone { tried: tried.to_owned() }.into())
        }
        never = silence::watch(session, &under_way, watch) => match never {},
    }
}
