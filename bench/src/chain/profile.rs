//! Threads of Zenoh that a chain is run with, to find out what they are worth.

use std::str::FromStr;

/// Threads under a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Profile {
    /// What it is called.
    pub(crate) name: String,
    /// Value of the environment variable `ZENOH_RUNTIME`: threads of Zenoh's runtimes, in RON.
    pub(crate) runtime: Option<String>,
}

/// Profiles that have a name.
const KNOWN: [&str; 5] = ["default", "pool-1", "pool-2", "pool-4", "rx-1"];

impl FromStr for Profile {
    type Err = String;

    /// One that has a name, or what the environment variable is to be.
    fn from_str(text: &str) -> Result<Self, String> {
        let shared = "tx: (handover: rx), net: (handover: rx), acc: (handover: rx), app: (handover: rx)";
        let runtime = match text.split_once('-') {
            _ if text.starts_with('(') => Some(text.to_owned()),
            _ if !KNOWN.contains(&text) => {
                return Err(format!("is none of {}, nor (RON)", KNOWN.join(", ")));
            }
            Some(("pool", threads)) => Some(format!("(rx: (worker_threads: {threads}), {shared})")),
            Some((_, threads)) => Some(format!("(rx: (worker_threads: {threads}))")),
            None => None,
        };
        Ok(Self { name: text.to_owned(), runtime })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_known_profile_can_be_asked_for() {
        let runtime = |name| Profile::from_str(name).unwrap().runtime;
        for name in KNOWN {
            assert_eq!(runtime(name).is_none(), name == "default");
        }
        assert_eq!(runtime("rx-1").unwrap(), "(rx: (worker_threads: 1))");
        assert_eq!(runtime("(tx: ())").unwrap(), "(tx: ())");
        assert!(Profile::from_str("nothing").unwrap_err().contains("pool-2"));
    }
}
