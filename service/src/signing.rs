//! Keys and signed calibration documents as files: the commands `keygen` and `sign`, and the folder of trusted keys.
//!
//! What is signed, and what makes a signature hold, is [`isotherm_protocol::signature`]. Here are the files, the random
//! numbers of a new key, and the words for the operator. The service itself only ever reads public keys.

mod keygen;
mod private_key;
mod sign;
mod trusted;

pub use keygen::KeygenArgs;
pub use sign::SignArgs;
pub use trusted::read_trusted_keys;

pub use keygen::run as keygen;
pub use sign::run as sign;
pub(crate) use trusted::{check_signature, doubts};
