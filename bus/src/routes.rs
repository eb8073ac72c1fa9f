//! Keys whose routes Zenoh is to remember.

use zenoh::key_expr::KeyExpr;
use zenoh::{Session, Wait};

/// Keys that are declared for as long as this is kept.
///
/// Zenoh remembers the route to a declared key. For one that comes, or is put, as text it looks for the subscribers anew with every
/// message, among all keys that it has heard of: those of other units, and their liveliness tokens. With hundreds of units that takes
/// longer than anything else that is done with a message.
#[derive(Debug, Default)]
pub struct DeclaredKeys(Vec<KeyExpr<'static>>);

impl DeclaredKeys {
    /// Declares keys, all of them or none.
    ///
    /// # Errors
    /// Zenoh's own, where the session is closed or a key is none.
    pub fn declare(session: &Session, keys: impl IntoIterator<Item = String>) -> Result<Self, zenoh::Error> {
        let keys = keys.into_iter().map(|key| session.declare_keyexpr(key).wait());
        keys.collect::<Result<_, _>>().map(Self)
    }

    /// Declares one more.
    ///
    /// # Errors
    /// As [`DeclaredKeys::declare`].
    pub fn add(&mut self, session: &Session, key: String) -> Result<(), zenoh::Error> {
        self.0.push(session.declare_keyexpr(key).wait()?);
        Ok(())
    }
}
