//! One unit of a recording on its way through a replica: corrected ticks out, in the form that is asked for.

use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Timestamp;
use isotherm_protocol::codec;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::journal::{JournalEntry, JournalEvent, split};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::{UnitStream, unfit};
use serde::Serialize;

use super::published::{Published, RawEnd};
use super::rows::{write_frame, write_tick};
use super::sums::{Summary, Sums};
use super::{counters, troubles};
use crate::diff::{Account, Comparison, DiffOptions, LogTick, Side};
use crate::message::{Message, Topic};
use crate::replica::{Changes, Done, Outline, Replica, ReplicaReport, entry_words};

/// Most corrected ticks that are left with the stream.
const MOST_READY: usize = 4096;

/// What is made of corrected ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Nothing but their sums.
    Sums,
    /// Rows of a CSV.
    Csv,
    /// Frames of the wire, each behind its length.
    Wire,
    /// Messages of a recording, with what the journal says between them.
    Messages,
}

/// What a unit is corrected by.
#[derive(Debug, Clone)]
pub enum Basis {
    /// Its journal.
    Journal {
        /// Where its entries stand.
        outline: Outline,
        /// What is to be other than in the service.
        changes: Changes,
    },
    /// Settings and a calibration that were given.
    Given {
        /// The settings.
        settings: UnitSettings,
        /// The calibration.
        calibration: Option<super::Loaded>,
    },
}

/// One unit that is to be corrected.
#[derive(Debug, Clone)]
pub struct UnitPlan {
    /// The unit.
    pub id: UnitId,
    /// What it is corrected by.
    pub basis: Basis,
    /// Whether its ticks are compared with those that the recording has of the service.
    pub compare: bool,
}

/// What has been made of a part of a unit's ticks.
#[derive(Debug, Default)]
pub struct Output {
    /// Rows or frames.
    pub bytes: Vec<u8>,
    /// Messages.
    pub messages: Vec<Message>,
    /// Documents that the journal has, and their SHA-256.
    pub documents: Vec<(Digest, String)>,
    /// Raw ticks in it.
    pub ticks: u64,
}

impl Output {
    /// Takes what is ready, as rows or frames; `frame` is a place to make them in.
    fn give_out(&mut self, stream: &mut UnitStream, form: Form, frame: &mut Vec<u8>) {
        // Writing to a vector does not fail.
        if form == Form::Wire {
            while stream.next_frame(frame).is_some() {
                let _ = write_frame(&mut self.bytes, frame);
            }
        } else if form == Form::Csv {
            let mut ticks = stream.ready().ticks().iter();
            let _ = ticks.try_for_each(|tick| write_tick(&mut self.bytes, tick));
        }
        stream.drop_ready();
    }
}

/// What correcting a unit came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnitReport {
    /// Serial of the unit.
    pub unit: UnitId,
    /// Whether its journal was followed.
    pub by_journal: bool,
    /// Figures of the corrected ticks.
    #[serde(flatten)]
    pub summary: Summary,
    /// Counters of the unit that are not zero.
    pub counters: std::collections::BTreeMap<String, u64>,
    /// What the unit has refused or passed over, in words, where no journal says what the service did.
    #[serde(skip)]
    pub troubles: Vec<String>,
    /// What became of the journal.
    pub replica: ReplicaReport,
    /// How the ticks compare with those that the service published.
    pub published: Option<Account>,
}

impl UnitReport {
    /// Whether anything was lost, or is other than the service had it.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        // What the service refused too is no loss here.
        let is_unfit =
            !self.by_journal && unfit::COUNTERS.iter().any(|name| self.counters.contains_key(*name));
        (is_unfit && self.unanswered() > 0)
            || !self.replica.is_exact()
            || self.published.as_ref().is_some_and(|account| !account.agrees())
    }

    /// Gyro ticks that went in and did not come out, those among them that came twice or too late.
    #[must_use]
    pub fn unanswered(&self) -> u64 {
        let count = |name: &str| self.counters.get(name).copied().unwrap_or(0);
        count("gyro_ticks_in").saturating_sub(count("ticks_out"))
    }
}

/// A unit at work.
#[derive(Debug)]
pub(super) struct UnitWork {
    replica: Replica,
    by_journal: bool,
    published: Published,
    raw_end: RawEnd,
    taker: Taker,
}

/// Takes corrected ticks from the stream.
#[derive(Debug)]
struct Taker {
    id: UnitId,
    form: Form,
    /// Ticks that were made of messages received before are not given out (ns since 1970-01-01 UTC).
    from_ns: u64,
    received_ns: u64,
    sums: Sums,
    comparison: Option<Comparison>,
    /// End of the last tick.
    made: Option<Timestamp>,
    /// What the journal said since the last tick.
    event: Option<Box<str>>,
    output: Output,
    frame: Vec<u8>,
}

impl UnitWork {
    pub(super) fn new(plan: UnitPlan, form: Form, from_ns: u64) -> Self {
        let UnitPlan { id, basis, compare } = plan;
        let by_journal = matches!(basis, Basis::Journal { .. });
        let replica = match basis {
            Basis::Journal { outline, changes } => Replica::new(id.clone(), outline, changes),
            Basis::Given { settings, calibration } => {
                Replica::without_journal(id.clone(), settings, calibration.as_ref())
            }
        };
        let taker = Taker {
            id,
            form,
            from_ns,
            received_ns: 0,
            sums: Sums::default(),
            comparison: compare.then(|| Comparison::new(DiffOptions::default(), false)),
            made: None,
            event: None,
            output: Output::default(),
            frame: Vec::new(),
        };
        Self { replica, by_journal, published: Published::default(), raw_end: RawEnd::default(), taker }
    }

    /// Takes a message of the unit.
    pub(super) fn take(&mut self, message: Message) {
        if let (Topic::Corrected(_), Some(_)) = (&message.topic, &self.taker.comparison) {
            self.published.push(message.frame.clone());
        }
        if let (Topic::Raw(_, stream), Some(_)) = (&message.topic, &self.taker.comparison) {
            self.raw_end.note(*stream, &message.frame);
        }
        self.replica.take(message);
        self.go_on();
    }

    fn go_on(&mut self) {
        let Self { replica, taker, published, .. } = self;
        while let Some(done) = replica.step(&mut |stream| taker.take(stream)) {
            taker.note(&done);
            let Some(stream) = replica.stream_mut() else { continue };
            // What was made before the part is given out to nobody, tick by tick. And frames that waited for an entry are many.
            let many = stream.ready().len() >= MOST_READY;
            if many || taker.received_ns < taker.from_ns {
                taker.take(stream);
            }
            if many && let Some(comparison) = &mut taker.comparison {
                published.compare(comparison, false);
            }
        }
    }

    /// What has been made since it was last asked.
    pub(super) fn output(&mut self) -> Output {
        let Self { replica, taker, published, .. } = self;
        if let Some(stream) = replica.stream_mut() {
            taker.take(stream);
        }
        if let Some(comparison) = &mut taker.comparison {
            published.compare(comparison, false);
        }
        std::mem::take(&mut taker.output)
    }

    /// The log is over.
    pub(super) fn finish(&mut self) {
        self.replica.finish();
        self.go_on();
    }

    pub(super) fn report(mut self) -> UnitReport {
        if let Some(comparison) = &mut self.taker.comparison {
            self.published.compare(comparison, true);
        }
        UnitReport {
            unit: self.taker.id,
            by_journal: self.by_journal,
            summary: self.taker.sums.summary(),
            counters: self.replica.stream().into_iter().flat_map(counters).collect(),
            troubles: self
                .replica
                .stream()
                .filter(|_| !self.by_journal)
                .map_or_else(Vec::new, |s| troubles(s, 0)),
            replica: self.replica.report().clone(),
            published: self.taker.comparison.map(|comparison| {
                comparison.finish_with(|end_time| self.raw_end.reaches(end_time, self.taker.made))
            }),
        }
    }
}

impl Taker {
    /// Takes what is ready.
    fn take(&mut self, stream: &mut UnitStream) {
        if stream.ready().is_empty() {
            return;
        }
        if let Some(comparison) = &mut self.comparison {
            self.made = stream.ready().ticks().last().map(|tick| tick.end_time);
            for tick in stream.ready().ticks() {
                let event = self.event.take();
                comparison.push(Side::A, LogTick { tick: tick.clone(), digest: None, event });
            }
        }
        if self.received_ns < self.from_ns {
            stream.drop_ready();
            return;
        }
        for tick in stream.ready().ticks() {
            self.sums.add(tick);
            self.output.ticks += u64::from(tick.ticks);
        }
        if self.form != Form::Messages {
            self.output.give_out(stream, self.form, &mut self.frame);
            return;
        }
        while stream.next_frame(&mut self.frame).is_some() {
            let topic = Topic::Corrected(self.id.clone());
            let message = Message { topic, received_ns: self.received_ns, frame: self.frame.clone() };
            self.output.messages.push(message);
        }
    }

    /// Notes what the replica has just done.
    fn note(&mut self, done: &Done) {
        match done {
            Done::Frame { received_ns, .. } => self.received_ns = *received_ns,
            Done::Entry { entry, left_out: false, received_ns } => {
                self.event = Some(entry_words(entry).into());
                if self.form == Form::Messages && *received_ns >= self.from_ns {
                    self.keep(entry, *received_ns);
                }
            }
            Done::Entry { .. } | Done::Notice(_) | Done::Flushed => {}
        }
    }

    /// Puts an entry between the messages, and its documents beside them.
    fn keep(&mut self, entry: &JournalEntry, received_ns: u64) {
        let documents = match &entry.event {
            JournalEvent::Changed { document, .. } => [document, &None],
            JournalEvent::Memory { document, pending, .. } => [document, pending],
            _ => [&None, &None],
        };
        let documents = documents.into_iter().flatten();
        self.output.documents.extend(documents.map(|text| (Digest::of(text.as_bytes()), text.clone())));
        if matches!(entry.event, JournalEvent::Memory { .. }) {
            return;
        }
        let topic = Topic::Journal(self.id.clone());
        let frames = split(entry).into_iter().filter_map(|part| codec::encode(&part).ok());
        let messages = frames.map(|frame| Message { topic: topic.clone(), received_ns, frame });
        self.output.messages.extend(messages);
    }
}
