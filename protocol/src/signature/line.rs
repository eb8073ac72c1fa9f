//! The signature line: finding, reading and writing it.

use base64ct::{Base64, Encoding};

use super::error::{Damage, SignatureError, Wrong};
use super::key::{KeyId, PublicKey};
use super::message;

/// What every signature line begins with.
const MARK: &str = "# isotherm-signature: ";
/// The part of it by which a damaged one is still known.
const WORD: &str = "isotherm-signature";
/// The kind of signature that is known.
const KIND: &str = "ed25519";
/// Characters of 64 bytes in base64.
const BASE64_CHARS: usize = 88;

/// A signature as it stands in a text, not yet verified.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signature<'t> {
    covered: &'t str,
    line: usize,
    key_id: KeyId,
    bytes: [u8; 64],
}

impl<'t> Signature<'t> {
    pub(super) fn find(text: &'t str) -> Result<Option<Self>, SignatureError> {
        let mut marked = marked_lines(text);
        let Some(first) = marked.next() else {
            return lines(text).filter(|line| !line.text.trim().is_empty()).last().map_or(Ok(None), unmarked);
        };
        if let Some(second) = marked.next() {
            return Err(second.wrong(1, Wrong::Second { first_line: first.number }));
        }
        let end = first.start + first.text.len();
        if let Some(behind) = text.get(end..).filter(|behind| !behind.is_empty()) {
            let is_blank = behind.trim().is_empty();
            let what = if is_blank { "a blank line was put" } else { "something was put" };
            let wrong = Wrong::NotLast { what, signature_line: first.number };
            return Err(SignatureError { line: first.number + 1, column: 1, wrong });
        }
        let (key_id, bytes) = read(&first)?;
        let covered = text.get(..first.start).unwrap_or_default();
        Ok(Some(Self { covered, line: first.number, key_id, bytes }))
    }

    /// The text that it covers: everything before its line.
    #[must_use]
    pub fn covered(&self) -> &'t str {
        self.covered
    }

    /// The key that it says it was made with.
    #[must_use]
    pub fn key_id(&self) -> KeyId {
        self.key_id
    }

    /// Its line, from 1.
    #[must_use]
    pub fn line(&self) -> usize {
        self.line
    }

    pub(super) fn wrong(&self, wrong: Wrong) -> SignatureError {
        SignatureError { line: self.line, column: 1, wrong }
    }

    pub(super) fn holds(&self, key: &PublicKey) -> bool {
        self.holds_for(key, self.covered)
    }

    fn holds_for(&self, key: &PublicKey, covered: &str) -> bool {
        key.holds(&message(covered), &self.bytes)
    }

    /// What happened to the text, told by undoing it.
    pub(super) fn damage(&self, key: &PublicKey) -> Option<Damage> {
        if self.covered.strip_prefix('\u{feff}').is_some_and(|rest| self.holds_for(key, rest)) {
            return Some(Damage::ByteOrderMark);
        }
        let lf = self.covered.replace("\r\n", "\n");
        if lf != self.covered && self.holds_for(key, &lf) {
            return Some(Damage::ToCrlf);
        }
        let crlf = lf.replace('\n', "\r\n");
        (crlf != self.covered && self.holds_for(key, &crlf)).then_some(Damage::ToLf)
    }
}

/// The line of a signature.
pub(super) fn write(key_id: KeyId, bytes: &[u8; 64]) -> String {
    format!("{MARK}{KIND} {key_id} {}\n", Base64::encode_string(bytes))
}

/// One line of a text, its line break included.
#[derive(Debug, Clone, Copy)]
struct Line<'t> {
    text: &'t str,
    /// Byte offset.
    start: usize,
    /// From 1.
    number: usize,
}

impl Line<'_> {
    fn wrong(&self, column: usize, wrong: Wrong) -> SignatureError {
        SignatureError { line: self.number, column, wrong }
    }

    /// Whether it was once a signature line, however damaged.
    fn is_marked(&self) -> bool {
        let words = self.text.trim_start().strip_prefix('#').map(str::trim_start);
        let word = words.and_then(|words| words.get(..WORD.len()));
        word.is_some_and(|word| word.eq_ignore_ascii_case(WORD))
    }
}

fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    text.split_inclusive('\n').scan((0, 0), |(next, number), text| {
        let start = *next;
        *next += text.len();
        *number += 1;
        Some(Line { text, start, number: *number })
    })
}

/// The lines that are, or once were, signatures.
fn marked_lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    lines(text).filter(Line::is_marked)
}

/// All other lines.
pub(super) fn other_lines(text: &str) -> impl Iterator<Item = &str> {
    lines(text).filter(|line| !line.is_marked()).map(|line| line.text)
}

/// A last line without the mark: a signature all the same, if it ends as one. A document must not pass for an unsigned one
/// because its mark was hit.
fn unmarked<'t>(last: Line<'_>) -> Result<Option<Signature<'t>>, SignatureError> {
    let token = last.text.split_whitespace().last().unwrap_or_default();
    let is_base64 =
        |text: &str| text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+/".contains(&byte));
    if token.len() == BASE64_CHARS && token.strip_suffix("==").is_some_and(is_base64) {
        return Err(last.wrong(1, Wrong::Form("does not begin with its mark".to_owned())));
    }
    Ok(None)
}

/// Reads a line in exactly the form that is written, so that one signature has one form.
fn read(line: &Line<'_>) -> Result<(KeyId, [u8; 64]), SignatureError> {
    let form = |column: usize, words: &str| line.wrong(column, Wrong::Form(words.to_owned()));
    let text = line.text.strip_suffix('\n').unwrap_or(line.text);
    let trimmed = text.trim_end();
    if trimmed != text {
        let what = if text.ends_with('\r') { "CRLF, its line ends were converted" } else { "blanks" };
        return Err(line.wrong(trimmed.chars().count() + 1, Wrong::End(what)));
    }
    let rest = text.strip_prefix(MARK).ok_or_else(|| form(1, "does not begin with its mark"))?;
    let mut column = MARK.len() + 1;
    let mut words = rest.split(' ');
    let mut next = || {
        let (word, at) = (words.next().unwrap_or_default(), column);
        column += word.chars().count() + 1;
        (word, at)
    };
    let ((kind, kind_at), (key_id, key_id_at), (bytes, bytes_at)) = (next(), next(), next());
    if kind != KIND {
        let kind = kind.chars().filter(|c| !c.is_control()).take(16).collect();
        return Err(line.wrong(kind_at, Wrong::Kind(kind)));
    }
    let key_id = key_id.parse().map_err(|()| {
        form(key_id_at, "has a damaged key id: it must be 16 hexadecimal digits in lower case")
    })?;
    let mut signature = [0; 64];
    // The decoder takes one form only: padded, and no bits to spare.
    let decoded = Base64::decode(bytes, &mut signature).map(<[u8]>::len);
    if decoded != Ok(64) {
        let words = format!(
            "has a damaged signature: {} characters instead of {BASE64_CHARS} of base64, or wrong ones",
            bytes.chars().count()
        );
        return Err(form(bytes_at, &words));
    }
    let (rest, rest_at) = next();
    if rest.is_empty() { Ok((key_id, signature)) } else { Err(form(rest_at, "has more after the signature")) }
}
