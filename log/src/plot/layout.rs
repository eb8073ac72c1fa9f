//! Which panel shows what.

mod words;

use isotherm_correction::sample::{OutputKind, SensorFlags, TickFlags};
use isotherm_protocol::key::UnitId;

use super::difference::Difference;
use super::nominal::{DEG_PER_H, Scale, unscaled};
use super::reading::UnitLogs;
use super::track::{Finished, Overall, Track};
use super::unit::{ACCEL_FLAGS, GYRO_FLAGS, MODE_MINUS, MODE_PLUS, RawTrack, SWITCH, Since, UnitPlot};
use super::{AXES, PlotSummary};
use crate::date::{date, seconds};
use isotherm_pages::{Axis, Chart, Content, Form, Ink, Lane, Mark, Page, Panel, Series, Stretch, Table};
use words::{duration, figure, remarks, results};

/// What the page shows; `None` where there is nothing.
pub(super) fn page(units: Vec<(UnitId, UnitLogs)>, summary: &PlotSummary) -> Option<Page> {
    let mut page = Page::new(&summary.logs.join(" and "));
    page.headlines(&results(summary));
    for words in remarks(summary) {
        page.paragraph(&words);
    }
    let mut drawn = false;
    for (unit, UnitLogs { mut logs, difference }) in units {
        let ranges = logs.iter_mut().flatten().flat_map(UnitPlot::tracks).filter_map(|track| track.range());
        let range = ranges.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
        let Some([begin_ns, end_ns]) = range else { continue };
        drawn = true;
        let both = logs.iter().flatten().count() == 2;
        let mut drawing = Drawing { begin_ns, end_ns, both, rows: Vec::new() };
        let difference = difference.filter(|difference| both && difference.common > 0);
        let chart = drawing.chart(&unit, logs, difference);
        page.heading(&format!("Unit {unit}"));
        page.paragraph(&format!(
            "From {} (time 0 is {begin_ns} ns on the producer's clock), {} are shown.",
            date(begin_ns),
            duration(seconds(end_ns.saturating_sub(begin_ns)))
        ));
        page.chart(&chart);
        let head = ["", "min", "mean", "max"].map(str::to_owned).to_vec();
        page.table(&Table { head, rows: drawing.rows });
    }
    drawn.then_some(page)
}

/// A chart that is being laid out.
struct Drawing {
    begin_ns: i64,
    end_ns: i64,
    /// There are two logs.
    both: bool,
    /// Rows of the table.
    rows: Vec<Vec<String>>,
}

/// What one log has for the panels.
#[derive(Default)]
struct Parts {
    rates: [Vec<Series>; 3],
    forces: [Vec<Series>; 3],
    /// Raw readings that belong to no axis: title, unit, curves.
    unplaced: Vec<(String, &'static str, Vec<Series>)>,
    readings: Vec<Series>,
    applied: Vec<Series>,
    lanes: Vec<Lane>,
    flags: Vec<Lane>,
}

impl Drawing {
    fn chart(&mut self, unit: &UnitId, logs: Vec<Option<UnitPlot>>, difference: Option<Difference>) -> Chart {
        let mut parts = Parts::default();
        let mut marks = Vec::new();
        for (log, shown) in logs.into_iter().enumerate() {
            let Some(mut shown) = shown else { continue };
            self.marks(log, &mut shown, &mut marks);
            self.add(log, shown, &mut parts);
        }
        let [rates, forces, angles] = self.differences(difference);
        let mut panels = Vec::new();
        lanes(&mut panels, "state and calibration", parts.lanes);
        let each =
            |what: &str, way: &str, unit: &str, height, curves: [Vec<Series>; 3], panels: &mut Vec<Panel>| {
                for (axis, curves) in AXES.iter().zip(curves) {
                    series(panels, format!("{what} {way} {axis}"), unit, height, curves);
                }
            };
        each("rate", "about", "°/h", 150, parts.rates, &mut panels);
        series(&mut panels, "difference of rates".to_owned(), "°/h", 110, rates);
        series(&mut panels, "accumulated difference of angles".to_owned(), "″", 110, angles);
        each("specific force", "along", "m/s²", 110, parts.forces, &mut panels);
        series(&mut panels, "difference of specific forces".to_owned(), "m/s²", 110, forces);
        for (title, unit, curves) in parts.unplaced {
            series(&mut panels, title, unit, 150, curves);
        }
        series(&mut panels, "temperatures applied".to_owned(), "°C", 110, parts.applied);
        series(&mut panels, "temperature readings".to_owned(), "as sent", 110, parts.readings);
        lanes(&mut panels, "modes and flags", parts.flags);
        let of = if self.both { "A and B" } else { "the log" };
        Chart {
            caption: format!(
                "Unit {unit} in {of}. Bands reach from the smallest to the largest value in a column, the line is \
                 the mean. Raw: readings with nominal scale factors, along the input axes."
            ),
            x: Axis::of("time", "s"),
            panels,
            marks,
        }
    }

    /// "A " or "B " where there are two logs.
    fn prefix(&self, log: usize) -> &'static str {
        match (self.both, log) {
            (false, _) => "",
            (true, 0) => "A ",
            (true, _) => "B ",
        }
    }

    /// Seconds on the axis.
    fn seconds(&self, at_ns: i64) -> f64 {
        seconds(at_ns.saturating_sub(self.begin_ns))
    }

    fn marks(&self, log: usize, shown: &mut UnitPlot, marks: &mut Vec<Mark>) {
        // Where corrected ticks tell from when on a calibration is in force, when it was given says nothing more.
        let told = shown.corrected.is_some();
        for happening in std::mem::take(&mut shown.happenings) {
            if told && happening.kind == "calibration given" {
                continue;
            }
            marks.push(Mark {
                x: self.seconds(happening.at_ns),
                kind: happening.kind.to_owned(),
                words: format!("{}{}", self.prefix(log), happening.words),
                ink: happening.ink,
            });
        }
        marks.sort_by(|a, b| a.x.total_cmp(&b.x));
    }

    /// Adds what one log has.
    fn add(&mut self, log: usize, shown: UnitPlot, parts: &mut Parts) {
        let prefix = self.prefix(log);
        for (name, list) in [("state", &shown.states), ("calibration", &shown.revisions)] {
            if !list.is_empty() {
                parts.lanes.push(Lane::Stretches {
                    name: format!("{prefix}{name}"),
                    stretches: self.stretches(list),
                });
            }
        }
        let nominal = shown.nominal.as_ref();
        let mut modes_told = false;
        if let Some(gyro) = shown.gyro {
            modes_told = true;
            let scale = match (nominal, gyro.kind) {
                (Some(nominal), _) => Some(nominal.gyro.clone()),
                (None, OutputKind::Mean) => Some(Scale::of_means(gyro.sensors, DEG_PER_H)),
                (None, OutputKind::Counts) => None,
            };
            let what = ("gyro", "rate about", "°/h");
            self.raw(log, gyro, scale, what, &mut parts.rates, &mut parts.unplaced, &mut parts.flags);
        }
        if let Some(accel) = shown.accel {
            let scale = nominal.and_then(|nominal| nominal.accel.clone());
            let what = ("accelerometer", "specific force along", "m/s²");
            self.raw(log, accel, scale, what, &mut parts.forces, &mut parts.unplaced, &mut parts.flags);
        }
        if let Some(track) = shown.corrected {
            self.corrected(log, track, modes_told, parts);
        }
        for (tracks, curves, what, unit) in [
            (shown.applied, &mut parts.applied, "temperature applied", "°C"),
            (shown.readings, &mut parts.readings, "temperature reading", "as sent"),
        ] {
            for (index, (channel, track)) in tracks.into_iter().enumerate() {
                let ink = Ink::several().nth(index + 2 * log).unwrap_or(Ink::First);
                self.row(format!("{prefix}{what} {channel} ({unit})"), track.overall(0, 1.0));
                let finished = track.finish(self.begin_ns);
                curves.extend(curve(&finished, 0, 1.0, format!("{prefix}{channel}"), ink));
            }
        }
    }

    fn corrected(&mut self, log: usize, track: Track, modes_told: bool, parts: &mut Parts) {
        let prefix = self.prefix(log);
        let ink = if log == 0 { Ink::Corrected } else { Ink::Other };
        for (index, axis) in AXES.iter().chain(&AXES).enumerate() {
            let what = if index < 3 { "rate about" } else { "specific force along" };
            let unit = if index < 3 { "°/h" } else { "m/s²" };
            self.row(format!("{prefix}corrected {what} {axis} ({unit})"), track.overall(index, 1.0));
        }
        let occurred = track.occurred();
        let finished = track.finish(self.begin_ns);
        for (index, curves) in parts.rates.iter_mut().chain(&mut parts.forces).enumerate() {
            curves.extend(curve(&finished, index, 1.0, format!("{prefix}corrected"), ink));
        }
        let named = |bit, name: String, ink| (bit, format!("{prefix}{name}"), ink);
        let mut bits = Vec::new();
        if !modes_told {
            bits.push(named(MODE_PLUS, "mode +1".to_owned(), Ink::Second));
            bits.push(named(MODE_MINUS, "mode −1".to_owned(), Ink::Third));
        }
        for (name, flag) in TickFlags::all().iter_names() {
            bits.push(named(flag.bits().trailing_zeros(), name.to_owned(), Ink::Alert));
        }
        for (first, kind) in [(GYRO_FLAGS, "gyro"), (ACCEL_FLAGS, "accelerometer")] {
            for (name, flag) in
                SensorFlags::all().iter_names().filter(|(_, flag)| *flag != SensorFlags::VALID)
            {
                bits.push(named(
                    first + flag.bits().trailing_zeros() - 1,
                    format!("{kind} {name}"),
                    Ink::Raw,
                ));
            }
        }
        bit_lanes(&finished, occurred, bits, &mut parts.flags);
    }

    /// Adds raw readings: to the axes that they are along, or to a panel of their own.
    #[expect(clippy::too_many_arguments, reason = "the places where they may go, each by its name")]
    fn raw(
        &mut self,
        log: usize,
        raw: RawTrack,
        scale: Option<Scale>,
        (sensor, along, unit): (&str, &str, &'static str),
        axes: &mut [Vec<Series>; 3],
        unplaced: &mut Vec<(String, &'static str, Vec<Series>)>,
        flags: &mut Vec<Lane>,
    ) {
        let prefix = self.prefix(log);
        let RawTrack { kind, sensors, track, .. } = raw;
        let occurred = track.occurred();
        let unit = if scale.is_some() { unit } else { unscaled(kind) };
        let scale = scale.unwrap_or(Scale { factors: vec![1.0; sensors], axes: Vec::new() });
        let factor = |index: usize| scale.factors.get(index).copied().unwrap_or(f64::NAN);
        for index in 0..sensors {
            let what = match scale.axes.get(index).and_then(|axis| AXES.get(*axis)) {
                Some(name) => format!("{along} {name}"),
                None => format!("{sensor} {}", index + 1),
            };
            self.row(format!("{prefix}raw {what} ({unit})"), track.overall(index, factor(index)));
        }
        let finished = track.finish(self.begin_ns);
        let mut own = Vec::new();
        for index in 0..sensors {
            let ink = if log == 0 { Ink::Raw } else { Ink::Fourth };
            if let Some(curves) = scale.axes.get(index).and_then(|axis| axes.get_mut(*axis)) {
                curves.extend(curve(&finished, index, factor(index), format!("{prefix}raw"), ink));
            } else {
                let ink = Ink::several().nth(index + 3 * log).unwrap_or(Ink::First);
                let name = format!("{prefix}{sensor} {}", index + 1);
                own.extend(curve(&finished, index, factor(index), name, ink));
            }
        }
        let title = format!("raw {sensor}s");
        match unplaced.iter_mut().find(|(known, other, _)| *known == title && *other == unit) {
            Some((_, _, curves)) => curves.extend(own),
            None => unplaced.push((title, unit, own)),
        }
        let bits = [
            (MODE_PLUS, "mode +1", Ink::Second),
            (MODE_MINUS, "mode −1", Ink::Third),
            (SWITCH, "switch commanded", Ink::Truth),
        ];
        let bits = bits.map(|(bit, name, ink)| (bit, format!("{prefix}{name}"), ink));
        bit_lanes(&finished, occurred, bits.to_vec(), flags);
    }

    /// Curves of what the logs differ by: rates, specific forces, angles.
    fn differences(&mut self, difference: Option<Difference>) -> [Vec<Series>; 3] {
        let mut curves = [const { Vec::new() }; 3];
        let Some(Difference { track, .. }) = difference else { return curves };
        let kinds = [("rate about", "°/h"), ("specific force along", "m/s²"), ("angle about", "″")];
        for (kind, (what, unit)) in kinds.iter().enumerate() {
            for (axis, name) in AXES.iter().enumerate() {
                self.row(format!("B − A {what} {name} ({unit})"), track.overall(3 * kind + axis, 1.0));
            }
        }
        let finished = track.finish(self.begin_ns);
        for (kind, curves) in curves.iter_mut().enumerate() {
            for ((axis, name), ink) in AXES.iter().enumerate().zip(Ink::several()) {
                curves.extend(curve(&finished, 3 * kind + axis, 1.0, format!("B − A {name}"), ink));
            }
        }
        curves
    }

    fn stretches(&self, list: &[Since]) -> Vec<Stretch> {
        let ends = list.iter().skip(1).map(|next| next.at_ns).chain([self.end_ns]);
        let stretch = |(since, end): (&Since, i64)| Stretch {
            from: self.seconds(since.at_ns),
            to: self.seconds(end),
            label: since.label.clone(),
            ink: since.ink,
        };
        list.iter().zip(ends).map(stretch).collect()
    }

    /// Adds a row to the table.
    fn row(&mut self, name: String, overall: Option<Overall>) {
        if let Some(Overall { min, max, mean }) = overall.filter(|overall| overall.mean.is_finite()) {
            self.rows.push(vec![name, figure(min), figure(mean), figure(max)]);
        }
    }
}

/// A curve of a track; `None` where it has no such value.
fn curve(finished: &Finished, index: usize, scale: f64, name: String, ink: Ink) -> Option<Series> {
    Some(Series { name, ink, form: Form::Line, samples: finished.samples(index, scale)? })
}

/// Lanes of the bits that occurred.
fn bit_lanes(finished: &Finished, occurred: u32, bits: Vec<(u32, String, Ink)>, lanes: &mut Vec<Lane>) {
    for (bit, name, ink) in bits {
        if occurred >> bit & 1 == 1 {
            let (bits, places) = (std::sync::Arc::clone(&finished.bits), finished.places.clone());
            lanes.push(Lane::Bit { name, ink, bit, bits, places });
        }
    }
}

/// Adds a panel with curves, where there are any.
fn series(panels: &mut Vec<Panel>, title: String, unit: &str, height: u32, curves: Vec<Series>) {
    if !curves.is_empty() {
        let content = Content::Series(curves);
        panels.push(Panel { title, unit: unit.to_owned(), height, logarithmic: false, content });
    }
}

/// Adds a panel with lanes, where there are any.
fn lanes(panels: &mut Vec<Panel>, title: &str, lanes: Vec<Lane>) {
    if !lanes.is_empty() {
        let content = Content::Lanes(lanes);
        panels.push(Panel {
            title: title.to_owned(),
            unit: String::new(),
            height: 0,
            logarithmic: false,
            content,
        });
    }
}
