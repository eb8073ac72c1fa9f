//! A log as a ROS 2 bag.

mod nominal;

use std::collections::BTreeMap;

use isotherm_correction::sample::{ChannelName, TickFlags};
use isotherm_log::ros2::{Header, Imu, Names, RosMessage, Temperature, time};
use isotherm_log::streams::contents::{UnitContents, usual};
use isotherm_log::streams::decoded::Decoded;
use isotherm_log::streams::rows::{Row, Rows, Step};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::document::Document;
use isotherm_protocol::key::UnitId;

use crate::bag::BagWriter;
use nominal::Nominal;

use super::{Conversion, Converted, Found, Outcome, Written};
use isotherm_log::error::Error;

/// What stands in for the reason where a time is beyond what a bag holds.
const NO_TIME: &str = "times before 1970 or after 2038, outside the range of ROS";

/// How a ROS 2 bag is made.
#[derive(Debug, Clone, Default)]
pub struct Ros2Options {
    /// Raw readings too, where there are corrected ticks.
    pub raw: bool,
    /// The frame of all messages; `None`: each unit's own name.
    pub frame: Option<String>,
    /// Calibration documents that say what raw readings are.
    pub documents: Vec<Document>,
}

pub(super) fn convert(conversion: &Conversion, found: &Found) -> Result<Outcome, Error> {
    let mut notes = Vec::new();
    let units_of_log = found.contents.units.keys();
    let strange = |document: &&Document| !units_of_log.clone().any(|unit| unit.as_str() == document.unit);
    if let Some(document) = conversion.ros2.documents.iter().find(strange) {
        let there = units_of_log.map(UnitId::as_str).collect::<Vec<_>>().join(", ");
        return Err(Error::Usage(format!(
            "--calibration is for unit {}, the log has {there}: give the document of one of these",
            document.unit
        )));
    }
    let names = Names::of(found.contents.units.keys().map(UnitId::as_str), "unit");
    let mut units = BTreeMap::new();
    for (unit, contents) in &found.contents.units {
        let documents = conversion.ros2.documents.iter().chain(&found.documents);
        let document = documents.into_iter().find(|document| document.unit == unit.as_str());
        let mut topics = UnitBag::new(unit, contents, &names.get(unit.as_str()), &conversion.ros2, document);
        notes.extend(topics.note.take());
        units.insert(unit.clone(), topics);
    }
    if !units.values().any(|unit| unit.corrected || unit.raw.is_some()) {
        return Err(Error::Usage(format!("the log has nothing for a ROS 2 bag:\n{}", notes.join("\n"))));
    }
    let folder = conversion.out.file_name().map_or("bag".into(), |name| name.to_string_lossy().into_owned());
    let file = format!("{folder}_0.mcap");
    let mut bag = conversion.place.partial(&conversion.out.join(&file))?;
    let mut writer = BagWriter::create(&mut bag)?;
    writer.metadata("isotherm", conversion.provenance().into_iter().collect())?;
    let mut converted = Converted::default();
    let log = conversion.read_units(&mut units, &mut converted, |unit, _, decoded, converted| {
        unit.take(decoded, &mut Bag { writer: &mut writer, converted })
    })?;
    for unit in units.values_mut() {
        unit.finish(&mut Bag { writer: &mut writer, converted: &mut converted })?;
    }
    let (summary, yaml) = writer.finish(&file)?;
    let metadata = conversion.place.write(&conversion.out.join("metadata.yaml"), &yaml)?;
    let files = [(bag, "ROS 2 bag", summary.messages()), (metadata, "its description", 1)];
    for (partial, what, rows) in files {
        converted.files.push(Written { path: partial.path().to_owned(), unit: None, what, rows });
        partial.keep()?;
    }
    (converted.topics, converted.notes) = (summary.topics, notes);
    Ok(Outcome { converted, log })
}

/// Where messages go, and where those are counted that do not.
struct Bag<'a> {
    writer: &'a mut BagWriter,
    converted: &'a mut Converted,
}

/// The topics of a unit.
#[derive(Debug)]
struct UnitBag {
    unit: String,
    /// First part of its topics' names: `/imu/<unit>`.
    base: String,
    frame: String,
    channels: Names,
    corrected: bool,
    raw: Option<(Rows, Nominal)>,
    /// Why its raw readings are not in the bag though nothing else is.
    note: Option<String>,
}

impl UnitBag {
    fn new(
        unit: &UnitId,
        contents: &UnitContents,
        name: &str,
        options: &Ros2Options,
        document: Option<&Document>,
    ) -> Self {
        let corrected = contents.corrected_ticks > 0;
        let nominal = document.map(Nominal::of).unwrap_or_default();
        let wanted = options.raw || !corrected;
        let stated =
            usual(&contents.gyro).map(|shape| (nominal.states(shape.output(), shape.sensors), shape));
        let note = match stated {
            _ if !wanted => None,
            Some((true, _)) => None,
            Some((false, shape)) if shape.sensors != 3 => Some(format!(
                "{unit}: an Imu message has three axes, the unit has {} gyros: correct the log first",
                shape.sensors
            )),
            Some((false, _)) => Some(format!(
                "{unit}: its raw readings are counts: correct the log first, or give the calibration document with \
                 --calibration"
            )),
            None => Some(format!("{unit}: it has neither corrected ticks nor raw gyro ticks")),
        };
        let raw = (wanted && note.is_none()).then(|| (Rows::of(contents), nominal));
        let channels = contents.channels.iter().chain(&contents.applied_channels);
        Self {
            unit: unit.to_string(),
            base: format!("/imu/{name}"),
            frame: options.frame.clone().unwrap_or_else(|| name.to_owned()),
            channels: Names::of(channels.map(ChannelName::as_str), "channel"),
            corrected,
            raw,
            note,
        }
    }

    fn take(&mut self, decoded: &Decoded, bag: &mut Bag<'_>) -> Result<(), Error> {
        match decoded {
            Decoded::Corrected(batch) => self.write_corrected(batch, bag)?,
            Decoded::Gyro(_) | Decoded::Accel(_) | Decoded::Temperature(_) => match &mut self.raw {
                Some((rows, _)) => {
                    rows.take(decoded);
                    self.drain(bag)?;
                }
                None => bag.converted.leave_out("raw messages", 1),
            },
            Decoded::Health(_) => bag.converted.leave_out("health messages", 1),
            Decoded::Reference(_) => bag.converted.leave_out("rate references", 1),
            Decoded::Status(_) => bag.converted.leave_out("status messages", 1),
            Decoded::Journal => bag.converted.leave_out("journal messages", 1),
        }
        Ok(())
    }

    fn finish(&mut self, bag: &mut Bag<'_>) -> Result<(), Error> {
        if let Some((rows, _)) = &mut self.raw {
            rows.finish();
            bag.converted.add(&rows.tally());
        }
        self.drain(bag)
    }

    fn write_corrected(&self, batch: &CorrectedBatch, bag: &mut Bag<'_>) -> Result<(), Error> {
        let topic = format!("{}/data", self.base);
        for tick in &batch.ticks {
            if tick.flags.contains(TickFlags::UNCALIBRATED) {
                bag.converted.leave_out("uncalibrated ticks, which have no unit of measure", 1);
            } else if tick.duration.as_ns() <= 0 {
                bag.converted.lose("ticks without a duration", 1);
            } else {
                let imu = |header| Imu::of_tick(header, tick);
                self.write(&topic, None, tick.end_time.as_ns(), imu, bag)?;
            }
        }
        let Some(last) = batch.ticks.last() else { return Ok(()) };
        for applied in &batch.temperatures {
            let message =
                |header| Temperature { header, temperature: applied.temperature_deg_c, variance: 0.0 };
            let topic = self.channel_topic("temperature", &applied.channel);
            self.write(&topic, Some(&applied.channel), last.end_time.as_ns(), message, bag)?;
        }
        Ok(())
    }

    /// Writes the raw rows that are ready.
    fn drain(&mut self, bag: &mut Bag<'_>) -> Result<(), Error> {
        let Some((mut rows, nominal)) = self.raw.take() else { return Ok(()) };
        while let Some(step) = rows.next_step() {
            if let Step::Row(row) = step {
                self.write_raw(&row, &nominal, bag)?;
            }
        }
        self.raw = Some((rows, nominal));
        Ok(())
    }

    fn write_raw(&self, row: &Row, nominal: &Nominal, bag: &mut Bag<'_>) -> Result<(), Error> {
        for reading in &row.temperatures {
            let Some(temperature) = nominal.temperature(&reading.channel, reading.raw) else {
                let words = "raw temperature readings without a document that converts them";
                bag.converted.leave_out(words, 1);
                continue;
            };
            let message = |header| Temperature { header, temperature, variance: 0.0 };
            let topic = self.channel_topic("temperature_raw", &reading.channel);
            self.write(&topic, Some(&reading.channel), row.time_ns, message, bag)?;
        }
        let Some((output, gyro)) = &row.gyro else {
            let alone = u64::from(row.accel.is_some());
            bag.converted.leave_out("raw accelerometer ticks without a gyro tick", alone);
            return Ok(());
        };
        let Some(rate) = nominal.rate(*output, gyro) else {
            bag.converted.lose("raw ticks whose rate cannot be stated", 1);
            return Ok(());
        };
        let force = row.accel.as_ref().and_then(|(output, accel)| nominal.force(*output, accel));
        let unstated = u64::from(row.accel.is_some() && force.is_none());
        bag.converted.leave_out("raw accelerometer readings without a document that scales them", unstated);
        let imu = |header| Imu::new(header, Some(rate), force);
        self.write(&format!("{}/data_raw", self.base), None, row.time_ns, imu, bag)
    }

    fn channel_topic(&self, kind: &str, channel: &str) -> String {
        format!("{}/{kind}/{}", self.base, self.channels.get(channel))
    }

    /// Writes a message with its header; one whose time no bag can hold is counted.
    fn write<M: RosMessage>(
        &self,
        topic: &str,
        channel: Option<&str>,
        time_ns: i64,
        message: impl FnOnce(Header) -> M,
        bag: &mut Bag<'_>,
    ) -> Result<(), Error> {
        let Some((stamp, log_ns)) = time(time_ns).zip(u64::try_from(time_ns).ok()) else {
            bag.converted.lose(NO_TIME, 1);
            return Ok(());
        };
        let message = message(Header { stamp, frame_id: self.frame.clone() });
        let origin = || {
            let mut origin = BTreeMap::from([("unit".to_owned(), self.unit.clone())]);
            origin.extend(channel.map(|channel| ("channel".to_owned(), channel.to_owned())));
            origin
        };
        bag.writer.write(topic, log_ns, &message, origin)
    }
}
