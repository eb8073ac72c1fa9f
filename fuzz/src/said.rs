//! What is said of an input.

use std::fmt::Display;

use isotherm_document::Problem;
use isotherm_document::escape::is_unfit;

/// Longest line that anybody is to read, in characters.
const LONGEST: usize = 1000;
/// Most problems of one text: those that are listed, and how many more there are.
const MOST: usize = 257;

/// Few words, whatever they repeat of the input.
pub(crate) fn in_few_words(said: &impl Display) {
    let words = said.to_string();
    assert!(!words.is_empty() && words.chars().count() <= LONGEST, "{} bytes: {words}", words.len());
}

/// A line that paints no screen and forges no other line.
pub(crate) fn on_one_line(said: &impl Display) {
    in_few_words(said);
    let words = said.to_string();
    assert!(!words.chars().any(is_unfit), "{words:?}");
}

/// A few lines, each with its place.
pub(crate) fn listed(problems: &[Problem]) {
    assert!(!problems.is_empty() && problems.len() <= MOST, "{} problems", problems.len());
    problems.iter().for_each(on_one_line);
    assert!(problems.iter().all(|problem| problem.line > 0 && problem.column > 0));
}
