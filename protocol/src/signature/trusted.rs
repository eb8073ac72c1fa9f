//! The keys whose signatures count.

use std::collections::BTreeMap;

use thiserror::Error;

use super::key::{KeyId, PublicKey};

/// Public keys by id, each with the name under which it is trusted.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TrustedKeys {
    by_id: BTreeMap<KeyId, (String, PublicKey)>,
}

/// A key that would make it unclear who signed.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RivalKey {
    /// The key is trusted already.
    #[error("is the same key as {other} ({key_id}): remove one of them")]
    SameKey {
        /// The key.
        key_id: KeyId,
        /// The name that it has already.
        other: String,
    },
    /// Another key has the same id.
    #[error("is another key than {other}, with the same id {key_id}: make a new one")]
    SameId {
        /// Their id.
        key_id: KeyId,
        /// The name of the one that was first.
        other: String,
    },
}

impl TrustedKeys {
    /// Trusts a key under a name.
    ///
    /// # Errors
    /// [`RivalKey`]: a key that is there already, under whatever name.
    pub fn insert(&mut self, name: &str, key: PublicKey) -> Result<(), RivalKey> {
        let key_id = key.id();
        match self.by_id.get(&key_id) {
            Some((other, present)) if *present == key => {
                Err(RivalKey::SameKey { key_id, other: other.clone() })
            }
            Some((other, _)) => Err(RivalKey::SameId { key_id, other: other.clone() }),
            None => {
                self.by_id.insert(key_id, (name.to_owned(), key));
                Ok(())
            }
        }
    }

    /// The key of an id, and its name.
    #[must_use]
    pub fn get(&self, key_id: KeyId) -> Option<(&str, &PublicKey)> {
        self.by_id.get(&key_id).map(|(name, key)| (name.as_str(), key))
    }

    /// Every key with its name, in the order of the ids.
    pub fn iter(&self) -> impl Iterator<Item = (KeyId, &str, &PublicKey)> {
        self.by_id.iter().map(|(id, (name, key))| (*id, name.as_str(), key))
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.by_id.len()
    }

    /// Whether no key is trusted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.by_id.is_empty()
    }
}
