//! Files as text, or what keeps them from being read as such.

use std::io::Read;
use std::path::Path;

use isotherm_document::unplaced;
use isotherm_protocol::document::{MAX_DOCUMENT_BYTES, Problem};

/// Reads a file up to one byte more than a document may have, so that a wrong file cannot fill the memory.
pub(crate) fn read_bounded(file: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::fs::File::open(file)?.take(MAX_DOCUMENT_BYTES as u64 + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Refuses a pipe or a device under the name of a file: to open or read it might wait for ever. What is not there is no problem here.
pub(crate) fn check_regular(file: &Path) -> std::io::Result<()> {
    match std::fs::metadata(file) {
        Ok(found) if !found.is_file() => {
            Err(std::io::Error::other("it is a folder, pipe or device, not a file"))
        }
        _ => Ok(()),
    }
}

/// A problem of a file as a whole.
pub(crate) fn whole(file: &str, message: String) -> Problem {
    unplaced(Some(file), message)
}

/// What was read by [`read_bounded`], as text.
///
/// # Errors
/// The one problem of a file that is too long, or not UTF-8.
pub(crate) fn text<'b>(bytes: &'b [u8], file: &str) -> Result<&'b str, Vec<Problem>> {
    if bytes.len() > MAX_DOCUMENT_BYTES {
        let message = format!("is longer than {MAX_DOCUMENT_BYTES} bytes: is it the right file?");
        return Err(vec![whole(file, message)]);
    }
    std::str::from_utf8(bytes).map_err(|error| {
        let at = error.valid_up_to();
        let before = String::from_utf8_lossy(bytes.get(..at).unwrap_or_default());
        let message = format!("is not UTF-8 at byte {at}: is it the right file, saved as UTF-8?");
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        vec![Problem { line, column, ..whole(file, message) }]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_text_has_one_problem() {
        let words = |bytes: &[u8]| text(bytes, "f").unwrap_err()[0].to_string();
        assert_eq!(text("°".as_bytes(), "f"), Ok("°"));
        assert!(words(b"a = 1\n\xff").starts_with("f:2:1: is not UTF-8 at byte 6"));
        assert!(words(&vec![b'#'; MAX_DOCUMENT_BYTES + 1]).contains("is longer than 1048576 bytes"));
        let zero = read_bounded(Path::new("/dev/zero")).unwrap();
        assert_eq!(zero.len(), MAX_DOCUMENT_BYTES + 1);
    }
}
