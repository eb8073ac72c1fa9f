//! One sentence for all gyros, or logs, that it holds of.

/// Sentences of gyros, each with the names of all that it holds of, in the order of the first.
#[must_use]
pub(crate) fn together(told: &[(&str, String)]) -> Vec<String> {
    grouped(told).into_iter().map(|(words, names)| format!("{}: {words}", gyros(&names))).collect()
}

/// Sentences of logs, each with the names of all that it holds of; of many only the first.
#[must_use]
pub(crate) fn of_logs(told: &[(&str, String)]) -> Vec<String> {
    const MOST: usize = 4;
    let logs = |names: &[&str]| match names.get(..MOST) {
        Some(first) if names.len() > MOST + 1 => {
            format!("{} and {} more logs, each", first.join(", "), names.len() - MOST)
        }
        _ if names.len() > 1 => format!("{}, each", names.join(", ")),
        _ => names.join(", "),
    };
    grouped(told).into_iter().map(|(words, names)| format!("{}: {words}", logs(&names))).collect()
}

/// Sentences with the names of all that they hold of, in the order of the first.
#[must_use]
pub(crate) fn grouped<'a>(told: &'a [(&'a str, String)]) -> Vec<(&'a str, Vec<&'a str>)> {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, words) in told {
        match groups.iter_mut().find(|(of, _)| of == words) {
            Some((_, names)) => names.push(name),
            None => groups.push((words, vec![name])),
        }
    }
    groups
}

/// "gyro x", "gyros x, y".
#[must_use]
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
