//! The player: when what goes out, and its end.

mod next;
mod obey;
mod told;

use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use isotherm_bus::{BusError, Outlet, OutletOptions, presence, receipt};
use isotherm_log::faults::Departure;
use isotherm_log::part::LogFiles;
use tokio::sync::mpsc::UnboundedReceiver;
use tokio::time::{Instant, sleep_until};
use zenoh::Session;

use super::playlist::{Frame, Load, Playlist};
use super::screen::Screen;
use super::silence::Shared;
use super::units::{PlayedUnit, Units};
use super::{Acknowledge, Command, PlayOptions};
use crate::error::Error;
use crate::pace::Pacer;

/// How often the position is shown.
const SHOW: Duration = Duration::from_millis(50);

/// The turn of a message that is to go out: by time (ns), then by order.
type Turn = (i64, u64);
/// A message that is to go out: the place of its unit, and what it is.
type Leaving = (usize, Departure<Arc<Frame>>);

/// How far it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// Messages go out.
    Playing,
    /// Somebody has asked for the end: no more go out.
    Finishing,
    /// What has not come back by now does not count as under way any more.
    Waited,
}

/// Plays.
pub(super) struct Player<'a> {
    session: &'a Session,
    options: &'a PlayOptions,
    screen: &'a Screen,
    /// Whoever is at the keyboard; `None` once nobody is.
    commands: Option<UnboundedReceiver<Command>>,
    pub(super) playlist: Playlist<'a>,
    units: Units<'a>,
    under_way: Shared,
    waiting: BTreeMap<Turn, Leaving>,
    order: u64,
    /// What is due up to here has been read (ns).
    read_to: i64,
    /// There is nothing more to be read.
    read_all: bool,
    pacer: Pacer,
    /// What lies before is passed over (ns).
    from: Option<i64>,
    /// Time of the last message that went out (ns), in this pass since the last seek.
    last_at: Option<i64>,
    /// Nothing has gone out in this pass.
    idle: bool,
    /// What goes out for one message of the log; empty in between.
    out: Vec<Departure<Arc<Frame>>>,
    /// When the position was shown last.
    shown: Option<Instant>,
    paused: Option<Instant>,
    steps: u64,
    stage: Stage,
    begun: Instant,
    ended: Option<Instant>,
    played_ns: i64,
    paused_for: Duration,
    pass: u64,
    seeks: u64,
    ticks_sent: u64,
}

impl<'a> Player<'a> {
    /// Opens the log; nothing is sent.
    pub(super) fn new(
        session: &'a Session,
        options: &'a PlayOptions,
        commands: UnboundedReceiver<Command>,
        screen: &'a Screen,
    ) -> Result<Self, Error> {
        Ok(Self {
            session,
            options,
            screen,
            commands: Some(commands),
            playlist: Playlist::new(options)?,
            units: Units::new(options),
            under_way: Shared::default(),
            waiting: BTreeMap::new(),
            order: 0,
            read_to: i64::MIN,
            read_all: false,
            pacer: Pacer::new(options.speed),
            from: None,
            last_at: None,
            idle: true,
            out: Vec::new(),
            shown: None,
            paused: None,
            steps: 0,
            stage: Stage::Playing,
            begun: Instant::now(),
            ended: None,
            played_ns: 0,
            paused_for: Duration::ZERO,
            pass: 1,
            seeks: 0,
            ticks_sent: 0,
        })
    }

    /// What is under way of each unit, for those who watch.
    pub(super) fn under_way(&self) -> Shared {
        Arc::clone(&self.under_way)
    }

    /// Plays to the end.
    pub(super) async fn run(&mut self) -> Result<(), Error> {
        if self.options.acknowledge != Acknowledge::No {
            presence::wait_for_service(self.session, self.options.wait).await?;
        }
        // The units of a text log are known: they are declared before its time begins.
        if let LogFiles::Text { unit, .. } = &self.options.files {
            for place in self.units.places(unit)? {
                self.declare(place).await?;
            }
        }
        self.begun = Instant::now();
        while self.stage == Stage::Playing {
            self.obey_all()?;
            self.stay_paused().await?;
            if self.stage != Stage::Playing {
                break;
            }
            match self.next_due().await? {
                Some(next) => self.play(next).await?,
                None if self.is_over()? => break,
                None => {}
            }
        }
        self.ended = Some(Instant::now());
        self.drain().await
    }

    /// Whether nothing is left to be played; goes on to the next pass where there is one.
    fn is_over(&mut self) -> Result<bool, Error> {
        // A pass in which nothing goes out would be followed by others like it for ever.
        if self.idle || self.options.passes.is_some_and(|passes| self.pass >= passes) {
            return Ok(true);
        }
        self.pass += 1;
        self.idle = true;
        self.rewind()?;
        Ok(false)
    }

    /// Goes back to the log's beginning.
    fn rewind(&mut self) -> Result<(), Error> {
        self.playlist.rewind()?;
        self.forget();
        Ok(())
    }

    /// Forgets what is waiting, and by which time.
    fn forget(&mut self) {
        self.waiting.clear();
        self.units.all.iter_mut().for_each(PlayedUnit::begin_anew);
        (self.read_to, self.read_all) = (i64::MIN, false);
        (self.from, self.last_at) = (None, None);
        self.pacer.restart();
    }

    /// Waits until a message is due and sends it, unless somebody would rather be elsewhere by then.
    async fn play(&mut self, next: (Turn, Leaving)) -> Result<(), Error> {
        // A step does not wait for its time.
        let due = if self.steps > 0 { None } else { self.pacer.due(next.0.0) };
        if let Some(at) = due.filter(|at| *at > Instant::now()) {
            tokio::select! {
                biased;
                command = obey::command(&mut self.commands) => {
                    // Whatever is asked for, the message waits among the others for its turn.
                    self.waiting.extend([next]);
                    return self.obey(command);
                }
                () = sleep_until(at) => {}
            }
        }
        self.send(next, due).await
    }

    /// Sends a message.
    async fn send(&mut self, next: (Turn, Leaving), due: Option<Instant>) -> Result<(), Error> {
        let ((at_ns, _), (place, departure)) = next;
        let input = departure.item.input;
        let declared = self.units.all.get_mut(place).and_then(|unit| unit.outlet.as_ref());
        if declared.is_none_or(|outlet| !outlet.is_open(input)) {
            let begun = Instant::now();
            if declared.is_none() {
                self.declare(place).await?;
            }
            if let Some(outlet) = self.units.all.get_mut(place).and_then(|unit| unit.outlet.as_mut()) {
                outlet.open(input).await?;
            }
            // The log's time does not go on while topics are declared.
            self.pacer.hold(begun.elapsed());
        } else {
            self.pacer.note(due);
        }
        let Some(unit) = self.units.all.get_mut(place) else { return Ok(()) };
        let Some(outlet) = &mut unit.outlet else { return Ok(()) };
        let bytes = departure.item.bytes.clone();
        if let Load::Gyro(ticks) = departure.item.load {
            outlet.publish_gyro(bytes, ticks).await?;
            self.ticks_sent += ticks.count;
            self.steps = self.steps.saturating_sub(1);
        } else {
            outlet.publish(input, bytes).await?;
        }
        unit.counts.note(departure.item.load, departure.again, departure.held_back);
        self.played_ns += self.last_at.map_or(0, |last| at_ns.saturating_sub(last).max(0));
        self.last_at = Some(self.last_at.map_or(at_ns, |last| last.max(at_ns)));
        self.idle = false;
        if self.shown.is_none_or(|shown| shown.elapsed() >= SHOW) {
            self.show();
        }
        Ok(())
    }

    /// Subscribes to what comes back of a unit; behind the service's answer no first tick can come back unseen.
    async fn declare(&mut self, place: usize) -> Result<(), Error> {
        let max_in_flight = self.units.max_in_flight();
        let Some(unit) = self.units.all.get_mut(place) else { return Ok(()) };
        let wait = self.options.wait;
        let options = OutletOptions { max_in_flight, match_timeout: wait, acknowledge_timeout: wait };
        let outlet = Outlet::declare(self.session, &unit.unit, options).await?;
        if let Some(under_way) = outlet.under_way() {
            presence::wait_for_service_of(self.session, &unit.unit, wait).await?;
            self.under_way.lock().unwrap_or_else(PoisonError::into_inner).push(under_way);
        }
        unit.outlet = Some(outlet);
        Ok(())
    }

    /// Waits until everything has come back that will, or until others have taken it where nothing is to come back.
    async fn drain(&mut self) -> Result<(), Error> {
        if self.options.acknowledge == Acknowledge::No {
            receipt::all_taken(self.session, self.options.wait).await?;
        }
        for unit in &self.units.all {
            let Some(outlet) = &unit.outlet else { continue };
            match outlet.drain().await {
                // What came back shows that something does: the rest is lost, and counted.
                Err(BusError::NoAcknowledgement { .. })
                    if outlet.account().is_some_and(|account| account.ticks_back > 0) => {}
                drained => drained?,
            }
        }
        self.stage = Stage::Waited;
        Ok(())
    }
}
