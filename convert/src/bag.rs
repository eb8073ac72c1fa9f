//! A ROS 2 bag: a folder with an MCAP file of the profile `ros2` and the `metadata.yaml` that `ros2 bag` reads.
//!
//! | topic | type | from |
//! |---|---|---|
//! | `/imu/<unit>/data` | `sensor_msgs/msg/Imu` | corrected increments, divided by their duration |
//! | `/imu/<unit>/data_raw` | `sensor_msgs/msg/Imu` | raw readings of three gyros in rad/s |
//! | `/imu/<unit>/temperature/<channel>` | `sensor_msgs/msg/Temperature` | temperatures as they were applied (°C) |
//! | `/imu/<unit>/temperature_raw/<channel>` | `sensor_msgs/msg/Temperature` | raw readings through the document's conversion (°C) |
//!
//! Every time in the bag is that of the sample on the producer's clock; the definitions of the messages stand in the file, so
//! that a reader needs nothing else.
//!
//! Sources: `rosbag2_storage` (`yaml.hpp`, `qos.cpp`) and the MCAP profile `ros2`.

mod metadata;

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use isotherm_log::error::Error;
use isotherm_log::file::Partial;
use isotherm_log::recording::io_error;
use isotherm_log::ros2::{RosMessage, to_cdr};
use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};
use serde::Serialize;

use metadata::QUALITY_OF_SERVICE;

/// Largest sum of messages in one chunk, before compression (bytes).
const CHUNK_BYTES: u64 = 1 << 20;

/// A topic of a bag.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BagTopic {
    /// Its name.
    pub name: String,
    /// Type of its messages.
    #[serde(rename = "type")]
    pub message_type: &'static str,
    /// What it is of: `unit`, and `channel` where it is of one.
    pub origin: BTreeMap<String, String>,
    /// How many.
    pub messages: u64,
}

/// What a bag holds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct BagSummary {
    /// Time of the earliest message (ns); `None` without one.
    pub first_ns: Option<u64>,
    /// Time of the latest message (ns).
    pub last_ns: u64,
    /// Its topics, in the order of their first messages.
    pub topics: Vec<BagTopic>,
}

impl BagSummary {
    /// From the earliest to the latest message (ns).
    #[must_use]
    pub(crate) fn duration_ns(&self) -> u64 {
        self.last_ns.saturating_sub(self.first_ns.unwrap_or(self.last_ns))
    }

    /// All messages.
    #[must_use]
    pub(crate) fn messages(&self) -> u64 {
        self.topics.iter().map(|topic| topic.messages).sum()
    }
}

/// Writes the MCAP file of a bag.
pub(crate) struct BagWriter {
    writer: Writer<BufWriter<File>>,
    path: PathBuf,
    /// Channel and place in the summary by name; looked up, never gone through.
    topics: HashMap<String, (u16, usize)>,
    summary: BagSummary,
}

impl std::fmt::Debug for BagWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BagWriter").field("path", &self.path).finish_non_exhaustive()
    }
}

impl BagWriter {
    /// Creates the MCAP file.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn create(partial: &mut Partial) -> Result<Self, Error> {
        let (file, path) = (partial.create()?, partial.path());
        let writer = WriteOptions::new()
            .profile("ros2")
            .library(concat!("isotherm ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            // The same bytes on every machine, however many threads it has.
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .create(BufWriter::new(file))
            .map_err(|source| failed(path, source))?;
        Ok(Self { writer, path: path.to_owned(), topics: HashMap::new(), summary: BagSummary::default() })
    }

    /// Writes one message. `origin` says what its topic is of, and is looked at for the topic's first message only.
    ///
    /// # Errors
    /// [`Error::File`]; nothing can be written behind it.
    pub(crate) fn write<M: RosMessage>(
        &mut self,
        topic: &str,
        time_ns: u64,
        message: &M,
        origin: impl FnOnce() -> BTreeMap<String, String>,
    ) -> Result<(), Error> {
        let (channel_id, place) = match self.topics.get(topic) {
            Some(known) => *known,
            None => self.declare::<M>(topic, origin())?,
        };
        let write = |source| Error::file(&self.path, "write the bag", source);
        let bytes = to_cdr(message).map_err(|error| write(io::Error::other(error)))?;
        // Sequence 0 is "not known", as ros2 bag writes it.
        let header = MessageHeader { channel_id, sequence: 0, log_time: time_ns, publish_time: time_ns };
        self.writer.write_to_known_channel(&header, &bytes).map_err(|source| failed(&self.path, source))?;
        let summary = &mut self.summary;
        summary.first_ns = Some(summary.first_ns.map_or(time_ns, |first| first.min(time_ns)));
        summary.last_ns = summary.last_ns.max(time_ns);
        if let Some(topic) = summary.topics.get_mut(place) {
            topic.messages += 1;
        }
        Ok(())
    }

    /// Writes names and values.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn metadata(&mut self, name: &str, values: BTreeMap<String, String>) -> Result<(), Error> {
        let metadata = mcap::records::Metadata { name: name.to_owned(), metadata: values };
        self.writer.write_metadata(&metadata).map_err(|source| failed(&self.path, source))
    }

    /// Ends the file; gives what it holds, and the text of `metadata.yaml` for the file under the name that it will have.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn finish(mut self, name: &str) -> Result<(BagSummary, String), Error> {
        self.writer.finish().map_err(|source| failed(&self.path, source))?;
        let path = self.path;
        let failed = |source| Error::file(&path, "write the bag", source);
        let mut buffered = self.writer.into_inner();
        buffered.flush().map_err(failed)?;
        buffered.get_ref().sync_all().map_err(failed)?;
        let yaml = metadata::yaml(name, &self.summary);
        Ok((self.summary, yaml))
    }

    /// Enters a topic with its type.
    fn declare<M: RosMessage>(
        &mut self,
        topic: &str,
        origin: BTreeMap<String, String>,
    ) -> Result<(u16, usize), Error> {
        let failed = |source| failed(&self.path, source);
        let schema = self.writer.add_schema(M::TYPE, "ros2msg", M::DEFINITION.as_bytes()).map_err(failed)?;
        let mut values = origin.clone();
        values.insert("offered_qos_profiles".to_owned(), QUALITY_OF_SERVICE.to_owned());
        let id = self.writer.add_channel(schema, topic, "cdr", &values).map_err(failed)?;
        let place = self.summary.topics.len();
        self.summary.topics.push(BagTopic {
            name: topic.to_owned(),
            message_type: M::TYPE,
            origin,
            messages: 0,
        });
        self.topics.insert(topic.to_owned(), (id, place));
        Ok((id, place))
    }
}

fn failed(path: &Path, source: McapError) -> Error {
    Error::file(path, "write the bag", io_error(source))
}

#[cfg(test)]
mod tests {
    use isotherm_log::ros2::{Header, Imu, Temperature, Time};

    use super::*;

    fn header() -> Header {
        Header { stamp: Time { sec: 5, nanosec: 7 }, frame_id: "A_1".to_owned() }
    }

    #[test]
    fn a_bag_describes_itself() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x_0.mcap");
        let mut partial = Partial::of(&path);
        let mut bag = BagWriter::create(&mut partial).unwrap();
        let origin = || BTreeMap::from([("unit".to_owned(), "A-1".to_owned())]);
        for (topic, time_ns) in [("/imu/A_1/temperature/b", 9), ("/imu/A_1/temperature/a", 4)] {
            let message = Temperature { header: header(), temperature: 1.5, variance: 0.0 };
            bag.write(topic, time_ns, &message, origin).unwrap();
        }
        bag.write("/imu/A_1/data", 7, &Imu::new(header(), None, None), origin).unwrap();
        let (summary, yaml) = bag.finish("x_0.mcap").unwrap();
        assert_eq!((summary.first_ns, summary.duration_ns(), summary.messages()), (Some(4), 5, 3));
        for line in ["  version: 5\n", "nanoseconds_since_epoch: 4\n", "        name: \"/imu/A_1/data\"\n"] {
            assert!(yaml.contains(line), "{line}\n{yaml}");
        }

        partial.keep().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
        assert_eq!(messages.len(), 3);
        let imu = messages.iter().find(|message| message.channel.topic == "/imu/A_1/data").unwrap();
        let schema = imu.channel.schema.as_ref().unwrap();
        assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("sensor_msgs/msg/Imu", "ros2msg"));
        assert_eq!((imu.channel.message_encoding.as_str(), imu.log_time), ("cdr", 7));
        assert_eq!(imu.channel.metadata["offered_qos_profiles"], QUALITY_OF_SERVICE);
        assert_eq!(imu.channel.metadata["unit"], "A-1");
    }
}
