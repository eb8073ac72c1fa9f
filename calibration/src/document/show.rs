//! A document in people's words and as curves.

mod about;
pub(crate) mod charts;
mod parts;
pub mod terms;

use isotherm_correction::calibration::Steady;
use isotherm_correction::channel::ThermalState;
use isotherm_correction::sample::ChannelName;
use isotherm_correction::units::{AngularRate, SpecificForce};
use isotherm_protocol::document::Document;
use serde_json::{Value, json};

use crate::document::{Written, accelerometers};
use crate::error::Error;
use crate::numbers::{hull, places};
use crate::report::{Report, alike, short};
use terms::{HOURS, Term, terms, tree};

/// Temperatures of the tables.
const COLUMNS: usize = 7;
/// Temperatures that are shown where no term has a range (°C).
const USUAL: [f64; 2] = [-40.0, 60.0];
/// Digits that the change of a term over the range has in a table.
const RANGE_DIGITS: f64 = 3.0;
/// Ramps that the sums are shown on (°C/min).
const RAMPS: [f64; 3] = [0.0, 1.0, -1.0];

/// Arguments of terms: symbol, what the axis of a diagram is called, how headings of diagrams and of tables go on.
const ARGUMENTS: [[&str; 4]; 4] = [
    ["°C", "temperature", "temperature", "temperature (in brackets: clamped, outside the fitted range)"],
    ["°C/s", "rate of temperature", "rate of temperature", "the temperature's rate"],
    ["°C/s²", "acceleration of temperature", "its acceleration", "the temperature's acceleration"],
    [HOURS, "time since turn-on", "time since turn-on", "the time since turn-on"],
];

/// Shows a document.
///
/// # Errors
/// [`Error::Document`] where it cannot be written as a tree.
pub fn show(written: &Written) -> Result<Report, Error> {
    let Written { name, document, .. } = written;
    let tree = tree(document)?;
    let terms = terms(&tree);
    let range = range_of(&terms);
    let heading = format!("Calibration of unit {}", document.unit);
    let mut sheet = Report::saying(heading, name, about::words(document));
    sheet.notes = about::notes(document, &terms);
    sheet.warnings.extend(written.loaded.warnings.iter().map(ToString::to_string));
    about::tables(&mut sheet, document);
    let formulas = terms.iter().map(|term| {
        let range = term.range.map_or_else(
            || "everywhere".to_owned(),
            |[low, high]| format!("{}…{} {}", short(low), short(high), term.argument),
        );
        vec![title(term), term.words.clone(), term.unit.clone(), range]
    });
    sheet.table("Terms", ["term", "formula", "unit", "fitted over"], formulas);
    over_temperature(&mut sheet, &terms, range);
    sums_table(&mut sheet, written, range);
    charts::charts(&mut sheet, written, &terms, range);
    let terms: Vec<Value> = terms.iter().map(|term| term_json(term, range)).collect();
    sheet.figures = json!({ "document": tree, "terms": terms });
    Ok(sheet)
}

/// The term as people call it: "gyro x lag of 300 s".
pub(crate) fn title(term: &Term) -> String {
    let kind = if term.kind == "gyro" { "gyro" } else { "accelerometer" };
    format!("{kind} {} {}", term.sensor, spoken(&term.name))
}

/// The name of a term as people say it: "static bias".
pub(crate) fn spoken(name: &str) -> String {
    name.replace('_', " ")
}

/// The range of temperature that all terms over it reach over together.
pub(crate) fn range_of(terms: &[Term]) -> [f64; 2] {
    let ranges = terms.iter().filter(|term| term.argument == "°C").filter_map(|term| term.range);
    hull(ranges).filter(|[low, high]| high > low).unwrap_or(USUAL)
}

fn over_temperature(sheet: &mut Report, terms: &[Term], range: [f64; 2]) {
    for [argument, .., words] in ARGUMENTS {
        let over = |term: &&Term| term.argument == argument && (term.range.is_some() || argument == "°C");
        let mine: Vec<&Term> = terms.iter().filter(over).collect();
        let own = hull(mine.iter().filter_map(|term| term.range)).unwrap_or_default();
        let at = places(if argument == "°C" { range } else { own }, COLUMNS);
        let row = |term: &Term| {
            let values: Vec<(f64, bool)> = at.iter().map(|x| term.at(*x)).collect();
            let words = alike(&values.iter().map(|(value, _)| *value).collect::<Vec<_>>(), RANGE_DIGITS);
            let cell = |(word, (_, clamped)): (String, &(f64, bool))| {
                if *clamped { format!("({word})") } else { word }
            };
            let cells = words.into_iter().zip(&values).map(cell);
            std::iter::once(format!("{}, {}", title(term), term.unit)).chain(cells).collect()
        };
        sheet.table(&format!("Over {words}"), heads(&at, argument), mine.into_iter().map(row));
    }
}

/// Heads of a table over places of an argument; the first column names the rows.
fn heads(at: &[f64], argument: &str) -> Vec<String> {
    let of = at.iter().map(|x| format!("{} {argument}", short(*x)));
    std::iter::once(String::new()).chain(of).collect()
}

/// The correction at one temperature of all channels, on a ramp.
pub(crate) fn steady(written: &Written, temperature: f64, ramp_deg_c_per_min: f64) -> Steady {
    let state = ThermalState { temperature, rate: ramp_deg_c_per_min / 60.0, ..ThermalState::default() };
    // An auxiliary channel has no temperature: what rests on it is left out.
    let calibration = &written.loaded.calibration;
    let known = |name: &ChannelName| calibration.channels().iter().any(|channel| channel.name() == name);
    calibration.steady(|name| known(name).then_some(state), None)
}

/// A sensor's bias in all.
pub(crate) struct Sum {
    pub(crate) name: String,
    pub(crate) unit: &'static str,
    /// By ramp (°C/min): the bias at each temperature; no number where it is not known.
    pub(crate) ramps: Vec<(f64, Vec<f64>)>,
}

/// The sums of all terms at some temperatures.
pub(crate) fn sums(written: &Written, at: &[f64]) -> Vec<Sum> {
    let over = |ramp: f64, of: &dyn Fn(&Steady) -> Option<f64>| {
        let values = at.iter().map(|x| of(&steady(written, *x, ramp)).unwrap_or(f64::NAN));
        (ramp, values.collect::<Vec<f64>>())
    };
    let gyros = written.document.gyro.sensor.iter().enumerate().map(|(index, gyro)| {
        let deg_per_h = |steady: &Steady| {
            steady.gyro_bias.get(index).map(|bias| AngularRate::from_rad_per_s(*bias).as_deg_per_h())
        };
        let ramps = RAMPS.map(|ramp| over(ramp, &deg_per_h)).to_vec();
        Sum { name: format!("gyro {}", gyro.name), unit: "°/h", ramps }
    });
    let accels = accelerometers(&written.document).iter().enumerate().map(|(index, accel)| {
        let milli_g = |steady: &Steady| {
            steady.accel_bias.get(index).map(|bias| SpecificForce::from_m_per_s2(*bias).as_g() * 1e3)
        };
        Sum { name: format!("accelerometer {}", accel.name), unit: "mg", ramps: vec![over(0.0, &milli_g)] }
    });
    gyros.chain(accels).collect()
}

fn sums_table(sheet: &mut Report, written: &Written, range: [f64; 2]) {
    let at = places(range, COLUMNS);
    let row = |sum: &Sum, (ramp, values): &(f64, Vec<f64>)| {
        let words = if sum.ramps.len() > 1 { format!(", {}", ramp_words(*ramp)) } else { String::new() };
        let cells = alike(values, RANGE_DIGITS).into_iter().zip(values);
        let cells = cells.map(|(word, value)| if value.is_nan() { "–".to_owned() } else { word });
        std::iter::once(format!("{}, {}{words}", sum.name, sum.unit)).chain(cells).collect::<Vec<_>>()
    };
    let sums = sums(written, &at);
    let rows = sums.iter().flat_map(|sum| sum.ramps.iter().map(move |ramp| row(sum, ramp)));
    sheet.table(&format!("Bias in all, {}", settled([&written.document])), heads(&at, "°C"), rows);
}

/// What sums of documents are taken at.
pub(crate) fn settled<const N: usize>(documents: [&Document; N]) -> String {
    let any = |holds: fn(&Document) -> bool, words: &'static str| {
        if documents.into_iter().any(holds) { words } else { "" }
    };
    let trend = any(|of| of.gyro.sensor.iter().any(|gyro| gyro.trend.is_some()), ", trend at its end");
    let mode = any(|of| of.mode_reversal.is_some(), ", lasing mode +");
    format!("lags settled{trend}{mode}")
}

pub(crate) fn ramp_words(ramp: f64) -> String {
    if ramp == 0.0 { "steady".to_owned() } else { format!("{ramp:+} °C/min") }
}

fn term_json(term: &Term, range: [f64; 2]) -> Value {
    let range = if term.argument == "°C" { range } else { term.range.unwrap_or_default() };
    let points: Vec<[f64; 2]> = places(range, 101).into_iter().map(|x| [x, term.at(x).0]).collect();
    json!({
        "kind": term.kind,
        "sensor": term.sensor,
        "term": term.name,
        "unit": term.unit,
        "argument": term.argument,
        "range": term.range,
        "points": points,
    })
}
