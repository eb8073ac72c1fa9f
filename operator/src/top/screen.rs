//! The terminal: taken, drawn on, and given back whatever happens.

use std::io;
use std::time::Duration;

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

/// How long the reading thread may go on after the end.
const POLL: Duration = Duration::from_millis(100);

/// The terminal in its raw mode, on its alternate screen; as it was before once this is dropped.
///
/// A panic gives it back first, so that its words can be read.
#[derive(Debug)]
pub(super) struct Screen {
    pub(super) terminal: DefaultTerminal,
}

impl Screen {
    /// Takes the terminal.
    pub(super) fn open() -> io::Result<Self> {
        match ratatui::try_init() {
            Ok(terminal) => Ok(Self { terminal }),
            Err(error) => {
                // It may have been taken half.
                let _ = ratatui::try_restore();
                Err(error)
            }
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A panic has given it back already; a second time would write over its words.
        if !std::thread::panicking() {
            // Where the terminal is gone there is nothing to give back.
            let _ = ratatui::try_restore();
        }
    }
}

/// Keys and changes of size, read on a thread of their own.
#[derive(Debug)]
pub(super) struct Keys(UnboundedReceiver<io::Result<Event>>);

impl Keys {
    /// Begins to read.
    pub(super) fn read() -> Self {
        let (sender, events) = unbounded_channel();
        std::thread::spawn(move || {
            while !sender.is_closed() {
                let event = match event::poll(POLL) {
                    Ok(false) => continue,
                    Ok(true) => event::read(),
                    Err(error) => Err(error),
                };
                let failed = event.is_err();
                if sender.send(event).is_err() || failed {
                    return;
                }
            }
        });
        Self(events)
    }

    /// The next one.
    pub(super) async fn next(&mut self) -> io::Result<Event> {
        let ended = || Err(io::Error::new(io::ErrorKind::UnexpectedEof, "no more keys come"));
        self.0.recv().await.unwrap_or_else(ended)
    }
}
