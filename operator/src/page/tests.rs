pub(crate) mod samples;

use ratatui::text::Line;

use super::*;
use samples::NOW_UNIX_MS;

const WIDTHS: [usize; 3] = [80, 120, 160];

fn now(statuses: &[Status]) -> Vec<Unit<'_>> {
    statuses.iter().map(|status| Unit::now(status, NOW_UNIX_MS)).collect()
}

fn words(lines: &[Line<'_>]) -> String {
    tone::text(lines, false)
}

#[test]
fn a_table_has_a_line_for_each_unit_and_fits_at_any_width() {
    for count in [0, 1, 8, 200] {
        let statuses = samples::fleet(count);
        for columns in (1..300).step_by(if count == 200 { 40 } else { 7 }).chain(WIDTHS) {
            let grid = units(&now(&statuses), columns);
            let lines = grid.lines();
            assert_eq!(lines.len(), count + 1);
            let widest = lines.iter().map(Line::width).max().unwrap();
            assert!(widest <= columns, "{count} units: {widest} > {columns}");
        }
    }
}

#[test]
fn the_narrow_table_keeps_what_matters_and_the_wide_one_has_all() {
    let statuses = samples::fleet(8);
    let head = |columns| words(&units(&now(&statuses), columns).lines()[..1]);
    for column in ["unit", "state", "rev", "°C", "range", "°/h", "Hz", "note"] {
        assert!(head(80).contains(column), "{column} in {}", head(80));
    }
    // A serial is whole before all else.
    assert!(words(&units(&now(&statuses), 20).lines()).contains("ZLG-0008"));
    assert!(words(&sheet(&now(&statuses)[4], None, &[], 30)).starts_with("! ZLG-0005\n  "));
    for column in ["°C/min", "mg", "gaps", "dup", "late", "bad", "p99", "cal. age"] {
        assert!(head(160).contains(column), "{column} in {}", head(160));
    }
}

#[test]
fn a_line_says_how_its_unit_is_without_any_colour() {
    let statuses = samples::fleet(8);
    insta::assert_snapshot!(words(&units(&now(&statuses), 160).lines()));
}

#[test]
fn a_unit_that_is_gone_is_dim_and_says_for_how_long() {
    let statuses = samples::fleet(1);
    let mut seen = now(&statuses);
    seen[0].gone = Some(Duration::from_secs(200));
    let grid = units(&seen, 120);
    let lines = grid.lines();
    insta::assert_snapshot!(words(&lines[1..]));
    let words = lines[1].spans.iter().filter(|span| !span.content.trim().is_empty());
    assert!(
        words.clone().count() > 5
            && words.clone().all(|span| span.style.add_modifier == tone::DIM.add_modifier)
    );
}

#[test]
fn the_page_of_a_unit_has_every_section_and_fits() {
    let mut status = samples::faulty("ZLG-0005");
    status.self_test = Some(samples::self_test(false));
    let service = samples::service(std::slice::from_ref(&status));
    for columns in (20..200).step_by(9).chain(WIDTHS) {
        let lines = sheet(&Unit::now(&status, NOW_UNIX_MS), Some(&service), &[], columns);
        // Section titles and the names of counters are not broken.
        let widest = lines.iter().map(Line::width).max().unwrap();
        assert!(columns < 60 || widest <= columns, "{widest} > {columns}\n{}", words(&lines));
    }
    insta::assert_snapshot!(words(&sheet(&Unit::now(&status, NOW_UNIX_MS), Some(&service), &[], 80)));
}

#[test]
fn what_a_unit_does_not_say_leaves_no_empty_section() {
    let status = Status { unit: "ZLG-0001".to_owned(), ..Status::default() };
    insta::assert_snapshot!(words(&sheet(&Unit::now(&status, NOW_UNIX_MS), None, &[], 80)));
}

#[test]
fn somebody_who_looks_on_sees_the_course_of_temperatures() {
    let status = samples::running("U");
    let name = status.channels[0].name;
    let start = Instant::now();
    let past: Vec<Past> = (0..60_u32)
        .map(|s| Past {
            at: start + Duration::from_secs(s.into()),
            channels: vec![(name, 20.0 + 0.1 * f64::from(s), 0.002)],
        })
        .collect();
    let unit = Unit { past: &past, ..Unit::now(&status, NOW_UNIX_MS) };
    insta::assert_snapshot!(words(&sheet(&unit, None, &[], 80)));
}

#[test]
fn a_service_stands_in_one_line_and_its_troubles_below_it() {
    let statuses = samples::fleet(8);
    let mut service = samples::service(&statuses);
    for columns in [10, 40, 80, 120, 160] {
        let lines = services((std::slice::from_ref(&service), &[]), &[], columns);
        assert!(lines.iter().all(|line| line.width() <= columns), "{}", words(&lines));
    }
    let text = |service: &ServiceStatus, gone: &[String]| {
        words(&services((std::slice::from_ref(service), gone), &[], 160))
    };
    let watched = text(&service, &[]);
    service.calibrations.as_mut().unwrap().state = isotherm_protocol::service_status::FolderState::Gone;
    let gone = text(&service, &[samples::INSTANCE.to_owned()]);
    insta::assert_snapshot!([watched, text(&service, &[]), gone].join("\n"));
}

#[test]
fn the_tally_counts_states_and_troubles() {
    let statuses = samples::fleet(25);
    let mut seen = now(&statuses);
    seen[0].gone = Some(Duration::from_secs(1));
    let text = words(&[tally(&seen, 160)]);
    assert_eq!(
        text.trim(),
        "25 units  ! 1 faulty  ▲ 6 warned  × 1 gone  20 running ±, 1 running, 1 standby, 1 self-test, 1 pre-launch"
    );
    assert_eq!(words(&[tally(&[], 80)]), "0 units\n");
}

/// `cargo test … -- --ignored screens`: writes what operators see to files, to be looked at.
#[test]
#[ignore = "writes files to be looked at"]
fn screens_of_status() {
    let folder = std::env::var("ISOTHERM_SCREENS").unwrap_or_else(|_| "../target/screens".to_owned());
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: String, lines: &[Line<'_>]| {
        std::fs::write(format!("{folder}/{name}.txt"), tone::text(lines, false)).unwrap();
    };
    for columns in WIDTHS {
        for count in [1, 8, 200] {
            let statuses = samples::fleet(count);
            let seen = now(&statuses);
            let mut lines = services((&[samples::service(&statuses)], &[]), &[], columns);
            let grid = units(&seen, columns);
            lines.extend([tally(&seen, columns), Line::default()]);
            lines.extend(grid.lines());
            write(format!("status-{count}-units-{columns}"), &lines);
        }
        for (name, status) in [
            ("running", samples::running("ZLG-0001")),
            ("faulty", samples::faulty("ZLG-0005")),
            ("pre-launch", samples::pre_launch("ZLG-0006")),
        ] {
            let service = samples::service(std::slice::from_ref(&status));
            write(
                format!("status-page-{name}-{columns}"),
                &sheet(&Unit::now(&status, NOW_UNIX_MS), Some(&service), &[], columns),
            );
        }
    }
}
