//! The page: shell blocks, and what is shown behind them.

use std::fmt::Write as _;
use std::path::Path;

/// A shell block and what it prints.
#[derive(Debug)]
pub(super) struct Recipe {
    /// Line of its first command.
    pub(super) line: usize,
    pub(super) commands: String,
    /// What the page shows of its output; `None` where it shows nothing.
    pub(super) shown: Option<String>,
    /// Where that stands: its first line and the line behind its last one, from 0.
    place: (usize, usize),
}

/// The page with its recipes.
#[derive(Debug)]
pub(super) struct Page {
    lines: Vec<String>,
    pub(super) recipes: Vec<Recipe>,
}

impl Page {
    pub(super) fn read(file: &Path) -> Self {
        let text = std::fs::read_to_string(file).unwrap();
        let lines: Vec<String> = text.lines().map(ToOwned::to_owned).collect();
        let mut recipes: Vec<Recipe> = Vec::new();
        let mut at = 0;
        while at < lines.len() {
            let kind = lines[at].strip_prefix("```").map(ToOwned::to_owned);
            let start = at + 1;
            at = start;
            let Some(kind) = kind else { continue };
            let end = (start..lines.len()).find(|line| lines[*line] == "```").expect("every block ends");
            let block: String = lines[start..end].iter().flat_map(|line| [line, "\n"]).collect();
            match kind.as_str() {
                "sh" => recipes.push(Recipe { line: start + 1, commands: block, shown: None, place: (0, 0) }),
                "text" => {
                    let recipe = recipes.last_mut().expect("an output has its commands");
                    assert_eq!(recipe.shown.replace(block), None, "line {start}: a second output");
                    recipe.place = (start, end);
                }
                _ => {}
            }
            at = end + 1;
        }
        Self { lines, recipes }
    }

    /// Writes the page with what its recipes show now.
    pub(super) fn write(&self, file: &Path) {
        let mut text = String::new();
        let mut at = 0;
        for recipe in &self.recipes {
            let Some(shown) = &recipe.shown else { continue };
            let (start, end) = recipe.place;
            self.lines[at..start].iter().for_each(|line| writeln!(text, "{line}").unwrap());
            shown.lines().for_each(|line| writeln!(text, "{}", line.trim_end()).unwrap());
            at = end;
        }
        self.lines[at..].iter().for_each(|line| writeln!(text, "{line}").unwrap());
        std::fs::write(file, text).unwrap();
    }
}

/// In what line the output differs from what is shown, if it does.
pub(super) fn differs(shown: &str, came: &str) -> Option<String> {
    let plain =
        |text: &str| -> Vec<String> { text.lines().map(plain).filter(|line| !line.is_empty()).collect() };
    let (shown, came) = (plain(shown), plain(came));
    let (mut shown, mut came) = (shown.as_slice(), came.as_slice());
    loop {
        match (shown, came) {
            ([], []) => return None,
            ([dots], _) if dots == "…" => return None,
            ([dots, next, ..], [line, rest @ ..]) if dots == "…" => {
                if fits(next, line) {
                    shown = &shown[1..];
                } else {
                    came = rest;
                }
            }
            ([expected, more @ ..], [line, rest @ ..]) if fits(expected, line) => {
                (shown, came) = (more, rest);
            }
            ([expected, ..], [line, ..]) => return Some(format!("{expected:?} is shown, {line:?} came")),
            ([expected, ..], []) => return Some(format!("{expected:?} is shown and did not come")),
            ([], [line, ..]) => return Some(format!("{line:?} came and is not shown")),
        }
    }
}

/// Whether a line is as shown, `…` standing for anything.
fn fits(shown: &str, line: &str) -> bool {
    let mut parts = shown.split('…');
    let Some(mut rest) = line.strip_prefix(parts.next().unwrap_or_default()) else { return false };
    let mut last = "";
    let mut dots = false;
    for part in parts {
        (dots, last) = (true, part);
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.is_empty() || (dots && (last.is_empty() || line.ends_with(last)))
}

/// A line without what differs from run to run: the width of columns, long numbers, digests, dates, times that something
/// took or has lasted.
fn plain(line: &str) -> String {
    let mut words: Vec<String> = Vec::new();
    for word in line.split_whitespace().filter(|word| !word.chars().all(|c| "─█▏▎▍▌▋▊▉".contains(c)))
    {
        let end = word.trim_end_matches([',', ';', '.', ':', ')']);
        let number = |word: &String| word.bytes().all(|byte| byte.is_ascii_digit() || byte == b'#');
        if ["ns", "µs", "ms", "s", "min", "h", "d"].contains(&end)
            && let Some(time) = words.last_mut().filter(|word| number(word))
        {
            *time = format!("#time{}", &word[end.len()..]);
        } else {
            let mut plain = String::new();
            numberless(word, &mut plain);
            words.push(plain);
        }
    }
    words.join(" ")
}

/// Writes a word with `#` in the place of a digest, and of every number that is long enough to differ.
fn numberless(word: &str, plain: &mut String) {
    let mut rest = word;
    while let Some(first) = rest.chars().next() {
        let hex = rest.find(|c: char| !matches!(c, '0'..='9' | 'a'..='f')).unwrap_or(rest.len());
        let number = rest.find(|c: char| !(c.is_ascii_digit() || ".:-".contains(c))).unwrap_or(rest.len());
        if hex >= 8 && rest[..hex].bytes().any(|byte| byte.is_ascii_digit()) {
            plain.push('#');
            rest = &rest[hex..];
        } else if first.is_ascii_digit() {
            if number < 3 {
                plain.push_str(&rest[..number]);
            } else {
                plain.push('#');
            }
            rest = &rest[number..];
        } else if "+-−–".contains(first) && rest[first.len_utf8()..].starts_with(|c: char| c.is_ascii_digit())
        {
            // The sign of a number may differ as well.
            rest = &rest[first.len_utf8()..];
        } else {
            plain.push(first);
            rest = &rest[first.len_utf8()..];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::differs;

    #[test]
    fn numbers_may_differ_and_words_may_not() {
        let shown = "revision 2 (fb75839373fa) at 12:30:01, −0.25 °/h\n…\n  end   of …\n";
        let came = "revision  2 (0175839373ff) at 09:00:59, +12.125 °/h\nanything\nat all\nend of it\n";
        assert_eq!(differs(shown, came), None);
        for (from, to) in [
            ("revision  2", "revision 3"),
            ("°/h", "mg"),
            ("end of it\n", ""),
            ("end of it", "end of it\nmore"),
        ] {
            assert!(differs(shown, &came.replace(from, to)).is_some(), "{to:?}");
        }
        assert!(differs("", "something\n").is_some() && differs("something\n", "").is_some());
        assert_eq!(differs("up 1 s  7 units\n", "up 24 min  7 units\n"), None);
        assert!(differs("up 1 s  7 units\n", "up 24 min  8 units\n").is_some());
        assert_eq!(differs("a … z\n", "a b z\n"), None);
        assert!(differs("a … z\n", "a b\n").is_some());
    }
}
