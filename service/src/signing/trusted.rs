//! The folder of trusted keys.

use std::ffi::OsStr;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use isotherm_protocol::document::Problem;
use isotherm_protocol::signature::{self, PublicKey, TrustedKeys};

use crate::config::SwapSettings;
use crate::control::watch::files_in;

use isotherm_document::file::{read_bounded, text};
use isotherm_document::unplaced;

/// Longest name of a signer, in characters.
const LONGEST_NAME: usize = 64;
/// How the first line of a private key ends, whatever its form.
const PRIVATE: &[u8] = b"PRIVATE KEY-----";
/// Whether everybody may write.
const WORLD_WRITABLE: u32 = 0o002;

/// Reads every `*.pub` of a folder, hidden files and sub-folders excepted; a key is trusted under its file's name without
/// the ending. The second value is what is doubtful, file by file in the order of their names.
///
/// # Errors
/// One problem for each file that is no key, or a key that is there twice; one for a folder that cannot be read. With a
/// bad file among them no key is taken: a key that silently did not count would have its signer's documents refused.
pub fn read_trusted_keys(folder: &Path) -> Result<(TrustedKeys, Vec<Problem>), Vec<Problem>> {
    let name = folder.display().to_string();
    let unread = |error: std::io::Error| vec![unplaced(Some(&name), format!("cannot be read: {error}"))];
    let files = files_in(folder, "pub").map_err(unread)?;
    let mut trusted = TrustedKeys::default();
    let (mut problems, mut warnings) = (Vec::new(), Vec::new());
    warnings.extend(open_to_all(folder));
    for path in files {
        let file = path.display().to_string();
        let added = read_key(&path).and_then(|(name, key)| {
            trusted.insert(&name, key).map_err(|rival| format!("{rival}, in {}", folder.display()))
        });
        if let Err(message) = added {
            problems.push(unplaced(Some(&file), message));
        }
        warnings.extend(open_to_all(&path));
    }
    warnings.extend(private_keys(folder).map_err(unread)?);
    if problems.is_empty() { Ok((trusted, warnings)) } else { Err(problems) }
}

/// What is doubtful about the configured keys, as a service finds it at its start.
///
/// # Errors
/// As [`read_trusted_keys`].
pub(crate) fn doubts(settings: &SwapSettings) -> Result<Vec<Problem>, Vec<Problem>> {
    let Some(folder) = &settings.trusted_keys else { return Ok(Vec::new()) };
    let (trusted, mut doubts) = read_trusted_keys(folder)?;
    if settings.require_signature && trusted.is_empty() {
        let words = "has no *.pub, so every document is refused (swap.require_signature): copy the public keys of \
                     those who sign there";
        doubts.push(unplaced(Some(&folder.display().to_string()), words.to_owned()));
    }
    Ok(doubts)
}

/// Verifies the signature as far as the configuration asks for one.
pub(crate) fn check_signature(
    settings: &SwapSettings,
    text: &str,
    name: &str,
    problems: &mut Vec<Problem>,
    warnings: &mut Vec<Problem>,
) {
    let Some(folder) = &settings.trusted_keys else { return };
    let verdict = if settings.require_signature { problems } else { &mut *warnings };
    // Read at each swap: a key that was added or taken away counts at once.
    let (keys, doubts) = match read_trusted_keys(folder) {
        Ok(read) => read,
        Err(found) => {
            verdict.extend(found);
            (TrustedKeys::default(), Vec::new())
        }
    };
    match signature::verify(text, &keys) {
        Ok(signature::Verdict::Signed { .. }) => {}
        Ok(signature::Verdict::Unsigned) if !settings.require_signature => {}
        Ok(signature::Verdict::Unsigned) => verdict.push(unplaced(
            Some(name),
            "is not signed, but require_signature is set: sign it (`isotherm sign`) with a key that has its .pub \
             file in the folder of trusted keys"
                .to_owned(),
        )),
        Err(error) => verdict.push(error.problem(Some(name))),
    }
    warnings.extend(doubts);
}

/// Says so where a private key lies among the public ones, under whatever name: whoever may read the folder can sign. One
/// in a `*.pub` is told as a bad key.
fn private_keys(folder: &Path) -> std::io::Result<Vec<Problem>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let public = path.extension().is_some_and(|extension| extension == "pub");
        // Opening a pipe would wait for somebody who writes.
        if public || !std::fs::metadata(&path).is_ok_and(|metadata| metadata.is_file()) {
            continue;
        }
        let bytes = read_bounded(&path).unwrap_or_default();
        if bytes.windows(PRIVATE.len()).any(|window| window == PRIVATE) {
            let message = "is a private key in the folder of trusted keys: anyone who can read it can sign in its \
                           owner's name. Move it to another machine, and make a new key if others could read it";
            found.push(unplaced(Some(&path.display().to_string()), message.to_owned()));
        }
    }
    found.sort_by(|a, b| a.file.cmp(&b.file));
    Ok(found)
}

/// One key and its name, or what is wrong with it.
fn read_key(path: &Path) -> Result<(String, PublicKey), String> {
    let cannot = |error: std::io::Error| format!("cannot be read: {error}");
    // Opening a pipe would wait for somebody who writes.
    if !std::fs::metadata(path).map_err(cannot)?.is_file() {
        return Err("is not a regular file".to_owned());
    }
    let bytes = read_bounded(path).map_err(cannot)?;
    let text =
        text(&bytes, None).map_err(|_| "is not text, so not a PEM key: is it the right file?".to_owned())?;
    let key = PublicKey::from_pem(text).map_err(|error| error.to_string())?;
    let name = path.file_stem().and_then(OsStr::to_str).unwrap_or_default();
    if name.chars().count() > LONGEST_NAME || name.chars().any(char::is_control) || name.is_empty() {
        return Err(format!(
            "has an unprintable name: it is the signer's, so it must be 1 to {LONGEST_NAME} printable characters \
             before `.pub`"
        ));
    }
    Ok((name.to_owned(), key))
}

/// Says so where everybody can change who is trusted.
fn open_to_all(path: &Path) -> Option<Problem> {
    let mode = std::fs::metadata(path).ok()?.permissions().mode() & 0o777;
    (mode & WORLD_WRITABLE != 0).then(|| {
        let file = path.display().to_string();
        let message = format!(
            "decides who is trusted, but everybody may write to it (mode {mode:o}): `chmod o-w {file}`"
        );
        unplaced(Some(&file), message)
    })
}
