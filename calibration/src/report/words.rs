//! The lines of a terminal; one sentence for all gyros, or logs, that it holds of.

use crate::numbers::grouped;
use crate::report::counted;

/// Lines of a terminal that a unit has at most: what an engineer decides by. The page and the JSON have the rest.
const LINES: usize = 12;
/// Fewest of them for what is to be looked at.
const LEAST_TOLD: usize = 2;

/// What was found, what is to be looked at, as much of it as there is room for, and where the rest is.
pub(crate) fn dozen(found: &[String], told: &[String], rest: &str) -> String {
    let room = LINES.saturating_sub(found.len() + 1).max(LEAST_TOLD);
    let lines: Vec<&str> = found.iter().chain(told.iter().take(room)).map(String::as_str).collect();
    let more = match told.len().saturating_sub(room) {
        0 => String::new(),
        more => format!("{} to be looked at; ", counted(more, "more thing is", "more things are")),
    };
    format!("{}\n{more}{rest}: --html FILE, or --json.\n", lines.join("\n"))
}

/// Sentences of gyros, each with the names of all that it holds of, in the order of the first.
pub(crate) fn together(told: &[(&str, String)]) -> Vec<String> {
    let told = told.iter().map(|(name, words)| (*name, words));
    grouped(told).into_iter().map(|(words, names)| format!("{}: {words}", gyros(&names))).collect()
}

/// Sentences of logs, each with the names of all that it holds of; of many only the first.
pub(crate) fn of_logs(told: &[(&str, String)]) -> Vec<String> {
    const MOST: usize = 4;
    let logs = |names: &[&str]| match names.get(..MOST) {
        Some(first) if names.len() > MOST + 1 => {
            format!("{} and {} more logs, each", first.join(", "), names.len() - MOST)
        }
        _ if names.len() > 1 => format!("{}, each", names.join(", ")),
        _ => names.join(", "),
    };
    let told = told.iter().map(|(name, words)| (*name, words));
    grouped(told).into_iter().map(|(words, names)| format!("{}: {words}", logs(&names))).collect()
}

/// "gyro x", "gyros x, y".
pub(crate) fn gyros(names: &[&str]) -> String {
    format!("{} {}", if names.len() == 1 { "gyro" } else { "gyros" }, names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_of_several_gyros_is_said_once() {
        let told =
            [("x", "late"), ("y", "dead"), ("z", "late")].map(|(name, words)| (name, words.to_owned()));
        assert_eq!(together(&told), ["gyros x, z: late", "gyro y: dead"]);
        assert_eq!(of_logs(&told), ["x, z, each: late", "y: dead"]);
        let many = ["a", "b", "c", "d", "e", "f"].map(|name| (name, "late".to_owned()));
        assert_eq!(of_logs(&many), ["a, b, c, d and 2 more logs, each: late"]);
    }
}
