//! Who signed a calibration document.

use isotherm_protocol::signature::{KeyId, SignatureError, TrustedKeys, Verdict, find, verify};
use serde::Serialize;
use thiserror::Error;

/// What is known of who signed a document.
#[derive(Debug, Clone, PartialEq, Eq, Error, Serialize)]
#[serde(tag = "state", rename_all = "lowercase")]
pub enum Signer {
    /// Nobody did.
    #[error("unsigned")]
    Unsigned,
    /// It has a signature, and no trusted keys were given to verify it with.
    #[error("signed by key {key_id}, not verified (needs --trusted-keys)")]
    Unverified {
        /// The key that the signature names.
        key_id: KeyId,
    },
    /// A trusted key did, and the document is unchanged.
    #[error("signed by {name} ({key_id})")]
    Signed {
        /// The key.
        key_id: KeyId,
        /// The name under which it is trusted.
        name: String,
    },
}

/// Who signed a document; nothing is said of one without a signature where no keys were given.
///
/// # Errors
/// A signature that does not hold, or is not in its form.
pub(super) fn signer(text: &str, trusted: Option<&TrustedKeys>) -> Result<Option<Signer>, SignatureError> {
    let Some(trusted) = trusted else {
        let found = find(text)?;
        return Ok(found.map(|signature| Signer::Unverified { key_id: signature.key_id() }));
    };
    verify(text, trusted).map(|verdict| {
        Some(match verdict {
            Verdict::Unsigned => Signer::Unsigned,
            Verdict::Signed { key_id, name } => Signer::Signed { key_id, name },
        })
    })
}
