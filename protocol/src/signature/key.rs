//! Keys: their files' text, and the names they are known by.

use std::fmt;
use std::str::FromStr;

use ed25519_dalek::pkcs8::spki::der::pem::LineEnding;
use ed25519_dalek::pkcs8::{
    self, DecodePrivateKey, DecodePublicKey, EncodePrivateKey, EncodePublicKey, KeypairBytes, spki,
};
use ed25519_dalek::{Signature, Signer, SigningKey, VerifyingKey};
use serde::{Serialize, Serializer};
use sha2::{Digest, Sha256};
use thiserror::Error;

use crate::digest::{self, Digits};

/// What a key is called in a signature: the first eight bytes of the SHA-256 of the raw public key, written as 16
/// hexadecimal digits in lower case.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct KeyId([u8; 8]);

impl fmt::Display for KeyId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Digits(&self.0).fmt(f)
    }
}

impl fmt::Debug for KeyId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "KeyId({self})")
    }
}

impl FromStr for KeyId {
    type Err = ();

    /// Reads exactly the form that is written.
    fn from_str(text: &str) -> Result<Self, ()> {
        digest::bytes(text).map(Self).filter(|id| id.to_string() == text).ok_or(())
    }
}

impl Serialize for KeyId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What is wrong with the text of a key.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum KeyError {
    /// There is no `-----BEGIN …-----` line.
    #[error("is not PEM text: it has no line `-----BEGIN {expected}-----`")]
    NoPem {
        /// The label that is expected.
        expected: &'static str,
    },
    /// There are several blocks.
    #[error("has {count} PEM blocks, must have one: give each key its own file")]
    Several {
        /// How many.
        count: usize,
    },
    /// The block holds something else.
    #[error("has a block {label:?}, must be {expected:?}: {advice}")]
    Label {
        /// What it says it is.
        label: String,
        /// What it should be.
        expected: &'static str,
        /// What to do.
        advice: &'static str,
    },
    /// A key of another algorithm.
    #[error("is a key of another algorithm, must be Ed25519: make one with `isotherm keygen`")]
    Algorithm,
    /// The block cannot be decoded.
    #[error("is damaged: copy the file again, or make a new pair with `isotherm keygen`")]
    Damaged,
    /// A public key for which signatures of anything can be made up.
    #[error("is a weak public key: anyone can forge its signatures; make a new key with `isotherm keygen`")]
    Weak,
}

/// Label of a private key's PEM block (PKCS#8, RFC 8410).
const PRIVATE: &str = "PRIVATE KEY";
/// Label of a public key's PEM block (`SubjectPublicKeyInfo`, RFC 8410).
const PUBLIC: &str = "PUBLIC KEY";

/// A key that signs. It never shows itself but as PEM text, and its memory is cleared when it is dropped.
pub struct PrivateKey(SigningKey);

impl PrivateKey {
    /// The key that 32 random bytes stand for.
    #[must_use]
    pub fn from_seed(seed: &[u8; 32]) -> Self {
        Self(SigningKey::from_bytes(seed))
    }

    /// Reads a PKCS#8 key in PEM form, with or without the public half in it.
    ///
    /// # Errors
    /// [`KeyError`]: anything but one unencrypted Ed25519 key.
    pub fn from_pem(text: &str) -> Result<Self, KeyError> {
        let pem = block(text, PRIVATE)?;
        SigningKey::from_pkcs8_pem(pem).map(Self).map_err(|error| match error {
            pkcs8::Error::PublicKey(error) => from_spki(&error),
            _ => KeyError::Damaged,
        })
    }

    /// Writes the key as `openssl pkey` reads it.
    ///
    /// # Errors
    /// [`KeyError::Damaged`] where the encoder refuses; it has no reason to.
    pub fn to_pem(&self) -> Result<String, KeyError> {
        // With the public half the block would be of PKCS#8's second version, which OpenSSL 3.0 does not read.
        let key = KeypairBytes { secret_key: self.0.to_bytes(), public_key: None };
        let pem = key.to_pkcs8_pem(LineEnding::LF);
        pem.map(|pem| pem.as_str().to_owned()).map_err(|_| KeyError::Damaged)
    }

    /// Its public half.
    #[must_use]
    pub fn public(&self) -> PublicKey {
        PublicKey(self.0.verifying_key())
    }

    pub(super) fn sign(&self, message: &[u8]) -> [u8; 64] {
        self.0.sign(message).to_bytes()
    }
}

impl fmt::Debug for PrivateKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PrivateKey({})", self.public().id())
    }
}

/// A key that verifies.
#[derive(Clone, PartialEq, Eq)]
pub struct PublicKey(VerifyingKey);

impl PublicKey {
    /// Reads a `SubjectPublicKeyInfo` in PEM form.
    ///
    /// # Errors
    /// [`KeyError`]: anything but one Ed25519 public key that is not weak.
    pub fn from_pem(text: &str) -> Result<Self, KeyError> {
        let pem = block(text, PUBLIC)?;
        let key = VerifyingKey::from_public_key_pem(pem).map_err(|error| from_spki(&error))?;
        if key.is_weak() { Err(KeyError::Weak) } else { Ok(Self(key)) }
    }

    /// Writes the key as `openssl pkey -pubin` reads it.
    ///
    /// # Errors
    /// [`KeyError::Damaged`] where the encoder refuses; it has no reason to.
    pub fn to_pem(&self) -> Result<String, KeyError> {
        self.0.to_public_key_pem(LineEnding::LF).map_err(|_| KeyError::Damaged)
    }

    /// SHA-256 of the 32 raw bytes, as 64 hexadecimal digits: what two people compare over the telephone.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        Digits(&self.digest()).to_string()
    }

    /// The head of the fingerprint.
    #[must_use]
    pub fn id(&self) -> KeyId {
        KeyId(self.digest().first_chunk().copied().unwrap_or_default())
    }

    fn digest(&self) -> [u8; 32] {
        Sha256::digest(self.0.as_bytes()).into()
    }

    /// Whether a signature is this key's for a message, by the strict reading of RFC 8032: no small-order points, no
    /// second form of the same signature.
    pub(super) fn holds(&self, message: &[u8], signature: &[u8; 64]) -> bool {
        self.0.verify_strict(message, &Signature::from_bytes(signature)).is_ok()
    }
}

impl fmt::Debug for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PublicKey({})", self.id())
    }
}

/// The one PEM block of a text, if it says that it is what is expected.
fn block<'t>(text: &'t str, expected: &'static str) -> Result<&'t str, KeyError> {
    const BEGIN: &str = "-----BEGIN ";
    let (_, rest) = text.split_once(BEGIN).ok_or(KeyError::NoPem { expected })?;
    let label = rest.split("-----").next().unwrap_or_default();
    let label: String = label.lines().next().unwrap_or_default().chars().take(40).collect();
    if label != expected {
        let advice = match label.as_str() {
            "PRIVATE KEY" => "this is the secret half: remove it from here and give the .pub file",
            "PUBLIC KEY" => "this is the public half: give the .key file",
            "ENCRYPTED PRIVATE KEY" => "remove the passphrase with `openssl pkey -in … -out …`",
            _ => "make a pair with `isotherm keygen`, or with `openssl genpkey -algorithm ed25519`",
        };
        return Err(KeyError::Label { label, expected, advice });
    }
    match text.matches(BEGIN).count() {
        1 => Ok(text.trim()),
        count => Err(KeyError::Several { count }),
    }
}

fn from_spki(error: &spki::Error) -> KeyError {
    match error {
        spki::Error::OidUnknown { .. } => KeyError::Algorithm,
        _ => KeyError::Damaged,
    }
}
