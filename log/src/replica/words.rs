//! Entries of a journal in words.

use isotherm_correction::units::Span;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::digest::Digits;
use isotherm_protocol::journal::{JournalEntry, JournalEvent};

/// An entry in one line, without the texts in it.
#[must_use]
pub fn entry_words(entry: &JournalEntry) -> String {
    format!("entry {}: {}", entry.number, event_words(&entry.event))
}

fn event_words(event: &JournalEvent) -> String {
    match event {
        JournalEvent::Began { highest_revision: 0, .. } => "the unit began".to_owned(),
        JournalEvent::Began { highest_revision, .. } => {
            format!("the unit began, after revision {highest_revision}")
        }
        JournalEvent::Memory { memory, .. } => format!("memory of the service, {} bytes", memory.len()),
        JournalEvent::Changed { revision, at, slew_ns, overlay, source, .. } => {
            let when = match at {
                Schedule::NextTick => "from the next tick on".to_owned(),
                Schedule::Sequence(sequence) => format!("from tick {sequence} on"),
                Schedule::TimeNs(time_ns) => format!("from the tick that ends at {time_ns} ns on"),
            };
            let slewed = match slew_ns {
                0 => String::new(),
                slew_ns => format!(", over {} s", Span::from_ns(*slew_ns).as_s()),
            };
            let overlay = if overlay.is_some() { ", with an overlay" } else { "" };
            let source = if source.is_empty() { String::new() } else { format!(", {source}") };
            let digits = Digits(&revision.digest);
            format!("swap to revision {} ({digits}) {when}{slewed}{overlay}{source}", revision.counter)
        }
        JournalEvent::Commanded { command, accepted, words } => {
            let became = if *accepted { "accepted" } else { "refused" };
            format!("command {} {became}: {words}", command.name())
        }
        JournalEvent::Flushed => "flushed: the stream had stopped".to_owned(),
        JournalEvent::SelfTestExpired => "the self-test got no more ticks and ended".to_owned(),
        JournalEvent::PreLaunchEnded => "the pre-launch calibration got no more ticks and ended".to_owned(),
        JournalEvent::Ended => "the service stopped".to_owned(),
    }
}
