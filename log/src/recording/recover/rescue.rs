//! Writing what was found into a new file.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

use mcap::records::{Channel, MessageHeader, Record};
use mcap::{McapError, Writer};

use super::RecoveryReport;
use crate::error::Error;
use crate::file::create_alone;
use crate::message::Topic;
use crate::recording::view;
use crate::recording::writer::{declare, declare_view, failed};
use crate::recording::{Attachment, CHANNELS, Documents, MESSAGE_ENCODING, METADATA, RecordingOptions};

/// A schema: its name, encoding and text.
type Schema = (String, String, Vec<u8>);

/// What the file says of its channels, wherever it stands in it.
#[derive(Debug, Default)]
pub(super) struct Definitions {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    /// Keys of channels, from records beside the chunks.
    keys: BTreeMap<u16, String>,
    /// How many of them there were when the pass began.
    before: usize,
}

impl Definitions {
    /// Whether the pass has found some that it did not know when it began.
    pub(super) fn are_more(&self) -> bool {
        self.count() > self.before
    }

    fn count(&self) -> usize {
        self.channels.len() + self.keys.len()
    }
}

/// A channel of the new file.
#[derive(Debug)]
struct Target {
    id: u16,
    key: String,
    /// Number that its next message should have; `None` for channels whose messages are not numbered by a recorder.
    next: Option<u32>,
    is_journal: bool,
}

/// The new file.
pub(super) struct Rescue<'a> {
    writer: Writer<BufWriter<Arc<File>>>,
    file: Arc<File>,
    definitions: &'a mut Definitions,
    /// By number in the old file.
    targets: HashMap<u16, Target>,
    journal: Documents,
    /// Documents of the journal that are not attached yet.
    documents: BTreeMap<String, Attachment>,
    attached: BTreeSet<String>,
    /// Messages that there were by channel, as the old file's summary says.
    stated: Option<BTreeMap<u16, u64>>,
}

impl<'a> Rescue<'a> {
    /// Creates the new file.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(super) fn create(
        path: &Path,
        options: RecordingOptions,
        profile: &str,
        definitions: &'a mut Definitions,
    ) -> Result<Self, Error> {
        let file = Arc::new(create_alone(path, options.overwrite)?);
        let buffered = BufWriter::new(Arc::clone(&file));
        let writer = options.to_library().profile(profile).create(buffered);
        let writer = writer.map_err(|source| failed(path, source))?;
        definitions.before = definitions.count();
        Ok(Self {
            writer,
            file,
            definitions,
            targets: HashMap::new(),
            journal: Documents::default(),
            documents: BTreeMap::new(),
            attached: BTreeSet::new(),
            stated: None,
        })
    }

    /// Takes one record.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(super) fn take(&mut self, record: Record<'_>, report: &mut RecoveryReport) -> Result<(), McapError> {
        match record {
            Record::Schema { header, data } => {
                let schema = (header.name, header.encoding, data.into_owned());
                self.definitions.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) => {
                self.definitions.channels.insert(channel.id, channel);
            }
            Record::Message { header, data } => self.message(header, &data, report)?,
            Record::Attachment { header, data, .. } => {
                report.attachments += 1;
                self.attach(&Attachment::read(header, data))?;
            }
            Record::Metadata(metadata) => {
                if metadata.name == CHANNELS {
                    let keys = metadata.metadata.iter();
                    let keys = keys.filter_map(|(id, key)| Some((id.parse().ok()?, key.clone())));
                    self.definitions.keys.extend(keys);
                }
                report.metadata += 1;
                self.writer.write_metadata(&metadata)?;
            }
            Record::Statistics(statistics) => self.stated = Some(statistics.channel_message_counts),
            _ => {}
        }
        Ok(())
    }

    /// Chunks stay as they were.
    ///
    /// # Errors
    /// As [`Rescue::take`].
    pub(super) fn end_chunk(&mut self) -> Result<(), McapError> {
        self.writer.flush()
    }

    /// Ends the file with a summary, and with a record of what was lost.
    ///
    /// # Errors
    /// As [`Rescue::take`].
    pub(super) fn finish(mut self, report: &mut RecoveryReport) -> Result<(), McapError> {
        for document in std::mem::take(&mut self.documents).into_values() {
            report.documents_rebuilt += 1;
            self.attach(&document)?;
        }
        report.missing = match &self.stated {
            // What is there once more for viewers is not lost twice.
            Some(stated) => {
                let copied = |number| self.key(number).is_some_and(|key| view::topic(key).is_some());
                let messages = report.topics.iter().filter(|(key, _)| view::topic(key).is_none());
                let written = messages.map(|(_, topic)| topic.messages).sum::<u64>() + report.nameless;
                let stated = stated.iter().filter(|(number, _)| !copied(**number)).map(|(_, count)| count);
                stated.sum::<u64>().saturating_sub(written)
            }
            None => report.topics.values().map(|topic| topic.missing).sum(),
        };
        self.writer.write_metadata(&account(report))?;
        self.writer.finish()?;
        let Self { writer, file, .. } = self;
        writer.into_inner().flush()?;
        Ok(file.sync_all()?)
    }

    /// Key of a channel of the old file.
    fn key(&self, number: u16) -> Option<&str> {
        let Definitions { channels, keys, .. } = &*self.definitions;
        channels.get(&number).map(|channel| &*channel.topic).or(keys.get(&number).map(String::as_str))
    }

    fn message(
        &mut self,
        header: MessageHeader,
        data: &[u8],
        report: &mut RecoveryReport,
    ) -> Result<(), McapError> {
        let number = header.channel_id;
        // Looked up each time where it is not known: its record may come later.
        if !self.targets.contains_key(&number)
            && let Some(target) = self.declare(number)?
        {
            self.targets.insert(number, target);
        }
        let Some(target) = self.targets.get_mut(&number) else {
            report.nameless += 1;
            return Ok(());
        };
        let topic = report.topics.entry(target.key.clone()).or_default();
        if let Some(next) = target.next.as_mut() {
            let passed_over = header.sequence.wrapping_sub(*next);
            // A number that goes back is no loss.
            topic.missing += u64::from(if passed_over < 1 << 31 { passed_over } else { 0 });
            *next = header.sequence.wrapping_add(1);
        }
        topic.messages += 1;
        report.messages += 1;
        if target.is_journal {
            for document in self.journal.take(data, header.log_time) {
                if !self.attached.contains(&document.name) {
                    self.documents.insert(document.name.clone(), document);
                }
            }
        }
        let header = MessageHeader { channel_id: target.id, ..header };
        self.writer.write_to_known_channel(&header, data)
    }

    /// Enters a channel of the old file into the new one; `None` where nothing names it.
    fn declare(&mut self, number: u16) -> Result<Option<Target>, McapError> {
        let (id, key, ours) = if let Some(channel) = self.definitions.channels.get(&number) {
            let schema = match self.definitions.schemas.get(&channel.schema_id) {
                Some((name, encoding, text)) => self.writer.add_schema(name, encoding, text)?,
                None => 0,
            };
            let Channel { topic, message_encoding, metadata, .. } = channel;
            let id = self.writer.add_channel(schema, topic, message_encoding, metadata)?;
            (id, topic.clone(), message_encoding == MESSAGE_ENCODING)
        } else if let Some(key) = self.definitions.keys.get(&number) {
            match view::topic(key) {
                Some(topic) => (declare_view(&mut self.writer, &topic)?, key.clone(), false),
                None => (declare(&mut self.writer, &Topic::of(key))?, key.clone(), true),
            }
        } else {
            return Ok(None);
        };
        let is_journal = ours && matches!(Topic::of(&key), Topic::Journal(_));
        Ok(Some(Target { id, key, next: ours.then_some(0), is_journal }))
    }

    fn attach(&mut self, attachment: &Attachment) -> Result<(), McapError> {
        self.documents.remove(&attachment.name);
        self.attached.insert(attachment.name.clone());
        self.writer.attach(&attachment.as_written())
    }
}

/// What the new file says of its making.
fn account(report: &RecoveryReport) -> mcap::records::Metadata {
    let number = |name: &str, value: u64| (name.to_owned(), value.to_string());
    let mut metadata = BTreeMap::from([
        ("record".to_owned(), "recovered".to_owned()),
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("original_ended".to_owned(), report.ended.to_string()),
        number("messages", report.messages),
        number("missing", report.missing),
        number("nameless", report.nameless),
        number("documents_rebuilt", report.documents_rebuilt),
        number("damaged_places", report.damaged_places),
        number("damaged_bytes", report.damaged_bytes),
    ]);
    if let Some(first) = report.damage.first() {
        metadata.insert("first_damage".to_owned(), format!("byte {}: {}", first.offset, first.words));
    }
    mcap::records::Metadata { name: METADATA.to_owned(), metadata }
}
