//! SHA-256 of documents: plain bytes on the wire, hexadecimal digits in JSON, files and on screens.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use thiserror::Error;

/// SHA-256 of a document's bytes; as text 64 hexadecimal digits, lower case.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Digest(#[serde(with = "hex")] pub [u8; 32]);

/// A text is no digest.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{text:?} is not a digest: must be 64 hexadecimal digits")]
pub struct DigestError {
    /// The text.
    pub text: String,
}

impl Digest {
    /// The digest of these bytes.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self(Sha256::digest(bytes).into())
    }

    /// Its first eight bytes, as in [`Revision`](crate::corrected::Revision).
    #[must_use]
    pub fn head(&self) -> [u8; 8] {
        self.0.first_chunk().copied().unwrap_or_default()
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Digits(&self.0).fmt(f)
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Digest({self})")
    }
}

impl FromStr for Digest {
    type Err = DigestError;

    fn from_str(text: &str) -> Result<Self, DigestError> {
        bytes(text).map(Self).ok_or_else(|| DigestError { text: text.chars().take(80).collect() })
    }
}

/// Bytes to be written as hexadecimal digits.
#[derive(Debug, Clone, Copy)]
pub struct Digits<'a>(pub &'a [u8]);

impl fmt::Display for Digits<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Hexadecimal digits as N bytes; `None` for any other text.
pub(crate) fn bytes<const N: usize>(text: &str) -> Option<[u8; N]> {
    let (pairs, []) = text.as_bytes().as_chunks::<2>() else { return None };
    if pairs.len() != N {
        return None;
    }
    let digit = |digit: u8| char::from(digit).to_digit(16).and_then(|value| u8::try_from(value).ok());
    let mut bytes = [0; N];
    for (byte, [high, low]) in bytes.iter_mut().zip(pairs) {
        *byte = digit(*high)? << 4 | digit(*low)?;
    }
    Some(bytes)
}

/// Serde form of bytes that are a digest or the head of one: digits where people read, else N plain bytes.
pub(crate) mod hex {
    use serde::de::{Error, Unexpected};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{Digits, bytes};

    pub(crate) fn serialize<S, const N: usize>(bytes: &[u8; N], serializer: S) -> Result<S::Ok, S::Error>
    where
        S: Serializer,
        [u8; N]: Serialize,
    {
        if serializer.is_human_readable() {
            serializer.collect_str(&Digits(bytes))
        } else {
            bytes.serialize(serializer)
        }
    }

    pub(crate) fn deserialize<'de, D, const N: usize>(deserializer: D) -> Result<[u8; N], D::Error>
    where
        D: Deserializer<'de>,
        [u8; N]: Deserialize<'de>,
    {
        if !deserializer.is_human_readable() {
            return Deserialize::deserialize(deserializer);
        }
        let text = String::deserialize(deserializer)?;
        let must_be = format!("{} hexadecimal digits", 2 * N);
        bytes(&text).ok_or_else(|| D::Error::invalid_value(Unexpected::Str(&text), &must_be.as_str()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_is_digits_for_people_and_bytes_on_the_wire() {
        let mut digest = Digest([0xa5; 32]);
        digest.0[0] = 0x0f;
        let json = serde_json::to_string(&digest).unwrap();
        assert_eq!(json, format!("\"0f{}\"", "a5".repeat(31)));
        assert_eq!(serde_json::from_str::<Digest>(&json).unwrap(), digest);
        assert_eq!(postcard::to_allocvec(&digest).unwrap(), digest.0);
        assert_eq!(postcard::from_bytes::<Digest>(&digest.0).unwrap(), digest);
        assert_eq!(digest.to_string().parse(), Ok(digest));
        assert_eq!(digest.head(), [0x0f, 0xa5, 0xa5, 0xa5, 0xa5, 0xa5, 0xa5, 0xa5]);
    }

    #[test]
    fn what_is_no_digest_is_refused() {
        let short = "0".repeat(63);
        for digits in ["", "xyz", &short, &format!("{short}g"), &format!("{short}00"), &"é".repeat(32)] {
            assert_eq!(digits.parse::<Digest>(), Err(DigestError { text: digits.to_owned() }));
            assert!(serde_json::from_str::<Digest>(&format!("\"{digits}\"")).is_err(), "{digits}");
        }
        assert!(postcard::from_bytes::<Digest>(&[0; 31]).is_err());
    }
}
