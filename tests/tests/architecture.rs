//! The table of a tick's path in `ARCHITECTURE.md` is true: every file is there, every function is in it, and the counts are the table's.

#![expect(clippy::panic, reason = "what does not hold ends the test")]

use std::path::Path;

/// What the section begins with, up to the next one.
const HEADING: &str = "## The path of a gyro tick";

/// A row of the table.
struct Row<'a> {
    text: &'a str,
    file: &'a str,
    functions: Vec<&'a str>,
}

/// What stands between backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// The rows of a table whose first column is a file and whose second names its functions.
fn rows(section: &str) -> Vec<Row<'_>> {
    let lines = section.lines().filter(|line| line.starts_with("| `"));
    let rows = lines.map(|text| {
        let mut columns = text.split('|').skip(1);
        let mut column = || columns.next().unwrap_or_else(|| panic!("row {text:?} has too few columns"));
        let file = quoted(column()).next().unwrap_or_else(|| panic!("row {text:?} names no file"));
        Row { text, file, functions: quoted(column()).collect() }
    });
    rows.collect()
}

/// Whether a source defines a function, which may stand with its type: `Type::name`.
fn defines(source: &str, function: &str) -> bool {
    let name = function.rsplit("::").next().unwrap_or(function);
    source.match_indices("fn ").any(|(at, keyword)| {
        let rest = source[at + keyword.len()..].strip_prefix(name);
        rest.is_some_and(|rest| rest.starts_with(['(', '<']))
    })
}

/// The number before a word, as in "45 files".
fn stated(section: &str, word: &str) -> usize {
    let before = section.split_once(&format!(" {word}")).map(|(before, _)| before);
    let number = before.and_then(|before| before.split_whitespace().last()?.parse().ok());
    number.unwrap_or_else(|| panic!("{HEADING:?} does not state how many {word} there are"))
}

#[test]
fn the_path_of_a_tick_is_as_the_architecture_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let page = std::fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    let (_, section) = page.split_once(HEADING).unwrap_or_else(|| panic!("there is no {HEADING:?}"));
    let section = section.split("\n## ").next().unwrap();
    let rows = rows(section);
    let mut seen = Vec::new();
    for Row { text, file, functions } in &rows {
        assert!(!seen.contains(file), "{file} has two rows; the second is {text:?}");
        seen.push(file);
        let source = std::fs::read_to_string(root.join(file))
            .unwrap_or_else(|error| panic!("{file} of row {text:?} cannot be read: {error}"));
        assert!(!functions.is_empty(), "row {text:?} names no function");
        for (index, function) in functions.iter().enumerate() {
            assert!(!functions[..index].contains(function), "row {text:?} names {function} twice");
            assert!(defines(&source, function), "{file} has no `fn {function}`, which row {text:?} names");
        }
    }
    let functions = rows.iter().map(|row| row.functions.len()).sum::<usize>();
    let copies = rows.iter().filter(|row| row.text.contains("(copy ")).count();
    for (word, counted) in [("files", rows.len()), ("functions", functions), ("copies", copies)] {
        let stated = stated(section, word);
        assert_eq!(stated, counted, "{HEADING:?} states {stated} {word}, its table has {counted}");
    }
}
