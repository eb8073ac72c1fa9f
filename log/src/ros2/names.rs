//! Names that ROS allows, for serials and channels that it does not.

use std::collections::{BTreeMap, BTreeSet};

use crate::streams::raw_text::free_name;

/// Part of a topic's name for a serial or a channel, as ROS allows it: letters, digits and single underscores, the
/// first a letter.
///
/// Every other character becomes an underscore, a run of them one; what would then begin with none of the letters gets
/// `prefix` and an underscore in front.
#[must_use]
pub fn token(name: &str, prefix: &str) -> String {
    let mut token = String::with_capacity(name.len());
    for character in name.chars() {
        let plain = if character.is_ascii_alphanumeric() { character } else { '_' };
        if plain != '_' || !token.ends_with('_') {
            token.push(plain);
        }
    }
    let token = token.trim_end_matches('_');
    if token.starts_with(|first: char| first.is_ascii_alphabetic()) {
        return token.to_owned();
    }
    let token = token.trim_start_matches('_');
    if token.is_empty() { prefix.to_owned() } else { format!("{prefix}_{token}") }
}

/// Different names of a kind, each with a different part of a topic's name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Names {
    tokens: BTreeMap<String, String>,
}

impl Names {
    /// Of all names, in the order of their characters: where two would come to the same, the second gets `_2`.
    #[must_use]
    pub fn of<'a>(names: impl IntoIterator<Item = &'a str>, prefix: &str) -> Self {
        let sorted: BTreeSet<_> = names.into_iter().collect();
        let mut taken = BTreeSet::new();
        let mut tokens = BTreeMap::new();
        for name in sorted {
            tokens.insert(name.to_owned(), free_name(token(name, prefix), &mut taken));
        }
        Self { tokens }
    }

    /// The part for a name; that of [`token`] for one that was not among them.
    #[must_use]
    pub fn get(&self, name: &str) -> String {
        self.tokens.get(name).cloned().unwrap_or_else(|| token(name, "x"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_names_become_legal_ones() {
        for (name, expected) in [
            ("ZLG-0001", "ZLG_0001"),
            ("a.-_b", "a_b"),
            ("0042", "unit_0042"),
            ("-7-", "unit_7"),
            ("...", "unit"),
            ("x_", "x"),
        ] {
            assert_eq!(token(name, "unit"), expected, "{name}");
        }
        assert_eq!(token("Gehäuse oben", "channel"), "Geh_use_oben");
    }

    #[test]
    fn different_names_stay_different() {
        let names = Names::of(["A_1", "A-1", "A.1", "A_1_2"], "unit");
        let tokens = ["A-1", "A.1", "A_1", "A_1_2"].map(|name| names.get(name));
        assert_eq!(tokens, ["A_1", "A_1_2", "A_1_3", "A_1_2_2"]);
    }
}
