//! Whatever the text, there is an answer.

use proptest::prelude::*;

use super::super::{Document, MAX_DOCUMENT_BYTES};
use super::{FULL, OTHER, listed, refuse};

/// Texts that are worth having anywhere.
const SPLICES: [&str; 26] = [
    "",
    "\n",
    "\"",
    "'",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ".",
    ",",
    "#",
    "nan",
    "-inf",
    "1e999",
    "0x7fffffffffffffff",
    "99999999999999999999",
    "true",
    "1979-05-27",
    "[gyro]",
    "[[gyro.sensor]]",
    "a.b = 1\n",
    "\u{feff}",
    "é\u{1f600}",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_documents_never_panic(
        full in any::<bool>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0_usize..40, any::<prop::sample::Index>()), 1..6),
    ) {
        let mut bytes = if full { FULL } else { OTHER }.as_bytes().to_vec();
        for (at, cut, splice) in edits {
            let at = at.index(bytes.len());
            let end = (at + cut).min(bytes.len());
            bytes.splice(at..end, splice.get(&SPLICES).bytes());
            if bytes.is_empty() {
                bytes.push(b'#');
            }
        }
        check(&bytes);
    }

    #[test]
    fn any_number_anywhere_never_panics(
        full in any::<bool>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<f64>()), 1..4),
    ) {
        let mut text = if full { FULL } else { OTHER }.to_owned();
        for (at, value) in edits {
            let numbers: Vec<_> = numbers(&text);
            let (start, end) = numbers[at.index(numbers.len())];
            text.replace_range(start..end, &format!("{value:e}").replace("NaN", "nan"));
        }
        check(text.as_bytes());
    }

    #[test]
    fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        check(&bytes);
    }
}

/// Start and end of every number after an equals sign, bracket or comma.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let part = |b: u8| b.is_ascii_digit() || b"+-.e_".contains(&b);
    (1..bytes.len())
        .filter(|&i| part(bytes[i]) && (b" [".contains(&bytes[i - 1])) && bytes[i] != b'e')
        .map(|i| (i, (i..bytes.len()).find(|&j| !part(bytes[j])).unwrap_or(bytes.len())))
        .collect()
}

/// Whatever is accepted is written and read back; whatever is refused says something.
fn check(bytes: &[u8]) {
    match Document::parse_bytes(bytes, None) {
        Ok(parsed) => {
            let written = parsed.document.to_toml().unwrap();
            let again =
                Document::parse(&written, None).unwrap_or_else(|problems| panic!("{}", listed(&problems)));
            assert_eq!(again.document, parsed.document);
        }
        Err(problems) => {
            assert!(!problems.is_empty());
            assert!(
                problems
                    .iter()
                    .all(|problem| problem.line > 0 && problem.column > 0 && !problem.message.is_empty())
            );
        }
    }
}

#[test]
fn what_is_too_long_is_not_read() {
    let text = format!("{FULL}\n#{}", "x".repeat(MAX_DOCUMENT_BYTES));
    let problems = refuse(&text);
    insta::assert_snapshot!(listed(&problems));
}

#[test]
fn a_flood_of_errors_is_cut_short() {
    let unknown = (0..60_000).map(|i| format!("k{i} = {i}")).collect::<Vec<_>>().join("\n");
    let sensors = "[[gyro.sensor]]\nq = 1\n".repeat(40_000);
    let knots = format!("note = [{}]", "[1,'a'],".repeat(120_000));
    for text in [unknown, sensors, knots] {
        let text = &text[..text.len().min(MAX_DOCUMENT_BYTES)];
        let start = std::time::Instant::now();
        let problems = refuse(text);
        assert!(problems.len() <= 257, "{}", problems.len());
        assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    }
}

#[test]
fn deep_nesting_is_refused() {
    for text in
        [format!("a = {}", "[".repeat(100_000)), format!("{}1", "a.".repeat(100_000)), "{a=".repeat(50_000)]
    {
        assert!(!refuse(&text).is_empty());
    }
}
