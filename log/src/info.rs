//! What a log holds: topics, rates, gaps, jitter, temperatures, switches, calibrations, commands.
//!
//! [`Survey`] takes the messages of a log one by one and keeps figures only: its memory grows with the number of topics,
//! never with the length of the log. Lists (swaps, commands, states, revisions) are bounded too, each with its count beside it.
//!
//! | module | holds |
//! |---|---|
//! | `histogram` | distributions of times: median and 99th percentile in fixed memory |
//! | `sequence` | gaps, duplicates, late ticks, beginnings anew |
//! | `timing` | reception against the producer's clock |
//! | `topic` | one stream: rate, intervals, and the above |
//! | `sent` | units of measure of raw readings |
//! | `raw`, `corrected`, `journal` | what is special to these |
//! | `files` | sizes, chunks, whether a recording is whole |

mod corrected;
mod files;
mod histogram;
mod journal;
mod raw;
mod sent;
mod sequence;
#[cfg(test)]
mod tests;
mod timing;
mod topic;

use std::collections::BTreeMap;

use isotherm_correction::sample::OutputKind;
use isotherm_correction::units::Span;
use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::document::Document;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::service_status::ServiceStatus;
use serde::Serialize;

use crate::message::{Message, Topic};
use crate::part::LogFiles;
use crate::recording::{Attachment, Metadata};
use crate::source::LogReport;
use crate::streams::decoded::{Decoded, decode};

pub use corrected::{AppliedInfo, CorrectedInfo, RevisionInfo, SigmaInfo};
pub use files::{ChunksInfo, FileInfo};
pub use histogram::Spread;
pub use journal::{CommandInfo, JournalInfo, StateInfo, StatusInfo, SwapInfo};
pub use raw::{ModeInfo, ReadingInfo, Readings};
pub use sequence::{Gap, Gaps, Order};
pub use timing::Jitter;
pub use topic::{LongestInterval, Rate, TopicInfo};

use corrected::CorrectedSurvey;
use journal::JournalSurvey;
use raw::Modes;
use sent::Sent;
use sequence::Place;
use topic::TopicSurvey;

/// Most entries of each list: topics of no unit, attachments, swaps, revisions and the like.
const MAX_LISTED: usize = 1024;

/// A file inside a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AttachmentInfo {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// When it was attached (ns since 1970-01-01 UTC).
    pub attached_ns: u64,
    /// Its length.
    pub bytes: u64,
}

/// What a log holds of one unit.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct UnitInfo {
    /// Its topics, in the order of their keys.
    pub topics: Vec<TopicInfo>,
    /// Readings of each gyro as they were sent: counts, or mean rates (rad/s).
    pub gyros: Vec<ReadingInfo>,
    /// Readings of each accelerometer as they were sent: counts, or mean outputs (V or m/s²).
    pub accelerometers: Vec<ReadingInfo>,
    /// Raw temperatures by channel, as they were sent.
    pub temperatures: Readings,
    /// Lasing modes; `None` for an instrument without.
    pub modes: Option<ModeInfo>,
    /// What the producer reported of the instrument, by name.
    pub health: Readings,
    /// Corrected ticks; `None` where there is none.
    pub corrected: Option<CorrectedInfo>,
    /// States, from the statuses; `None` where there is none.
    pub status: Option<StatusInfo>,
    /// Swaps and commands; `None` without a journal.
    pub journal: Option<JournalInfo>,
}

/// What a log holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LogInfo {
    /// Its files.
    pub files: Vec<FileInfo>,
    /// What reading it came to.
    pub reading: LogReport,
    /// When the first message was received (ns since 1970-01-01 UTC); `None` for text logs.
    pub first_received_ns: Option<u64>,
    /// The same of the last.
    pub last_received_ns: Option<u64>,
    /// Units by their serial.
    pub units: BTreeMap<String, UnitInfo>,
    /// Topics of no unit.
    pub other_topics: Vec<TopicInfo>,
    /// Messages of further topics of no unit, beyond 1024.
    pub other_messages: u64,
    /// Versions of the services that were heard.
    pub service_versions: Vec<String>,
    /// Files inside the recordings, the first 1024.
    pub attachments: Vec<AttachmentInfo>,
    /// What the recorder wrote down: versions, when and how, counts.
    pub metadata: Vec<Metadata>,
}

/// Looks at the messages of a log, one by one.
#[derive(Debug, Default)]
pub struct Survey {
    recording: bool,
    /// What a text log's mapping says of its one unit.
    sent: Sent,
    /// What the documents of a recording say of theirs, by serial.
    documents: BTreeMap<String, Sent>,
    units: BTreeMap<UnitId, UnitSurvey>,
    others: BTreeMap<String, TopicSurvey>,
    other_messages: u64,
    service_versions: Vec<String>,
    attachments: Vec<AttachmentInfo>,
    metadata: Vec<Metadata>,
    received_ns: Option<[u64; 2]>,
    ticks: u64,
}

/// One unit.
#[derive(Debug, Default)]
struct UnitSurvey {
    /// As far as it is known before the end.
    info: UnitInfo,
    topics: BTreeMap<Topic, TopicSurvey>,
    /// Gyros, accelerometers give counts.
    counts: [bool; 2],
    /// The newest series of the gyros: accelerometers state none.
    series: Option<u64>,
    modes: Modes,
    corrected: CorrectedSurvey,
    status: StatusInfo,
    journal: JournalSurvey,
}

impl Survey {
    /// Nothing seen yet of this log.
    #[must_use]
    pub fn new(files: &LogFiles) -> Self {
        match files {
            LogFiles::Recordings(_) => Self { recording: true, ..Self::default() },
            LogFiles::Text { mapping, .. } => Self { sent: Sent::by_mapping(mapping), ..Self::default() },
        }
    }

    /// Takes the next message.
    pub fn take(&mut self, message: &Message) {
        let received = message.received_ns;
        let range = self.received_ns.get_or_insert([received; 2]);
        *range = [range[0].min(received), range[1].max(received)];
        if let Some(unit) = message.topic.unit() {
            let unit = match self.units.get_mut(unit) {
                Some(unit) => unit,
                None => self.units.entry(unit.clone()).or_default(),
            };
            self.ticks += unit.take(message);
            return;
        }
        let key = message.topic.key();
        if !self.others.contains_key(&key) && self.others.len() == MAX_LISTED {
            self.other_messages += 1;
            return;
        }
        let topic = self.others.entry(key).or_insert_with_key(|key| TopicSurvey::new(key.clone()));
        topic.message(&message.frame);
        if let Topic::Service(_) = message.topic {
            match codec::decode::<ServiceStatus>(&message.frame) {
                Ok(status) => remember(&mut self.service_versions, &status.version),
                Err(error) => topic.unreadable(&error),
            }
        }
    }

    /// Takes what a recording holds beside messages.
    pub fn beside(&mut self, attachments: Vec<Attachment>, metadata: Vec<Metadata>) {
        for attachment in &attachments {
            if let Ok(parsed) = Document::parse_bytes(&attachment.bytes, None) {
                self.documents.insert(parsed.document.unit.clone(), Sent::by_document(&parsed.document));
            }
        }
        let room = MAX_LISTED.saturating_sub(self.attachments.len());
        self.attachments.extend(attachments.into_iter().take(room).map(|attachment| AttachmentInfo {
            bytes: attachment.bytes.len() as u64,
            name: attachment.name,
            media_type: attachment.media_type,
            attached_ns: attachment.attached_ns,
        }));
        let room = MAX_LISTED.saturating_sub(self.metadata.len());
        self.metadata.extend(metadata.into_iter().take(room));
    }

    /// Ticks so far, raw and corrected.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// What it comes to.
    #[must_use]
    pub fn finish(self, files: Vec<FileInfo>, reading: LogReport) -> LogInfo {
        let recording = self.recording;
        let received = self.received_ns.filter(|_| recording);
        let finished = |topics: Vec<TopicSurvey>| {
            topics.into_iter().map(|topic| topic.finish(recording)).collect::<Vec<_>>()
        };
        let units = self.units.into_iter().map(|(unit, survey)| {
            let mut info = UnitInfo {
                topics: finished(survey.topics.into_values().collect()),
                modes: survey.modes.finish(),
                corrected: survey.corrected.finish(),
                status: (!survey.status.states.is_empty()).then_some(survey.status),
                journal: survey.journal.finish(),
                ..survey.info
            };
            let unit = unit.to_string();
            self.documents.get(&unit).unwrap_or(&self.sent).note(&mut info, survey.counts);
            (unit, info)
        });
        LogInfo {
            files,
            reading,
            first_received_ns: received.map(|[first, _]| first),
            last_received_ns: received.map(|[_, last]| last),
            units: units.collect(),
            other_topics: finished(self.others.into_values().collect()),
            other_messages: self.other_messages,
            service_versions: self.service_versions,
            attachments: self.attachments,
            metadata: self.metadata,
        }
    }
}

impl UnitSurvey {
    /// Takes a message; how many ticks are in it.
    fn take(&mut self, message: &Message) -> u64 {
        let topic = &message.topic;
        let mut survey = match self.topics.remove(topic) {
            Some(survey) => survey,
            None => TopicSurvey::new(topic.key()),
        };
        survey.message(&message.frame);
        let before = survey.count();
        if let Err(error) = self.read(message, &mut survey) {
            survey.unreadable(&error);
        }
        let ticks = survey.count() - before;
        self.topics.insert(topic.clone(), survey);
        ticks
    }

    fn read(&mut self, message: &Message, survey: &mut TopicSurvey) -> Result<(), CodecError> {
        let received_ns = message.received_ns;
        let Some((_, decoded)) = decode(message)? else { return Ok(()) };
        match decoded {
            Decoded::Gyro(batch) => {
                let Some(first) = batch.ticks.first() else { return Ok(()) };
                self.counts[0] = batch.output == OutputKind::Counts;
                let times = batch.ticks.iter().map(|tick| (tick.end_time.as_ns(), length_ns(tick.duration)));
                match survey.ticks(Some(first.series), first.sequence, received_ns, &times) {
                    Place::Old => {}
                    place => {
                        self.series = Some(first.series);
                        self.modes.take(&batch, place == Place::Start);
                        ReadingInfo::ticks(
                            &mut self.info.gyros,
                            batch.ticks.iter().map(|tick| &*tick.readings),
                        );
                    }
                }
            }
            Decoded::Accel(batch) => {
                let Some(first) = batch.ticks.first() else { return Ok(()) };
                self.counts[1] = batch.output == OutputKind::Counts;
                let times = batch.ticks.iter().map(|tick| (tick.end_time.as_ns(), length_ns(tick.duration)));
                if survey.ticks(self.series, first.sequence, received_ns, &times) != Place::Old {
                    let readings = batch.ticks.iter().map(|tick| &*tick.readings);
                    ReadingInfo::ticks(&mut self.info.accelerometers, readings);
                }
            }
            Decoded::Temperature(batch) => {
                let times = batch.ticks().filter_map(|tick| tick.first()).map(|reading| reading.time.as_ns());
                survey.readings(received_ns, times);
                self.info.temperatures.temperatures(&batch);
            }
            Decoded::Health(batch) => {
                survey.readings(received_ns, batch.ticks.iter().map(|tick| tick.time_ns));
                self.info.health.health(&batch);
            }
            Decoded::Reference(reference) => {
                survey.readings(received_ns, std::iter::once(reference.end_ns));
            }
            Decoded::Corrected(batch) => {
                // A batch may have gaps between its ticks, and an output may stand for several raw ticks.
                for tick in &batch.ticks {
                    let first = tick.sequence.saturating_sub(u64::from(tick.ticks.saturating_sub(1)));
                    let time = (tick.end_time.as_ns(), length_ns(tick.duration));
                    survey.outputs(batch.series, first, u64::from(tick.ticks.max(1)), time);
                }
                if let Some(last) = batch.ticks.last() {
                    survey.received(received_ns, last.end_time.as_ns());
                }
                self.corrected.take(&batch);
            }
            Decoded::Status(status) => self.status.take(received_ns, &status),
            Decoded::Journal => self.journal.take(received_ns, &message.frame)?,
        }
        Ok(())
    }
}

/// Length of a span (ns).
fn length_ns(span: Span) -> u64 {
    span.as_ns().unsigned_abs()
}

/// Notes a value that is not in the list yet.
fn remember(list: &mut Vec<String>, value: &str) {
    if list.len() < MAX_LISTED && !list.iter().any(|known| known == value) {
        list.push(value.to_owned());
    }
}
