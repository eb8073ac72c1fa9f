//! The file of a private key.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use isotherm_cli::Exit;
use isotherm_protocol::document::Problem;
use isotherm_protocol::signature::PrivateKey;

use isotherm_document::file::{read_bounded, text};
use isotherm_document::unplaced;

/// Permissions of group and others, of which a private key must have none.
const OTHERS: u32 = 0o077;

/// Reads a private key. The second value is what is doubtful about its file.
///
/// # Errors
/// What is wrong, and how the command ends.
pub(super) fn read(path: &Path) -> Result<(PrivateKey, Option<Problem>), (Problem, Exit)> {
    let file = path.display().to_string();
    let bytes = read_bounded(path)
        .map_err(|error| (unplaced(Some(&file), format!("cannot be read: {error}")), Exit::Failed))?;
    let bad = |message: String| (unplaced(Some(&file), message), Exit::BadConfiguration);
    let text = text(&bytes, Some(&file)).map_err(|_| bad("is not text, so not a PEM key".to_owned()))?;
    let key = PrivateKey::from_pem(text).map_err(|error| bad(error.to_string()))?;
    Ok((key, exposed(path, &file)))
}

/// Says so where others than the owner can get at the key.
fn exposed(path: &Path, file: &str) -> Option<Problem> {
    let mode = std::fs::metadata(path).ok()?.permissions().mode() & 0o777;
    (mode & OTHERS != 0).then(|| {
        unplaced(
            Some(file),
            format!("is a private key that others can read (mode {mode:o}): `chmod 600 {file}`"),
        )
    })
}
