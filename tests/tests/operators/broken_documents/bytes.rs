//! Not the text of a document at all.

use super::{Case, line_of};
use crate::documents::BASE;

pub(super) fn cases() -> Vec<Case> {
    let utf16 = |big: bool| {
        BASE.encode_utf16().flat_map(move |c| if big { c.to_be_bytes() } else { c.to_le_bytes() })
    };
    let with_mark: Vec<u8> = [0xff, 0xfe].into_iter().chain(utf16(false)).collect();
    let without_mark: Vec<u8> = utf16(true).collect();
    let spliced = |at: &str, bytes: &[u8]| {
        let (before, behind) = BASE.split_at(BASE.find(at).unwrap());
        [before.as_bytes(), bytes, behind.as_bytes()].concat()
    };
    let degree_in_latin_1 = spliced("\n[origin]", b"\n# 25 \xb0C");
    let nul = spliced("[origin]", b"# \0\n");
    let program: Vec<u8> =
        b"\x7fELF\x02\x01\x01\0".iter().copied().chain((0..=255).cycle().take(4096)).collect();
    let nested = format!("{BASE}\n[origin.details]\na = {}", "[".repeat(100_000));
    let half = &BASE[..BASE.find("rest_frequency").unwrap()];
    let conflict = BASE.replacen("[gyro]", "<<<<<<< HEAD\n[gyro]", 1);
    let before_origin = line_of(BASE, "[origin]");
    vec![
        Case::new("empty", "", 1, "schema", "is missing"),
        Case::new("line breaks", "\n\n\r\n", 1, "schema", "is missing"),
        Case::new("only a comment", "# to be filled in", 1, "schema", "is missing"),
        Case::new("UTF-16", with_mark, 1, "", "is not UTF-8 at byte 0"),
        Case::new("UTF-16 without a mark", without_mark, 1, "", "TOML: "),
        Case::new("Latin-1", degree_in_latin_1, before_origin, "", "is not UTF-8 at byte"),
        Case::new("NUL in a comment", nul, before_origin, "", "TOML: "),
        // A byte of it is a line break.
        Case::new("a program", program, 2, "", "is not UTF-8 at byte"),
        Case::new(
            "compressed",
            b"\x1f\x8b\x08\0\0\0\0\0\0\x03\xed\xbd".to_vec(),
            1,
            "",
            "is not UTF-8 at byte 1",
        ),
        Case::new("old line ends", BASE.replace('\n', "\r"), 1, "", "TOML: "),
        Case::new("too long", vec![b'#'; 3 << 20], 1, "", "is longer than 1048576 bytes"),
        Case::new("too long by one byte", vec![b'\n'; (1 << 20) + 1], 1, "", "is longer than 1048576 bytes"),
        Case::new("too deep", nested.clone(), line_of(&nested, "a = ["), "", "TOML: "),
        Case::new("half written", half, half.lines().count(), "", "TOML: "),
        Case::new("JSON", "{\n  \"schema\": 1\n}\n", 1, "", "is no TOML: it looks like JSON"),
        Case::new("a login page", "<!doctype html>\n<title>Sign in</title>\n", 1, "", "looks like HTML"),
        Case::new(
            "a text log",
            "sequence,x\n".to_owned() + &"1,2\n".repeat(999),
            1,
            "",
            "looks like a text log",
        ),
        Case::new("an open conflict", conflict.clone(), line_of(&conflict, "<<<<<<<"), "", "TOML: "),
        Case::new(
            "a line of another file",
            format!("{BASE}\nroot:x:0:0\n"),
            BASE.lines().count() + 2,
            "",
            "TOML: ",
        ),
    ]
}
