//! From runs to a document with the ratio of the board, and its report.

use isotherm_pages::{Axis, Chart, Ink, Panel, Series};
use isotherm_protocol::document::{AccelSensor, Document};

use super::model::{Ratio, Rows};
use crate::axes::{main_axis, output_name};
use crate::document::{Written, about, accelerometers, tidy};
use crate::error::Error;
use crate::finding::AccelKind;
use crate::fits::thermal::samples::Samples;
use crate::fits::thermal::target::axes;
use crate::fits::thermal::{Site, Stand};
use crate::numbers::{dot, hull, once_each};
use crate::report::{Curve, Judged, Report, Rest, Sigmas, Verdict, beside, fixed, judge, per_deg_c, short};
use crate::runs::Run;
use crate::runs::table::Rows as Windows;

/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 220;
/// Points of a curve over temperature.
const POINTS: u32 = 60;

/// What the fit starts from.
#[derive(Debug, Clone)]
pub struct Wanted<'a> {
    /// Runs.
    pub runs: &'a [Run],
    /// Runs that the fit does not see and is judged on.
    pub judges: &'a [Run],
    /// How the unit stands in all of them, those of the fit first.
    pub stands: &'a [Stand],
    /// Document with the accelerometers and the channel of their board.
    pub base: &'a Document,
    /// Temperature of the board at which r is 1 (°C); where absent that of the base, or the middle of what was seen.
    pub reference_deg_c: Option<f64>,
    /// Windows (s).
    pub window_s: f64,
}

impl Wanted<'_> {
    /// Temperature of the board at which r of an accelerometer is 1 (°C): the stated one, else where it was.
    fn reference_of(&self, sensor: &AccelSensor) -> Option<f64> {
        self.reference_deg_c.or(about(sensor.board_ratio_error.as_ref()))
    }
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Made {
    /// The document.
    pub written: Written,
    /// The ratio of each accelerometer, or why there is none.
    pub found: Vec<Result<Ratio, AccelKind>>,
    /// The report.
    pub report: Report,
}

/// Fits the ratio of the board of each accelerometer.
///
/// # Errors
/// [`Error::Refused`] and [`Error::Found`] with every reason; [`Error::Log`], [`Error::Document`].
pub fn fit(wanted: &Wanted<'_>) -> Result<Made, Error> {
    let sensors = accelerometers(wanted.base);
    if sensors.is_empty() {
        let words = "the document has no accelerometers: add [accel] with their channels and board_channel";
        return Err(Error::refused(words));
    }
    let mut bare = wanted.base.clone();
    for sensor in bare.accel.iter_mut().flat_map(|accel| &mut accel.sensor) {
        sensor.board_ratio_error = None;
    }
    let mut samples = Vec::new();
    for run in wanted.runs {
        let series = run.series()?;
        samples.push(Samples::of(run, &series, &bare, wanted.window_s)?);
    }
    let mut found: Vec<Result<Ratio, AccelKind>> = sensors
        .iter()
        .enumerate()
        .map(|(index, sensor)| {
            let (rows, channels) = rows(wanted, &samples, index, sensor)?;
            rows.fit(wanted.reference_of(sensor), &channels)
        })
        .collect();
    if found.iter().all(Result::is_err) {
        let reasons =
            sensors.iter().zip(found).filter_map(|(sensor, found)| Some(found.err()?.of(&sensor.name)));
        return Err(Error::Found(reasons.collect()));
    }
    let given = Written::of(wanted.base)?;
    let mut written = Written::of(&with(wanted.base, &found))?;
    let Judged { mut curves, mut troubles } = judged(wanted, [&given, &written])?;
    let mains: Vec<usize> =
        wanted.base.accel.iter().flat_map(|accel| accel.orientation.rows.iter().map(main_axis)).collect();
    let mut verdicts = Curve::verdicts(&curves);
    let refused = |verdict: &&Verdict| !verdict.accepted;
    let is_worse =
        |axis| verdicts.iter().filter(refused).any(|verdict| verdict.of == output_name(false, axis));
    if (0..3).any(is_worse) {
        let fitted = found.iter_mut().zip(&mains).filter(|(found, _)| found.is_ok());
        for (found, axis) in fitted.filter(|(_, axis)| is_worse(**axis)) {
            *found = Err(AccelKind::MadeWorse { axis: *axis });
        }
        written = Written::of(&with(wanted.base, &found))?;
        let again = judged(wanted, [&given, &written])?;
        (curves, troubles) = (again.curves, once_each([troubles, again.troubles].concat()));
        verdicts = beside(&verdicts, Curve::verdicts(&curves));
    }
    let mut report =
        Report::new("Ratio of the accelerometers' board over its temperature", &wanted.base.unit);
    report.residuals = curves;
    report.verdicts = verdicts;
    report.warnings = troubles;
    tell(&mut report, (wanted, sensors, &mains), &found);
    Ok(Made { written, found, report })
}

/// What the windows of all runs have of one accelerometer, and the channels of its board and its own.
fn rows(
    wanted: &Wanted<'_>,
    samples: &[Samples],
    index: usize,
    sensor: &AccelSensor,
) -> Result<(Rows, [String; 2]), AccelKind> {
    let board = sensor.board_channel.clone().ok_or(AccelKind::NoBoardChannel)?;
    let mut rows = Rows::default();
    for (number, (run, stand)) in samples.iter().zip(wanted.stands).enumerate() {
        let Site::Known { force_m_per_s2: Some(force), .. } = &stand.site else { continue };
        let turned = wanted.base.accel.as_ref().map(|accel| axes(&accel.orientation, index, run));
        let along = |row: &[f64; 3]| dot(*force, *row);
        let input: Vec<f64> = turned.iter().flatten().map(along).collect();
        let of = |channel: &String| {
            run.deg_c.get(channel).ok_or_else(|| AccelKind::NoReadings { channel: channel.clone() })
        };
        let board_deg_c = of(&board)?;
        let count = board_deg_c.len();
        let own = sensor.channel.as_ref().map(of).transpose()?.cloned();
        // An accelerometer without a channel is one that nothing warms.
        rows.own_deg_c.extend(own.unwrap_or_else(|| vec![wanted.base.temperature.assumed_deg_c; count]));
        rows.board_deg_c.extend(board_deg_c);
        let shown = run.forces.get(index).ok_or(AccelKind::FewWindows { windows: 0 })?;
        rows.error.extend(shown.iter().zip(&input).map(|(shown, input)| shown - input));
        rows.input.extend(input);
        rows.run.extend(std::iter::repeat_n(number, count));
    }
    let own = sensor.channel.clone().unwrap_or_default();
    Ok((rows, [board, own]))
}

/// The document with what was found.
fn with(base: &Document, found: &[Result<Ratio, AccelKind>]) -> Document {
    let mut document = base.clone();
    let sensors = document.accel.iter_mut().flat_map(|accel| &mut accel.sensor);
    for (sensor, found) in sensors.zip(found) {
        if let Ok(found) = found {
            sensor.board_ratio_error = Some(found.curve());
        }
    }
    document
}

/// Forces along the case axes before and after, each run less its mean, which the ratio does not know.
fn judged(wanted: &Wanted<'_>, documents: [&Written; 2]) -> Result<Judged, Error> {
    let of_run = |_, _: &Run| Ok((Rest::default(), Windows::valid(wanted.window_s), "accelerometer"));
    judge((wanted.runs, wanted.judges), documents, of_run)
}

/// Puts into the report what was found of each accelerometer.
fn tell(
    report: &mut Report,
    (wanted, sensors, mains): (&Wanted<'_>, &[AccelSensor], &[usize]),
    found: &[Result<Ratio, AccelKind>],
) {
    let mut curves = Vec::new();
    for (((sensor, found), axis), ink) in sensors.iter().zip(found).zip(mains).zip(Ink::several()) {
        let name = &sensor.name;
        match found {
            Err(kind) => {
                report.warnings.push(format!("{}; its ratio does not change", kind.clone().of(name)));
                let verdict =
                    report.verdicts.iter_mut().find(|verdict| verdict.of == output_name(false, *axis));
                if let Some(verdict) = verdict.filter(|verdict| verdict.accepted) {
                    *verdict = verdict.clone().refused(kind.to_string());
                }
            }
            Ok(ratio) => {
                report.warnings.extend(ratio.doubt.clone().map(|kind| kind.of(name).to_string()));
                for (power, (x, sigma)) in ratio.x.iter().zip(&ratio.sigmas).enumerate() {
                    let unit = per_deg_c("ppm", power + 1);
                    let what = format!("accelerometer {name} board ratio, power {}", power + 1);
                    report.coefficient(what, unit, -1e6 * x, 1e6 * sigma);
                }
                let [low, high] = ratio.range_deg_c;
                report.notes.push(format!(
                    "Accelerometer {name}: r − 1 is {} to {} ppm from {} to {} °C of the board{}.",
                    short(ratio.error_ppm(low)),
                    short(ratio.error_ppm(high)),
                    fixed(low, 1),
                    fixed(high, 1),
                    if ratio.beside_own {
                        ", fitted together with slopes of K and S, which are not written"
                    } else {
                        ""
                    }
                ));
                let at = |step: u32| low + (high - low) * f64::from(step) / f64::from(POINTS);
                let points = (0..=POINTS).map(|step| (at(step), ratio.error_ppm(at(step))));
                curves.push(Series::line(format!("accelerometer {name}"), ink, points));
            }
        }
    }
    report.notes.push(format!("Each of {} runs less its mean.", wanted.runs.len()));
    let mut middle = sensors.iter().zip(found).filter(|(sensor, _)| wanted.reference_of(sensor).is_none());
    if let Some(ratio) = middle.find_map(|(_, found)| found.as_ref().ok()) {
        report.warnings.push(format!(
            "r is 1 at {} °C, the middle of the board's range: the scale factors of the document must hold there; if they were \
             calibrated with the board at another temperature, give it with --reference",
            short(ratio.reference_deg_c)
        ));
    }
    let panel = Panel::of("r − 1", "ppm", HEIGHT, curves);
    let x = Axis::of("temperature of the board", "°C");
    let chart = Chart::of("Ratio of the board over its temperature.", x, vec![panel]);
    report.charts.push(("Ratio of the board".to_owned(), chart));
}

impl Made {
    fn each(&self) -> impl Iterator<Item = (&AccelSensor, &Ratio)> {
        let sensors = accelerometers(&self.written.document);
        sensors.iter().zip(&self.found).filter_map(|(sensor, found)| Some((sensor, found.as_ref().ok()?)))
    }

    /// Standard errors of the ratios, by powers from 0.
    pub fn sigmas(&self) -> Sigmas {
        let mut sigmas = Sigmas::default();
        for (sensor, ratio) in self.each() {
            let ppm = std::iter::once(0.0).chain(ratio.sigmas.iter().map(|sigma| tidy(1e6 * sigma)));
            sigmas.put(("accel", &sensor.name, "board_ratio_error"), ppm.collect());
        }
        sigmas
    }

    /// Lowest and highest temperature of the boards (°C).
    pub fn range_deg_c(&self) -> Option<[f64; 2]> {
        let ranges = self.each().map(|(_, ratio)| ratio.range_deg_c);
        hull(ranges).map(|range| range.map(tidy))
    }
}
