//! What is wrong with a signature, and where.

use std::fmt;

use isotherm_document::few;
use thiserror::Error;

use super::key::KeyId;
use crate::document::Problem;

/// Why a signature is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SignatureError {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub wrong: Wrong,
}

impl SignatureError {
    /// The same as a problem of a document; `file` is the name that it is to carry.
    #[must_use]
    pub fn problem(&self, file: Option<&str>) -> Problem {
        let (file, message) = (file.map(Into::into), self.wrong.to_string());
        Problem { file, line: self.line, column: self.column, key: String::new(), message }
    }
}

impl fmt::Display for SignatureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.problem(None).fmt(f)
    }
}

impl std::error::Error for SignatureError {}

/// What is wrong.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Wrong {
    /// The line is not in its form.
    #[error(
        "the signature line {0}; it must be `# isotherm-signature: ed25519 KEY-ID SIGNATURE`: restore the signed \
         text, or sign it again"
    )]
    Form(String),
    /// Something was put at the line's end.
    #[error(
        "the signature line ends with {0}: the text was changed after signing; restore the signed text, or sign it \
         again"
    )]
    End(&'static str),
    /// A signature of another kind.
    #[error("the signature is of kind {0:?}, this release knows \"ed25519\"")]
    Kind(String),
    /// Something stands behind the signature.
    #[error(
        "{what} after the signature of line {signature_line}: the text was changed after signing; restore the signed \
         text, or sign it again"
    )]
    NotLast {
        /// What stands there, with a verb.
        what: &'static str,
        /// Line of the signature.
        signature_line: usize,
    },
    /// There is more than one signature.
    #[error(
        "is a second signature line, the first is line {first_line}: keep one, or sign the document again"
    )]
    Second {
        /// Line of the first.
        first_line: usize,
    },
    /// The key is not trusted.
    #[error("is signed by key {key_id}, which is not trusted here; {}", trusted_words(trusted))]
    UnknownKey {
        /// The key that the signature names.
        key_id: KeyId,
        /// Those that are trusted, with their names.
        trusted: Vec<(KeyId, String)>,
    },
    /// The signature does not hold for the text.
    #[error("the signature of {name} ({key_id}) is wrong: the text was changed after signing{}", damage_words(*damage))]
    Changed {
        /// The key that the signature names.
        key_id: KeyId,
        /// The name under which it is trusted.
        name: String,
        /// What happened to the text, where that can be told.
        damage: Option<Damage>,
    },
    /// The text is to be signed, but has a signature.
    #[error("is already signed, by key {key_id}: keep it, or replace it with `isotherm sign --overwrite`")]
    Signed {
        /// The key that the signature names.
        key_id: KeyId,
    },
}

/// A change that programs make to texts on their way, and that can be undone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Damage {
    /// Line ends became CRLF.
    ToCrlf,
    /// Line ends became LF.
    ToLf,
    /// A byte order mark was put in front.
    ByteOrderMark,
}

fn trusted_words(trusted: &[(KeyId, String)]) -> String {
    if trusted.is_empty() {
        return "no key is trusted: put the signer's .pub file into the folder of trusted keys".to_owned();
    }
    let names = few(trusted.iter().map(|(id, name)| format!("{name} ({id})")));
    let verb = if trusted.len() == 1 { "is" } else { "are" };
    format!(
        "{names} {verb}: put the signer's .pub file into the folder of trusted keys, or have the document \
         signed with a trusted key"
    )
}

fn damage_words(damage: Option<Damage>) -> &'static str {
    match damage {
        Some(Damage::ToCrlf) => ", its line ends were converted to CRLF; convert them back to LF",
        Some(Damage::ToLf) => ", its line ends were converted from CRLF to LF; convert them back",
        Some(Damage::ByteOrderMark) => ", a byte order mark was put in front of it; remove it",
        None => "; restore the signed text, or sign it again",
    }
}
