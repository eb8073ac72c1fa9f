//! Pages by themselves, and their script where a program for scripts is there.

use std::process::Command;
use std::sync::Arc;

use super::*;

/// A page with everything on it.
fn page() -> Page {
    let mut page = Page::new("a < b & \"c\"");
    page.heading("Section");
    page.headline("1.68 → 0.19 °/h");
    page.paragraph("Words.");
    page.table(&Table {
        head: vec![String::new(), "A".into()],
        rows: vec![vec!["ticks".into(), "7".into()]],
    });
    let x: Arc<[f64]> = vec![0.0, 1.0, 2.0, 3.0].into();
    let points = |y: [f64; 4]| Samples::Points { x: Arc::clone(&x), y: y.to_vec() };
    let series = |name: &str, samples| Series {
        name: name.into(),
        ink: Ink::Raw,
        form: Form::Line,
        dashes: 0,
        samples,
    };
    let bins = Samples::Bins {
        first: 0.0,
        width: 1.5,
        min: vec![-1.0, f64::NAN],
        max: vec![1.0, f64::NAN],
        mean: vec![0.25, f64::INFINITY],
    };
    let panel = |content| Panel {
        title: "</script><b>".into(),
        unit: "°/h".into(),
        height: 150,
        logarithmic: false,
        content,
    };
    let flags = Arc::new(Bits(vec![0, 1, 3, 2]));
    let lane = |bit| Lane::Bit {
        name: format!("bit {bit}"),
        ink: Ink::Alert,
        bit,
        bits: Arc::clone(&flags),
        places: Places::Points(Arc::clone(&x)),
    };
    let stretch = Stretch { from: 0.0, to: 2.0, label: "standby".into(), ink: Ink::Third };
    let curves = vec![
        series("one", points([9.81, 9.82, f64::NAN, 9.83])),
        series("two", points([1.0; 4])),
        series("three", bins),
    ];
    page.chart(&Chart {
        caption: "what < where".into(),
        x: Axis::of("time", "s"),
        panels: vec![
            panel(Content::Series(curves)),
            panel(Content::Lanes(vec![
                lane(0),
                lane(1),
                Lane::Stretches { name: "state".into(), stretches: vec![stretch] },
            ])),
        ],
        marks: vec![Mark { x: 1.0, kind: "command".into(), words: "<run>".into(), ink: Ink::Third }],
    });
    page
}

/// Whether each element that is opened is closed again, in order; script and style hold text only.
fn unbalanced(html: &str) -> Option<String> {
    const VOID: [&str; 3] = ["meta", "!doctype", "br"];
    let (mut open, mut rest) = (Vec::new(), html);
    while let Some(at) = rest.find('<') {
        let end = at + rest[at..].find('>')?;
        let tag = &rest[at + 1..end];
        rest = &rest[end + 1..];
        let name = tag.trim_start_matches('/').split_whitespace().next()?.to_owned();
        if tag.starts_with('/') {
            if open.pop().as_ref() != Some(&name) {
                return Some(format!("</{name}> closes nothing"));
            }
        } else if !VOID.contains(&name.as_str()) {
            if ["script", "style"].contains(&name.as_str()) {
                rest = &rest[rest.find(&format!("</{name}>"))?..];
            }
            open.push(name);
        }
    }
    open.pop().map(|name| format!("<{name}> stays open"))
}

#[test]
fn a_page_needs_nothing_beside_it() {
    let html = page().to_html();
    for outside in ["http:", "https:", "<link", "@import", "url(", "src=", "href=", "import(", "fetch("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert_eq!(unbalanced(&html), None);
    assert!(unbalanced("<p><b></p></b>").is_some() && unbalanced("<p>").is_some());
    assert!(
        html.contains("<noscript>") && html.contains("@media print") && html.contains("prefers-color-scheme")
    );
}

#[test]
fn text_cannot_leave_its_place() {
    let html = page().to_html();
    assert!(html.contains("a &lt; b &amp; &quot;c&quot;") && html.contains("what &lt; where"));
    assert!(html.contains("\\u003c/script>\\u003cb>") && html.contains("\\u003crun>"), "in the shape");
    assert_eq!(html.matches("</script>").count(), html.matches("<script").count());
}

#[test]
fn lists_that_are_shared_are_in_the_file_once() {
    let html = page().to_html();
    // Places once, values of two curves, flags once; the three lists of bins differ in nothing but their middle.
    assert_eq!(html.matches("id=\"data").count(), 5);
}

#[test]
fn a_page_without_charts_has_no_script() {
    let mut page = Page::new("x");
    page.paragraph("words");
    assert!(!page.to_html().contains("<script"));
}

#[test]
fn the_script_maps_decimates_and_labels_as_it_should_where_node_is_there() {
    let parts = [&CHART_SCRIPT[..2], &PAGE_SCRIPT[..1]].concat().concat();
    let script = format!(
        "\"use strict\";\nconst assert = require('assert');\n{parts}\n{}",
        include_str!("script/tests.js")
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.js");
    std::fs::write(&path, script).unwrap();
    match Command::new("node").arg(&path).output() {
        Err(error) => println!("skipped: no node: {error}"),
        Ok(output) => {
            let words = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{words}");
            assert_eq!(String::from_utf8_lossy(&output.stdout), "done\n", "all of it was run");
        }
    }
}

#[test]
fn the_whole_script_can_be_parsed_where_node_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("script.js");
    std::fs::write(
        &path,
        format!("\"use strict\";\n(() => {{\n{}{}}})();\n", CHART_SCRIPT.concat(), PAGE_SCRIPT.concat()),
    )
    .unwrap();
    match Command::new("node").arg("--check").arg(&path).output() {
        Err(error) => println!("skipped: no node: {error}"),
        Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
    }
}

#[test]
fn words_stand_to_the_left_and_figures_to_the_right() {
    let mut page = Page::new("x");
    let row = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
    let long = "failed: a reason that is longer than a phone is wide, by far";
    page.table(&Table {
        head: row(["unit", "of", "rms", "state"]),
        rows: vec![row(["A", "gyro x", "→ 1.5", "accepted"]), row(["B", "gyro y", "–", long])],
    });
    let html = page.to_html();
    // It is wider than a phone: each cell has its head with it.
    let line = "<th data-head=\"unit\">A</th><td class=\"words\" data-head=\"of\">gyro x</td><td data-head=\"rms\">→ 1.5</td>\
                <td class=\"words long\" data-head=\"state\">accepted</td>";
    assert!(html.contains(line), "{html}");
    assert!(html.contains("<th>unit</th><th class=\"words\">of</th><th>rms</th>"), "{html}");
    assert!(html.contains("<div class=\"table wide\">"), "{html}");
}

#[test]
fn a_table_that_fits_stays_one_and_formulas_wrap() {
    let mut page = Page::new("x");
    let row = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
    page.table(&Table {
        head: row(["", "rms"]),
        rows: vec![row(["gyro x", "1.5"]), row(["MEMS-0001", "2"])],
    });
    let formula = "90 + 4·(T − 25) + 0.03·(T − 25)² − 0.0004·(T − 25)³";
    page.table(&Table { head: row(["term", "formula"]), rows: vec![row(["static bias", formula])] });
    let html = page.to_html();
    assert!(
        html.contains("<div class=\"table\"><table>") && html.contains("<th>gyro x</th><td>1.5</td>"),
        "{html}"
    );
    assert!(
        html.contains(&format!("<td class=\"words long\" data-head=\"formula\">{formula}</td>")),
        "{html}"
    );
}

#[test]
fn results_stand_one_to_a_line() {
    let mut page = Page::new("x");
    page.headlines(&[("a < b".into(), String::new()), ("c; refused".into(), "it is zero".into())]);
    let lines =
        "<ul class=\"headline\">\n<li>a &lt; b</li>\n<li>c; refused <span>it is zero</span></li>\n</ul>";
    assert!(page.to_html().contains(lines));
}

#[test]
fn colours_for_several_are_no_others() {
    let several: Vec<Ink> = Ink::several().take(6).collect();
    for ink in [Ink::Raw, Ink::Corrected, Ink::Other, Ink::Truth, Ink::Alert, Ink::Faint] {
        assert!(!several.contains(&ink), "{ink:?} already stands for something in the same chart");
    }
    assert!((1..6).all(|at| !several[..at].contains(&several[at])), "{several:?}");
}
