//! What somebody at the keyboard makes of it.

use tokio::sync::mpsc::UnboundedReceiver;
use tokio::time::Instant;

use super::{Player, Stage};
use crate::error::Error;
use crate::pace::Speed;
use crate::play::Command;

impl Player<'_> {
    /// Does what somebody asked for meanwhile.
    pub(super) fn obey_all(&mut self) -> Result<(), Error> {
        while let Some(Ok(command)) = self.commands.as_mut().map(UnboundedReceiver::try_recv) {
            self.obey(command)?;
        }
        Ok(())
    }

    /// Waits for commands while playing is paused and no step is asked for.
    pub(super) async fn stay_paused(&mut self) -> Result<(), Error> {
        while self.paused.is_some() && self.steps == 0 && self.stage == Stage::Playing {
            self.show();
            let command = command(&mut self.commands).await;
            self.obey(command)?;
        }
        Ok(())
    }

    /// Does what somebody asks for.
    pub(super) fn obey(&mut self, command: Command) -> Result<(), Error> {
        match command {
            Command::Pause => self.pause(self.paused.is_none()),
            Command::Step => {
                self.pause(true);
                self.steps += 1;
            }
            Command::StepOrForward if self.paused.is_some() => self.steps += 1,
            Command::StepOrForward => self.seek(10.0)?,
            Command::Seek(seconds) => self.seek(seconds)?,
            Command::Faster => self.set_speed(self.pacer.speed().faster()),
            Command::Slower => self.set_speed(self.pacer.speed().slower()),
            Command::Finish => self.stage = Stage::Finishing,
            Command::Stop => return Err(Error::Stopped),
        }
        self.show();
        Ok(())
    }

    fn pause(&mut self, pause: bool) {
        match self.paused {
            Some(since) if !pause => {
                self.paused_for += since.elapsed();
                self.paused = None;
                self.pacer.restart();
            }
            None if pause => self.paused = Some(Instant::now()),
            _ => {}
        }
    }

    fn set_speed(&mut self, speed: Speed) {
        self.pacer.set_speed(speed);
        // The rest of a wait counts from the last message.
        if let Some(last) = self.last_at {
            self.pacer.due(last);
        }
    }

    /// Goes on elsewhere in the log: further on, in the same series; back, in a new one.
    fn seek(&mut self, seconds: f64) -> Result<(), Error> {
        let here = self.last_at.or(self.from).unwrap_or(0);
        #[expect(clippy::cast_possible_truncation, reason = "some seconds")]
        let there = here.saturating_add((seconds * 1e9) as i64).max(0);
        if there < here {
            self.rewind()?;
        } else {
            // What has been read already and goes out later than that is not read again.
            let later = self.waiting.split_off(&(there, 0));
            self.forget();
            self.waiting = later;
        }
        self.from = Some(there);
        self.seeks += 1;
        Ok(())
    }
}

/// The next command; never, once nobody can give one.
pub(super) async fn command(commands: &mut Option<UnboundedReceiver<Command>>) -> Command {
    if let Some(receiver) = commands {
        if let Some(command) = receiver.recv().await {
            return command;
        }
        *commands = None;
    }
    std::future::pending().await
}
