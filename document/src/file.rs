//! Files as text, or what keeps them from being read as such.

use std::io::Read;
use std::path::Path;

use crate::looks::doubt;
use crate::problem::{Lines, Problem};
use crate::text::{MAX_BYTES, unplaced};

/// Reads a file up to one byte more than a text may have, so that a wrong file cannot fill the memory.
///
/// # Errors
/// That of the file.
pub fn read_bounded(file: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::fs::File::open(file)?.take(MAX_BYTES as u64 + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Refuses a pipe or a device under the name of a file: to open or read it might wait for ever. What is not there is no problem here.
///
/// # Errors
/// What the file is instead.
pub fn check_regular(file: &Path) -> std::io::Result<()> {
    match std::fs::metadata(file) {
        Ok(found) if !found.is_file() => {
            Err(std::io::Error::other("it is a folder, pipe or device, not a file"))
        }
        _ => Ok(()),
    }
}

/// Bytes as text, as they were read by [`read_bounded`] or came over the bus.
///
/// # Errors
/// The one problem of what is too long, or not UTF-8: the place of the first bytes that are not.
pub fn text<'b>(bytes: &'b [u8], file: Option<&str>) -> Result<&'b str, Vec<Problem>> {
    if bytes.len() > MAX_BYTES {
        let message = format!("is longer than {MAX_BYTES} bytes: {}", doubt(bytes));
        return Err(vec![unplaced(file, message)]);
    }
    std::str::from_utf8(bytes).map_err(|error| {
        let valid = error.valid_up_to();
        let before =
            bytes.get(..valid).and_then(|before| std::str::from_utf8(before).ok()).unwrap_or_default();
        let (line, column) = Lines::new(before).position(valid);
        let message = format!("is not UTF-8 at byte {valid}: {}", doubt(bytes));
        vec![Problem { line, column, ..unplaced(file, message) }]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_text_has_one_problem() {
        let words = |bytes: &[u8]| text(bytes, Some("f")).unwrap_err()[0].to_string();
        assert_eq!(text("°".as_bytes(), Some("f")), Ok("°"));
        let long = vec![b'#'; MAX_BYTES + 1];
        insta::assert_snapshot!(
            [b"a = 1\n\xff".as_slice(), &long, b"\x89MCAP0\r\n\xff"].map(words).join("\n")
        );
        let zero = read_bounded(Path::new("/dev/zero")).unwrap();
        assert_eq!(zero.len(), MAX_BYTES + 1);
    }
}
