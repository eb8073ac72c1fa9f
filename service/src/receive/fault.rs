//! Faults of the input and of the service itself: counted by kind; the first of a kind is logged, and then their number.

use std::time::{Duration, Instant};

use isotherm_operator::status::unix_ms;
use isotherm_protocol::codec::CodecError;
use isotherm_protocol::escape::shown;
use isotherm_protocol::status::{Counter, Fault};
use thiserror::Error;

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
    /// Entries of the unit's journal that could not be published.
    JournalUnpublished = "journal_entries_unpublished",
    /// Corrected ticks of which another instance has computed other bits.
    OtherBits = "instances_disagree",
    /// Units whose corrected ticks two services publish that are no pair.
    TwoSpeak = "two_services",
    /// Units that two producers seem to publish.
    TwoProducers = "two_producers",
    /// Ticks that the calibration in force cannot take: another number of readings, or another kind.
    Unfit = "ticks_unfit",
    /// An event thought impossible inside one unit's processing; the unit was reset.
    Alarm = "alarms",
}

impl FaultKind {
    /// Whether a message was refused.
    pub(crate) fn is_refusal(self) -> bool {
        use FaultKind as K;

        !matches!(
            self,
            K::Unpublished
                | K::JournalUnpublished
                | K::Alarm
                | K::OtherBits
                | K::TwoSpeak
                | K::TwoProducers
                | K::Unfit
        )
    }

    /// Those that units count; the others belong to the service.
    pub fn of_units() -> impl Iterator<Item = Self> {
        use FaultKind as K;

        let of_service = |kind: &Self| {
            matches!(
                kind,
                K::UnknownStream | K::BadSerial | K::Deletion | K::TooManyUnits | K::OtherBits | K::TwoSpeak
            )
        };
        Self::ALL.iter().copied().filter(move |kind| !of_service(kind))
    }
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

/// How long a fault that goes on is counted in silence.
const SILENCE: Duration = Duration::from_secs(60);

/// What is to be logged of a fault.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum Telling {
    /// The first of its kind, in words.
    #[error("{0}; further ones are only counted")]
    First(String),
    /// It goes on.
    #[error("{count} more in the last {} s", since.as_secs())]
    Again {
        /// How many since it was last told of.
        count: u64,
        /// How long ago that was.
        since: Duration,
    },
}

/// One kind of fault so far.
#[derive(Debug, Clone, Default)]
struct Kind {
    count: u64,
    first: String,
    /// Time of the last one by the service's clock.
    last_unix_ms: i64,
    /// When it was last told of, and how many there were then.
    told: Option<(Instant, u64)>,
}

/// Counts faults and remembers the first of each kind in words.
#[derive(Debug, Clone, Default)]
pub(crate) struct FaultLog {
    /// None before the first fault, for most units have none; then every kind.
    kinds: Vec<Kind>,
    last: Option<FaultKind>,
}

impl FaultLog {
    /// Counts `count` faults of a kind; what is to be logged of it: the first one, and while it goes on the number of
    /// further ones once a minute.
    pub(crate) fn note(
        &mut self,
        kind: FaultKind,
        count: u64,
        words: impl FnOnce() -> String,
    ) -> Option<Telling> {
        self.note_at(Instant::now(), kind, count, words)
    }

    fn note_at(
        &mut self,
        now: Instant,
        kind: FaultKind,
        count: u64,
        words: impl FnOnce() -> String,
    ) -> Option<Telling> {
        if self.kinds.is_empty() {
            self.kinds = vec![Kind::default(); FaultKind::ALL.len()];
        }
        let entry = self.kinds.get_mut(kind as usize)?;
        entry.count += count;
        entry.last_unix_ms = unix_ms();
        let Some((told, before)) = entry.told else {
            // The words of a repeated fault are not made anew: a flood of bad messages must stay cheap.
            // Words may quote what came in.
            entry.first = shown(&words());
            entry.told = Some((now, entry.count));
            self.last = Some(kind);
            return Some(Telling::First(entry.first.clone()));
        };
        let since = now.saturating_duration_since(told);
        (since >= SILENCE).then(|| {
            entry.told = Some((now, entry.count));
            Telling::Again { count: entry.count - before, since }
        })
    }

    /// How many of a kind.
    pub(crate) fn count(&self, kind: FaultKind) -> u64 {
        self.kinds.get(kind as usize).map_or(0, |kind| kind.count)
    }

    /// Messages that were refused, of whatever kind.
    pub(crate) fn refused(&self) -> u64 {
        FaultKind::ALL.iter().filter(|kind| kind.is_refusal()).map(|kind| self.count(*kind)).sum()
    }

    /// The last fault of a kind not seen before, in words.
    pub(crate) fn last(&self) -> Option<&str> {
        let kind = self.kinds.get(self.last? as usize)?;
        Some(&kind.first)
    }

    /// The kinds that occurred, each with the first of its kind in words.
    pub(crate) fn faults(&self) -> Vec<Fault> {
        let occurred = FaultKind::ALL.iter().zip(&self.kinds).filter(|(_, entry)| entry.count > 0);
        let fault = |(kind, entry): (&FaultKind, &Kind)| Fault {
            kind: kind.name().to_owned(),
            count: entry.count,
            first: entry.first.clone(),
            last_unix_ms: entry.last_unix_ms,
        };
        occurred.map(fault).collect()
    }

    /// The kinds that occurred, as counters.
    pub(crate) fn counters(&self) -> impl Iterator<Item = Counter> + '_ {
        let occurred = FaultKind::ALL.iter().filter(|kind| self.count(**kind) > 0);
        occurred.map(|kind| Counter { name: kind.name().to_owned(), value: self.count(*kind) })
    }
}

/// A fault that is there now and stays until somebody does something about it.
pub(crate) fn standing(kind: &str, count: u64, words: String) -> Fault {
    Fault { kind: kind.to_owned(), count, first: words, last_unix_ms: unix_ms() }
}

/// The fault of a kind, if there is one.
pub(crate) fn of_kind<'f>(faults: &'f [Fault], kind: &str) -> Option<&'f Fault> {
    faults.iter().find(|fault| fault.kind == kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repeated_fault_is_counted_and_not_repeated() {
        let mut log = FaultLog::default();
        let first = log.note(FaultKind::Checksum, 1, || "first".to_owned());
        assert_eq!(first, Some(Telling::First("first".to_owned())));
        assert_eq!(log.note(FaultKind::Checksum, 1, || unreachable!()), None);
        assert!(log.note(FaultKind::Unpublished, 5, || "second".to_owned()).is_some());
        assert_eq!((log.count(FaultKind::Checksum), log.refused()), (2, 2));
        assert_eq!(log.last(), Some("second"));
        let counters: Vec<_> = log.counters().map(|counter| (counter.name, counter.value)).collect();
        assert_eq!(counters, [("bad_frames_checksum".to_owned(), 2), ("ticks_unpublished".to_owned(), 5)]);
        let faults = log.faults();
        assert_eq!((faults.len(), faults[0].first.as_str(), faults[0].count), (2, "first", 2));
    }

    #[test]
    fn a_fault_that_goes_on_is_told_with_its_number_once_a_minute() {
        let mut log = FaultLog::default();
        let start = Instant::now();
        let mut at =
            |s| log.note_at(start + Duration::from_secs(s), FaultKind::Body, 1, || "words".to_owned());
        assert!(at(0).is_some());
        assert!((1..60).all(|s| at(s).is_none()));
        assert_eq!(at(60), Some(Telling::Again { count: 60, since: SILENCE }));
        assert!((61..120).all(|s| at(s).is_none()));
        insta::assert_snapshot!(at(120).unwrap());
    }

    #[test]
    fn kinds_index_their_own_counter() {
        for (index, kind) in FaultKind::ALL.iter().enumerate() {
            assert_eq!(*kind as usize, index, "{}", kind.name());
        }
    }
}
