//! Where a log was cut short, as everyone who reads it is to know.

use std::sync::{Arc, OnceLock};

use isotherm_log::recording::RecordingReport;
use isotherm_log::source::LogReport;
use isotherm_log::text::ReadReport;

/// Why reading stopped before the end of a log, once it did; the same for all copies.
#[derive(Debug, Clone, Default)]
pub struct Cut(Arc<OnceLock<String>>);

impl Cut {
    /// Takes over what reading a log came to.
    pub fn note(&self, name: &str, report: &LogReport) {
        match report {
            LogReport::Recording(RecordingReport { cut_short: Some(words), .. }) => self.recording(words),
            LogReport::Text(ReadReport { cut_short: true, .. }) => {
                let words = format!(
                    "the log is cut short, and used up to there: {name}: a compressed file is incomplete; copy it \
                     again"
                );
                self.0.get_or_init(|| words);
            }
            LogReport::Recording(_) | LogReport::Text(_) => {}
        }
    }

    /// A recording of which a reader says why it stopped.
    pub fn recording(&self, words: &str) {
        self.0.get_or_init(|| {
            format!(
                "the recording is cut short, and used up to there: {words}; isotherm-replay recover may save more"
            )
        });
    }

    /// Hands on what it knows.
    pub fn hand_on(&self, other: &Self) {
        if let Some(words) = self.words() {
            other.0.get_or_init(|| words.to_owned());
        }
    }

    /// The sentence for it.
    pub fn words(&self) -> Option<&str> {
        self.0.get().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_know_what_one_of_them_has_found() {
        let cut = Cut::default();
        let copy = cut.clone();
        cut.note("log.csv.gz", &LogReport::Text(ReadReport { skipped_rows: 3, ..ReadReport::default() }));
        assert_eq!(copy.words(), None, "rows that are passed over are no cut");
        cut.note("log.csv.gz", &LogReport::Text(ReadReport { cut_short: true, ..ReadReport::default() }));
        insta::assert_snapshot!(copy.words().unwrap());
        // The first place counts.
        copy.recording("other.mcap: ends in the middle");
        let other = Cut::default();
        cut.hand_on(&other);
        assert!(other.words().is_some_and(|words| !words.contains("other.mcap")));
    }
}
