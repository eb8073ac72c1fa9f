//! Chains that are whole, and chains with every kind of break.

use super::*;
use crate::history::{AuditEvent, WallTime, Withdrawal, Withdrawn};

fn entry(number: u64) -> AuditEntry {
    AuditEntry {
        number,
        time: WallTime::from_unix_ms(1_795_248_000_000),
        unit: Some("ZLG-1".to_owned()),
        by: "ann".to_owned(),
        event: AuditEvent::Withdrawn(Withdrawal { revision: number, why: Withdrawn::Cancelled }),
    }
}

/// Lines of a new file.
fn lines(numbers: std::ops::RangeInclusive<u64>) -> Vec<String> {
    let mut chain = Chain::default();
    numbers.map(|number| chain.line(&entry(number)).unwrap()).collect()
}

/// Reads lines, as a service does that starts.
fn pass(chain: &mut Chain, lines: &[String]) {
    for line in lines {
        chain.pass(line.as_bytes());
    }
}

/// The checksum made to fit again, as whoever edits a line on purpose would.
fn resealed(line: &str) -> String {
    sealed(line.rsplit_once(",\"crc\"").unwrap().0.to_owned() + "}").unwrap()
}

/// What is broken: number of the entry, fault.
fn broken(lines: &[String]) -> Vec<(Option<u64>, Fault)> {
    let mut verifier = Verifier::default();
    let found = lines.iter().filter_map(|line| verifier.line(line.as_bytes()));
    found.map(|broken| (broken.number, broken.fault)).collect()
}

#[test]
fn a_line_is_what_the_documentation_says_and_older_readers_read_it() {
    let [first, second]: [String; 2] = lines(1..=2).try_into().unwrap();
    let json = entry(1).to_json().unwrap();
    let body = format!("{},\"previous\":\"{}\"}}", json.strip_suffix('}').unwrap(), "0".repeat(64));
    let digest = Digest::of(format!("{}{body}", "0".repeat(64)).as_bytes());
    assert!(
        first.starts_with(&format!("{},\"chain\":\"{digest}\",\"crc\":\"", body.strip_suffix('}').unwrap()))
    );
    let json = entry(2).to_json().unwrap();
    let digest = Digest::of(format!("{digest}{json}").as_bytes());
    assert!(
        second.starts_with(&format!("{},\"chain\":\"{digest}\",\"crc\":\"", json.strip_suffix('}').unwrap()))
    );
    for (line, number) in [(first, 1), (second, 2)] {
        assert_eq!(AuditEntry::from_line(line.as_bytes()), Ok(entry(number)));
    }
}

#[test]
fn a_whole_chain_has_no_break_over_files_and_after_lines_without_digests() {
    let mut chain = Chain::default();
    let old: Vec<_> = (1..=3).map(|number| entry(number).to_line().unwrap()).collect();
    pass(&mut chain, &old);
    let mut all = old;
    for number in 4..=9 {
        if number == 7 {
            chain.begin_file();
        }
        all.push(chain.line(&entry(number)).unwrap());
    }
    assert_eq!(broken(&all), []);
    let named: Vec<_> = all.iter().map(|line| line.contains("\"previous\"")).collect();
    assert_eq!(named, [false, false, false, true, false, false, true, false, false]);
    // The older file may have been removed.
    assert_eq!(broken(&all[6..]), []);
    let mut verifier = Verifier::default();
    assert!(all.iter().all(|line| verifier.line(line.as_bytes()).is_none()));
    assert_eq!((verifier.entries, verifier.first, verifier.begins), (9, Some(1), Some(4)));
    assert_eq!(verifier.head.map(|head| head.number), Some(9));
    // Read back, the chain goes on where it ended.
    let mut again = Chain::default();
    pass(&mut again, &all);
    all.push(again.line(&entry(10)).unwrap());
    assert_eq!(broken(&all), []);
    // The last line without a digest is covered too.
    all[2] = entry(3).to_line().unwrap().replace("ann", "eve");
    all[2] = resealed(&all[2]);
    assert_eq!(broken(&all), [(Some(4), Fault::Elsewhere)]);
}

#[test]
fn a_byte_changed_anywhere_is_found_with_a_checksum_that_fits_or_not() {
    let good = lines(1..=4);
    for at in 0..good[1].len() - 1 {
        let mut changed = good.clone();
        let mut bytes = changed[1].clone().into_bytes();
        bytes[at] ^= 1;
        let Ok(text) = String::from_utf8(bytes) else { continue };
        changed[1] = text;
        let [(_, Fault::Line(_))] = &*broken(&changed) else { panic!("byte {at}: {:?}", broken(&changed)) };
    }
    for (from, to) in
        [("ann", "eve"), ("\"revision\":2", "\"revision\":3"), ("ZLG-1", "ZLG-2"), (".000Z", ".001Z")]
    {
        let mut changed = good.clone();
        changed[1] = resealed(&good[1].replacen(from, to, 1));
        assert_ne!(changed, good);
        assert_eq!(broken(&changed), [(Some(2), Fault::Digest)], "{from}");
    }
    // What JSON repeats of a line is cut.
    let long = format!("\"number\":\"{}\"", "x".repeat(5000));
    let changed = [good[0].clone(), resealed(&good[1].replacen("\"number\":2", &long, 1))];
    let [(None, Fault::Line(LineError::Entry { words, .. }))] = &*broken(&changed) else { panic!() };
    assert_eq!(words.chars().count(), 300);
    // With its own digest made anew it is the next one that does not fit.
    let mut chain = Chain::default();
    chain.pass(good[0].as_bytes());
    let forged = AuditEntry { by: "eve".to_owned(), ..entry(2) };
    let changed = [vec![good[0].clone(), chain.line(&forged).unwrap()], good[2..].to_vec()].concat();
    assert_eq!(broken(&changed), [(Some(3), Fault::Digest)]);
}

#[test]
fn lines_taken_out_exchanged_doubled_or_inserted_are_found() {
    let good = lines(1..=6);
    let without = |taken: std::ops::Range<usize>| {
        let mut rest = good.clone();
        rest.drain(taken);
        broken(&rest)
    };
    assert_eq!(without(2..4), [(Some(5), Fault::Missing { first: 3, last: 4 })]);
    assert_eq!(without(0..1), [(Some(2), Fault::Headless)]);
    let mut exchanged = good.clone();
    exchanged.swap(2, 3);
    let expected = [(Some(4), Fault::Missing { first: 3, last: 3 }), (Some(3), Fault::Behind { last: 4 })];
    assert_eq!(broken(&exchanged), expected);
    let insert = |line: String| {
        let mut more = good.clone();
        more.insert(3, line);
        broken(&more)
    };
    assert_eq!(insert(good[2].clone()), [(Some(3), Fault::Behind { last: 3 })]);
    let bare = entry(4).to_line().unwrap();
    assert_eq!(insert(bare), [(Some(4), Fault::Without { begins: 1 })]);
    let mut chain = Chain::default();
    pass(&mut chain, &good[..3]);
    let forged = AuditEntry { by: "eve".to_owned(), ..entry(4) };
    let expected = [(Some(4), Fault::Behind { last: 4 }), (Some(5), Fault::Digest)];
    assert_eq!(insert(chain.line(&forged).unwrap()), expected);
}

#[test]
fn an_end_that_was_cut_is_told_where_it_is_known_what_was_written() {
    let mut verifier = Verifier::default();
    assert!(lines(1..=4).iter().all(|line| verifier.line(line.as_bytes()).is_none()));
    assert_eq!((verifier.end(Some(4)), verifier.end(None), verifier.end(Some(2))), (None, None, None));
    let cut = verifier.end(Some(7)).unwrap();
    assert_eq!((cut.number, cut.unit.as_deref()), (Some(4), Some("ZLG-1")));
    assert_eq!(cut.fault, Fault::Cut { first: 5, last: 7 });
    insta::assert_snapshot!(cut.fault);
}

#[test]
fn a_file_that_begins_anew_or_elsewhere_is_found() {
    let mut good = lines(1..=4);
    let mut other = Chain::default();
    other.begin_file();
    good.extend((5..=6).map(|number| other.line(&entry(number)).unwrap()));
    assert_eq!(broken(&good), [(Some(5), Fault::Elsewhere)]);
    assert_eq!(broken(&good[4..]), [(Some(5), Fault::Missing { first: 1, last: 4 })]);
}

#[test]
fn a_damaged_line_is_one_break_and_what_follows_is_taken_as_it_stands() {
    let mut lines = lines(1..=5);
    lines[2] = lines[2].replace("ann", "\u{0}");
    let mut verifier = Verifier::default();
    let found: Vec<_> = lines.iter().filter_map(|line| verifier.line(line.as_bytes())).collect();
    let [Broken { number: Some(3), unit: Some(unit), fault: Fault::Line(_) }] = &*found else {
        panic!("{found:?}")
    };
    assert_eq!(unit, "ZLG-1");
    // As the last line, too: it is not missing.
    let mut verifier = Verifier::default();
    assert_eq!(lines[..3].iter().filter_map(|line| verifier.line(line.as_bytes())).count(), 1);
    assert_eq!(verifier.end(Some(3)), None);
    assert_eq!(verifier.end(Some(5)).map(|broken| broken.fault), Some(Fault::Cut { first: 4, last: 5 }));
}

proptest::proptest! {
    #[test]
    fn no_line_leads_astray(lines in proptest::collection::vec(proptest::collection::vec(proptest::num::u8::ANY, 0..200), 0..20)) {
        let (mut verifier, mut chain) = (Verifier::default(), Chain::default());
        for line in &lines {
            let found = verifier.line(line);
            proptest::prop_assert!(found.is_some());
            chain.pass(line);
        }
        proptest::prop_assert_eq!(chain, Chain::default());
        proptest::prop_assert_eq!(verifier.entries, 0);
    }
}
