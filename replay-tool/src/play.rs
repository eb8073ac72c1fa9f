//! Playing a log to the raw topics of its units.

mod player;
mod playlist;
mod report;
mod screen;
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

pub(crate) use report::{PlayReport, UnitReport};
pub(crate) use screen::Screen;

/// How long a session may take to close.
const CLOSE_LIMIT: Duration = Duration::from_secs(5);

/// What is played, and how.
#[derive(Debug, Clone)]
pub(crate) struct PlayOptions {
    /// The log.
    pub(crate) files: LogFiles,
    /// Which part of it.
    pub(crate) part: Part,
    /// Keys of the messages that are taken, any of them; all where there is none.
    pub(crate) topics: Vec<OwnedKeyExpr>,
    /// By which clock.
    pub(crate) clock: Clock,
    /// How fast.
    pub(crate) speed: Speed,
    /// How often the part is played; `None` is for ever.
    pub(crate) passes: Option<u64>,
    /// Units that are played as others: serial in the log, serial on the bus.
    pub(crate) names: BTreeMap<UnitId, UnitId>,
    /// Each unit is played as so many, `SERIAL-001` and so on; `None` is as itself.
    pub(crate) copies: Option<u32>,
    /// What happens to messages on their way.
    pub(crate) faults: FaultOptions,
    /// Where all chance comes from.
    pub(crate) seed: u64,
    /// Number of the first series; `None` is one that no player had before.
    pub(crate) series: Option<u64>,
    /// What the instruments of a text log are to report of themselves, once a second of event time.
    pub(crate) health: Vec<HealthReading>,
    /// How the session is opened.
    pub(crate) session: ClientOptions,
    /// How long to wait for service and subscribers, and for what comes back.
    pub(crate) wait: Duration,
    /// Whether and how far playing is bounded by what comes back.
    pub(crate) acknowledge: Acknowledge,
}

/// Whether and how far playing is bounded by what comes back corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Acknowledge {
    /// Not at all: for listeners other than the service.
    No,
    /// At most so many gyro ticks of a unit are sent and not come back; `None` is by the number of units.
    Bounded(Option<u64>),
}

/// What somebody at the keyboard asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Command {
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

/// What playing came to.
#[derive(Debug)]
pub(crate) struct Played {
    /// What was sent, and what became of it.
    pub(crate) report: PlayReport,
    /// What reading the log came to.
    pub(crate) log: LogReport,
    /// Why it ended before the log did: a signal, a log that cannot be read on, a service that has gone.
    pub(crate) ended: Result<(), Error>,
}

/// Plays a log.
///
/// # Errors
/// [`Error::Log`] for a log that cannot be opened, [`Error::Bus`] where no session can be, or the service is missing.
pub(crate) async fn play(
    options: &PlayOptions,
    commands: UnboundedReceiver<Command>,
    screen: &Screen,
) -> Result<Played, Error> {
    // From here on a signal ends in order.
    let mut stop = Stop::on(&[SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()])?;
    let way = options.session.way(Role::Peer)?;
    let opened = tokio::select! {
        biased;
        () = stop.asked() => return Err(Error::Stopped),
        session = way.open_patiently(options.wait, |words| screen.say(words)) => session?,
    };
    let played = {
        let mut player = Player::new(&opened, options, commands, screen)?;
        let tried = way.tried();
        let ended = tokio::select! {
            biased;
            () = stop.asked() => Err(Error::Stopped),
            ended = run(&opened, &tried, options, &mut player, screen) => ended,
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
async fn run(
    session: &zenoh::Session,
    tried: &str,
    options: &PlayOptions,
    player: &mut Player<'_>,
    screen: &Screen,
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
        never = silence::watch(session, &under_way, screen) => match never {},
    }
}
