//! Faults of the input and of the service itself: counted by kind, logged once per kind.

use isotherm_protocol::codec::CodecError;
use isotherm_protocol::status::Counter;

/// Declares the kinds once, so that kind, counter name and documentation cannot drift apart.
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal,)+) => {
        /// Kind of a fault.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum FaultKind {
            $($(#[$doc])* $kind,)+
        }

        impl FaultKind {
            /// All kinds.
            pub const ALL: &[Self] = &[$(Self::$kind,)+];

            /// Name of its counter.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$kind => $name,)+ }
            }
        }
    };
}

kinds! {
    /// Too short or too long to be a frame.
    Length = "bad_frames_length",
    /// Another kind of message than the key promises.
    Kind = "bad_frames_kind",
    /// A version that is not known.
    Version = "bad_frames_version",
    /// The checksum does not fit the bytes.
    Checksum = "bad_frames_checksum",
    /// The body does not decode, or its parts contradict each other.
    Body = "bad_frames_body",
    /// A raw key whose last chunk names no stream.
    UnknownStream = "unknown_stream",
    /// A key whose unit chunk is no serial.
    BadSerial = "bad_serial",
    /// A deletion instead of a message.
    Deletion = "deletions",
    /// A further unit beyond the limit.
    TooManyUnits = "units_refused",
    /// Corrected ticks that could not be published.
    Unpublished = "ticks_unpublished",
    /// An event thought impossible inside one unit's processing; the unit was reset.
    Alarm = "alarms",
}

impl From<&CodecError> for FaultKind {
    fn from(error: &CodecError) -> Self {
        match error {
            CodecError::Length { .. } => Self::Length,
            CodecError::Kind { .. } => Self::Kind,
            CodecError::Version { .. } => Self::Version,
            CodecError::Checksum { .. } => Self::Checksum,
            _ => Self::Body,
        }
    }
}

/// Counts faults and remembers the last one in words.
#[derive(Debug, Clone, Default)]
pub struct FaultLog {
    counts: [u64; FaultKind::ALL.len()],
    last: Option<String>,
}

impl FaultLog {
    /// Counts `count` faults of a kind; `true` for the first of its kind, which is the one to be logged.
    pub fn note(&mut self, kind: FaultKind, count: u64, words: impl FnOnce() -> String) -> bool {
        let Some(counter) = self.counts.get_mut(kind as usize) else { return false };
        let first = *counter == 0;
        *counter += count;
        // The words of a repeated fault are not made anew: a flood of bad messages must stay cheap.
        if first {
            self.last = Some(words());
        }
        first
    }

    /// How many of a kind.
    #[must_use]
    pub fn count(&self, kind: FaultKind) -> u64 {
        self.counts.get(kind as usize).copied().unwrap_or(0)
    }

    /// Messages that were refused, of whatever kind.
    #[must_use]
    pub fn refused(&self) -> u64 {
        let own = [FaultKind::Unpublished, FaultKind::Alarm];
        FaultKind::ALL.iter().filter(|kind| !own.contains(kind)).map(|kind| self.count(*kind)).sum()
    }

    /// The last fault of a kind not seen before, in words.
    #[must_use]
    pub fn last(&self) -> Option<&str> {
        self.last.as_deref()
    }

    /// The kinds that occurred, as counters.
    pub fn counters(&self) -> impl Iterator<Item = Counter> + '_ {
        let occurred = FaultKind::ALL.iter().filter(|kind| self.count(**kind) > 0);
        occurred.map(|kind| Counter { name: kind.name().to_owned(), value: self.count(*kind) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repeated_fault_is_counted_and_not_repeated() {
        let mut log = FaultLog::default();
        assert!(log.note(FaultKind::Checksum, 1, || "first".to_owned()));
        assert!(!log.note(FaultKind::Checksum, 1, || unreachable!()));
        assert!(log.note(FaultKind::Unpublished, 5, || "second".to_owned()));
        assert_eq!((log.count(FaultKind::Checksum), log.refused()), (2, 2));
        assert_eq!(log.last(), Some("second"));
        let counters: Vec<_> = log.counters().map(|counter| (counter.name, counter.value)).collect();
        assert_eq!(counters, [("bad_frames_checksum".to_owned(), 2), ("ticks_unpublished".to_owned(), 5)]);
    }

    #[test]
    fn kinds_index_their_own_counter() {
        for (index, kind) in FaultKind::ALL.iter().enumerate() {
            assert_eq!(*kind as usize, index, "{}", kind.name());
        }
    }
}
