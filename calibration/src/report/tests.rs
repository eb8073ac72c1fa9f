use std::path::Path;

use isotherm_protocol::document::{Document, Sample};

use super::*;
use crate::document::Written;
use crate::error::Error;
use crate::fixture::simulated;
use crate::numbers::Size;
use crate::runs::Run;
use crate::runs::table::Rows;

fn size(peak_to_peak: f64) -> Size {
    Size { count: 10, rms: 0.25 * peak_to_peak, peak_to_peak, ..Size::default() }
}

fn verdict() -> Verdict {
    Verdict::new("gyro x", "°/h", [size(1.5), size(0.15)]).out_of_sample(Some([size(1.68), size(0.17)]))
}

#[test]
fn a_verdict_says_what_came_of_it() {
    let verdicts = [
        verdict(),
        verdict().refused("no model beats its mean"),
        Verdict::new("accelerometer z", "m/s²", [size(4.0), size(2.0)]),
        Verdict::new("gyro y", "°/h", <[Size; 2]>::default()).refused("all readings are zero"),
    ];
    insta::assert_snapshot!(verdicts.map(|verdict| verdict.words()).join("\n"));
}

#[test]
fn a_document_states_the_sizes_of_the_verdicts() {
    let stated = residuals(&[verdict(), Verdict::new("axis", "″", [size(1.0), size(0.1)])]);
    assert_eq!(stated.len(), 2, "an angle has no residual in a document: {stated:?}");
    assert_eq!((stated[0].of.as_str(), stated[0].sample), ("gyro.x", Sample::In));
    assert_eq!((stated[1].sample, stated[1].peak_to_peak_after), (Sample::Out, Some(0.17)));
}

#[test]
fn a_report_says_the_same_in_every_form() {
    let mut report = Report::new("Thermal calibration, method joint", "FOG-0001");
    report.verdicts = vec![verdict(), Verdict::new("gyro y", "°/h", [size(1.0), size(2.0)]).refused("worse")];
    report.warnings.push("only one plateau < 3 °C wide".into());
    report.coefficient("gyro x static_bias c0", "°/h", 1.234_567, 0.001);
    report.coefficient("gyro x static_bias c1", "°/h/°C", -2.5e-5, None);
    let time_s: std::sync::Arc<[f64]> = (0..20_000).map(f64::from).collect::<Vec<_>>().into();
    let wave: Vec<f64> = time_s.iter().map(|t| libm::sin(t * 1e-3)).collect();
    report.residuals.push(Curve {
        of: "gyro x".into(),
        measure: "°/h".into(),
        run: "chamber.mcap".into(),
        sample: Sample::Out,
        window_s: 1.0,
        temperature_deg_c: time_s.iter().map(|t| t * 1e-3).collect(),
        time_s,
        after: wave.iter().map(|value| 0.1 * value).collect(),
        before: wave,
    });
    let json = report.to_json();
    assert_eq!(json["accepted"], false);
    assert_eq!(json["verdict"], report.headline());
    assert_eq!(json["verdicts"][0]["out_of_sample"]["after"]["peak_to_peak"], 0.17);
    assert_eq!(json["coefficients"][1]["sigma"], Value::Null);
    let html = report.to_html();
    // The page's curves are left out.
    let (body, _) = html.split_once("<main>").unwrap().1.split_once("</main>").unwrap();
    let page: Vec<&str> = body.lines().filter(|line| !line.starts_with("<script")).collect();
    let refusals = report.refusals().unwrap();
    insta::assert_snapshot!([&report.to_text(), &refusals, &page.join("\n")].map(String::as_str).join("\n"));
    // A unit of measure by itself is said once.
    assert!(
        html.contains(r#""title":"","unit":"°/h""#) && !html.contains(r#""title":"°/h""#),
        "units doubled"
    );
    assert!(html.len() < 600_000, "{}", html.len());
}

#[test]
fn a_terminal_shows_a_dozen_lines() {
    let mut report = Report::new("Thermal calibration, method joint", "FOG-0001");
    report.verdicts = vec![verdict(); 6];
    report.warnings = (0..9).map(|k| format!("number {k}")).collect();
    let text = report.to_text();
    assert_eq!(text.lines().count(), 12, "{text}");
    insta::assert_snapshot!(text);
}

#[test]
fn judging_a_run_shows_what_the_terms_do() {
    let scenario = isotherm_simulator::presets::mems_chamber(3);
    let scenario = isotherm_simulator::Scenario { duration_s: 60.0, ..scenario };
    let run = simulated(&scenario, |_| ());
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
    let after = Written::read(Path::new(path)).unwrap();
    let before = Written::of(&after.document.nominal()).unwrap();
    let judged = |rest: Rest| {
        let of_run = |_, _: &Run| Ok((rest, Rows::valid(5.0), ""));
        judge((&[], std::slice::from_ref(&run)), [&before, &after], of_run).unwrap()
    };
    let means = judged(Rest::default());
    let names: Vec<&str> = means.curves.iter().map(|curve| curve.of.as_str()).collect();
    assert_eq!(names[..3], ["gyro x", "gyro y", "gyro z"]);
    assert_eq!(names.len(), 6);
    for curve in &means.curves {
        let [before, after] = curve.sizes();
        assert!(before.mean.abs() < 1e-9 && after.mean.abs() < 1e-9, "{curve:?}");
        assert_eq!((curve.time_s.len(), curve.temperature_deg_c.len(), after.count), (12, 12, 12));
    }
    let document: &Document = &after.document;
    assert_eq!(curve::channel_of(document, true, 0), document.gyro.sensor[0].channel);
    assert_eq!(output_unit(document), "m/s²", "what its accelerometers put out");
    let truth = judged(Rest { rate_deg_per_h: Some([0.0; 3]), ..Rest::default() });
    let [before, after] = truth.curves[0].sizes();
    assert!(before.mean.abs() > 2.0 * after.mean.abs(), "the bias is taken away: {before:?} {after:?}");
    assert_eq!(Curve::verdicts(&truth.curves).len(), 6);
}

#[test]
fn a_batch_keeps_its_order_and_ends_with_one_table() {
    let items: Vec<u64> = (0..50).collect();
    let squares = in_parallel(&items, |item| item * item);
    assert_eq!(squares, items.iter().map(|item| item * item).collect::<Vec<_>>());
    let mut report = Report::new("Thermal calibration", "A");
    report.verdicts = vec![verdict(), verdict().refused("worse")];
    let units = [("A".to_owned(), Ok(report)), ("B".to_owned(), Err(Error::refused("no raw ticks")))];
    let batch = Batch(&units);
    assert_eq!(batch.counts(), [1, 1, 1]);
    insta::assert_snapshot!(batch.to_text());
    assert_eq!(batch.to_json()["units"][1]["failed"], "no raw ticks");
    assert_eq!(of_unit(Path::new("out/fit.html"), "B"), Path::new("out/fit-B.html"));
}
