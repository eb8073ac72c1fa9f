//! "Did you mean": the known word that an unknown one was probably meant to be.

use strsim::osa_distance;

/// Words longer than this are no slips of the pen.
const LONGEST: usize = 64;

/// The closest of the known words, where one is close enough to be worth a guess.
pub(crate) fn closest<'k>(unknown: &str, known: impl Iterator<Item = &'k str> + Clone) -> Option<&'k str> {
    if unknown.len() > LONGEST {
        return None;
    }
    let allowed = (unknown.chars().count() / 3).max(1);
    let nearest =
        known.clone().map(|word| (osa_distance(unknown, word), word)).min_by_key(|(distance, _)| *distance);
    if let Some((distance, word)) = nearest
        && distance <= allowed
    {
        return Some(word);
    }
    // The unit forgotten or another one taken: the only known word that starts with the same one.
    let first = unknown.split('_').next().filter(|first| first.len() > 2)?;
    let mut same = known.filter(|word| word.split('_').next() == Some(first));
    same.next().filter(|_| same.next().is_none())
}

/// Edits (insert, delete, replace, swap of neighbours) from a word to the nearest of the known ones.
pub(crate) fn nearest<'k>(unknown: &str, known: impl Iterator<Item = &'k str>) -> usize {
    let unknown: String = unknown.chars().take(LONGEST).collect();
    known.map(|word| osa_distance(&unknown, word)).min().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_and_missing_units_find_their_word() {
        let known = ["grid_step_s", "smoothing_s", "range_deg_c", "channel"];
        for (unknown, expected) in [
            ("grid_setp_s", Some("grid_step_s")),
            ("smoothing", Some("smoothing_s")),
            ("range", Some("range_deg_c")),
            ("range_kelvin", Some("range_deg_c")),
            ("Channel", Some("channel")),
            ("colour", None),
            ("", None),
        ] {
            assert_eq!(closest(unknown, known.into_iter()), expected, "{unknown}");
        }
    }
}
