//! The terminal: taken, drawn on, and given back whatever happens.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ratatui::crossterm::event::{self, Event};
use ratatui::{DefaultTerminal, Frame};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

/// How long the reading thread may go on after the end.
const POLL: Duration = Duration::from_millis(100);

/// The terminal in its raw mode, on its alternate screen; as it was before once this is dropped.
///
/// A panic gives it back first, so that its words can be read.
#[derive(Debug)]
pub(super) struct Screen {
    terminal: DefaultTerminal,
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

    /// Draws it anew.
    pub(super) fn draw(&mut self, drawn: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        self.terminal.draw(drawn).map(|_| ())
    }

    /// Wipes away what others have written on it.
    pub(super) fn clear(&mut self) -> io::Result<()> {
        self.terminal.clear()
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
pub(super) struct Keys {
    events: UnboundedReceiver<io::Result<Event>>,
    ended: Arc<AtomicBool>,
}

impl Keys {
    /// Begins to read.
    pub(super) fn read() -> Self {
        let (sender, events) = unbounded_channel();
        let ended = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&ended);
        std::thread::spawn(move || {
            while !is_over.load(Ordering::Relaxed) {
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
        Self { events, ended }
    }

    /// The next one.
    pub(super) async fn next(&mut self) -> io::Result<Event> {
        let ended = || Err(io::Error::new(io::ErrorKind::UnexpectedEof, "no more keys come"));
        self.events.recv().await.unwrap_or_else(ended)
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
    }
}
