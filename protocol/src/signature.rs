//! Signed calibration documents: who signed a text, and whether it is still the text that was signed.
//!
//! A signature is one more line at the end of the document, a comment to TOML, so that it goes wherever the text goes: in
//! a file, in a message, in an e-mail.
//!
//! ```text
//! # isotherm-signature: ed25519 <key id> <base64 of the 64 bytes of the signature>
//! ```
//!
//! It covers every byte before that line. What Ed25519 (RFC 8032) signs is [`DOMAIN`] and then those bytes, so that a
//! signature made for something else never holds for a document. Nothing may stand behind the line but its own line
//! break, and there is one such line or none. `docs/adr/0016-signatures.md` says why.
//!
//! ```
//! use isotherm_protocol::signature::{Existing, PrivateKey, TrustedKeys, Verdict, sign, verify};
//!
//! let key = PrivateKey::from_seed(&[7; 32]);
//! let signed = sign("schema = 1\n", &key, Existing::Refuse).unwrap();
//!
//! let mut trusted = TrustedKeys::default();
//! trusted.insert("bench-2", key.public()).unwrap();
//! let Ok(Verdict::Signed { name, .. }) = verify(&signed, &trusted) else { panic!() };
//! assert_eq!(name, "bench-2");
//! assert!(verify(&signed.replace("1", "2"), &trusted).is_err());
//! assert_eq!(verify("schema = 1\n", &trusted), Ok(Verdict::Unsigned));
//! ```

mod error;
mod key;
mod line;
#[cfg(test)]
mod tests;
mod trusted;

pub use error::{Damage, SignatureError, Wrong};
pub use key::{KeyError, KeyId, PrivateKey, PublicKey};
pub use line::Signature;
pub use trusted::{RivalKey, TrustedKeys};

/// What stands before the text in the bytes that are signed.
pub const DOMAIN: &[u8] = b"isotherm calibration document v1\n";

/// What a text's signature says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// There is no signature.
    Unsigned,
    /// Signed by a trusted key, and unchanged since.
    Signed {
        /// The key.
        key_id: KeyId,
        /// The name under which it is trusted.
        name: String,
    },
}

/// What [`sign`] does with a signature that is there already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Leave the text alone and say so.
    Refuse,
    /// Take it off, whether it holds or not.
    Replace,
}

/// The signature of a text, not yet verified.
///
/// # Errors
/// A signature line that is not in its form, not the last one, or not the only one.
pub fn find(text: &str) -> Result<Option<Signature<'_>>, SignatureError> {
    Signature::find(text)
}

/// Says who signed a text.
///
/// # Errors
/// Everything that [`find`] refuses; a key that is not trusted; a signature that does not hold.
pub fn verify(text: &str, trusted: &TrustedKeys) -> Result<Verdict, SignatureError> {
    let Some(signature) = find(text)? else { return Ok(Verdict::Unsigned) };
    let key_id = signature.key_id();
    let Some((name, key)) = trusted.get(key_id) else {
        let trusted = trusted.iter().map(|(id, name, _)| (id, name.to_owned())).collect();
        return Err(signature.wrong(Wrong::UnknownKey { key_id, trusted }));
    };
    let name = name.to_owned();
    if signature.holds(key) {
        Ok(Verdict::Signed { key_id, name })
    } else {
        let damage = signature.damage(key);
        Err(signature.wrong(Wrong::Changed { key_id, name, damage }))
    }
}

/// The text with a signature behind it; a text that does not end with a line break is given one first.
///
/// Ed25519 draws no random number: the same text and key give the same signature.
///
/// # Errors
/// With [`Existing::Refuse`], a text that is signed already, or has what [`find`] refuses.
pub fn sign(text: &str, key: &PrivateKey, existing: Existing) -> Result<String, SignatureError> {
    let mut signed = match existing {
        Existing::Refuse => {
            if let Some(signature) = find(text)? {
                return Err(signature.wrong(Wrong::Signed { key_id: signature.key_id() }));
            }
            text.to_owned()
        }
        // Signature lines in the middle, left there by an edit below them, have to go too: the text could not be verified
        // with them.
        Existing::Replace => line::other_lines(text).collect(),
    };
    if !signed.is_empty() && !signed.ends_with('\n') {
        signed.push('\n');
    }
    let line = line::write(key.public().id(), &key.sign(&message(&signed)));
    signed.push_str(&line);
    Ok(signed)
}

/// The bytes that are signed.
fn message(covered: &str) -> Vec<u8> {
    [DOMAIN, covered.as_bytes()].concat()
}
