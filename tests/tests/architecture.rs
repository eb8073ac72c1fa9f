//! The tables of the paths of a tick and of a swap in `ARCHITECTURE.md` are true: every file is there, every function and type is in it,
//! and the counts are the table's.

#![expect(clippy::panic, reason = "what does not hold ends the test")]

use std::path::Path;

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
    number.unwrap_or_else(|| panic!("it is not stated how many {word} there are: {section}"))
}

/// The types that a row says are in its file, or in the file behind them.
fn types<'a>(row: &Row<'a>) -> Vec<(&'a str, &'a str)> {
    let parts = row.text.split("type `").skip(1);
    let types = parts.map(|part| {
        let name = part.split('`').next().unwrap_or(part);
        let file = part.split_once("` (`").filter(|(before, _)| *before == name);
        (name, file.map_or(row.file, |(_, file)| file.split('`').next().unwrap_or(file)))
    });
    types.collect()
}

/// Checks the table of a section against its files, and these counts against the table.
fn check(heading: &str, stated_counts: &[&str]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |file: &str| {
        std::fs::read_to_string(root.join(file))
            .unwrap_or_else(|error| panic!("{file} cannot be read: {error}"))
    };
    let page = read("ARCHITECTURE.md");
    let (_, section) = page.split_once(heading).unwrap_or_else(|| panic!("there is no {heading:?}"));
    let section = section.split("\n## ").next().unwrap_or(section);
    let rows = rows(section);
    let (mut seen, mut named) = (Vec::new(), 0);
    for row in &rows {
        let Row { text, file, functions } = row;
        assert!(!seen.contains(file), "{file} has two rows; the second is {text:?}");
        seen.push(file);
        let source = read(file);
        assert!(!functions.is_empty(), "row {text:?} names no function");
        for (index, function) in functions.iter().enumerate() {
            assert!(!functions[..index].contains(function), "row {text:?} names {function} twice");
            assert!(defines(&source, function), "{file} has no `fn {function}`, which row {text:?} names");
        }
        for (name, file) in types(row) {
            let is_there = read(file).contains(&format!("struct {name} {{"));
            assert!(is_there, "{file} has no `struct {name}`, which row {text:?} names");
            named += 1;
        }
    }
    let functions = rows.iter().map(|row| row.functions.len()).sum::<usize>();
    let copies = rows.iter().filter(|row| row.text.contains("(copy ")).count();
    let counts = [("files", rows.len()), ("functions", functions), ("copies", copies), ("types", named)];
    for (word, counted) in counts.into_iter().filter(|(word, _)| stated_counts.contains(word)) {
        let stated = stated(section, word);
        assert_eq!(stated, counted, "{heading:?} states {stated} {word}, its table has {counted}");
    }
}

#[test]
fn the_path_of_a_tick_is_as_the_architecture_says() {
    check("## The path of a gyro tick", &["files", "functions", "copies"]);
}

#[test]
fn the_path_of_a_swap_is_as_the_architecture_says() {
    check("## The path of a swap", &["files", "types"]);
}
