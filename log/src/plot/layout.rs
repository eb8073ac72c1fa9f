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
        let difference = difference.filter(|difference| both && difference.summary.common_ticks > 0);
        let unit = summary.serials(unit.as_str());
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
    fn chart(&mut self, unit: &str, logs: Vec<Option<UnitPlot>>, difference: Option<Difference>) -> Chart {
        let mut parts = Parts::default();
        let mut marks = Vec::new();
        for (log, shown) in logs.into_iter().enumerate() {
            let Some(mut shown) = shown else { continue };
            self.marks(log, &mut shown, &mut marks);
            self.add(log, shown, &mut parts);
        }
        let [rates, forces, angles] = self.differences(difference);
        let one = |title: &str, unit, height, curves| vec![Panel::of(title, unit, height, curves)];
        let each = |what: &str, unit: &str, height, curves: [Vec<Series>; 3]| -> Vec<Panel> {
            let axes = AXES.iter().zip(curves);
            axes.map(|(axis, curves)| Panel::of(format!("{what} {axis}"), unit, height, curves)).collect()
        };
        let unplaced = parts.unplaced.into_iter();
        let panels = [
            lanes("state and calibration", parts.lanes),
            each("rate about", "°/h", 150, parts.rates),
            one("difference of rates", "°/h", 110, rates),
            one("accumulated difference of angles", "″", 110, angles),
            each("specific force along", "m/s²", 110, parts.forces),
            one("difference of specific forces", "m/s²", 110, forces),
            unplaced.map(|(title, unit, curves)| Panel::of(title, unit, 150, curves)).collect(),
            one("temperatures applied", "°C", 110, parts.applied),
            one("temperature readings", "as sent", 110, parts.readings),
            lanes("modes and flags", parts.flags),
        ];
        let has_content = |panel: &Panel| match &panel.content {
            Content::Series(curves) => !curves.is_empty(),
            Content::Lanes(lanes) => !lanes.is_empty(),
        };
        let of = if self.both { "A and B" } else { "the log" };
        Chart {
            caption: format!(
                "Unit {unit} in {of}. Bands reach from the smallest to the largest value in a column, the line is \
                 the mean. Raw: readings along the input axes, with nominal scale factors where a calibration for them is known."
            ),
            x: Axis { within: Some([0.0, self.seconds(self.end_ns)]), ..Axis::of("time", "s") },
            panels: panels.into_iter().flatten().filter(has_content).collect(),
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
            // A document for other sensors says nothing of these.
            let scale = nominal.map(|nominal| nominal.gyro.clone()).filter(|scale| scale.is_of(&gyro));
            let means = || (gyro.kind == OutputKind::Mean).then(|| Scale::of_means(gyro.sensors, DEG_PER_H));
            let scale = scale.or_else(means);
            self.raw(log, gyro, scale, true, parts);
        }
        if let Some(accel) = shown.accel {
            let scale = nominal.and_then(|nominal| nominal.accel.clone()).filter(|scale| scale.is_of(&accel));
            self.raw(log, accel, scale, false, parts);
        }
        if let Some(track) = shown.corrected {
            self.corrected(log, track, modes_told, parts);
        }
        for (tracks, curves, what, unit) in [
            (shown.applied, &mut parts.applied, "temperature applied", "°C"),
            (shown.readings, &mut parts.readings, "temperature reading", "as sent"),
        ] {
            for ((ink, dashes), (channel, track)) in several(curves.len()).zip(tracks) {
                let row = format!("{prefix}{what} {channel} ({unit})");
                let name = format!("{prefix}{channel}");
                let curve = self.curve(&track.finish(self.begin_ns), (0, 1.0), row, name, ink);
                curves.extend(curve.map(|curve| Series { dashes, ..curve }));
            }
        }
    }

    fn corrected(&mut self, log: usize, track: Track, modes_told: bool, parts: &mut Parts) {
        let prefix = self.prefix(log);
        let ink = if log == 0 { Ink::Corrected } else { Ink::Other };
        let finished = track.finish(self.begin_ns);
        let places = parts.rates.iter_mut().chain(&mut parts.forces).zip(AXES.iter().chain(&AXES));
        for (index, (curves, axis)) in places.enumerate() {
            let what = if index < 3 { "rate about" } else { "specific force along" };
            let unit = if index < 3 { "°/h" } else { "m/s²" };
            let row = format!("{prefix}corrected {what} {axis} ({unit})");
            curves.extend(self.curve(&finished, (index, 1.0), row, format!("{prefix}corrected"), ink));
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
        for (first, kind) in [(GYRO_FLAGS, "gyro"), (ACCEL_FLAGS, "accel")] {
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
        bit_lanes(&finished, bits, &mut parts.flags);
    }

    /// Adds raw readings: to the axes that they are along, or to a panel of their own.
    fn raw(&mut self, log: usize, raw: RawTrack, scale: Option<Scale>, of_gyros: bool, parts: &mut Parts) {
        let prefix = self.prefix(log);
        let (sensor, along, unit, placed) = if of_gyros {
            ("gyro", "rate about", "°/h", &mut parts.rates)
        } else {
            ("accelerometer", "specific force along", "m/s²", &mut parts.forces)
        };
        let RawTrack { kind, sensors, track, .. } = raw;
        let unit = if scale.is_some() { unit } else { unscaled(kind) };
        let scale = scale.unwrap_or(Scale { kind, factors: vec![1.0; sensors], axes: Vec::new() });
        let finished = track.finish(self.begin_ns);
        let title = format!("raw {sensor}s");
        let at = parts.unplaced.iter().position(|(known, other, _)| *known == title && *other == unit);
        let at = at.unwrap_or_else(|| {
            parts.unplaced.push((title, unit, Vec::new()));
            parts.unplaced.len() - 1
        });
        let Some((_, _, own)) = parts.unplaced.get_mut(at) else { return };
        for (index, several) in (0..sensors).zip(several(own.len())) {
            let factor = scale.factors.get(index).copied().unwrap_or(f64::NAN);
            let axis = scale.axes.get(index).copied();
            let place = axis.and_then(|axis| AXES.get(axis).zip(placed.get_mut(axis)));
            let (what, name, (ink, dashes), curves) = if let Some((axis, curves)) = place {
                let ink = if log == 0 { Ink::Raw } else { Ink::Fourth };
                (format!("{along} {axis}"), format!("{prefix}raw"), (ink, 0), curves)
            } else {
                let what = format!("{sensor} {}", index + 1);
                (what.clone(), format!("{prefix}{what}"), several, &mut *own)
            };
            let row = format!("{prefix}raw {what} ({unit})");
            let curve = self.curve(&finished, (index, factor), row, name, ink);
            curves.extend(curve.map(|curve| Series { dashes, ..curve }));
        }
        let bits = [
            (MODE_PLUS, "mode +1", Ink::Second),
            (MODE_MINUS, "mode −1", Ink::Third),
            (SWITCH, "switch commanded", Ink::Truth),
        ];
        let bits = bits.map(|(bit, name, ink)| (bit, format!("{prefix}{name}"), ink));
        bit_lanes(&finished, bits.to_vec(), &mut parts.flags);
    }

    /// Curves of what the logs differ by: rates, specific forces, angles.
    fn differences(&mut self, difference: Option<Difference>) -> [Vec<Series>; 3] {
        let mut curves = [const { Vec::new() }; 3];
        let Some(Difference { track, .. }) = difference else { return curves };
        let kinds = [("rate about", "°/h"), ("specific force along", "m/s²"), ("angle about", "″")];
        let finished = track.finish(self.begin_ns);
        for (kind, ((what, unit), curves)) in kinds.iter().zip(&mut curves).enumerate() {
            for ((axis, name), ink) in AXES.iter().enumerate().zip(Ink::several()) {
                let row = format!("B − A {what} {name} ({unit})");
                let which = (3 * kind + axis, 1.0);
                curves.extend(self.curve(&finished, which, row, format!("B − A {name}"), ink));
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

    /// A curve of the values of one quantity, scaled, and its row in the table; `None` where there is none.
    fn curve(
        &mut self,
        finished: &Finished,
        (index, scale): (usize, f64),
        row: String,
        name: String,
        ink: Ink,
    ) -> Option<Series> {
        let Overall { min, max, mean } = finished.overall(index, scale)?;
        if mean.is_finite() {
            self.rows.push(vec![row, figure(min), figure(mean), figure(max)]);
        }
        Some(Series { name, ink, form: Form::Line, dashes: 0, samples: finished.samples(index, scale)? })
    }
}

/// Colours and dashes of curves in a panel that has so many: behind each six, and for another log, the colours begin anew with other
/// dashes.
pub(super) fn several(before: usize) -> impl Iterator<Item = (Ink, usize)> {
    let colours = Ink::SEVERAL.len();
    let first = before.next_multiple_of(colours);
    Ink::several().zip(first..).map(move |(ink, number)| (ink, number / colours))
}

/// Lanes of the bits that occurred.
fn bit_lanes(finished: &Finished, bits: Vec<(u32, String, Ink)>, lanes: &mut Vec<Lane>) {
    for (bit, name, ink) in bits {
        if finished.occurred >> bit & 1 == 1 {
            let (bits, places) = (std::sync::Arc::clone(&finished.bits), finished.places.clone());
            lanes.push(Lane::Bit { name, ink, bit, bits, places });
        }
    }
}

/// A panel of lanes.
fn lanes(title: &str, lanes: Vec<Lane>) -> Vec<Panel> {
    vec![Panel { content: Content::Lanes(lanes), ..Panel::of(title, "", 0, Vec::new()) }]
}
