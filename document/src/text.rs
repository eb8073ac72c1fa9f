//! From bytes to the root of a TOML text: size, UTF-8, syntax, version. What is wrong here ends the matter.

use toml::Spanned;
use toml::de::DeTable;

use crate::problem::{Lines, Problem};
use crate::reader::Reader;
use crate::schema::Form;

/// Longest text that is read, in bytes.
pub const MAX_BYTES: usize = 1 << 20;

/// What the TOML parser says of a key that is given twice.
const DUPLICATE_KEY: &str = "duplicate key";

/// Bytes as text.
///
/// # Errors
/// The place of the first bytes that are not UTF-8.
pub fn utf8<'b>(bytes: &'b [u8], file: Option<&str>) -> Result<&'b str, Vec<Problem>> {
    std::str::from_utf8(bytes).map_err(|error| {
        let valid = error.valid_up_to();
        let before =
            bytes.get(..valid).and_then(|before| std::str::from_utf8(before).ok()).unwrap_or_default();
        let (line, column) = Lines::new(before).position(valid);
        let message = format!("is not UTF-8 at byte {valid}: save the document as UTF-8");
        vec![Problem { line, column, ..unplaced(file, message) }]
    })
}

/// A problem of the text as a whole.
#[must_use]
pub fn unplaced(file: Option<&str>, message: String) -> Problem {
    Problem { file: file.map(Into::into), line: 1, column: 1, key: String::new(), message }
}

impl<'t> Reader<'t> {
    /// The root table of the text; `None` where it is not worth walking, which has been reported then.
    pub(crate) fn root(&mut self, form: &Form) -> Option<Spanned<DeTable<'t>>> {
        let text = self.text();
        if text.len() > MAX_BYTES {
            self.report_at(0, "", format!("is {} bytes long, may have {MAX_BYTES}", text.len()));
            return None;
        }
        let (root, errors) = DeTable::parse_recoverable(text);
        for error in &errors {
            let span = error.span().unwrap_or(0..0);
            let message = match error.message() {
                DUPLICATE_KEY => {
                    format!("TOML: {DUPLICATE_KEY} `{}`: remove one", self.excerpt(span.clone()))
                }
                other => format!("TOML: {other}"),
            };
            self.report_at(span.start, "", message);
        }
        // After a duplicate key (the first one counts) the walk can go on; after any other error of syntax it
        // would find fault with what the author never wrote.
        let broken = errors.iter().any(|error| error.message() != DUPLICATE_KEY);
        (!broken && !self.is_foreign(root.get_ref(), form)).then_some(root)
    }

    /// Refuses a text of another version before anything else is said about its keys.
    fn is_foreign(&mut self, root: &DeTable<'_>, form: &Form) -> bool {
        let Some((key, [oldest, newest])) = form.versions else { return false };
        let Some(value) = root.get(key) else { return false };
        let version = value.get_ref().as_integer().map(|integer| integer.as_str().parse::<u32>());
        let Some(Ok(version)) = version else { return false };
        let foreign = !(oldest..=newest).contains(&version);
        if foreign {
            let known = if oldest == newest { format!("{newest}") } else { format!("{oldest} to {newest}") };
            let message = format!("is version {version}; this release reads {known}: nothing else was read");
            self.report_at(value.span().start, key, message);
        }
        foreign
    }
}
