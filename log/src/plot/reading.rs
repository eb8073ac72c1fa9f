//! The logs, read once and in step, into what is shown of their units.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::document::{Document, Parsed};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::UnitStream;

use super::difference::Difference;
use super::nominal::Nominal;
use super::unit::UnitPlot;
use super::{MAX_UNITS, PlotLog, PlotOptions, PlotSummary, UnitSummary, layout, track};
use crate::error::Error;
use crate::message::{Message, Topic};
use crate::offline::{Loaded, troubles};
use crate::streams::decoded::{Decoded, decode};
use isotherm_pages::Page;

/// Logs that begin further apart than this are laid side by side by their beginnings (ns).
const APART_NS: u64 = 86_400_000_000_000;
/// Messages that are looked at for the first time of a log.
const LOOK_AHEAD: usize = 4096;

/// A log that is being read.
struct Source {
    log: PlotLog,
    /// Messages read and not taken yet.
    ahead: VecDeque<Message>,
    over: bool,
    /// The serial of its unit, where it is shown under another.
    own: Option<UnitId>,
    /// Where on the axis it is (ns).
    now_ns: i64,
    /// What its raw messages are corrected by, and of which unit they are.
    corrects: Option<(UnitStream, UnitId)>,
}

impl Source {
    /// Reads on by one message, and makes what is to be corrected of it; whether there was one.
    fn read(&mut self) -> Result<bool, Error> {
        let mut message = self.log.messages.next_message()?;
        self.over = message.is_none();
        let received_ns = message.as_ref().map_or(0, |message| message.received_ns);
        if let Some((stream, unit)) = &mut self.corrects {
            match &message {
                None => stream.flush(),
                Some(Message { topic: Topic::Raw(of, kind), frame, .. }) => {
                    unit.clone_from(of);
                    // One that cannot be read is counted as such where it is shown.
                    let _ = stream.receive(*kind, frame);
                }
                Some(_) => {}
            }
            if !self.over && self.log.correct_from.is_some_and(|from_ns| received_ns < from_ns) {
                stream.drop_ready();
                message = None;
            }
        }
        self.ahead.extend(message);
        if let Some((stream, unit)) = &mut self.corrects {
            let mut frame = Vec::new();
            while stream.next_frame(&mut frame).is_some() {
                let topic = Topic::Corrected(unit.clone());
                self.ahead.push_back(Message { topic, received_ns, frame: std::mem::take(&mut frame) });
            }
        }
        Ok(!self.over)
    }

    /// The end of the first gyro, accelerometer or corrected tick, else the time of the first message that has one (ns on the producer's
    /// clock).
    fn first_ns(&mut self) -> Result<Option<i64>, Error> {
        let mut other = None;
        while self.ahead.len() < LOOK_AHEAD && !self.over {
            let read = self.ahead.len();
            self.read()?;
            for message in self.ahead.iter().skip(read) {
                let Ok(Some((_, decoded))) = decode(message) else { continue };
                let Some([first, _]) = decoded.times() else { continue };
                if matches!(decoded, Decoded::Gyro(_) | Decoded::Accel(_) | Decoded::Corrected(_)) {
                    return Ok(Some(first.as_ns()));
                }
                other.get_or_insert(first.as_ns());
            }
        }
        Ok(other)
    }
}

/// One unit in all logs.
pub(super) struct UnitLogs {
    pub(super) logs: Vec<Option<UnitPlot>>,
    pub(super) difference: Option<Difference>,
}

/// What is being read.
pub(super) struct Plot {
    logs: Vec<Source>,
    units: BTreeMap<UnitId, UnitLogs>,
    /// Those of the units that have raw or corrected messages.
    drawn: BTreeSet<UnitId>,
    left_out: BTreeSet<UnitId>,
    detail: usize,
    nominal: Option<Nominal>,
    /// By how much each log is moved on the axis (ns).
    moved_ns: Vec<i64>,
    second_moved_ns: Option<i64>,
}

impl Plot {
    /// Nothing read yet.
    pub(super) fn new(logs: Vec<PlotLog>, options: &PlotOptions) -> Result<Self, Error> {
        let mut sources = Vec::with_capacity(logs.len());
        for log in logs {
            let calibration = options.calibration.as_ref().filter(|_| log.correct_from.is_some());
            let corrects = calibration.cloned().map(Loaded::of).transpose()?.map(|loaded| {
                let stream = UnitStream::new(loaded.unit.clone(), UnitSettings::default());
                (loaded.installed(stream), loaded.unit)
            });
            let ahead = VecDeque::new();
            sources.push(Source { log, ahead, over: false, own: None, now_ns: i64::MIN, corrects });
        }
        let mut plot = Self {
            moved_ns: vec![0; sources.len()],
            logs: sources,
            units: BTreeMap::new(),
            drawn: BTreeSet::new(),
            left_out: BTreeSet::new(),
            detail: options.detail.clamp(2, 1 << 20),
            nominal: options.calibration.as_ref().map(|parsed| Nominal::of(&parsed.document)),
            second_moved_ns: None,
        };
        plot.align()?;
        Ok(plot)
    }

    /// Lays logs of different times side by side by their beginnings.
    fn align(&mut self) -> Result<(), Error> {
        let [first, second] = self.logs.as_mut_slice() else { return Ok(()) };
        if let (Some(first), Some(second)) = (first.first_ns()?, second.first_ns()?)
            && first.abs_diff(second) > APART_NS
        {
            let by = first.saturating_sub(second);
            self.second_moved_ns = Some(by);
            if let Some(moved) = self.moved_ns.get_mut(1) {
                *moved = by;
            }
        }
        Ok(())
    }

    /// Takes the next message of the log that is behind; false when all are over.
    pub(super) fn step(&mut self) -> Result<bool, Error> {
        let Some(log) = self.next_log()? else { return Ok(false) };
        if let Some(message) = self.logs.get_mut(log).and_then(|source| source.ahead.pop_front()) {
            self.show(log, &message);
        }
        Ok(true)
    }

    /// The log that is behind on the axis; `None` when all are over.
    fn next_log(&mut self) -> Result<Option<usize>, Error> {
        for source in &mut self.logs {
            while source.ahead.is_empty() && !source.over {
                source.read()?;
            }
        }
        let waiting = self.logs.iter().enumerate().filter(|(_, source)| !source.ahead.is_empty());
        Ok(waiting.min_by_key(|(_, source)| source.now_ns).map(|(log, _)| log))
    }

    /// Enters a message into what is shown of its unit.
    fn show(&mut self, log: usize, message: &Message) {
        let Some(serial) = message.topic.unit() else { return };
        let Some(source) = self.logs.get_mut(log) else { return };
        let own = serial;
        let serial = source.log.shown_as.as_ref().unwrap_or(own);
        if serial != own && source.own.is_none() {
            source.own = Some(own.clone());
        }
        if self.left_out.contains(serial) {
            return;
        }
        // A unit of which only the status was recorded takes no place from one that has something to draw.
        let draws = matches!(message.topic, Topic::Raw(..) | Topic::Corrected(_));
        if draws && !self.drawn.contains(serial) {
            if self.drawn.len() == MAX_UNITS {
                self.units.remove(serial);
                if self.left_out.len() < LOOK_AHEAD {
                    self.left_out.insert(serial.clone());
                }
                return;
            }
            self.drawn.insert(serial.clone());
        }
        if !self.units.contains_key(serial) {
            if !draws && self.units.len() >= LOOK_AHEAD {
                return;
            }
            let logs = self.moved_ns.iter().map(|_| None).collect();
            self.units.insert(serial.clone(), UnitLogs { logs, difference: None });
        }
        let Some(unit) = self.units.get_mut(serial) else { return };
        let UnitLogs { logs, difference } = unit;
        let both = logs.len() == 2;
        let Some(place) = logs.get_mut(log) else { return };
        let moved = self.moved_ns.get(log).copied().unwrap_or(0);
        let (detail, nominal) = (self.detail, &self.nominal);
        let shown = place.get_or_insert_with(|| UnitPlot::new(detail, nominal.clone(), moved));
        shown.take(message, &mut |at_ns, tick| {
            if both {
                difference.get_or_insert_with(|| Difference::new(detail)).take(log, at_ns, tick);
            }
        });
        if let Some(now) = shown.clock.now() {
            source.now_ns = now;
        }
    }

    /// Draws what was read.
    pub(super) fn finish(mut self) -> Result<(Page, PlotSummary), Error> {
        self.units.retain(|serial, _| self.drawn.contains(serial));
        for unit in self.units.values_mut() {
            if let Some(difference) = &mut unit.difference {
                difference.end();
            }
        }
        // Documents may also lie in the recording as files.
        for (log, source) in self.logs.iter_mut().enumerate() {
            let Some(recording) = source.log.messages.recording() else { continue };
            for attachment in recording.take_attachments() {
                let Ok(Parsed { document, .. }) = Document::parse_bytes(&attachment.bytes, None) else {
                    continue;
                };
                let unit = self.units.iter_mut().find(|(unit, _)| unit.as_str() == document.unit);
                if let Some(shown) = unit.and_then(|(_, unit)| unit.logs.get_mut(log)?.as_mut())
                    && shown.nominal.is_none()
                {
                    shown.nominal = Some(Nominal::of(&document));
                }
            }
        }
        let summary = self.summary();
        // The page's size is bounded by that of two units.
        let units = self.units.len();
        if units > 2 {
            let detail = (self.detail * 2 / units).max(256);
            for unit in self.units.values_mut() {
                let tracks = unit.logs.iter_mut().flatten().flat_map(UnitPlot::tracks);
                tracks.for_each(|track| track.reduce(detail));
                if let Some(difference) = &mut unit.difference {
                    difference.track.reduce(detail);
                }
            }
        }
        let units: Vec<_> = self.units.into_iter().collect();
        let page = layout::page(units, &summary).ok_or(Error::Nothing("draw"))?;
        Ok((page, summary))
    }

    fn summary(&self) -> PlotSummary {
        let (mut words, mut refused_ticks) = (Vec::new(), 0);
        for source in &self.logs {
            let Some((stream, _)) = &source.corrects else { continue };
            let counters = stream.unit().counters();
            refused_ticks += counters.gyro_ticks_in.saturating_sub(counters.ticks_out);
            words.extend(troubles(stream, 0).iter().map(|trouble| format!("{}: {trouble}", source.log.name)));
        }
        let of = |shown: &UnitPlot| UnitSummary {
            raw_ticks: shown.gyro.as_ref().map_or(0, |raw| raw.track.ticks()),
            corrected_ticks: shown.corrected.as_ref().map_or(0, track::Track::ticks),
            uncalibrated_ticks: shown.uncalibrated,
            missed_ticks: shown.missed,
            marks: shown.happenings.len() as u64,
            marks_left_out: shown.unlisted,
            unreadable_messages: shown.unreadable,
        };
        let units = self.units.iter().map(|(unit, shown)| {
            (unit.to_string(), shown.logs.iter().map(|shown| shown.as_ref().map(of)).collect())
        });
        let differences = self.units.iter().filter_map(|(unit, shown)| {
            let difference = shown.difference.as_ref().filter(|_| {
                shown.logs.iter().flatten().filter(|shown| shown.corrected.is_some()).count() == 2
            })?;
            Some((unit.to_string(), difference.summary))
        });
        PlotSummary {
            logs: self.logs.iter().map(|source| source.log.name.clone()).collect(),
            own_serials: self.logs.iter().map(|source| source.own.as_ref().map(UnitId::to_string)).collect(),
            reading: self.logs.iter().map(|source| source.log.messages.report()).collect(),
            units: units.collect(),
            differences: differences.collect(),
            units_left_out: self.left_out.len() as u64,
            second_moved_ns: self.second_moved_ns,
            troubles: words,
            refused_ticks,
        }
    }
}
