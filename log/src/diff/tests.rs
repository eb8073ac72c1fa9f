//! Two logs of the same readings, and what differs.

use std::path::{Path, PathBuf};

use isotherm_correction::sample::{CorrectedTick, TickFlags};
use isotherm_correction::units::{Span, Timestamp};

use super::*;
use crate::offline::rows::{write_header, write_tick};
use crate::offline::unit_id;
use crate::part::Part;

fn tick(sequence: u64) -> CorrectedTick {
    let n = f64::from(u32::try_from(sequence).unwrap());
    CorrectedTick {
        sequence,
        end_time: Timestamp::from_ns(i64::try_from(sequence + 1).unwrap() * 5_000_000),
        duration: Span::from_ms(5),
        ticks: 1,
        delta_angle: [n * 0.1, -n / 3.0, 1e-6],
        delta_velocity: [0.0, 0.0, 0.049],
        flags: if sequence == 4 { TickFlags::GAP } else { TickFlags::empty() },
        missed: u64::from(sequence == 4),
        revision: if sequence < 6 { 1 } else { 2 },
        ..CorrectedTick::default()
    }
}

fn csv(folder: &Path, name: &str, ticks: &[CorrectedTick]) -> PathBuf {
    let mut bytes = Vec::new();
    write_header(&mut bytes).unwrap();
    for tick in ticks {
        write_tick(&mut bytes, tick).unwrap();
    }
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn compared(a: &[CorrectedTick], b: &[CorrectedTick], options: DiffOptions) -> Account {
    let folder = tempfile::tempdir().unwrap();
    let unit = unit_id("U-1").unwrap();
    let open =
        |name, ticks| CorrectedLog::open(&csv(folder.path(), name, ticks), &Part::default(), &unit).unwrap();
    let mut accounts = compare(&mut open("a", a), &mut open("b", b), options, |_| {}).unwrap();
    accounts.remove(&unit).unwrap_or_default()
}

#[test]
fn the_first_tick_that_differs_by_one_bit_is_named_with_what_happened_before() {
    let a: Vec<_> = (0..2000).map(tick).collect();
    assert!(compared(&a, &a, DiffOptions::default()).is_identical());
    let mut b = a.clone();
    b[1200].delta_angle[1] = b[1200].delta_angle[1].next_up();
    b[1500].delta_velocity[2] += 1e-3;
    let account = compared(&a, &b, DiffOptions::default());
    assert_eq!((account.ticks, account.different), (2000, 2));
    let first = account.first.unwrap();
    assert_eq!((first.sequence, first.at, first.around.len()), (1200, 3, 7));
    let around: Vec<_> = first.around.iter().map(|row| row.a.as_ref().unwrap().tick.sequence).collect();
    assert_eq!(around, [1197, 1198, 1199, 1200, 1201, 1202, 1203]);
    let [field] = first.fields.as_slice() else { panic!("{:?}", first.fields) };
    assert_eq!(field.field, "delta_angle_y_rad");
    assert_eq!(
        (field.a.parse::<f64>().unwrap(), field.b.parse::<f64>().unwrap()),
        (-400.0, (-400.0_f64).next_up())
    );
    assert_eq!(field.a_bits.as_deref(), Some("0xc079000000000000"));
    let Some(Equivalent::DegPerH(rate)) = field.equivalent else { panic!("{field:?}") };
    let expected = (5.684_341_886_080_802e-14_f64 / 0.005).to_degrees() * 3600.0;
    assert!((rate - expected).abs() < 1e-9 * expected, "{rate} {expected}");
    insta::assert_snapshot!(first.event_a.tick.as_deref().unwrap());
    assert_eq!((account.angle[1].sequence, account.velocity[2].sequence), (1200, 1500));
    assert!((account.velocity[2].equivalent - 1e-3 / 0.005 / 9.80665 * 1e3).abs() < 1e-9);
}

#[test]
fn what_is_allowed_is_no_difference_and_is_told_all_the_same() {
    let a: Vec<_> = (0..100).map(tick).collect();
    let mut b = a.clone();
    b[10].delta_angle[0] += 1e-9;
    b[20].delta_velocity[2] += 1e-9;
    let with = |tolerance| compared(&a, &b, DiffOptions { tolerance, around: 0 });
    let none = Tolerance::default();
    assert_eq!(with(Tolerance { angle_rad: 2e-9, ..none }).different, 1);
    assert_eq!(with(Tolerance { angle_rad: 2e-9, velocity_m_per_s: 2e-9, ..none }).different, 0);
    assert_eq!(with(Tolerance { relative: 1e-6, ..none }).different, 0);
    let account = with(Tolerance { angle_rad: 5e-10, ..none });
    assert_eq!(account.different, 2);
    assert!(account.angle[0].increment > 9e-10);
    let account = with(Tolerance { angle_rad: 2e-9, velocity_m_per_s: 2e-9, ..none });
    assert_eq!((account.within_tolerance, account.is_identical()), (2, true));
    assert_eq!(compared(&a, &a, DiffOptions::default()).within_tolerance, 0);
}

#[test]
fn ticks_of_one_log_alone_are_counted_by_where_they_are() {
    let all: Vec<_> = (0..100).map(tick).collect();
    let part: Vec<_> = all
        .iter()
        .filter(|tick| (5..40).contains(&tick.sequence) || (45..90).contains(&tick.sequence))
        .cloned()
        .collect();
    let account = compared(&all, &part, DiffOptions::default());
    assert_eq!(account.only_a, Only { before: 5, between: 5, behind: 10 });
    assert_eq!((account.ticks, account.different, account.only_b.all()), (80, 0, 0));
    let first = account.first.unwrap();
    assert_eq!((first.sequence, first.only_in), (0, Some("a")));
    let account = compared(&part, &part[..30], DiffOptions::default());
    assert_eq!((account.only_a.behind, account.first.unwrap().sequence), (50, 35));
    let nothing = compared(&all, &[], DiffOptions::default());
    assert!(!nothing.is_identical() && nothing.only_a.all() == 100);
}

#[test]
fn what_is_no_corrected_log_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let unit = unit_id("U-1").unwrap();
    let good = csv(folder.path(), "good.csv", &[tick(0), tick(1)]);
    let text = std::fs::read_to_string(&good).unwrap();
    let refused = [
        ("x.csv", text.replacen("-0.3333333333333333", "x", 1)),
        ("y.bin", "sequence of something else".to_owned()),
        ("z.csv", text.split_once('\n').unwrap().1.to_owned()),
    ]
    .map(|(name, bytes)| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let mut log = CorrectedLog::open(&path, &Part::default(), &unit).unwrap();
        log.next_ticks().unwrap_err().to_string()
    });
    insta::assert_snapshot!(refused.join("\n").replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn a_part_of_a_csv_is_its_ticks_that_end_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let unit = unit_id("U-1").unwrap();
    let all: Vec<_> = (0..3000).map(tick).collect();
    let path = csv(folder.path(), "long.csv", &all);
    let sequences = |start, end: Option<u32>| {
        let part = Part { start: Span::from_ms(start), end: end.map(Span::from_ms), ..Part::default() };
        let mut log = CorrectedLog::open(&path, &part, &unit).unwrap();
        let mut found = Vec::new();
        while let Some(ticks) = log.next_ticks().unwrap() {
            found.extend(ticks.ticks.iter().map(|tick| tick.tick.sequence));
        }
        found
    };
    assert_eq!(sequences(0, Some(10)), [0, 1]);
    assert_eq!(sequences(12_498, Some(12_520)), [2499, 2500, 2501, 2502, 2503]);
    assert_eq!(sequences(14_990, None), [2998, 2999]);
    assert!(sequences(20_000, None).is_empty());
}
