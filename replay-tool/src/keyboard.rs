//! Keys pressed while a log is played.

use std::io::{IsTerminal, stderr, stdin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use crossterm::terminal;
use tokio::sync::mpsc::UnboundedSender;

use crate::play::Command;

/// What the keys do, in a line.
pub(crate) const KEYS: &str = "space pause · n or → step · + - speed · ← → or [ ] seek 10 s · q quit";
/// How long the end of listening may take.
const LOOK: Duration = Duration::from_millis(50);

/// Listens to the keyboard. While it does, the terminal gives out every key at once; dropped, it is as it was.
#[derive(Debug)]
pub(crate) struct Keyboard {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Keyboard {
    /// Begins to listen; `None` where nobody sits there: input or standard error is no terminal.
    #[must_use]
    pub(crate) fn listen(commands: UnboundedSender<Command>) -> Option<Self> {
        if !(stdin().is_terminal() && stderr().is_terminal()) {
            return None;
        }
        terminal::enable_raw_mode().ok()?;
        let mut keyboard = Self { over: Arc::default(), thread: None };
        let over = Arc::clone(&keyboard.over);
        let listen = move || {
            while !over.load(Ordering::Relaxed) {
                match event::poll(LOOK) {
                    Ok(false) => {}
                    Ok(true) => {
                        let command = event::read().ok().and_then(|event| command(&event));
                        if command.is_some_and(|command| commands.send(command).is_err()) {
                            return;
                        }
                    }
                    Err(_) => return,
                }
            }
        };
        keyboard.thread = std::thread::Builder::new().name("keyboard".to_owned()).spawn(listen).ok();
        Some(keyboard)
    }
}

impl Drop for Keyboard {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        // The terminal is given back whatever became of the thread.
        let _ = self.thread.take().map(JoinHandle::join);
        let _ = terminal::disable_raw_mode();
    }
}

/// What a key asks for.
fn command(event: &Event) -> Option<Command> {
    let Event::Key(KeyEvent { code, modifiers, kind: KeyEventKind::Press | KeyEventKind::Repeat, .. }) =
        event
    else {
        return None;
    };
    if modifiers.contains(KeyModifiers::CONTROL) {
        return matches!(code, KeyCode::Char('c')).then_some(Command::Stop);
    }
    Some(match code {
        KeyCode::Char(' ') => Command::Pause,
        KeyCode::Char('n') => Command::Step,
        KeyCode::Right => Command::StepOrForward,
        KeyCode::Left | KeyCode::Char('[') => Command::Seek(-10.0),
        KeyCode::Char(']') => Command::Seek(10.0),
        KeyCode::Char('+' | '=') => Command::Faster,
        KeyCode::Char('-' | '_') => Command::Slower,
        KeyCode::Char('q') => Command::Finish,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_what_they_ask_for() {
        let key = |code| Event::Key(KeyEvent::new(code, KeyModifiers::NONE));
        let table = [
            (KeyCode::Char(' '), Some(Command::Pause)),
            (KeyCode::Char('n'), Some(Command::Step)),
            (KeyCode::Right, Some(Command::StepOrForward)),
            (KeyCode::Left, Some(Command::Seek(-10.0))),
            (KeyCode::Char('['), Some(Command::Seek(-10.0))),
            (KeyCode::Char(']'), Some(Command::Seek(10.0))),
            (KeyCode::Char('+'), Some(Command::Faster)),
            (KeyCode::Char('-'), Some(Command::Slower)),
            (KeyCode::Char('q'), Some(Command::Finish)),
            (KeyCode::Char('c'), None),
            (KeyCode::Tab, None),
        ];
        for (code, expected) in table {
            assert_eq!(command(&key(code)), expected, "{code:?}");
        }
        let interrupt = Event::Key(KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL));
        assert_eq!(command(&interrupt), Some(Command::Stop));
    }
}
