//! What operators ask, and what is written down of it.

use isotherm_document::escape::shown;
use isotherm_protocol::control::{CommandOrder, MAX_BY, SwapOptions};
use isotherm_protocol::history::{AuditEntry, LineError};

use crate::said::in_few_words;

/// Lines of an audit file, and what JSON has of them: an entry is written as a line that is whole and says the same.
pub fn audit(input: &[u8]) {
    for line in input.split_inclusive(|byte| *byte == b'\n').take(16) {
        match AuditEntry::from_line(line) {
            Ok(entry) => {
                assert!(AuditEntry::is_whole(line));
                written_again(&entry);
            }
            Err(error) => in_few_words(&error),
        }
        if let Ok(entry) = serde_json::from_slice(line) {
            written_again(&entry);
        }
    }
}

fn written_again(entry: &AuditEntry) {
    // For people; the whole of it may be as long as its texts.
    assert!(!shown(entry).contains('\n'));
    match entry.to_line() {
        Ok(line) => {
            assert!(line.ends_with('\n') && line.matches('\n').count() == 1);
            assert!(AuditEntry::is_whole(line.as_bytes()));
            assert_eq!(AuditEntry::from_line(line.as_bytes()).as_ref(), Ok(entry));
            // Cut off in mid-write, it is none.
            let cut = line.len() / 2;
            assert!(!AuditEntry::is_whole(line.as_bytes().get(..cut).unwrap_or_default()));
        }
        Err(LineError::Length { .. }) => {}
        Err(error) => assert!(error.to_string().is_empty(), "not written: {error}"),
    }
}

/// A command: what is taken says the same when it is written.
pub fn command(input: &[u8]) {
    match CommandOrder::read(input) {
        Ok(order) => {
            assert!(order.by.chars().count() <= MAX_BY && !order.by.chars().any(char::is_control));
            let json = serde_json::to_vec(&order).expect("what is read can be written");
            assert_eq!(CommandOrder::read(&json).as_ref(), Ok(&order));
        }
        Err(words) => in_few_words(&words),
    }
}

/// The parameters of a swap: likewise.
pub fn selector(input: &[u8]) {
    let Ok(parameters) = str::from_utf8(input) else { return };
    match SwapOptions::parse(parameters) {
        Ok(options) => {
            let written = options.to_parameters();
            assert_eq!(SwapOptions::parse(&written).as_ref(), Ok(&options), "{written}");
        }
        Err(error) => in_few_words(&error),
    }
}
