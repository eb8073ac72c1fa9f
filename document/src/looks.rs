//! What a file is that was given in the place of a TOML text by mistake.

/// What begins so cannot be TOML.
const BEGINNINGS: [(&[u8], &str); 10] = [
    (b"\x89MCAP", "a recording (MCAP)"),
    (b"\x1f\x8b", "compressed (gzip)"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"PAR1", "a Parquet file"),
    (b"\x7fELF", "a program"),
    (b"\xff\xfe", "UTF-16"),
    (b"\xfe\xff", "UTF-16"),
    (b"{", "JSON"),
    (b"<!", "HTML or XML"),
    (b"<?", "HTML or XML"),
];

/// How much of a file is looked at (bytes).
const LOOKED_AT: usize = 1 << 12;

/// What a file looks like, where that is no TOML text.
pub(crate) fn looks_like(bytes: &[u8]) -> Option<&'static str> {
    let bytes = bytes.trim_ascii_start();
    let start = bytes.get(..LOOKED_AT).unwrap_or(bytes);
    let known = BEGINNINGS.iter().find(|(beginning, _)| start.starts_with(beginning));
    if let Some((_, words)) = known {
        return Some(words);
    }
    let start = String::from_utf8_lossy(start);
    let mut lines = start.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let states_something = lines.clone().any(|line| line.contains('=') || line.starts_with('['));
    let has_cells = |line: &str| line.contains([',', ';', '\t']);
    (!states_something && lines.next().is_some_and(has_cells)).then_some("a text log or other table (CSV)")
}

/// What to look at in a file that cannot be right.
pub(crate) fn doubt(bytes: &[u8]) -> String {
    looks_like(bytes).map_or_else(
        || "is it the right file, saved as UTF-8?".to_owned(),
        |words| format!("it looks like {words}, which is no document"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_be_toml_with_an_error_looks_like_nothing_else() {
        for (text, like) in [
            ("\n{\n  \"schema\": 1\n}\n", Some("JSON")),
            ("<?xml version=\"1.0\"?>\n", Some("HTML or XML")),
            ("# a comment\nsequence;x;y\n1;0.5;0.25\n", Some("a text log or other table (CSV)")),
            ("<<<<<<< HEAD\nschema = 1\n", None),
            ("schema, 1\nunit = \"A-1\"\n", None),
            ("a, b\n[gyro\n", None),
            ("schema", None),
            ("# a, b", None),
        ] {
            assert_eq!(looks_like(text.as_bytes()), like, "{text}");
        }
    }
}
