//! Words that the reports of modes and rates share: one sentence for all gyros that it holds of, and figures without a minus before zero.

/// Sentences of gyros, each with the names of all that it holds of, in the order of the first.
#[must_use]
pub(crate) fn together(told: &[(&str, String)]) -> Vec<String> {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, words) in told {
        match groups.iter_mut().find(|(of, _)| of == words) {
            Some((_, names)) => names.push(name),
            None => groups.push((words, vec![name])),
        }
    }
    groups.into_iter().map(|(words, names)| format!("{}: {words}", gyros(&names))).collect()
}

/// "gyro x", "gyros x, y".
#[must_use]
pub(crate) fn gyros(names: &[&str]) -> String {
    format!("{} {}", if names.len() == 1 { "gyro" } else { "gyros" }, names.join(", "))
}

/// A number to so many places; zero has no sign.
#[must_use]
pub(crate) fn fixed(value: f64, places: usize) -> String {
    let words = format!("{value:.places$}");
    match words.strip_prefix('-') {
        Some(size) if size.bytes().all(|byte| matches!(byte, b'0' | b'.')) => size.to_owned(),
        _ => words,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_of_several_gyros_is_said_once() {
        let told =
            [("x", "late"), ("y", "dead"), ("z", "late")].map(|(name, words)| (name, words.to_owned()));
        assert_eq!(together(&told), ["gyros x, z: late", "gyro y: dead"]);
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(
            [-0.0004, -0.0006, 0.0, -12.3456].map(|x| fixed(x, 3)),
            ["0.000", "-0.001", "0.000", "-12.346"]
        );
    }
}
