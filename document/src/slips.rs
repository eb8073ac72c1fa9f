//! What people write that TOML does not take, and what to write instead.

use std::ops::Range;

/// How far from an error its value is looked for (characters).
const LONGEST_VALUE: usize = 40;
/// What ends a value.
const ENDS: &str = "[]{}=,#\r\n";
const MINUS_SIGNS: [char; 2] = ['−', '–'];
const QUOTES: [char; 5] = ['“', '”', '„', '‘', '’'];

/// The value at the offset of an error that is a slip of this kind: where it stands, what is wrong with it, and what to write.
pub(crate) fn slip(text: &str, offset: usize) -> Option<(Range<usize>, String)> {
    let (before, after) = text.split_at_checked(offset)?;
    let start = offset - length(before.chars().rev(), ENDS);
    let end = offset + length(after.chars(), ENDS);
    let item = text.get(start..end)?.trim();
    let in_list = text.get(..start).is_some_and(|before| before.ends_with(['[', ',']));
    let advice = blanks(item, in_list)
        .or_else(|| minus(item))
        .or_else(|| quotes(item))
        .or_else(|| date(item))
        .or_else(|| unit(item))
        .or_else(|| leading_zero(item).filter(|_| in_list));
    if let Some(advice) = advice {
        return Some((start..end, advice));
    }
    let end = offset + length(after.chars(), "[]{}=#\r\n");
    let with_point = text.get(start..end)?.trim().replacen(',', ".", 1);
    let advice = format!("has a decimal comma: write {with_point}");
    (after.starts_with(',') && is_number(&with_point)).then_some((start..end, advice))
}

/// Length of what comes before one of these characters (bytes).
fn length(characters: impl Iterator<Item = char>, ends: &str) -> usize {
    characters.take(LONGEST_VALUE).take_while(|c| !ends.contains(*c)).map(char::len_utf8).sum()
}

fn is_number(written: &str) -> bool {
    written.contains(|c: char| c.is_ascii_digit()) && written.parse::<f64>().is_ok()
}

fn blanks(item: &str, in_list: bool) -> Option<String> {
    let parts: Vec<_> = item.split_whitespace().collect();
    if parts.len() < 2 {
        return None;
    }
    let number = parts.concat();
    if is_number(&number) {
        let comma = if in_list { ", or put a comma between" } else { "" };
        return Some(format!("has blanks between its digits: write {number}{comma}"));
    }
    parts
        .iter()
        .all(|part| is_number(part))
        .then(|| format!("has no comma between its numbers: write {}", parts.join(", ")))
}

fn minus(item: &str) -> Option<String> {
    let number = item.replace(MINUS_SIGNS, "-");
    (number != item && is_number(&number)).then(|| format!("has a typographic minus: write {number}"))
}

fn quotes(item: &str) -> Option<String> {
    let inner = item.trim_matches(QUOTES);
    (inner.len() < item.len()).then(|| format!("has typographic quotes: write \"{inner}\""))
}

fn date(item: &str) -> Option<String> {
    let mut parts = item.split('.').map(|part| part.parse::<u32>().ok());
    let [day, month, year] = [parts.next()??, parts.next()??, parts.next()??];
    let is_date =
        parts.next().is_none() && (1..=31).contains(&day) && (1..=12).contains(&month) && year > 1000;
    is_date.then(|| format!("is no date of TOML: write {year}-{month:02}-{day:02}"))
}

fn unit(item: &str) -> Option<String> {
    let split = |(end, _)| item.split_at_checked(end).filter(|(number, _)| is_number(number));
    let (number, unit) = item.char_indices().rev().find_map(split)?;
    let unit = unit.trim();
    let is_unit = unit.starts_with(|c: char| c.is_alphabetic() || "°%″′\"".contains(c))
        && !unit.contains(|c: char| c.is_ascii_digit());
    is_unit.then(|| format!("is a number with a unit: write {}, the key names the unit", number.trim()))
}

/// `[0,45, 0,008]`
fn leading_zero(item: &str) -> Option<String> {
    let is_zero_led = item.len() > 1 && item.starts_with('0') && item.chars().all(|c| c.is_ascii_digit());
    is_zero_led.then(|| "begins with 0: if it stands behind a decimal comma, write a point there".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_slip_has_no_advice() {
        for (line, at) in
            [("a = b 1", "b"), ("a = 2026-11-21", "-11"), ("a = [1, x]", "x"), ("a = 0x1G", "G")]
        {
            assert_eq!(slip(line, line.find(at).unwrap()), None, "{line}");
        }
    }
}
